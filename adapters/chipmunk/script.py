"""A run on Chipmunk as a stand-alone script: the calls of `adapters.chipmunk.simulation`, with their values."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from adapters.chipmunk.profiles import UNSET, checked
from adapters.chipmunk.simulation import ChipmunkSimulation
from adapters.chipmunk.translation import corners, moment
from adapters.scene import Body, Capsule, Disc, Scene
from adapters.script import constants, imports, literal, stepped, text, velocity

_SPACE = ("iterations", "collision_slop", "collision_bias", "collision_persistence")


def python(scene: Scene, dt: float, settings: Mapping[str, Any], steps: int) -> str:
    """Python of a run with pymunk; see `adapters.engine.Writer`."""
    chosen = checked(settings)
    built = ChipmunkSimulation(scene, dt, chosen)  # places and materials are those computed by the simulation
    lines = [*imports(scene, "import pymunk"), *constants(dt, steps), "", "space = pymunk.Space()"]
    lines.append(f"space.gravity = {literal(scene.gravity)}")
    lines += [f"space.{name} = {chosen[name]!r}" for name in (*_SPACE, *UNSET) if name in chosen]
    lines += ["bodies = {}", *(f"# start: {change}" for change in built.initial_change)]
    for asked, body, shape in zip(scene.bodies, built.bodies, built.shapes, strict=True):
        lines += ["", *_made(scene, asked, body, shape)]
    lines += ["", "", "def state():", "    return {"]
    lines.append("        name: ((*body.position, body.angle), (*body.velocity, body.angular_velocity))")
    lines += ["        for name, body in bodies.items()", "    }"]
    return text(lines + stepped([*_loads(scene), "space.step(DT)"]))


def _made(scene: Scene, asked: Body, body: Any, shape: Any) -> list[str]:
    """Lines that make a body with its shape, as ``body`` and ``shape`` are placed."""
    kind = {"fixed": "STATIC", "prescribed": "KINEMATIC"}.get(asked.motion)
    given = f"body_type=pymunk.Body.{kind}" if kind else f"{asked.mass!r}, {moment(asked)!r}"
    lines = [f"body = bodies[{asked.name!r}] = pymunk.Body({given})"]
    lines.append(f"body.position, body.angle = {literal(tuple(body.position))}, {body.angle!r}")
    if asked.motion != "fixed":
        lines.append(f"body.velocity, body.angular_velocity = {literal(tuple(body.velocity))}, {asked.twist[2]!r}")
    if isinstance(asked.shape, Disc):
        lines.append(f"shape = pymunk.Circle(body, {asked.shape.radius!r})")
    elif isinstance(asked.shape, Capsule):
        x = asked.shape.half_length
        lines.append(f"shape = pymunk.Segment(body, ({-x!r}, 0.0), ({x!r}, 0.0), {asked.shape.radius!r})")
    else:
        lines.append(f"shape = pymunk.Poly(body, {corners(scene, asked)!r})")
    if any(asked.surface_velocity):
        lines.append(f"shape.surface_velocity = {literal(asked.surface_velocity)}")
    lines.append(f"shape.elasticity, shape.friction = {shape.elasticity!r}, {shape.friction!r}")
    return [*lines, "space.add(body, shape)"]


def _loads(scene: Scene) -> list[str]:
    """Lines before a step: external loads, which every step clears, and prescribed velocities."""
    lines = [f"bodies[{b.name!r}].velocity = {velocity(b)}" for b in scene.bodies if b.course is not None]
    loaded = [b for b in scene.bodies if b.motion == "free" and (any(b.force) or any(b.torque))]
    return lines + [
        f"bodies[{b.name!r}].force, bodies[{b.name!r}].torque = {literal(b.force)}, {b.torque[0]!r}" for b in loaded
    ]
