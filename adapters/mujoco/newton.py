"""Newton's MuJoCo solver (`newton`): MuJoCo Warp, which collides too, behind Newton's model; here on the CPU.

    Spec -> MJCF -> Newton's importer -> Newton's model -> its own MjModel -> MuJoCo Warp -> Newton's state

What the importer and the solver do not carry over is refused: their `MjModel` is compared with that of MuJoCo C.
"""

from __future__ import annotations

import warnings
from types import MappingProxyType
from typing import Any, final

import numpy as np

from adapters.engine import EngineError, ProfileRule, Quirk, Setting
from adapters.law.single_precision import UNIT
from adapters.mujoco.port import PortEngine, port_facts
from adapters.mujoco.profiles import PROFILES
from adapters.mujoco.releases import Mjcf, no_autoreset
from adapters.mujoco.spec import Spec
from adapters.mujoco.warp import CONTACTS, MujocoWarpEngine, WarpSimulation
from adapters.needs import Needs
from adapters.newton.simulation import imported
from adapters.releases import Distribution, Releases, Requirement

#: Numbers of a model that its motion depends on. Newton turns the frames of meshes, and has other sizes of planes.
CARRIED = (
    *(f"body_{name}" for name in ("mass", "inertia", "gravcomp")),
    *(f"geom_{name}" for name in ("bodyid", "type", "contype", "conaffinity")),
    *(f"geom_{name}" for name in ("friction", "condim", "solref", "solimp", "margin", "gap")),
    *(f"pair_{name}" for name in ("geom1", "geom2", "friction", "dim")),
    *(f"pair_{name}" for name in ("solref", "solreffriction", "solimp", "margin", "gap")),
)
#: Options that are no settings, are given with each step, or say nothing without no-slip iterations, which are refused.
GIVEN = ("timestep", "disableflags", "noslip_tolerance")


@final
class NewtonMujocoSimulation(WarpSimulation):
    """One model of Newton, its MuJoCo solver, and two states: a step reads one and writes the other."""

    def _put(self) -> None:
        self._warp, newton = imported()
        import mujoco_warp

        self._port, self._recorded = mujoco_warp, None
        self._model.opt.disableflags &= ~no_autoreset(self._mujoco)
        most = CONTACTS * self._model.ngeom
        written, builder = Mjcf(self._mujoco), newton.ModelBuilder(gravity=self._scene.gravity)
        Spec(self._scene, self._dt, self._settings, written)
        written.option.disableflags = self._model.opt.disableflags
        order = {self._model.pair(row).name: row for row in range(self._model.npair)}
        written.contact[:] = sorted(written.contact, key=lambda pair: order[pair.get("name")])
        builder.rigid_gap = 0.0
        multiccd = not self._model.opt.disableflags & int(self._mujoco.mjtDisableBit.mjDSBL_MULTICCD)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # what they tell is compared below
            builder.add_mjcf(written.text())
            world = builder.finalize(device="cpu")
            self._solver = newton.solvers.SolverMuJoCo(
                world,
                nconmax=most,
                njmax=4 * most,
                enable_multiccd=multiccd,
                skip_visual_only_geoms=False,
                kinematic_switchable_roots=False,
            )
        self._ported, self._state = self._solver.mjw_model, self._solver.mjw_data
        self._carry(self._solver.mj_model)
        start, self._data = self._data, self._mujoco.MjData(self._solver.mj_model)
        self._data.qpos[:], self._data.qvel[:] = start.qpos, start.qvel
        self._now, self._next, self._control = world.state(), world.state(), world.control()
        places, speeds = self._now.joint_q.numpy().reshape(-1, 7), self._now.joint_qd.numpy().reshape(-1, 6)
        places[:] = self._data.qpos.reshape(-1, 7)[:, [0, 1, 2, 4, 5, 6, 3]]
        for row, index in enumerate(self._moving):
            body = self._scene.bodies[index]
            speeds[row] = body.twist
            if body.motion == "free":
                self._now.body_f.numpy()[row] = (*body.force, *body.torque)

    def _carry(self, theirs: Any) -> None:
        """Take the numbers of Newton's model, and of what MuJoCo Warp steps, over into that of C.

        Raises
        ------
        EngineError
            If one differs by more than single precision.
        """
        ours, stepped = self._model, self._ported
        names = [name for name in dir(ours.opt) if name[0] != "_" and name not in GIVEN]
        told = [("option ", ours.opt, name, getattr(theirs.opt, name)) for name in names]
        told += [("", ours, name, getattr(stepped, name).numpy()) for name in CARRIED]
        for kind, own, name, there in told:
            here = getattr(own, name)
            there = there[0] if np.ndim(there) > np.ndim(here) else there  # of the first of its worlds
            if np.shape(here) != np.shape(there) or not np.allclose(here, there, 4.0 * UNIT, 0.0):
                raise EngineError(f"{kind}{name}: Newton has {np.ravel(there)} for {np.ravel(here)}")
            setattr(own, name, there)

    def _step(self) -> None:
        self._solver.step(self._now, self._next, self._control, None, self._dt)
        for name in ("joint_q", "joint_qd"):
            self._warp.copy(getattr(self._now, name), getattr(self._next, name))

    def _copy(self) -> None:
        self._port.get_data_into(self._data, self._solver.mj_model, self._state)


