"""The motion of blows in singles, event by event: who meets whom, when, where, and in which step it is recorded."""

import math
from dataclasses import replace

import numpy as np
import pytest

from adapters.law import single_precision as singles
from adapters.law.single_precision import LARGEST, SMALLEST, TOUCHING, Method
from adapters.scene import Body, Box, HalfSpace, Pair, Scene, Sphere

EXACT = Method(lambda e, speed: e, 200, 2.0**-53)
STILL = (1.0, 0.0, 0.0, 0.0)


def ball(name, place, velocity, radius=0.5, mass=1.0, spin=(0.0, 0.0, 0.0)):
    return Body(name, Sphere(radius), mass, (0.4 * mass * radius**2,) * 3, (*place, *STILL), (*velocity, *spin))


def space(*bodies, restitution=0.5, friction=0.0, duration=1.0):
    return Scene("blow", 1, 3, bodies, (Pair(restitution=restitution, friction=friction),), (0.0,) * 3, duration)


def meeting(*bodies, **given):
    return singles._Flight(space(*bodies, **given), EXACT)._meeting(0, 1)


def test_step_of_a_blow_at_the_beginning_of_a_step():
    """Two equal balls, 1 m/s, half a metre apart: a blow after exactly 0.5 s, when the 33rd of these steps begins."""
    dt = 1 / 64
    scene = space(ball("left", (0.0, 2.0, 0.0), (1.0, 0.0, 0.0)), ball("right", (1.5, 2.0, 0.0), (0.0, 0.0, 0.0)))
    motion, blows = singles._motion(singles.Held(scene), dt, EXACT)
    rows = motion.contacts.rows
    assert blows == 1 and len(rows.impulse) == 1 and motion.dt == dt and motion.finish == "completed"
    assert list(motion.contacts.step) == list(range(1, 65))
    assert list(np.flatnonzero(np.diff(motion.contacts.offset))) == [32]
    assert (rows.a[0], rows.b[0], rows.gap[0]) == (0, 1, 0.0) and rows.impulse[0] == pytest.approx((0.75, 0.0, 0.0))
    assert rows.normal[0] == pytest.approx((1.0, 0.0, 0.0))
    assert motion.twist[:, :, 0] == pytest.approx(np.array([[1.0, 0.0]] * 32 + [[0.25, 0.75]] * 33))
    t = np.arange(65) * dt
    after = np.maximum(t - 0.5, 0.0)
    assert motion.t == pytest.approx(t) and motion.pose[:, :, 1] == pytest.approx(2.0)
    assert motion.pose[:, 0, 0] == pytest.approx(np.minimum(t, 0.5) + 0.25 * after)
    assert motion.pose[:, 1, 0] == pytest.approx(1.5 + 0.75 * after)
    assert motion.pose[:, :, 3:] == pytest.approx(np.broadcast_to(STILL, (65, 2, 4)))


def test_place_of_a_ball_on_a_box_s_face():
    block = Body("block", Box((1.0, 0.5, 0.25)), motion="fixed", pose=(0.0, 0.0, 1.0, *STILL))
    down = ball("ball", (0.5, 0.25, 1.75), (0.25, 0.0, -0.5), 0.25)
    for first, second in ((block, down), (down, block)):  # whichever stands first, the box is the first of a contact
        wait, contact = meeting(first, second, friction=0.5)
        a = (first, second).index(block)
        assert (contact.a, contact.b, contact.e, contact.mu) == (a, 1 - a, 0.5, 0.5)
        assert wait == pytest.approx(0.5) and contact.normal == pytest.approx((0.0, 0.0, 1.0))
        assert contact.arms[0] == pytest.approx((0.5, 0.25, 0.25)) and contact.arms[1] == pytest.approx((0, 0, -0.25))
    side = ball("ball", (-1.5, 0.25, 1.125), (0.5, 0.0, 0.0), 0.25)
    wait, contact = meeting(block, side)
    assert wait == pytest.approx(0.5) and contact.normal == pytest.approx((-1.0, 0.0, 0.0))
    assert contact.arms[0] == pytest.approx((-1.0, 0.25, 0.125)) and contact.arms[1] == pytest.approx((0.25, 0, 0))


def test_meeting_of_balls_and_flat_boxes_with_a_tilted_plane():
    floor = Body("floor", HalfSpace((0.0, 0.0, 1.0), 0.5), motion="fixed")
    wait, contact = meeting(ball("ball", (3.0, 1.0, 1.25), (1.0, 0.0, -0.5), 0.25), floor)
    assert wait == pytest.approx(1.0) and (contact.a, contact.b) == (1, 0)
    assert contact.arms[0] == pytest.approx((0, 0, 0)) and contact.arms[1] == pytest.approx((0.0, 0.0, -0.25))
    box = Body("box", Box((1.0, 0.5, 0.25)), 1.0, (1.0, 1.0, 1.0), (3.0, 1.0, 1.25, *STILL), (0, 0, -0.25, 0, 0, 0))
    wait, contact = meeting(floor, box)
    assert wait == pytest.approx(2.0) and contact.arms[1] == pytest.approx((0.0, 0.0, 0.0))


