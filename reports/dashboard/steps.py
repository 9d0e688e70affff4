"""Steps in a series: where its level changes and stays, found by the change-point detection of `ruptures`.

x            log10 of an error, or of a ratio of times: a step is a factor, at any level
scatter      robust, from differences of neighbours: a step adds one large difference, and the median ignores it
penalty      PENALTY scatter^2 (1 + SHORT/n) for each step: larger than what noise alone gains by a split
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import ruptures

#: With few points the scatter itself is uncertain: at n = 8 the penalty is three times as large.
SHORT = 16.0
#: Least scatter [decades], a tenth of a per cent: closer values are one level, even if they repeat exactly.
LEAST = math.log10(1.001)
#: Number of points from which on the median of their differences is not the step itself.
ENOUGH = 4


@dataclass(frozen=True)
class Rule:
    """Criteria for a step.

    Parameters
    ----------
    factor
        Least relevant change.
    lasts
        Points that a level must last.
    penalty
        Gain of a split in units of scatter^2. A split of normal noise gains chi-square of 1 degree of freedom: 25 is
        5 sigma, 6e-7 for each possible place.
    """

    factor: float
    lasts: int
    penalty: float


#: An error is computed and repeats.
ERROR = Rule(1.01, 1, 25.0)
#: A time is measured. A single outlier is a busy machine. Its tails are heavy: Student's distribution with 4 degrees of
#: freedom has twice the variance that its median difference suggests. Factor: `comparison.PRACTICAL`.
TIME = Rule(1.1, 3, 50.0)


@dataclass(frozen=True)
class Step:
    """Level before and after the point ``at``, which is the first of the new level."""

    at: int
    before: float
    after: float

    @property
    def factor(self) -> float:
        """After over before."""
        return self.after / self.before


def steps(values: Sequence[float], rule: Rule) -> list[Step]:
    """Steps of a series of positive numbers."""
    x, least = np.log10(np.asarray(values, float)), math.log10(rule.factor)
    if len(x) < 2 * rule.lasts or np.ptp(x) <= least:
        return []
    seen = 1.4826 * float(np.median(np.abs(np.diff(x)))) / math.sqrt(2.0) if len(x) >= ENOUGH else 0.0
    scatter = max(LEAST, seen)
    penalty = rule.penalty * scatter**2 * (1.0 + SHORT / len(x))
    ends = _ends(x, penalty, rule.lasts)
    found, start = [], 0
    for end, following in pairwise(ends):
        before, after = (float(10.0 ** np.median(x[a:b])) for a, b in ((start, end), (end, following)))
        if abs(math.log10(after / before)) > least:
            found.append(Step(end, before, after))
        start = end
    return found


def _ends(x: np.ndarray, penalty: float, lasts: int) -> list[int]:
    """Ends of the segments of constant level, the last one included."""
    finder = ruptures.KernelCPD(kernel="linear", min_size=lasts, jump=1)  # squared distance to the segment's mean
    return [int(end) for end in finder.fit(x.reshape(-1, 1)).predict(pen=penalty)]
