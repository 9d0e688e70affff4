"""The audit passes what is right, refuses what is wrong, and shares nothing with the solver."""

import ast
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import reference_solver.certificate.audit as package
from reference_solver import Body, Box, Capsule, Disc, HalfSpace, Model, Settings, Simulation, Sphere, geometry
from reference_solver.certificate.audit import CHECKS, audit, ends_of_series
from reference_solver.certificate.audit.contact import reduced_mass, speeds
from reference_solver.certificate.audit.motion import integrated_turn
from reference_solver.certificate.audit.run import Run
from reference_solver.certificate.truth import certify, distance
from reference_solver.geometry import rotation
from tests.verification import self_test
from tests.verification.fuzz.scenes import STRIDE, scene

DT, G = 1.0 / 240.0, 9.81
UPRIGHT = (1.0, 0.0, 0.0, 0.0)


def floor(dimension=2, **fields):
    if dimension == 2:
        return Body(HalfSpace((0.0, 1.0)), **({"motion": "fixed"} | fields))
    return Body(HalfSpace((0.0, 0.0, 1.0)), pose=(0.0, 0.0, 0.0, *UPRIGHT), motion="fixed")


def disc(x, y, *twist):
    return Body(Disc(0.5), 1.0, 0.125, (x, y, 0.0), twist or None)


def planar(*bodies, restitution=0.0, friction=0.5):
    return Model(2, bodies, (0.0, -G), restitution, friction)


def refused(model, steps, dt=DT):
    record = Simulation(model, Settings.reference(dt)).record(steps, pieces=True)
    return {finding.name for finding in audit(model, record, dt) if not finding.holds}


def test_it_imports_no_solver():
    """What certifies shares the model, the record's form, its own geometry and the oracle's least squares only."""
    folder = Path(package.__file__).parent
    allowed = ("certificate", "exact_contact", "geometry", "model", "pieces", "records", "shapes")
    for path in [*folder.glob("*.py"), Path(geometry.__file__)]:
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ImportFrom) and node.module.startswith("reference_solver"):
                assert node.module.split(".")[1] in allowed, (path, node.module)


@pytest.mark.parametrize("name", self_test.SCENES)
def test_what_is_right_is_certified(name):
    assert self_test.seen_by(*self_test.run(self_test.SCENES[name])) == ()


def test_number_and_families_of_corruptions():
    families = [corruption.family for corruption in self_test.CORRUPTIONS]
    assert len(families) >= 40
    assert set(families) == {"law", "input", "detection", "events", "motion", "bookkeeping"}
    assert len({(c.family, c.name, c.scene) for c in self_test.CORRUPTIONS}) == len(families)


@pytest.mark.parametrize("part", range(7))
def test_corruptions_are_caught(part):
    """A seventh of them; `make certify ARGS="--self-test"` plants them all, at all sizes."""
    for trial in self_test.trials((self_test.JUDGED,), part, 7):
        assert trial.seen, trial.corruption.name


def test_every_check_can_fail():
    """No check is idle: each is the one that sees some corruption, or has its scene here."""
    seen = set()
    for trial in self_test.trials((1e-2,)):
        seen |= set(trial.seen)
    own = {"finite", "pull", "scale", "unknown", "resolution", "start", "choice", "shared"}
    assert set(CHECKS) - own <= seen, set(CHECKS) - own - seen


