"""Pairs of bodies that can touch during a scene: only their materials must be represented by an engine.

For a group of bodies that may touch each other, the motion is bounded by energy. With the kinetic energy T of the group
and ``V = sqrt(2 T)``, contacts that add no energy (fixed partners, e <= 1, friction) give

    V(t) <= V(0) + t sqrt(sum m a^2 + torque^2 / I)      (Cauchy and Schwarz, of the loads' power),

so a body of mass m is never faster than ``V(t)/sqrt(m)`` and never farther from its start than t times that. A
prescribed body or a surface velocity adds energy, and so does restitution above 1: bodies that can reach one may be
anywhere afterwards.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from adapters.scene import Body, HalfSpace, Pair, Scene
from adapters.scene.drives import top_speed
from adapters.scene.near import near_pairs
from adapters.scene.shapes import reach

#: Pair of bodies, by index, with its material.
Meeting = tuple[int, int, Pair]
#: Factor on the distances, as engines deviate from the exact motion by drag, overlap or faster rebounds.
ROOM = 2.0
#: Most bodies for a test of every pair; with more, all are assumed to touch.
MOST_BODIES = 200


def representable(scene: Scene, solve: Callable[[Sequence[Meeting]], list[float] | None]) -> list[float] | None:
    """Values per body that give the materials of all pairs, or else of those that can touch; None if there are none.

    ``solve`` finds them for a list of pairs. All pairs are tried first. Many bodies of one material are represented by
    two free ones and two others.
    """
    if len(scene.bodies) > MOST_BODIES and len(scene.materials()) == 1:
        free = [body.motion == "free" for body in scene.bodies]
        chosen = [k for kind in (True, False) for k in [k for k, own in enumerate(free) if own is kind][:2]]
        told = solve(pairs_among(scene, sorted(chosen)))
        if told is not None:
            return [told[chosen[0] if is_free else chosen[-1]] for is_free in free]
    found = solve(list(scene.contact_pairs()))
    if found is not None:
        return found
    pairs = meeting_pairs(scene)
    return solve(pairs) if pairs else [0.0] * len(scene.bodies)


def pairs_among(scene: Scene, chosen: Sequence[int]) -> list[Meeting]:
    """Pairs with a free body among the chosen ones."""
    pairs = combinations(chosen, 2)
    names = [body.name for body in scene.bodies]
    free = [body.motion == "free" for body in scene.bodies]
    return [(i, j, scene.material(names[i], names[j])) for i, j in pairs if free[i] or free[j]]


def common_material(scene: Scene) -> tuple[float, float] | None:
    """Restitution and friction, if all pairs have the same: every rule of combination keeps equal values."""
    found = scene.materials()
    return found.pop() if len(found) == 1 else None


def told_pairs(scene: Scene) -> list[tuple[int, int]]:
    """Pairs in a readback: all, or with many bodies those that can touch at the start."""
    if len(scene.bodies) > MOST_BODIES:
        return list(near_pairs(scene, np.array([[body.pose for body in scene.bodies]])))
    return [(i, j) for i, j, _ in scene.contact_pairs()]


def meeting_pairs(scene: Scene) -> list[Meeting]:
    """Pairs with a free body that can come to touch within the scene's duration."""
    pairs = list(scene.contact_pairs())
    if scene.gaining or sum(body.motion == "free" for body in scene.bodies) > MOST_BODIES:
        return pairs
    group = list(range(len(scene.bodies)))
    while True:
        around = _around(scene, group)
        met = [pair for pair in pairs if _gap(scene, pair[0], pair[1]) <= around[pair[0]] + around[pair[1]]]
        joined = list(group)
        for i, j, _ in met:
            # A fixed body transfers no energy between bodies that touch it; a driven one does work on them.
            if _moves(scene.bodies[i]) and _moves(scene.bodies[j]):
                old, new = joined[j], joined[i]
                joined = [new if name == old else name for name in joined]
        if joined == group:
            return met
        group = joined


def _moves(body: Body) -> bool:
    return body.motion != "fixed" or any(body.surface_velocity)


def _around(scene: Scene, group: Sequence[int]) -> list[float]:
    """Largest distance of a body's outermost point from its start [m]."""
    found = [0.0] * len(scene.bodies)
    for name in set(group):
        members = [k for k, other in enumerate(group) if other == name]
        free = [scene.bodies[k] for k in members if scene.bodies[k].motion == "free"]
        driven = any(scene.bodies[k].motion != "free" and _moves(scene.bodies[k]) for k in members)
        start, growth = _norms(scene, free)
        for k in members:
            body = scene.bodies[k]
            if driven and free:
                speed = math.inf
            elif body.motion == "free":
                speed = (start + growth * scene.duration) / math.sqrt(body.mass)
            else:
                speed = top_speed(body) if body.motion == "prescribed" else 0.0
            found[k] = reach(body.shape) + ROOM * scene.duration * speed
    return found


def _norms(scene: Scene, free: Sequence[Body]) -> tuple[float, float]:
    """``V(0)`` [sqrt(kg) m/s] of a group, and its growth rate by loads."""
    d, start, growth = scene.dimension, 0.0, 0.0
    for body in free:
        inertia = np.atleast_1d(np.asarray(body.inertia, dtype=float))
        load = np.array(body.force) / body.mass + np.array(scene.gravity)
        start += body.mass * _square(body.twist[:d]) + float(inertia.max()) * _square(body.twist[d:])
        growth += body.mass * _square(load) + _square(body.torque) / float(inertia.min())
    return math.sqrt(start), math.sqrt(growth)


def _square(vector: Sequence[float] | NDArray[np.float64]) -> float:
    return float(sum(float(x) ** 2 for x in vector))


def _gap(scene: Scene, i: int, j: int) -> float:
    """Distance of two centres at the start, or of a centre from a face [m]."""
    a, b = scene.bodies[i], scene.bodies[j]
    if isinstance(a.shape, HalfSpace):
        a, b = b, a
    place = a.pose[: scene.dimension]
    if isinstance(b.shape, HalfSpace):
        return sum(n * x for n, x in zip(b.shape.normal, place, strict=True)) - b.shape.offset
    return math.dist(place, b.pose[: scene.dimension])
