"""What the audit allows for contacts that turn: pieces beside each other in time, and no more than they tell."""

from dataclasses import replace

import numpy as np
import pytest

from reference_solver import Body, HalfSpace, Model, Settings, Simulation, Sphere
from reference_solver.certificate.audit import audit
from reference_solver.certificate.audit.run import Run
from reference_solver.certificate.audit.turning import UNKNOWN_CHANGE, _largest_turn, changes_of_force, turns_beside
from reference_solver.pieces import FORCES, TURNING, Pieces
from tests.verification import self_test
from tests.verification.known import gates

UPRIGHT = (1.0, 0.0, 0.0, 0.0)
H = 1.0 / 240.0


def run_of(lengths, forces=None, begin=None, contacts=1, twist=(0.0,) * 6):
    """Pieces of a ball on a floor: lengths [s], mean forces [N]; one after the other, or as they begin [s]."""
    lengths = np.asarray(lengths, dtype=float)
    begin = np.concatenate([[0.0], np.cumsum(lengths)[:-1]]) if begin is None else np.asarray(begin, dtype=float)
    p, c = len(lengths), len(lengths) * contacts
    forces = np.tile([0.0, 0.0, 1.0], (p, 1)) if forces is None else np.asarray(forces, dtype=float)
    impulse = np.repeat(forces * lengths[:, None], contacts, axis=0) / contacts
    pose, normal = np.tile([0.0, 0.0, 0.5, *UPRIGHT], (p, 1)), np.tile([0.0, 0.0, 1.0], (c, 1))
    pieces = Pieces(
        step=np.arange(p), begin=begin, length=lengths,
        kind=np.full(p, FORCES), scheme=np.full(p, TURNING),
        first_body=np.arange(p + 1), first_contact=contacts * np.arange(p + 1),
        body=np.ones(p, np.int64), pose_before=pose, twist_before=np.tile(twist, (p, 1)), pose_after=pose,
        twist_after=np.tile(twist, (p, 1)), body_a=np.zeros(c, np.int64), body_b=np.ones(c, np.int64),
        feature=np.zeros(c, np.int64), point=np.zeros((c, 3)), normal=normal, impulse=impulse,
        moment=np.zeros((c, 3)),
    )  # fmt: skip
    floor = Body(HalfSpace((0.0, 0.0, 1.0)), pose=(0.0, 0.0, 0.0, *UPRIGHT), motion="fixed")
    ball = Body(Sphere(0.5), 1.0, (0.1,) * 3, (0.0, 0.0, 0.5, *UPRIGHT))
    return Run(Model(3, [floor, ball], (0.0, 0.0, -9.81), 0.0, 0.5), pieces, H)


class TestTurnsBeside:
    """A slip that turns back within a piece has both its ends alike: the slower of its neighbours tells how far."""

    @pytest.mark.parametrize(
        ("turned", "found"),
        [
            ((0.1, 0.0, 0.3), 0.2),  # the slower of both, for twice as long
            ((0.3, 0.0, 0.1), 0.2),
            ((0.1, 0.7, 0.3), 0.7),  # what it turns by itself is more
            ((0.1, 0.0, 1.5), 0.0),  # no turn that its ends could tell
            ((0.0, 0.0, 0.3), 0.0),  # one neighbour alone says nothing
        ],
    )
    def test_slower_neighbour_for_the_time_of_the_piece(self, turned, found):
        beside = turns_beside(run_of([H, 2.0 * H, H]), np.array(turned))
        assert beside == pytest.approx([turned[0], found, turned[2]], abs=1e-12)

    @pytest.mark.parametrize("late", [1e-9 * H, 0.5 * H])
    def test_neighbours_of_pieces_that_do_not_follow(self, late):
        run = run_of([H, 2.0 * H, H], begin=[0.0, H, 3.0 * H + late])
        assert turns_beside(run, np.array([0.1, 0.0, 0.3])) == pytest.approx([0.1, 0.0, 0.3])

    def test_neighbours_far_from_the_start_but_for_round_off(self):
        begin = 1e4 + np.array([0.0, H, 3.0 * H])  # a unit in the last place of it is 4e-10 of a step
        run = run_of([H, 2.0 * H, H], begin=begin)
        assert turns_beside(run, np.array([0.1, 0.0, 0.3]))[1] == pytest.approx(0.2)

    def test_points_of_one_pair(self):
        turned = np.repeat([0.1, 0.0, 0.3], 2)
        assert turns_beside(run_of([H, 2.0 * H, H], contacts=2), turned) == pytest.approx(turned, abs=0.0)


def test_turn_of_a_normal_beyond_spins_and_passing():
    """3 rad/s, and 2 m/s past a corner at the ball's own radius of .5 m: 7 rad/s."""
    run = run_of([H, 2.0 * H], twist=(2.0, 0.0, 0.0, 0.0, 0.0, 3.0))
    assert _largest_turn(run, np.arange(2)) == pytest.approx([7.0 * H, 14.0 * H], abs=1e-11)


class TestChangesOfForce:
    def test_twice_the_faster_of_both_neighbours(self):
        """2, 2.02, 2.1 N over 1, 2 and 1 steps: .02 and .08 N in 1.5 steps, .08/1.5 a step of 2.02 N."""
        forces = np.array([[0.0, 0.0, f] for f in (2.0, 2.02, 2.1)])
        found = changes_of_force(run_of([H, 2.0 * H, H], forces))
        assert found == pytest.approx([UNKNOWN_CHANGE, 2.0 * 2.0 * (0.08 / 1.5) / 2.02, UNKNOWN_CHANGE], rel=1e-12)

    def test_a_force_that_turns_changes(self):
        forces = [(0.0, 0.0, 1.0), (0.6, 0.0, 0.8), (0.6, 0.0, 0.8)]
        found = changes_of_force(run_of([H, H, H], forces))
        assert found[1] == pytest.approx(2.0 * np.hypot(0.6, 0.2), rel=1e-12)

    def test_neighbour_that_begins_later(self):
        run = run_of([H, H, H], begin=[0.0, H, 2.5 * H])
        assert changes_of_force(run) == pytest.approx([UNKNOWN_CHANGE] * 3)


