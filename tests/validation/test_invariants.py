"""What is judged in any scene: right motions pass whatever their speed, spin and length; each fault fails."""

import math
from dataclasses import replace

import numpy as np
import pytest

from adapters.scene import Body, Box, Disc, HalfSpace, Pair, Scene, Sphere
from adapters.trajectory import Trajectory
from validation import metrics
from validation.files import invariants
from validation.files.mass_properties import moments, volume

DT = 1 / 240


def ball(name="ball", **changed):
    values = {"mass": 2.0, "inertia": 0.09, "pose": (0.0, 1.0, 0.0)} | changed
    return Body(name, Disc(0.3), **values)


def over_floor(*bodies, gravity=(0.0, -9.81), duration=2.0):
    floor = Body("floor", HalfSpace((0.0, 1.0), 0.0), motion="fixed")
    return Scene("drop", 1, 2, (floor, *bodies), (Pair(restitution=1.0),), gravity, duration)


def moved(scene, *paths, dt=DT):
    """Trajectory of the free bodies along ``paths``: each gives (pose (s, 3), twist (s, 3))."""
    steps = len(paths[0][0])
    pose, twist = np.zeros((steps, len(scene.bodies), 3)), np.zeros((steps, len(scene.bodies), 3))
    for k, (poses, twists) in enumerate(paths, start=1):
        pose[:, k], twist[:, k] = poses, twists
    return Trajectory(np.arange(steps) * dt, pose, twist, None, dt, "completed")


def verdicts(scene, trajectory, dt=DT):
    """Pass or fail of both checks."""
    values = {
        "energy_growth": invariants.energy_growth(scene, trajectory)[0],
        "penetration": invariants.deepest(scene, trajectory)[0][0],
    }
    return {c.metric: values[c.metric] <= c.bound for c in invariants.checks(scene, dt) if c.truth is not None}


def bounced(height, speed, g, e, order, steps, dt=DT, radius=0.3):
    """Independent stepper of a ball over a floor, both orders of a step; the reflection takes the step's own speed."""
    y, v, rows = height, speed, []
    for _ in range(steps):
        rows.append((y, v))
        if order == "position first":
            y += v * dt
        hits = y <= radius and v < 0.0
        rests = y <= radius and abs(v) <= 2.0 * g * dt  # a rebound that ends within the step that made it
        v = 0.0 if rests else -e * v if hits else v - g * dt
        if order == "velocity first":
            y += v * dt
    states = np.array(rows)
    zero = np.zeros(steps)
    return np.column_stack([zero, states[:, 0], zero]), np.column_stack([zero, states[:, 1], zero])


@pytest.mark.parametrize("order", ["velocity first", "position first"])
@pytest.mark.parametrize("e", [0.3, 1.0])
@pytest.mark.parametrize(("speed", "g"), [(0.0, 9.81), (-60.0, 9.81), (-60.0, 0.0), (-1e-6, 0.0)])
def test_bouncing_ball_in_both_orders(order, e, speed, g):
    scene = over_floor(ball(twist=(0.0, speed, 0.0)), gravity=(0.0, -g))
    assert verdicts(scene, moved(scene, bounced(1.0, speed, g, e, order, 480))) == {
        "energy_growth": True,
        "penetration": True,
    }


def test_slowly_sinking_body():
    """The bound used to be g times the duration as a speed: 1.6 m in 40 s at this step."""
    for rate in (0.01, 0.1):
        scene = over_floor(ball(pose=(0.0, 0.3, 0.0)), duration=40.0)
        steps = 9600
        depth = np.minimum(rate * np.arange(steps) * DT, 1.5)
        pose = np.column_stack([np.zeros(steps), 0.3 - depth, np.zeros(steps)])
        twist = np.column_stack([np.zeros(steps), np.where(depth < 1.5, -rate, 0.0), np.zeros(steps)])
        assert not verdicts(scene, moved(scene, (pose, twist)))["penetration"]