def test_time_at_which_balls_meet():
    left, right = ball("a", (0, 0, 0), (2.0, 0, 0), 0.25), ball("b", (3.0, 0.6, 0.0), (0, 0, 0), 0.75, 2.0)
    wait, contact = meeting(left, right, restitution=0.25, friction=0.125)
    # At the blow the centres are 1 m apart, 0.6 m of them across the way.
    assert wait == pytest.approx((3.0 - 0.8) / 2.0) and contact.normal == pytest.approx((0.8, 0.6, 0.0))
    assert contact.arms[0] == pytest.approx((0.2, 0.15, 0.0)) and contact.arms[1] == pytest.approx((-0.6, -0.45, 0.0))
    assert (contact.a, contact.b, contact.e, contact.mu) == (0, 1, 0.25, 0.125)
    for other in (
        replace(right, pose=(3.0, 1.01, 0.0, *STILL)),  # passes by
        replace(right, twist=(3.0, 0.0, 0.0, 0.0, 0.0, 0.0)),  # parts
        replace(right, twist=left.twist),  # keeps its distance
        replace(right, pose=(0.9, 0.0, 0.0, *STILL)),  # overlaps
    ):
        assert meeting(left, other) is None
    still, near = replace(left, twist=(0.0,) * 6), replace(right, pose=(1.0, 0.0, 0.0, *STILL))
    assert meeting(still, near)[0] == meeting(replace(still, motion="fixed"), near)[0] == 0.0
    assert meeting(replace(still, motion="fixed"), replace(near, motion="fixed")) is None


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e3])
def test_separating_and_resting_contacts_at_any_size(size):
    """Within `TOUCHING` of each other; what parts no faster than roundings make it counts as touching still."""
    reach = 2.0 * size
    for gap, speed, wait in (
        (0.0, 1.0, 0.0), (0.5 * TOUCHING, 1.0, 0.0), (-0.5 * TOUCHING, 1.0, 0.0), (0.0, 0.0, 0.0),
        (0.0, -0.5 * TOUCHING, 0.0), (0.0, -2.0 * TOUCHING, None), (-3.0 * TOUCHING, 1.0, None),
        (3.0 * TOUCHING, 0.5 * TOUCHING, None), (0.125 * size, 0.0, None), (0.125 * size, 1.0, 0.125 * size),
    ):  # fmt: skip
        pair = ball("a", (0, 0, 0), (speed, 0, 0), size), ball("b", (reach + gap, 0, 0), (0, 0, 0), size)
        if size == 1e3 and 0.0 < abs(gap) < 1.0:
            continue  # a gap of a billionth is a rounding there
        found = meeting(*pair)
        assert (found is None) == (wait is None), (gap, speed)
        assert found is None or found[0] == pytest.approx(wait, rel=1e-6, abs=1e-12)
    floor = Body("floor", HalfSpace((0.0, 0.0, 1.0)), motion="fixed")
    for gap, speed, wait in (
        (0.0, 1.0, 0.0), (0.0, 0.0, 0.0), (0.25 * size, 0.5, 0.5 * size), (0.25 * size, 0.0, None), (0.0, -1.0, None),
        (-0.25 * size, 1.0, None),
    ):  # fmt: skip
        found = meeting(floor, ball("a", (0, 0, size + gap), (0, 0, -speed), size))
        assert (found is None) == (wait is None), (gap, speed)
        assert found is None or found[0] == pytest.approx(wait, rel=1e-6, abs=1e-12)


def test_touch_at_exactly_the_largest_gap():
    """The least balls there are to have such a gap: their radii are a half of it."""
    half = 0.5 * TOUCHING
    assert meeting(ball("a", (0, 0, 0), (1.0, 0, 0), half), ball("b", (4.0 * half, 0, 0), (0, 0, 0), half))[0] == 0.0


def test_rubbing_ball_spin_and_stop_by_coulomb_s_law():
    """A ball that slides comes down: its friction is mu times the blow, or 2/7 of its slip if that is less."""
    floor = Body("floor", HalfSpace((0.0, 0.0, 1.0)), motion="fixed")
    for mu, rub in ((0.1, 0.1 * 1.5), (10.0, 2.0 / 7.0 * 3.0)):
        scene = space(floor, ball("ball", (0, 0, 0.75), (3.0, 0, -1.0), mass=1.0), friction=mu)
        motion, _ = singles._motion(singles.Held(scene), 1 / 64, EXACT)
        assert motion.twist[-1, 1] == pytest.approx((3.0 - rub, 0.0, 0.5, 0.0, rub * 0.5 / 0.1, 0.0))
        late = replace(EXACT, rebound_after_friction=True)
        motion, _ = singles._motion(singles.Held(scene), 1 / 64, late)
        assert motion.twist[-1, 1, 0] == pytest.approx(3.0 - min(rub, mu * 1.0))


@pytest.mark.parametrize("value", [SMALLEST, LARGEST, 1.0])
def test_ends_of_the_single_precision_range(value):
    light = ball("ball", (0, 0, 0), (0, 0, 0))
    for body in (replace(light, mass=value), replace(light, inertia=(value, 1.0, 1.0))):
        assert singles.without_a_place(space(body)) is None


def test_first_moment_beyond_single_precision():
    body, other = ball("first", (0, 0, 0), (0, 0, 0)), ball("ball", (0, 0, 0), (0, 0, 0))
    for value in (math.nextafter(SMALLEST, 0.0), math.nextafter(LARGEST, math.inf)):
        for k in range(3):
            moments = tuple(value if i == k else 1.0 for i in range(3))
            said = f"ball.inertia: {value:g} cannot be represented in single precision"
            assert singles.without_a_place(space(body, replace(other, inertia=moments))) == said
            assert singles.without_a_place(space(replace(other, inertia=moments, motion="fixed"))) is None