class TestWhatWasCertifiedOnce:
    def test_disc_under_a_falling_ceiling(self):
        """No motion obeys all laws."""
        ceiling = Body(HalfSpace((0.0, -1.0)), pose=(0.0, 1.2, 0.0), twist=(0.0, -0.3, 0.0), motion="prescribed")
        certificate = certify(planar(floor(), ceiling, disc(0.0, 0.5)), Settings.reference(DT), 200)
        assert not certificate.holds
        assert any("crushed" in reason for reason in certificate.reasons), certificate.reasons

    def test_a_start_in_the_floor(self):
        certificate = certify(planar(floor(), disc(0.0, 0.3)), Settings.reference(DT), 10)
        assert not certificate.holds and "bodies 0 and 1 overlap" in certificate.reasons[0]

    def test_an_overlap_of_a_tenth_of_a_body(self):
        assert "start" in refused(planar(floor(), disc(0.0, 0.5), disc(0.9, 0.5)), 10)

    @pytest.mark.parametrize("far", [1e10, 1e15])
    def test_bodies_at_coordinates_that_resolve_no_place(self, far):
        assert "resolution" in refused(planar(floor(), disc(far, 0.5, 1.0, 0.0, 0.0)), 10)

    def test_a_ball_that_passes_a_wall(self):
        """The wall is known to the certificate only: every other body is where the solver has it."""
        wall = Body(Box((0.01, 2.0)), pose=(2.0, 1.0, 0.0), motion="fixed")
        model = planar(floor(), disc(0.0, 0.5, 50.0, 0.0, 0.0), friction=0.0)
        record = Simulation(model, Settings.reference(DT)).record(30, pieces=True)
        walled = planar(*model.bodies, wall, friction=0.0)
        sample = np.repeat([[wall.pose]], len(record.pose), axis=0)
        record = replace(record, pose=np.concatenate([record.pose, sample], axis=1))
        found = {finding.name for finding in audit(walled, record, DT) if not finding.holds}
        assert found == {"overlap"}


class TestRecords:
    """Faults of the record that no run of ours makes."""

    @pytest.fixture
    def sliding(self):
        model = planar(floor(), Body(Box((0.5, 0.5)), 1.0, 1 / 6, (0.0, 0.5, 0.0), (2.0, 0.0, 0.0)))
        return model, Simulation(model, Settings.reference(DT)).record(10, pieces=True)

    def broken(self, sliding, **fields):
        model, record = sliding
        changed = replace(record, pieces=replace(record.pieces, **fields))
        return {finding.name for finding in audit(model, changed, DT) if not finding.holds}

    def test_none(self, sliding):
        assert self.broken(sliding) == set()

    def test_no_number(self, sliding):
        impulse = sliding[1].pieces.impulse.copy()
        impulse[3, 0] = math.nan
        assert "finite" in self.broken(sliding, impulse=impulse)

    def test_a_pull(self, sliding):
        assert "pull" in self.broken(sliding, impulse=-sliding[1].pieces.impulse)

    @pytest.mark.parametrize(("units", "pulls"), [(2.0, False), (1e5, True)])
    def test_pull_within_round_off_of_a_larger_impulse_beside_it(self, sliding, units, pulls):
        impulse = sliding[1].pieces.impulse.copy()
        impulse[0, 1] = -units * np.spacing(impulse[1, 1])  # the first two contacts are those of one piece
        assert sliding[1].pieces.first_contact[1] == 2 and impulse[1, 1] > 0.0
        assert ("pull" in self.broken(sliding, impulse=impulse)) is pulls

    def test_contact_on_a_body_outside_its_piece(self, sliding):
        body = sliding[1].pieces.body.copy()
        body[1] = 0
        assert "unknown" in self.broken(sliding, body=body)

    def test_an_impulse_beyond_any_scale(self, sliding):
        assert "scale" in self.broken(sliding, impulse=1e9 * sliding[1].pieces.impulse)

    def test_no_pieces(self, sliding):
        with pytest.raises(ValueError, match="pieces"):
            audit(sliding[0], replace(sliding[1], pieces=None), DT)


def test_integral_of_a_turn():
    """About a principal axis it is known; and energy and the body's angular momentum are kept elsewhere."""
    moments = np.array([[1.0, 2.0, 3.0]])
    spin, length = 5.0, np.array([0.06])
    start = np.array([UPRIGHT])
    momentum = np.array([[0.0, 0.0, 3.0 * spin]])
    q, way = integrated_turn(start, momentum, momentum, moments, length)
    half = 0.5 * spin * length[0]
    assert q[0] == pytest.approx([math.cos(half), 0.0, 0.0, math.sin(half)], abs=1e-15)
    assert way[0] == pytest.approx([0.0, 0.0, 2.0 * half], abs=1e-15)


