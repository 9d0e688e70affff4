"""The plugin interface: what an engine declares, and what a simulation returns.

An adapter is one final subclass of `Engine` and one of `Simulation`, in the engine's folder (`adapters.engine_folder`).
It translates scenes, refuses those that the engine cannot represent (`Engine.refuses`), and reads back what the engine
holds. It never approximates in silence, has no access to a scene's truth, and contains no loop over steps: the only one
is `adapters.stepping.run`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from importlib.metadata import version
from itertools import pairwise
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from adapters.needs import Needs
from adapters.releases import Releases
from adapters.scene import Scene
from adapters.scene.drives import Ability

Array = NDArray[np.float64]


class EngineError(RuntimeError):
    """An engine refused or failed; the message is one line for the row of that cell."""


@dataclass(frozen=True)
class Setting:
    """One parameter of a profile: its value, the reason and the source."""

    name: str
    value: Any
    because: str
    source: str = ""


@dataclass(frozen=True)
class Quirk:
    """A peculiarity of an engine, and how the adapter handles it."""

    what: str
    what_we_do: str
    source: str


@dataclass(frozen=True)
class Scheme:
    """Order in which an engine updates bodies; predictions select by it, never by an engine's name.

    Parameters
    ----------
    order
        Phases of a step, for people.
    position_offset
        Free fall from rest is sampled at ``x(t) + position_offset * g * t * dt / 2`` along gravity: +1 velocity first
        (semi-implicit Euler falls too far), -1 position first (lags behind), 0 second order, 1/n where a step consists
        of n semi-implicit ones.
    """

    order: str
    position_offset: float


@dataclass(frozen=True)
class Expected:
    """A conformance check that an engine is known to fail: name, reason and source; ``profile``: in that one alone."""

    check: str
    because: str
    source: str
    profile: str = ""


@dataclass(frozen=True)
class Declared:
    """What a profile is declared to realise on a probe: a value and its band (same unit)."""

    value: float
    band: float
    because: str = ""

    @classmethod
    def over(cls, values: Sequence[float], left: float, because: str) -> Declared:
        """Any of these values at phases of a step, in order; ``left`` is added to the band.

        Between two phases the value changes by no more than between neighbouring ones.
        """
        steepest = max(abs(x - y) for x, y in pairwise(values))
        low, high = min(values), max(values)
        return cls(0.5 * (high + low), 0.5 * (high - low) + steepest + left, because)


def _vectors(told: Sequence[Any], dimension: int) -> Array:
    """Rows (k, d) of vectors; a number is repeated for all components, such as NaN for an unreported impulse.

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


#: A contact of an adapter: bodies by index, point, normal from the first to the second, impulse on that one, gap.
Row = tuple[int, int, Any, Any, Any, float]


@dataclass(frozen=True)
class Contacts:
    """Contacts of one instant as arrays over k contacts; NaN where the engine reports nothing.

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
        point, normal, impulse = (_vectors(told, dimension) for told in (points, normals, impulses))
        return cls.turned(np.array(first, np.int64), np.array(second, np.int64), point, normal, impulse, np.array(gaps))

    @classmethod
    def turned(
        cls, i: NDArray[np.int64], j: NDArray[np.int64], point: Array, normal: Array, impulse: Array, gap: Array
    ) -> Contacts:
        """Turn pairs so that a < b; normals point from ``i`` to ``j``, impulses are on ``j``."""
        sign = np.where(i < j, 1.0, -1.0)[:, None]
        return cls(np.minimum(i, j), np.maximum(i, j), point, sign * normal, sign * impulse, np.asarray(gap, float))


@dataclass(frozen=True)
class Recorded:
    """Successive states of a part of a run.

    Parameters
    ----------
    pose, twist
        (s, n, 3 | 7) and (s, n, 3 | 6), as from `Simulation.pose` and `Simulation.twist`.
    counts
        (s,) number of contacts of each.
    contacts
        Contacts of all, in that order; None where not requested.
    """

    pose: Array
    twist: Array
    counts: NDArray[np.int64]
    contacts: Contacts | None = None


class Simulation(ABC):
    """One world, built anew for every run and never reset. A missing value is an error, not a zero."""

    #: Changes of the scene's start state by the adapter, in words; shown beside the result.
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
        """Make ``samples`` times ``stride`` steps, a state after each ``stride``; None, without a step: not supported.

        For engines whose states are read faster many at once (`adapters.copied` does that for most). The result must
        equal that of `advance` and the readers, bit for bit.
        """
        return None

    @abstractmethod
    def readback(self) -> dict[str, Any]:
        """Values read from the engine: masses, materials, dt, solver settings."""

    def certificate(self) -> dict[str, Any]:
        """How well the results satisfy the engine's equations; empty where it does not report that.

        For an exact profile ``certified`` says whether the solution was found, and ``reasons`` why not. A run that is
        not certified is REFUSED: it is no truth and takes part in no comparison.
        """
        return {}

    def close(self) -> None:  # noqa: B027  (most engines hold nothing that needs closing)
        """Release the engine's resources."""


