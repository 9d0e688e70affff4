"""A run on PhysX as a stand-alone script: the calls of `adapters.physx.simulation`, with their numbers."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from adapters.drives import velocity_over
from adapters.means import means
from adapters.physx.translation import turn_to
from adapters.scene import Body, Box, Capsule, HalfSpace, Hull, Scene, Sphere
from adapters.script import constants, imports, literal, place, stepped, text


def python(scene: Scene, dt: float, settings: Mapping[str, Any], steps: int) -> str:
    """Python of a run with SAPIEN; see `adapters.engine.Writer`."""
    spinning = any(body.motion == "prescribed" and any(body.twist[3:]) for body in scene.bodies)
    lines = [*imports(scene, "import numpy as np", "import sapien", angles=spinning), *constants(dt, steps), ""]
    lines += [
        f"engine = sapien.physx.PhysxEngine({settings['tolerance_length']!r}, 0.2)  # one per process",
        "sapien.physx.set_scene_config(",
        f"    gravity=np.array({literal(scene.gravity)}, np.float32),",
        f"    bounce_threshold={settings['bounce_threshold']!r},",
        f"    enable_pcm={settings['persistent_manifolds']!r},",
        f"    enable_tgs={settings['solver'] == 'tgs'},",
        "    enable_ccd=False,",
        "    enable_enhanced_determinism=False,",
        f"    enable_friction_every_iteration={settings['friction_every_iteration']!r},",
        "    cpu_workers=0,",
        ")",
        "system = sapien.physx.PhysxCpuSystem()",
        "system.timestep = DT",
        "world = sapien.Scene([system])",
        "bodies = {}",
    ]
    own = zip(means(scene, "restitution") or [], means(scene, "friction") or [], strict=True)
    for index, (body, numbers) in enumerate(zip(scene.bodies, own, strict=True)):
        lines += ["", *_made(index, body, settings, numbers)]
    lines += _TURNED if spinning else []
    step = []
    for body in scene.bodies:
        part = f"bodies[{body.name!r}][1]"
        if body.is_loaded:
            step.append(f"{part}.add_force_torque({literal(body.force)}, {literal(body.torque)})")
    driven = [body for body in scene.bodies if body.motion == "prescribed"]
    if driven:
        step.append("time = done * DT")
    for body in driven:
        turn = literal(body.pose[3:])
        if any(body.twist[3:]):
            turn = f"turned({turn}, {literal(body.twist[3:])}, {math.hypot(*body.twist[3:])!r}, time)"
        step.append(f"bodies[{body.name!r}][1].kinematic_target = sapien.Pose({place(body)}, {turn})")
    return text([*lines, "", *_state(scene, dt), *stepped([*step, "system.step()"])])


def _made(index: int, asked: Body, settings: Mapping[str, Any], numbers: tuple[float, float]) -> list[str]:
    """Lines that make a body with its shape; ``numbers`` are its restitution and friction."""
    kind = "Static" if asked.motion == "fixed" else "Dynamic"
    restitution, friction = (literal(number) for number in numbers)
    lines = [
        "entity = sapien.Entity()",
        f"entity.name = 'body {index}'",
        f"part = sapien.physx.PhysxRigid{kind}Component()",
        f"material = sapien.physx.PhysxMaterial({friction}, {friction}, {restitution})",
        f"shape = sapien.physx.PhysxCollisionShape{_shape(asked)}",
        f"shape.contact_offset, shape.rest_offset = {settings['contact_offset']!r}, 0.0",
        "part.attach(shape)",
    ]
    if isinstance(asked.shape, Hull):
        lines.append(f"assert len(shape.vertices) == {len(asked.shape.vertices)}  # it may drop some")
    if asked.motion != "fixed":
        lines += [
            f"part.kinematic = {asked.motion == 'prescribed'}",
            "part.sleep_threshold = 0.0",
            f"part.solver_position_iterations = {settings['iterations']!r}",
            f"part.solver_velocity_iterations = {settings['velocity_iterations']!r}",
            f"part.linear_damping, part.angular_damping = 0.0, {settings['angular_damping']!r}",
            f"part.max_angular_velocity = {settings['fastest_spin']!r}",
            f"part.max_depenetration_velocity = {settings['push_out']!r}",
        ]
    if asked.motion == "free":
        lines.append(f"part.mass, part.inertia = {literal(asked.mass)}, {literal(asked.inertia)}")
        twist = f"{literal(asked.twist[:3])}, {literal(asked.twist[3:])}"
        lines.append(f"part.linear_velocity, part.angular_velocity = {twist}")
    if isinstance(asked.shape, HalfSpace):
        normal, offset = asked.shape.normal, asked.shape.offset
        pose = f"{literal([offset * n for n in normal])}, {literal(turn_to(normal))}"
    else:
        pose = f"{literal(asked.pose[:3])}, {literal(asked.pose[3:])}"
    lines += ["entity.add_component(part)", f"entity.pose = sapien.Pose({pose})", "world.add_entity(entity)"]
    return [*lines, f"bodies[{asked.name!r}] = entity, part"]


def _shape(asked: Body) -> str:
    """Rest of the call that makes a shape."""
    shape = asked.shape
    if isinstance(shape, HalfSpace):
        return "Plane(material)"
    if isinstance(shape, Sphere):
        return f"Sphere({literal(shape.radius)}, material)"
    if isinstance(shape, Capsule):
        return f"Capsule({literal(shape.radius)}, {literal(shape.half_length)}, material)"
    if isinstance(shape, Hull):
        return f"ConvexMesh(np.array({literal(shape.vertices)}, np.float32), (1.0, 1.0, 1.0), material)"
    assert isinstance(shape, Box)
    return f"Box({literal(shape.half_extents)}, material)"


#: Lines of the function that turns what is driven (`adapters.physx.translation.turned`).
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
        "    for name, (entity, part) in bodies.items():",
        "        pose, twist = (*entity.pose.p, *entity.pose.q), (0.0,) * 6",
        "        if name in HALF_SPACES:",
        "            pose = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)",
        "        if isinstance(part, sapien.physx.PhysxRigidDynamicComponent):",
        "            twist = (*part.linear_velocity, *part.angular_velocity)",
        *(["        if done == 0:", "            twist = DRIVEN.get(name, twist)"] if first else []),
        "        found[name] = [float(x) for x in pose], [float(x) for x in twist]",
        "    return found",
    ]
