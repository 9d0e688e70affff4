"""Bounds of the four scenes, worked out once more from their derivations, number by number, with units and sources."""

import math
from fnmatch import fnmatchcase

import pytest

from adapters.law import exactly
from validation import bounds
from validation.catalogue import CATALOGUE

DT = 1 / 240
#: What a thousand updates of one unit of round-off leave, with a factor of five.
ROUND_OFF = 1e-12


def checks_of(name, dimension=2, dt=DT, **params):
    canonical = CATALOGUE[name]
    return {check.metric: check for check in canonical.checks(canonical.scene(dimension, params), dt)}


def bounds_of(name, **kwargs):
    return {metric: check.bound for metric, check in checks_of(name, **kwargs).items()}


def test_bound_of_an_impact():
    found = checks_of("impact", e=0.8, v=6.0, mass=0.5)
    assert {m: (c.unit, c.bound, c.truth) for m, c in found.items()} == {
        "rebound_ratio": ("1", ROUND_OFF, pytest.approx(0.8, abs=1e-15)),
        "rebound_speed": ("m/s", ROUND_OFF * 6.0, pytest.approx(4.8, abs=1e-15)),
        "velocity_change": ("m/s", ROUND_OFF * 6.0, pytest.approx(10.8, abs=1e-14)),
        "impulse": ("N s", ROUND_OFF * 3.0, pytest.approx(5.4, abs=1e-14)),
        "momentum_defect": ("1", ROUND_OFF, 0.0),
    }
    assert {c.source for m, c in found.items() if m != "momentum_defect"} == {
        "Newton's law of restitution; one contact, no external force"
    }
    assert found["momentum_defect"].source == "conservation of momentum"


def apex_bounds(e, height, g, dt):
    """Every bounce costs (1 - e^2 + e (1 + e)/2) v dt, where v is the speed of that impact; what was lost before
    shrinks by e^2 in the next."""
    v0 = math.sqrt(2.0 * g * height)
    cost = [(1.0 - e**2 + e * (1.0 + e) / 2.0) * v0 * e**k * dt for k in range(5)]
    summed = [sum(c * e ** (2 * (n - k)) for k, c in enumerate(cost[: n + 1])) + g * dt**2 / 8.0 for n in range(5)]
    speeds = [v0 * e ** (n + 1) for n in range(5)]
    return {n + 1: bound for n, (bound, v) in enumerate(zip(summed, speeds, strict=True)) if v > 20.0 * g * dt}


@pytest.mark.parametrize(("e", "height", "g"), [(0.5, 1.0, 9.81), (0.8, 1.25, 9.81), (0.95, 1.0, 3.7)])
@pytest.mark.parametrize("dt", [1 / 60, 1 / 240, 1 / 4000])
def test_apex_bound_by_the_late_bounces_before(e, height, g, dt):
    found = checks_of("bounce", dt=dt, e=e, height=height, g=g)
    expected = {f"apex[{n}]": pytest.approx(bound, rel=1e-12) for n, bound in apex_bounds(e, height, g, dt).items()}
    apexes = {m: c for m, c in found.items() if m.startswith("apex[")}
    assert {m: c.bound for m, c in apexes.items()} == expected
    assert {m: c.truth for m, c in apexes.items()} == {
        f"apex[{n}]": pytest.approx(height * e ** (2 * n)) for n in apex_bounds(e, height, g, dt)
    }
    assert {c.unit for c in apexes.values()} <= {"m"}


def test_the_first_bounce_in_numbers():
    """e = 1/2 from 1 m under 8 m/s^2 at 1/256 s: 4 m/s, a cost of 9/8 v dt, and 8/65536/8 m of the first parabola."""
    first = checks_of("bounce", dt=1 / 256, e=0.5, height=1.0, g=8.0)["apex[1]"]
    assert first.bound == pytest.approx(9 / 8 * 4 / 256 + 1 / 65536, rel=1e-14)
    assert first.source == "energy balance of a bounce that is found late by up to dt"


def test_arc_counted_from_twenty_steps_of_gravity():
    """From 1 m under 8 m/s^2 speeds are 4, 2, 1, 0.5 m/s at e = 1/2; at 1/160 s twenty steps of gravity are 1 m/s."""
    assert {m for m in checks_of("bounce", dt=1 / 160, e=0.5, g=8.0) if m.startswith("apex[")} == {"apex[1]"}
    assert {m for m in checks_of("bounce", dt=1 / 161, e=0.5, g=8.0) if m.startswith("apex[")} == {"apex[1]", "apex[2]"}


def test_the_ratio_of_intervals_needs_three_arcs():
    assert "apex_interval_ratio" not in checks_of("bounce", dt=1 / 161, e=0.5, g=8.0)
    three = checks_of("bounce", dt=1 / 321, e=0.5, g=8.0)
    assert "apex[3]" in three and "apex[4]" not in three and "apex_interval_ratio" in three


