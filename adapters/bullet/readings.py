"""Bullet's ways to read contact forces; see `adapters.readings`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from adapters.bullet.simulation import BulletSimulation
from adapters.readings import Ask, Cause, Read, Reading

_STEP = "a step; with numSubSteps = n > 1 it is 1/n of the force of the last substep"
_BIAS = "without the split impulse; what contactERP pushes out of an overlap is in it, and in the velocity"


def _points(forces: Callable[[tuple[Any, ...]], Any], asks: bool) -> Callable[[BulletSimulation], Ask]:
    """A reading of ``getContactPoints``, of all points or of those asked for by ``bodyA``.

    ``forces`` gives the force of a point on bodyA [N].
    """

    def begin(simulation: BulletSimulation) -> Ask:
        call, client, index = simulation._p.getContactPoints, simulation._client, simulation._index

        def ask(body: int) -> list[Read]:
            told = call(bodyA=simulation._ids[body], physicsClientId=client) if asks else call(physicsClientId=client)
            found = []
            for point in told:
                first, second = index[point[1]], index[point[2]]
                impulse = simulation._dt * forces(point)
                if body == first:
                    found.append(Read(second, impulse, np.array(point[5])))
                elif body == second:
                    found.append(Read(first, -impulse, np.array(point[6])))
            return found

        return ask

    return begin


def _normal(point: tuple[Any, ...]) -> Any:
    return point[9] * np.array(point[7])


def _whole(point: tuple[Any, ...]) -> Any:
    return _normal(point) + point[10] * np.array(point[11]) + point[12] * np.array(point[13])


_AXES = "along contactNormalOnB, lateralFrictionDir1, lateralFrictionDir2 in world axes"
_APART = Cause(
    ("blow", "airborne"),
    "with contactProcessingThreshold = 0 points stay in the list after bodies part, with the force of the last step in "
    "touch: skip those with distance > 0, but never as shipped, where such points carry force",
    {"contactProcessingThreshold": 1e30}, "tuned",
)  # fmt: skip
_WARM = Cause(
    ("grip",), "friction of a warm start is not all of what acts before the solver has converged",
    {"warmStartingFactor": 0.0}, "tuned",
)  # fmt: skip
_UNTURNED = Cause(
    ("rest", "slope", "sliding", "blow", "grip"),
    "where X is the second body, the call swaps A and B and turns the normal, but no direction of friction",
)
READINGS = (
    Reading(
        "getContactPoints(): normalForce, lateralFriction1, lateralFriction2", "force",
        "each point; add up those of a body", "on bodyA, minus that on bodyB", _AXES, _STEP, _BIAS,
        _points(_whole, False), causes=(_APART, _WARM),
    ),
    Reading(
        "getContactPoints(bodyA=X): the same", "force", "each point of X", "on X", _AXES, _STEP, _BIAS,
        _points(_whole, True), causes=(_UNTURNED, _APART),
    ),
    Reading(
        "getContactPoints(bodyA=X): normalForce", "force", "each point of X", "on X",
        "along contactNormalOnB", _STEP, _BIAS, _points(_normal, True), "normal", causes=(_APART,),
    ),
)  # fmt: skip
