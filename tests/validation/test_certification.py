"""Errors of metrics: what a run to another tolerance does otherwise is told, and nothing where all runs do the same."""

from dataclasses import replace

import numpy as np
import pytest

from adapters.engine import Contacts
from adapters.stepping import step_count
from adapters.trajectory import ContactRecord, Trajectory
from validation.cells import Slot, prepare
from validation.running import certification
from validation.running.certification import fully_certified

DT = 1 / 240


class Certifying:
    """An engine that certifies whatever it did."""

    def certify(self, *asked):
        return {"holds": True, "reasons": []}

    def at_other_tolerances(self, settings, certificate):
        return [{"tolerance": share * settings["tolerance"]} for share in (0.1, 10.0)]


def run(off, scene, dt, sampling):
    """A run that is right but for ``off`` [m], by which the last body is too far along x when it ends.

    Boxes slide to a stop, other bodies lie where they are; contacts carry the weight.
    """
    d, n = scene.dimension, step_count(scene.duration, dt)
    t = np.array([*range(0, n, sampling.stride), n]) * dt
    pose = np.array([[body.pose for body in scene.bodies]] * len(t))
    twist = np.zeros((len(t), len(scene.bodies), 3 if d == 2 else 6))
    if scene.name == "slide":
        p = scene.params
        on = np.minimum(t, p["v"] / (p["mu"] * p["g"]))
        pose[:, -1, 0] += p["v"] * on - 0.5 * p["mu"] * p["g"] * on**2
        twist[:, -1, 0] = p["v"] - p["mu"] * p["g"] * on
    pose[:, -1, 0] += off * np.minimum(1.0, t / (0.9 * t[-1]))
    contacts = None
    if sampling.contacts_from is not None:
        at = np.flatnonzero(t > sampling.contacts_from - 0.5 * dt)
        still = np.zeros((len(at), d))
        weight = still + [*(0.0,) * (d - 1), scene.bodies[1].mass * scene.params["g"] * dt]
        rows = Contacts(0 * at, 0 * at + 1, still, still, weight, 0.0 * at)
        contacts = ContactRecord(at, np.arange(len(at) + 1), rows)
    return Trajectory(t, pose, twist, contacts, dt, "completed", certificate={"certified": True, "reasons": []})


#: A scene that records states, and one that records impulses; the metric that tells how far its body is along x.
CELLS = [
    (Slot("slide", (), 2, "reference", "reference", DT), "stopping_distance"),
    (Slot("stack", (("n", 1.0),), 2, "reference", "reference", DT), "drift"),
]


@pytest.mark.parametrize(("slot", "metric"), CELLS)
@pytest.mark.parametrize("power", [0.32, 0.875, 1.0])
def test_error_by_a_power_of_the_tolerance_not_understated(monkeypatch, slot, metric, power):
    """Nor more than ten to that power too large; runs have the same steps, and other metrics no error."""
    steps, error = [], 1e-4

    def to_tolerance(engine, scene, dt, settings, sampling):
        steps.append(dt)
        return run(error * settings["tolerance"] ** power, scene, dt, sampling)

    monkeypatch.setattr(certification, "run", to_tolerance)
    prepared = prepare(slot)
    trajectory = run(error, prepared.scene, DT, prepared.canonical.sampling(prepared.scene))
    told = fully_certified(Certifying(), prepared, slot, {"tolerance": 1.0}, trajectory).certificate["metric_errors"]
    assert error <= told[metric] <= 2.0 * error * 10.0**power and steps == [DT, DT]
    assert {**told, metric: 0.0} == pytest.approx(dict.fromkeys(told, 0.0), abs=1e-9)


def test_no_error_of_a_metric_that_one_run_lacks(monkeypatch):
    slot, metric = CELLS[0]
    prepared = prepare(slot)
    sampling, whole = prepared.canonical.sampling(prepared.scene), prepared.canonical.measure

    def measure(scene, found):
        return {**whole(scene, found), metric: (1.0, "") if found.dt == DT else (None, "it never stops")}

    prepared = replace(prepared, canonical=replace(prepared.canonical, measure=measure))
    trajectory = run(0.0, prepared.scene, DT, sampling)
    monkeypatch.setattr(certification, "run", lambda *asked: replace(trajectory, dt=0.5 * DT))
    told = fully_certified(Certifying(), prepared, slot, {"tolerance": 1.0}, trajectory).certificate["metric_errors"]
    assert told[metric] is None and told["braking"] == 0.0