def test_missing_contact_after_two_steps():
    scene = over_floor(ball(pose=(0.0, 0.3, 0.0)))
    steps = np.arange(4.0)
    pose = np.column_stack([0.0 * steps, 0.3 - 9.81 * DT**2 * steps * (steps + 1.0) / 2.0, 0.0 * steps])
    twist = np.column_stack([0.0 * steps, -9.81 * DT * steps, 0.0 * steps])
    for last, passes in ((2, True), (4, False)):
        assert verdicts(scene, moved(scene, (pose[:last], twist[:last])))["penetration"] is passes


def test_allowed_late_step_of_two_closing_bodies():
    """10 m/s each: their overlap after one step is 20 m/s times dt, which neither body's own speed explains."""
    scene = over_floor(ball("a", pose=(-1.0, 5.0, 0.0)), ball("b", pose=(1.0, 5.0, 0.0)), gravity=(0.0, 0.0))
    x = np.array([-0.31, -0.31 + 10.0 * DT, -0.31 + 10.0 * DT])
    v = np.array([10.0, 10.0, 0.0])

    def path(sign):
        return np.column_stack([sign * x, 5.0 + 0.0 * x, 0.0 * x]), np.column_stack([sign * v, 0.0 * v, 0.0 * v])

    assert verdicts(scene, moved(scene, path(1.0), path(-1.0)))["penetration"]
    x[2] += 0.5 * 10.0 * DT  # half a step deeper after the contact was found
    v[2] = 1.0
    assert not verdicts(scene, moved(scene, path(1.0), path(-1.0)))["penetration"]


@pytest.mark.parametrize("spin", [0.0, 200.0])
def test_spin_brings_a_corner_down_and_is_known(spin):
    """A box turning at 200 rad/s about a fixed centre: a corner dips 200 rad/s times 0.7 m times dt at most."""
    box = Body("box", Box((0.5, 0.5)), 1.0, 1.0 / 6.0, (0.0, 0.69, 0.0), (0.0, 0.0, spin))
    scene = over_floor(box, gravity=(0.0, 0.0))
    angle = np.array([0.0, 0.25 * math.pi, 0.25 * math.pi])
    pose = np.column_stack([0.0 * angle, 0.69 + 0.0 * angle, angle])
    twist = np.column_stack([0.0 * angle, 0.0 * angle, [spin, 0.0, 0.0]])
    assert verdicts(scene, moved(scene, (pose, twist)))["penetration"] is (spin > 0.0)


@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e9])
def test_growth_without_loads_to_round_off_of_the_energy(scale):
    """A bound of 1e-12 J forgives everything a light scene does and nothing a heavy one must do."""
    scene = over_floor(ball(mass=2.0 * scale, inertia=0.09 * scale, twist=(3.0, 0.0, 1.0)), gravity=(0.0, 0.0))
    t = np.arange(100) * DT
    pose = np.column_stack([3.0 * t, 1.0 + 0.0 * t, t])
    for growth, passes in ((1e-15, True), (1e-9, False)):
        speed = 3.0 * np.sqrt(1.0 + np.where(t > 0.1, growth, 0.0))
        twist = np.column_stack([speed, 0.0 * t, 1.0 + 0.0 * t])
        assert verdicts(scene, moved(scene, (pose, twist)))["energy_growth"] is passes


def test_energy_of_a_constant_torque_is_no_growth():
    scene = over_floor(ball(torque=(3.0,)), gravity=(0.0, 0.0))
    rate = 3.0 / 0.09
    for order in (0.0, 1.0):  # spin before or after the step's torque
        t = np.arange(200) * DT
        spin = rate * t
        angle = np.concatenate([[0.0], np.cumsum((spin[:-1] + order * rate * DT) * DT)])
        pose = np.column_stack([0.0 * t, 1.0 + 0.0 * t, angle])
        twist = np.column_stack([0.0 * t, 0.0 * t, spin])
        assert verdicts(scene, moved(scene, (pose, twist)))["energy_growth"]
        assert not verdicts(scene, moved(scene, (pose, 1.02 * twist)))["energy_growth"]


