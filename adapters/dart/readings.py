"""DART's ways to read contact forces; see `adapters.readings`."""

from __future__ import annotations

from typing import Any

import numpy as np

from adapters.dart.simulation import DartSimulation
from adapters.readings import Ask, Cause, Read, Reading, Told, acting_on

_STEP = "the step just made"
_BIAS = "what is pushed out of an overlap is in it, and in the velocity"


def _contact_force(simulation: DartSimulation) -> Ask:
    def body_of(thing: Any) -> int:
        return simulation.index[thing.getShapeFrame().getBodyNode().getName()]

    def ask(body: int) -> list[Read]:
        found: list[Told] = []
        for contact in simulation.world.getLastCollisionResult().getContacts():
            first, second = body_of(contact.collisionObject1), body_of(contact.collisionObject2)
            found.append((second, first, simulation.dt * np.array(contact.force), np.array(contact.point)))
        return acting_on(body, found)

    return ask


def _constraint_forces(simulation: DartSimulation) -> Ask:
    def ask(body: int) -> list[Read] | None:
        if simulation.scene.bodies[body].motion != "free":
            return None
        node = simulation.nodes[body]
        force = np.array(node.getSkeleton().getConstraintForces())[3:]
        return [Read(None, simulation.dt * node.getTransform().rotation() @ force)]

    return ask


READINGS = (
    Reading(
        "contact.force of world.getLastCollisionResult()", "force", "each point; add up those of a body",
        "on the body of collisionObject1", "world axes", _STEP, _BIAS, _contact_force,
        hint="A body asleep reads 0; bodies fall asleep unless getDeactivationOptions().mEnabled is set to False.",
    ),
    Reading(
        "skeleton.getConstraintForces()", "force", "all contacts of a body, and its joint limits", "on the body",
        "axes of the body: torque, then force", _STEP, _BIAS, _constraint_forces,
        causes=(Cause(("blow", "grip"), "a body that turns has other axes at the start of the step than at its end"),),
    ),
)  # fmt: skip
