"""One MuJoCo model and its data.

After a step MuJoCo holds positions and velocities of the step's end, but contacts, gaps and contact forces of its
start. ``force * dt`` is therefore the impulse of the last step, and `Contacts.gap` is the gap at its start, one step
older than the pose.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from adapters.copied import Copied
from adapters.engine import Array, Contacts, EngineError
from adapters.mujoco.matched import Matched
from adapters.mujoco.moving import Moved, moved
from adapters.mujoco.releases import check_state, silence
from adapters.mujoco.spec import Spec, has_joint, rotation, start
from adapters.scene import Scene
from adapters.scene.drives import velocity_over


class MujocoSimulation(Copied):
    """One MuJoCo model and its data."""

    def __init__(self, scene: Scene, dt: float, settings: Mapping[str, Any]) -> None:
        import mujoco

        silence(mujoco)
        self._mujoco, self._scene, self._dt = mujoco, scene, dt
        self._settings = dict(settings)
        self._model = Spec(scene, dt, settings).compile()
        self._data = mujoco.MjData(self._model)
        self._moving = [i for i, body in enumerate(scene.bodies) if has_joint(body)]
        driven = [(row, scene.bodies[i]) for row, i in enumerate(self._moving)]
        self._driven = [(6 * row, body) for row, body in driven if body.course is not None]
        self._moved = Moved(scene, dt, self._model, self._data) if moved(scene) else None
        self._matched = Matched(mujoco, scene, settings, self._model, self._data) if "rounds" in settings else None
        self._made = 0
        self._faces = list(self._moved.faces) if self._moved else []
        self._poses = np.array([body.pose for body in scene.bodies], dtype=float)
        names = [self._model.geom(g).name for g in range(self._model.ngeom)]
        self._body_of_geom = np.array([int(name.removeprefix("geom")) for name in names], np.int64)
        self._full = _memory_warnings(mujoco, self._data)
        self._set_start()

    def _set_start(self) -> None:
        """Start state and loads."""
        self._data.qpos[:], self._data.qvel[:] = start(self._scene, self._dt)
        for index in self._moving:
            body = self._scene.bodies[index]
            if body.motion == "free":
                row = self._model.body(f"body{index}").id
                self._data.xfrc_applied[row] = (*body.force, *body.torque)

    def advance(self, steps: int) -> None:
        """Make ``steps`` steps.

        Raises
        ------
        EngineError
            If MuJoCo dropped contacts because of too little memory.
        """
        if self._driven or self._moved or self._matched:
            for _ in range(steps):
                self._drive()
        else:
            self._mujoco.mj_step(self._model, self._data, nstep=steps)
        check_state(self._mujoco, self._data)
        self._check_memory()

    def _check_memory(self) -> None:
        for warning in self._full:
            if warning.number:
                raise EngineError("memory: MuJoCo's arena is too small, so contacts were dropped")

    def _drive(self) -> None:
        """Make a step in which bodies move by a course, faces move, surfaces run or references are matched."""
        for row, body in self._driven:
            self._data.qvel[row : row + 3] = velocity_over(body, self._dt, self._made)
        mj, model, data = self._mujoco, self._model, self._data
        if self._moved or self._matched:
            mj.mj_step1(model, data)
            if self._moved:
                self._moved.enter(self._made)
            if self._matched:
                self._matched.step2()
            else:
                mj.mj_step2(model, data)
            if self._moved:
                self._moved.move()
        else:
            mj.mj_step(model, data)
        self._made += 1

    def copy_pose(self) -> Array:
        """Positions of moving bodies, then places of moved faces."""
        return np.concatenate([self._data.qpos, *self._moved.places()]) if self._moved else self._data.qpos.copy()

    def poses_of(self, copies: Sequence[Array]) -> Array:
        """Poses at the end of the last step."""
        samples, own = len(copies), 7 * len(self._moving)
        told = np.array(copies)
        found = np.tile(self._poses, (samples, 1, 1))
        found[:, self._moving] = told[:, :own].reshape(samples, -1, 7)
        found[:, self._faces, :3] = told[:, own:].reshape(samples, -1, 3)
        return found

    def copy_twist(self) -> Array:
        """Positions and velocities of moving bodies, then velocities of moved faces."""
        parts = [self._data.qpos, self._data.qvel]
        return np.concatenate(parts + self._moved.velocities() if self._moved else parts)

    def twists_of(self, copies: Sequence[Array]) -> Array:
        """Twists at the end of the last step; MuJoCo keeps angular velocity in body axes."""
        samples, n = len(copies), len(self._moving)
        told = np.array(copies)
        velocity = told[:, 7 * n : 13 * n].reshape(samples, -1, 6)
        turns = rotation(told[:, : 7 * n].reshape(-1, 7)[:, 3:]).reshape(samples, -1, 3, 3)
        # Not by `einsum`, whose last digit depends on the number of states.
        x, y, z = (turns[..., axis] * velocity[..., [3 + axis]] for axis in range(3))
        found = np.zeros((samples, len(self._poses), 6))
        found[:, self._moving] = np.concatenate([velocity[..., :3], x + y + z], axis=2)
        found[:, self._faces, :3] = told[:, 13 * n :].reshape(samples, -1, 3)
        return found

    def copy_contacts(self) -> tuple[Array, ...]:
        """Fields of contacts in the order of `contacts_of`, and the forces of all constraints."""
        contact, count = self._data.contact, self._data.ncon
        if not count:
            return ()
        fields = (contact.geom, contact.pos, contact.frame, contact.dist, contact.dim, contact.friction)
        return (*(field.copy() for field in fields), contact.efc_address.copy(), self._data.efc_force.copy())

    def contacts_of(self, copies: Sequence[tuple[Array, ...]]) -> tuple[NDArray[np.int64], Contacts]:
        """Contacts and gaps at the start of the last step, impulses of that step.

        RK4 solves contacts four times a step and stores the last, so impulses are not available (NaN).
        """
        counts = np.array([len(copy[0]) if copy else 0 for copy in copies], np.int64)
        found = [copy for copy in copies if copy]
        if not found:
            return counts, Contacts.from_rows([], 3)
        geom, point, frame, gap, dim, friction, address, force = map(np.concatenate, zip(*found, strict=True))
        sizes = [len(copy[-1]) for copy in found]
        begin = np.repeat(np.cumsum(sizes) - sizes, counts[counts > 0])
        frame = frame.reshape(-1, 3, 3)
        if self._settings["integrator"] == "RK4":
            impulse = np.full(point.shape, np.nan)
        else:
            pushed = self._forces(force, np.where(address < 0, -1, begin + address), dim, friction)
            impulse = self._dt * (pushed[:, None] @ frame)[:, 0]
        first, second = self._body_of_geom[geom.astype(int)].T
        return counts, Contacts.turned(first, second, point, frame[:, 0], impulse, gap)

    def _forces(self, force: Array, row: NDArray[np.int64], dim: NDArray[np.int64], friction: Array) -> Array:
        """Forces of contacts along the axes of their frames, (k, 3), as ``mj_contactForce``.

        ``row``: the first of a contact's rows in ``force``; -1 where the contact has none. A pyramid has four rows, its
        normal plus and minus each tangent times its friction.
        """
        rough, pyramid = dim > 1, self._model.opt.cone == self._mujoco.mjtCone.mjCONE_PYRAMIDAL
        inside = np.append(force, np.zeros(4))  # a contact without friction has one row
        rows = np.where((row >= 0)[:, None], inside[row[:, None] + np.arange(4)], 0.0)
        if pyramid:
            normal = rows[:, 0] + rows[:, 1] + rows[:, 2] + rows[:, 3]
            along = (rows[:, [0, 2]] - rows[:, [1, 3]]) * friction[:, :2]
        else:
            normal, along = rows[:, 0], rows[:, 1:3]
        return np.column_stack([np.where(rough, normal, rows[:, 0]), np.where(rough[:, None], along, 0.0)])

    def _residual(self) -> Array:
        """``M a`` less loads and contacts of the last solve, (nv,) [N, N m]."""
        inertial = np.zeros(self._model.nv)
        self._mujoco.mj_mulM(self._model, self._data, inertial, self._data.qacc)
        return np.asarray(inertial - self._data.qfrc_smooth - self._data.qfrc_constraint)

    def readback(self) -> dict[str, Any]:
        """Values of the compiled model."""
        model, mj = self._model, self._mujoco
        option = model.opt
        values: dict[str, Any] = {
            "dt": float(option.timestep),
            "gravity": option.gravity.tolist(),
            "integrator": mj.mjtIntegrator(option.integrator).name,
            "cone": mj.mjtCone(option.cone).name,
            "solver": mj.mjtSolver(option.solver).name,
            "iterations": int(option.iterations),
            "tolerance": float(option.tolerance),
            "noslip_iterations": int(option.noslip_iterations),
            "impratio": float(option.impratio),
            "disableflags": int(option.disableflags),
            "enableflags": int(option.enableflags),
            "materials": self._materials(),
        }
        for index in self._moving:
            row, name = model.body(f"body{index}"), self._scene.bodies[index].name
            values[f"{name}.mass"] = float(row.mass[0])
            values[f"{name}.inertia"] = row.inertia.tolist()
            values[f"{name}.size"] = model.geom(f"geom{index}").size.tolist()
        return values

    def _materials(self) -> dict[str, Any]:
        model = self._model
        if model.npair == 0:
            row = model.geom(0)
            fields = {"friction": row.friction, "solref": row.solref, "solimp": row.solimp, "condim": row.condim}
            return {"all geoms": {name: np.ravel(value).tolist() for name, value in fields.items()}}
        return {
            model.pair(k).name: {
                "friction": float(model.pair_friction[k][0]),
                "condim": int(model.pair_dim[k]),
                "solref": model.pair_solref[k].tolist(),
                "solreffriction": model.pair_solreffriction[k].tolist(),
                "solimp": model.pair_solimp[k].tolist(),
            }
            for k in range(model.npair)
        }

    def certificate(self) -> dict[str, Any]:
        """Largest residual of M a = loads + contacts in the last solve [N, N m], Newton steps, warnings."""
        mj, model, data = self._mujoco, self._model, self._data
        if model.nv == 0:
            return {}
        residual = np.abs(self._residual()).max()
        warnings = {mj.mju_warningText(k, 0): int(w.number) for k, w in enumerate(data.warning) if w.number}
        found = {"residual": float(residual), "newton_steps": data.solver_niter.tolist(), "warnings": warnings}
        return found | (self._matched.told() if self._matched else {})


def _memory_warnings(mujoco: Any, data: Any) -> list[Any]:
    """Counters of dropped contacts; they are MuJoCo's own, so they stay up to date."""
    kinds = mujoco.mjtWarning
    return [data.warning[kind] for kind in (kinds.mjWARN_CONTACTFULL, kinds.mjWARN_CNSTRFULL)]