@pytest.mark.parametrize(("e", "height", "g", "dt"), [(0.8, 1.0, 9.81, 1 / 240), (0.5, 2.0, 1.62, 1 / 960)])
def test_bound_of_intervals_between_arcs(e, height, g, dt):
    check = checks_of("bounce", dt=dt, e=e, height=height, g=g)["apex_interval_ratio"]
    v = [math.sqrt(2.0 * g * height) * e**n for n in range(4)]
    wrong_speed = {n: bound * g / v[n] for n, bound in apex_bounds(e, height, g, dt).items() if n < 4}
    first, second = (v[1] + v[2]) / g, (v[2] + v[3]) / g
    off_first = (wrong_speed[1] + wrong_speed[2]) / g + dt
    off_second = (wrong_speed[2] + wrong_speed[3]) / g + dt
    # The largest ratio that both errors allow: (second + off_second)/(first - off_first), less second/first.
    assert check.bound == pytest.approx((second + off_second) / (first - off_first) - second / first, rel=1e-9)
    assert check.truth == pytest.approx(e)
    assert (check.unit, check.source) == ("1", "t_n = (v_n + v_(n+1))/g")


@pytest.mark.parametrize(("height", "g", "dt"), [(1.0, 9.81, 1 / 240), (4.0, 8.0, 1 / 128)])
def test_growth_bound_by_the_first_parabola(height, g, dt):
    check = checks_of("bounce", dt=dt, height=height, g=g)["apex_growth"]
    assert check.bound == pytest.approx(g * (dt / 2) ** 2 / 2 / height + ROUND_OFF, rel=1e-12)
    assert (check.truth, check.unit, check.source) == (0.0, "1", "conservation of energy")


@pytest.mark.parametrize(("e", "dt"), [(0.8, 1 / 240), (0.5, 1 / 60), (0.95, 1 / 1000)])
def test_rest_bound_of_step_bounce_tail_and_phase_scatter(e, dt):
    height, g = 1.0, 9.81
    check = checks_of("bounce", dt=dt, e=e, height=height, g=g)["rest_time"]
    v0, slow = math.sqrt(2.0 * g * height), 2.0 * g * dt
    bounces = math.log(v0 / slow, 1.0 / e)
    assert v0 * e**bounces == pytest.approx(slow)
    tail = 2.0 * slow / g / (1.0 - e) / dt  # the series of flights 2 v/g from 2 g dt down
    one_phase = (1.0 - e**2) / e * 0.289 * 2.0 / (1.0 - e)
    assert check.bound == pytest.approx((bounces + tail + 4.0 * math.sqrt(bounces) * one_phase + 1.0) * dt, rel=1e-12)
    assert (check.unit, check.source) == ("s", "geometric series of bounce times")
    assert f"each of {bounces:.0f} bounces" in check.because


def test_rest_bound_of_a_ball_without_a_rebound():
    assert bounds_of("bounce", e=0.0)["rest_time"] == pytest.approx((1 + 4 + 1) * DT, rel=1e-14)


def test_rest_bound_of_a_slow_ball_with_one_bounce():
    """From g dt^2 the ball lands with sqrt(2) g dt, below the speed from which bounces are counted."""
    e, g, dt = 0.5, 8.0, 1 / 64

    def bound(bounces):
        return (bounces + 4 / 0.5 + 4 * math.sqrt(bounces) * 2 / 0.5 * 0.75 / 0.5 * 0.289 + 1) * dt

    found = bounds_of("bounce", e=e, g=g, height=g * dt * dt, dt=dt)["rest_time"]
    assert found == pytest.approx(bound(1.0), rel=1e-12)
    # From 3.125 g dt^2 it lands with 2.5 g dt, and log(1.25) to the base 2 bounces are above 2 g dt.
    found = bounds_of("bounce", e=e, g=g, height=3.125 * g * dt * dt, dt=dt)["rest_time"]
    assert found == pytest.approx(bound(math.log2(1.25)), rel=1e-12)


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize(("n", "mass", "g"), [(1, 1.0, 9.81), (5, 2.0, 3.7)])
def test_stack_bound_of_one_step_of_free_fall(dimension, n, mass, g):
    found = checks_of("stack", dimension, n=n, mass=mass, g=g, duration=5.0)
    v1, top = g * DT, n - 0.5
    assert {m: (c.unit, c.bound) for m, c in found.items()} == {
        "settle_time": ("s", pytest.approx(100 * n * DT)),
        "drift": ("m", pytest.approx(n * g * DT**2, rel=1e-12)),
        "penetration": ("m", pytest.approx(g * DT**2 + ROUND_OFF * top, rel=1e-12)),
        "kinetic_energy": ("J", pytest.approx(n * mass * v1**2 / 2e4, rel=1e-12)),
        "impulse_scatter": ("1", 0.02),
        **{f"interface_impulse[{i}]": ("1", pytest.approx(0.02 * DT)) for i in range(1, n + 1)},
        **{load: ("1", 0.02) for load in ("load[least]", "load[greatest]", "unbalanced")},
    }
    assert {m: c.truth for m, c in found.items()} == {m: 1.0 if "[" in m else 0.0 for m in found}
    assert found.pop("unbalanced").source == "equilibrium of forces on each box"
    assert {c.source for m, c in found.items() if "[" not in m} == {"static equilibrium"}
    assert {c.source for m, c in found.items() if "[" in m} == {"weight above the interface"}