ProfileRule = Callable[[Needs, float], list[Setting]]
#: ``write(scene, dt, settings, steps)``: the run of a scene as a text that needs the engine only.
#: The settings have passed `Engine.check_settings`.
Writer = Callable[[Scene, float, Mapping[str, Any], int], str]


#: Role of a profile. Comparisons and marks select by role, never by a profile's name.
Role = Literal["shipped", "textbook", "tuned", "one", "solution", "matched"]
ROLES: Mapping[Role, str] = {
    "shipped": "the engine's own settings",
    "textbook": "a textbook's method at a fixed cost",
    "tuned": "best stock settings, chosen by what a scene needs",
    "one": "one set of stock settings for all scenes",
    "solution": "solves its contact problem and reports whether it did; a failure is a defect",
    "matched": "the textbook law instead of the engine's own, by a loop around its solver. This is not the engine's "
    "contact model, so it is not ranked",
}
#: Roles of profiles that run and are shown, but neither compared nor recommended: settings alone do not give them.
UNRANKED: frozenset[Role] = frozenset({"matched"})
Precision = Literal["double", "single"]
#: Name of the profile in the rows of an engine whose profiles are unknown.
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
    #: Schemes of profiles with another scheme, by name.
    profile_schemes: Mapping[str, Scheme] = field(default_factory=dict)
    #: Roles of profiles, by name; others have no role.
    roles: Mapping[str, Role] = field(default_factory=dict)
    #: Colour of the engine in pictures, ``#rrggbb``; reports choose one where it is empty.
    colour: str = ""
    #: Numbers that the engine computes with.
    precision: Precision = "double"
    #: Whether the engine is optional: only its own extra installs it, and a run without --engine leaves it out if
    #: missing.
    apart: bool = False
    #: What the adapter supports beyond discs, balls, boxes and fixed half-spaces. A scene that needs more is
    #: UNSUPPORTED before it reaches the adapter.
    abilities: frozenset[Ability] = frozenset()
    #: Name of the engine of which this one is a port: the same models and settings, steps of its own.
    port_of: str = ""

    @property
    def epsilon(self) -> float:
        """Distance from 1 to the next number of the engine's precision."""
        return 2.0**-52 if self.precision == "double" else 2.0**-23

    @property
    def round_off(self) -> float:
        """Error of a number of order 10 after some tens of steps, or of a quaternion's root and product.

        A hundred roundings in single precision; far more in double precision, where such errors do not matter.
        """
        return 1e-9 if self.precision == "double" else 1e3 * self.epsilon

    def profile(self, role: Role) -> str | None:
        """Name of the profile with this role, if there is one."""
        return next((name for name, own in self.roles.items() if own == role), None)


