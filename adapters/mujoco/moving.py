"""Moving faces and surface velocities, which MuJoCo does not have: their velocity is added to the contacts of a step.

A constraint has the reference acceleration ``aref = -b v - k r``, where v is the velocity of the bodies that MuJoCo
moves. The velocity of a face moved from outside (a mocap body, without velocity in contacts) is added row by row
between the two halves of a step: ``aref -= b (v of the face along the row)``.
"""

from __future__ import annotations

import inspect
from typing import Any

import numpy as np

from adapters.scene import Body, HalfSpace, Scene
from adapters.scene.drives import velocity_over
from adapters.script import literal, velocity


def is_moved_face(body: Body) -> bool:
    """Whether a body is a half-space that is moved from outside."""
    return isinstance(body.shape, HalfSpace) and body.motion == "prescribed"


def moved(scene: Scene) -> dict[int, Body]:
    """Indices of bodies whose contacts need a velocity that MuJoCo does not have."""
    return {i: b for i, b in enumerate(scene.bodies) if is_moved_face(b) or any(b.surface_velocity)}


def motions(scene: Scene, dt: float, step: int) -> dict[int, tuple[tuple[float, ...], tuple[float, ...]]]:
    """Velocity of the face over step number ``step`` and velocity of its surface, by index of the body [m/s]."""
    still = (0.0, 0.0, 0.0)
    return {
        i: (velocity_over(body, dt, step) if is_moved_face(body) else still, body.surface_velocity)
        for i, body in moved(scene).items()
    }


def enter_motions(model, data, motions):
    """Add the velocities of moving geoms, by index, to their contacts; after ``mj_step1``, before ``mj_step2``."""
    for k in range(data.ncon):
        contact = data.contact[k]
        row, frame = contact.efc_address, contact.frame.reshape(3, 3)
        if row < 0:
            continue
        away = np.zeros(3)
        for side, geom in ((-1.0, contact.geom[0]), (1.0, contact.geom[1])):
            face, surface = motions.get(int(geom), ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)))
            run = frame @ np.array(surface)
            run[0] = 0.0  # a surface velocity has no normal component
            away += side * (frame @ np.array(face) + run)
        if contact.dim == 1:
            rows = away[:1]
        elif model.opt.cone == 1:  # elliptic: the normal, then the tangents
            rows = np.concatenate([away, np.zeros(contact.dim - 3)])
        else:  # pyramid: the normal plus and minus each tangent by its friction
            sides = ((away[t] if t < 3 else 0.0) * contact.friction[t - 1] for t in range(1, contact.dim))
            rows = np.array([away[0] + sign * side for side in sides for sign in (1.0, -1.0)])
        data.efc_aref[row : row + len(rows)] -= data.efc_KBIP[row : row + len(rows), 1] * rows


def script_lines(scene: Scene, dt: float, second_half: str) -> tuple[list[str], list[str]]:
    """Lines of a script before its loop, and of a step; ``second_half`` is a line, or empty for MuJoCo's."""
    if not moved(scene):
        return [], ["mujoco.mj_step1(model, data)", second_half] if second_half else ["mujoco.mj_step(model, data)"]
    first = {i: face for i, (face, _) in motions(scene, dt, 0).items()}
    faces = ["# Velocities of faces that move, by the numbers of their bodies.", f"faces = {first}"]
    pairs, before, after = [], [], []
    for i, body in moved(scene).items():
        pairs.append(f'model.geom("geom{i}").id: (faces[{i}], {literal(body.surface_velocity)})')
        if is_moved_face(body):
            before.append(f"faces[{i}] = {velocity(body)}")
            after.append(f'data.mocap_pos[model.body("body{i}").mocapid[0]] += DT * np.array(faces[{i}])')
    step = [*before, "mujoco.mj_step1(model, data)", f"enter_motions(model, data, {{{', '.join(pairs)}}})"]
    return (
        ["", "", *inspect.getsource(enter_motions).splitlines(), "", "", *faces],
        [*step, second_half or "mujoco.mj_step2(model, data)", *after],
    )


class Moved:
    """Moves the faces of one model and adds their velocities to contacts."""

    def __init__(self, scene: Scene, dt: float, model: Any, data: Any) -> None:
        self._scene, self._dt, self._model, self._data = scene, dt, model, data
        self.faces = {i: int(model.body(f"body{i}").mocapid[0]) for i, b in moved(scene).items() if is_moved_face(b)}
        self._geoms = {i: int(model.geom(f"geom{i}").id) for i in moved(scene)}
        self._given = motions(scene, dt, 0)

    def enter(self, step: int) -> None:
        """Add face velocities to the contacts of step number ``step``; after ``mj_step1``."""
        given = motions(self._scene, self._dt, step)
        enter_motions(self._model, self._data, {self._geoms[i]: motion for i, motion in given.items()})
        self._given = given

    def move(self) -> None:
        """Move the faces on at the end of a step."""
        for i, row in self.faces.items():
            self._data.mocap_pos[row] += self._dt * np.array(self._given[i][0])

    def places(self) -> list[Any]:
        """Places of the faces."""
        return [self._data.mocap_pos[row] for row in self.faces.values()]

    def velocities(self) -> list[Any]:
        """Velocities of the faces in the last step (before any step, of the first)."""
        return [self._given[i][0] for i in self.faces]
