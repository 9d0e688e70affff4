"""A similar scene in other sizes and masses: times scale with the root of the length.

    lengths times L, masses times M, times times sqrt(L)    ->    speeds sqrt(L), forces and impulses M, M sqrt(L)

Gravity, restitution and friction are unchanged, so the laws of rigid bodies give similar motions. An engine with fixed
metres and seconds (a margin, a speed threshold, a time constant) may not.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from adapters.scene import Body, Scene
from adapters.scene.shapes import Box, Capsule, Cylinder, Disc, HalfSpace, Hull, Polygon, Shape, Sphere
from adapters.trajectory import Sampling, Trajectory
from validation.canonical import CanonicalScene

#: Factor of masses in other sizes, different from that of a constant density.
MASS = 0.2


def sized(base: CanonicalScene, length: float) -> CanonicalScene:
    """Return ``base`` with all lengths multiplied, and masses by `MASS`; it is judged in the units of ``base``."""
    mass, time = MASS, math.sqrt(length)

    def own(scene: Scene) -> Scene:
        return base.scene(scene.dimension, scene.params)

    def sampling(scene: Scene) -> Sampling:
        found = base.sampling(own(scene))
        start = found.contacts_from
        return replace(found, contacts_from=None if start is None else start * time)

    return replace(
        base,
        name=f"{base.name}@{length:g}",
        make=lambda dimension, params: enlarged(base.make(dimension, params), length, mass),
        exact=lambda scene: base.exact(own(scene)),
        measure=lambda scene, found: base.measure(own(scene), told_in_units_of(found, length, mass)),
        rule=lambda scene, dt, truth: base.rule(own(scene), dt / time, truth),
        growth=lambda scene: base.growth(own(scene)),
        sampling=sampling,
    )


def enlarged(scene: Scene, length: float, mass: float) -> Scene:
    """Return a scene with all lengths and masses multiplied, and the times of the same fall."""
    time, d = math.sqrt(length), scene.dimension

    def scaled(values: tuple[float, ...], factor: float) -> tuple[float, ...]:
        return tuple(factor * value for value in values)

    def body(one: Body) -> Body:
        moments = one.inertia
        course = one.course
        return replace(
            one,
            shape=_enlarged(one.shape, length),
            mass=mass * one.mass,
            inertia=(
                tuple(mass * length**2 * i for i in moments)  # type: ignore[arg-type]
                if isinstance(moments, tuple)
                else mass * length**2 * moments
            ),
            pose=(*scaled(one.pose[:d], length), *one.pose[d:]),
            twist=(*scaled(one.twist[:d], length / time), *scaled(one.twist[d:], 1.0 / time)),
            force=scaled(one.force, mass),
            torque=scaled(one.torque, mass * length),
            surface_velocity=scaled(one.surface_velocity, length / time),
            course=course
            and replace(course, amplitude=scaled(course.amplitude, length), frequency=course.frequency / time),
        )

    return replace(scene, bodies=tuple(map(body, scene.bodies)), duration=scene.duration * time)


def _enlarged(shape: Shape, length: float) -> Shape:
    if isinstance(shape, Sphere | Disc):
        return type(shape)(shape.radius * length)
    if isinstance(shape, Box):
        return Box(tuple(half * length for half in shape.half_extents))
    if isinstance(shape, Capsule | Cylinder):
        return replace(shape, radius=shape.radius * length, half_length=shape.half_length * length)
    if isinstance(shape, HalfSpace):
        return HalfSpace(shape.normal, shape.offset * length)
    assert isinstance(shape, Polygon | Hull)
    return replace(shape, vertices=tuple(tuple(x * length for x in vertex) for vertex in shape.vertices))  # type: ignore[arg-type]


def told_in_units_of(found: Trajectory, length: float, mass: float) -> Trajectory:
    """Return the result of an `enlarged` scene in the units of the scene itself."""
    time, d = math.sqrt(length), found.dimension
    pose, twist = np.array(found.pose), np.array(found.twist)
    pose[:, :, :d] /= length
    twist[:, :, :d] *= time / length
    twist[:, :, d:] *= time
    contacts = found.contacts
    if contacts is not None:
        rows, impulse = contacts.rows, contacts.rows.impulse * (time / (mass * length))
        rows = replace(rows, point=rows.point / length, gap=rows.gap / length, impulse=impulse)
        contacts = replace(contacts, rows=rows)
    return replace(found, t=found.t / time, pose=pose, twist=twist, contacts=contacts, dt=found.dt / time)
