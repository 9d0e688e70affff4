"""A solver in any language: a program that answers questions, each in one line of JSON, on its standard streams.

A question is asked when the one before is answered::

    we ask     {"ask": "hello", "id": 1, "protocol": 1}
    it says    {"id": 1, "protocol": 1, "name": "mine", "version": "0.1",
                "facts": {"title": "Mine", "dimensions": [2], "customary_dt": 0.0167,
                          "scheme": {"order": "forces, contacts, position", "position_offset": 1}},
                "profiles": {"plain": {"iterations": {"value": 50, "because": "impulses settle"}}}}
    we ask     {"ask": "refuses", "id": 2, "scene": SCENE, "profile": "plain"}
    it says    {"id": 2, "refuses": null}                or a sentence: "box.shape: discs only"
    we ask     {"ask": "build", "id": 3, "scene": SCENE, "dt": 0.01, "settings": {"iterations": 50}}
    it says    {"id": 3, "pose": [[0, 0, 0], [0, 1, 0]], "twist": [[0, 0, 0], [0, 0, 0]], "contacts": [],
                "readback": {"dt": 0.01, "iterations": 50}}
    we ask     {"ask": "step", "id": 4, "steps": 7}
    it says    {"id": 4, "pose": ..., "twist": ..., "contacts": [{"bodies": [0, 1], "point": [0, 0],
                "normal": [0, 1], "impulse": [0, 0.0981], "gap": -1e-5}]}

SCENE
    ``dimension`` (2 or 3), ``gravity`` [m/s^2], ``bodies`` (numbered from 0), and ``material`` (restitution, friction)
    of all pairs that ``pairs`` does not list by ``bodies``. A body has ``name``, ``shape``, ``mass``, ``inertia``,
    ``motion`` (free, fixed, prescribed), ``pose``, ``twist``, constant ``force`` and ``torque``. A shape has ``type``
    and numbers: disc and sphere ``radius``, box ``half_extents``, half_space ``normal`` and ``offset`` (solid where
    normal . x <= offset; its pose is the origin), others as `adapters.scene.shapes` lists them. SI units; y (2-D) or z
    (3-D) is up; angles turn counter-clockwise. A pose is x, y, angle or x, y, z and a quaternion w, x, y, z, a twist
    the velocity and the spin. A normal points from the first body of a contact to the second; the impulse [N s] of the
    last step acts on the second; a gap < 0 is an overlap.

Rules
    * One answer, one line, with the ``id`` of its question. Numbers as exact as the language writes them.
    * ``build`` makes a world in the place of the one before; ``step`` makes that many steps and reads the world.
    * ``{"id": 3, "error": "iterations: ..."}`` answers any question that cannot be: the case fails with that line.
    * null is "not known": a gap, a vector of a contact or a component. JSON has no NaN: null in a pose or a twist after
      a step means that it is not finite, and the run has diverged.
    * ``name`` is that of the package's entry point. ``--iterations`` replaces the setting of that name.
    * ``facts`` may also have ``precision`` ("single"), ``abilities``, ``roles``, ``quirks``, ``colour``; ``hello`` may
      have ``declares`` (what a profile does otherwise than a scene asks: quantity by profile, with value, band and
      because) and ``expected`` (conformance checks that it fails: check, because, source); ``build`` ``changed``.
    * Standard error is free. The program ends when its input ends.

Whatever else it does, its case fails in one line that begins with the question and names the field: a line that is no
JSON, another shape, a wrong id, NaN, 64 MiB without an end, silence for ten minutes (a case has its own limit), its
death. It runs inside the worker of its case (`adapters.isolation`) and ends with it.
"""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from adapters.checked_engine import CheckedEngine
from adapters.engine import (
    Array,
    Contacts,
    Declared,
    EngineError,
    EngineFacts,
    Expected,
    Quirk,
    Scheme,
    Setting,
    Simulation,
)
from adapters.isolation.foreign import PATIENCE
from adapters.needs import Needs
from adapters.pipe.messages import Built, Hello, Refuses, State, contacts, read, rows, told
from adapters.pipe.process import Process
from adapters.plain import NAME, one_line
from adapters.scene import Scene
from adapters.settings import LARGEST_INT, like, whole

#: Processes without a world, by program and folder: a start takes longer than most cases.
_idle: dict[tuple[Any, ...], list[Process]] = {}


