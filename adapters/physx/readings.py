"""PhysX's ways to read contact forces in SAPIEN; see `adapters.readings`."""

from __future__ import annotations

import numpy as np

from adapters.physx.simulation import PhysxSimulation
from adapters.readings import Ask, Read, Reading, Told, acting_on


def _points(simulation: PhysxSimulation) -> Ask:
    def ask(body: int) -> list[Read]:
        found: list[Told] = []
        for contact in simulation.system.get_contacts():
            first, second = (simulation.index[part.entity.name] for part in contact.bodies)
            for point in contact.points:
                found.append((second, first, np.array(point.impulse, float), np.array(point.position, float)))
        return acting_on(body, found)

    return ask


READINGS = (
    Reading(
        "system.get_contacts()[i].points[j].impulse", "impulse", "each point of a pair", "on contact.bodies[0]",
        "world axes, the normal part alone", "the step just made", "without", _points, "normal",
        "The binding returns no friction: a body on a slope seems out of balance.",
    ),
)  # fmt: skip
