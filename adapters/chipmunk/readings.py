"""Chipmunk's ways to read contact forces; see `adapters.readings`."""

from __future__ import annotations

from typing import Any

import numpy as np

from adapters.chipmunk.simulation import ChipmunkSimulation
from adapters.readings import Ask, Cause, Read, Reading, Told, cleared

_OF, _STEP = "the sum over the points of a pair", "the step just made"
_BIAS = "without: overlaps are corrected by velocities of their own"


def _after_step(simulation: ChipmunkSimulation) -> Ask:
    own = {id(shape): index for index, shape in enumerate(simulation.shapes)}

    def ask(body: int) -> list[Read]:
        found: list[Read] = []

        def collect(arbiter: Any) -> None:
            other = own[id(arbiter.shapes[1])]
            found.append(Read(other, np.array(arbiter.total_impulse)))

        simulation.bodies[body].each_arbiter(collect)
        return found

    return ask


def _post_solve(simulation: ChipmunkSimulation) -> Ask:
    own = {id(shape): index for index, shape in enumerate(simulation.shapes)}
    heard: list[Told] = []

    def listen(arbiter: Any, space: Any, data: Any) -> None:
        first, second = (own[id(shape)] for shape in arbiter.shapes)
        heard.append((second, first, np.array(arbiter.total_impulse), None))  # it acts on the first

    simulation.space.on_collision(post_solve=listen)
    return cleared(simulation, heard)


_AGAIN = Cause(
    ("rest",),
    "where bodies touch again within collision_persistence steps, the impulse of the last time is added to it",
    {"collision_persistence": 1}, "default",
)  # fmt: skip
READINGS = (
    Reading(
        "arbiter.total_impulse in post_solve", "impulse", _OF, "on the body of arbiter.shapes[0]", "world axes",
        _STEP, _BIAS, _post_solve, causes=(_AGAIN,),
    ),
    Reading(
        "arbiter.total_impulse in body.each_arbiter(), after the step", "impulse", _OF,
        "on that body, which is arbiter.shapes[0]", "world axes", _STEP, _BIAS, _after_step,
        hint="A static body has no arbiters: ask the body that touches it.", causes=(_AGAIN,),
    ),
)  # fmt: skip
