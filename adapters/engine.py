"""The plugin line: what an engine promises and what a simulation gives back.

An adapter is one final subclass of `Engine` and one of `Simulation`, in the engine's folder
(`adapters.engine_folder`). It translates, refuses what
it cannot honour (`Engine.refuses`), and reads back what the engine now holds. It never approximates in silence,
never sees a scene's truth, and contains no loop over steps: the only one is `adapters.stepping.run`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from adapters.drives import Ability
from adapters.needs import Needs
from adapters.releases import Releases
from adapters.scene import Scene

Array = NDArray[np.float64]


class EngineError(RuntimeError):
    """An engine refused or failed; the message is one line for the row of that cell."""


@dataclass(frozen=True)
class Setting:
    """One parameter of a profile: what it is set to, why, and where that is known from."""

    name: str
    value: Any
    because: str
    source: str = ""


@dataclass(frozen=True)
class Quirk:
    """A habit of an engine that the adapter had to deal with."""

    what: str
    what_we_do: str
    source: str


@dataclass(frozen=True)
class Scheme:
    """In which order an engine moves bodies; the discrete oracle selects on it, never on an engine's name.

    Parameters
    ----------
    order
        Phases of a step, for people.
    position_offset
        Free fall from rest is sampled at ``x(t) + position_offset * g * t * dt / 2`` along gravity: +1 velocity
        first (semi-implicit Euler falls too far), -1 position first (lags behind), 0 second order, 1/n where a step
        is made of n semi-implicit ones.
    """

    order: str
    position_offset: float


@dataclass(frozen=True)
class Expected:
    """A conformance check that an engine is known to fail: which, why, and where that is known from."""

    check: str
    because: str
    source: str


@dataclass(frozen=True)
class Declared:
    """What a profile claims to realise on a probe: a value and the band it may lie in (same unit)."""

    value: float
    band: float
    because: str = ""


def _vectors(told: Sequence[Any], dimension: int) -> Array:
    """Rows (k, d) of vectors; a number stands for a vector of it, as NaN does for an impulse that is not told.

    Raises
    ------
    ValueError
        For a vector of another dimension.
    """
    try:
        found = np.array(told, float)
    except ValueError:  # some are numbers
        found = np.zeros(0)
    if found.shape != (len(told), dimension):
        found = np.array([np.broadcast_to(np.asarray(each, float), (dimension,)) for each in told])
    return found


#: A contact as adapters tell it: bodies by index, point, normal from the first to the second, impulse on that one, gap.
Row = tuple[int, int, Any, Any, Any, float]


@dataclass(frozen=True)
class Contacts:
    """Contacts of one instant as arrays over k contacts; NaN where the engine does not say.

    ``a``, ``b``: body indices of the scene (k,); ``point``, ``normal`` (from a to b), ``impulse`` on b of the
    last step in world axes [N s]: (k, d); ``gap`` [m], < 0 is overlap: (k,).
    """

    a: NDArray[np.int64]
    b: NDArray[np.int64]
    point: Array
    normal: Array
    impulse: Array
    gap: Array

    @classmethod
    def from_rows(cls, rows: Sequence[Row], dimension: int) -> Contacts:
        """Build from rows in their order; pairs are turned so that a < b."""
        if not rows:
            none, nowhere = np.zeros(0, np.int64), np.zeros((0, dimension))
            return cls(none, none.copy(), nowhere, nowhere.copy(), nowhere.copy(), np.zeros(0))
        first, second, points, normals, impulses, gaps = zip(*rows, strict=True)
        i, j = np.array(first, np.int64), np.array(second, np.int64)
        sign = np.where(i < j, 1.0, -1.0)[:, None]
        a, b, gap = np.minimum(i, j), np.maximum(i, j), np.array(gaps, float)
        point, normal, impulse = (_vectors(told, dimension) for told in (points, normals, impulses))
        return cls(a, b, point, sign * normal, sign * impulse, gap)

    @classmethod
    def by_pair(cls, rows: Iterable[Row], dimension: int) -> Contacts:
        """Build from rows, sorted by pair; those of a pair stay in their order."""
        return cls.from_rows(sorted(rows, key=lambda row: (min(row[:2]), max(row[:2]))), dimension)


@dataclass(frozen=True)
class Recorded:
    """States of a stretch of a run, one after another.

    Parameters
    ----------
    pose, twist
        (s, n, 3 | 7) and (s, n, 3 | 6), as `Simulation.pose` and `Simulation.twist` tell each of them.
    counts
        (s,) how many contacts belong to each.
    contacts
        Those of all, in that order; None where they were not asked for.
    """

    pose: Array
    twist: Array
    counts: NDArray[np.int64]
    contacts: Contacts | None = None


class Simulation(ABC):
    """One built world. Built fresh for every run, never reset. What is missing is an error, not a zero."""

    #: What the adapter had to change in the scene's start state, in words; shown beside the result.
    initial_change: tuple[str, ...] = ()

    @abstractmethod
    def advance(self, steps: int) -> None:
        """Make ``steps`` steps of the dt given to `Engine.build`."""

    @abstractmethod
    def pose(self) -> Array:
        """Poses of all bodies in the scene's order, (n, 3) planar or (n, 7) spatial, at this instant."""

    @abstractmethod
    def twist(self) -> Array:
        """Twists of all bodies, (n, 3) or (n, 6), as the engine reports them at this instant."""

    @abstractmethod
    def contacts(self) -> Contacts:
        """Contacts with the impulses of the last step made."""

    def record(self, samples: int, stride: int, contacts: bool) -> Recorded | None:
        """Make ``samples`` times ``stride`` steps and tell the state after each ``stride`` of them, or None: make none.

        For engines that can do so without a call per step. It must be, bit for bit, what `advance` and the readers tell
        sample after sample.
        """
        return None

    @abstractmethod
    def readback(self) -> dict[str, Any]:
        """What the engine now holds (masses, materials, dt, solver settings), read from the engine."""

    def certificate(self) -> dict[str, Any]:
        """How well the answers solve their own equations; empty where an engine does not say.

        Where a profile promises a solution, ``certified`` says whether it was found and ``reasons`` why not: a run
        that is not certified is INVALID, and so never a truth nor a partner of comparison.
        """
        return {}

    def close(self) -> None:  # noqa: B027  (most engines hold nothing that needs closing)
        """Release what the engine holds."""


