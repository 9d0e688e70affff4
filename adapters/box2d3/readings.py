"""Box2D 3's ways to read contact forces in its Python package; see `adapters.readings`."""

from __future__ import annotations

from typing import Any

import numpy as np

from adapters.box2d3.simulation import Box2D3Simulation
from adapters.readings import Ask, Cause, Read, Reading, Told, acting_on


def _begin_touch(simulation: Box2D3Simulation) -> Ask:
    own = {body.shapes[0].id: index for index, body in enumerate(simulation.bodies)}

    def ask(body: int) -> list[Read]:
        found: list[Told] = []
        for event in simulation.world.get_contact_events().begin_events():
            first, second = own[event.shape_a.id], own[event.shape_b.id]
            manifold: Any = event.manifold
            n = np.array([manifold.normal.x, manifold.normal.y])
            for point in manifold.points[: manifold.point_count]:
                impulse = (
                    point.normal_impulse * n + point.tangent_impulse * np.array([-n[1], n[0]])
                ) / simulation.units
                found.append((first, second, impulse, None))
        return acting_on(body, found)

    return ask


_EARLY = Cause(
    ("rest", "slope", "sliding", "blow", "grip"),
    "the event comes before a contact is solved for the first time, and never again: it reads 0",
)
READINGS = (
    Reading(
        "world.get_contact_events().begin_events()[i].manifold.points[j].normal_impulse", "impulse",
        "each point of a contact that has just begun", "on shape_b's body", "along manifold.normal",
        "no step that was made", "without", _begin_touch,
        hint="The package has no other call: b2Body_GetContactData is not in it.", causes=(_EARLY,),
    ),
)  # fmt: skip
