"""Faults of an adapter, each with the check that must notice it, at three sizes.

Sizes are 10, 1 and 0.1 %, except where the motion of a step hides an extent, or solvers do not keep a symmetry.
"""

from __future__ import annotations

import math
import os
import random
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from adapters.conformance.scenes import DT
from adapters.conformance.spoilt import Fault, Spoilt, World
from adapters.engine import Array, Contacts, Recorded, Setting
from adapters.scene import Body, Box, Scene, Sphere

SHARES = (0.1, 0.01, 0.001)
COARSE = (1.0, 0.1, 0.01)
#: Sizes for values that must agree bit for bit.
BITS = (1e-3, 1e-6, 1e-9)


# ---- input of the engine -------------------------------------------------------------------------------------------


def _each(change: Callable[[Body, float], Body]) -> Callable[[Scene, float], Scene]:
    """Change every free body of a scene."""

    def told(scene: Scene, size: float) -> Scene:
        return replace(scene, bodies=tuple(change(b, size) if b.motion == "free" else b for b in scene.bodies))

    return told


def _mass(body: Body, size: float) -> Body:
    return replace(body, mass=(1.0 - size) * body.mass)


def _moments(body: Body, wanted: Array, size: float) -> Body:
    told = (1.0 - size) * np.array(body.inertia) + size * wanted
    return replace(body, inertia=(float(told[0]), float(told[1]), float(told[2])))


def _inertia(body: Body, size: float) -> Body:
    return _moments(body, np.zeros(3), size)


def _disc(body: Body, size: float) -> Body:
    if not isinstance(body.shape, Sphere):
        return body
    return _moments(body, np.full(3, 0.5 * body.mass * body.shape.radius**2), size)


def _swapped(body: Body, size: float) -> Body:
    return _moments(body, np.array(body.inertia)[[1, 0, 2]], size)


def _extent(body: Body, size: float) -> Body:
    if isinstance(body.shape, Box):
        return replace(body, shape=Box(tuple((1.0 - size) * h for h in body.shape.half_extents)))
    return replace(body, shape=Sphere((1.0 - size) * body.shape.radius)) if isinstance(body.shape, Sphere) else body


def _long(body: Body, size: float) -> Body:
    if not isinstance(body.shape, Box):
        return body
    *others, last = body.shape.half_extents
    return replace(body, shape=Box((*others, (1.0 + size) * last)))


def _torque(body: Body, size: float) -> Body:
    return replace(body, torque=tuple((1.0 - size) * t for t in body.torque))


def _gravity(scene: Scene, size: float) -> Scene:
    return replace(scene, gravity=tuple((1.0 - size) * g for g in scene.gravity))


def _sideways(scene: Scene, size: float) -> Scene:
    (x, y, z), c, s = scene.gravity, math.cos(size), math.sin(size)
    return replace(scene, gravity=(c * x - s * z, y, s * x + c * z))


def _pair(name: str) -> Callable[[Scene, float], Scene]:
    def told(scene: Scene, size: float) -> Scene:
        changed = (replace(pair, **{name: (1.0 - size) * getattr(pair, name)}) for pair in scene.pairs)
        return replace(scene, pairs=tuple(changed))

    return told


# ---- output of a world ---------------------------------------------------------------------------------------------


def _at(rows: Any, columns: Any, amount: Callable[[World], float]) -> Callable[[World, Array, float], Array]:
    """Add ``size`` times an amount to some numbers."""

    def read(world: World, value: Array, size: float) -> Array:
        value = value.copy()
        value[rows, columns] += size * amount(world)
        return value

    return read


def _scaled(rows: Any, columns: Any, power: Callable[[World], float]) -> Callable[[World, Array, float], Array]:
    """Reduce some numbers by the share ``size``, ``power`` times."""

    def read(world: World, value: Array, size: float) -> Array:
        value = value.copy()
        value[rows, columns] *= (1.0 - size) ** power(world)
        return value

    return read


ALL, LINEAR, ANGULAR = slice(None), slice(0, 3), slice(3, 6)


def _late_pose(world: World, value: Array, size: float) -> Array:
    return np.asarray((1.0 - size) * value + size * world.before[0])


def _late_twist(world: World, value: Array, size: float) -> Array:
    return np.asarray((1.0 - size) * value + size * world.before[1])


def _pushed(world: World, value: Array, size: float) -> Array:
    value = value.copy()
    for i, body in enumerate(world.scene.bodies):
        if body.motion == "prescribed" and world.steps:
            value[i, 2] -= size
    return value