@pytest.mark.parametrize("turn", [0.01, 0.5, 20.0])
def test_integral_of_a_turn_of_any_length(turn):
    """Of a rod under an even torque, against DOP853 with steps of its own; and rows do not see each other."""
    random = np.random.default_rng(5)
    moments, q = np.array([[0.01, 1.0, 1.2]]), random.normal(size=(1, 4))
    q /= np.linalg.norm(q)
    before = 0.01 * turn * np.array([[0.6, -0.64, 0.48]])
    after = before + 0.003 * turn * np.array([[0.0, 1.0, -0.5]])

    def rate(t, y):
        axes = rotation(np.concatenate([np.zeros(3), y[:4]]))
        w = axes @ (axes.T @ (before + t / 0.7 * (after - before))[0] / moments[0])
        return np.concatenate([[-0.5 * w @ y[1:4]], 0.5 * (y[0] * w + np.cross(w, y[1:4])), w])

    start = np.concatenate([q[0], np.zeros(3)])
    truth = solve_ivp(rate, (0.0, 0.7), start, method="DOP853", rtol=1e-13, atol=1e-15).y[:, -1]
    many = [np.repeat(x, 3, axis=0) for x in (q, before, after, moments)]
    many[1][1], many[2][1] = 0.0, 0.0
    turned, ways = integrated_turn(*many, np.full(3, 0.7))
    for row in (0, 2):
        assert np.concatenate([turned[row], ways[row]]) == pytest.approx(truth, abs=2e-12 * max(turn, 1.0))
    assert turned[1] == pytest.approx(q[0], abs=1e-15) and ways[1] == pytest.approx(np.zeros(3), abs=0.0)


def test_edge_along_which_corners_close_last():
    """Two edges tie where corners meet, and the gap along either is none; the other one stops more than it may."""
    turn = 0.25 * math.pi
    bodies = [
        Body(Box((0.5, 0.5)), 1.0, 1 / 6, (0.0, 0.0, turn), (1.0, -0.4, 0.0)),
        Body(Box((0.5, 0.5)), 1.0, 1 / 6, (math.sqrt(2.0) + 0.1, -0.04, turn)),
    ]
    model = Model(2, bodies, (0.0, 0.0), 0.0, 0.0)
    record = Simulation(model, Settings.reference(DT)).record(30, pieces=True)
    other = replace(record.pieces, normal=record.pieces.normal * [1.0, -1.0])
    seen = [{f.name for f in audit(model, r, DT) if not f.holds} for r in (record, replace(record, pieces=other))]
    assert "choice" not in seen[0] and "choice" in seen[1]


def test_turn_of_a_ball_that_spins_fast():
    """A radian and more a step, of unequal moments: integrated in more steps, not refused for the integration."""
    ball = Body(Sphere(0.3), 1.0, (0.03, 0.035, 0.04), (0.0, 0.0, 5.0, *UPRIGHT), (0.0, 0.0, 0.0, 30.0, 20.0, 25.0))
    assert refused(Model(3, [floor(3), ball], (0.0, 0.0, -G), 0.0, 0.0), 10, 1.0 / 30.0) == set()


def test_turns_of_bodies_that_touch():
    """A disc has no corner by which its geometry would tell of its angle."""
    name = "angle of what touches [rad]"
    corruption = next(each for each in self_test.CORRUPTIONS if each.name == name)
    assert "turn" in self_test.seen_by(*corruption.plant(self_test.SCENES[corruption.scene], 1e-6))


@pytest.mark.parametrize("turn", [1e-8, 1e-6, 1e-4])
def test_discs_have_one_normal(turn):
    """Along another they are nearly as far apart, by the square of the turn: the normal itself is looked at."""
    model = planar(disc(0.0, 0.0, 1.0, 0.0, 0.0), disc(1.05, 0.3), friction=0.0)
    record = Simulation(model, Settings.reference(DT)).record(40, pieces=True)
    n = record.pieces.normal
    other = replace(record.pieces, normal=n + turn * np.stack([-n[:, 1], n[:, 0]], axis=1))
    seen = [{f.name for f in audit(model, r, DT) if not f.holds} for r in (record, replace(record, pieces=other))]
    assert len(n) and seen[0] == set() and "direction" in seen[1]


