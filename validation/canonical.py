"""A canonical scene: everything about one scene, in one object, from one file.

    figure and law        what the scene shows
    parameters, make      the scene itself
    exact, measure, rule  its truth, the measurements of a run, and the tolerance between them
    quick, standard, full the cells that a suite runs
    primary, steps        the error by which a benchmark compares engines, and its time steps
    the rest              facts for reports, tuning and fault detection

A canonical scene does not depend on engines. Bounds that several scenes share are in `validation.bounds`, metrics in
`validation.metrics`. `validation.catalogue` finds the scenes.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

from adapters.engine import Setting
from adapters.scene import Scene, SceneError
from adapters.trajectory import Measured, Sampling, Trajectory

#: Standard gravity as the field's examples use it [m/s^2].
GRAVITY = 9.81


@dataclass(frozen=True)
class Parameter:
    """A parameter of a scene.

    Parameters
    ----------
    default, unit
        Used where a call does not set it; shown by ``crosscheck describe``.
    because
        Meaning, and the reason for the default.
    low, high
        Closed range of physical values.
    integer
        Whether only whole numbers make sense.
    positive
        Whether ``low`` itself is excluded.
    """

    name: str
    default: float
    unit: str
    because: str
    low: float = -math.inf
    high: float = math.inf
    integer: bool = False
    positive: bool = False

    def check(self, scene: str, value: float) -> float:
        """Return ``value`` as a number of this parameter.

        Raises
        ------
        SceneError
            Naming scene and parameter, if it is not finite, out of range, or not whole where it must be.
        """
        label = f"{scene}.{self.name}"
        if not math.isfinite(value):
            raise SceneError(f"{label}: {value!r} is not a finite number")
        if value < self.low or value > self.high or (self.positive and value == self.low):
            raise SceneError(
                f"{label}: {value:g} must lie in {'(' if self.positive else '['}{self.low:g}, {self.high:g}]"
            )
        if self.integer and value != int(value):
            raise SceneError(f"{label}: {value:g} must be a whole number")
        return float(value)


@dataclass(frozen=True)
class Check:
    """One judged number: PASS if |value - truth| <= bound; shown but not judged if there is no truth."""

    metric: str
    unit: str
    truth: float | None
    bound: float | None
    because: str
    source: str

    @property
    def is_finite(self) -> bool:
        """Whether truth and bound, where they exist, are finite."""
        return all(number is None or math.isfinite(number) for number in (self.truth, self.bound))

    def unjudged(self) -> Check:
        """The same number, shown and not judged: its scene is too large for a tolerance."""
        return Check(self.metric, self.unit, None, None, f"not judged, its tolerance is not finite; {self.because}", "")


@dataclass(frozen=True)
class Track:
    """Exact state of one body over time, where a closed form exists: ``height(t)`` or position along x."""

    body: str
    position: Callable[[float], tuple[float, ...]]


#: Families of scenes in the order in which they are shown; others follow by name.
FAMILIES = (
    "rebound", "materials", "grip and force", "stacks and statics", "friction", "turning", "many impacts", "hard",
)  # fmt: skip

#: A few cells a scene; those and others whose known failures are listed check by check; those that map a scene out.
Suite = Literal["quick", "standard", "full"]
SUITES: tuple[Suite, ...] = ("quick", "standard", "full")
#: Parameters of a cell, as what differs from the scene's defaults.
Params = Mapping[str, float]


@dataclass(frozen=True)
class Variation:
    """Parameters of a cell, and the iteration counts to run it at (None: the profile's own).

    ``dimensions`` are those in which the cell runs; empty for all of the scene's.
    """

    params: Params
    iterations: tuple[int | None, ...] = (None,)
    dimensions: tuple[int, ...] = ()

    def runs_in(self, dimension: int) -> bool:
        """Whether the cell is meant in this dimension."""
        return not self.dimensions or dimension in self.dimensions


@dataclass(frozen=True)
class Primary:
    """The one declared error of a scene, and the state in which the scene is timed.

    A work-precision plot shows one number per run of an engine. It is declared with the scene, before any measurement,
    and is a supremum over variations that an engine cannot choose: the phase of an impact within a step, the side of a
    threshold.

    Parameters
    ----------
    name, unit
        For axes.
    law
        What is measured, in one line.
    because
        Why this quantity was chosen.
    variations
        ``variations(dt)``: parameters of the cells whose worst error counts; the first one is timed.
    error
        ``error(scene, dt, metrics)`` of one cell, or None and why.
    state
        The state that is timed, in words.
    warm_up, window
        Simulated seconds before the timed call and within it; a window of None is the whole scene.
    order
        Order in the step at which the error of a correct first-order method falls at least, as its bounds do; 0: laws
        of momentum alone decide, and the error is round-off. Scenes with an order are the core suite
        (`validation.questions.core`).
    """

    name: str
    unit: str
    law: str
    because: str
    variations: Callable[[float], list[dict[str, float]]]
    error: Callable[[Scene, float, Mapping[str, Measured]], Measured]
    state: str
    warm_up: float = 0.0
    window: float | None = None
    order: int | None = None


def halves(first: float, last: float) -> tuple[float, ...]:
    """Steps [s] from a rate of ``first`` [1/s] by halves to one of at least ``last``."""
    rates = [first]
    while rates[-1] < last:
        rates.append(2.0 * rates[-1])
    return tuple(1.0 / rate for rate in rates)


#: Steps [s] of a quick benchmark of a scene that states none, and is named.
NAMED = (1.0 / 60.0, 1.0 / 240.0, 1.0 / 960.0)


@dataclass(frozen=True)
class Steps:
    """Steps [s] of a benchmark of a scene, and iteration counts beside each profile's own, by suite.

    A scene without quick steps runs in the full benchmark, or where it is named. Cases at 1/240 s that the quick suite
    of verdicts has are not run again: a dozen scenes with quick steps have almost all of theirs there.
    """

    quick: tuple[float, ...] = ()
    full: tuple[float, ...] = halves(30.0, 1920.0)
    quick_iterations: tuple[int, ...] = ()
    full_iterations: tuple[int, ...] = ()

    def dts(self, suite: Suite) -> tuple[float, ...]:
        """Steps of a suite [s]; `NAMED` where a scene has no quick ones."""
        return (self.quick or NAMED) if suite == "quick" else self.full

    def counts(self, suite: Suite) -> tuple[int, ...]:
        """Iteration counts of a suite."""
        return self.quick_iterations if suite == "quick" else self.full_iterations


@dataclass(frozen=True)
class Member:
    """A cell that ran, as given to a study: complete ``params`` and measured ``metrics``."""

    dimension: int
    dt: float
    params: Params
    metrics: Mapping[str, Measured]


#: Result of a study: value, reason, and the check that judges it.
Reduced = tuple[float | None, str, Check]


@dataclass(frozen=True)
class Study:
    """A result of several cells of a scene together: a threshold, a supremum.

    Parameters
    ----------
    name
        Of its metric.
    reduce
        ``reduce(members)`` of cells that differ in parameters only; None if there is no result.
    """

    name: str
    reduce: Callable[[Sequence[Member]], Reduced | None]


@dataclass(frozen=True)
class Searched:
    """What tuning runs of a scene (`validation.settings.tuning`).

    Parameters
    ----------
    group
        Scenes with like needs are searched together: a profile has one set of settings for them.
    cells, held_out
        Parameters of the search, and those on which no check may get worse.
    starved
        Iteration counts at which no check that passed may fail, for profiles with such a count.
    """

    group: str
    cells: tuple[Params, ...]
    held_out: tuple[Params, ...] = ()
    starved: tuple[int, ...] = ()


@dataclass(frozen=True)
class Restitution:
    """A metric that shows the restitution an engine realises, for the report's explorer.

    Parameters
    ----------
    metric
        Its name; of a series (``apex``) the name before the index.
    asked
        Parameter with the coefficient that is asked for.
    scale
        Parameter to which the metric is relative, or on which it may depend: a height, a speed.
    heights
        Number of heights in the series; 0 if the metric is the ratio of speeds.
    """

    metric: str
    asked: str
    scale: str
    heights: int = 0


@dataclass(frozen=True)
class Frontier:
    """A parameter that is driven until an engine fails (`validation.questions.frontier`).

    Parameters
    ----------
    name, unit
        Its name for people: ``impact speed`` in m/s.
    axis
        The scene's parameter, or ``dt``, or ``iterations``.
    easy, hard, hardest
        Range of the quick search, and the end of the full one. Hard may be below easy.
    fate
        ``fate(scene, metrics)`` of a cell that ran: how it failed, as one word, or empty if it survived. It tests
        whether the engine still does what the scene is about, with a wide margin, not whether it is exact.
    survives
        The criterion of survival, with its numbers.
    params
        Other parameters, as what differs from the scene's defaults.
    whole
        Whether only whole numbers make sense.
    """

    name: str
    unit: str
    axis: str
    easy: float
    hard: float
    hardest: float
    fate: Callable[[Scene, Mapping[str, Measured]], str]
    survives: str
    params: Params = field(default_factory=dict)
    whole: bool = False


@dataclass(frozen=True)
class Brought:
    """A profile that a scene brings for an engine: its settings are those of a model made for that engine.

    It declares nothing, so no property check runs before it; ``dt`` is the model's own step [s].
    """

    profile: str
    dt: float
    settings: tuple[Setting, ...]


@dataclass(frozen=True, kw_only=True)
class CanonicalScene:
    """A scene of the catalogue; see the module's docstring.

    Parameters
    ----------
    name, version, title
        Identity; a change of physics is a new version.
    symptoms
        What users see where an engine fails, in their words, at least eight; ``crosscheck ask`` searches them.
    figure
        ASCII drawing with the law.
    law
        The truth in one line, for reports.
    dimensions
        Dimensions it exists in.
    parameters
        All of them, in display order.
    make
        ``make(dimension, params) -> Scene``.
    exact
        ``exact(scene) -> {metric: truth}``, from the scene alone.
    measure
        ``measure(scene, trajectory) -> {metric: (value, reason)}``.
    rule
        ``rule(scene, dt, truth) -> [Check]``: the stated tolerances.
    sampling
        What has to be recorded.
    track
        Exact motion for the replay's ghost, or None.
    family
        Its group: one of `FAMILIES`, or another name.
    quick, standard, full
        Cells of the suites. Quick: a few, which cover every kind of result. Standard: those whose known failures are
        listed check by check. Full: a map of the parameters, possibly without the defaults. A suite without cells uses
        those of the suite before.
    representative
        The cell that represents the scene: its noise floor is measured, and its motion is kept for the replay.
    planted
        Cells in which faults are planted (`validation.questions.detection`): together they have every check.
    primary, steps
        The error by which a benchmark compares engines, and its runs.
    size
        Parameter that sets the number of bodies, where a benchmark may increase it.
    growth
        Factor by which an unstable motion amplifies a deviation from its line or plane, and so round-off
        (`bounds.planar`).
    smooth
        Metrics that depend smoothly on the step, without an impact: one cell a step is enough to fit an order.
    studies
        Results of several of its cells together.
    searched
        What tuning runs of it.
    frontiers
        How far it can be driven.
    words
        Meaning of a metric's value, in words with ``{value}``, where `metrics.WORDS` has none; names without index.
        ``"rebound_ratio=0"`` is for the value 0.
    seen_as
        For metrics that people know as another number: ``seen_as[metric](params, value)`` is that ratio.
    restitution
        Its data for the report's explorer of restitution.
    notes
        What was filled in or corrected in a scene from a file, one line each; shown where it runs or is described.
    brings
        Profiles of its own, by engine: a model made for an engine runs there with its own settings.
    """

    name: str
    version: int
    title: str
    figure: str
    law: str
    dimensions: tuple[int, ...]
    parameters: tuple[Parameter, ...]
    make: Callable[[int, Params], Scene]
    exact: Callable[[Scene], dict[str, float]]
    measure: Callable[[Scene, Trajectory], dict[str, Measured]]
    rule: Callable[[Scene, float, dict[str, float]], list[Check]]
    sampling: Callable[[Scene], Sampling]
    track: Callable[[Scene], Track | None] = lambda scene: None
    family: str = "others"
    symptoms: tuple[str, ...] = ()
    quick: tuple[Variation, ...] = (Variation({}),)
    standard: tuple[Variation, ...] = ()
    full: tuple[Variation, ...] = ()
    representative: Params = field(default_factory=dict)
    planted: tuple[Params, ...] = ()
    primary: Primary | None = None
    steps: Steps = Steps()
    size: str | None = None
    growth: Callable[[Scene], float] = lambda scene: 1.0
    smooth: tuple[str, ...] = ()
    studies: tuple[Study, ...] = ()
    searched: Searched | None = None
    frontiers: tuple[Frontier, ...] = ()
    words: Mapping[str, str] = field(default_factory=dict)
    seen_as: Mapping[str, Callable[[Params, float], float]] = field(default_factory=dict)
    restitution: Restitution | None = None
    notes: tuple[str, ...] = ()
    brings: Mapping[str, Brought] = field(default_factory=dict)

    def brought(self, engine: str, profile: str) -> Brought | None:
        """The profile of that name that the scene brings for an engine, if it does."""
        found = self.brings.get(engine)
        return found if found is not None and found.profile == profile else None

    def variations(self, suite: Suite) -> Sequence[Variation]:
        """Cells of a suite."""
        standard = self.standard or self.quick
        return {"quick": self.quick, "standard": standard, "full": self.full or standard}[suite]

    def stands_for_it(self, params: Params) -> bool:
        """Whether a cell with these parameters is the representative one."""
        return self.complete(params) == self.complete(self.representative)

    def minimal(self, params: Params) -> tuple[tuple[str, float], ...]:
        """Parameters that differ from the defaults, validated and sorted, as a slot has them; raises as `complete`."""
        complete = self.complete(params)
        defaults = {parameter.name: parameter.default for parameter in self.parameters}
        return tuple(sorted((name, value) for name, value in complete.items() if value != defaults[name]))

    def checks(self, scene: Scene, dt: float) -> list[Check]:
        """State all checks of ``scene`` at step ``dt`` [s]: truth, bound and reason.

        Raises
        ------
        SceneError
            If its numbers overflow.
        """
        try:
            found = self.rule(scene, dt, self.exact(scene))
        except (OverflowError, ZeroDivisionError):
            raise SceneError(f"{self.name}: its numbers are too large or too small to be judged") from None
        return [check if check.is_finite else check.unjudged() for check in found]

    def complete(self, params: Mapping[str, float]) -> dict[str, float]:
        """All parameters with their values, defaults filled in.

        Raises
        ------
        SceneError
            For a parameter the scene does not have, or a value outside its range.
        """
        known = {parameter.name: parameter for parameter in self.parameters}
        for name in params:
            if name not in known:
                close = difflib.get_close_matches(name, known, n=1)
                hint = f"did you mean {close[0]!r}?" if close else f"it has {', '.join(known) or 'none'}"
                raise SceneError(f"{self.name}.{name}: there is no such parameter, {hint}")
        return {name: p.check(self.name, params.get(name, p.default)) for name, p in known.items()}

    def scene(self, dimension: int, params: Mapping[str, float] | None = None) -> Scene:
        """Make the scene in ``dimension`` with ``params`` (missing ones at their defaults)."""
        if dimension not in self.dimensions:
            raise SceneError(f"{self.name}.dimension: {dimension} is not one of {self.dimensions}")
        return self.make(dimension, self.complete(params or {}))
