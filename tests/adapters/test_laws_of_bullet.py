"""Laws of Bullet against integrations of the motion they speak of, in scenes longer and shorter than ours."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from adapters.bullet.laws import (
    RESIDUAL_SPEED,
    _bounding_radius,
    _split_push,
    law_of,
    pulled_with_drag,
    sliding_with_drag,
)
from adapters.needs import needs
from adapters.scene import Box
from validation.catalogue import CATALOGUE

#: Short against all that a slide or a belt takes: what a step makes of an integration is less than a thousandth.
DT = 1 / 2000


def braked(pull, law, start, times):
    """Speeds of what is pulled [m/s^2] and dragged as the law has it, without steps."""
    found = solve_ivp(lambda t, v: pull - law.drag(v[0], 1.0), (0.0, times[-1]), [start], t_eval=times, rtol=1e-10)
    return found.y[0]


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("duration", [0.6, 1.0, 3.0])
def test_a_slide_speeds_up_by_what_is_left_of_its_pull_over_the_second_half_however_long_it_is(dimension, duration):
    scene = replace(CATALOGUE["incline"].scene(dimension, {"ratio": 1.3, "mu": 0.4}), duration=duration)
    pull = scene.gravity[0] + 0.4 * scene.gravity[-1]
    speed = braked(pull, law_of("default", needs(scene), DT), 0.0, [0.0, duration / 2, duration])
    mean, band = sliding_with_drag(scene, DT, None)
    assert mean == pytest.approx((speed[2] - speed[1]) / (duration / 2), rel=1e-3)
    assert mean < 0.999 * pull  # and drag is seen
    assert band == pytest.approx(2.0 * RESIDUAL_SPEED / (duration / 2), rel=2e-3)


def test_a_slide_that_sticks_and_what_is_no_box_have_no_law():
    scene = CATALOGUE["incline"].scene(3, {"ratio": 0.99})
    assert sliding_with_drag(scene, DT, None) is None
    assert sliding_with_drag(CATALOGUE["roll_incline"].scene(3, {}), DT, None) is None


@pytest.mark.parametrize("dimension", [2, 3])
def test_a_belt_takes_a_box_to_its_own_speed_and_no_further(dimension):
    """What the scene measures of it is handed in: here places and speeds as they are."""
    canonical, told = CATALOGUE["conveyor"], []

    def measure(scene, motion):
        told.append(motion)
        return {"pull": (float(motion.twist[-1, 1, 0]), "")}

    scene = canonical.scene(dimension, {})
    belt, box = scene.bodies
    run = float(np.hypot(*belt.surface_velocity[:2]))
    value, band = pulled_with_drag(scene, DT, measure)
    pull = scene.material(belt.name, box.name).friction * -scene.gravity[-1]
    motion = told[0]
    free = braked(pull, law_of("default", needs(scene), DT), 0.0, motion.t)
    along = np.array(belt.surface_velocity) / run
    wanted = np.minimum(free, run)
    assert np.allclose(motion.twist[:, 1, :dimension] @ along, wanted, atol=2e-3 * run)
    gone = motion.pose[:, 1, :dimension] - motion.pose[0, 1, :dimension]
    trapezoid = np.concatenate([[0.0], np.cumsum(0.5 * (wanted[1:] + wanted[:-1])) * DT])
    assert np.allclose(gone @ along, trapezoid, atol=2e-3 * run) and np.allclose(gone[:, 1:-1], 0.0)
    assert motion.t[-1] == pytest.approx(scene.duration, abs=DT) and motion.dt == DT and motion.finish == "completed"
    assert value == motion.twist[-1, 1, 0] and band == 6.0 * RESIDUAL_SPEED / scene.duration
    assert np.array_equal(motion.pose[:, 0], [belt.pose] * len(motion.t)) and not motion.twist[:, 0].any()
    assert pulled_with_drag(scene, DT, lambda *asked: {"pull": (None, "it stands")}) is None
    still = replace(belt, surface_velocity=(0.0,) * dimension)
    others = (
        replace(scene, gravity=(1.0, *scene.gravity[1:])),
        replace(scene, bodies=(*scene.bodies, replace(box, name="other"))),
        replace(scene, bodies=(still, box)),
    )
    for other in others:
        assert pulled_with_drag(other, DT, measure) is None
    fast = replace(belt, surface_velocity=tuple(1e4 * each for each in belt.surface_velocity))
    assert pulled_with_drag(replace(scene, bodies=(fast, box)), DT, measure) is None


def test_the_ball_around_a_box_has_its_corners_on_it_and_a_planar_box_is_as_deep_as_it_is_long():
    assert _bounding_radius(Box((2.0, 3.0, 6.0))) == 7.0
    assert _bounding_radius(Box((0.5, 0.25))) == pytest.approx(0.75) == _bounding_radius(Box((0.25, 0.5)))


def test_a_plate_is_pushed_out_by_a_share_of_what_is_deep_and_beyond_the_slop():
    """Profile one: contactERP of the overlap less the slop, in a step; up to 4 cm by speeds, which the ball has."""
    scene = CATALOGUE["thin_wall"].scene(3, {})
    assert _split_push(scene, 1 / 240, 0.04) == 0.0 == _split_push(scene, 1 / 240, 0.0)
    one, more, half = (_split_push(scene, dt, deep) for dt, deep in ((DT, 0.06), (DT, 0.07), (0.5 * DT, 0.06)))
    share = (more - one) * DT / 0.01
    assert 0.0 < share < 1.0 and half == pytest.approx(2.0 * one)
    assert 0.0 <= 0.06 - one * DT / share < 1e-3  # the slop
