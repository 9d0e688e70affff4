"""Bound on a balance from round-off of single precision in Newton's XPBD: half a unit for each counted operation.

A balance is a number that is 0 except for round-off. It changes by the rounding of velocities and places in the steps
of a known motion, that of the recurrence in double precision:

    a step                  v += dt g                               2 roundings of a velocity, none without loads
    a sweep that presses    v += l n/(m n_c)                        3
    rebounds                8 sweeps of v += l n/m, and a mean      3 each, and 2
    a step that presses     overlaps and slips, over the step       `ROUNDINGS` of a place

Each iteration corrects a share of the errors before it, so roundings of places count once per step. An impulse is one
number for both bodies: places do not change a sum of momenta. Restitution sets the separation speed of a contact,
independent of the iterations before: among places only the lever arm of a blow changes the energy of the two bodies.

Stops of bodies are different. A stop removes the rest of a velocity after an iteration, at most 0.1 mm/s, without a
recorded impulse; later iterations correct the same amount, the rest of the overlap over the step. In double precision
both are equal. In single precision iterations end without a visible overlap, so their corrections have an error of the
roundings of a place over the step, as in any step with contact, and this error is momentum.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from adapters.law.single_precision import UNIT
from adapters.newton.shipped import INNER
from adapters.scene import Body, Box, Scene, Sphere
from adapters.trajectory import Trajectory

#: Roundings of the place of two touching points, which determine depth and slip: each is transformed from the world to
#: a body's axes (subtracted, rotated about two axes) and back (rotated, added), with up to half a unit of error each
#: time. At a constant place the error is the same in every step, which no sample shows.
ROUNDINGS = 12.0


class Roundings(NamedTuple):
    """Bounds of their sums, and the scales of a balance.

    ``speed`` of velocities only, ``levered`` with lever arms of blows, ``placed`` with overlaps and slips, ``told`` of
    impulses relative to velocities [m/s]; ``place`` [m]; ``spin`` of a body per speed by a blow [rad/m]; ``start``, the
    fastest body at the start [m/s].
    """

    speed: float
    levered: float
    placed: float
    told: float
    place: float
    spin: float
    start: float


def _share(of: Roundings, speed: float) -> float:
    """A share of the start speed; unknown for a start at rest."""
    return speed / of.start if of.start > 0.0 else 0.0


#: Bound of round-off in a metric which is a balance, in its unit.
LIMITS: Mapping[str, Callable[[Roundings], float]] = {
    "momentum_defect": lambda of: _share(of, of.told),
    "energy_defect": lambda of: _share(of, 2.0 * of.levered),
    "energy_lost": lambda of: _share(of, 2.0 * of.levered),
    "asymmetry": lambda of: _share(of, of.placed),
    "sideways": lambda of: of.placed,
    "wrong_speed": lambda of: of.levered,
    "twisted": lambda of: of.placed * of.spin,
    "centre_moved": lambda of: of.place,
}


def roundings_of(spatial: Scene, motion: Trajectory, dt: float, chosen: Mapping[str, Any]) -> Roundings:
    """Count and add roundings.

    Parameters
    ----------
    spatial
        The scene, in three dimensions.
    motion
        Motion of the same bodies, every step, in the scene's own dimension.
    dt
        Step [s].
    chosen
        Settings.
    """
    free = [k for k, body in enumerate(spatial.bodies) if body.motion == "free"]
    bodies, axes = [spatial.bodies[k] for k in free], motion.dimension
    speeds = np.linalg.norm(motion.twist[:, free, :axes], axis=2)
    far = float(np.linalg.norm(motion.pose[:, free, :axes], axis=2).max()) + max(map(_size, bodies))
    steps = len(motion.pose) - 1
    pressing = np.diff(motion.contacts.offset) > 0 if motion.contacts else np.zeros(steps, bool)
    pressed = np.count_nonzero(pressing)
    loaded = any(spatial.gravity) or any(any(body.force) for body in bodies)
    rebounds = chosen["rebound_iterations"] * (3.0 * INNER + 2.0) if chosen["rebounds"] else 0.0
    many = 2.0 * steps * loaded + pressed * (3.0 * chosen["iterations"] + rebounds)
    rubs = any(pair.friction for pair in spatial.pairs)
    spin = max(body.mass * _size(body) / float(np.min(body.inertia)) * _turns(body, rubs) for body in bodies)
    speed, off = UNIT * many * float(speeds.max()), UNIT * pressed * ROUNDINGS * far
    place = UNIT * far * (steps + pressed * chosen["iterations"]) + speed * steps * dt
    levered = speed + off * spin * float(speeds.max())
    # Restitution comes after the last stop: a body at rest after it was not stopped.
    stopped = not chosen["rebounds"] and bool((pressing[:, None] & (speeds[:-1] > 0.0) & (speeds[1:] == 0.0)).any())
    placed = speed + off / dt
    return Roundings(speed, levered, placed, placed if stopped else speed, place, spin, float(speeds[0].max()))


def _turns(body: Body, rubs: bool) -> bool:
    """Whether blows rotate a body: those of smooth balls go through their centres."""
    return rubs or not isinstance(body.shape, Sphere)


def _size(body: Body) -> float:
    """Farthest point of a ball or box from its centre [m]."""
    if isinstance(body.shape, Sphere):
        return body.shape.radius
    assert isinstance(body.shape, Box)
    return float(np.linalg.norm(body.shape.half_extents))