class PipeEngine(CheckedEngine):
    """An engine that is a program; a subclass names it, and may replace what the program says of itself.

    Raises
    ------
    ImportError
        If the program cannot be started.
    EngineError
        If it does not say who it is.
    """

    #: Program and arguments; it runs in the folder of the subclass.
    command: tuple[str, ...]

    def __init__(self) -> None:
        if isinstance(self.command, str):
            raise EngineError(f"command: {one_line(self.command, NAME)!r} must be a tuple: the program, its arguments")
        process = self._taken()
        hello = self._hello = read("hello", Hello, process.ask("hello", PATIENCE, protocol=1))
        said = hello.facts
        self.facts = EngineFacts(
            name=hello.name,
            title=said.title,
            package=hello.name,
            dimensions=frozenset(said.dimensions),
            scheme=Scheme(said.scheme.order, said.scheme.position_offset),
            customary_dt=said.customary_dt,
            quirks=tuple(Quirk(each.what, each.what_we_do, each.source) for each in said.quirks),
            roles=said.roles,
            colour=said.colour or "",
            precision=said.precision,
            abilities=frozenset(said.abilities),
        )
        self.expected = tuple(Expected(each.check, each.because, each.source) for each in hello.expected)
        self.profiles = {
            profile: partial(
                _given, [Setting(name, each.value, each.because, each.source) for name, each in own.items()]
            )
            for profile, own in hello.profiles.items()
        }
        values = {name: each.value for settings in hello.profiles.values() for name, each in settings.items()}
        self.kinds = {
            name: whole(1, LARGEST_INT) if name == "iterations" else like(value) for name, value in values.items()
        }
        self.sources = tuple(path for part in self.command if (path := self.folder / part).is_file())
        self._give_back(process)

    def __reduce__(self) -> tuple[Any, ...]:
        """Another process asks the program itself."""
        return type(self), ()

    @property
    def folder(self) -> Path:
        """Where the program runs."""
        return Path(inspect.getfile(type(self))).resolve().parent

    def version(self) -> str:
        """Version that the program states."""
        return self._hello.version

    def listed(self) -> str:
        """The same: no metadata have it."""
        return self.version()

    def refuses(self, scene: Scene, profile: str) -> str | None:
        """What the program says."""
        process = self._taken()
        answer = read("refuses", Refuses, process.ask("refuses", scene=told(scene), profile=profile))
        self._give_back(process)
        return answer.refuses or super().refuses(scene, profile)

    def declares(self, profile: str, needs: Needs, dt: float) -> dict[str, Declared]:
        """What ``hello`` said of the profile."""
        own = self._hello.declares.get(profile, {})
        return {name: Declared(each.value, each.band, each.because) for name, each in own.items()}

    def simulation(self, scene: Scene, dt: float, settings: Mapping[str, Any]) -> Simulation:
        """A world in a process that has no other."""
        return PipeSimulation(self, self._taken(), scene, dt, settings)

    def _taken(self) -> Process:
        waiting = _idle.setdefault((self.command, self.folder), [])
        while waiting:
            process = waiting.pop()
            if not process.ended():
                return process
            process.close()
        return Process(self.command, self.folder)

    def _give_back(self, process: Process) -> None:
        _idle[self.command, self.folder].append(process)


def _given(settings: list[Setting], needs: Needs, dt: float) -> list[Setting]:
    """Settings that are the same for every scene."""
    return settings


class PipeSimulation(Simulation):
    """The world of one process."""

    def __init__(
        self, engine: PipeEngine, process: Process, scene: Scene, dt: float, settings: Mapping[str, Any]
    ) -> None:
        self._engine, self._process, self._scene = engine, process, scene
        answer = process.ask("build", scene=told(scene), dt=dt, settings=dict(settings))
        built = read("build", Built, answer)
        self._take("build", built)
        for name, told_of in (("pose", self._pose), ("twist", self._twist)):
            for body, number in np.argwhere(np.isnan(told_of)):
                raise EngineError(f"build: {name}.{body}.{number}: null, but the start of a world is known")
        self._readback, self.initial_change = built.readback, tuple(built.changed)

    def _take(self, question: str, state: State) -> None:
        count, planar = len(self._scene.bodies), self._scene.dimension == 2
        self._pose = rows(f"{question}: pose", state.pose, count, 3 if planar else 7)
        self._twist = rows(f"{question}: twist", state.twist, count, 3 if planar else 6)
        self._contacts = contacts(question, state.contacts, self._scene)

    def advance(self, steps: int) -> None:
        """See `Simulation.advance`."""
        self._take("step", read("step", State, self._process.ask("step", steps=steps)))

    def pose(self) -> Array:
        """See `Simulation.pose`."""
        return self._pose

    def twist(self) -> Array:
        """See `Simulation.twist`."""
        return self._twist

    def contacts(self) -> Contacts:
        """See `Simulation.contacts`."""
        return self._contacts

    def readback(self) -> dict[str, Any]:
        """See `Simulation.readback`."""
        return self._readback

    def close(self) -> None:
        """Keep the process for another world."""
        self._engine._give_back(self._process)
