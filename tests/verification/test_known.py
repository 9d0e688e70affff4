"""Known motions: their gates hold, their truths obey laws they were not made from, and a false truth fails."""

import dataclasses
import math

import numpy as np
import pytest

from reference_solver import Settings, Simulation
from reference_solver.certificate.audit import audit
from reference_solver.geometry import gap
from reference_solver.pieces import IMPACT
from tests.verification.known import blows, corners, edges, gates, planar, rubbing, spatial
from tests.verification.known.motion import Miss, complementary, integrated, miss
from tests.verification.space import SPACES


@pytest.mark.few(3)
@pytest.mark.parametrize("name", gates.MOTIONS)
def test_certified_known_motions(name):
    found = gates.misses(name, 3)
    assert gates.beyond(name, found).holds
    assert [row for row in gates.kept(name, found) if not row.holds] == []


def test_row_of_an_error_beyond_x():
    near, far, refused = Miss(1e-9, 1e-9, ()), Miss(2e-9, 1e-9, ()), Miss(1.0, 1e-9, ("no",))
    assert gates.beyond("", [near, refused]).holds and not gates.beyond("", [near, far]).holds
    rows = {row.quantity: row.holds for row in gates.kept("planar", [near] * 4 + [refused] * 2)}
    assert rows == {"known motion: error [m]": True, "known motion: share certified": False}
    assert not next(gates.kept("planar", [Miss(2e-8, 1e-7, ())])).holds


@pytest.mark.parametrize("name", ["board on rollers, planar", "ball on a turntable", "box on three corners at once"])
def test_truth_off_by_a_micrometre(name):
    motion = gates.MOTIONS[name](np.random.default_rng(0))
    wrong = motion.truth.copy()
    wrong[0] += 1e-6
    found = miss(dataclasses.replace(motion, truth=wrong), 40)
    assert found.refused == () and not gates.beyond(name, [found]).holds


def test_turn_at_the_reach_of_a_body():
    motion = planar.wedge(SPACES[0], np.random.default_rng(1))
    wrong = motion.truth.copy()
    wrong[2] += 1e-5
    found = miss(dataclasses.replace(motion, truth=wrong), 40)
    assert found.off == pytest.approx(1e-5 * motion.model.bodies[-1].shape.radius, rel=1e-3)


@pytest.mark.few(3)
@pytest.mark.parametrize("name", gates.MOTIONS)
def test_overlap_at_the_start_and_in_the_truth(name):
    for seed in range(3):
        motion = gates.MOTIONS[name](np.random.default_rng(seed))
        bodies, truths = motion.model.bodies, np.atleast_2d(motion.truth)
        ends = [np.array(body.pose) for body in bodies]
        for k, truth in enumerate(truths, len(bodies) - len(truths)):
            ends[k] = np.where(np.isnan(truth), bodies[k].pose, truth)
        for k, body in enumerate(bodies):
            for other, end in zip(bodies[:k], ends[:k], strict=True):
                if body.motion == "free":
                    assert gap(other.shape, other.pose, body.shape, body.pose) > -1e-9
                    assert gap(other.shape, end, body.shape, ends[k]) > -1e-9


def test_a_lopsided_ball_keeps_its_energy():
    motion = spatial.lopsided_ball(False, np.random.default_rng(3))
    ball = motion.model.bodies[-1]
    uniform = dataclasses.replace(ball, inertia=(0.4 * ball.shape.radius**2,) * 3)
    assert np.linalg.norm(motion.truth[:2]) > 0.05  # it has rolled
    # A ball of equal moments rolls straight: the wobble is what makes the difference.
    straight = motion.time * np.array(uniform.twist[:2])
    assert np.linalg.norm(motion.truth[:2] - straight) > 1e-4


def test_order_and_stop_of_the_integrator():
    end, left = integrated(lambda s: np.array([s[1], -s[0]]), np.array([1.0, 0.0]), 1.0)
    assert left == 0.0 and np.allclose(end, [math.cos(1.0), -math.sin(1.0)], rtol=0.0, atol=1e-13)
    end, left = integrated(lambda s: np.array([s[1], -s[0]]), np.array([1.0, 0.0]), 3.0, lambda s: s[0])
    assert 3.0 - left == pytest.approx(0.5 * math.pi, abs=1e-12)


def test_corners_pulled_and_pushed_at_once():
    with pytest.raises(ValueError, match="contacts"):
        complementary(np.array([[-1.0]]), np.array([-1.0]))


def test_box_sliding_over_the_corner_of_a_table():
    """Corners of its base leave the table, and that of the table leaves its base: pressed polygons of up to six."""
    found = [miss(edges.slides_over_a_corner(np.random.default_rng(seed)), 30) for seed in range(6, 14)]
    assert [each.refused for each in found] == [()] * len(found)
    assert max(each.off for each in found) < 1e-11


