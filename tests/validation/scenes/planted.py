"""What tests of scenes ask of a record of their own, true or with a fault that they have planted."""

import numpy as np

from adapters.trajectory import ContactRecord, Contacts, Trajectory
from validation.catalogue import CATALOGUE


def made(name, dimension=2, **params):
    """A scene of the catalogue, and what it is in this dimension with these parameters."""
    canonical = CATALOGUE[name]
    return canonical, canonical.scene(dimension, params)


def still(scene, samples):
    """Poses and twists of bodies that stay where they start."""
    pose = np.array([[body.pose for body in scene.bodies]] * samples)
    return pose, np.zeros((samples, len(scene.bodies), 3 if scene.dimension == 2 else 6))


def carried(pairs, impulses, first=0):
    """One contact of each pair (a, b) at every step from ``first`` on, with its impulse on b: (steps, pairs, d)."""
    steps, count, d = impulses.shape
    a, b = np.tile(np.transpose(pairs), steps)
    flat = impulses.reshape(-1, d)
    rows = Contacts(a, b, np.zeros_like(flat), np.zeros_like(flat), flat, np.zeros(len(a)))
    return ContactRecord(np.arange(first, first + steps), count * np.arange(steps + 1), rows)


def loaded(scene, impulses, dt, duration):
    """A record in which nothing moves, and each pair (a, b) carries its impulse on b at every step."""
    n = round(duration / dt) + 1
    contacts = carried(list(impulses), np.array([list(impulses.values())] * n))
    return Trajectory(np.arange(n) * dt, *still(scene, n), contacts, dt, "completed")


def stated(checks):
    """Unit and bound of each check, all of which have a reason and a source."""
    assert all(check.because and check.source for check in checks)
    return {check.metric: (check.unit, check.bound) for check in checks}


def failing(canonical, scene, trajectory):
    """Metrics of the judged checks that the record does not pass; what has no value does not pass."""
    measured = canonical.measure(scene, trajectory)
    return {
        check.metric
        for check in canonical.checks(scene, trajectory.dt)
        if check.bound is not None
        and (measured[check.metric][0] is None or not abs(measured[check.metric][0] - check.truth) <= check.bound)
    }
