"""Ports of MuJoCo: the model, settings and readings of MuJoCo C, and steps of a port.

    Spec -> MjModel -> the port's model -> its steps -> MjData, by the port's own copy -> readings as of MuJoCo C

A port runs beside MuJoCo C of its own release, which compiles the model: in another environment than a newer C.
"""

from __future__ import annotations

import os
from abc import abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import replace
from importlib import import_module
from importlib.metadata import version
from types import MappingProxyType
from typing import Any

from adapters.engine import Array, Declared, Engine, EngineError, EngineFacts, Precision, Quirk, Simulation
from adapters.mujoco.engine import MujocoEngine
from adapters.mujoco.profiles import PROFILES
from adapters.mujoco.shipped import SOLIMP
from adapters.mujoco.simulation import MujocoSimulation
from adapters.needs import Needs, needs
from adapters.plain import one_line
from adapters.scene import Scene
from adapters.settings import Check, checked_step

#: What the adapter of a port leaves to MuJoCo C: it enters velocities between the halves of a step.
MOVED = frozenset({"surface velocity", "moving half-space", "course"})
#: Causes of differences; contacts are as stiff as in C without a margin, and as shipped.
SMOOTH = "pairs without friction keep rows of friction, of 1e-5 in C"
STIFF = {"contacts of profile tuned are too stiff for single precision": {"margin": 0.0, "solimp": SOLIMP}}
#: The adapter of MuJoCo C.
ORIGINAL = MujocoEngine()


def port_facts(name: str, title: str, package: str, precision: Precision, *quirks: Quirk) -> EngineFacts:
    """Facts of a port: those of MuJoCo C, except for what differs."""
    return replace(
        ORIGINAL.facts,
        name=name,
        title=title,
        package=package,
        roles=MappingProxyType({"default": "shipped", "tuned": "tuned"}),
        colour="",
        precision=precision,
        apart=True,
        port_of=ORIGINAL.name,
        abilities=ORIGINAL.facts.abilities - MOVED,
        quirks=quirks,
        known_bad_versions={},
    )


class PortSimulation(MujocoSimulation):
    """One model of a port; `MujocoSimulation` reads the `MjData` into which the port copies its own."""

    def __init__(self, scene: Scene, dt: float, settings: Mapping[str, Any]) -> None:
        super().__init__(scene, dt, settings)
        try:
            self._put()
        except (NotImplementedError, ValueError) as error:  # the ways of ports to refuse a model
            raise EngineError(f"scene: {one_line(error)}") from None

    @abstractmethod
    def _put(self) -> None:
        """Hand model and start state over to the port."""

    @abstractmethod
    def _copy(self) -> None:
        """Copy all of the port's data into those of MuJoCo C."""

    @abstractmethod
    def _tolerance(self) -> float:
        """Tolerance that the port's solver uses."""

    def copy_contacts(self) -> tuple[Array, ...]:
        """See `MujocoSimulation.copy_contacts`; of the data that the port copies."""
        self._copy()
        return super().copy_contacts()

    def readback(self) -> dict[str, Any]:
        """Values of the compiled model, and the port's own tolerance."""
        return {**super().readback(), "tolerance": self._tolerance()}

    def certificate(self) -> dict[str, Any]:
        """Empty: a port has no residual of its own."""
        return {}


class PortEngine(Engine):
    """A port of MuJoCo C with its profiles, except for the one that loops around the solver of C."""

    profiles = MappingProxyType({name: PROFILES[name] for name in ("default", "tuned")})
    #: Name by which the port is imported.
    module: str
    #: Package with the release number of MuJoCo; the port's own unless told.
    numbered = ""
    simulation: Callable[[Scene, float, Mapping[str, Any]], Simulation]
    #: Settings of the port alone.
    own: Mapping[str, Check] = MappingProxyType({})
    switches: Mapping[str, Mapping[str, Any]] = MappingProxyType(
        {
            SMOOTH: {"smooth_condim": 1},
            "round-off decides whether bodies that touch are in contact": {"margin": 1e-3},
            "friction rows without friction, and touching bodies": {"margin": 1e-3, "smooth_condim": 1},
            "the tolerance of its solver is at least 1e-6": {"tolerance": 1e-6},
            "edges of its friction pyramids are alike": {"cone": "elliptic"},
            "elliptic cones, or the damping of their friction": {"cone": "pyramidal", "solreffriction": None},
            "its solver starts elsewhere in each step": {"disabled": ("warmstart",)},
        }
    )

    def version(self) -> str:
        """Version of the port.

        Raises
        ------
        ImportError
            If it is not installed, or MuJoCo C of another release is.
        """
        stepped = self.numbered or self.facts.package
        found, here = version(stepped), ORIGINAL.version()
        if found.split(".")[:2] != here.split(".")[:2]:
            raise ImportError(f"{stepped} {found} is no port of MuJoCo {here}, which is installed")
        told = set(os.environ)
        import_module(self.module)
        for name in set(os.environ) - told:  # JAX sets two, and a process whose variables change runs no second case
            del os.environ[name]
        return version(self.facts.package)

    def refuses(self, scene: Scene, profile: str) -> str | None:
        """See `MujocoEngine.refuses`."""
        return ORIGINAL.refuses(scene, profile)

    def refusal(self, scene: Scene, profile: str, dt: float) -> str | None:
        """The engine's own sentence where the port does not take a model of C."""
        refused = super().refusal(scene, profile, dt)
        if refused is None and profile in self.profiles:
            try:
                self.build(scene, dt, {each.name: each.value for each in self.settings(profile, needs(scene), dt)})
            except EngineError as error:
                return str(error)
        return refused

    def settable(self) -> Mapping[str, Check]:
        """See `Engine.settable`; those of MuJoCo C and the port's own."""
        return {**ORIGINAL.settable(), **self.own}

    def check_settings(self, settings: Mapping[str, Any]) -> None:
        """See `Engine.check_settings`."""
        for name, check in self.own.items():
            if name in settings and check(settings[name]):
                raise EngineError(f"{name}: must be {check(settings[name])}")
        ORIGINAL.check_settings({name: value for name, value in settings.items() if name not in self.own})

    def build(self, scene: Scene, dt: float, settings: Mapping[str, Any]) -> Simulation:
        """Make a world.

        Raises
        ------
        EngineError
            For a scene or a setting that MuJoCo C or the port does not support.
        """
        checked_step(dt)
        self.check_settings(settings)
        if refused := self.refuses(scene, ""):
            raise EngineError(refused)
        return self.simulation(scene, dt, settings)

    def declares(self, profile: str, needs: Needs, dt: float) -> dict[str, Declared]:
        """As MuJoCo C; bands of a port in single precision are wider by its round-off."""
        declared = ORIGINAL.declares(profile, needs, dt)
        wider = self.facts.round_off if self.facts.precision == "single" else 0.0
        return {name: replace(told, band=told.band + wider) for name, told in declared.items()}
