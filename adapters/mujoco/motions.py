"""Motions of a ball and a column by MuJoCo's contact law, as trajectories like those of the step loop."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from adapters.engine import Contacts
from adapters.mujoco.contact_law import ContactLaw
from adapters.scene import HalfSpace, Scene
from adapters.trajectory import ContactRecord, Trajectory

Array = NDArray[np.float64]
#: Corners of a box on a face.
CORNERS = 4


@lru_cache(maxsize=128)  # a megabyte each at most
def fall(law: ContactLaw, height: float, velocity: float, rest: float, load: float, steps: int) -> Array:
    """Height, velocity and contact's velocity change of one body over a face, (steps + 1, 3).

    ``rest`` is the height at contact; the state is the height, not the gap, as an engine rounds the height.
    """
    rows = [(height, velocity, 0.0)]
    for _ in range(steps):
        _, velocity, change = law.advance(height - rest, velocity, load)
        height = height + law.dt * velocity
        rows.append((height, velocity, change))
    return np.array(rows)


@lru_cache(maxsize=32)  # two megabytes each at most
def column(
    law: ContactLaw,
    heights: tuple[float, ...],
    sizes: tuple[float, ...],
    masses: tuple[float, ...],
    load: float,
    steps: int,
    edge: float,
) -> Array:
    """Heights, velocities and normal impulses of boxes on each other, (steps + 1, 3, n); all at rest at the start.

    Face i lies below box i, has `CORNERS` contacts that share its load, and couples two inverse masses. One step solves
    ``(A + R) f = aref - a0`` over the active faces. A has no positive entry off its diagonal, so faces are only ever
    added [Chandrasekaran 1970]. A face is in contact if its gap is below ``-edge``: boxes that fall together keep a gap
    of round-off, with an undetermined sign.
    """
    n = len(heights)
    inverse = 1.0 / np.array(masses)
    jacobian = np.eye(n) - np.eye(n, k=-1)  # relative velocity of face i: box i minus the box below
    coupling = jacobian @ np.diag(inverse) @ jacobian.T
    spacing = 0.5 * (np.array(sizes) + np.array((0.0, *sizes[:-1])))
    rows = np.zeros((steps + 1, 3, n))
    z, v = np.array(heights), np.zeros(n)
    rows[0, 0] = z
    for k in range(1, steps + 1):
        gap = jacobian @ z - spacing - law.margin
        force = _face_forces(law, gap, jacobian @ v, coupling, jacobian @ np.full(n, load), edge)
        v = v + law.dt * (load + inverse * (jacobian.T @ force))
        z = z + law.dt * v
        rows[k] = z, v, law.dt * force
    return rows


def _face_forces(law: ContactLaw, gap: Array, approach: Array, coupling: Array, load: Array, edge: float) -> Array:
    """Forces [N] of all faces in one step; ``load``: relative accelerations without contact."""
    touching = gap < -edge
    d = np.array([law.impedance(g) for g in gap])
    reference = -law.damping * approach - law.stiffness * d * gap
    soft = np.diag(coupling) * law.softness * (1.0 - d) / d / CORNERS
    force = np.zeros(len(gap))
    pushing = touching & (load < reference)
    for _ in range(len(gap) + 1):
        chosen = np.flatnonzero(pushing)
        matrix = coupling[np.ix_(chosen, chosen)] + np.diag(soft[chosen])
        force[chosen] = np.linalg.solve(matrix, (reference - load)[chosen])
        missing = touching & ~pushing & (load + coupling @ force < reference)
        if not missing.any():
            break
        pushing |= missing
    return force


def as_trajectory(scene: Scene, dt: float, rows: Array) -> Trajectory:
    """The record of the step loop: ``rows`` (steps, 3, n) are heights, velocities, impulses from below."""
    d, (steps, _, n) = scene.dimension, rows.shape
    pose = np.empty((steps, n + 1, 3 if d == 2 else 7))
    pose[:] = [body.pose for body in scene.bodies]
    twist = np.zeros((steps, n + 1, 3 if d == 2 else 6))
    pose[:, 1:, d - 1], twist[:, 1:, d - 1] = rows[:, 0], rows[:, 1]
    impulse = np.zeros((steps * n, d))
    impulse[:, -1] = rows[:, 2].ravel()
    unknown = np.full((steps * n, d), np.nan)
    lower = np.tile(np.arange(n), steps)
    contacts = Contacts(lower, lower + 1, unknown, unknown, impulse, unknown[:, 0])
    record = ContactRecord(np.arange(steps), n * np.arange(steps + 1), contacts)
    return Trajectory(np.arange(steps, dtype=np.float64) * dt, pose, twist, record, dt, "completed")


def is_vertical(scene: Scene) -> bool:
    """A half-space facing up at height 0 and upright free bodies above it that move only up and down."""
    d = scene.dimension
    upright = (0.0,) if d == 2 else (1.0, 0.0, 0.0, 0.0)
    face = scene.bodies[0].shape
    level = isinstance(face, HalfSpace) and face.normal[-1] == 1.0 and face.offset == 0.0
    return level and all(
        body.motion == "free"
        and body.pose[d:] == upright
        and not (any(body.pose[: d - 1]) or any(body.twist[: d - 1]) or any(body.twist[d:]))
        and not (any(scene.gravity[: d - 1]) or any(body.force) or any(body.torque))
        for body in scene.bodies[1:]
    )


def along_a_heading(scene: Scene, dt: float, heading: Array, motion: Array) -> Trajectory:
    """The record of the step loop of a planar ``motion`` (steps, 2, 3) along a level unit vector."""
    d, steps = scene.dimension, len(motion)
    pose = np.empty((steps, 2, 3 if d == 2 else 7))
    pose[:] = [body.pose for body in scene.bodies]
    twist = np.zeros((steps, 2, 3 if d == 2 else 6))
    (x, up, turn), (vx, vy, omega) = motion[:, 0].T, motion[:, 1].T
    pose[:, 1, : d - 1], pose[:, 1, d - 1] = np.outer(x, heading), up
    twist[:, 1, : d - 1], twist[:, 1, d - 1] = np.outer(vx, heading), vy
    if d == 2:
        pose[:, 1, 2], twist[:, 1, 2] = turn, omega
    else:  # a rotation from the heading towards the vertical is about (heading_y, -heading_x)
        axis = np.array([heading[1], -heading[0], 0.0])
        pose[:, 1, 3:] = np.column_stack([np.cos(0.5 * turn), np.outer(np.sin(0.5 * turn), axis)])
        twist[:, 1, 3:] = np.outer(omega, axis)
    return Trajectory(np.arange(steps, dtype=np.float64) * dt, pose, twist, None, dt, "completed")