def test_restitution_of_a_gravity_step_as_growth():
    scene = over_floor(ball())
    rows, (y, v) = [], (1.0, 0.0)
    for _ in range(480):
        rows.append((y, v))
        v -= 9.81 * DT
        v = -v if y <= 0.3 and v < 0.0 else v
        y += v * DT
    states = np.array(rows)
    zero = np.zeros(len(states))
    path = np.column_stack([zero, states[:, 0], zero]), np.column_stack([zero, states[:, 1], zero])
    assert not verdicts(scene, moved(scene, path))["energy_growth"]


@pytest.mark.parametrize(
    ("shape", "restitution", "friction", "judged"),
    [
        (Box((0.5, 0.5)), 1.0, 0.5, False),
        (Box((0.5, 0.5)), 0.0, 0.5, True),
        (Box((0.5, 0.5)), 1.0, 0.0, True),
        (Disc(0.5), 1.0, 0.5, True),
    ],
)
def test_energy_judged_unless_the_requested_law_adds_some(shape, restitution, friction, judged):
    floor = Body("floor", HalfSpace((0.0, 1.0), 0.0), motion="fixed")
    body = Body("body", shape, pose=(0.0, 1.0, 0.0))
    scene = Scene("drop", 1, 2, (floor, body), (Pair("*", "*", restitution, friction),), (0.0, -9.81), 1.0)
    (energy,) = (check for check in invariants.checks(scene, DT) if check.metric == "energy_growth")
    assert (energy.truth is not None) is judged


def test_energy_added_to_a_rod_by_newton_s_law():
    """Kane's paradox, solved by hand: a rod at 45 degrees, e = 1, whose slip reverses within the impact."""
    e, mu, gain = 1.0, 0.5, 0.0
    for slope in np.linspace(0.2, 1.4, 60):
        for slip in np.linspace(-4.0, 4.0, 80):
            rx, ry = math.cos(slope), -math.sin(slope)  # contact from the centre, half length 1, m = 1, I = 1/3
            k = np.array([[1.0 + 3.0 * ry * ry, -3.0 * rx * ry], [-3.0 * rx * ry, 1.0 + 3.0 * rx * rx]])
            before = np.array([slip, -1.0])
            impulse = np.linalg.solve(k, np.array([0.0, e]) - before)  # sticks: tangential speed 0, normal e
            if abs(impulse[0]) > mu * impulse[1]:  # slips one way or the other
                side = math.copysign(mu, impulse[0])
                impulse = np.array([side, 1.0]) * (1.0 + e) / (k[1, 0] * side + k[1, 1])
            after = before + k @ impulse
            gain = max(gain, 0.5 * float(impulse @ (before + after)))
    assert gain > 0.01


def test_bounds_do_not_grow_with_the_duration():
    short, long = (over_floor(ball(), duration=duration) for duration in (1.0, 1000.0))
    assert invariants.overlap_bound(short, DT) == invariants.overlap_bound(long, DT)
    assert invariants.energy_bound(short, DT) == invariants.energy_bound(long, DT)


@pytest.mark.parametrize("shape", [Disc(0.7), Sphere(0.7), Box((0.3, 0.8)), Box((0.3, 0.8, 0.5))])
def test_mass_properties_are_the_integrals_over_the_body(shape):
    """Mid-point sums over a fine grid of cells: error of second order in the cell, 1e-2 at 60 cells a side."""
    d = 3 if isinstance(shape, Sphere) else len(getattr(shape, "half_extents", (0, 0)))
    half = getattr(shape, "half_extents", (0.7,) * d)
    axes = [np.linspace(-h, h, 121)[1::2] for h in half]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, d)
    if isinstance(shape, Disc | Sphere):
        points = points[np.linalg.norm(points, axis=1) <= shape.radius]
    content = len(points) * math.prod(2.0 * h / 60.0 for h in half)
    assert volume(shape) == pytest.approx(content, rel=1e-2)
    squares = (points**2).mean(axis=0)
    expected = squares.sum() if d == 2 else [squares[1] + squares[2], squares[2] + squares[0], squares[0] + squares[1]]
    assert moments(shape, 1.0, d) == pytest.approx(expected, rel=1e-2)


