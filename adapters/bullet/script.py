"""A run on Bullet as a stand-alone script: the calls of `adapters.bullet.simulation`, with their values."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations
from typing import Any

from adapters.bullet import clipped
from adapters.bullet.profiles import by_call
from adapters.bullet.simulation import HEAVY, WAITING_ROOM
from adapters.bullet.translation import Z_TO_X, factors, moments, placement
from adapters.engine import EngineError
from adapters.scene import Body, Box, Capsule, Cylinder, HalfSpace, Hull, Scene, Sphere
from adapters.scene.drives import velocity_over
from adapters.script import constants, imports, keywords, literal, stepped, text, velocity


def python(scene: Scene, dt: float, settings: Mapping[str, Any], steps: int) -> str:
    """Python of a run with pybullet; see `adapters.engine.Writer`."""
    world, material = by_call(settings)
    restitution, friction = factors(scene, "restitution"), factors(scene, "friction")
    if restitution is None or friction is None:
        raise EngineError("pairs: no product of two bodies' values gives this table of materials")
    heaviest = max((body.mass for body in scene.bodies if body.motion == "free"), default=1.0)
    masses = [{"free": b.mass, "fixed": 0.0, "prescribed": HEAVY * heaviest}[b.motion] for b in scene.bodies]
    filed = settings.get("enableSAT")
    own = "import pathlib\nimport tempfile\n\nimport pybullet as p" if filed is not None else "import pybullet as p"
    lines = [*imports(scene, own), *constants(dt, steps), "", "p.connect(p.DIRECT)"]
    lines += [f"p.setPhysicsEngineParameter(fixedTimeStep=DT, {keywords(world)})", "p.setGravity(0.0, 0.0, 0.0)"]
    lines += ["bodies = {}", ""]
    if filed is not None:
        lines += _loader(bool(filed), int(settings.get("useMaximalCoordinates", 0)))
    lines.append("# A new inertia or orientation acts a step late: bodies wait far away, already turned, for one step.")
    maximal = int(settings.get("useMaximalCoordinates", 0))
    for i, body in enumerate(scene.bodies):
        values = {"restitution": restitution[i], "lateralFriction": friction[i], **material}
        lines += _made(i, body, scene, masses[i], maximal, values, filed is not None)
    for a, b in combinations([body.name for body in scene.bodies if body.motion != "free"], 2):
        lines.append(f"p.setCollisionFilterPair(bodies[{a!r}], bodies[{b!r}], -1, -1, 0)")
    lines += ["p.stepSimulation()", "", "# Now to their places."]
    for body in scene.bodies:
        lines += _placed(body, scene, dt)
    lines += [f"p.setGravity{literal(scene.gravity)}", "", *_state(scene)]
    return text(lines + stepped([*_loads(scene, masses), "p.stepSimulation()"]))


def _loader(known: bool, maximal: int) -> list[str]:
    """Lines of a function that makes a body from files: only these have faces in Bullet."""
    flags = "p.URDF_USE_INERTIA_FROM_FILE" + (" | p.URDF_INITIALIZE_SAT_FEATURES" if known else "")
    return [
        "",
        "def loaded(files, place, turn, fixed):",
        "    with tempfile.TemporaryDirectory() as folder:",
        "        for name, text in files.items():",
        '            pathlib.Path(folder, name).write_text(text, encoding="ascii")',
        '        path = str(pathlib.Path(folder, "body.urdf"))',
        f"        how = dict(useFixedBase=fixed, flags={flags}, useMaximalCoordinates={maximal})",
        "        return p.loadURDF(path, place, turn, **how)",
        "",
        "",
    ]


def _made(
    index: int, body: Body, scene: Scene, mass: float, maximal: int, material: Mapping[str, Any], filed: bool
) -> list[str]:
    """Lines that make a body at its waiting place; boxes and hulls from files, if needed."""
    sizes, _, quaternion = placement(body, scene)
    shape = f"p.GEOM_BOX, halfExtents={literal(sizes)}"
    if isinstance(body.shape, Sphere):
        shape = f"p.GEOM_SPHERE, radius={sizes[0]!r}"
    elif isinstance(body.shape, Hull):
        shape = f"p.GEOM_MESH, vertices={literal(body.shape.vertices)}"
    elif isinstance(body.shape, Capsule | Cylinder):
        kind = "p.GEOM_CAPSULE" if isinstance(body.shape, Capsule) else "p.GEOM_CYLINDER"
        lying = f"collisionFrameOrientation={literal(Z_TO_X)}"
        shape = f"{kind}, radius={sizes[0]!r}, height={sizes[1]!r}, {lying}"
    waiting = (WAITING_ROOM * (index + 1), WAITING_ROOM, WAITING_ROOM)
    place = f"{literal(waiting)}, {literal(quaternion)}"
    made = f"p.createMultiBody({mass!r}, shape, -1, {place}, useMaximalCoordinates={maximal})"
    lines = [f"shape = p.createCollisionShape({shape})"]
    if filed and isinstance(body.shape, Box | HalfSpace | Hull):
        lines = [f"files = {clipped.files(body.shape, sizes, mass)!r}"]
        made = f"loaded(files, {place}, {int(mass == 0.0)})"
    lines += [f"body = bodies[{body.name!r}] = {made}", f"p.changeDynamics(body, -1, {keywords(material)})"]
    if body.motion != "fixed":
        lines.append(f"p.changeDynamics(body, -1, mass={mass!r}, localInertiaDiagonal={literal(moments(body, mass))})")
    if body.motion == "prescribed":
        lines.append("p.changeDynamics(body, -1, linearDamping=0.0, angularDamping=0.0)")
    return lines


def _placed(body: Body, scene: Scene, dt: float) -> list[str]:
    """Lines that move a body to its start; its pose first, since that zeroes its velocity."""
    _, position, quaternion = placement(body, scene)
    lines = [f"p.resetBasePositionAndOrientation(bodies[{body.name!r}], {literal(position)}, {literal(quaternion)})"]
    if body.motion != "fixed":
        given = f"{literal(velocity_over(body, dt, 0))}, {literal(body.twist[3:])}"
        lines.append(f"p.resetBaseVelocity(bodies[{body.name!r}], {given})")
    return lines


def _state(scene: Scene) -> list[str]:
    """Lines of the function that reads all bodies; a half-space, here a box, without the offset of its centre."""
    ways = {body.name: placement(body, scene)[1] for body in scene.bodies if isinstance(body.shape, HalfSpace)}
    return [
        "# Half-spaces, and the way to the centre of the box that stands for each.",
        f"HALF_SPACES = {{{', '.join(f'{name!r}: {literal(way)}' for name, way in ways.items())}}}",
        "",
        "",
        "def state():",
        "    found = {}",
        "    for name, body in bodies.items():",
        "        (x, y, z), (qx, qy, qz, qw) = p.getBasePositionAndOrientation(body)",
        "        velocity, spin = p.getBaseVelocity(body)",
        "        if name in HALF_SPACES:",
        "            a, b, c = HALF_SPACES[name]",
        "            x, y, z, qw, qx, qy, qz = x - a, y - b, z - c, 1.0, 0.0, 0.0, 0.0",
        "        found[name] = (x, y, z, qw, qx, qy, qz), (*velocity, *spin)",
        "    return found",
    ]


def _loads(scene: Scene, masses: list[float]) -> list[str]:
    """Lines before a step: prescribed velocities, and external loads, which last for one step."""
    lines, loads = [], []
    for body, mass in zip(scene.bodies, masses, strict=True):
        force, torque = body.force, body.torque
        if body.motion == "prescribed":
            force, torque = tuple(-mass * g for g in scene.gravity), (0.0, 0.0, 0.0)
            given = f"{velocity(body)}, {literal(body.twist[3:])}"
            lines.append(f"p.resetBaseVelocity(bodies[{body.name!r}], {given})")
        if body.motion != "fixed" and any((*force, *torque)):
            own = f"bodies[{body.name!r}]"
            loads.append(f"centre, _ = p.getBasePositionAndOrientation({own})")
            loads.append(f"p.applyExternalForce({own}, -1, {literal(force)}, centre, p.WORLD_FRAME)")
            loads.append(f"p.applyExternalTorque({own}, -1, {literal(torque)}, p.WORLD_FRAME)")
    return lines + loads
