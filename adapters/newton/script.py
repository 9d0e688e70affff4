"""A run on Newton as a stand-alone script: the calls of `adapters.newton.simulation`, with their values.

Steps are made one by one: the adapter's graph, for speed, replays the same launches.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from adapters.newton.simulation import ALONG_X, is_driven, triangles
from adapters.scene import Body, Box, Capsule, HalfSpace, Hull, Scene, Sphere
from adapters.scene.means import means
from adapters.script import constants, imports, keywords, literal, place, stepped, text, velocity


def python(scene: Scene, dt: float, settings: Mapping[str, Any], steps: int) -> str:
    """Python of a run with newton; see `adapters.engine.Writer`."""
    lines = [*imports(scene, "import newton", "import numpy as np", "import warp"), *constants(dt, steps), ""]
    lines += [
        "warp.config.log_level = warp.LOG_ERROR",
        f"builder = newton.ModelBuilder(gravity={literal(tuple(float(g) for g in scene.gravity))})",
        f"builder.rigid_gap = {settings['gap']!r}",
        "# Bodies by name: Newton's number, -1 of what is fixed and belongs to its world, and the pose at the start.",
        "bodies = {}",
    ]
    own = zip(means(scene, "restitution") or [], means(scene, "friction") or [], strict=True)
    for body, numbers in zip(scene.bodies, own, strict=True):
        lines += ["", *_made(body, settings, numbers)]
    given = {
        "iterations": settings["iterations"],
        "rigid_contact_relaxation": settings["relaxation"],
        "rigid_contact_con_weighting": settings["weighted"],
        "enable_restitution": settings["rebounds"],
        "rigid_contact_restitution_iterations": settings["rebound_iterations"],
    }
    lines += ["", 'model = builder.finalize(device="cpu")']
    lines += ["solver = newton.solvers.SolverXPBD(", "    model,"]
    lines += [*(f"    {keywords({name: value})}," for name, value in given.items()), ")"]
    lines += [
        "pipeline = newton.CollisionPipeline(model)",
        "touching = pipeline.contacts()",
        "now, following, control = model.state(), model.state(), model.control()",
        "# Views on the engine's own numbers.",
        "place, speed, load = now.body_q.numpy(), now.body_qd.numpy(), now.body_f.numpy()",
    ]
    for body in scene.bodies:
        lines += _started(body)
    led = [body for body in scene.bodies if body.motion == "prescribed" and not isinstance(body.shape, HalfSpace)]
    lines += _TURNED if any(any(body.twist[3:]) for body in led) else []
    step = ["time = done * DT  # a driven body is where the step ends before others move"] if led else []
    for body in led:
        step += _led(body)
    moves = any(body.motion == "free" or is_driven(body) for body in scene.bodies)
    return text([*lines, *_state(scene), *stepped([*step, *(_STEP if moves else [])])])


def _made(asked: Body, settings: Mapping[str, Any], numbers: tuple[float, float]) -> list[str]:
    """Lines that make a body with its shape; ``numbers`` are its restitution and friction."""
    turn, moving = (*asked.pose[4:], asked.pose[3]), asked.motion == "free" or is_driven(asked)
    pose = f"warp.transform({literal(asked.pose[:3])}, {literal(turn)})"
    lines = [f"pose = {'warp.transform_identity()' if isinstance(asked.shape, HalfSpace) else pose}"]
    if asked.motion == "free":
        rows = np.diag(np.asarray(asked.inertia, float)).ravel().tolist()
        inertia = f"inertia=warp.mat33{literal(rows)}, lock_inertia=True"
        lines.append(f"number = builder.add_body(xform=pose, mass={literal(asked.mass)}, {inertia})")
    elif moving:
        lines.append("number = builder.add_body(xform=pose, is_kinematic=True, lock_inertia=True)")
    else:
        lines.append("number = -1")
    restitution, friction = numbers
    own = {
        "density": 0.0,
        "mu": friction,
        "restitution": restitution,
        "mu_torsional": settings["torsional"] if friction > 0.0 else 0.0,
        "mu_rolling": settings["rolling"] if friction > 0.0 else 0.0,
    }
    lines.append(f"config = newton.ModelBuilder.ShapeConfig({keywords(own)})")
    return [*lines, *_shape(asked, moving), f"bodies[{asked.name!r}] = number, {literal(asked.pose)}"]


def _shape(asked: Body, moving: bool) -> list[str]:
    """Lines that make a shape; that of a moving body is at its centre."""
    shape, where = asked.shape, "None" if moving else "pose"
    if isinstance(shape, HalfSpace):
        plane = literal((*(float(n) for n in shape.normal), -float(shape.offset)))
        return [f"builder.add_shape_plane(plane={plane}, width=0.0, length=0.0, body=number, cfg=config)"]
    if isinstance(shape, Sphere):
        return [f"builder.add_shape_sphere(number, xform={where}, radius={literal(shape.radius)}, cfg=config)"]
    if isinstance(shape, Capsule):
        size = f"radius={literal(shape.radius)}, half_height={literal(shape.half_length)}"
        return [
            f"along = warp.transform((0.0, 0.0, 0.0), {literal(ALONG_X)})  # theirs lie along z",
            *([] if moving else ["along = pose * along"]),
            f"builder.add_shape_capsule(number, xform=along, {size}, cfg=config)",
        ]
    if isinstance(shape, Hull):
        corners = f"np.array({literal(shape.vertices)}, np.float32)"
        sides = f"np.array({literal(triangles(shape).ravel())}, np.int32)"
        return [
            f"mesh = newton.Mesh({corners}, {sides}, compute_inertia=False)",
            f"assert len(mesh.vertices) == {len(shape.vertices)}  # it may drop some",
            f"builder.add_shape_convex_hull(number, xform={where}, mesh=mesh, cfg=config)",
        ]
    assert isinstance(shape, Box)
    x, y, z = (literal(half) for half in shape.half_extents)
    return [f"builder.add_shape_box(number, xform={where}, hx={x}, hy={y}, hz={z}, cfg=config)"]


def _started(asked: Body) -> list[str]:
    """Lines that give a body its twist and its constant load."""
    if asked.motion != "free" and not is_driven(asked):
        return []
    number, twist = f"bodies[{asked.name!r}][0]", asked.twist
    if asked.motion == "fixed":
        twist = (*asked.surface_velocity, 0.0, 0.0, 0.0)
    lines = [f"speed[{number}] = {literal(twist)}"]
    if asked.motion == "free" and any((*asked.force, *asked.torque)):
        lines.append(f"load[{number}] = {literal((*asked.force, *asked.torque))}")
    return lines


def _led(asked: Body) -> list[str]:
    """Lines before a step that set a driven body's pose at its end, and its velocity."""
    w, x, y, z = asked.pose[3:]
    turn = literal((x, y, z, w))
    if any(asked.twist[3:]):
        rate = float(np.linalg.norm(asked.twist[3:]))
        turn = f"turned({literal(asked.pose[3:])}, {literal(asked.twist[3:])}, {rate!r}, time)"
    number = f"bodies[{asked.name!r}][0]"
    return [
        f"place[{number}] = (*{place(asked)}, *{turn})",
        f"speed[{number}, :3] = {velocity(asked)}",
    ]