def test_infinite_bounds_judge_nothing_without_a_warning():
    """Found by `make soak`: two kilograms under 1e308 m/s^2 weigh more than a number can say."""
    scene = over_floor(ball(mass=2.0), gravity=(0.0, -1e308))
    assert invariants.energy_bound(scene, DT) == math.inf
    (energy, *_) = invariants.checks(scene, DT)
    assert energy.metric == "energy_growth" and not energy.is_finite


# ---- each number once more, by hand --------------------------------------------------------------------------------

STEP = 1 / 64


def test_unit_and_reason_of_both_checks():
    scene = over_floor(ball())
    energy, depth = invariants.checks(scene, STEP)
    assert (energy.metric, energy.unit, energy.truth, energy.bound) == (
        "energy_growth", "J", 0.0, invariants.energy_bound(scene, STEP))  # fmt: skip
    assert (depth.metric, depth.unit, depth.truth, depth.bound) == (
        "penetration", "m", 0.0, invariants.overlap_bound(scene, STEP))  # fmt: skip
    assert energy.source == "contacts do not add energy (e <= 1)" and depth.source == "bodies are impenetrable"
    assert energy.because.startswith("velocity and position are half a step apart, which changes a conserved energy")
    assert depth.because.startswith("a contact is found at most one step late")


def test_energy_with_a_source_shown_without_a_truth():
    pusher = Body("pusher", Disc(0.5), pose=(5.0, 5.0, 0.0), twist=(1.0, 0.0, 0.0), motion="prescribed")
    energy, depth = invariants.checks(over_floor(ball(), pusher), STEP)
    assert (energy.truth, energy.bound) == (None, None)
    assert energy.because == "shown: a prescribed body may add energy"
    assert invariants.fed_by(over_floor(pusher)) == "a prescribed body may add energy"
    assert depth.truth == 0.0
    assert invariants.fed_by(over_floor(ball())) == ""


def box(name="box", x=0.0, **changed):
    return Body(name, Box((0.5, 0.5)), **{"mass": 2.0, "inertia": 0.5, "pose": (x, 1.0, 0.0)} | changed)


@pytest.mark.parametrize(
    ("pairs", "fed"),
    [
        ((Pair("box", "floor", 0.5, 0.25),), True),
        ((Pair("box", "floor", 0.5, 0.0),), False),
        ((Pair("box", "floor", 0.0, 0.25),), False),
        # Restitution here and friction there are no paradox, and neither is one of round bodies.
        ((Pair("box", "floor", 0.5, 0.0), Pair("box", "ball", 0.0, 0.25)), False),
        ((Pair("ball", "floor", 0.5, 0.25),), False),
        ((Pair("ball", "floor", 0.5, 0.25), Pair("box", "floor", 0.5, 0.0), Pair("box", "ball", 0.0, 0.25)), False),
        ((Pair("box", "ball", 0.5, 0.25),), True),
    ],
)
def test_pairs_that_allow_kane_s_paradox(pairs, fed):
    floor = Body("floor", HalfSpace((0.0, 1.0), 0.0), motion="fixed")
    for bodies in ((floor, box(), ball()), (floor, ball(), box())):
        scene = Scene("drop", 1, 2, bodies, pairs, (0.0, -9.81), 1.0)
        assert invariants.fed_by(scene) == (
            "Newton's restitution with friction can add energy where a box is hit off its centre (Kane's paradox)"
            if fed else "")  # fmt: skip


