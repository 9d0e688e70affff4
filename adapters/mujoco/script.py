"""A run on MuJoCo as MJCF, and as a stand-alone script around it: the model of `adapters.mujoco.spec` as text."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from adapters.engine import EngineError
from adapters.mujoco.matched import SECOND_HALF, loop_lines
from adapters.mujoco.moving import is_moved_face, script_lines
from adapters.mujoco.releases import Mjcf
from adapters.mujoco.spec import Spec, has_joint, start
from adapters.scene import Scene
from adapters.script import constants, imports, literal, stepped, text, velocity


def mjcf(scene: Scene, dt: float, settings: Mapping[str, Any], steps: int) -> str:
    """MJCF of a scene, its start as keyframe ``start``; see `adapters.engine.Writer`.

    Raises
    ------
    EngineError
        For a course, a moving face or a loop around the solver, which a model cannot express.
    """
    if "rounds" in settings:
        raise EngineError("rounds: MJCF has no word for a loop around the solver; python has")
    for body in scene.bodies:
        if body.course is not None or any(body.surface_velocity) or is_moved_face(body):
            raise EngineError(f"{body.name}: MJCF has no word for a course, a face that moves or a surface that runs")
    return _model(scene, dt, settings, True)


def _model(scene: Scene, dt: float, settings: Mapping[str, Any], key: bool) -> str:
    import mujoco

    written = Mjcf(mujoco)
    Spec(scene, dt, settings, written)
    if key:
        for i, body in enumerate(scene.bodies):
            if body.is_loaded:
                written.add_load(f"body{i}", (*body.force, *body.torque))
        qpos, qvel = start(scene, dt)
        written.add_key(name="start", qpos=qpos, qvel=qvel)
    return written.text()


def python(scene: Scene, dt: float, settings: Mapping[str, Any], steps: int) -> str:
    """Python of a run with mujoco; see `adapters.engine.Writer`."""
    qpos, qvel = start(scene, dt)
    lines = [*imports(scene, "import mujoco", "import numpy as np"), *constants(dt, steps), 'MODEL = """']
    lines += [*_model(scene, dt, settings, False).splitlines(), '"""']
    lines.append("# Names and poses; of bodies that move the pose is the one at the start.")
    lines.append("BODIES = {")
    lines += [f"    {body.name!r}: {literal(body.pose)}," for body in scene.bodies]
    moving = [i for i, body in enumerate(scene.bodies) if has_joint(body)]
    lines += ["}", f"MOVING = {moving}", "", "model = mujoco.MjModel.from_xml_string(MODEL)"]
    lines += ["data = mujoco.MjData(model)", f"data.qpos[:] = {qpos}", f"data.qvel[:] = {qvel}"]
    for i, body in enumerate(scene.bodies):
        if body.motion == "free" and any((*body.force, *body.torque)):
            load = literal((*body.force, *body.torque))
            lines.append(f'data.xfrc_applied[model.body("body{i}").id] = {load}')
    drives = []
    for row, i in enumerate(moving):
        if scene.bodies[i].course is not None:
            drives.append(f"data.qvel[{6 * row} : {6 * row + 3}] = {velocity(scene.bodies[i])}")
    before, step = script_lines(scene, dt, SECOND_HALF if "rounds" in settings else "")
    before += loop_lines(scene, settings) if "rounds" in settings else []
    return text(lines + _state(scene) + before + stepped([*drives, *step]))


def _state(scene: Scene) -> list[str]:
    """Lines of the function that reads all bodies, with the places of moving faces."""
    faces = [
        f'    pose[{i}, :3], twist[{i}, :3] = data.mocap_pos[model.body("body{i}").mocapid[0]], faces[{i}]'
        for i, body in enumerate(scene.bodies)
        if is_moved_face(body)
    ]
    return [*_STATE[:-1], *faces, _STATE[-1]]


#: Lines of the function that reads all bodies: MuJoCo has angular velocity in body axes.
_STATE = [
    "",
    "",
    "def state():",
    "    pose, twist = np.array(list(BODIES.values())), np.zeros((len(BODIES), 6))",
    "    if MOVING:",
    "        pose[MOVING], velocity = data.qpos.reshape(-1, 7), data.qvel.reshape(-1, 6)",
    "        quaternion = pose[MOVING, 3:]",
    "        w, x, y, z = (quaternion / np.linalg.norm(quaternion, axis=1, keepdims=True)).T",
    "        rows = [",
    "            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],",
    "            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],",
    "            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],",
    "        ]",
    "        turn = np.moveaxis(np.array(rows), 2, 0)",
    "        twist[MOVING, :3] = velocity[:, :3]",
    '        twist[MOVING, 3:] = np.einsum("nij,nj->ni", turn, velocity[:, 3:])',
    "    return dict(zip(BODIES, zip(pose.tolist(), twist.tolist())))",
]