def test_box_that_spins_on_a_light_one():
    boxes = [(0.47, 0.46, 0.08), (0.09, 0.19, 0.11)]
    numbers = np.array([[0.01, 44.0], [0.6, 0.2], [5.0, -6.7], [0.95, -0.27]])
    found = miss(rubbing.spun_down(boxes, *numbers, 0.2), 15)
    assert found.off < 1e-9


def test_heavy_slab_on_a_light_one():
    """77 kg on 0.06 kg: by round-off of its weight both would rise with 1e-11 m/s^2, which their contacts took off."""
    motion = rubbing.slabs(SPACES[1], np.random.default_rng(2))
    dt = motion.time / 15
    found = Simulation(motion.model, Settings.reference(dt)).record(15, 5, pieces=True)
    assert [finding for finding in audit(motion.model, found, dt) if not finding.holds] == []


def test_layers_that_stop_together():
    """A slab on one that is as heavy, on a smooth floor: both end with half of its speed."""
    ways = rubbing.layers([1.0, 1.0], [1e-12, 2.0], [0.0, 4.0], 2.0)
    assert ways == pytest.approx([1.0 + 2.0, 3.0 + 2.0], abs=1e-9)  # relative slip ends after 1 s


def test_time_of_a_ball_s_rebounds_by_their_series():
    """Frictionless, level: rest after sqrt(2 h/g) (1 + e)/(1 - e) (O16), and its blows are as many as fit."""
    e, height, radius = 0.5, 0.4, 0.1
    world = blows.Flight(np.array([[0.0, 1.0, 0.0]]), radius, np.array([0.0, -10.0]), e, 0.0)
    x, v, w, q = np.array([0.0, radius + height]), np.array([1.0, 0.0]), np.zeros(1), np.zeros(1)
    place, _, count = world.goes(x, v, w, q, 3.0)
    assert place == pytest.approx([3.0, radius], abs=1e-8)
    impact = math.sqrt(2.0 * 10.0 * height)
    assert count == math.ceil(math.log(blows.LAST / impact) / math.log(e))


def test_smooth_ball_that_leaves_an_edge():
    """cos(theta) = 2/3 + v^2/(3 g r): energy, and a load of zero."""
    radius, v = 0.3, 0.2
    world = edges.Rolling(np.array([1.0, 1.0, 1.0]), radius, np.array([0.0, 0.0, -10.0]), 0.0, False)
    state = np.array([1.0, 0.0, 0.0, 0.0, *np.zeros(3), v, 0.0, 0.0, 1.0 - 1e-9, 0.0, 1.0 + radius])
    beyond = np.array([True, False, True])
    state[10] = 1.0
    end, left = integrated(lambda s: world._rate(s, beyond), state, 2.0, lambda s: world.load(s, beyond))
    assert left > 0.0
    assert (end[12] - 1.0) / radius == pytest.approx(2.0 / 3.0 + v * v / (3.0 * 10.0 * radius), abs=1e-9)


@pytest.mark.parametrize("space", SPACES, ids=lambda space: space.name)
@pytest.mark.parametrize("seed", [40, 88])
def test_series_of_rebounds_in_the_noise_of_its_gap(space, seed):
    """E22: by their ratio e rebounds are over after forty or so; lifted out of the noise each time they never were."""
    motion = corners.falls_on_a_corner(space, np.random.default_rng(seed))
    found = miss(motion, 60)
    assert found.refused == () and found.off <= found.bound + 2e-11
    pieces = Simulation(motion.model, Settings.reference(motion.time / 60)).record(60, pieces=True).pieces
    assert (pieces.kind == IMPACT).sum() <= 2 * math.log(1e7) / -math.log(motion.model.restitution[0, 1])


def test_box_that_rebounds_on_a_corner():
    """Smooth: the spin about the corner that is struck, and e of its speed; flights keep energy."""
    box = corners.Box((0.2, 0.4), 0.0)
    state = np.array([-0.8, 3.0, 0.0, 2.0, box.lever(-0.8)[1], -1.5])
    after = box.struck(state, 0.6)
    x, _ = box.lever(-0.8)
    about = [each[5] * x + box.inertia * each[1] for each in (state, after)]
    assert about[1] == pytest.approx(about[0], abs=1e-14)
    assert box.approach(after) == pytest.approx(-0.6 * box.approach(state), abs=1e-14)
    assert box.height(box.flown(after, box.back(after, 1.0))) == pytest.approx(0.0, abs=1e-15)