def test_fixed_box_has_no_rotation():
    wall = Body("wall", Box((0.5, 0.5)), motion="fixed", pose=(9.0, 1.0, 0.0))
    scene = Scene("drop", 1, 2, (wall, ball()), (Pair("*", "*", 0.5, 0.25),), (0.0, 0.0), 1.0)
    assert invariants.fed_by(scene) == ""


def test_energy_bound_by_work_of_loads_and_round_off():
    """Loads 2 (0, -8) + (6, 28) = (6, 12) and 4 (0, -8) = (0, -32); bounds in binary numbers."""
    one = ball("one", force=(6.0, 28.0), torque=(3.0,), inertia=0.5, pose=(3.0, 4.0, 0.0), twist=(0.0, 2.0, 4.0))
    two = ball("two", mass=4.0, pose=(0.0, 2.0, 0.0))
    kicked = Body("kicked", Disc(9.0), mass=64.0, pose=(50.0, 1.0, 0.0), twist=(9.0, 9.0, 9.0), motion="prescribed")
    scene = over_floor(one, two, kicked, gravity=(0.0, -8.0))
    work = ((36.0 + 144.0) / 2.0 + 9.0 / 0.5 + 32.0**2 / 4.0) * STEP**2
    assert invariants.energy_bound(scene, STEP) == pytest.approx(work, rel=1e-6)
    at_play = 0.5 * 2.0 * 4.0 + 0.5 * 0.5 * 16.0 + math.sqrt(180.0) * 5.0 + 32.0 * 2.0
    size = 0.5 * (2.0 + 4.0) * 1e-12 * (0.3 / STEP) ** 2
    assert invariants.energy_bound(scene, STEP) - work == pytest.approx(1e-12 * (at_play + size), rel=1e-3, abs=0.0)


def test_round_off_of_a_body_without_load():
    scene = over_floor(box(mass=2.0, pose=(0.0, 0.0, 0.0)), gravity=(0.0, 0.0))
    reach = math.sqrt(0.5)
    assert invariants.energy_bound(scene, STEP) == pytest.approx(1e-24 * (reach / STEP) ** 2, rel=1e-12, abs=0.0)


def test_least_moment_for_torque_and_largest_for_spin():
    floor = Body("floor", HalfSpace((0.0, 0.0, 1.0), 0.0), motion="fixed")
    pose = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
    body = Body("body", Box((0.5, 0.5, 0.5)), 1.0, (0.5, 0.25, 1.0), pose, torque=(1.0, 2.0, 2.0))
    scene = Scene("s", 1, 3, (floor, body), (Pair(),), (0.0, 0.0, 0.0), 1.0)
    assert invariants.energy_bound(scene, STEP) == pytest.approx(9.0 / 0.25 * STEP**2, rel=1e-6)
    turning = 3.0 * math.sqrt(0.75) / 0.25
    assert invariants.overlap_bound(scene, STEP) == pytest.approx(turning * STEP**2, rel=1e-6)
    spun = Body("body", Sphere(1e-9), 1.0, (0.5, 0.25, 1.0), pose, (0.0, 0.0, 0.0, 2.0, 0.0, 0.0))
    scene = Scene("s", 1, 3, (floor, spun), (Pair(),), (0.0, 0.0, 0.0), 1.0)
    assert invariants.energy_bound(scene, STEP) == pytest.approx(1e-12 * 0.5 * 1.0 * 4.0, rel=1e-6, abs=0.0)


def test_overlap_bound_by_the_two_strongest_loads():
    """Accelerations 8, 8 + 3 of a push, and 8 + 2 (.707)/.5 of a torque on a box; no torque moves a rim."""
    bodies = (
        ball("a", torque=(5.0,)), ball("b", force=(0.0, -6.0)),
        box("c", torque=(2.0,)), ball("d", mass=1.0),
    )  # fmt: skip
    scene = over_floor(*bodies, gravity=(0.0, -8.0))
    most = 8.0 + 3.0 + 8.0 + 2.0 * math.sqrt(0.5) / 0.5
    place = 1.0 + math.sqrt(0.5)  # of the box, the farthest outermost point
    assert invariants.overlap_bound(scene, STEP) == pytest.approx(most * STEP**2, rel=1e-9)
    assert invariants.overlap_bound(scene, STEP) - most * STEP**2 == pytest.approx(1e-12 * place, rel=1e-3, abs=0.0)
    alone = over_floor(ball(), gravity=(0.0, -8.0))
    assert invariants.overlap_bound(alone, STEP) == pytest.approx(8.0 * STEP**2 + 1.3e-12, rel=1e-12)