def _without_margin(rule: ProfileRule) -> ProfileRule:
    def settings(needs: Needs, dt: float) -> list[Setting]:
        because = "Newton sets it to 0 where a shape is a box"
        own = Setting("margin", 0.0, because, "SolverMuJoCo, _zero_margins_for_native_ccd")
        return [own if each.name == "margin" else each for each in rule(needs, dt)]

    return settings


@final
class NewtonMujocoEngine(PortEngine):
    """Adapter of Newton's MuJoCo solver."""

    facts = port_facts(
        "mujoco_newton",
        "Newton (MuJoCo)",
        "newton",
        "single",
        *MujocoWarpEngine.facts.quirks,
        Quirk(
            "restitution of Newton's shapes has no effect in this solver",
            "rebounds come from solref, as in MuJoCo; a model has them by MJCF",
            "newton-physics/newton, SolverMuJoCo; measured with 1.8.0: tests/adapters/test_ports_of_mujoco.py",
        ),
        Quirk(
            "it integrates by implicitfast, and finds one contact of two meshes, where MuJoCo has Euler and several",
            "both are given as settings have them",
            "SolverMuJoCo, integrator, enable_multiccd; MuJoCo 3.17: mjDSBL_MULTICCD",
        ),
        Quirk(
            "it sets margins to 0 in a model with a box",
            "`tuned` has none; a setting that is not carried over is refused",
            "SolverMuJoCo, _zero_margins_for_native_ccd",
        ),
        Quirk(
            "gravity of MJCF is not read: it stays 9.81 m/s^2; a pair without solreffriction gets (0.02, 1)",
            "gravity is given to the builder, solreffriction is written, 0 0 where it is that of the normal",
            "newton/_src/utils/import_mjcf.py; SolverMuJoCo, pair_solreffriction; measured with 1.8.0",
        ),
        Quirk(
            "shapes of MJCF get Newton's gap of 0.1 m, within which contacts are told that do not push",
            "the gap is 0, as in MuJoCo",
            "ModelBuilder.rigid_gap",
        ),
    )
    module = "newton"
    numbered = "mujoco-warp"
    simulation = NewtonMujocoSimulation
    profiles = MappingProxyType({**PortEngine.profiles, "tuned": _without_margin(PROFILES["tuned"])})
    expected = MujocoWarpEngine.expected
    switches = ({"margin": 0.0}, *PortEngine.switches)
    releases = Releases(
        (Distribution("newton"),),
        known=">=1.8,<1.9",
        requirements=(
            Requirement("~=1.8.0", "scipy", "its importer of MJCF makes hulls with it, and does not ask for it"),
            Requirement("~=1.8.0", "mujoco==3.17.0", "its extra sim asks for mujoco ~=3.17.0"),
            Requirement("~=1.8.0", "mujoco-warp==3.17.0", "its extra sim asks for mujoco-warp ~=3.17.0"),
        ),
    )