class TestTruth:
    def test_error_of_an_exact_run(self):
        certificate = certify(planar(floor(), disc(0.0, 1.5), restitution=0.8), Settings.reference(DT), 240)
        assert certificate.holds and certificate.reasons == ()
        assert certificate.error[-1] < 2e-12  # solves leave 1e-13 of 5 m/s, which grows up to fourfold in a second
        assert certificate.error_until(0.5) <= certificate.error[-1]
        assert certificate.horizon == math.inf and certificate.growth[-1] < 10.0
        assert "holds=True" in repr(certificate) and "\n" not in repr(certificate), "no arrays"

    def test_certificate_beyond_the_horizon(self):
        """A ball in the room between four discs that touch: each bounce spreads a disturbance about twofold."""
        posts = [Body(Disc(1.0), pose=(x, y, 0.0), motion="fixed") for x in (-1.0, 1.0) for y in (-1.0, 1.0)]
        ball = Body(Disc(0.1), 1.0, 0.005, (0.05, 0.02, 0.0), (4.0, 3.0, 0.0))
        certificate = certify(Model(2, [*posts, ball], (0.0, 0.0), 1.0, 0.0), Settings.reference(DT), 480)
        assert certificate.holds and 0.5 < certificate.horizon < 2.0
        assert "only laws" in certificate.reasons[-1]
        assert certificate.error_until(certificate.horizon) == math.inf
        early = 0.5 * certificate.horizon
        assert certificate.error_until(early) < 1e-9

    @pytest.mark.parametrize("half, spot, e", [((0.31, 0.27), (0.51, 0.55), 0.45), ((0.34, 0.26), (0.53, 0.18), 0.43)])
    def test_error_of_a_box_that_comes_to_rest_on_its_corner(self, half, spot, e):
        """Its series of rebounds ends while it turns: held too soon, it was up to 1.5e-6 m off at dt and dt/2 alike."""
        inertia = (half[0] ** 2 + half[1] ** 2) / 3.0
        box = Body(Box(half), 1.0, round(inertia, 4), (0.0, *spot))
        model = planar(floor(), box, restitution=e, friction=0.8)
        steps, finer = 144, 61
        certificate = certify(model, Settings.reference(DT), steps)
        truth = Simulation(model, Settings.reference(DT / finer)).record(steps * finer, finer)
        off = distance(model, certificate.pose, truth.pose)
        assert off[-1] < 1e-9
        assert certificate.holds and (off <= certificate.error + 1e-12).all()  # the truth has round-off, too

    def test_error_of_a_solver_that_is_off_in_one_direction(self, monkeypatch):
        """A solver that is off by the same at any step, to the right: its mirrored world is off to the right, too."""
        shift = np.array([1e-6, 0.0, 0.0])

        class Sided(Simulation):
            def record(self, steps, stride=1, **what):
                made = super().record(steps, stride, **what)
                return replace(made, pose=made.pose + shift)

        monkeypatch.setattr("reference_solver.certificate.truth.Simulation", Sided)
        assert certify(planar(floor(), disc(0.0, 1.5), restitution=0.8), Settings.reference(DT), 60).error[-1] >= 1e-6

    def test_error_of_an_end_of_a_series(self):
        """Of a box on its corner, all steps after the last: 1e-11 of its half width, and a hundredth of that a step."""
        box = Body(Box((0.31, 0.27)), 1.0, 0.0563, (0.0, 0.51, 0.55))
        model = planar(floor(), box, restitution=0.45, friction=0.8)
        certificate = certify(model, Settings.reference(DT), 144)
        record = Simulation(model, Settings.reference(DT)).record(144, pieces=True)
        ends, _, _ = ends_of_series(model, record, DT)
        left_out = 0.27e-11 * (1.0 + (certificate.t[-1] - ends) / DT / 100.0)
        assert len(ends) and certificate.error[-1] > left_out.sum()

    def test_error_of_a_series_ended_too_early(self, monkeypatch):
        """A series that was ended too early is as far off with other steps; the record tells of it."""
        model = planar(floor(), disc(0.0, 1.5), restitution=0.8)
        monkeypatch.setattr(
            "reference_solver.certificate.truth.ends_of_series",
            lambda model, record, dt: (np.array([0.1]), np.array([1e-7]), np.array([1e-5])),
        )
        certificate = certify(model, Settings.reference(DT), 60)
        assert certificate.error[-1] == pytest.approx(1e-7 + 1e-5 * (60 * DT - 0.1), rel=1e-3)
        assert certificate.error[10] < 1e-9

    def test_error_of_a_run_that_is_off_for_a_while(self):
        """A box that topples off another's edge: off by 6e-11 m as it falls, and no more once it lies (seed 15)."""
        drawn = scene(15, 2)
        certificate = certify(drawn.model, Settings.reference(1.0 / drawn.rate), drawn.steps, STRIDE)
        finer = 9
        truth = Simulation(drawn.model, Settings.reference(1.0 / (finer * drawn.rate)))
        off = distance(drawn.model, certificate.pose, truth.record(finer * drawn.steps, finer * STRIDE).pose)
        assert certificate.holds and (off <= certificate.error).all()

    def test_error_by_speeds_that_solves_leave(self):
        """No run with another step need show it."""
        model = planar(floor(), disc(0.0, 1.5), restitution=1.0)
        certificate = certify(model, Settings.reference(DT), 240)
        assert certificate.error[-1] >= 1e-13 * 1.0  # m/s, of at least one second

    def test_steps_below_one_are_refused(self):
        with pytest.raises(ValueError, match="steps"):
            certify(planar(floor(), disc(0.0, 0.5)), Settings.reference(DT), 0)

    def test_a_spatial_run(self):
        ball = Body(Sphere(0.5), 1.0, (0.1,) * 3, (0, 0, 0.7, *UPRIGHT), (1.0, 0.5, -1.0, 1.0, 0.0, 0.0))
        certificate = certify(
            Model(3, [floor(3), ball], (0.0, 0.0, -G), 0.8, 0.1), Settings.reference(DT), 60, stride=3
        )
        assert certificate.holds and len(certificate.t) == 21
        # half of it is what the end of a slip may leave out: 1e-11 of a radius of .5 m (`truth.SLIP_ENDS`)
        assert certificate.error[-1] < 1e-11


