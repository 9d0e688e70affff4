"""Newton's MuJoCo solver (`newton`): MuJoCo Warp, which collides too, behind Newton's model; here on the CPU.

    Spec -> MJCF -> Newton's importer -> Newton's model -> its own MjModel -> MuJoCo Warp -> Newton's state

What the importer and the solver do not carry over is refused: their `MjModel` is compared with that of MuJoCo C.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, final

import numpy as np

from adapters.engine import Array, EngineError, ProfileRule, Quirk, Setting
from adapters.law.single_precision import UNIT
from adapters.mujoco.port import STIFF, PortEngine, port_facts
from adapters.mujoco.profiles import PROFILES
from adapters.mujoco.releases import Mjcf, no_autoreset
from adapters.mujoco.spec import Spec, rotation
from adapters.mujoco.warp import CONTACTS, MujocoWarpEngine, WarpSimulation, imported
from adapters.needs import Needs
from adapters.releases import Distribution, Releases, Requirement
from adapters.settings import Check, whole

#: Numbers of a model that its motion depends on. Newton turns the frames of meshes, and has other sizes of planes.
CARRIED = (
    *(f"body_{name}" for name in ("mass", "gravcomp")),
    *(f"geom_{name}" for name in ("bodyid", "type", "contype", "conaffinity")),
    *(f"geom_{name}" for name in ("friction", "condim", "solref", "solimp", "margin", "gap")),
    *(f"pair_{name}" for name in ("geom1", "geom2", "friction", "dim")),
    *(f"pair_{name}" for name in ("solref", "solreffriction", "solimp", "margin", "gap")),
)
MARGIN = "SolverMuJoCo, _zero_margins_for_native_ccd"
#: Options that are no settings, are given with each step, or say nothing without no-slip iterations, which are refused.
GIVEN = ("timestep", "disableflags", "noslip_tolerance")


@final
class NewtonMujocoSimulation(WarpSimulation):
    """One model of Newton, its MuJoCo solver, and two states: a step reads one and writes the other."""

    def _put(self) -> None:
        self._warp, self._port = imported()
        import newton

        self._recorded = None
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
            world.joint_qd.numpy()[:] = np.ravel([self._scene.bodies[index].twist for index in self._moving])
            self._solver = newton.solvers.SolverMuJoCo(
                world,
                nconmax=most,
                njmax=4 * most,
                enable_multiccd=multiccd,
                skip_visual_only_geoms=False,
                update_data_interval=self._settings["update_data_interval"],
                kinematic_switchable_roots=False,
            )
        self._ported, self._state = self._solver.mjw_model, self._solver.mjw_data
        self._carry(self._solver.mj_model)
        start, self._data = self._data, self._mujoco.MjData(self._solver.mj_model)
        self._data.qpos[:], self._data.qvel[:] = start.qpos, start.qvel
        self._now, self._next, self._control = world.state(), world.state(), world.control()
        for row, index in enumerate(self._moving):
            body = self._scene.bodies[index]
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
        here = _moments(ours.body_inertia, ours.body_iquat)
        if not np.allclose(here, _moments(theirs.body_inertia, theirs.body_iquat), 0.0, 8.0 * UNIT * here.max()):
            raise EngineError("body_inertia: that of Newton is another")

    def _step(self) -> None:
        self._solver.step(self._now, self._next, self._control, None, self._dt)
        for name in ("joint_q", "joint_qd"):
            self._warp.copy(getattr(self._now, name), getattr(self._next, name))

    def _copy(self) -> None:
        self._port.get_data_into(self._data, self._solver.mj_model, self._state)


def _moments(principal: Array, frame: Array) -> Array:
    """Tensors of inertia (n, 3, 3) of principal moments (n, 3) in frames (n, 4): Newton orders its axes otherwise."""
    turn = rotation(frame)
    return np.asarray(turn * principal[:, None] @ turn.transpose(0, 2, 1))


def _as_newton(rule: ProfileRule) -> ProfileRule:
    def settings(needs: Needs, dt: float) -> list[Setting]:
        none = Setting("margin", 0.0, "a margin is not carried over where a shape is a box", MARGIN)
        because = "as shipped: each step converts Newton's state to MuJoCo's and back; with 0 only back"
        converted = Setting("update_data_interval", 1, because, "SolverMuJoCo, update_data_interval")
        return [*(none if each.name == "margin" else each for each in rule(needs, dt)), converted]

    return settings


@final
class NewtonMujocoEngine(PortEngine):
    """Adapter of Newton's MuJoCo solver."""

    facts = port_facts(
        "mujoco_newton",
        "Newton MJ (MuJoCo's solver)",
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
            MARGIN,
        ),
        Quirk(
            "gravity of MJCF is not read: it stays 9.81 m/s^2; a pair without solreffriction gets (0.02, 1)",
            "gravity is given to the builder, solreffriction is written, 0 0 where it is that of the normal",
            "newton/_src/utils/import_mjcf.py; SolverMuJoCo, pair_solreffriction; measured with 1.8.0",
        ),
        Quirk(
            "shapes from MJCF get Newton's detection gap of 0.1 m: contacts without force are reported up to it",
            "the gap is 0, as in MuJoCo",
            "ModelBuilder.rigid_gap",
        ),
    )
    module = "newton"
    numbered = "mujoco-warp"
    simulation = NewtonMujocoSimulation
    profiles = MappingProxyType({name: _as_newton(PROFILES[name]) for name in PortEngine.profiles})
    own: Mapping[str, Check] = MappingProxyType({"update_data_interval": whole(0, 1)})
    expected = MujocoWarpEngine.expected
    switches = MappingProxyType(
        {
            **PortEngine.switches,
            "margins are 0 in a model with a box": {"margin": 0.0},
            **STIFF,
            "each step converts the state and back": {"update_data_interval": 0},
            "margins and conversion": {"margin": 0.0, "update_data_interval": 0},
        }
    )
    releases = Releases(
        (Distribution("newton"),),
        known=">=1.8,<1.9",
        requirements=(
            Requirement("~=1.8.0", "scipy", "its importer of MJCF makes hulls with it, and does not require it"),
            Requirement("~=1.8.0", "mujoco==3.17.0", "its extra sim requires mujoco ~=3.17.0"),
            Requirement("~=1.8.0", "mujoco-warp==3.17.0", "its extra sim requires mujoco-warp ~=3.17.0"),
        ),
    )