def test_overlap_round_off_of_a_high_column():
    """A step so short that free fall adds less than the round-off of the place of the top body."""
    bound = checks_of("stack", n=1000, dt=1e-7, duration=5.0)["penetration"].bound
    assert bound == pytest.approx(9.81e-14 + 999.5e-12, rel=1e-9)


def test_rest_of_a_stack_in_its_last_second():
    assert bounds_of("stack", n=5, duration=2.0)["settle_time"] == pytest.approx(1.0)
    assert bounds_of("stack", n=2, duration=1.5)["settle_time"] == pytest.approx(0.5)


@pytest.mark.parametrize(("g", "duration"), [(9.81, 2.0), (3.7, 8.0)])
def test_allowed_distance_of_sticking_and_sliding_boxes(g, duration):
    (creep,) = checks_of("incline", ratio=0.9, g=g, duration=duration).values()
    assert (creep.metric, creep.unit, creep.truth) == ("creep", "m/s", 0.0)
    assert creep.bound == pytest.approx(g * DT**2 / duration, rel=1e-14)
    assert creep.source == "Coulomb's law, static"
    (slide,) = checks_of("incline", ratio=1.1, g=g, duration=duration).values()
    assert (slide.metric, slide.unit) == ("acceleration", "m/s^2")
    assert slide.bound == pytest.approx(0.01 * g * DT / (duration / 2.0), rel=1e-14)
    assert slide.source == "Coulomb's law, kinetic"
    assert "g dt/100" in slide.because
    theta = math.atan(0.55)
    assert slide.truth == pytest.approx(g * (math.sin(theta) - 0.5 * math.cos(theta)), rel=1e-12)


@pytest.mark.parametrize("name", CATALOGUE)
def test_rules_take_the_given_truth(name):
    """A rule that looked up a truth of its own would judge a scene by something else than its law."""
    scene = CATALOGUE[name].scene(CATALOGUE[name].dimensions[0])
    truth = {metric: 10.0 + k for k, metric in enumerate(CATALOGUE[name].exact(scene))}
    stated = {c.metric: c.truth for c in CATALOGUE[name].rule(scene, DT, truth) if c.metric in truth}
    assert stated == truth


#: Of every bound: worked value at g = 9 m/s^2, dt = 1/4 s, and the sentence that a user reads.
STATED = {
    "exact": ((3.0,), 3e-12, "exact law at every dt: only round-off of at most 1000 velocity updates remains"),
    "bookkeeping": (
        (4.0,),
        4e-12,
        "impulses must sum to m dv up to round-off, whatever the contact law",
    ),
    "slips": (
        (3, 9.0, 0.25),
        1.6875,
        "each of n interfaces may slip by one step of free fall, and slips add up: n g dt^2",
    ),
    "found_late": (
        (9.0, 0.25, 7e9),
        0.5625 + 7e-3,
        "one interface whose contact is found one step late: one step of free fall, g dt^2, whatever lies above",
    ),
    "landed": (
        (2.0, 9.0, 0.25, 7e9),
        0.5 + 0.5625 + 7e-3,
        "the impact is found up to one step late, v dt deep, and the rest one more step of free fall: + g dt^2",
    ),
    "still_energy": (
        (3.0, 9.0, 0.25),
        1.5 * (0.01 * 2.25) ** 2,
        "n bodies slower than the limit of motion, v1/100 = g dt/100",
    ),
    "settled": (
        (2, 0.001, 10.0),
        0.2,
        "moving at v1/100 for longer would use up the drift of n g dt^2; and the last second must be at rest",
    ),
    "carried": (
        (0.25,),
        0.005,
        "bodies slower than v1/100 before and after the last second leave 2 v1/100 of momentum unaccounted",
    ),
    "steady": ((), 0.02, "a body slower than v1/100 changes its momentum by at most 2 m v1/100 a step"),
    "straight": ((9.0, 0.25, 7e9), 0.5625 + 7e-3, "one step of a force across the path: g dt^2"),
    "stuck": (
        (9.0, 0.25, 2.0),
        0.28125,
        "a sticking box may move by one step of free fall, g dt^2, over the whole run",
    ),
    "driven": (
        (9.0, 0.25, 2.0),
        0.01125,
        "constant force is exact in every scheme: only motion below v1/100 = g dt/100 is forgiven",
    ),
}


@pytest.mark.parametrize("name", STATED)
def test_bound_with_its_number_and_reason(name):
    arguments, value, because = STATED[name]
    bound = getattr(bounds, name)(*arguments)
    assert bound.value == pytest.approx(value, rel=1e-12)
    assert bound.because == because


def test_default_scale_of_one_and_short_run_without_settling():
    assert bounds.exact().value == bounds.bookkeeping().value == 1e-12
    assert bounds.settled(2, 0.25, 10.0).value == 9.0


def test_pattern_of_a_metric_with_an_index():
    assert exactly("impulse[2]") == "impulse[[]2]"
    assert fnmatchcase("impulse[2]", exactly("impulse[2]"))
    assert not fnmatchcase("impulse2", exactly("impulse[2]"))
