"""Known motions: their gates hold, their truths obey laws they were not made from, and a false truth fails."""

import dataclasses
import math

import numpy as np
import pytest

from reference_solver.certification.geometry import gap
from reference_solver.certification.known import gates, planar, spatial
from reference_solver.certification.known.motion import Miss, integrated, miss
from reference_solver.certification.space import SPACES


@pytest.mark.parametrize("name", gates.MOTIONS)
def test_what_is_certified_of_a_known_motion_is_true(name):
    found = gates.misses(name, 3)
    assert gates.beyond(name, found).holds
    assert [row for row in gates.kept(name, found) if not row.holds] == []


def test_an_error_beyond_x_fails_its_row():
    near, far, refused = Miss(1e-9, 1e-9, ()), Miss(2e-9, 1e-9, ()), Miss(1.0, 1e-9, ("no",))
    assert gates.beyond("", [near, refused]).holds and not gates.beyond("", [near, far]).holds
    rows = {row.quantity: row.holds for row in gates.kept("", [near] * 4 + [refused] * 2)}
    assert rows == {"known motion: error [m]": True, "known motion: share certified": False}
    assert not next(gates.kept("", [Miss(2e-8, 1e-7, ())])).holds


@pytest.mark.parametrize("name", ["board on rollers, planar", "ball on a turntable", "box on three corners at once"])
def test_a_truth_that_is_off_by_a_millionth_of_a_metre_is_missed(name):
    motion = gates.MOTIONS[name](np.random.default_rng(0))
    wrong = motion.truth.copy()
    wrong[0] += 1e-6
    found = miss(dataclasses.replace(motion, truth=wrong), 40)
    assert found.refused == () and not gates.beyond(name, [found]).holds


def test_a_turn_counts_at_the_reach_of_the_body():
    motion = planar.wedge(SPACES[0], np.random.default_rng(1))
    wrong = motion.truth.copy()
    wrong[2] += 1e-5
    found = miss(dataclasses.replace(motion, truth=wrong), 40)
    assert found.off == pytest.approx(1e-5 * motion.model.bodies[-1].shape.radius, rel=1e-3)


@pytest.mark.parametrize("name", gates.MOTIONS)
def test_nothing_overlaps_at_the_start_and_the_truth_overlaps_nothing(name):
    for seed in range(3):
        motion = gates.MOTIONS[name](np.random.default_rng(seed))
        body, others = motion.model.bodies[-1], motion.model.bodies[:-1]
        end = np.where(np.isnan(motion.truth), body.pose, motion.truth)
        for other in others:
            assert gap(other.shape, other.pose, body.shape, body.pose) > -1e-9
            assert gap(other.shape, other.pose, body.shape, end) > -1e-9


def test_a_lopsided_ball_keeps_its_energy():
    motion = spatial.lopsided_ball(np.random.default_rng(3))
    ball = motion.model.bodies[-1]
    uniform = dataclasses.replace(ball, inertia=(0.4 * ball.shape.radius**2,) * 3)
    assert np.linalg.norm(motion.truth[:2]) > 0.05  # it has rolled
    # A ball of equal moments rolls straight: the wobble is what makes the difference.
    straight = motion.time * np.array(uniform.twist[:2])
    assert np.linalg.norm(motion.truth[:2] - straight) > 1e-4


def test_the_integrator_is_of_fourth_order_and_stops_where_it_is_told():
    end, left = integrated(lambda s: np.array([s[1], -s[0]]), np.array([1.0, 0.0]), 1.0)
    assert left == 0.0 and np.allclose(end, [math.cos(1.0), -math.sin(1.0)], rtol=0.0, atol=1e-13)
    end, left = integrated(lambda s: np.array([s[1], -s[0]]), np.array([1.0, 0.0]), 3.0, lambda s: s[0])
    assert 3.0 - left == pytest.approx(0.5 * math.pi, abs=1e-12)


def test_no_set_of_corners_fits_what_pulls_and_pushes_at_once():
    with pytest.raises(ValueError, match="corners"):
        spatial._complementary(np.array([[-1.0]]), np.array([-1.0]))
