"""The toy engine with one fault of a given size in its input, motion or output."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from adapters.conformance.toy import ToyEngine
from adapters.engine import Array, Contacts, Declared, Engine, EngineError, EngineFacts, Recorded, Setting, Simulation
from adapters.needs import Needs
from adapters.scene import Scene


@dataclass(frozen=True)
class Fault:
    """One fault of an adapter.

    Parameters
    ----------
    check
        The check that must notice it: its name, or ``receipt <quantity>``.
    sizes
        Three sizes in ``unit``, the largest first; empty for a fault without size.
    told, stepped
        Changes of the scene and the step.
    pose, twist, contacts, readback, record
        Wrong readings, as functions of the world, the true value and the size; a record exists only with this fault.
    settings, refuses, facts, build
        Wrong statements or actions of the engine itself.
    """

    check: str
    sizes: tuple[float, ...] = ()
    unit: str = ""
    told: Callable[[Scene, float], Scene] | None = None
    stepped: Callable[[float, float], float] | None = None
    pose: Callable[[World, Array, float], Array] | None = None
    twist: Callable[[World, Array, float], Array] | None = None
    contacts: Callable[[World, Contacts, float], Contacts] | None = None
    readback: Callable[[World, dict[str, Any], float], dict[str, Any]] | None = None
    record: Callable[[World, Recorded, float], Recorded] | None = None
    settings: Callable[[list[Setting]], list[Setting]] | None = None
    refuses: Callable[[Scene, str | None], str | None] | None = None
    facts: Callable[[EngineFacts], EngineFacts] | None = None
    build: Callable[[Spoilt, Scene, float, dict[str, Any]], tuple[float, dict[str, Any]]] | None = None


@dataclass
class Past:
    """State that an engine with a fault shares between its worlds; a correct one shares none."""

    steps: int = 0
    last: str = ""
    stepped: World | None = None
    kept: list[bytes] = field(default_factory=list)


class Spoilt(Engine):
    """The toy with one fault of ``size``."""

    def __init__(self, fault: Fault, size: float) -> None:
        self.fault, self.size, self.inner, self.past = fault, size, ToyEngine(), Past()
        self.facts = self.fault.facts(self.inner.facts) if self.fault.facts else self.inner.facts
        self.profiles = {profile: self._rule(profile) for profile in self.inner.profiles}

    def _rule(self, profile: str) -> Callable[[Needs, float], list[Setting]]:
        def rule(needs: Needs, dt: float) -> list[Setting]:
            given = self.inner.profiles[profile](needs, dt)
            return self.fault.settings(given) if self.fault.settings else given

        return rule

    def version(self) -> str:
        """Version of the toy."""
        return self.inner.version()

    def refuses(self, scene: Scene, profile: str) -> str | None:
        """The toy's refusals, or those changed by the fault."""
        said = self.inner.refuses(scene, profile)
        return self.fault.refuses(scene, said) if self.fault.refuses else said

    def declares(self, profile: str, needs: Needs, dt: float) -> dict[str, Declared]:
        """No deviations: faults are not declared."""
        return {}

    def build(self, scene: Scene, dt: float, settings: Mapping[str, Any]) -> Simulation:
        """A world with a wrong scene, step or reading."""
        given = dict(settings)
        if self.fault.build:
            dt, given = self.fault.build(self, scene, dt, given)
        told = self.fault.told(scene, self.size) if self.fault.told else scene
        step = self.fault.stepped(dt, self.size) if self.fault.stepped else dt
        if self.refuses(scene, "") and not self.fault.refuses:
            raise EngineError(str(self.refuses(scene, "")))
        return World(self, scene, self.inner.build(told, step, given), dt)


class World(Simulation):
    """One world of an engine with a fault."""

    def __init__(self, engine: Spoilt, scene: Scene, inner: Simulation, dt: float) -> None:
        self.engine, self.scene, self.inner, self.dt = engine, scene, inner, dt
        self.steps, self.at_once, self.interrupted = 0, 1, 0
        # Interrupted: own steps directly after one of another world.
        #: Steps of other worlds of this engine before this one was built, and the scene before it.
        self.born, self.after = engine.past.steps, engine.past.last
        engine.past.last = scene.name
        self.before = inner.pose(), inner.twist(), inner.contacts()

    @property
    def others(self) -> int:
        """Steps of other worlds since this one was built."""
        return self.engine.past.steps - self.born - self.steps

    def advance(self, steps: int) -> None:
        """See `Simulation.advance`."""
        self.at_once = max(self.at_once, steps)
        for _ in range(steps):
            self.before = self.inner.pose(), self.inner.twist(), self.inner.contacts()
            self.inner.advance(1)
            self.interrupted += self.steps > 0 and self.engine.past.stepped is not self
            self.engine.past.stepped = self
            self.steps += 1
            self.engine.past.steps += 1

    def pose(self) -> Array:
        """See `Simulation.pose`."""
        spoil = self.engine.fault.pose
        return spoil(self, self.inner.pose(), self.engine.size) if spoil else self.inner.pose()

    def twist(self) -> Array:
        """See `Simulation.twist`."""
        spoil = self.engine.fault.twist
        return spoil(self, self.inner.twist(), self.engine.size) if spoil else self.inner.twist()

    def contacts(self) -> Contacts:
        """See `Simulation.contacts`."""
        spoil = self.engine.fault.contacts
        return spoil(self, self.inner.contacts(), self.engine.size) if spoil else self.inner.contacts()

    def record(self, samples: int, stride: int, contacts: bool) -> Recorded | None:
        """See `Simulation.record`."""
        from adapters.conformance.worlds import one_by_one

        spoil = self.engine.fault.record
        return spoil(self, one_by_one(self, samples, stride), self.engine.size) if spoil else None

    def readback(self) -> dict[str, Any]:
        """See `Simulation.readback`."""
        spoil = self.engine.fault.readback
        return spoil(self, self.inner.readback(), self.engine.size) if spoil else self.inner.readback()
