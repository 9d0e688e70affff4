"""MuJoCo's declared friction of a box that is thrown up: what Newton's tolerance may make of it is its band."""

import math
from dataclasses import replace

import pytest

pytest.importorskip("mujoco")

from adapters.mujoco.box_on_face import BoxOnFace
from adapters.mujoco.engine import FRICTION_SHARE, MujocoEngine, _friction
from adapters.needs import Needs
from adapters.receipts.probes import SLIDE_TIME, Case, slide
from adapters.stepping import step_count

DT = 1 / 240
#: A box that friction of 2.5 throws up and turns, so that a start that is off by little ends elsewhere.
NEEDS = Needs(2, True, 2.5, 0.0, "rest", True, 1.0, 6.0, 1.0, 9.81, 9.81)


def declared(needs=NEEDS, **changed):
    settings = {each.name: each.value for each in MujocoEngine().settings("tuned", needs, DT)}
    return _friction(settings | changed, needs, DT)


def ratio(start):
    """Friction over load of a start that is faster by this [m/s], from the box's own motion."""
    scene, steps = slide(Case(2, 0.0, 2.5, DT, 0.0)), step_count(SLIDE_TIME, DT)
    settings = {each.name: each.value for each in MujocoEngine().settings("tuned", NEEDS, DT)}
    speed = scene.bodies[1].twist[0] + start
    forwards, upwards, _ = BoxOnFace.of(settings, scene, DT).motion(steps, speed)[-1][1]
    return (speed - forwards) / (upwards - scene.gravity[-1] * steps * DT)


@pytest.mark.parametrize("tolerance", [1e-8, 1e-4, 1e-2])
def test_declared_friction_band_by_starts_off_by_the_tolerance(tolerance):
    """Newton's cost is good to the tolerance: accelerations to its root, and a start to that over a step."""
    without, found = declared(tolerance=0.0), declared(tolerance=tolerance)
    assert set(found) == {"friction", "friction_impulse"} and found["friction"] == found["friction_impulse"]
    exact, told = without["friction"], found["friction"]
    assert exact.value == told.value == pytest.approx(ratio(0.0)) and exact.band == FRICTION_SHARE * 2.5
    off = math.sqrt(12.0 * tolerance) * DT
    apart = max(abs(ratio(k * off) - ratio(0.0)) for k in (1.0, -1.0))
    assert apart > 0.0 and told.band - exact.band == pytest.approx(2.0 * apart, rel=1e-6)


def test_requested_friction_of_a_box_that_stays_on_its_face():
    assert declared(replace(NEEDS, friction=0.5), tolerance=1e-2) == {}
