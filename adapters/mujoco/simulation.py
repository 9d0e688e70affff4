"""One MuJoCo model and its data.

After a step MuJoCo holds positions and velocities of the step's end, but contacts, gaps and contact forces of its
start. ``force * dt`` is therefore the impulse of the last step, and `Contacts.gap` is the gap at its start, one step
older than the pose.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, final

import numpy as np

from adapters.drives import velocity_over
from adapters.engine import Array, Contacts, EngineError, Simulation, Worlds
from adapters.mujoco.matched import Matched
from adapters.mujoco.moving import Moved, moved
from adapters.mujoco.releases import check_state, silence
from adapters.mujoco.spec import Spec, has_joint, rotation, start
from adapters.scene import Scene


class MujocoSimulation(Simulation):
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
        self._poses = np.array([body.pose for body in scene.bodies], dtype=float)
        self._twists = np.zeros((len(scene.bodies), 6))
        names = [self._model.geom(g).name for g in range(self._model.ngeom)]
        self._body_of_geom = np.array([int(name.removeprefix("geom")) for name in names], np.int64)
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
        self._check_memory(self._data)

    def _check_memory(self, data: Any) -> None:
        kinds = self._mujoco.mjtWarning
        for kind in (kinds.mjWARN_CONTACTFULL, kinds.mjWARN_CNSTRFULL):
            if data.warning[kind].number:
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

    def pose(self) -> Array:
        """Poses at the end of the last step."""
        if self._moving:
            self._poses[self._moving] = self._data.qpos.reshape(-1, 7)
        if self._moved:
            self._moved.state(self._poses, self._twists)
        return self._poses.copy()

    def twist(self) -> Array:
        """Twists at the end of the last step."""
        if self._moving:
            velocity = self._data.qvel.reshape(-1, 6)
            turns = rotation(self._data.qpos.reshape(-1, 7)[:, 3:])
            self._twists[self._moving, :3] = velocity[:, :3]
            self._twists[self._moving, 3:] = np.einsum("nij,nj->ni", turns, velocity[:, 3:])
        if self._moved:
            self._moved.state(self._poses, self._twists)
        return self._twists.copy()

    def contacts(self) -> Contacts:
        """Contacts and gaps at the start of the last step, impulses of that step.

        RK4 solves contacts four times a step and stores the last, so impulses are not available (NaN).
        """
        contact, count = self._data.contact, self._data.ncon
        if not count:
            return Contacts.from_rows([], 3)
        force = np.zeros((count, 6))
        for k in range(count):
            self._mujoco.mj_contactForce(self._model, self._data, k, force[k])
        frame = contact.frame.reshape(count, 3, 3)
        one_solve = self._settings["integrator"] != "RK4"
        impulse = self._dt * (force[:, None, :3] @ frame)[:, 0] if one_solve else np.full((count, 3), np.nan)
        first, second = self._body_of_geom[contact.geom].T
        turned = np.where(first < second, 1.0, -1.0)[:, None]
        pair = np.minimum(first, second), np.maximum(first, second)
        return Contacts(*pair, contact.pos.copy(), turned * frame[:, 0], turned * impulse, contact.dist.copy())

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


@final
class MujocoWorlds(Worlds, MujocoSimulation):
    """Many models by ``mujoco.rollout``, which begins each call without warm start; the state of the first is read."""

    def __init__(self, scenes: Sequence[Scene], dt: float, settings: Mapping[str, Any], threads: int) -> None:
        from mujoco import rollout

        super().__init__(scenes[0], dt, settings)
        mj = self._mujoco
        self._rollout = rollout.Rollout(nthread=threads)
        self._models = [self._model, *(Spec(scene, dt, settings).compile() for scene in scenes[1:])]
        self._workers = [mj.MjData(self._model) for _ in range(threads)]
        self._kind = mj.mjtState.mjSTATE_FULLPHYSICS
        state = np.empty(mj.mj_stateSize(self._model, self._kind))
        mj.mj_getState(self._model, self._data, state, self._kind)
        self._states = np.tile(state, (len(scenes), 1))

    def advance(self, steps: int) -> None:
        """Make ``steps`` steps of all worlds; see `MujocoSimulation.advance`."""
        if not steps:
            return
        states, _ = self._rollout.rollout(self._models, self._workers, self._states, nstep=steps)
        self._states = states[:, -1].copy()
        self._mujoco.mj_setState(self._model, self._data, self._states[0], self._kind)
        for data in self._workers:
            self._check_memory(data)

    def close(self) -> None:
        """End the threads."""
        self._rollout.close()
