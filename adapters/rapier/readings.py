"""Rapier's ways to read contact forces in its Python package; see `adapters.readings`."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from adapters.rapier.simulation import RapierSimulation
from adapters.readings import Ask, Cause, Read, Reading, Told, acting_on, cleared

_STEP = "the whole step, all substeps"
_BIAS = "with what the solver pushes out of overlaps in it"


def _pairs(simulation: RapierSimulation) -> Iterator[tuple[int, int, Any]]:
    for pair in simulation.world.narrow_phase.contact_pairs():
        yield simulation.index[pair.collider1], simulation.index[pair.collider2], pair


def _vector(told: Any) -> Any:
    return np.array([told.x, told.y, told.z])


def _points(simulation: RapierSimulation) -> Ask:
    def ask(body: int) -> list[Read]:
        told, bodies = list[Told](), simulation.world.rigid_bodies
        for first, second, pair in _pairs(simulation):
            for manifold in pair.manifolds:
                data = manifold.data
                place = {
                    each.contact_id: data.solver_contact_world_points(each, bodies) for each in data.solver_contacts
                }
                for k, point in enumerate(manifold.points):
                    middle = 0.5 * (_vector(place[k][0]) + _vector(place[k][1])) if k in place else np.zeros(3)
                    told.append((first, second, point.impulse * _vector(data.normal), middle))
        return acting_on(body, told)

    return ask


def _total(simulation: RapierSimulation) -> Ask:
    def ask(body: int) -> list[Read]:
        return acting_on(
            body, [(first, second, _vector(pair.total_impulse()), None) for first, second, pair in _pairs(simulation)]
        )

    return ask


def _event(simulation: RapierSimulation) -> Ask:
    rapier3d, world = simulation.rapier3d, simulation.world
    for handle in simulation.index:
        collider = world.colliders[handle]
        collider.active_events = rapier3d.ActiveEvents.CONTACT_FORCE_EVENTS
        collider.contact_force_event_threshold = 0.0
    collector = world.event_handler = rapier3d.ChannelEventCollector()
    heard: list[Told] = []
    ask = cleared(simulation, heard)

    def drained(body: int) -> list[Read] | None:
        for event in collector.drain_contact_force_events():
            first, second = simulation.index[event.collider1], simulation.index[event.collider2]
            heard.append((first, second, simulation.dt * _vector(event.total_force), None))
        return ask(body)

    return drained


_SMOOTH = Cause(("rest", "slope", "sliding", "blow", "grip"), "it adds up normal parts; there is no call for friction")
READINGS = (
    Reading(
        "manifold.points[k].impulse", "impulse", "each point of a manifold; add up those of a pair",
        "on collider2's body, from collider1's", "the normal alone, manifold.data.normal",
        _STEP, _BIAS, _points, "normal",
    ),
    Reading(
        "pair.total_impulse", "impulse", "all points of a pair", "on collider2's body, from collider1's", "world axes",
        _STEP, _BIAS, _total, causes=(_SMOOTH,),
    ),
    Reading(
        "event.total_force of ChannelEventCollector.drain_contact_force_events()", "force", "all points of a pair",
        "on collider2's body, from collider1's", "world axes", _STEP, _BIAS, _event,
        hint="It needs ActiveEvents.CONTACT_FORCE_EVENTS on a collider, and a threshold of 0.",
        causes=(_SMOOTH,),
    ),
)  # fmt: skip
