"""A run on Box2D 2.3 as a stand-alone script: the calls of `adapters.box2d.simulation`, with their numbers."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from adapters.ground import reach
from adapters.meeting import common_material
from adapters.scene import Body, Box, Disc, HalfSpace, Scene
from adapters.script import constants, imports, literal, materials, stepped, text

_MAKERS = {"free": "CreateDynamicBody", "fixed": "CreateStaticBody", "prescribed": "CreateKinematicBody"}


def python(scene: Scene, dt: float, settings: Mapping[str, Any], steps: int) -> str:
    """Python of a run with Box2D; see `adapters.engine.Writer`."""
    units, alike = float(settings["units_per_metre"]), common_material(scene)
    gravity = _scaled(scene.gravity, units)
    lines = [*imports(scene, "import Box2D"), *constants(dt, steps)]
    lines += [f"UNITS = {units!r}  # lengths are handed over in 1/UNITS m", ""]
    lines += [f"world = Box2D.b2World(gravity={literal(gravity)})"]
    lines += [f"world.continuousPhysics = {settings['continuous']!r}", "bodies = {}", ""]
    for index, body in enumerate(scene.bodies):
        lines += [*_made(index, body, scene, settings, alike or (0.0, 0.0)), ""]
    early = bool(settings["early_restitution"])
    own = materials(scene) if early or alike is None else []
    if own:
        lines += [*own, *_LISTENER]
        if early:
            kick = tuple(g * dt for g in gravity)
            lines += [f"    KICK = {literal(kick)}  # gravity of a step", *_EARLY]
        lines += ["", "", "listener = world.contactListener = Listener()"]
    still = literal([body.name for body in scene.bodies if isinstance(body.shape, HalfSpace)])
    lines.append(f"HALF_SPACES = {still}  # their pose is the origin, wherever their polygons stand")
    loads = []
    for body in scene.bodies:
        if body.is_loaded:
            held = f"bodies[{body.name!r}]"
            loads.append(f"{held}.ApplyForceToCenter({literal(_scaled(body.force, units))}, True)")
            loads.append(f"{held}.ApplyTorque({literal(body.torque[0] * units**2)}, True)")
    step = f"world.Step(DT, {settings['iterations']!r}, {settings['position_iterations']!r})"
    return text([*lines, *_STATE, *stepped([*loads, step])])


def _scaled(v: tuple[float, ...], units: float) -> tuple[float, float]:
    return v[0] * units, v[1] * units


def _made(
    index: int, asked: Body, scene: Scene, settings: Mapping[str, Any], numbers: tuple[float, float]
) -> list[str]:
    """Lines that make a body with its shape; ``numbers`` are its restitution and friction."""
    units = float(settings["units_per_metre"])
    if isinstance(asked.shape, HalfSpace):
        (nx, ny), offset = asked.shape.normal, asked.shape.offset
        turn = 0.0 if 0.0 in (nx, ny) else math.atan2(-nx, ny)
        place = f"position={literal(_scaled((offset * nx, offset * ny), units))}, angle={literal(turn)}"
    else:
        x, y, theta = asked.pose
        place = f"position={literal(_scaled((x, y), units))}, angle={literal(theta)}, allowSleep=False"
    lines = [f"body = bodies[{asked.name!r}] = world.{_MAKERS[asked.motion]}({place})", f"body.userData = {index}"]
    lines += _shape(asked, scene, units, settings["skin"])
    own = f"density=1.0, restitution={literal(numbers[0])}, friction={literal(numbers[1])}"
    lines.append(f"body.CreateFixture(Box2D.b2FixtureDef(shape=shape, {own}))")
    if asked.motion == "free":
        assert isinstance(asked.inertia, float | int)
        mass, inertia = literal(asked.mass), literal(asked.inertia * units**2)
        lines.append(f"body.massData = Box2D.b2MassData(mass={mass}, I={inertia}, center=(0.0, 0.0))")
    if asked.motion != "fixed":
        vx, vy, omega = asked.twist
        velocity = literal(_scaled((vx, vy), units))
        lines.append(f"body.linearVelocity, body.angularVelocity = {velocity}, {literal(omega)}")
    return lines


def _shape(asked: Body, scene: Scene, units: float, skin: float) -> list[str]:
    """Lines that make a shape."""
    shape = asked.shape
    if isinstance(shape, Disc):
        return [f"shape = Box2D.b2CircleShape(radius={literal(shape.radius * units)})"]
    if isinstance(shape, Box):
        box: tuple[Any, ...] = _scaled(shape.half_extents, units)
    else:
        assert isinstance(shape, HalfSpace)
        wide = reach(scene) * units
        nx, ny = shape.normal if 0.0 in shape.normal else (0.0, 1.0)
        box = (wide, wide, (-nx * wide, -ny * wide), 0.0)
    return [f"shape = Box2D.b2PolygonShape(box={literal(box)})", f"shape.radius = {literal(skin)}"]


#: Lines of what gives each pair its own material when it meets.
_LISTENER = [
    "class Listener(Box2D.b2ContactListener):",
    "    def BeginContact(self, contact):",
    "        own = material(contact.fixtureA.body.userData, contact.fixtureB.body.userData)",
    "        contact.restitution, contact.friction = own",
]
#: Lines of what lowers a restitution so that the rebound is that of the velocity before a step's gravity.
_EARLY = [
    "",
    "    def PreSolve(self, contact, oldManifold):",
    "        a, b = contact.fixtureA.body, contact.fixtureB.body",
    "        n, p = contact.worldManifold.normal, contact.worldManifold.points[0]",
    "        va, vb = a.GetLinearVelocityFromWorldPoint(p), b.GetLinearVelocityFromWorldPoint(p)",
    "        before = (vb[0] - va[0]) * n[0] + (vb[1] - va[1]) * n[1]",
    "        falls = (b.type == Box2D.b2_dynamicBody) - (a.type == Box2D.b2_dynamicBody)",
    "        after = before + falls * (self.KICK[0] * n[0] + self.KICK[1] * n[1])",
    "        asked, _ = material(a.userData, b.userData)",
    "        contact.restitution = max(0.0, asked * before / after) if after < 0.0 else asked",
]
#: Lines of the function that reads all bodies.
_STATE = [
    "",
    "",
    "def state():",
    "    found, per_metre = {}, 1.0 / UNITS",
    "    for name, body in bodies.items():",
    "        (x, y), (vx, vy) = body.position, body.linearVelocity",
    "        pose = (x * per_metre, y * per_metre, body.angle)",
    "        twist = (vx * per_metre, vy * per_metre, body.angularVelocity)",
    "        found[name] = (0.0, 0.0, 0.0) if name in HALF_SPACES else pose, twist",
    "    return found",
]