@pytest.mark.parametrize("seed", range(30))
def test_quaternion_of_unit_length_but_for_round_off(seed):
    """But one that is not what the run begins with is."""
    angle = np.random.default_rng(seed).uniform(0.0, 3.0)
    turn = (math.cos(0.5 * angle), math.sin(0.5 * angle), 0.0, 0.0)
    box = Body(Box((0.1, 0.2, 0.3)), 1.0, (0.1, 0.1, 0.1), (0.0, 0.0, 0.0, *turn))
    model = Model(3, [box], (0.0, 0.0, -G), 0.0, 0.0)
    assert refused(model, 5) == set()
    record = Simulation(model, Settings.reference(DT)).record(5, pieces=True)
    other = replace(model, bodies=(replace(box, pose=(0.0, 0.0, 0.0, turn[0], turn[1] + 1e-14, 0.0, 0.0)),))
    assert "joined" in {finding.name for finding in audit(other, record, DT) if not finding.holds}


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e3])
def test_energy_from_nowhere_of_light_bodies_without_loads(size):
    """Without loads it used to be measured against a joule."""
    light = Body(Disc(0.5), 1e-6 * size, 0.125e-6 * size, (0.0, 0.0, 0.0), (0.1, 0.0, 0.0))
    model = Model(2, [light], (0.0, 0.0), 0.0, 0.0)
    record = Simulation(model, Settings.reference(DT)).record(5, pieces=True)
    faster = replace(record.pieces, twist_after=record.pieces.twist_after * (1.0 + 1e-3))
    found = {finding.name for finding in audit(model, replace(record, pieces=faster), DT) if not finding.holds}
    assert "gained" in found


