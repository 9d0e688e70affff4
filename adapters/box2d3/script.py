"""A run on Box2D 3.1 as a stand-alone script: the recorded calls of `adapters.box2d3.simulation`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from adapters.box2d3.simulation import Box2D3Simulation
from adapters.recording import written
from adapters.scene import HalfSpace, Scene
from adapters.script import constants, imports, literal, stepped, text

#: Variables of a script, and the calls and attributes of their values.
_NAMES = {
    "world": "World",
    "turn": "Rot",
    "body": "create_dynamic_body create_static_body create_kinematic_body",
    "material": "surface_material",
    "held": "mass_data",
    "": "create_shape",
}


def python(scene: Scene, dt: float, settings: Mapping[str, Any], steps: int) -> str:
    """Python of a run with pyb2d3; see `adapters.engine.Writer`."""
    import pyb2d3

    made, step = written(Box2D3Simulation, pyb2d3, "pyb2d3", _NAMES, (scene, dt, settings))
    lines = [*imports(scene, "import pyb2d3", angles=True), *constants(dt, steps)]
    lines.append(f"UNITS = {float(settings['units_per_metre'])!r}  # lengths are handed over in 1/UNITS m")
    still = literal([body.name for body in scene.bodies if isinstance(body.shape, HalfSpace)])
    lines += ["bodies = {}", "", *made, ""]
    lines.append(f"HALF_SPACES = {still}  # their pose is the origin, wherever their polygons stand")
    return text([*lines, *_STATE, *stepped(step)])


#: Lines of the function that reads all bodies: the engine's own angle has an error of 1e-4.
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
