"""Bounces: the scene, its closed form and its measure, each worked out by hand in numbers that are exact in binary."""

import math

import numpy as np
import pytest

from adapters.trajectory import Trajectory
from validation.catalogue import CATALOGUE
from validation.scenes import bounce

#: A fall from 1 m under 8 m/s^2 takes half a second and ends at 4 m/s.
G, HEIGHT = 8.0, 1.0


def scene(dimension=2, **params):
    return CATALOGUE["bounce"].scene(dimension, {"e": 0.5, "g": G, "height": HEIGHT, **params})


@pytest.mark.parametrize("dimension", [2, 3])
def test_a_ball_is_dropped_from_its_clearance(dimension):
    made = scene(dimension, mass=2.0, mu=0.25, height=1.5)
    floor, ball = made.bodies
    up = (0.0,) * (dimension - 1)
    assert (floor.name, floor.motion, floor.shape.normal, floor.shape.offset) == ("floor", "fixed", (*up, 1.0), 0.0)
    assert (ball.name, ball.mass, ball.shape.radius, ball.pose[:dimension]) == ("ball", 2.0, 0.5, (*up, 2.0))
    assert not any(ball.twist) and made.gravity == (*up, -G) and made.name == "bounce" and made.version == 1
    assert made.material("ball", "floor").restitution == 0.5 and made.material("ball", "floor").friction == 0.25
    assert made.params == {"e": 0.5, "height": 1.5, "g": G, "mu": 0.25, "mass": 2.0}


@pytest.mark.parametrize(
    ("e", "end"),
    [
        (0.5, 1.1 * 1.5 + 0.25),  # rest after .5 (1.5)/(.5) s, a tenth and a quarter of a second more
        (0.0, 0.5 + 0.3),  # it rests where it lands: 1.1 times .5 s and a quarter
        (1.0, 0.5 * 12.0),  # the fall and five whole arcs, and one arc more
    ],
)
def test_duration_past_rest_or_six_arcs(e, end):
    assert scene(e=e).duration == pytest.approx(end, rel=1e-12)
    # From four times the height everything takes twice as long, but for the quarter of a second.
    late = 2.0 * end if e == 1.0 else 2.0 * end - 0.25
    assert scene(e=e, height=4.0 * HEIGHT).duration == pytest.approx(late, rel=1e-12)
    assert bounce.rest_time(e, HEIGHT, G) == (math.inf if e == 1.0 else pytest.approx(0.5 * (1.0 + e) / (1.0 - e)))


def test_exact_numbers_of_a_bounce():
    assert bounce.exact(scene()) == pytest.approx(
        {f"apex[{n}]": 0.25**n for n in range(1, 6)}
        | {"apex_interval_ratio": 0.5, "apex_growth": 0.0, "force_in_flight": 0.0, "rest_time": 1.5}
    )
    assert "rest_time" not in bounce.exact(scene(e=1.0))


@pytest.mark.parametrize(
    ("t", "height"),
    [
        (0.0, 1.0),
        (0.25, 0.75),
        (0.5, 0.0),
        (0.75, 0.25),  # it leaves with 2 m/s and is at its first top a quarter of a second later
        (0.625, 0.1875),
        (1.0, 0.0),
        (1.125, 0.0625),
        (1.3125, 0.015625),
        (2.0, 0.0),  # at rest since 1.5 s
    ],
)
def test_the_exact_clearance_is_parabolas_between_exact_bounces(t, height):
    assert bounce.clearance(0.5, HEIGHT, G, t) == pytest.approx(height, abs=1e-9)
    for dimension in (2, 3):
        track = bounce.track(scene(dimension))
        assert track.body == "ball"
        assert track.position(t) == pytest.approx((*(0.0,) * (dimension - 1), 0.5 + height), abs=1e-9)


def test_rest_at_the_landing_without_restitution():
    assert [bounce.clearance(0.0, HEIGHT, G, t) for t in (0.25, 0.5, 0.75, 9.0)] == [0.75, 0.0, 0.0, 0.0]


def test_equal_apexes_without_restitution_loss():
    assert bounce.clearance(1.0, HEIGHT, G, 20.0) == pytest.approx(1.0, abs=1e-9)  # twenty whole arcs


def sampled(made, dt=1 / 64, heights=None):
    """The exact motion at every step, with the velocity of its parabolas."""
    e, up = made.params["e"], made.dimension - 1
    t = np.arange(int(made.duration / dt) + 1) * dt
    clear = np.array([bounce.clearance(e, HEIGHT, G, x) for x in t]) if heights is None else heights(t)
    pose = np.zeros((len(t), 2, 3 if made.dimension == 2 else 7))
    twist = np.zeros((len(t), 2, 3 if made.dimension == 2 else 6))
    pose[:, 1, up] = 0.5 + clear
    ahead = np.array([bounce.clearance(e, HEIGHT, G, x + 1e-7) for x in t]) if heights is None else heights(t + 1e-7)
    twist[:, 1, up] = (ahead - clear) / 1e-7
    return Trajectory(t, pose, twist, None, dt, "completed")