@pytest.mark.parametrize("mass", [1.0, 1e5])
@pytest.mark.parametrize(("gap", "lost"), [(2.5e-13, False), (1e-11, False), (1e-9, True)])
def test_work_lost_by_a_load_that_shuts_a_gap_counted_as_none(gap, lost, mass):
    """Of a step's energy a share gap/(g h^2), 1.5e-9 at 2.5e-13 m; as `apart`, up to 1e-9 of a body, 5e-10 m here.

    A disc that rests is lowered by ``gap`` in one step, as its velocity at the end of it says, under its load.
    """
    model = planar(floor(), Body(Disc(0.5), mass, 0.125 * mass, (0.0, 0.5, 0.0)), friction=0.0)
    record = Simulation(model, Settings.reference(DT)).record(5, pieces=True)
    pieces = record.pieces
    rows = np.flatnonzero(pieces.body == 1)
    pose, last, first = pieces.pose_after.copy(), pieces.twist_after.copy(), pieces.twist_before.copy()
    pose[rows[2:], 1] -= gap
    before = pieces.pose_before.copy()
    before[rows[3:], 1] -= gap
    last[rows[2], 1] = first[rows[3], 1] = -2.0 * gap / DT
    moved = replace(pieces, pose_after=pose, pose_before=before, twist_after=last, twist_before=first)
    found = {finding.name for finding in audit(model, replace(record, pieces=moved), DT) if not finding.holds}
    assert ("lost" in found) is lost


def test_work_of_a_torque_on_a_tumbling_body():
    """By the mean of its spins at both ends of a step a box gained 1.3e-7 of its energy from nowhere, and void."""
    box = Body(Box((0.226, 0.187, 0.352)), 0.265, (0.0140, 0.0155, 0.0076), (0.0, 0.0, 2.0, *UPRIGHT),
               (0.0, 0.0, 0.0, -1.64, -1.09, -1.16), torque=(-0.029, 0.0, -0.094))  # fmt: skip
    model = Model(3, (box,), (0.0, 0.0, -15.3), 0.5, 0.07)
    for dt in (DT, 2.0 * DT):
        record = Simulation(model, Settings.reference(dt)).record(10, pieces=True)
        found = {finding.name: finding for finding in audit(model, record, dt)}
        assert found["gained"].holds and found["lost"].holds
        assert max(found["gained"].value, found["lost"].value) < 1e-14, dt
    gives = replace(model, bodies=(replace(box, torque=(-0.029, 0.0, -0.0941)),))
    assert {"gained", "lost", "spin"} & {finding.name for finding in audit(gives, record, dt) if not finding.holds}


def test_rod_spun_up_by_torques_about_its_own_axis():
    """It turns by six radians a step in the end; by Hermite's formula it gained 4e-8 of its energy, and was refused.

    A solver's turn that is off is told as well, and so is a torque of another size.
    """
    r, half, mass = 0.0175, 0.4585, 9.0
    along, across = mass * 0.5 * r * r, mass * (0.25 * r * r + (half + r) ** 2 / 3.0)
    rod = Body(Capsule(half, r), mass, (along, across, across), (0.0, 0.0, 2.0, *UPRIGHT),
               (0.3, 0.0, 0.0, 400.0, 0.5, -0.3), torque=(-0.004, 2.7, -3.2))  # fmt: skip
    model, dt = Model(3, (rod,), (0.0, 0.0, -G), 0.0, 0.0), 1.0 / 90.0
    record = Simulation(model, Settings.reference(dt)).record(20, pieces=True)
    spins = np.linalg.norm(record.twist[:, 0, 3:], axis=1)
    assert spins.max() * dt > 4.0
    found = {finding.name: finding for finding in audit(model, record, dt)}
    assert all(finding.holds for finding in found.values()), [str(x) for x in found.values() if not x.holds]
    assert max(found["gained"].value, found["lost"].value) < 1e-12
    gives = replace(model, bodies=(replace(rod, torque=(-0.004, 2.7, -3.2003)),))
    refused_for = {finding.name for finding in audit(gives, record, dt) if not finding.holds}
    assert "spin" in refused_for


