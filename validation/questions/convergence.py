"""Whether and how fast an engine converges to the truth as its step shrinks.

Two questions, two methods
    * The declared error of a scene (`validation.canonical.Primary`, a supremum over the phases of its impacts) against
      dt: a straight line in logarithms gives the observed order. A single phase gives no order at all.
    * A smooth metric (no impact in the scene) against dt: Richardson extrapolation from three steps of equal ratio r,

          p = log((f3 - f2)/(f2 - f1)) / log r        limit = f1 + (f1 - f2)/(r^p - 1)

      with f1 the finest, and an uncertainty band of 1.25 |f1 - f2|/(r^p - 1), the grid convergence index of
      P. J. Roache, J. Fluids Eng. 116 (1994) 405, for three grids.

The verdict is one of `Limit`; it never changes a check's PASS or FAIL.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from itertools import pairwise

import numpy as np

from validation.bench.work import accuracy
from validation.bounds import ROUND_OFF
from validation.cells import Observation, Outcome, Slot
from validation.posed import resolve

#: Three finest errors within this factor, over steps at least a factor of four apart, are constant: even order 1/4
#: would change them by 4^(1/4) = 1.41.
LEVEL = 1.35
#: Safety factor of the grid convergence index for three grids (Roache 1994).
SAFETY = 1.25
#: Orders beyond this come from differences of round-off, not from a method.
HIGHEST_ORDER = 6.0


class Limit(Enum):
    """Result of a convergence study."""

    TRUTH = "converges to the truth"
    ELSEWHERE = "converges elsewhere"
    NOT = "does not converge"
    NOISY = "too noisy for an order"
    FEW = "too few steps for an order"


@dataclass(frozen=True)
class Order:
    """Least-squares slope of log error over log dt, with its standard error."""

    order: float
    standard_error: float


@dataclass(frozen=True)
class Convergence:
    """Declared error of one engine and profile on one scene, over steps.

    ``dts`` descend [s]; ``errors`` as the scene declares them; ``order`` is None where no line fits.
    """

    scene: str
    dimension: int
    engine: str
    profile: str
    dts: tuple[float, ...]
    errors: tuple[float, ...]
    order: Order | None
    limit: Limit
    because: str


@dataclass(frozen=True)
class Extrapolation:
    """A smooth metric of one cell, extrapolated to dt = 0; ``band`` is its uncertainty in the metric's unit."""

    scene: str
    dimension: int
    engine: str
    profile: str
    metric: str
    unit: str
    params: str
    truth: float
    dts: tuple[float, ...]
    values: tuple[float, ...]
    order: float | None
    value: float | None
    band: float | None
    limit: Limit
    because: str


def observed_order(dts: Sequence[float], errors: Sequence[float]) -> Order | None:
    """Slope of log error over log dt; None for fewer than two positive errors, and no standard error for two."""
    x, y = np.log(dts), np.log(np.maximum(errors, 1e-300))
    if len(x) < 2 or min(errors) <= 0.0:
        return None
    centred = x - x.mean()
    slope = float(centred @ y / (centred @ centred))
    rest = y - y.mean() - slope * centred
    spread = float(rest @ rest / (centred @ centred) / (len(x) - 2)) if len(x) > 2 else math.inf
    return Order(slope, math.sqrt(spread))


