"""What a canonical scene is: a figure, parameters with reasons, a maker, and the exact answer.

A canonical scene knows nothing of engines. Its tolerances stand in `validation.tolerances`, its metrics in
`validation.metrics`.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from adapters.scene import Scene, SceneError
from adapters.trajectory import Sampling, Trajectory

#: Standard gravity as the field's examples use it [m/s^2].
GRAVITY = 9.81


@dataclass(frozen=True)
class Parameter:
    """A number that a scene may be asked with.

    Parameters
    ----------
    default, unit
        Used where a call does not say; shown by ``crosscheck describe``.
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
            Naming scene and parameter, if it is not finite, whole where it must be, or within the range.
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
        """Whether truth and bound, where there are any, are numbers that can be compared with."""
        return all(number is None or math.isfinite(number) for number in (self.truth, self.bound))

    def unjudged(self) -> Check:
        """The same number, shown and not judged: its scene is too large for a tolerance."""
        return Check(self.metric, self.unit, None, None, f"not judged, its tolerance is not finite; {self.because}", "")


#: A measured value, or None and why there is none.
Measured = tuple[float | None, str]


@dataclass(frozen=True)
class Track:
    """Exact state of one body over time, where a closed form exists: ``height(t)`` or position along x."""

    body: str
    position: Callable[[float], tuple[float, ...]]


@dataclass(frozen=True)
class CanonicalScene:
    """A scene of the catalogue.

    Parameters
    ----------
    name, version, title
        Identity; a change of physics is a new version.
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
    sampling
        What has to be recorded.
    track
        Exact motion for the replay's ghost, or None.
    rule
        The stated tolerances, from `validation.tolerances`.
    notes
        What was filled in or put right in a scene from a file, one line each; said wherever it is run or described.
    """

    name: str
    version: int
    title: str
    figure: str
    law: str
    dimensions: tuple[int, ...]
    parameters: tuple[Parameter, ...]
    make: Callable[[int, Mapping[str, float]], Scene]
    exact: Callable[[Scene], dict[str, float]]
    measure: Callable[[Scene, Trajectory], dict[str, Measured]]
    sampling: Callable[[Scene], Sampling]
    track: Callable[[Scene], Track | None]
    rule: Callable[[Scene, float, dict[str, float]], list[Check]]
    notes: tuple[str, ...] = ()

    def checks(self, scene: Scene, dt: float) -> list[Check]:
        """State all checks of ``scene`` at step ``dt`` [s]: truth, bound and reason.

        Raises
        ------
        SceneError
            If its numbers leave what can be computed with.
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
                hint = f"did you mean {close[0]!r}?" if close else f"it has {', '.join(known)}"
                raise SceneError(f"{self.name}.{name}: there is no such parameter, {hint}")
        return {name: p.check(self.name, params.get(name, p.default)) for name, p in known.items()}

    def scene(self, dimension: int, params: Mapping[str, float] | None = None) -> Scene:
        """Make the scene in ``dimension`` with ``params`` (missing ones at their defaults)."""
        if dimension not in self.dimensions:
            raise SceneError(f"{self.name}.dimension: {dimension} is not one of {self.dimensions}")
        return self.make(dimension, self.complete(params or {}))
