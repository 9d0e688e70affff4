"""MJX (`mujoco-mjx`): MuJoCo in JAX, in double precision, or in JAX's own single as another engine; here on the CPU.

A model is compiled when it makes its first step. One compiled function makes all steps, however many are asked for: a
call for each would take longer than the steps.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from types import MappingProxyType
from typing import Any, final

import numpy as np

from adapters.engine import EngineError, Expected, ProfileRule, Quirk, Recorded, Setting
from adapters.mujoco.port import SMOOTH, STIFF, PortEngine, PortSimulation, port_facts
from adapters.mujoco.profiles import PROFILES
from adapters.mujoco.shipped import SOLIMP
from adapters.mujoco.spec import Spec
from adapters.needs import Needs
from adapters.settings import word
from adapters.whole import cache_folder

#: States that one call records.
RECORDED = 256
#: Contacts that fit per free body, and the number of free bodies from which on there may be more.
CONTACTS, MANY = 8, 4
#: Layouts whose compiled steps a process keeps: each has 600 to 1400 mappings of memory, and Linux allows 65530.
KEPT = 24


@lru_cache(KEPT)
def _steps(layout: object) -> Any:
    """``(model, data, most, samples, stride) -> (data, most, states)``, compiled for models of one layout.

    ``most`` is the largest number of contacts in a step, or an empty tuple where all fit; ``states`` is
    (RECORDED, nq + nv): one after each ``stride`` steps, in the first ``samples`` rows.
    """
    import jax
    from jax import numpy as jnp
    from mujoco import mjx

    if jax.config.jax_compilation_cache_dir is None:  # the user has chosen none, and JAX keeps nothing by itself
        jax.config.update("jax_compilation_cache_dir", str(cache_folder() / "jax"))
        jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)

    def steps(model: Any, data: Any, most: Any, samples: int, stride: int) -> Any:
        def step(_: Any, carried: Any) -> Any:
            now, most = carried
            # A loop keeps the types of what it carries; in double precision a step makes some integers longer.
            after = jax.tree.map(lambda new, old: jnp.asarray(new, old.dtype), mjx.step(model, now), now)
            return after, tuple(jnp.maximum(each, _touching(after)) for each in most)

        def sample(k: Any, carried: Any) -> Any:
            now, most = jax.lax.fori_loop(0, stride, step, carried[:2])
            return now, most, carried[2].at[k].set(jnp.concatenate([now.qpos, now.qvel]))

        states = jnp.zeros((RECORDED, data.qpos.size + data.qvel.size))
        return jax.lax.fori_loop(0, samples, sample, (data, most, states))

    return jax.jit(steps)


def _touching(data: Any) -> Any:
    """Number of contacts within their margins."""
    contact = data._impl.contact
    return (contact.dist < contact.includemargin).sum()


@final
class MjxSimulation(PortSimulation):
    """One model of MJX."""

    def _put(self) -> None:
        import jax
        from mujoco import mjx

        self._jax, self._port = jax, mjx
        model, free = self._model, len(self._moving)
        self._room = CONTACTS * free if free >= MANY else 0
        if self._room:
            limited = Spec(self._scene, self._dt, self._settings)
            limited.spec.add_numeric(name="max_contact_points", data=[self._room])
            model = limited.compile()
        with self._numbers():
            self._ported = mjx.put_model(model, impl="jax")
            self._state = mjx.put_data(model, self._data, impl="jax")
        if self._settings["smooth_condim"] == 1 and not any(mu for _, mu in self._scene.materials()):
            # No contact has a cone; MJX's code of elliptic ones stops where there is none.
            self._ported = self._ported.tree_replace({"opt.cone": mjx.ConeType.PYRAMIDAL})

    def _numbers(self) -> Any:
        return self._jax.enable_x64(self._settings["precision"] == "double")

    def _stepped(self, samples: int, stride: int) -> Any:
        with self._numbers():
            leaves, tree = self._jax.tree.flatten((self._ported, self._state))
            steps = _steps((tree, tuple(map(self._jax.typeof, leaves))))
            most = (0,) if self._room else ()
            self._state, most, states = steps(self._ported, self._state, most, samples, stride)
        if most and int(most[0]) >= self._room:
            raise EngineError("memory: contacts do not fit, so some may have been dropped")
        told = np.array(states[:samples], float)
        self._data.qpos[:], self._data.qvel[:] = np.split(told[-1], [self._model.nq])
        return told

    def advance(self, steps: int) -> None:
        """Make ``steps`` steps."""
        if steps:
            self._stepped(1, steps)

    def record(self, samples: int, stride: int, contacts: bool) -> Recorded:
        """See `Simulation.record`; without contacts many samples in one call."""
        if contacts:
            return super().record(samples, stride, contacts)
        found = [self._stepped(min(RECORDED, samples - done), stride) for done in range(0, samples, RECORDED)]
        told = [*np.concatenate(found)]
        poses = self.poses_of([each[: self._model.nq] for each in told])
        return Recorded(poses, self.twists_of(told), np.zeros(samples, np.int64))

    def _copy(self) -> None:
        self._port.get_data_into(self._data, self._model, self._state)

    def _tolerance(self) -> float:
        return float(self._ported.opt.tolerance)


def _with_precision(rule: ProfileRule, precision: str) -> ProfileRule:
    def settings(needs: Needs, dt: float) -> list[Setting]:
        because = "as MuJoCo C" if precision == "double" else "as JAX computes unless told otherwise"
        return [*rule(needs, dt), Setting("precision", precision, because, "JAX documentation: jax_enable_x64")]

    return settings


def _profiles(precision: str) -> MappingProxyType[str, ProfileRule]:
    return MappingProxyType({name: _with_precision(PROFILES[name], precision) for name in PortEngine.profiles})


#: Facts of both engines.
FACTS = port_facts(
    "mujoco_mjx",
    "MJX",
    "mujoco-mjx",
    "double",
    Quirk(
        "JAX computes in single precision unless told otherwise",
        "double precision, so that differences from MuJoCo C are none of round-off; mujoco_mjx_single is JAX's own",
        "JAX documentation: jax_enable_x64",
    ),
    Quirk(
        "a pair without friction, which keeps rows of friction, has 0 in them where C has 1e-5",
        "unchanged; with smooth_condim=1 it has no such rows, and moves as in C",
        "measured with 3.17.0: after a blow a ball is 2 mm elsewhere, with friction 1e-5 it is not",
    ),
    Quirk(
        "elliptic cones stop a scene of which no pair has friction rows: an index is no integer",
        "such a scene, which has no cones, is given to MJX with pyramidal ones; it moves as in C",
        "mujoco/mjx/_src/solver.py, _update_constraint; measured with 3.17.0: 1e-13 m",
    ),
    Quirk(
        "two boxes have contacts from an overlap of 1e-6 m on; with `tuned` they rest less deep, and rattle",
        "unchanged; with solimp=0.99 0.99 0.001 0.5 1 they rest a hundred times as deep, and move as in C",
        "mujoco/mjx/_src/collision_convex.py, _create_contact_manifold; measured with 3.17.0: pinch",
    ),
    Quirk(
        "an edge of a box on another box: its overlap is measured along a face of the edge, at an angle to the normal",
        "unchanged: the overlap of C divided by the cosine of that angle",
        "mujoco/mjx/_src/collision_convex.py, _create_contact_manifold; measured with 3.17.0: shove",
    ),
    Quirk(
        "corners of a box within the margin of a plane that do not overlap it may be no contacts",
        "unchanged; with margin=0 the box moves as in C",
        "mujoco/mjx/_src/collision_convex.py, plane_convex; measured with 3.17.0: incline",
    ),
    Quirk(
        "with elliptic cones its solver may stop far from the solution when it starts at the forces of the last step",
        "unchanged; with disabled=warmstart it finds the solution of C",
        "measured with 3.17.0: two dominoes fly 600 m; a step is off by 6.5 m/s^2, without by 1e-11",
    ),
    Quirk(
        "a step solves for every contact that any two bodies might have",
        f"for {CONTACTS} per free body at most, from {MANY} bodies on; a run that needs more fails",
        "MJX documentation: max_contact_points; measured with 3.17.0: a column of six moves alike within 1e-13 m",
    ),
    Quirk(
        "a step is compiled for each layout of a model, anew in each process",
        "JAX keeps what it compiles in our cache folder, or in the user's",
        "JAX documentation: jax_compilation_cache_dir; measured: 6.3 s of CPU for a ball, then 1.2 s",
    ),
)


#: Causes of differences: in single precision; of the solver in both; and in double, where also its tolerance shows, and
#: bodies that rest less than 1e-6 m deep.
CORNERS: Mapping[str, Mapping[str, Any]] = {
    SMOOTH: {"smooth_condim": 1},
    "corners of a box in the margin of a plane may be no contacts": {"margin": 0.0},
}
SOLVER: Mapping[str, Mapping[str, Any]] = {
    "its solver ends elsewhere with friction pyramids": {"cone": "elliptic"},
    "its solver may stop where it starts, at the forces of the last step": {"disabled": ("warmstart",)},
}
DEEPER: Mapping[str, Mapping[str, Any]] = {
    "its solver ends at its tolerance after another step": {"tolerance": 0.0},
    "corners of a box in the margin of a plane may be no contacts": {"margin": 0.0},
    SMOOTH: {"smooth_condim": 1, "tolerance": 0.0},
    **SOLVER,
    "friction rows without friction, and pyramids": {"cone": "elliptic", "smooth_condim": 1, "tolerance": 0.0},
    "bodies that rest less than 1e-6 m deep may have no contacts": {
        "margin": 0.0,
        "solimp": (0.99, 0.99, 0.001, 0.5, 1.0),
    },
    "bodies that touch may have no contacts": {"margin": -1e-5},
    "touching bodies, and where its solver starts": {"margin": -1e-5, "disabled": ("warmstart",)},
}


class MjxPort(PortEngine):
    """What both engines share: the model and its steps, in the precision that a setting tells."""

    module = "mujoco.mjx"
    simulation = MjxSimulation
    expected: tuple[Expected, ...] = (
        Expected(
            "receipt restitution",
            "a pair without friction has 0 in its rows of friction, and rebounds by another law than C",
            "measured with 3.17.0: with friction 1e-5 or smooth_condim=1 it rebounds as in C within 1e-4",
        ),
    )
    switches: Mapping[str, Mapping[str, Any]] = MappingProxyType(DEEPER)
    own: Mapping[str, Any] = MappingProxyType({"precision": word("double", "single")})


@final
class MujocoMjxEngine(MjxPort):
    """Adapter of MJX in double precision."""

    facts = FACTS
    profiles = _profiles("double")


@final
class MujocoMjxSingleEngine(MjxPort):
    """Adapter of MJX in single precision."""

    facts = replace(FACTS, name="mujoco_mjx_single", title="MJX single (MuJoCo on JAX)", precision="single")
    profiles = _profiles("single")
    expected = (
        *MjxPort.expected,
        *(
            Expected(check, SMOOTH, "measured with 3.17.0: holds with smooth_condim=1")
            for check in ("impulse", "sizes", "receipt impulse", "receipt turn")
        ),
        *(
            Expected(check, cause, "measured with 3.17.0: holds with margin=0 and solimp as shipped", "tuned")
            for cause in STIFF
            for check in ("contacts", "order")
        ),
    )
    switches = MappingProxyType(
        {
            **CORNERS,
            **STIFF,
            **SOLVER,
            "friction rows without friction, and pyramids": {"cone": "elliptic", "smooth_condim": 1},
            "stiff contacts, and where its solver starts": {
                "margin": 0.0,
                "solimp": SOLIMP,
                "disabled": ("warmstart",),
            },
        }
    )