class Engine(ABC):
    """A physics engine; subclasses are final and have no state."""

    facts: EngineFacts
    #: Profile name -> rule that gives the settings for a scene's needs and the step.
    profiles: Mapping[str, ProfileRule]
    #: Most bodies of a scene that the engine is meant for; a plan with a larger one says so. None: no such limit.
    most_bodies: int | None = None
    #: Other releases that the adapter supports; None: only the installed package.
    releases: Releases | None = None
    #: Further settings that a user may change, by name, with a check of each (`adapters.settings`).
    kinds: Mapping[str, Callable[[Any], str]] = MappingProxyType({})
    #: Settings that an earlier version had, by name, with what takes their place.
    former: Mapping[str, str] = MappingProxyType({})
    #: Conformance checks that the engine is known to fail.
    expected: tuple[Expected, ...] = ()
    #: Writers of a run for the engine alone, by format (``crosscheck export --to``). The scene has a dimension of the
    #: engine; what a format cannot express raises `EngineError`.
    exports: Mapping[str, Writer] = MappingProxyType({})
    #: Of a port: causes by which its motion may differ from the original's, with settings that remove them from both.
    switches: Mapping[str, Mapping[str, Any]] = MappingProxyType({})
    #: Files other than Python modules that its results depend on, such as a program that it starts.
    sources: tuple[Path, ...] = ()
    #: Readers of model files of this engine, by file ending (`adapters.model`).
    reads: Mapping[str, Callable[[str, bool], Any]] = MappingProxyType({})

    @property
    def name(self) -> str:
        """Short name used on the command line."""
        return self.facts.name

    def scheme(self, profile: str) -> Scheme:
        """Scheme of ``profile``."""
        return self.facts.profile_schemes.get(profile, self.facts.scheme)

    @abstractmethod
    def version(self) -> str:
        """Version of the engine that is installed.

        Raises
        ------
        ImportError
            If it cannot be imported.
        """

    def listed(self) -> str:
        """Version by the metadata of the engine's package: nothing is imported, which takes seconds for some engines.

        Raises
        ------
        ImportError
            If the package is not installed.
        """
        return version(self.facts.package)

    @abstractmethod
    def refuses(self, scene: Scene, profile: str) -> str | None:
        """Why this engine cannot represent ``scene``, or None; the scene has a dimension of the engine."""

    def too_coarse(self, scene: Scene, dt: float) -> str | None:
        """Why steps of ``dt`` [s] are too long for ``scene``, or None; the scene is not refused."""
        return None

    def refusal(self, scene: Scene, profile: str, dt: float) -> str | None:
        """Why this engine cannot run ``scene`` in steps of ``dt`` [s], or None: such a cell is UNSUPPORTED."""
        return self.refuses(scene, profile) or self.too_coarse(scene, dt)

    def settable(self) -> Mapping[str, Callable[[Any], str]]:
        """`kinds` of the installed release."""
        return self.kinds

    def check_settings(self, settings: Mapping[str, Any]) -> None:  # noqa: B027  (`build` checks them in any case)
        """Refuse settings that `build` would refuse for every scene, before anything runs.

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
        """What the profile realises on the probes, where that differs from the scene's values.

        Keys are names of `adapters.receipts.QUANTITIES`; absent ones are declared to equal the scene's values.
        """

    def certify(
        self,
        scene: Scene,
        dt: float,
        settings: Mapping[str, Any],
        steps: int,
        final_pose: Array,
        others: Sequence[Array] = (),
    ) -> dict[str, Any] | None:
        """Certify independently the run of ``steps`` steps that ended in ``final_pose``; None if the engine cannot.

        ``others``: poses after each step of the runs `at_other_tolerances`, where these are known. The dictionary has
        ``holds``, ``reasons`` and the numbers behind them.
        """
        return None

    def at_other_tolerances(
        self, settings: Mapping[str, Any], certificate: Mapping[str, Any]
    ) -> list[Mapping[str, Any]]:
        """Settings of a run with this light ``certificate``, to other tolerances: what differs there tells its error.

        Empty if the tolerance had no part in the run.
        """
        return []

    def kernels(self) -> Path | None:
        """Folder of machine code that this engine compiles at its first steps; None if it compiles nothing.

        It is another one for other sources. What is compiled may depend on the profile, the dimension and the scene:
        the first steps of all scenes of a plan compile it.
        """
        return None

    def snippet(self, settings: Mapping[str, Any], names: Collection[str], scene: Scene, dt: float) -> str:
        """Settings ``names`` of ``settings`` in the engine's own language, for pasting.

        Numbers are for step ``dt`` [s] and the scene's materials. A number that depends on restitution e, step or
        gravity has its formula in a comment beside it, with ``e``, ``dt`` and ``g``. Pairs of different materials have
        their own lines where these differ. Empty where an adapter has no such lines.
        """
        return ""

    def words(self, settings: Mapping[str, Any], scene: Scene, dt: float) -> dict[str, tuple[str, Any]]:
        """The engine's own terms for settings: our name -> the engine's name, and the value or formula in its terms.

        Settings that are missing have the same name in both. An empty name: another setting includes this one.
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
