"""Box2D's ways to read contact forces; see `adapters.readings`."""

from __future__ import annotations

from typing import Any

import numpy as np

from adapters.box2d.simulation import Box2DSimulation
from adapters.readings import Ask, Cause, Read, Reading, Told, acting_on, cleared

_BIAS = "without: overlaps are corrected in positions alone"
_AXES = "along worldManifold.normal, and along that normal turned by -90 degrees"


def _parts(contact: Any, normal: Any, tangent: Any, units: float) -> list[Told]:
    """Bodies of a contact, impulse of each point on the second, and place of the point."""
    a, b = contact.fixtureA.body.userData, contact.fixtureB.body.userData
    world = contact.worldManifold
    (nx, ny), count = world.normal, contact.manifold.pointCount
    return [
        (a, b, np.array([jn * nx + jt * ny, jn * ny - jt * nx]) / units, np.array(place) / units)
        for jn, jt, place in zip(normal[:count], tangent[:count], world.points[:count], strict=True)
    ]


def _post_solve(simulation: Box2DSimulation) -> Ask:
    heard: list[Told] = []
    own = simulation.listener

    class Listener(type(own)):  # type: ignore[misc]
        def PostSolve(self, contact: Any, impulse: Any) -> None:
            heard.extend(_parts(contact, impulse.normalImpulses, impulse.tangentImpulses, simulation.units))

    simulation.listener = simulation.world.contactListener = Listener(own.radii, own.materials, own.early)
    return cleared(simulation, heard)


def _manifold(simulation: Box2DSimulation) -> Ask:
    def ask(body: int) -> list[Read]:
        parts: list[Told] = []
        for contact in simulation.world.contacts:
            points = contact.manifold.points
            normal, tangent = [p.normalImpulse for p in points], [p.tangentImpulse for p in points]
            parts += _parts(contact, normal, tangent, simulation.units)
        return acting_on(body, parts)

    return ask


_ENDED = Cause(
    ("blow",), "a continuous collision in the step finds the contact anew and clears its impulses: it reads 0",
    {"continuous": False}, "tuned",
)  # fmt: skip
READINGS = (
    Reading(
        "impulse.normalImpulses, tangentImpulses in PostSolve", "impulse", "each point of a contact; add up all calls",
        "on the body of fixtureB, from that of fixtureA", _AXES,
        "each solve; a step with a continuous collision has several, whose sum is the step's", _BIAS, _post_solve,
    ),
    Reading(
        "contact.manifold.points[i].normalImpulse, tangentImpulse, after the step", "impulse",
        "each point of a contact in world.contacts", "on the body of fixtureB, from that of fixtureA", _AXES,
        "the last solve of the step, without those of continuous collisions", _BIAS, _manifold, causes=(_ENDED,),
    ),
)  # fmt: skip
