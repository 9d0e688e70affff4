"""Parameter sweeps: their cells, and the results as one table.

    grid     every value of LOW ... HIGH, N of them, evenly (or evenly in the logarithm)
    list     every given value
    random   N points, independent and uniform between LOW and HIGH (or uniform in the logarithm), from a seed
    sobol    N points of a scrambled Sobol sequence, which fill the same range more evenly, from the same seed

Grids and lists are crossed with each other and with the points; random and Sobol parameters are drawn together, so that
N points vary all of them at once. A seed gives the same cells again, so that the same command resumes.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import TYPE_CHECKING, Literal

import numpy as np

from adapters.scene import SceneError
from validation.canonical import CanonicalScene
from validation.cells import Slot
from validation.judging.rows import Row
from validation.posed import pinned, resolve
from validation.running.plan import Request, slots

if TYPE_CHECKING:
    import pandas as pd

#: Most cells of a sweep: the plan takes half a gigabyte of memory, the rows some ten.
MOST_CELLS = 200_000
#: Most points of a Sobol sequence or values of a grid.
MOST_POINTS = 2**17

Kind = Literal["random", "sobol"]


@dataclass(frozen=True)
class Range:
    """A parameter between two bounds; ``log`` spreads it evenly in the logarithm."""

    name: str
    low: float
    high: float
    log: bool = False

    def at(self, share: float) -> float:
        """Value at a share in [0, 1] of the range; the ends are exact."""
        if share in (0.0, 1.0):
            return self.high if share else self.low
        if self.log:
            return float(self.low * math.pow(self.high / self.low, share))
        return float(self.low + share * (self.high - self.low))


def range_from(text: str, option: str, parts: int) -> tuple[Range, int]:
    """Read ``NAME=LOW:HIGH`` with a count where ``parts`` is 3, and perhaps ``:log``.

    Raises
    ------
    SceneError
        Naming the option.
    """
    form = "NAME=LOW:HIGH" + (":COUNT" if parts == 3 else "") + "[:log]"
    name, _, rest = text.partition("=")
    said = rest.split(":")
    log = len(said) == parts + 1 and said[-1] == "log"
    try:
        low, high = float(said[0]), float(said[1])
        count = int(said[2]) if parts == 3 else 0
    except (ValueError, IndexError):
        raise SceneError(f"{option}: {text[:80]!r} is not of the form {form}") from None
    if not name.strip() or len(said) != parts + log:
        raise SceneError(f"{option}: {text[:80]!r} is not of the form {form}")
    if not (math.isfinite(low) and math.isfinite(high) and low < high):
        raise SceneError(f"{option}: {name}: {said[0]} must be less than {said[1]}, both finite")
    if log and low <= 0.0:
        raise SceneError(f"{option}: {name}: {said[0]} has no logarithm")
    if parts == 3 and not 2 <= count <= MOST_POINTS:
        raise SceneError(f"{option}: {name}: {count} must be a whole number in [2, {MOST_POINTS}]")
    return Range(name.strip(), low, high, log), count


def grid(text: str) -> tuple[str, list[float]]:
    """Values of ``NAME=LOW:HIGH:COUNT[:log]``."""
    found, count = range_from(text, "grid", 3)
    return found.name, [found.at(k / (count - 1)) for k in range(count)]


def listed(text: str) -> tuple[str, list[float]]:
    """Values of ``NAME=A,B,C``."""
    name, _, rest = text.partition("=")
    try:
        values = [float(word) for word in rest.split(",")]
    except ValueError:
        raise SceneError(f"list: {text[:80]!r} is not of the form NAME=A,B,C") from None
    if not name.strip():
        raise SceneError(f"list: {text[:80]!r} is not of the form NAME=A,B,C")
    return name.strip(), values


def points(ranges: Sequence[tuple[Kind, Range]], count: int, seed: int) -> list[dict[str, float]]:
    """``count`` points over all ranges; one empty point where there are none.

    Raises
    ------
    SceneError
        For no points, or too many.
    """
    if not ranges:
        return [{}]
    if not 1 <= count <= MOST_POINTS:
        raise SceneError(f"samples: {count} must be a whole number in [1, {MOST_POINTS}]")
    even = [each for kind, each in ranges if kind == "sobol"]
    loose = [each for kind, each in ranges if kind == "random"]
    shares = np.random.default_rng(seed).random((count, len(loose)))
    if even:
        from scipy.stats import qmc

        sequence = qmc.Sobol(len(even), scramble=True, rng=np.random.default_rng(seed))
        drawn = sequence.random_base2(math.ceil(math.log2(count)))[:count]  # a power of two keeps the sequence balanced
        shares = np.hstack([shares, drawn])
    names = loose + even
    return [{each.name: each.at(float(s)) for each, s in zip(names, row, strict=True)} for row in shares]


@dataclass(frozen=True)
class Study:
    """The varied parameters: crossed values, and points drawn together."""

    crossed: Mapping[str, Sequence[float]]
    drawn: Sequence[Mapping[str, float]]

    def __len__(self) -> int:
        return math.prod(len(values) for values in self.crossed.values()) * len(self.drawn)

    def __iter__(self) -> Iterator[dict[str, float]]:
        for values in product(*self.crossed.values()):
            for point in self.drawn:
                yield {**dict(zip(self.crossed, values, strict=True)), **point}


def study_slots(request: Request, study: Study) -> list[Slot]:
    """Cells of a study, on every scene, engine, profile, dimension and step of ``request``.

    Raises
    ------
    SceneError, EngineError
        For a parameter that a scene does not have or whose value is out of its range, and for too many cells, before
        they are made.
    """
    first = next(iter(study))
    fixed = dict(request.params or {})
    for name in first:
        if name in fixed:
            raise SceneError(f"param: {name} is both fixed and varied")
    each = len(slots(replace(request, params=_rounded(request, {**fixed, **first}))))
    if each * len(study) > MOST_CELLS:
        raise SceneError(f"sweep: {each * len(study)} cases are more than the {MOST_CELLS} of one sweep")
    found: dict[Slot, None] = {}
    for params in study:
        found.update(dict.fromkeys(slots(replace(request, params=_rounded(request, {**fixed, **params})))))
    return list(found)


def _rounded(request: Request, params: Mapping[str, float]) -> dict[str, float]:
    """Parameters, with whole ones rounded."""
    whole = {p.name for scene in _scenes(request) for p in scene.parameters if p.integer}
    return {name: float(round(value)) if name in whole else value for name, value in params.items()}


def _scenes(request: Request) -> list[CanonicalScene]:
    return [resolve(pinned(name)) for name in request.scenes]


def table(rows: Sequence[Row]) -> pd.DataFrame:
    """One line per cell: parameters, outcome, the value of every metric, and whether all judged ones pass."""
    import pandas as pd

    lines: dict[str, dict[str, object]] = {}
    for row in rows:
        if len(row.cells) > 1:  # a study of several cells has no line
            continue
        line = lines.get(row.cells[0]) if row.cells[0] else None
        if line is None:
            line = {
                "scene": row.scene, "dimension": row.dimension, "engine": row.engine, "profile": row.profile,
                "engine_version": row.engine_version, "dt": row.dt, "iterations": row.iterations,
                **row.params, "outcome": row.outcome, "passes": row.outcome == "ok", "state_hash": row.state_hash,
            }  # fmt: skip
            lines[row.cells[0] or f"{len(lines)}"] = line
        line["passes"] = bool(line["passes"]) and row.physics != "fail" and row.outcome == "ok"
        line[row.metric] = row.value
    return pd.DataFrame(list(lines.values()))
