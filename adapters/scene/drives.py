"""Driven motion: surface velocities, prescribed courses, and the abilities of an adapter for them.

A conveyor is a body at rest whose surface moves along itself. For a half-space that is the same as a half-space that
moves along itself, which engines without surface velocities get (`as_moving`).

A course adds an oscillation to the constant twist of a prescribed body:

    x(t) = x0 + v t + A (sin(2 pi f t + phase) - sin(phase))

Engines move a body by a velocity. For each step they get the mean one, ``(x(t + dt) - x(t)) / dt``, so the body is on
its course at the end of every step; bodies that touch it see that velocity.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Literal

from adapters.scene import Body, HalfSpace, Scene

#: Features of a scene beyond discs, balls, boxes, fixed half-spaces, constant twists and passive contacts. An adapter
#: lists those that it supports (`adapters.engine.EngineFacts.abilities`); others are refused before it is called.
Ability = Literal[
    "surface velocity",
    "moving half-space",
    "turning half-space",
    "course",
    "capsule",
    "polygon",
    "cylinder",
    "hull",
    "restitution above 1",
]


def velocity_over(body: Body, dt: float, step: int) -> tuple[float, ...]:
    """Velocity [m/s] that takes a prescribed body through step number ``step`` (0 is the first) of ``dt`` [s]."""
    velocity, course = body.twist[: len(body.force)], body.course
    if course is None:
        return velocity
    rate = 2.0 * math.pi * course.frequency
    late, early = (math.sin(rate * (k * dt) + course.phase) for k in (step + 1, step))
    return tuple(v + a * ((late - early) / dt) for v, a in zip(velocity, course.amplitude, strict=True))


def place_after(body: Body, time: float) -> tuple[float, ...]:
    """Place [m] of a prescribed body's centre after ``time`` [s]."""
    size, course = len(body.force), body.course
    place = tuple(x + v * time for x, v in zip(body.pose[:size], body.twist[:size], strict=True))
    if course is None:
        return place
    swung = math.sin(2.0 * math.pi * course.frequency * time + course.phase) - math.sin(course.phase)
    return tuple(x + a * swung for x, a in zip(place, course.amplitude, strict=True))


def top_speed(body: Body) -> float:
    """Largest prescribed or surface speed of a body [m/s]; of a free body its initial speed."""
    own = math.hypot(*body.twist[: len(body.force)]) + (body.course.top_speed if body.course else 0.0)
    return own + math.hypot(*body.surface_velocity)


def asked_abilities(scene: Scene) -> Iterator[tuple[str, Ability]]:
    """Features that a scene needs: field and ability."""
    kinds: dict[str, Ability] = {"Capsule": "capsule", "Polygon": "polygon", "Cylinder": "cylinder", "Hull": "hull"}
    for body in scene.bodies:
        kind = type(body.shape).__name__
        if kind in kinds:
            yield f"{body.name}.shape", kinds[kind]
        if any(body.surface_velocity):
            yield f"{body.name}.surface_velocity", "surface velocity"
        if body.course is not None:
            yield f"{body.name}.course", "course"
        if isinstance(body.shape, HalfSpace) and body.motion == "prescribed":
            yield f"{body.name}.motion", "moving half-space"
        if turns(body):
            yield f"{body.name}.twist", "turning half-space"
    if scene.gaining and any(restitution > 1.0 for restitution, _ in scene.materials()):
        yield "pairs", "restitution above 1"


def turns(body: Body) -> bool:
    """Whether a half-space rotates, about the initial origin."""
    return isinstance(body.shape, HalfSpace) and any(body.twist[len(body.force) :])


def as_moving(scene: Scene) -> Scene:
    """The same physics with half-spaces that move along themselves instead of fixed ones with a surface velocity."""
    bodies = tuple(_moving(body) for body in scene.bodies)
    return scene if bodies == scene.bodies else replace(scene, bodies=bodies)


def _moving(body: Body) -> Body:
    if not any(body.surface_velocity) or not isinstance(body.shape, HalfSpace) or body.motion != "fixed":
        return body
    spin = (0.0,) * (len(body.twist) - len(body.force))
    return replace(body, motion="prescribed", twist=(*body.surface_velocity, *spin), surface_velocity=())