@pytest.mark.parametrize("dimension", [2, 3])
def test_the_exact_motion_measures_as_its_truth(dimension):
    made = scene(dimension)
    found = {name: value for name, (value, why) in bounce.measure(made, sampled(made)).items() if not why}
    truth = bounce.exact(made)
    # Samples are on the tops of arcs 1 and 2; of later ones the parabola through three samples says all.
    assert [found[f"apex[{n}]"] for n in (1, 2)] == pytest.approx([truth["apex[1]"], truth["apex[2]"]], abs=1e-6)
    assert found["apex_interval_ratio"] == pytest.approx(0.5, abs=1e-6)
    assert found["apex_growth"] == 0.0
    # Rest begins where no speed is above 2 g dt = .25 m/s any more: within the arcs from .25 m/s on, .125 s in all.
    assert 1.5 - 0.125 <= found["rest_time"] <= 1.5


def test_ball_without_a_second_rise_has_no_apex():
    made = scene()
    lying = sampled(made, heights=lambda t: np.maximum(1.0 - 4.0 * t**2, 0.0))
    found = bounce.measure(made, lying)
    assert [found[f"apex[{n}]"] for n in (1, 5)] == [
        (0.0, "there is no apex 1: the ball does not rise again"),
        (0.0, "there is no apex 5: the ball does not rise again"),
    ]
    assert "apex[6]" not in found and found["apex_growth"] == (0.0, "")
    assert found["apex_interval_ratio"] == (0.0, "there are only 0 apexes, three are needed")


def test_growth_as_the_largest_rise_of_an_apex():
    made = scene(e=1.0, height=2.0)

    def arcs(t):
        """Arcs of a second with tops 2.5, 2.25, 3 m, above a drop from 2 m."""
        tops = np.array([2.0, 2.5, 2.25, 3.0, 1.0, 1.0])
        k = np.minimum((t + 0.5).astype(int), 5)
        return np.maximum(tops[k] * (1.0 - 4.0 * (t - k) ** 2), 0.0)

    t = np.arange(5 * 64) / 64
    pose, twist = np.zeros((len(t), 2, 3)), np.zeros((len(t), 2, 3))
    pose[:, 1, 1], twist[:, 1, 1] = 0.5 + arcs(t), (arcs(t + 1e-7) - arcs(t)) / 1e-7
    found = bounce.measure(made, Trajectory(t, pose, twist, None, 1 / 64, "completed"))
    assert [found[f"apex[{n}]"][0] for n in (1, 2, 3)] == pytest.approx([2.5, 2.25, 3.0], abs=1e-9)
    assert found["apex_growth"][0] == pytest.approx(0.375)  # .75 m over a drop of 2 m; the first rise is .5 m


def apexes(*heights):
    return {f"apex[{n}]": (h, "") for n, h in enumerate(heights, 1)}


def test_apex_error_over_resolved_apexes_relative_to_the_drop():
    """Speeds are 4, 2, 1, .5 m/s; twenty steps of gravity at 1/256 s are .625 m/s: two arcs count, a third does not."""
    made = scene()
    exact = (0.25, 0.0625, 0.015625, 0.0, 0.0)
    assert bounce.apex_error(made, 1 / 256, apexes(*exact)) == (0.0, "")
    assert bounce.apex_error(made, 1 / 256, apexes(0.375, 0.0625, 9.0, 9.0, 9.0)) == (0.125, "")
    assert bounce.apex_error(made, 1 / 256, apexes(0.25, 0.0, 9.0, 9.0, 9.0)) == (0.0625, "")
    assert bounce.apex_error(made, 1 / 256, apexes(0.0, 0.0, 9.0, 9.0, 9.0)) == (0.25, "")
    doubled = apexes(1.0, 0.125, 0.03125, 9.0, 9.0)  # from 2 m an apex of .5 m is true; .5 m is a quarter of 2 m
    assert bounce.apex_error(scene(height=2.0), 1 / 256, doubled) == (0.25, "")
    assert bounce.apex_error(made, 1 / 80, apexes(9.0, 9.0, 9.0, 9.0, 9.0)) == (
        None, "no apex is resolved at this step")  # fmt: skip
    assert bounce.apex_error(made, 1 / 81, apexes(0.5, 9.0, 9.0, 9.0, 9.0)) == (0.25, "")
    missing = apexes(0.375, 9.0, 9.0, 9.0, 9.0) | {"apex[2]": (None, "gone")}
    assert bounce.apex_error(made, 1 / 256, missing) == (0.125, "")


def test_nan_apex_without_an_error():
    for heights in ((math.nan, 0.0625, 0.0, 0.0, 0.0), (0.25, math.nan, 0.0, 0.0, 0.0)):
        value, why = bounce.apex_error(scene(), 1 / 256, apexes(*heights))
        assert math.isnan(value) and why == ""


