"""Friction in impacts and in lasting contact: closed forms of textbooks, to round-off."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from reference_solver import Body, Box, Disc, HalfSpace, Model, Sphere
from tests.verification.event_driven.errors import LeavesClosedForm
from tests.verification.event_driven.oracle import EventDriven

G = 9.81
#: A few units in the last place of numbers of order one, over a handful of operations.
EXACT = 1e-14


def floor(angle=0.0, velocity=None):
    shape = HalfSpace((-math.sin(angle), math.cos(angle)))
    if velocity is None:
        return Body(shape, motion="fixed")
    return Body(shape, motion="prescribed", twist=(*velocity, 0.0))


def disc(height=0.5, vx=0.0, vy=0.0, spin=0.0, k=0.5, mass=1.0, radius=0.5):
    return Body(Disc(radius), mass=mass, inertia=k * mass * radius**2, pose=(0.0, height, 0.0), twist=(vx, vy, spin))


def ball(height=0.5, velocity=(0.0, 0.0, 0.0), spin=(0.0, 0.0, 0.0), radius=0.5):
    moment = 0.4 * radius**2
    pose = (0.0, 0.0, height, 1.0, 0.0, 0.0, 0.0)
    return Body(Sphere(radius), mass=1.0, inertia=(moment,) * 3, pose=pose, twist=(*velocity, *spin))


def box(vx=0.0, half=(0.5, 0.5), height=None):
    b, h = half
    inertia = (b * b + h * h) / 3.0
    return Body(Box(half), mass=1.0, inertia=inertia, pose=(0.0, h if height is None else height, 0.0),
                twist=(vx, 0.0, 0.0))  # fmt: skip


def planar(*bodies, e=0.0, mu=0.0, gravity=(0.0, -G), law="N-SEQ"):
    return EventDriven(Model(2, bodies, gravity, np.float64(e), np.float64(mu)), law)


def spatial(*bodies, e=0.0, mu=0.0, gravity=(0.0, 0.0, -G)):
    return EventDriven(Model(3, bodies, gravity, np.float64(e), np.float64(mu)))


@settings(max_examples=40)
@given(st.floats(-3, 3), st.floats(0.1, 5), st.floats(-20, 20), st.floats(0, 1), st.floats(0.01, 2))
def test_oblique_disc_by_the_closed_form(vt, vn, spin, e, mu):
    radius, k = 0.5, 0.5
    run = planar(floor(), disc(1.0, vt, -vn, spin), e=e, mu=mu, gravity=(0.0, 0.0))
    run.advance(run.next_event())
    u = vt + spin * radius
    if abs(u) * k / (1 + k) <= mu * (1 + e) * vn:
        v = (vt - k * spin * radius) / (1 + k)
        w = -v / radius
    else:
        change = mu * (1 + e) * vn * math.copysign(1.0, u)
        v, w = vt - change, spin - change / (k * radius)
    assert run.twist[1] == pytest.approx([v, e * vn, w], abs=1e-13)  # ten units in the last place of the spin


def test_a_spinning_sphere_reverses_its_spin():
    run = spatial(
        Body(HalfSpace((0.0, 0.0, 1.0)), motion="fixed", pose=(0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)),
        ball(1.0, (1.0, 0.0, -1.0), (0.0, -20.0, 0.0)), e=1.0, mu=10.0, gravity=(0.0, 0.0, 0.0),
    )  # fmt: skip
    run.advance(run.next_event())
    # v_t = 1, omega R = 10: v_t' = (v_t - k omega R) / (1 + k) = -15/7
    assert run.twist[1] == pytest.approx([-15 / 7, 0.0, 1.0, 0.0, -30 / 7, 0.0], abs=EXACT)


def test_impacts_with_friction_in_both_dimensions():
    run = planar(floor(), disc(2.0, 1.5, 0.0, 3.0, k=0.4), e=0.7, mu=0.2)
    other = spatial(
        Body(HalfSpace((0.0, 0.0, 1.0)), motion="fixed", pose=(0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)),
        ball(2.0, (1.5, 0.0, 0.0), (0.0, -3.0, 0.0)), e=0.7, mu=0.2,
    )  # fmt: skip
    run.advance(2.5)
    other.advance(2.5)
    assert len(run.events) >= 3
    assert other.twist[1, [0, 2]] == pytest.approx(run.twist[1, :2], abs=EXACT)
    assert other.pose[1, [0, 2]] == pytest.approx(run.pose[1, :2], abs=EXACT)


@pytest.mark.parametrize("e", [0.0, 0.3, 0.8])
def test_rolling_of_a_ball_thrown_sideways(e):
    # angular momentum about the contact line is kept through all bounces: v = v0 / (1 + k)
    run = planar(floor(), disc(2.0, 3.0), e=e, mu=0.15)
    run.run()
    assert run.twist[1] == pytest.approx([2.0, 0.0, -4.0], abs=1e-13)
    assert run.pose[1, 1] == 0.5


@pytest.mark.parametrize("e", [0.5, 0.9])
def test_end_of_bounces_on_a_rising_floor(e):
    rise = 0.3
    run = planar(floor(velocity=(0.0, rise)), disc(1.5, vy=rise), e=e)
    run.run()
    end = math.sqrt(2.0 / G) * (1 + e) / (1 - e)  # the drop seen from the floor
    assert run.events[-1].t == pytest.approx(end, rel=EXACT)
    assert run.twist[1, 1] == pytest.approx(rise, abs=EXACT)
    run.advance(end + 10.0)
    assert run.pose[1, 1] - 0.5 == pytest.approx(rise * (end + 10.0), abs=1e-13)


@pytest.mark.parametrize("exponent", range(1, 13))
def test_box_on_an_incline_at_the_edge_of_the_cone(exponent):
    mu = 0.5
    for sign in (-1.0, 1.0):
        slope = mu * (1.0 + sign * 10.0**-exponent)
        c = 1.0 / math.hypot(1.0, slope)
        s = slope * c
        run = planar(floor(), box(half=(0.5, 0.25)), mu=mu, gravity=(G * s, -G * c))
        run.advance(2.0)
        truth = G * (s - mu * c) if sign > 0.0 else 0.0
        assert run.twist[1] == pytest.approx([2.0 * truth, 0.0, 0.0], abs=2.0 * G * 2e-15)
        if sign < 0.0:
            assert run.twist[1].any() == 0  # not a bit of creep


def test_place_and_time_of_a_sliding_box_s_stop():
    v, mu = 3.0, 0.4
    run = planar(floor(), box(v, (1.0, 0.25)), mu=mu)
    run.run()
    assert run.events[-1].kind == "stick"
    assert run.events[-1].t == pytest.approx(v / (mu * G), rel=EXACT)
    run.advance(run.time + 100.0)
    assert run.pose[1, 0] == pytest.approx(v * v / (2.0 * mu * G), rel=EXACT)
    assert not run.twist[1].any()


def test_box_carried_by_a_belt():
    belt, mu = 2.0, 0.3
    run = planar(floor(velocity=(belt, 0.0)), box(half=(1.0, 0.25)), mu=mu)
    run.run()
    t = belt / (mu * G)
    assert run.events[-1].t == pytest.approx(t, rel=EXACT)
    assert run.twist[1] == pytest.approx([belt, 0.0, 0.0], abs=EXACT)
    assert run.pose[1, 0] - belt * t == pytest.approx(-(belt**2) / (2.0 * mu * G), rel=1e-13)


def test_refusal_of_a_box_pulled_over_its_edge():
    for lean, tips in ((0.49, False), (0.51, True)):  # b/h = 0.5
        c = 1.0 / math.hypot(1.0, lean)
        bodies, gravity = (floor(), box(half=(0.25, 0.5))), (G * lean * c, -G * c)
        if tips:
            with pytest.raises(LeavesClosedForm, match="box turns"):
                planar(*bodies, mu=1.0, gravity=gravity).advance(1.0)
        else:
            assert not planar(*bodies, mu=1.0, gravity=gravity).record([1.0]).twist[0, 1].any()


@pytest.mark.parametrize("k", [0.4, 0.5, 2 / 3, 1.0])
@pytest.mark.parametrize("rough", [0.99, 1.01])
def test_body_on_an_incline_by_friction(k, rough):
    slope = math.tan(0.4)
    mu = rough * slope * k / (1.0 + k)
    c, s = math.cos(0.4), math.sin(0.4)
    run = planar(floor(), disc(k=k), mu=mu, gravity=(G * s, -G * c))
    run.advance(2.0)
    a, turn = (G * s / (1 + k), -G * s / (1 + k) / 0.5) if rough > 1 else (G * (s - mu * c), -mu * G * c / (k * 0.5))
    assert run.twist[1] == pytest.approx([2 * a, 0.0, 2 * turn], abs=1e-13)
    assert run.pose[1] == pytest.approx([2 * a, 0.5, 2 * turn], abs=1e-13)


def test_disc_thrown_up_an_incline():
    # spins freely against the slope: friction first brakes it, then it rolls; both phases in closed form
    c, s, mu, k, r = math.cos(0.2), math.sin(0.2), 0.4, 0.5, 0.5
    v0 = -3.0
    run = planar(floor(), disc(vx=v0), mu=mu, gravity=(G * s, -G * c))
    run.advance(1.0)
    a, alpha = G * (s + mu * c), mu * G * c / (k * r)
    stick = -v0 / (a + alpha * r)
    assert run.events[0].t == pytest.approx(stick, rel=EXACT)
    after = v0 + a * stick + G * s / (1 + k) * (1.0 - stick)
    assert run.twist[1, 0] == pytest.approx(after, abs=EXACT)
    assert run.twist[1, 2] == pytest.approx(-after / r, abs=1e-13)


def test_parabola_and_roll_of_a_massed_ball():
    mu, k, r = 0.2, 0.4, 0.5
    v0, w0 = np.array([1.0, 0.5, 0.0]), np.array([6.0, 4.0, 5.0])
    plane = Body(HalfSpace((0.0, 0.0, 1.0)), motion="fixed", pose=(0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0))
    run = spatial(plane, ball(0.5, tuple(v0), tuple(w0)), mu=mu)
    u0 = v0 + np.cross(w0, [0.0, 0.0, -r])
    slip = np.linalg.norm(u0)
    end = slip * k / ((1 + k) * mu * G)
    half = 0.5 * end
    middle = v0 * half - 0.5 * mu * G * half**2 * u0 / slip
    assert run.record([half]).pose[0, 1, :2] == pytest.approx(middle[:2], abs=EXACT)
    run.run()
    assert run.events[-1].t == pytest.approx(end, rel=EXACT)
    v = v0 - u0 * k / (1 + k)
    assert run.twist[1, :3] == pytest.approx(v, abs=EXACT)
    assert run.twist[1, 5] == 5.0  # a point contact does not brake the spin about its normal
    run.advance(end + 3.0)
    reached = v0 * end - 0.5 * mu * G * end**2 * u0 / slip + 3.0 * v
    assert run.pose[1, :2] == pytest.approx(reached[:2], abs=1e-13)


def test_turn_of_a_rolling_sphere():
    plane = Body(HalfSpace((0.0, 0.0, 1.0)), motion="fixed", pose=(0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0))
    run = spatial(plane, ball(0.5, (1.0, 0.0, 0.0), (0.0, 2.0, 0.0)), mu=0.5)
    run.advance(0.7)
    assert run.pose[1, 3:] == pytest.approx([math.cos(0.7), 0.0, math.sin(0.7), 0.0], abs=EXACT)


def test_refusal_of_a_slide_across_gravity():
    plane = Body(HalfSpace((0.0, 0.0, 1.0)), motion="fixed", pose=(0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0))
    with pytest.raises(LeavesClosedForm, match="direction of sliding"):
        spatial(plane, ball(0.5, (1.0, 0.0, 0.0)), mu=0.1, gravity=(0.0, 2.0, -9.0))


def test_ball_at_rest_in_a_groove():
    sides = [floor(math.pi / 4), floor(-math.pi / 4)]
    run = planar(*sides, disc(0.5 * math.sqrt(2.0)), mu=0.3)
    run.advance(50.0)
    assert run.pose[2, :2] == pytest.approx([0.0, 0.5 * math.sqrt(2.0)], abs=1e-12)
    assert not run.events


def test_column_of_balls_at_rest():
    column = [disc(0.5 + k) for k in range(6)]
    run = planar(floor(), *column)
    run.advance(1000.0)
    assert run.pose[1:, 1].tolist() == [0.5 + k for k in range(6)]


def test_ball_hit_at_rest_on_a_floor():
    resting = disc(0.5)
    falling = Body(Disc(0.5), mass=1.0, inertia=0.125, pose=(0.0, 3.0, 0.0))
    run = planar(floor(), resting, falling, e=0.5)
    run.run()
    assert {e.kind for e in run.events} == {"impact", "rest"}
    assert run.pose[1:, 1] == pytest.approx([0.5, 1.5], abs=1e-13)
    assert not run.twist.any() or np.abs(run.twist).max() <= 1e-13


def test_refusal_of_a_ball_off_centre_on_another():
    on_top = Body(Disc(0.5), mass=1.0, inertia=0.125, pose=(0.6, 0.5 + 0.8, 0.0))
    with pytest.raises(LeavesClosedForm, match="moves over"):
        planar(floor(), disc(0.5), on_top).advance(1.0)