@pytest.mark.parametrize(("height", "met"), [(5e-3, False), (2e-4, True)])
def test_rod_that_turns_by_radians_in_a_step(height, met):
    """It spins about its own axis, and keeps clear of a floor 5 mm below; one that its end dips into it has missed.

    By the shorter way from one end of a step to the other it would be .6 of its radius in the former.
    """
    r, half, mass = 0.0175, 0.4585, 9.0
    along, across = mass * 0.5 * r * r, mass * (0.25 * r * r + (half + r) ** 2 / 3.0)
    place, twist = (0.0, 0.0, r + height, *UPRIGHT), (0.0, 0.0, 0.0, 400.0, 0.0, 5.0)
    rod = Body(Capsule(half, r), mass, (along, across, across), place, twist)
    model, dt = Model(3, (rod,), (0.0, 0.0, 0.0), 0.0, 0.0), 1.0 / 60.0
    record = Simulation(model, Settings.reference(dt)).record(2, pieces=True)
    under = Body(HalfSpace((0.0, 0.0, 1.0)), pose=(0.0, 0.0, 0.0, *UPRIGHT), motion="fixed")
    floored = Model(3, (rod, under), (0.0, 0.0, 0.0), 0.0, 0.0)
    sample = np.repeat([[under.pose]], len(record.pose), axis=0)
    record = replace(record, pose=np.concatenate([record.pose, sample], axis=1))
    found = {finding.name for finding in audit(floored, record, dt) if not finding.holds}
    assert found == ({"overlap"} if met else set())


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("beyond", [1e-8, 1e-4])
def test_corner_that_slides_off_its_face(dimension, beyond):
    """A box slides flat over a table whose end the run knows too late; at rest on it the load stays where it is."""
    half, table, steps, dt = 0.1, 0.5, 10, 1.0 / 240.0
    across = () if dimension == 2 else (0.5,)
    pose = lambda x, y: (x, y, 0.0) if dimension == 2 else (x, 0.0, y, 1.0, 0.0, 0.0, 0.0)  # noqa: E731
    inertia = 2.0 / 3.0 * half**2
    twist = (1.0,) + (0.0,) * (2 if dimension == 2 else 5)
    start = pose(table - half + beyond - steps * dt, half)
    box = Body(Box((half,) * dimension), 1.0, inertia if dimension == 2 else (inertia,) * 3, start, twist)

    def with_table(longer):
        fixed = Body(Box((table + longer, *across, 0.2)), pose=pose(0.0, -0.2), motion="fixed")
        return Model(dimension, [fixed, box], (0.0,) * (dimension - 1) + (-9.81,), 0.0, 0.0)

    record = Simulation(with_table(1e-3), Settings.reference(dt)).record(steps, pieces=True)
    assert not [finding for finding in audit(with_table(1e-3), record, dt) if not finding.holds]
    assert [finding.name for finding in audit(with_table(0.0), record, dt) if not finding.holds] == ["stays"]


@pytest.mark.parametrize(("dimension", "speed"), [(2, 0.37), (2, 5.0), (3, 1.3), (3, 5.0)])
def test_ball_that_rolls_over_the_seam_of_two_boxes(dimension, speed):
    """A corner passes below it: a millionth of a radius before it, the gap is round-off and the normal leans."""
    r, table, across = 0.1, 2.0, (0.5,) * (dimension - 1)
    pose = lambda x, y: (x, y, 0.0) if dimension == 2 else (x, 0.0, y, *UPRIGHT)  # noqa: E731
    boxes = [Body(Box((table, *across)), pose=pose(x, -0.5), motion="fixed") for x in (-table, table)]
    steps = 30
    spin = (-speed / r,) if dimension == 2 else (0.0, speed / r, 0.0)
    twist = (speed,) + (0.0,) * (dimension - 1) + spin
    inertia = 0.5 * r**2 if dimension == 2 else (0.4 * r**2,) * 3
    ball = Body(Disc(r) if dimension == 2 else Sphere(r), 1.0, inertia, pose(-speed * 20.3 * DT, r), twist)
    model = Model(dimension, [*boxes, ball], (0.0,) * (dimension - 1) + (-G,), 0.0, 0.5)
    record = Simulation(model, Settings.reference(DT)).record(steps, pieces=True)
    assert not [finding for finding in audit(model, record, DT) if not finding.holds]
    assert np.abs(record.pose[:, 2, dimension - 1] - r).max() < 1e-12
    pieces = record.pieces
    for tilt, seen in ((1e-8, True), (0.0, False)):
        normal = pieces.normal.copy()
        normal[:, 0] += tilt
        told = audit(model, replace(record, pieces=replace(pieces, normal=normal)), DT)
        assert ("direction" in {finding.name for finding in told if not finding.holds}) is seen


