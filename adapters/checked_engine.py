"""Common checks of adapters before a world is made: step, settings and scene."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib import import_module
from importlib.metadata import version
from typing import Any

from adapters.engine import Engine, EngineError, Simulation
from adapters.law.single_precision import without_a_place
from adapters.scene import Scene
from adapters.settings import checked, checked_step


class CheckedEngine(Engine):
    """An engine of one Python package, with the settings of `Engine.kinds` and one class of worlds."""

    #: Name by which the engine is imported.
    module: str
    #: ``simulation(scene, dt, settings)`` makes a world from checked arguments.
    simulation: Callable[[Scene, float, Mapping[str, Any]], Simulation]

    def version(self) -> str:
        """Version of the installed distribution.

        Raises
        ------
        ImportError
            If it cannot be imported.
        """
        import_module(self.module)
        return version(self.facts.package)

    def refuses(self, scene: Scene, profile: str) -> str | None:
        """Refuse masses and moments beyond single precision, if the engine computes in it."""
        return without_a_place(scene) if self.facts.precision == "single" else None

    def checked(self, settings: Mapping[str, Any]) -> dict[str, Any]:
        """Valid settings, as passed to the world.

        Raises
        ------
        EngineError
            Naming the first setting that is unknown, missing or of the wrong kind.
        """
        return checked(self.name, self.kinds, settings)

    def profile_of(self, settings: Mapping[str, Any]) -> str:
        """Name of the profile for `refuses`; empty if it is the same for all."""
        return ""

    def check_settings(self, settings: Mapping[str, Any]) -> None:
        """See `Engine.check_settings`."""
        self.checked(settings)

    def build(self, scene: Scene, dt: float, settings: Mapping[str, Any]) -> Simulation:
        """Make a world; see `Engine.build`.

        Raises
        ------
        EngineError
            For a spatial scene in a planar engine, a refused scene, a bad step or setting.
        """
        if scene.dimension == 3 and 3 not in self.facts.dimensions:
            raise EngineError(f"dimension: {self.name} is planar and cannot run a spatial scene")
        dt, chosen = checked_step(dt), self.checked(settings)
        if reason := self.refusal(scene, self.profile_of(chosen), dt):
            raise EngineError(reason)
        return self.simulation(scene, dt, chosen)
