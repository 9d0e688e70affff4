"""Statistics of timings: small, distribution-free, reproducible."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

#: Resamples of a bootstrap; beyond each end of a 95 % interval are then ten of them.
RESAMPLES = 400
CONFIDENCE = 0.95
#: Change of the median from the first to the second half of the rounds that counts as drift.
DRIFT = 0.05


@dataclass(frozen=True)
class Spread:
    """Minimum, median and bootstrap interval of the median of n samples."""

    n: int
    minimum: float
    median: float
    low: float
    high: float

    @property
    def width(self) -> float:
        """Width of the interval relative to the median."""
        return (self.high - self.low) / self.median if self.median else np.inf


@cache
def _resamples(n: int) -> NDArray[np.int64]:
    """Indices of all resamples of n values; fixed, so that the same timings give the same interval."""
    return np.random.default_rng(n).integers(0, n, (RESAMPLES, n))


def spread(samples: ArrayLike) -> Spread:
    """Percentile bootstrap (Efron 1979) of the median."""
    values = np.asarray(samples, float)
    medians = np.median(values[_resamples(len(values))], axis=1)
    tail = 50.0 * (1.0 - CONFIDENCE)
    low, high = np.percentile(medians, [tail, 100.0 - tail])
    return Spread(len(values), float(values.min()), float(np.median(values)), float(low), float(high))


def drift(samples: ArrayLike) -> float:
    """Median of the second half over that of the first, minus 1; 0 for fewer than four samples."""
    values = np.asarray(samples, float)
    if len(values) < 4:
        return 0.0
    half = len(values) // 2
    return float(np.median(values[half:]) / np.median(values[:half]) - 1.0)


def lower_envelope(cost: ArrayLike, error: ArrayLike) -> NDArray[np.bool_]:
    """Which points are on the lower envelope: no other point is as good in both cost and error, and better in one.

    Only points that ran; nothing is interpolated between them. A NaN is never on it.
    """
    c, e = np.asarray(cost, float), np.asarray(error, float)
    on = np.zeros(len(c), bool)
    best = np.inf
    for k in np.lexsort((e, c)):
        if np.isfinite(c[k]) and e[k] < best:
            on[k], best = True, e[k]
    return on


@dataclass(frozen=True)
class Fit:
    """Exponent p of y = a x^p with its standard error."""

    exponent: float
    standard_error: float
    factor: float
    points: int


def power_law(x: ArrayLike, y: ArrayLike) -> Fit | None:
    """Least squares of log y on log x; None for fewer than three points, which leave no error to estimate."""
    u, v = np.log(np.asarray(x, float)), np.log(np.asarray(y, float))
    if len(u) < 3 or np.ptp(u) == 0.0:
        return None
    du = u - u.mean()
    exponent = float(du @ v / (du @ du))
    offset = float(v.mean() - exponent * u.mean())
    residual = v - offset - exponent * u
    error = float(np.sqrt(residual @ residual / (len(u) - 2) / (du @ du)))
    return Fit(exponent, error, float(np.exp(offset)), len(u))
