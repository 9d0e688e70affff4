"""Quantities of a scene file: position, angle and velocity of a body, forces of its contacts."""

from __future__ import annotations

from collections.abc import Collection, Iterator

import numpy as np

from adapters.engine import Array
from adapters.scene import Scene
from adapters.trajectory import Trajectory
from reference_solver.geometry import rotation
from validation.canonical import Measured
from validation.files import forces
from validation.metrics import UNAVAILABLE

#: Quantities of a body in checks, by dimension; forces are those of all its contacts.
QUANTITIES = {
    2: ("x", "y", "angle", "vx", "vy", "omega", "fx", "fy"),
    3: ("x", "y", "z", "angle", "vx", "vy", "vz", "wx", "wy", "wz", "fx", "fy", "fz"),
}


#: Forces are means over this much time at the end [s], or over the last half of a shorter run.
WINDOW = 1.0
_AXES = "xyz"


def unit(quantity: str) -> str:
    """Unit of ``ball.vx`` and its like."""
    what = parts_of(quantity)[2]
    if what in forces.OTHERS[3]:
        return {"contacts": "1", "overlap_without_force": "m"}.get(what, "N")
    if what == "angle":
        return "rad"
    if what == "omega" or what.startswith("w"):
        return "rad/s"
    return {"v": "m/s", "f": "N"}.get(what[0], "m")


def force_window(scene: Scene) -> float:
    """Time at the end over which forces are averaged [s]."""
    return min(WINDOW, 0.5 * scene.duration)


def quantity(
    scene: Scene, trajectory: Trajectory, name: str, at: float | None = None, over: str | None = None
) -> Measured:
    """Value of ``BODY.QUANTITY`` at time ``at`` [s], at the end if None.

    Quantities with step values (`forces.is_over_time`) have their mean over `force_window`, or the statistic ``over``.
    """
    partner, body, what = parts_of(name, scene.places.keys())
    if what.startswith("f") and at is None and over in (None, "mean"):
        return _force(scene, trajectory, scene.index(body), partner, "fxfyfz".index(what) // 2)
    if forces.is_over_time(what):
        other = None if partner is None else scene.index(partner)
        window = forces.window_of(trajectory, at, force_window(scene))
        return forces.told(scene, trajectory, scene.index(body), other, what, over or "mean", window)
    values = _history(trajectory, scene.index(body), what)
    return float(np.interp(trajectory.t[-1] if at is None else at, trajectory.t, values)), ""


def _history(trajectory: Trajectory, body: int, what: str) -> Array:
    """Samples of one coordinate of one body, (s,)."""
    d = trajectory.dimension
    pose, twist = trajectory.pose[:, body], trajectory.twist[:, body]
    if what == "angle":
        return _turned(pose)
    if what == "omega":
        return twist[:, 2]
    if what.startswith("v"):
        return twist[:, _axis(what[1], d)]
    if what.startswith("w"):
        return twist[:, 3 + _AXES.index(what[1])]
    return pose[:, _axis(what, d)]


def _axis(letter: str, dimension: int) -> int:
    assert letter in _AXES[:dimension]
    return _AXES.index(letter)


def _turned(pose: Array) -> Array:
    """Angle since the start [rad]: with full turns in 2-D; in 3-D the rotation angle, from 0 to pi."""
    if pose.shape[1] == 3:
        angle: Array = np.unwrap(pose[:, 2]) - pose[0, 2]
        return angle
    turn = rotation(pose)
    relative = turn @ turn[0].T
    sine = np.stack([relative[:, 2, 1] - relative[:, 1, 2], relative[:, 0, 2] - relative[:, 2, 0]], -1)
    sine = np.linalg.norm(np.column_stack([sine, relative[:, 1, 0] - relative[:, 0, 1]]), axis=1)
    return np.asarray(np.arctan2(0.5 * sine, 0.5 * (np.trace(relative, axis1=1, axis2=2) - 1.0)))


def _force(scene: Scene, trajectory: Trajectory, body: int, partner: str | None, axis: int) -> Measured:
    """Mean force of the contacts on ``body`` over the end of the run [N]."""
    contacts = trajectory.contacts
    if contacts is None or len(contacts.step) == 0:
        return None, "contacts were not recorded"
    late = trajectory.t[contacts.step] > trajectory.t[-1] - force_window(scene) + 0.5 * trajectory.dt
    if partner is None:
        total = contacts.impulse_on(body)[late, axis]
    else:
        other = scene.index(partner)
        sign = 1.0 if body > other else -1.0  # impulses are kept as those on the body with the higher index
        total = sign * contacts.impulse_between(other, body)[late, axis]
    if np.isnan(total).any():
        return None, UNAVAILABLE
    return float(total.sum() / (len(total) * trajectory.dt)), ""


def parts_of(quantity: str, names: Collection[str] = ()) -> tuple[str | None, str, str]:
    """Return partner (or None), body and quantity of ``floor/box.fy`` or ``ball.y``.

    ``names`` are those of the scene's bodies: a name may hold a slash itself.
    """
    bodies, _, what = quantity.rpartition(".")
    if bodies in names or "/" not in bodies:
        return None, bodies, what
    places = [k for k, letter in enumerate(bodies) if letter == "/"]
    fits = [k for k in places if bodies[:k] in names and bodies[k + 1 :] in names]
    cut = fits[0] if fits else places[-1]
    return bodies[:cut], bodies[cut + 1 :], what


def shown_quantities(scene: Scene) -> Iterator[str]:
    """Every quantity of every free body, in the order in which they are shown."""
    for body in scene.bodies:
        if body.motion == "free":
            yield from (f"{body.name}.{what}" for what in QUANTITIES[scene.dimension])
