"""A run on PhysX as a stand-alone script: the recorded calls of `adapters.physx.simulation`."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from adapters.physx.simulation import PhysxSimulation, imported
from adapters.recording import written
from adapters.scene import HalfSpace, Hull, Scene
from adapters.scene.drives import velocity_over
from adapters.script import constants, imports, literal, place, stepped, text

#: Variables of a script, and the calls that return their values.
_NAMES = {
    "engine": "PhysxEngine",
    "system": "PhysxCpuSystem",
    "world": "Scene",
    "entity": "Entity",
    "part": "PhysxRigidStaticComponent PhysxRigidDynamicComponent",
    "material": "PhysxMaterial",
    "shape": "PhysxCollisionShapePlane PhysxCollisionShapeSphere PhysxCollisionShapeCapsule PhysxCollisionShapeBox "
    "PhysxCollisionShapeConvexMesh",
    "": "attach add_component add_entity set_scene_config",
}


class _Undriven(PhysxSimulation):
    """A world whose script itself moves driven bodies."""

    def _lead(self, k: int) -> None:
        pass


def python(scene: Scene, dt: float, settings: Mapping[str, Any], steps: int) -> str:
    """Python of a run with SAPIEN; see `adapters.engine.Writer`."""
    made, step = written(_Undriven, imported(), "sapien", _NAMES, (scene, dt, settings))
    spinning = any(body.motion == "prescribed" and any(body.twist[3:]) for body in scene.bodies)
    lines = [*imports(scene, "import numpy as np", "import sapien", angles=spinning), *constants(dt, steps)]
    lines += ["bodies = {}", "", "# One engine per process.", *made, "", *(_TURNED if spinning else [])]
    for body in scene.bodies:
        if isinstance(body.shape, Hull):
            held = f"bodies[{body.name!r}].collision_shapes[0].vertices"
            lines.append(f"assert len({held}) == {len(body.shape.vertices)}  # it may drop some")
    driven = [body for body in scene.bodies if body.motion == "prescribed"]
    led = ["time = done * DT"] if driven else []
    for body in driven:
        turn = literal(body.pose[3:])
        if any(body.twist[3:]):
            turn = f"turned({turn}, {literal(body.twist[3:])}, {math.hypot(*body.twist[3:])!r}, time)"
        led.append(f"bodies[{body.name!r}].kinematic_target = sapien.Pose({place(body)}, {turn})")
    return text([*lines, *_state(scene, dt), *stepped([*step[:-1], *led, step[-1]])])


#: Lines of the function that turns driven bodies (`adapters.physx.translation.turned`).
_TURNED = [
    "",
    "",
    "def turned(quaternion, spin, rate, time):",
    "    half, q = 0.5 * rate * time, np.array(quaternion)",
    "    p = np.array([math.cos(half), *(math.sin(half) / rate * np.array(spin))])",
    "    product = [p[0] * q[0] - p[1:] @ q[1:], *(p[0] * q[1:] + q[0] * p[1:] + np.cross(p[1:], q[1:]))]",
    "    return tuple(float(x) for x in product)",
    "",
    "",
]


def _state(scene: Scene, dt: float) -> list[str]:
    """Lines of the function that reads all bodies."""
    first = {b.name: (*velocity_over(b, dt, 0), *b.twist[3:]) for b in scene.bodies if b.motion == "prescribed"}
    given = ", ".join(f"{name!r}: {literal(twist)}" for name, twist in first.items())
    told = [f"DRIVEN = {{{given}}}  # twists that the engine tells as soon as a step is made", "done = 0"]
    still = literal([body.name for body in scene.bodies if isinstance(body.shape, HalfSpace)])
    return [
        f"HALF_SPACES = {still}  # their pose is the origin",
        *(told if first else []),
        "",
        "",
        "def state():",
        "    found = {}",
        "    for name, part in bodies.items():",
        "        pose, twist = (*part.entity.pose.p, *part.entity.pose.q), (0.0,) * 6",
        "        if name in HALF_SPACES:",
        "            pose = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)",
        "        if isinstance(part, sapien.physx.PhysxRigidDynamicComponent):",
        "            twist = (*part.linear_velocity, *part.angular_velocity)",
        *(["        if done == 0:", "            twist = DRIVEN.get(name, twist)"] if first else []),
        "        found[name] = [float(x) for x in pose], [float(x) for x in twist]",
        "    return found",
    ]
