"""A run on Box2D 3.1 as a stand-alone script: the calls of `adapters.box2d3.simulation`, with their numbers."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from adapters.box2d3.translation import frictions, restitutions
from adapters.ground import reach
from adapters.scene import Body, Box, Disc, HalfSpace, Scene
from adapters.script import constants, imports, literal, stepped, text

_MAKERS = {"free": "create_dynamic_body", "fixed": "create_static_body", "prescribed": "create_kinematic_body"}


def python(scene: Scene, dt: float, settings: Mapping[str, Any], steps: int) -> str:
    """Python of a run with pyb2d3; see `adapters.engine.Writer`."""
    units = float(settings["units_per_metre"])
    lines = [*imports(scene, "import pyb2d3", angles=True), *constants(dt, steps)]
    lines += [f"UNITS = {units!r}  # lengths are handed over in 1/UNITS m", ""]
    lines += ["world = pyb2d3.World(", f"    gravity={literal(_scaled(scene.gravity, units))},"]
    lines.append(f"    restitution_threshold={literal(settings['restitution_threshold'] * units)},")
    lines += [f"    maximum_linear_speed={literal(settings['maximum_speed'] * units)},", ")"]
    springs = (settings["hertz"], settings["damping_ratio"], settings["push_speed"] * units)
    lines.append(f"world.set_contact_tuning{literal(springs)}")
    lines += [f"world.continuous_enabled = {settings['continuous']!r}", "world.sleeping_enabled = False", "bodies = {}"]
    own = zip(restitutions(scene) or [], frictions(scene) or [], strict=True)
    for body, numbers in zip(scene.bodies, own, strict=True):
        lines += ["", *_made(body, scene, units, numbers)]
    still = literal([body.name for body in scene.bodies if isinstance(body.shape, HalfSpace)])
    lines += ["", f"HALF_SPACES = {still}  # their pose is the origin, wherever their polygons stand"]
    loads = []
    for body in scene.bodies:
        if body.is_loaded:
            held = f"bodies[{body.name!r}]"
            loads.append(f"{held}.apply_force_to_center({literal(_scaled(body.force, units))})")
            loads.append(f"{held}.apply_torque({literal(body.torque[0] * units**2)})")
    return text([*lines, *_STATE, *stepped([*loads, f"world.step(DT, {settings['substeps']!r})"])])


def _scaled(v: tuple[float, ...], units: float) -> tuple[float, float]:
    return v[0] * units, v[1] * units


def _made(asked: Body, scene: Scene, units: float, numbers: tuple[float, float]) -> list[str]:
    """Lines that make a body with its shape; ``numbers`` are its restitution and friction."""
    if isinstance(asked.shape, HalfSpace):
        (nx, ny), offset = asked.shape.normal, asked.shape.offset
        x, y = offset * nx, offset * ny
        c, s = (1.0, 0.0) if 0.0 in (nx, ny) else (ny, -nx)
    else:
        x, y, theta = asked.pose
        c, s = math.cos(theta), math.sin(theta)
    place = f"position={literal(_scaled((x, y), units))}, rotation=turn, enable_sleep=False"
    own = f"restitution={literal(numbers[0])}, friction={literal(numbers[1])}"
    lines = [
        "turn = pyb2d3.Rot()",
        f"turn.c, turn.s = {literal(c)}, {literal(s)}",
        f"body = bodies[{asked.name!r}] = world.{_MAKERS[asked.motion]}({place})",
        f"material = pyb2d3.surface_material({own})",
        f"body.create_shape(pyb2d3.shape_def(density=1.0, material=material), {_shape(asked, scene, units)})",
    ]
    if asked.motion == "free":
        assert isinstance(asked.inertia, float | int)
        lines += [
            "held = body.mass_data",
            f"held.mass, held.center = {literal(asked.mass)}, (0.0, 0.0)",
            f"held.rotational_inertia = {literal(asked.inertia * units**2)}",
            "body.mass_data = held",
        ]
    if asked.motion != "fixed":
        vx, vy, omega = asked.twist
        velocity = literal(_scaled((vx, vy), units))
        lines.append(f"body.linear_velocity, body.angular_velocity = {velocity}, {literal(omega)}")
    return lines


def _shape(asked: Body, scene: Scene, units: float) -> str:
    """Call that makes a shape."""
    shape = asked.shape
    if isinstance(shape, Disc):
        return f"pyb2d3.circle(radius={literal(shape.radius * units)})"
    if isinstance(shape, Box):
        return f"pyb2d3.box{literal(_scaled(shape.half_extents, units))}"
    assert isinstance(shape, HalfSpace)
    nx, ny = shape.normal if 0.0 in shape.normal else (0.0, 1.0)
    wide = reach(scene) * units
    return f"pyb2d3.box({literal(wide)}, {literal(wide)}, center={literal((-nx * wide, -ny * wide))})"


#: Lines of the function that reads all bodies: the angle that the engine tells itself is off by 1e-4.
_STATE = [
    "",
    "",
    "def state():",
    "    found = {}",
    "    for name, body in bodies.items():",
    "        (x, y), (vx, vy), turn = body.position, body.linear_velocity, body.rotation",
    "        pose = (float(x) / UNITS, float(y) / UNITS, math.atan2(float(turn.s), float(turn.c)))",
    "        twist = (float(vx) / UNITS, float(vy) / UNITS, float(body.angular_velocity))",
    "        found[name] = (0.0, 0.0, 0.0) if name in HALF_SPACES else pose, twist",
    "    return found",
]