def _low(told: Contacts, size: float) -> Array:
    return np.asarray((1.0 - size) * told.impulse)


def _impulse(change: Callable[[Contacts, float], Array]) -> Callable[[World, Contacts, float], Contacts]:
    return lambda world, told, size: replace(told, impulse=change(told, size))


def _late_impulse(world: World, told: Contacts, size: float) -> Contacts:
    """A share of the impulse of the step before; nothing where it had no such contact."""
    before = world.before[2]
    if len(before.a) == len(told.a):
        return replace(told, impulse=(1.0 - size) * told.impulse + size * before.impulse)
    return replace(told, impulse=(1.0 - size) * told.impulse)


def _spread(world: World, told: Contacts, size: float) -> Contacts:
    """A share of every impulse comes a step later, so that their sum is right."""
    late = world.before[2]
    parts = [(told, 1.0 - size), (late, size)] if world.steps else [(told, 1.0)]
    kept = ("a", "b", "point", "normal", "gap")
    joined = {name: np.concatenate([getattr(rows, name) for rows, _ in parts]) for name in kept}
    return Contacts(impulse=np.concatenate([share * rows.impulse for rows, share in parts]), **joined)


def _slipping(told: Contacts, size: float) -> Array:
    normal = (told.impulse * told.normal).sum(axis=1, keepdims=True) * told.normal
    return np.asarray(normal + (1.0 - size) * (told.impulse - normal))


def _tilted(world: World, told: Contacts, size: float) -> Contacts:
    x, y, z = told.normal.T
    c, s = math.cos(size), math.sin(size)
    return replace(told, normal=np.column_stack([c * x - s * z, y, s * x + c * z]))


def _tilted_once(world: World, told: Contacts, size: float) -> Contacts:
    """Only the last normal; others are right."""
    return replace(told, normal=np.vstack([told.normal[:-1], _tilted(world, told, size).normal[-1:]]))


def _long_once(world: World, told: Contacts, size: float) -> Contacts:
    """Only the last normal is too long."""
    return replace(told, normal=np.vstack([told.normal[:-1], (1.0 + size) * told.normal[-1:]]))


def _turned_aside(world: World, value: Array, size: float) -> Array:
    """The last body gains along one axis what it loses along the other: the sum of components is unchanged."""
    value = value.copy()
    value[-1, [0, 2]] += np.array([size, -size]) * float(world.steps > 0)
    return value


def _backwards(world: World, told: Contacts, size: float) -> Contacts:
    return Contacts(told.b, told.a, told.point, told.normal, told.impulse, told.gap)


def _held(world: World, held: dict[str, Any], size: float) -> dict[str, Any]:
    bodies = {name: {**body, "mass": (1.0 - size) * body["mass"]} for name, body in held["bodies"].items()}
    return {**held, "bodies": bodies}


def _mirrored_turn(world: World, value: Array, size: float) -> Array:
    turned: Array = value * np.array([1.0, 1.0, 1.0, 1.0, -1.0, -1.0, -1.0])
    return turned


# ---- statements of the engine --------------------------------------------------------------------------------------


def _leaking(engine: Spoilt, scene: Scene, dt: float, given: dict[str, Any]) -> tuple[float, dict[str, Any]]:
    engine.past.kept.append(b"x" * int(engine.size))
    return dt, given


def _known_only(engine: Spoilt, scene: Scene, dt: float, given: dict[str, Any]) -> tuple[float, dict[str, Any]]:
    return dt, {"iterations": given["iterations"]}


def _any_step(engine: Spoilt, scene: Scene, dt: float, given: dict[str, Any]) -> tuple[float, dict[str, Any]]:
    return (dt if 0.0 < dt < math.inf else DT), given


def _any_direction(engine: Spoilt, scene: Scene, dt: float, given: dict[str, Any]) -> tuple[float, dict[str, Any]]:
    return abs(dt), given


def _any_count(engine: Spoilt, scene: Scene, dt: float, given: dict[str, Any]) -> tuple[float, dict[str, Any]]:
    return dt, {**given, "iterations": max(1, given.get("iterations", 1))}


def _no_reason(given: list[Setting]) -> list[Setting]:
    return [replace(setting, because="") for setting in given]


def _low_record(world: World, told: Recorded, size: float) -> Recorded:
    return told if told.contacts is None else replace(told, contacts=_impulse(_low)(world, told.contacts, size))


