"""Results of a recurrence of Newton's solver: poses, twists and impulses of every step as a `Trajectory`."""

from __future__ import annotations

from typing import Any

import numpy as np

from adapters.engine import Array, Contacts
from adapters.scene import Scene
from adapters.scene.lift import lower_contacts, lower_pose, lower_twist
from adapters.trajectory import ContactRecord, Trajectory


def told_trajectory(
    spatial: Scene,
    moving: list[int],
    pose: Array,
    twist: Array,
    contacts: ContactRecord | None,
    dt: float,
    flat: bool,
) -> Trajectory:
    """All bodies over time: those moved by a recurrence, and all others at their places in the scene.

    Parameters
    ----------
    spatial
        The scene, in three dimensions.
    moving
        Indices of its k moving bodies.
    pose, twist
        (s, k, 7) [m] and (s, k, 6) [m/s, rad/s] after each of s steps.
    contacts
        Of each step, or None without records.
    dt
        Step [s].
    flat
        Of a 2-D scene, in its own coordinates.
    """
    steps = len(pose)
    poses = np.repeat(np.array([[each.pose for each in spatial.bodies]], float), steps + 1, axis=0)
    twists = np.repeat(np.array([[each.twist for each in spatial.bodies]], float), steps + 1, axis=0)
    poses[1:, moving], twists[1:, moving] = pose, twist
    if flat:
        samples = poses.shape[:2]
        poses = lower_pose(poses.reshape(-1, 7)).reshape(*samples, 3)
        twists = lower_twist(twists.reshape(-1, 6)).reshape(*samples, 3)
    return Trajectory(np.arange(steps + 1, dtype=np.float64) * dt, poses, twists, contacts, dt, "completed")


def told_contacts(
    pressed: np.ndarray[Any, np.dtype[Any]], pairs: Array, impulse: np.ndarray[Any, np.dtype[Any]], flat: bool
) -> ContactRecord:
    """Impulses of all steps, on the body with the higher index; a contact has only its impulse.

    Parameters
    ----------
    pressed
        (s, p) whether each of p pairs pressed in a step.
    pairs
        (p, 2) indices of both bodies.
    impulse
        (s, p, 3) on the second of them [N s].
    flat
        As in `told_trajectory`.
    """
    step, pair = np.nonzero(pressed)
    ends = np.array(pairs, np.int64).reshape(-1, 2)[pair]
    given = impulse[step, pair].astype(float)
    given[ends[:, 0] > ends[:, 1]] *= -1.0
    ends.sort(axis=1)
    blank = np.zeros((len(step), 3))
    held = Contacts(ends[:, 0], ends[:, 1], blank, blank.copy(), given, np.zeros(len(step)))
    offset = np.searchsorted(step, np.arange(len(pressed) + 1)).astype(np.int64)
    samples = np.arange(1, len(pressed) + 1, dtype=np.int64)
    return ContactRecord(samples, offset, lower_contacts(held) if flat else held)