def limit_of(
    dts: Sequence[float], errors: Sequence[float], floor: float = ROUND_OFF
) -> tuple[Order | None, Limit, str]:
    """Order, verdict and reason from errors at descending steps.

    Errors at or below ``floor`` are round-off and have no order. Falling to round-off is convergence only if the errors
    fell before (a rise by more than `LEVEL` is noise). If only the finest step is at round-off, the fall to it must fit
    an order of at most `HIGHEST_ORDER`; otherwise it may be a chance phase.
    """
    if not errors:
        return None, Limit.FEW, "no step has a measured error"
    if len(errors) < 3:
        return None, Limit.FEW, f"{len(errors)} of 3"
    if max(errors) <= floor:
        return None, Limit.TRUTH, "exact to round-off at every step"
    above = [(dt, error) for dt, error in zip(dts, errors, strict=True) if error > floor]
    if errors[-1] <= floor:
        return None, *_round_off_limit(dts, errors, floor)
    fit = observed_order([dt for dt, _ in above], [error for _, error in above])
    if max(errors[-3:]) <= LEVEL * min(errors[-3:]) and dts[-3] >= 4.0 * dts[-1] * (1.0 - 1e-9):
        return fit, Limit.ELSEWHERE, f"levels off at an error of {errors[-1]:.2g}"
    if fit is None or len(above) < 3:
        return fit, Limit.FEW, "too few errors above round-off for an order"
    said = f"order {fit.order:.2f} +- {fit.standard_error:.2f}"
    if fit.order - 2.0 * fit.standard_error > 0.0:
        return fit, Limit.TRUTH, f"{said} over {len(above)} steps"
    if fit.order + 2.0 * fit.standard_error < 0.0:
        return fit, Limit.NOT, f"the error grows as the step shrinks, {said}"
    return fit, Limit.NOISY, f"{said}: neither falling nor constant"


def _round_off_limit(dts: Sequence[float], errors: Sequence[float], floor: float) -> tuple[Limit, str]:
    """Verdict and reason where the finest error is round-off and a coarser one is not."""
    rises = [after > max(LEVEL * before, floor) for before, after in pairwise(errors)]
    if any(rises):
        return Limit.NOISY, f"round-off at dt = {dts[-1]:.3g} s, but errors rise on the way"
    last = next(k for k in reversed(range(len(errors))) if errors[k] > floor)
    needed = math.log(errors[last] / floor) / math.log(dts[last] / dts[last + 1])
    if last == len(errors) - 2 and needed > HIGHEST_ORDER:
        return Limit.NOISY, f"round-off at dt = {dts[-1]:.3g} s only, from {errors[-2]:.2g} one step coarser"
    return Limit.TRUTH, f"falls to round-off at dt = {dts[-1]:.3g} s "


def richardson(dts: Sequence[float], values: Sequence[float]) -> tuple[float, float, float] | None:
    """Order, limit and band from the three finest of descending steps.

    Returns
    -------
    None if the steps have no common ratio, or the differences do not shrink with one sign (an oscillating or
    diverging sequence has no extrapolation).
    """
    if len(values) < 3:
        return None
    (h3, h2, h1), (f3, f2, f1) = dts[-3:], values[-3:]
    ratio = h2 / h1
    if abs(h3 / h2 - ratio) > 1e-6 * ratio or f2 == f1:
        return None
    quotient = (f3 - f2) / (f2 - f1)
    if quotient <= 1.0:
        return None
    order = min(math.log(quotient) / math.log(ratio), HIGHEST_ORDER)
    correction = (f1 - f2) / (ratio**order - 1.0)
    return order, f1 + correction, SAFETY * abs(correction)


#: Scene, dimension, engine, profile.
Series = tuple[str, int, str, str]
#: Error by series, step and iterations.
DeclaredErrors = Mapping[Series, Mapping[tuple[float, int | None], float]]


def declared_errors(observations: Iterable[Observation]) -> DeclaredErrors:
    """Declared error per series and (step, iterations; None: the profile's own), where all variations ran.

    A step with a cell that crashed or diverged has no error.
    """
    cells: dict[Series, dict[tuple[float, int | None], dict[Slot, Observation]]]
    cells = defaultdict(lambda: defaultdict(dict))
    for observation in observations:
        slot = observation.slot
        if slot.ulp == 0 and _is_variation(slot):
            series = (slot.scene, slot.dimension, slot.engine, slot.profile)
            cells[series][slot.dt, slot.iterations].setdefault(slot, observation)
    found: dict[Series, dict[tuple[float, int | None], float]] = defaultdict(dict)
    for series, settings in cells.items():
        for (dt, iterations), members in settings.items():
            primary = resolve(series[0]).primary
            if primary is not None and len(members) == len(primary.variations(dt)):
                error = float(accuracy(list(members.values()))["error"])
                if math.isfinite(error):
                    found[series][dt, iterations] = error
    return dict(found)