def test_fixed_body_by_its_place_and_not_its_weight():
    wall = Body("wall", Box((0.5, 0.5)), mass=1e-9, motion="fixed", pose=(3e9, 4e9, 0.0))
    scene = over_floor(ball(), wall, gravity=(0.0, -8.0))
    assert invariants.overlap_bound(scene, STEP) == pytest.approx(8.0 * STEP**2 + 5e-3, rel=1e-9)


def resting(scene, overlaps, dt=STEP, speed=0.0):
    """One ball of radius .3 m over the floor, as deep in it as ``overlaps`` say, moving down at ``speed``."""
    n = len(overlaps)
    pose = np.column_stack([np.zeros(n), 0.3 - np.asarray(overlaps), np.zeros(n)])
    twist = np.column_stack([np.zeros(n), np.full(n, -speed), np.zeros(n)])
    return moved(scene, (pose, twist), dt=dt)


def test_allowed_overlap_of_an_approach():
    scene = over_floor(ball())
    step = 2.0 * STEP

    def beyond(*overlaps):
        return invariants.deepest(scene, resting(scene, overlaps, speed=2.0))

    assert beyond(-0.1, -0.1, step) == ((0.0, ""), (pytest.approx(step), ""))
    found, depth = beyond(-0.1, 1.5 * step, -0.1)
    assert (found[0], depth[0]) == (pytest.approx(0.5 * step), pytest.approx(1.5 * step))
    assert beyond(0.125, 0.125 + step)[0] == (pytest.approx(0.0, abs=1e-15), "")  # what it starts with is its author's
    assert beyond(0.125, -0.1, 0.125)[0][0] == pytest.approx(0.125 - step)  # and no one's once it has left
    assert beyond(-0.1, 0.125)[0][0] == pytest.approx(0.125 - step)
    assert beyond(-0.1, -0.1) == ((0.0, ""), (0.0, ""))


def test_longest_step_since_an_overlap_began():
    granted = invariants._granted(np.array([0.0, 0.1, 0.1, 0.0, 0.1]), np.array([1.0, 2.0, 1.5, 0.25, 0.125]), 0.0)
    assert granted.tolist() == [0.0, 2.0, 2.0, 0.0, 0.25]
    granted = invariants._granted(np.array([0.5, 0.1, 0.1, 0.0, 0.1]), np.array([0.5, 2.0, 1.5, 0.25, 0.125]), 0.0)
    assert granted.tolist() == [1.0, 2.5, 2.5, 0.0, 0.25]


@pytest.mark.parametrize(("speed", "ends"), [(0.0, True), (1e-3, True), (2e-3, False)])
def test_end_of_the_overlap_of_an_approach(speed, ends):
    """A fall of 0.01 m in a step: at rest for 5 steps the load would have moved it by 0.125 m, more than the depth."""
    step = np.array([0.2, *(speed * 0.01,) * 9])
    granted = invariants._granted(np.array([0.0, *(0.1,) * 9]), step, 0.01)
    assert granted[:5].tolist() == [0.0, *(0.2,) * 4]
    assert granted[5:].tolist() == [speed * 0.01 if ends else 0.2] * 5