ProfileRule = Callable[[Needs, float], list[Setting]]
#: ``write(scene, dt, settings, steps)``: the run of so many steps of a scene, as a text that needs the engine alone.
#: `Engine.check_settings` has let the settings pass.
Writer = Callable[[Scene, float, Mapping[str, Any], int], str]


#: What a profile is among those of its engine. Comparisons and marks select on it, never on a profile's name.
Role = Literal["shipped", "textbook", "tuned", "one", "solution", "matched"]
ROLES: Mapping[Role, str] = {
    "shipped": "what a user gets without changing anything",
    "textbook": "a textbook's method at a fixed cost",
    "tuned": "best stock settings, chosen by what a scene needs",
    "one": "one set of stock settings for all scenes",
    "solution": "solves its contact problem and reports whether it did; a failure is a defect",
    "matched": "the textbook law instead of the engine's own, by a loop around its solver. This is not the engine's "
    "contact model, so it is not ranked",
}
#: Roles of profiles that are asked and shown, but neither compared nor recommended: nobody gets them by settings.
UNRANKED: frozenset[Role] = frozenset({"matched"})
Precision = Literal["double", "single"]
#: Name of the profile in the rows of an engine that cannot be asked for its own.
NOT_KNOWN = "?"


@dataclass(frozen=True)
class EngineFacts:
    """Constant facts of an engine, shown by ``crosscheck describe`` and in the fairness sheet."""

    name: str
    title: str
    package: str
    dimensions: frozenset[int]
    scheme: Scheme
    customary_dt: float
    quirks: tuple[Quirk, ...] = ()
    known_bad_versions: Mapping[str, str] = field(default_factory=dict)
    #: Profiles that step differently, by name.
    profile_schemes: Mapping[str, Scheme] = field(default_factory=dict)
    #: What the profiles are, by name; one that is none of these has no role.
    roles: Mapping[str, Role] = field(default_factory=dict)
    #: Colour of the engine in pictures, ``#rrggbb``; reports choose one where it is empty.
    colour: str = ""
    #: Numbers that the engine computes with.
    precision: Precision = "double"
    #: Whether an extra of its own alone installs it: a run that names no engine leaves it out where it is not there.
    apart: bool = False
    #: What the adapter honours beyond discs, balls, boxes and half-spaces that are fixed. A scene that asks for more is
    #: UNSUPPORTED before the adapter sees it.
    abilities: frozenset[Ability] = frozenset()

    @property
    def epsilon(self) -> float:
        """Distance from 1 to the next number that the engine knows."""
        return 2.0**-52 if self.precision == "double" else 2.0**-23

    @property
    def round_off(self) -> float:
        """What a number of order 10 may be off after some tens of steps, or a quaternion's root and product.

        A hundred roundings of single numbers; of double ones far more, since nothing near it is of interest.
        """
        return 1e-9 if self.precision == "double" else 1e3 * self.epsilon

    def profile(self, role: Role) -> str | None:
        """Name of the profile with this role, if there is one."""
        return next((name for name, own in self.roles.items() if own == role), None)