def _state(scene: Scene) -> list[str]:
    """Lines of the function that reads all bodies; running surfaces and half-spaces do not move."""
    faces = [body.name for body in scene.bodies if isinstance(body.shape, HalfSpace)]
    still = [body.name for body in scene.bodies if body.motion == "fixed"]
    return [
        f"HALF_SPACES, FIXED = {literal(faces)}, {literal(still)}",
        "",
        "",
        "def state():",
        "    found = {}",
        "    for name, (number, pose) in bodies.items():",
        "        if number >= 0 and name not in HALF_SPACES:",
        "            pose = place[number, [0, 1, 2, 6, 3, 4, 5]].tolist()",
        "        twist = (0.0,) * 6 if name in FIXED else speed[number].tolist()",
        "        found[name] = pose, twist",
        "    return found",
    ]


#: Lines of a step: contacts at its start, then positions; the state is ready for the next.
_STEP = [
    "pipeline.collide(now, touching)",
    "solver.step(now, following, control, touching, DT)",
    "warp.copy(now.body_q, following.body_q)",
    "warp.copy(now.body_qd, following.body_qd)",
]
#: Lines of the function that rotates driven bodies (`adapters.newton.simulation.turned`).
_TURNED = [
    "",
    "",
    "def turned(quaternion, spin, rate, time):",
    "    w, x, y, z = quaternion",
    "    c, (a, b, d) = np.cos(0.5 * rate * time), np.sin(0.5 * rate * time) / rate * np.array(spin)",
    "    i, j, k = c * x + a * w + b * z - d * y, c * y + b * w + d * x - a * z, c * z + d * w + a * y - b * x",
    "    return i, j, k, c * w - a * x - b * y - d * z",
    "",
    "",
]