@pytest.mark.parametrize("share", [1e-6, 1e-2])
def test_corrections_of_more_than_round_off(share):
    """Contacts that stay closed are given impulses of any sign at an instant: of 1e-11 of the momentum there."""
    drawn = scene(20, 2)
    record, dt = (
        Simulation(drawn.model, Settings.reference(1.0 / drawn.rate)).record(drawn.steps, pieces=True),
        1.0 / drawn.rate,
    )
    assert not [str(finding) for finding in audit(drawn.model, record, dt) if not finding.holds]
    run = Run(drawn.model, record.pieces, dt)
    j, n = np.flatnonzero(run.is_correction[run.contact_owner])[0], record.pieces.normal
    whole = share * (reduced_mass(run) * speeds(run))[j]
    for along, name in ((-n[j], "pull"), (np.array([-n[j, 1], n[j, 0]]), "cone")):
        impulse = record.pieces.impulse.copy()
        impulse[j] = whole * along
        changed = replace(record, pieces=replace(record.pieces, impulse=impulse))
        assert name in {finding.name for finding in audit(drawn.model, changed, dt) if not finding.holds}


def at_rest_after_a_blow():
    """A box that strikes a wall with e = 0 at 1 m/s and rests there without loads, and the last piece of its record."""
    box = Body(Box((0.5, 0.5)), 1.0, 1.0 / 6.0, (0.6, 0.0, 0.0), (-1.0, 0.0, 0.0))
    model = Model(2, [Body(HalfSpace((1.0, 0.0)), motion="fixed"), box], (0.0, 0.0), 0.0, 0.5)
    record = Simulation(model, Settings.reference(DT)).record(60, pieces=True)
    assert [finding for finding in audit(model, record, DT) if not finding.holds] == []
    return model, record, len(record.pieces) - 1


@pytest.mark.parametrize(("speed", "seen"), [(1e-15, False), (1e-13, True)])
def test_approach_of_what_rests_without_loads(speed, seen):
    """A hundred last places of the speed that it had are round-off: 2e-14 m/s of 1 m/s."""
    model, record, last = at_rest_after_a_blow()
    pieces, row = record.pieces, record.pieces.first_body[last]
    before, after, impulse = pieces.twist_before.copy(), pieces.twist_after.copy(), pieces.impulse.copy()
    before[row, 0] = after[row, 0] = -speed
    impulse[pieces.first_contact[last]] = (1e-30, 0.0)
    changed = replace(record, pieces=replace(pieces, twist_before=before, twist_after=after, impulse=impulse))
    assert ("normal" in {finding.name for finding in audit(model, changed, DT) if not finding.holds}) is seen


@pytest.mark.parametrize(("share", "seen"), [(0.5, False), (5.0, True)])
def test_spin_of_what_stands_still(share, seen):
    """A change of spin that moves no point of a body faster than its last places allow is round-off."""
    model, record, last = at_rest_after_a_blow()
    pieces, run = record.pieces, Run(model, record.pieces, DT)
    after = pieces.twist_after.copy()
    # Of the box I = m (a^2 + a^2)/3 with half width a, and its corners are at a sqrt(2): I = m reach^2/3.
    after[pieces.first_body[last], 2] = 3.0 * share * run.still[1] / run.reach[1]
    changed = replace(record, pieces=replace(pieces, twist_after=after))
    assert ("spin" in {finding.name for finding in audit(model, changed, DT) if not finding.holds}) is seen
