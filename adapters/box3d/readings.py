"""Box3D's ways to read contact forces in its Python package; see `adapters.readings`."""

from __future__ import annotations

from collections.abc import Iterator
from importlib import import_module
from types import SimpleNamespace
from typing import Any

import numpy as np

from adapters.box3d.simulation import Box3DSimulation
from adapters.readings import Ask, Cause, Read, Reading, Told, acting_on


def _vector(told: Any) -> Any:
    return np.array([told.x, told.y, told.z])


def _manifolds(simulation: Box3DSimulation) -> Iterator[tuple[int, int, Any]]:
    """Two bodies, by their indices in the scene, and a manifold between them; each manifold once."""
    lib, index = simulation.lib, simulation.index
    for own, body in enumerate(simulation.bodies):
        room = lib.b3Body_GetContactCapacity(body)
        found = simulation.ffi.new("b3ContactData[]", room) if room else []
        for k in range(lib.b3Body_GetContactData(body, found, room) if room else 0):
            first, second = index[found[k].shapeIdA.index1], index[found[k].shapeIdB.index1]
            for m in range(found[k].manifoldCount if own == first else 0):
                yield first, second, found[k].manifolds[m]


def _data(simulation: Box3DSimulation, name: str) -> Ask:
    def ask(body: int) -> list[Read]:
        told, units, poses = list[Told](), simulation.units, np.array(simulation.copy_pose(), float)
        for first, second, manifold in _manifolds(simulation):
            points = [manifold.points[k] for k in range(manifold.pointCount)]
            places = [(poses[first, :3] + _vector(each.anchorA)) / units for each in points]
            told += [
                (first, second, getattr(each, name) / units * _vector(manifold.normal), place)
                for each, place in zip(points, places, strict=True)
            ]
            if points:
                told.append((first, second, _vector(manifold.frictionImpulse) / units, np.mean(places, axis=0)))
        return acting_on(body, told)

    return ask


def _sensor(simulation: Box3DSimulation) -> Ask:
    sensor = import_module("robox3d").ContactSensor
    world = SimpleNamespace(last_substep_dt=simulation.dt / simulation.settings["substeps"])
    sensors = [sensor(SimpleNamespace(id=body, _world=world)) for body in simulation.bodies]

    def ask(body: int) -> list[Read]:
        return [Read(None, simulation.dt / simulation.units * sensors[body].read().normal_force)]

    return ask


_TOUCHING = ("rest", "slope", "sliding", "blow", "grip")
_LAST = "the last substep"
_PART = Cause(_TOUCHING, "it is the impulse of one substep of several", {"substeps": 1})
_SUM = Cause(_TOUCHING, "it adds up the impulse after each solve and each relaxation: one substep counts several times")
_ONE = Cause(("rest", "blow"), "it is the force of the last substep, and that of the others differs")
_SMOOTH = Cause(_TOUCHING, "it adds up normal parts; friction is not in it")
READINGS = (
    Reading(
        "b3Body_GetContactData(): manifold.points[k].normalImpulse, manifold.frictionImpulse", "impulse",
        "each point of a manifold, friction of all together", "on shapeB's body, from shapeA's",
        "along manifold.normal; friction in world axes", _LAST, "without, as it is relaxed",
        lambda simulation: _data(simulation, "normalImpulse"),
        hint="Divided by the length of a substep it is a force.", causes=(_PART,),
    ),
    Reading(
        "b3Body_GetContactData(): manifold.points[k].totalNormalImpulse", "impulse", "each point of a manifold",
        "on shapeB's body, from shapeA's", "along manifold.normal", "all substeps, solves and relaxations",
        "with what pushes out of overlaps in it", lambda simulation: _data(simulation, "totalNormalImpulse"), "normal",
        causes=(_SUM,),
    ),
    Reading(
        "ContactSensor(body).read().normal_force", "force", "all points of a body", "on the body", "world axes", _LAST,
        "without, as it is relaxed", _sensor, causes=(_ONE, _SMOOTH),
    ),
)  # fmt: skip
