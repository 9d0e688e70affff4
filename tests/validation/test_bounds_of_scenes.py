"""Bounds that were too wide: what each owes, shown on motions that are right and on the fault it is there to see."""

import numpy as np
import pytest

from adapters.trajectory import Trajectory
from validation.catalogue import CATALOGUE

DTS = (1 / 60, 1 / 240, 1 / 1000)


def reflected(scene, dt, scheme, restitute_gravity=False):
    """Independent scalar stepper of a bouncing ball at e = 1: heights and velocities of a whole run.

    ``scheme`` orders one step: velocity first, position first, or the mid-point rule. The impact takes the velocity
    that the step began with; a wrong engine (``restitute_gravity``) takes the one after gravity.
    """
    e, g, y, v = scene.params["e"], scene.params["g"], scene.params["height"], 0.0
    rows = [(y, v)]
    while len(rows) <= scene.duration / dt:
        old = v
        if scheme == "position first":
            y += v * dt
        free = v - g * dt
        hit = y <= 0.0 and v < 0.0
        v = -e * (free if restitute_gravity else v) if hit else free
        if scheme == "velocity first":
            y += v * dt
        if scheme == "mid-point":
            y += 0.5 * (old + v) * dt
        rows.append((y, v))
    states = np.array(rows)
    pose, twist = np.zeros((len(rows), 2, 3)), np.zeros((len(rows), 2, 3))
    pose[:, 1, 1], twist[:, 1, 1] = states[:, 0] + 0.5, states[:, 1]
    return Trajectory(np.arange(len(rows)) * dt, pose, twist, None, dt, "completed")


def judged(scene, trajectory, metric):
    """Value and bound of one check."""
    canonical = CATALOGUE[scene.name]
    (check,) = (check for check in canonical.checks(scene, trajectory.dt) if check.metric == metric)
    return canonical.measure(scene, trajectory)[metric][0], check.bound


@pytest.mark.parametrize("scheme", ["velocity first", "position first", "mid-point"])
@pytest.mark.parametrize("dt", DTS)
def test_no_growth_allowance_at_e_1_for_late_impacts(scheme, dt):
    for height in np.linspace(1.0, 1.1, 7):
        scene = CATALOGUE["bounce"].scene(2, {"e": 1.0, "height": float(height)})
        growth, bound = judged(scene, reflected(scene, dt, scheme), "apex_growth")
        assert growth <= bound, height


@pytest.mark.parametrize("scheme", ["velocity first", "position first", "mid-point"])
@pytest.mark.parametrize("dt", DTS)
def test_growth_by_restitution_of_gravity_s_step(dt, scheme):
    """Each rebound is g dt too fast, |v| dt of height: as much as a late impact used to be forgiven."""
    scene = CATALOGUE["bounce"].scene(2, {"e": 1.0})
    growth, bound = judged(scene, reflected(scene, dt, scheme, restitute_gravity=True), "apex_growth")
    assert growth > 0.5 * np.sqrt(2.0 * 9.81) * dt > 10.0 * bound


def sunk(n, overlap, which):
    """A column at rest whose interface ``which`` (from below, 1 based) overlaps by ``overlap`` [m]."""
    scene = CATALOGUE["stack"].scene(2, {"n": n})
    pose = np.tile([body.pose for body in scene.bodies], (10, 1, 1))
    pose[1:, which:, 1] -= overlap
    return scene, pose


@pytest.mark.parametrize("dt", DTS)
@pytest.mark.parametrize(("n", "which"), [(1, 1), (10, 1), (10, 7), (20, 20)])
def test_bound_of_one_interface_at_any_height(n, which, dt):
    for share, passes in ((0.99, True), (1.01, False), (0.99 * n, n == 1)):
        scene, pose = sunk(n, share * 9.81 * dt * dt, which)
        twist = np.zeros_like(pose)
        depth, bound = judged(scene, Trajectory(np.arange(10) * dt, pose, twist, None, dt, "completed"), "penetration")
        assert (depth <= bound) is passes, share


@pytest.mark.parametrize("dt", DTS)
def test_column_found_one_step_late(dt):
    """All contacts are missing in the first step: everything falls together, only the lowest interface overlaps."""
    scene, pose = sunk(10, 9.81 * dt * dt, 1)
    depth, bound = judged(
        scene, Trajectory(np.arange(10) * dt, pose, np.zeros_like(pose), None, dt, "completed"), "penetration"
    )
    assert 0.999 * bound < depth <= bound


@pytest.mark.parametrize("dt", DTS)
@pytest.mark.parametrize("n", [1, 5, 20])
def test_drift_bound_of_a_column_s_interfaces(n, dt):
    """A contact that is missing for a step lets what it holds go for g dt^2; the slips below a body add up in it."""
    for share, passes in ((0.99, True), (1.01, False)):
        scene, pose = sunk(n, 0.0, 1)
        pose[1:, n, 0] += share * n * 9.81 * dt * dt
        drift, bound = judged(
            scene, Trajectory(np.arange(10) * dt, pose, np.zeros_like(pose), None, dt, "completed"), "drift"
        )
        assert (drift <= bound) is passes, share


#: Checks that no step makes sharper: whole numbers, loads of single steps and their scatter, which are a share of what
#: moves unseen, and a speed to the round-off of a place over one step.
AT_ANY_STEP = {"blows", "stands", "impulse_scatter", "unbalanced", "thrown"}
#: What checks add of ways that bodies go, where those are longer than the scene [m]: two of a fall and a throw of 10 s.
GONE = {"flight": 2.0 * (10.0 + 1500.0 + 490.5)}
OF_ONE_STEP = ("[least]", "[greatest]")


@pytest.mark.parametrize("name", CATALOGUE)
def test_bound_terms_by_step_and_round_off_only(name):
    """Halving the step widens no bound but by round-off; of a step of 1 us a thousandth and round-off are left."""
    canonical = CATALOGUE[name]
    for dimension in canonical.dimensions:
        for variation in canonical.variations("standard"):
            scene = canonical.scene(dimension, variation.params)
            shorter = {dt: {c.metric: c for c in canonical.checks(scene, dt)} for dt in (1 / 480, 1e-6)}
            far = max(GONE.get(name, 0.0), *(abs(x) for body in scene.bodies for x in body.pose))
            for check in canonical.checks(scene, 1 / 240):
                if check.bound is None or check.metric in AT_ANY_STEP or check.metric.endswith(OF_ONE_STEP):
                    continue
                half, least = (found[check.metric].bound for found in shorter.values())
                # Steps that only round add up: as many of them as there are, each by a unit in the last place.
                rounding = [1e-15 * (1.0 + far) * scene.duration / dt for dt in (1 / 480, 1e-6)]
                assert half <= check.bound + rounding[0], (check.metric, variation.params)
                assert least <= 1e-3 * check.bound + rounding[1], (check.metric, variation.params)
                # Where that allows all of it, there is no step in it: it is round-off, of places far away as well.
                assert check.bound > rounding[1] or check.bound < 1e-8 or name == "far_origin", check.metric