class Engine(ABC):
    """A physics engine behind the plugin line; subclasses are final and hold no state."""

    facts: EngineFacts
    #: Profile name -> rule that chooses the settings from a scene's needs and the step.
    profiles: Mapping[str, ProfileRule]
    #: What the adapter knows of other releases; None: nothing, its package is the only distribution.
    releases: Releases | None = None
    #: Settings that a user may set beside a profile's own, by name, with what each must be (`adapters.settings`).
    kinds: Mapping[str, Callable[[Any], str]] = MappingProxyType({})
    #: Conformance checks that it is known to fail.
    expected: tuple[Expected, ...] = ()
    #: What a run can be written as for the engine alone, by the name of the format (``crosscheck export --to``). The
    #: scene has a dimension the engine knows; what a format has no word for is an `EngineError`.
    exports: Mapping[str, Writer] = MappingProxyType({})
    #: Readers of models that people have for this engine, by the ending of their files (`adapters.model`).
    reads: Mapping[str, Callable[[str, bool], Any]] = MappingProxyType({})

    @property
    def name(self) -> str:
        """Short name used on the command line."""
        return self.facts.name

    def scheme(self, profile: str) -> Scheme:
        """How ``profile`` moves bodies."""
        return self.facts.profile_schemes.get(profile, self.facts.scheme)

    @abstractmethod
    def version(self) -> str:
        """Version of the engine that is installed."""

    @abstractmethod
    def refuses(self, scene: Scene, profile: str) -> str | None:
        """Why this engine cannot honour ``scene``, or None; the scene has a dimension the engine knows."""

    def too_coarse(self, scene: Scene, dt: float) -> str | None:
        """Why steps of ``dt`` [s] are too long for ``scene`` here, or None; of a scene that is not refused."""
        return None

    def refusal(self, scene: Scene, profile: str, dt: float) -> str | None:
        """Why this engine cannot run ``scene`` in steps of ``dt`` [s], or None: such a cell is UNSUPPORTED."""
        return self.refuses(scene, profile) or self.too_coarse(scene, dt)

    def settable(self) -> Mapping[str, Callable[[Any], str]]:
        """`kinds` of the release that is installed."""
        return self.kinds

    def check_settings(self, settings: Mapping[str, Any]) -> None:  # noqa: B027  (`build` checks them in any case)
        """Refuse settings that `build` would refuse, whatever the scene is, before anything runs.

        Raises
        ------
        EngineError
            Naming the setting.
        """

    @abstractmethod
    def build(self, scene: Scene, dt: float, settings: Mapping[str, Any]) -> Simulation:
        """Make a world; ``settings`` holds every setting of the profile by name, ``iterations`` included."""

    @abstractmethod
    def declares(self, profile: str, needs: Needs, dt: float) -> dict[str, Declared]:
        """What the profile realises on the probes where that differs from what a scene asks for.

        Keys are names of `adapters.receipts.QUANTITIES`; what is absent is declared to be as asked.
        """

    def certify(
        self, scene: Scene, dt: float, settings: Mapping[str, Any], steps: int, final_pose: Array
    ) -> dict[str, Any] | None:
        """Certify the run of ``steps`` steps that ended in ``final_pose`` independently; None where nothing can.

        The dictionary has ``holds``, ``reasons`` and whatever numbers stand behind them.
        """
        return None

    def kernels(self) -> Path | None:
        """Folder that keeps machine code which this engine compiles at its first steps; None if it compiles nothing."""
        return None

    def snippet(self, settings: Mapping[str, Any], names: Collection[str], scene: Scene, dt: float) -> str:
        """Settings ``names`` of ``settings`` in the engine's own language, as a user would paste them.

        Numbers are those of step ``dt`` [s] and of the scene's materials. Where one is made of the restitution e, the
        step or gravity, its formula stands in a comment beside it, with ``dt`` and ``g`` and ``e`` for them. Where
        pairs of different materials need different lines, each material has its own. Empty where an adapter knows no
        such lines.
        """
        return ""

    def words(self, settings: Mapping[str, Any], scene: Scene, dt: float) -> dict[str, tuple[str, Any]]:
        """What the engine itself calls settings: by our name its own name, and the value or the formula in its words.

        A setting that is not among them has one name for both. An empty name: the setting is told with another one.
        """
        return {}

    def settings(self, profile: str, needs: Needs, dt: float, iterations: int | None = None) -> list[Setting]:
        """Settings of ``profile``; ``iterations`` replaces the profile's own count.

        Raises
        ------
        EngineError
            For an unknown profile, or if the profile has no iteration count to replace.
        """
        if profile not in self.profiles:
            raise EngineError(f"profile: {self.name} has no profile {profile!r}, only {', '.join(self.profiles)}")
        settings = self.profiles[profile](needs, dt)
        if iterations is None:
            return settings
        asked = Setting("iterations", iterations, "asked for by --iterations")
        if not any(setting.name == "iterations" for setting in settings):
            raise EngineError(f"iterations: {self.name}/{profile} does not stop at an iteration count")
        return [asked if setting.name == "iterations" else setting for setting in settings]