#: Sizes up to which no check sees a corruption of the self-test, and X contains it; all larger ones are seen, and all
#: others.
NOT_SEEN = {
    "friction of a slide over a hill": 1e-6,
    "friction where there is none, over a hill": 1e-6,
    "moment and spin over a hill": 1e-6,
    "inertia in space": 1e-7,
}


def test_corruptions_of_a_ten_millionth():
    """What a check lets pass is no more than what it has to: ten times as much is seen here."""
    missed = {}
    for trial in self_test.trials((1e-7, 1e-6, 1e-5)):
        if trial.seen == self_test.IN_X:
            missed[trial.corruption.name] = max(trial.size, missed.get(trial.corruption.name, 0.0))
    assert missed == NOT_SEEN


HILL = self_test.SCENES["disc that slides off a disc"]


def test_moment_off_its_point_over_a_hill():
    """Its point goes .003 m in a piece, and its force changes by a hundredth: 1e-4 of the moment are not told."""
    spun = next(each for each in self_test.CORRUPTIONS if each.name == "moment and spin over a hill")
    assert "moment" in self_test.seen_by(*spun.plant(HILL, 2e-4))


@pytest.mark.parametrize("share", [1e-3, 1e-2, 0.5])
def test_friction_over_a_hill_that_is_too_weak(share):
    """It slips all the way: where normals turn, too, all of mu p_n is against it."""
    weaker = self_test.given(lambda model, size: replace(model, friction=model.friction * (1.0 - size)))
    assert "friction" in self_test.seen_by(*weaker(HILL, share))


@pytest.fixture(scope="module", params=["ball slipping along a groove", "ball spinning in a corner"])
def slipping(request):
    """A ball whose slips on all planes turn, its record, and the sines (c,) by which they do within their pieces."""
    motion = gates.MOTIONS[request.param](np.random.default_rng(0))
    dt = motion.time / 60
    record = Simulation(motion.model, Settings.reference(dt)).record(60, pieces=True)
    pieces, lever = record.pieces, -motion.model.bodies[-1].shape.radius * record.pieces.normal
    owner = np.repeat(np.arange(len(pieces)), np.diff(pieces.first_contact))
    row = pieces.first_body[owner + 1] - 1  # the ball is the last of each piece
    ends = [x[row, :3] + np.cross(x[row, 3:], lever) for x in (pieces.twist_before, pieces.twist_after)]
    across = np.linalg.norm(np.cross(*ends), axis=1)
    return motion.model, record, dt, across / np.linalg.norm(ends[0], axis=1) / np.linalg.norm(ends[1], axis=1)


def refused(model, record, dt, **fields):
    changed = replace(record, pieces=replace(record.pieces, **fields))
    return {finding.name for finding in audit(model, changed, dt) if not finding.holds}


class TestFrictionOfSlipsThatTurn:
    """In a phase it is a mean of directions: off by no more than what the slip turns there, and never too strong."""

    def parts(self, slipping):
        pieces = slipping[1].pieces
        contact = len(pieces.body_a) // 2
        n, impulse = pieces.normal[contact], pieces.impulse.copy()
        pressed = impulse[contact] @ n
        return contact, n, pressed, impulse[contact] - pressed * n, impulse

    def test_as_it_is_it_obeys(self, slipping):
        assert refused(*slipping[:3]) == set()

    @pytest.mark.parametrize("sign", [-1.0, 1.0])
    def test_friction_off_its_slip_by_twice_what_that_turns(self, slipping, sign):
        contact, n, pressed, along, impulse = self.parts(slipping)
        off = 2.0 * sign * slipping[3][contact]
        assert 1e-4 < abs(off) < 0.1
        impulse[contact] = pressed * n + np.cos(off) * along + np.sin(off) * np.cross(n, along)
        assert "friction" in refused(*slipping[:3], impulse=impulse)

    @pytest.mark.parametrize("more", [1e-5, 2e-2])
    def test_friction_too_strong_or_too_weak(self, slipping, more):
        """On a plane nothing is unknown but what stages leave, 1e-8, and by how much a mean of directions is shorter.

        That is a 24th of the square of the turn, of what is too strong; and the turn itself, of what is too weak.
        """
        contact, n, pressed, along, impulse = self.parts(slipping)
        for sign, name in ((1.0, "cone"), (-1.0, "friction")):
            impulse[contact] = pressed * n + (1.0 + sign * more) * along
            if name == "cone" or more > 2.0 * slipping[3][contact]:
                assert name in refused(*slipping[:3], impulse=impulse), name

    def test_friction_of_a_contact_that_is_not_pressed(self, slipping):
        """Of a ten-thousand-millionth of its speed: what round-off of a phase leaves is a tenth of that."""
        model, record, dt, _ = slipping
        contact, _, _, along, impulse = self.parts(slipping)
        ball = model.bodies[-1]
        speed = ball.shape.radius * np.linalg.norm(record.twist[:, -1, 3:], axis=1).min()
        impulse[contact] = 1e-10 * ball.mass * speed * along / np.linalg.norm(along)
        assert "cone" in refused(model, record, dt, impulse=impulse)