FAULTS: dict[str, Fault] = {
    "mass too small": Fault("receipt mass", SHARES, "share", told=_each(_mass)),
    "inertia too small": Fault("receipt inertia", SHARES, "share", told=_each(_inertia)),
    "inertia of a disc given to a ball": Fault("receipt inertia", COARSE, "share", told=_each(_disc)),
    "box too long along one axis": Fault("sizes", (0.1, 0.03, 0.01), "share", told=_each(_long)),
    "inertia too small about every axis": Fault("moments", SHARES, "share", told=_each(_inertia)),
    "principal axes swapped": Fault("receipt inertia", COARSE, "share", told=_each(_swapped)),
    "torque too small": Fault("receipt inertia", SHARES, "share", told=_each(_torque)),
    "torque with the wrong sign": Fault("receipt turn", told=lambda scene, _: _each(_torque)(scene, 2.0)),
    "gravity too weak": Fault("receipt gravity", SHARES, "share", told=_gravity),
    "gravity sideways": Fault("receipt gravity", SHARES, "rad", told=_sideways),
    "gravity upwards": Fault("receipt gravity", told=lambda scene, _: _gravity(scene, 2.0)),
    "friction too low": Fault("receipt friction", SHARES, "share", told=_pair("friction")),
    "friction too high": Fault(
        "receipt friction", COARSE, "share", told=lambda scene, size: _pair("friction")(scene, -size)
    ),
    "restitution too low": Fault("receipt restitution", SHARES, "share", told=_pair("restitution")),
    "restitution ignored": Fault("receipt restitution", told=lambda scene, _: _pair("restitution")(scene, 1.0)),
    # A box is measured to a step of its approach, half a per cent of it at 1/240 s.
    "extents too small": Fault("receipt size", (0.5, 0.1, 0.01), "share", told=_each(_extent)),
    "step of its own": Fault("receipt step", SHARES, "share", stepped=lambda dt, size: (1.0 - size) * dt),
    "state read late": Fault("receipt sampling", COARSE, "steps", pose=_late_pose, twist=_late_twist),
    "drag that is not declared": Fault(
        "receipt linear_damping", SHARES, "1/s", twist=_scaled(ALL, LINEAR, lambda world: world.steps * world.dt)
    ),
    "spin that dies down": Fault(
        "receipt angular_damping", SHARES, "1/s", twist=_scaled(ALL, ANGULAR, lambda world: world.steps * world.dt)
    ),
    "impulses reported too low": Fault("receipt impulse", SHARES, "share", contacts=_impulse(_low)),
    "friction reported too low": Fault("receipt friction_impulse", SHARES, "share", contacts=_impulse(_slipping)),
    "angles with the wrong sign": Fault("receipt turn", pose=_mirrored_turn),
    # The wrong word is the fault, which the type checker notices as well.
    "role that does not exist": Fault("facts", facts=lambda facts: replace(facts, roles={"default": "best"})),  # type: ignore[dict-item]
    "setting without a reason": Fault("profiles", settings=_no_reason),
    "setting that is set twice": Fault("profiles", settings=lambda given: given * 2),
    "unknown settings ignored": Fault("refusals", build=_known_only),
    "refusal of several lines": Fault("refusals", refuses=lambda scene, said: "bodies:\nno" if said else None),
    "time step is not checked": Fault("bad_numbers", build=_any_step),
    "step backwards taken": Fault("bad_numbers", build=_any_direction),
    "count below 1 is accepted": Fault("bad_numbers", build=_any_count),
    "refused, but built": Fault(
        "capabilities", refuses=lambda scene, said: said or ("no" if len(scene.bodies) == 1 else None)
    ),
    "prescribed body pushed": Fault("capabilities", SHARES, "m/s", twist=_pushed),
    "start displaced": Fault("states", (1e-2, 1e-4, 1e-6), "m", pose=_at(ALL, 2, lambda world: 1.0)),
    "start with another speed": Fault("states", (1e-2, 1e-4, 1e-6), "m/s", twist=_at(ALL, 0, lambda world: 1.0)),
    "bodies in another order": Fault(
        "states", pose=lambda world, value, _: value[::-1], twist=lambda world, value, _: value[::-1]
    ),
    "another mass is used than reported": Fault("readback", SHARES, "share", readback=_held),
    "nothing read back": Fault("readback", readback=lambda world, held, _: {}),
    "one normal of several tilted": Fault("contacts", (0.1, 0.03, 0.01), "rad", contacts=_tilted_once),
    "recoil too small": Fault("impulse", SHARES, "share", twist=_scaled(0, LINEAR, lambda world: 1.0)),
    "gravity of half a step too much": Fault(
        "free_fall", COARSE, "steps", pose=_at(ALL, 2, lambda world: -0.5 * 9.81 * world.dt * world.steps * world.dt)
    ),
    "momentum without a cause": Fault(
        "momentum", SHARES, "share", twist=_scaled(-1, LINEAR, lambda world: float(world.steps > 0))
    ),
    "momentum moved from one axis to another": Fault("momentum", SHARES, "m/s", twist=_turned_aside),
    "spin without a cause": Fault(
        "spin", (1.0, 0.1, 0.03), "share", twist=_scaled(0, ANGULAR, lambda world: float(world.steps > 0))
    ),
    "normal tilted": Fault("contacts", SHARES, "rad", contacts=_tilted),
    "normal not of length 1": Fault(
        "contacts", SHARES, "share", contacts=lambda _, told, size: replace(told, normal=(1.0 + size) * told.normal)
    ),
    "one normal of several not of length 1": Fault("contacts", SHARES, "share", contacts=_long_once),
    "normal from the second body": Fault("contacts", contacts=lambda _, told, size: replace(told, normal=-told.normal)),
    # Bodies may sink by centimetres, and every other point of a body is farther from the floor.
    "contact point elsewhere": Fault(
        "contacts", (1.0, 0.3, 0.1), "m", contacts=lambda _, told, size: replace(told, point=told.point + size)
    ),
    "gap of another contact": Fault(
        "contacts", (1.0, 0.3, 0.1), "m", contacts=lambda _, told, size: replace(told, gap=told.gap + size)
    ),
    "bodies of a contact in wrong order": Fault("contacts", contacts=_backwards),
    "impulse of the wrong body": Fault(
        "impulse", COARSE, "share", contacts=_impulse(lambda told, size: (1.0 - 2.0 * size) * told.impulse)
    ),
    "impulse of the step before": Fault("sampling", COARSE, "share", contacts=_late_impulse),
    # The sum over all steps is right: a check of the sum alone does not notice it.
    "impulse spread over two steps": Fault("sampling", COARSE, "share", contacts=_spread),
    "first body drifts": Fault(
        "order", COARSE, "m/s", pose=_at(0, 0, lambda world: world.steps * world.dt), twist=_at(0, 0, lambda world: 1.0)
    ),
    "all bodies drift to one side": Fault(
        "mirror", COARSE, "m/s", pose=_at(ALL, 0, lambda world: world.steps * world.dt)
    ),
    "slower upwards than sideways": Fault("quarter_turn", SHARES, "share", twist=_scaled(ALL, 2, lambda world: 1.0)),
    "state shared with another world": Fault(
        "fresh", BITS, "m a step", pose=_at(ALL, 0, lambda world: float(world.others))
    ),
    # Worlds that run one after another, each to its end, are right.
    "depends on steps of another world": Fault(
        "fresh", BITS, "m a step", pose=_at(ALL, 0, lambda world: float(world.interrupted))
    ),
    "another result each time": Fault("repeat", BITS, "m/s", twist=_at(ALL, 0, lambda world: random.random())),
    "another result after another scene": Fault(
        "history", BITS, "m", pose=_at(ALL, 0, lambda world: float(world.after not in ("", world.scene.name)))
    ),
    "another result in another process": Fault(
        "process", BITS, "m", pose=_at(ALL, 0, lambda world: float(1 + os.getpid() % 9973))
    ),
    "another result for many steps at once": Fault(
        "stride", BITS, "m", pose=_at(ALL, 0, lambda world: float(world.at_once > 1))
    ),
    "another state in a record": Fault(
        "stride", BITS, "m", record=lambda world, told, size: replace(told, pose=told.pose + size * (told.pose != 0.0))
    ),
    "recorded contacts a sample late": Fault(
        "stride", record=lambda world, told, _: replace(told, counts=np.roll(told.counts, 1))
    ),
    "recorded impulses too low": Fault("stride", SHARES, "share", record=_low_record),
    "worlds are never freed": Fault("memory", (1e5, 1e4, 3e3), "bytes a world", build=_leaking),
}


class FaultyToy(Spoilt):
    """The toy with the fault called ``name``, of ``size``."""

    def __init__(self, name: str, size: float) -> None:
        super().__init__(FAULTS[name], size)
        self._told = name, size

    def __reduce__(self) -> tuple[Any, ...]:
        """Another process makes the same fault again."""
        return FaultyToy, self._told
