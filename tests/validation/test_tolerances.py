"""Tolerances are derived from scene and step: correct answers of every fixed-step order pass, wrong physics fails."""

import math

import numpy as np
import pytest

from adapters.trajectory import Trajectory
from validation.scenes import CATALOGUE

DTS = (1 / 60, 1 / 240, 1 / 1000)


def bounce_by(scene, dt, order, e=None, g_factor=1.0, damping=0.0):
    """Independent scalar stepper of a bouncing ball: rigid law, ``order`` of moving and forcing within a step."""
    e = scene.params["e"] if e is None else e
    g = scene.params["g"] * g_factor
    y, v = scene.params["height"], 0.0
    rows = [(y, v)]
    for _ in range(math.ceil(scene.duration / dt - 1e-9)):
        if order == "position first":
            y += v * dt
            v = -e * v if y <= 0.0 and v < 0.0 else (0.0 if y <= 0.0 and v == 0.0 else v - g * dt)
        else:
            v = -e * v if y <= 0.0 and v < 0.0 else (0.0 if y <= 0.0 and v == 0.0 else v - g * dt)
            y += v * dt
        v *= 1.0 - damping * dt
        rows.append((y, v))
    states = np.array(rows)
    pose, twist = np.zeros((len(rows), 2, 3)), np.zeros((len(rows), 2, 3))
    pose[:, 1, 1], twist[:, 1, 1] = states[:, 0] + 0.5, states[:, 1]
    return Trajectory(np.arange(len(rows)) * dt, pose, twist, None, dt, "completed")


def failing(scene, trajectory):
    canonical = CATALOGUE[scene.name]
    measured = canonical.measure(scene, trajectory)
    return {
        check.metric
        for check in canonical.checks(scene, trajectory.dt)
        if not abs(measured[check.metric][0] - check.truth) <= check.bound
    }


@pytest.mark.parametrize("order", ["position first", "velocity first"])
@pytest.mark.parametrize("dt", DTS)
@pytest.mark.parametrize("e", [0.5, 0.8, 0.95, 1.0])
def test_a_rigid_bounce_passes_in_both_orders_whatever_the_phase(e, dt, order):
    canonical = CATALOGUE["bounce"]
    for height in np.linspace(1.0, 1.15, 7):
        scene = canonical.scene(2, {"e": e, "height": float(height)})
        assert failing(scene, bounce_by(scene, dt, order)) == set(), height


@pytest.mark.parametrize("order", ["position first", "velocity first"])
def test_wrong_physics_fails_the_bounce(order):
    scene = CATALOGUE["bounce"].scene(2, {"e": 0.8})
    dt = 1 / 240
    assert "apex[1]" in failing(scene, bounce_by(scene, dt, order, e=0.75))
    assert "apex[3]" in failing(scene, bounce_by(scene, dt, order, damping=0.1))
    assert "rest_time" in failing(scene, bounce_by(scene, dt, order, g_factor=0.7))


def test_energy_growth_is_caught_where_e_is_below_one():
    scene = CATALOGUE["bounce"].scene(2, {"e": 0.95})
    assert "apex_growth" in failing(scene, bounce_by(scene, 1 / 240, "velocity first", e=1.02))


def test_bounds_do_not_know_the_engine_and_shrink_with_the_step():
    for name, params in (("bounce", {}), ("stack", {"n": 5}), ("incline", {"ratio": 0.9}), ("incline", {"ratio": 1.1})):
        canonical = CATALOGUE[name]
        scene = canonical.scene(2, params)
        coarse = {check.metric: check.bound for check in canonical.checks(scene, 1 / 60)}
        fine = {check.metric: check.bound for check in canonical.checks(scene, 1 / 960)}
        for metric in coarse.keys() & fine.keys() - {"impulse_scatter"}:
            assert fine[metric] < coarse[metric], (name, metric)


def test_every_check_states_unit_reason_and_source():
    for canonical in CATALOGUE.values():
        for dimension in canonical.dimensions:
            for check in canonical.checks(canonical.scene(dimension), 1 / 240):
                assert check.unit and check.because and check.source and check.bound > 0.0
                assert math.isfinite(check.bound)


def test_the_worked_example_is_a_scene():
    scene = CATALOGUE["impact"].scene(2, {"e": 0.8, "v": 6.0, "mass": 0.5})
    truth = CATALOGUE["impact"].exact(scene)
    assert truth["rebound_speed"] == pytest.approx(4.8, abs=1e-15)
    assert truth["impulse"] == pytest.approx(5.4, abs=1e-14)
    assert truth["velocity_change"] == pytest.approx(10.8, abs=1e-14)