def test_overlap_of_a_ball_at_rest_in_the_floor():
    """Found a step late it may be 0.02 m deep; there it stays."""
    scene = over_floor(ball())
    blow = resting(scene, [-0.1, *(0.02,) * 200], speed=0.0)
    twist = np.array(blow.twist)
    twist[:2, 1, 1] = -0.02 / STEP
    (beyond, _), (depth, _) = invariants.deepest(scene, replace(blow, twist=twist))
    assert beyond == depth == pytest.approx(0.02)


def test_approach_speed_along_normals_or_centres_with_spin():
    floor = Body("floor", HalfSpace((0.6, 0.8), 0.0), motion="fixed")
    scene = Scene("s", 1, 2, (floor, box(), ball(pose=(9.0, 9.0, 0.0))), (Pair(),), (0.0, 0.0), 1.0)
    twist = np.zeros((2, 3, 3))
    twist[:, 1], twist[:, 2] = [(5.0, 0.0, 2.0), (0.0, 5.0, -4.0)], [(2.0, 4.0, 9.0), (0.0, 5.0, 9.0)]
    trajectory = Trajectory(np.arange(2.0), np.zeros((2, 3, 3)), twist, None, 1.0, "completed")
    reach = math.sqrt(0.5)
    assert invariants.approach(scene, trajectory, 0, 1) == pytest.approx([3.0 + 2.0 * reach, 4.0 + 4.0 * reach])
    assert invariants.approach(scene, trajectory, 0, 2) == pytest.approx([1.2 + 3.2, 4.0])
    assert invariants.approach(scene, trajectory, 1, 2) == pytest.approx([5.0 + 2.0 * reach, 4.0 * reach])


def test_growth_less_half_a_step_of_power():
    """A ball of 2 kg under a force of 16 N across, no gravity; speeds 0, 1, 3, 2 m/s while it stays where it is."""
    scene = over_floor(ball(force=(16.0, 0.0)), gravity=(0.0, 0.0))
    speed = np.array([0.0, 1.0, 3.0, 2.0])
    pose = np.column_stack([np.full(4, 7.0), np.full(4, 1.0), np.zeros(4)])
    twist = np.column_stack([speed, np.zeros(4), np.zeros(4)])
    growth, why = invariants.energy_growth(scene, moved(scene, (pose, twist), dt=STEP))
    assert (growth, why) == (pytest.approx(9.0 - 0.5 * STEP * 16.0 * 3.0), "")
    growth, _ = invariants.energy_growth(scene, moved(scene, (pose, twist[::-1]), dt=STEP))
    assert growth == pytest.approx(5.0 - 0.5 * STEP * 16.0 * (3.0 + 2.0))  # from 2 m/s to 3 m/s
    moving = pose + np.outer([0.0, 0.25, 0.5, 0.75], [1.0, 0.0, 0.0])
    growth, _ = invariants.energy_growth(scene, moved(scene, (moving, twist), dt=STEP))
    assert growth == pytest.approx(9.0 - 16.0 * 0.5 - 0.5 * STEP * 16.0 * 3.0)  # the load's work is none
    assert invariants.energy_growth(scene, moved(scene, (pose, 0.0 * twist), dt=STEP)) == (0.0, "")


@pytest.mark.filterwarnings("ignore:overflow:RuntimeWarning", "ignore:invalid value:RuntimeWarning")
def test_infinite_energy_as_growth():
    """A body that explodes to 1e160 m/s: its energy and what round-off makes of it are both infinite."""
    scene = over_floor(ball(), gravity=(0.0, 0.0))
    speed = np.array([0.0, 1.0, 1e160, 1e160])
    pose = np.column_stack([np.full(4, 7.0), np.full(4, 1.0), np.zeros(4)])
    twist = np.column_stack([speed, np.zeros(4), np.zeros(4)])
    growth, _ = invariants.energy_growth(scene, moved(scene, (pose, twist), dt=STEP))
    assert not np.isfinite(growth)