@pytest.mark.parametrize(("apex", "e"), [(0.5, 0.5), (2.0, 1.0), (0.0, 0.0), (-0.1, 0.0)])
def test_an_apex_shows_a_restitution(apex, e):
    assert bounce.rebound({"height": 2.0}, apex) == e


def test_standard_suite_of_sixteen_heights_and_four_restitutions():
    standard = [dict(variation.params) for variation in CATALOGUE["bounce"].standard]
    assert standard == [{"e": 0.8, "height": pytest.approx(1.0 + 0.01 * k)} for k in range(16)] + [
        {"e": e, "height": 1.0} for e in (0.5, 0.95, 1.0)
    ]
    full = {(v.params["e"], round(v.params["height"], 2)) for v in CATALOGUE["bounce"].full}
    assert full == {(e, round(1.0 + 0.01 * k, 2)) for e in (0.5, 0.8, 0.95, 1.0) for k in range(16)}


def test_a_ball_from_four_metres_falls_for_a_second():
    """It leaves the floor with 4 m/s, is up at 1 m half a second later and down again after a whole one."""
    for t, height in ((0.5, 3.0), (1.0, 0.0), (1.5, 1.0), (2.0, 0.0), (2.25, 0.25), (3.5, 0.0)):
        assert bounce.clearance(0.5, 4.0, G, t) == pytest.approx(height, abs=1e-9)


def test_all_five_apexes_count_where_all_are_resolved():
    """The fifth arc starts with 4/32 m/s, above twenty steps of gravity at 1/2048 s, .078 m/s."""
    exact = tuple(0.25**n for n in range(1, 6))
    assert bounce.apex_error(scene(), 1 / 2048, apexes(*exact)) == (0.0, "")
    last = (*exact[:4], exact[4] + 0.5)
    assert bounce.apex_error(scene(), 1 / 2048, apexes(*last)) == (0.5, "")


def test_resolution_by_the_speed_of_the_whole_fall():
    """From 2 m it lands with sqrt(32) = 5.66 m/s; half of that is above twenty steps of 8 m/s^2/80, 2 m/s."""
    assert bounce.apex_error(scene(height=2.0), 1 / 80, apexes(0.5, 9.0, 9.0, 9.0, 9.0)) == (0.0, "")


@pytest.mark.parametrize(("speed", "counts"), [(0.24, False), (0.26, True), (0.36, True)])
def test_motion_counts_from_two_steps_of_gravity_on(speed, counts):
    """At 1/64 s that is .25 m/s: for the end of motion, and for an arc to be one."""
    made = scene()
    found = sampled(made)
    found.twist[:, 1, 1] = 0.0
    found.twist[70, 1, 1], found.twist[71, 1, 1] = speed, -speed
    found.pose[:, 1, 1] = 0.5
    found.pose[70:72, 1, 1] = 0.5 + 0.125
    measured = bounce.measure(made, found)
    assert measured["rest_time"] == (72 / 64 if counts else 0.0, "")
    assert measured["apex[1]"][0] == pytest.approx(0.140625 if counts else 0.0)  # of 0, 1/8, 1/8, 0 m


def test_interval_smaller_than_its_errors_has_no_bound():
    """Intervals of 3/8 and 3/16 s after arcs of 2, 1 and .5 m/s; the errors of the speeds take up to 3/8 s or more."""
    for errors in ([1.0, 1.0, 0.0], [9.0, 0.0, 0.0]):
        assert bounce._interval_check(0.5, HEIGHT, G, 1 / 8, errors, 0.5).bound == np.inf
    # The first interval may be shorter by 1/4 s + 1/8 s less a hair: what is left of it is that hair.
    hair = 2.0**-20
    tight = bounce._interval_check(0.5, HEIGHT, G, 1 / 8, [1.0, 1.0 - 8.0 * hair, 0.0], 0.5)
    assert tight.bound == pytest.approx((0.25 - hair + 0.5 * (0.375 - hair)) / hair)
    # An error of the third arc alone is one of the second interval alone, 9/8 s of it.
    late = bounce._interval_check(0.5, HEIGHT, G, 1 / 8, [0.0, 0.0, 8.0], 0.5)
    assert late.bound == pytest.approx((1.125 + 0.5 * 0.125) / 0.25)


def test_rest_at_a_step_that_tells_one_bounce():
    """The ball lands with 4 m/s, twice g dt at 1/4 s: one bounce, a tail of 8 dt, four times its scatter, one step."""
    found = {check.metric: check.bound for check in bounce.checks(scene(), 1 / 4, bounce.exact(scene()))}
    scatter = 4.0 * (1.0 - 0.25) / 0.5 * 0.289 * 2.0 / (1.0 - 0.5)
    assert found["rest_time"] == pytest.approx((1.0 + 8.0 + scatter + 1.0) / 4)


def test_every_restitution_is_dropped_from_every_height():
    made = [dict(variation.params) for variation in bounce._from_all_heights(0.25, 0.75)]
    assert made == [{"e": e, "height": pytest.approx(1.0 + 0.01 * k)} for e in (0.25, 0.75) for k in range(16)]