def _is_variation(slot: Slot) -> bool:
    """Whether the slot is one of the cells whose worst error its scene declares."""
    canonical = resolve(slot.scene)
    if canonical.primary is None:
        return False
    asked = canonical.complete(dict(slot.params))
    return any(canonical.complete(params) == asked for params in canonical.primary.variations(slot.dt))


def convergence(declared: DeclaredErrors) -> list[Convergence]:
    """Error against dt for every engine and profile, with order and verdict."""
    out = []
    for series, errors in declared.items():
        dts = tuple(sorted((dt for dt, iterations in errors if iterations is None), reverse=True))
        own = tuple(errors[dt, None] for dt in dts)
        if dts:
            out.append(Convergence(*series, dts, own, *limit_of(dts, own)))
    return out


def extrapolations(observations: Iterable[Observation]) -> list[Extrapolation]:
    """Richardson extrapolation of every smooth metric that ran at three steps or more."""
    cells: dict[tuple[Slot, str], dict[float, Observation]] = defaultdict(dict)
    for observation in observations:
        slot = observation.slot
        if slot.ulp == 0 and slot.iterations is None and observation.outcome is Outcome.OK:
            for metric in resolve(slot.scene).smooth:
                anywhere = Slot(slot.scene, slot.params, slot.dimension, slot.engine, slot.profile, 1.0)
                cells[anywhere, metric].setdefault(slot.dt, observation)
    found = [_extrapolated(slot, metric, steps) for (slot, metric), steps in cells.items() if len(steps) >= 3]
    return [entry for entry in found if entry is not None]


def _extrapolated(slot: Slot, metric: str, steps: dict[float, Observation]) -> Extrapolation | None:
    canonical = resolve(slot.scene)
    scene = canonical.scene(slot.dimension, dict(slot.params))
    dts = tuple(sorted(steps, reverse=True))
    values = [steps[dt].metrics.get(metric, (None, ""))[0] for dt in dts]
    checks = {check.metric: check for check in canonical.checks(scene, dts[-1])}
    check = checks.get(metric)
    if check is None or check.truth is None or check.bound is None or any(value is None for value in values):
        return None
    numbers = tuple(float(value) for value in values if value is not None)
    scale = ROUND_OFF * max(1.0, abs(check.truth), *map(abs, numbers))
    order, value, band, limit, because = _smooth_limit(dts, numbers, check.truth, scale)
    return Extrapolation(
        slot.scene, slot.dimension, slot.engine, slot.profile, metric, check.unit, slot.params_text(), check.truth,
        dts, numbers, order, value, band, limit, because,
    )  # fmt: skip


def _smooth_limit(
    dts: tuple[float, ...], values: tuple[float, ...], truth: float, scale: float
) -> tuple[float | None, float | None, float | None, Limit, str]:
    """Order, limit, band, verdict and reason; ``scale`` is the round-off of the values."""
    last = values[-3:]
    if max(last) - min(last) <= scale:
        at_truth = abs(values[-1] - truth) <= 2.0 * scale
        limit, where = (Limit.TRUTH, "the truth") if at_truth else (Limit.ELSEWHERE, f"{values[-1]:.6g}")
        return None, values[-1], scale, limit, f"the same value at every step, {where}"
    found = richardson(dts, values)
    if found is None:
        growing = abs(last[2] - last[1]) > abs(last[1] - last[0]) and abs(last[2] - truth) > abs(last[0] - truth)
        limit = Limit.NOT if growing else Limit.NOISY
        return None, None, None, limit, "differences grow" if growing else "differences do not shrink with one sign"
    order, value, band = found[0], found[1], found[2] + scale
    near = abs(value - truth) <= band
    said = f"order {order:.2f}, limit {value:.6g} +- {band:.1g}"
    return order, value, band, Limit.TRUTH if near else Limit.ELSEWHERE, f"{said}, truth {truth:.6g}"