def test_energy_growth_without_round_off_of_the_work():
    """Two balls that fall at 4 m/s each under 8 m/s^2; and one that has come far under a load that moves little."""
    scene = over_floor(ball("a"), ball("b"), gravity=(0.0, -8.0))
    speed = np.array([0.0, -4.0])
    path = np.column_stack([np.zeros(2), np.ones(2), np.zeros(2)]), np.column_stack([np.zeros(2), speed, np.zeros(2)])
    growth, _ = invariants.energy_growth(scene, moved(scene, path, path, dt=STEP))
    assert growth == pytest.approx(2.0 * 16.0 - 2.0 * 0.5 * STEP * 16.0 * 4.0)
    far = over_floor(ball(mass=2.0), gravity=(-8.0, 0.0))
    # Across the load: no work, and a path of 4e9 m and then of 3e9 m.
    pose = np.array([(5e9, 0.0, 0.0), (5e9, 4e9, 0.0), (5e9, 3e9, 0.0)])
    twist = np.zeros((3, 3))
    twist[2, 1] = 0.3  # .09 J, of which 16 N times 3e9 m round .048 J
    assert invariants.energy_growth(far, moved(far, (pose, twist), dt=STEP))[0] == pytest.approx(0.09 - 0.048)


def test_work_of_a_load_and_of_a_torque():
    scene = over_floor(ball(torque=(4.0,), force=(0.0, 3.0)), gravity=(0.0, -8.0))
    pose = np.array([(5.0, 2.0, 0.0), (6.0, 3.0, 0.0), (9.0, 1.0, 0.0)])
    twist = np.array([(0.0, 0.0, 1.0), (0.0, 0.0, 2.0), (0.0, 0.0, 4.0)])
    energy = invariants.mechanical_energy(scene, moved(scene, (pose, twist), dt=0.5))
    spins = 0.5 * 0.09 * np.array([1.0, 4.0, 16.0])
    assert energy == pytest.approx(spins + 13.0 * np.array([0.0, 1.0, -1.0]) - 4.0 * np.array([0.0, 0.75, 2.25]))


# ---- bodies that start in each other ----


def parted(depth, speed, mass=2.0, load=(0.0, -9.81)):
    """A ball that starts ``depth`` deep in the floor and leaves it at ``speed``, coming to rest on the floor."""
    scene = over_floor(ball(mass=mass, pose=(0.0, 0.3 - depth, 0.0)), gravity=load, duration=0.1)
    y = 0.3 - depth * np.array([1.0, 0.5, 0.0, 0.0])
    pose = np.column_stack([0.0 * y, y, 0.0 * y])
    twist = np.zeros_like(pose)
    twist[1, 1] = speed
    trajectory = moved(scene, (pose, twist))
    overlaps = metrics.overlaps(scene, trajectory)
    return invariants.energy_growth(scene, trajectory, overlaps)[0] <= invariants.energy_bound(scene, DT)


@pytest.mark.parametrize("depth", [1e-5, 2e-3, 0.05])
@pytest.mark.parametrize("gravity", [0.0, 9.81, 1e3])
def test_energy_of_an_overlap_removed_slowly_and_explosively(depth, gravity):
    """Lifting it out is m g d, and whoever undoes it in a step makes a speed of d/dt of it."""
    load = (0.0, -gravity)
    assert parted(depth, 0.0, load=load) and parted(depth, depth / DT, load=load)
    fall = gravity * DT  # the work of one step is granted to any body
    assert not parted(depth, 2.0 * depth / DT + 4.0 * fall + math.sqrt(2.0 * gravity * depth), load=load)


def test_no_allowance_for_bodies_that_start_apart():
    scene = over_floor(ball(pose=(0.0, 0.31, 0.0)), gravity=(0.0, 0.0), duration=0.1)
    pose, twist = np.tile((0.0, 0.31, 0.0), (3, 1)), np.zeros((3, 3))
    twist[1:, 1] = 1e-3
    trajectory = moved(scene, (pose, twist))
    assert invariants.energy_growth(scene, trajectory, metrics.overlaps(scene, trajectory))[0] == pytest.approx(1e-6)
