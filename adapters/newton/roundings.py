"""Most that single numbers make of a balance in a run of Newton's XPBD: operations counted, each half a unit off.

A balance is a number that is nothing but for round-off. What changes it is the rounding of velocities and places in
the steps of a motion that is known, that of the recurrence in doubles:

    a step                  v += dt g                               2 roundings of a velocity, none without loads
    a sweep that presses    v += l n/(m n_c)                        3
    rebounds                8 sweeps of v += l n/m, and a mean      3 each, and 2
    a step that presses     overlaps and slips, over the step       `ROUNDINGS` of a place

Sweeps take back what those before them were off by, a share each, so that roundings of places count once a step. An
impulse is one number for both bodies: places do not change a sum of momenta. Rebounds set the speed at which a contact
parts, whatever sweeps have left of it: of places only the lever of a blow changes what two bodies have of its energy.

Where sweeps stop a body it is otherwise. A stop takes what a sweep has left of a velocity, at most 0.1 mm/s, and no
impulse tells of it; the sweeps after it ask for as much, the way that was left of the overlap over the step. In doubles
both are the same number. In singles sweeps end where no overlap is seen any more, so that what they ask for is off by
the roundings of a place over the step, as in any step that presses, and these are momentum.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from adapters.newton.shipped import INNER
from adapters.scene import Body, Box, Scene, Sphere
from adapters.single_precision import UNIT
from adapters.trajectory import Trajectory

#: Roundings of the place where two points touch, of which one tells depth and slip: each is taken from the world to a
#: body's axes (taken away, turned about two axes) and back (turned, added), and may be half a unit off each time. At a
#: place that does not change they are off the same way in every step, which no draw shows.
ROUNDINGS = 12.0


class Roundings(NamedTuple):
    """What they add up to at most, and what a balance is told in.

    ``speed`` of velocities alone, ``levered`` with what levers of blows make of them, ``placed`` with what overlaps and
    slips do, ``told`` of impulses against velocities [m/s]; ``place`` [m]; ``spin`` that a blow gives a body beside its
    speed [rad/m]; ``start``, the fastest body as the scene starts [m/s].
    """

    speed: float
    levered: float
    placed: float
    told: float
    place: float
    spin: float
    start: float


def _share(of: Roundings, speed: float) -> float:
    """Of the speed that a scene starts with; nothing is known of one that starts at rest."""
    return speed / of.start if of.start > 0.0 else 0.0


#: Most that roundings make of a metric which is a balance, in its unit.
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
    """Count and add up.

    Parameters
    ----------
    spatial
        The scene, in three dimensions.
    motion
        Of the same bodies, every step, in the scene's own dimension.
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
    # Rebounds come after the last stop: what they leave at rest was not stopped.
    stopped = not chosen["rebounds"] and bool((pressing[:, None] & (speeds[:-1] > 0.0) & (speeds[1:] == 0.0)).any())
    placed = speed + off / dt
    return Roundings(speed, levered, placed, placed if stopped else speed, place, spin, float(speeds[0].max()))


def _turns(body: Body, rubs: bool) -> bool:
    """Whether blows turn a body: smooth balls are struck towards their centres."""
    return rubs or not isinstance(body.shape, Sphere)


def _size(body: Body) -> float:
    """Farthest point of a ball or box from its centre [m]."""
    if isinstance(body.shape, Sphere):
        return body.shape.radius
    assert isinstance(body.shape, Box)
    return float(np.linalg.norm(body.shape.half_extents))
