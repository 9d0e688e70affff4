"""Choice of an engine: profiles that pass every check of a scene, from which step on, at what cost; and fixes."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from adapters.registry import is_ranked, profile_of
from reports.fixes import ROLES, Change, changes, fix, how_measured
from reports.page.source import Plain, Source
from reports.page.verdicts import Mark, family_of, ratio_of, severity, slug
from reports.speed import busy, duration
from reports.wording import joined, mark_of, number
from validation.cells import format_dt
from validation.running.plan import QUICK_DT

#: Scene, dimension.
Line = tuple[str, int]


@dataclass(frozen=True)
class Cost:
    """CPU time per simulated second [s/s], and the interval of its median."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class Candidate:
    """One engine and profile on one scene: the steps that ran, which of them pass every check, and the cost.

    ``tied`` is whether the interval of its cost overlaps that of the cheapest, so that their order is open.
    """

    engine: str
    profile: str
    steps: list[tuple[str, bool]]
    largest: str
    price: Cost | None
    failing: str
    tied: bool = False

    @property
    def cost(self) -> float:
        """CPU time per simulated second [s/s] at the largest step that passes; infinite if it was not timed."""
        return math.inf if self.price is None or math.isnan(self.price.value) else self.price.value

    @property
    def cost_text(self) -> str:
        """The cost as text; empty if it was not timed."""
        return duration(self.cost) if math.isfinite(self.cost) else ""


@dataclass(frozen=True)
class Choice:
    """Candidates of a scene, passing ones first and the cheapest of them on top, with the answer in a sentence."""

    scene: str
    dimension: int
    anchor: str
    answer: str
    candidates: list[Candidate]

    @property
    def timed(self) -> bool:
        """Whether any passing candidate was timed; without a time there is no first choice."""
        return any(candidate.cost_text for candidate in self.good)

    @property
    def good(self) -> list[Candidate]:
        """Candidates that pass every check, the cheapest first."""
        return [candidate for candidate in self.candidates if candidate.largest]


def choices(source: Source) -> list[Choice]:
    """One choice per scene and dimension."""
    rows = [*source.rows, *(source.bench.rows if source.bench else ())]
    grouped: dict[tuple[Any, ...], list[Plain]] = defaultdict(list)
    for row in rows:
        if row["iterations"] is None and row["outcome"] not in ("unsupported", "not_installed"):
            grouped[row["scene"], row["dimension"], row["engine"], row["profile"], row["dt"]].append(row)
    costs = _costs(source)
    found = [_choice(source, line, grouped, costs) for line in source.lines]
    return [choice for choice in found if choice is not None]


def _costs(source: Source) -> dict[tuple[Any, ...], Cost]:
    """Cost by scene, dimension, engine, profile, step, at the profile's own iterations.

    Empty if nothing was timed, or if the machine was so busy that times give no order.
    """
    if source.bench is None or busy(source.bench.tables["timings"]):
        return {}
    points = source.bench.tables["work_points"].to_dict("records")
    own = [p for p in points if p["iterations"] is None or p["iterations"] != p["iterations"]]
    return {
        (p["scene"], p["dimension"], p["engine"], p["profile"], p["dt"]): Cost(p["cost"], p["cost_low"], p["cost_high"])
        for p in own
    }


def _choice(
    source: Source,
    line: Line,
    grouped: Mapping[tuple[Any, ...], Sequence[Plain]],
    costs: Mapping[tuple[Any, ...], Cost],
) -> Choice | None:
    candidates: list[Candidate] = []
    for column in (column for column in source.columns if is_ranked(*column)):
        steps = {key[4]: rows for key, rows in grouped.items() if key[:4] == (*line, *column)}
        if steps:
            candidates.append(_candidate(line, column, steps, costs))
    if not candidates:
        return None
    candidates.sort(key=lambda c: (c.largest == "", c.cost))
    candidates = _with_ties(candidates)
    return Choice(*line, slug("choose", *line), _answer(candidates, source.bench is not None), candidates)


def _with_ties(candidates: Sequence[Candidate]) -> list[Candidate]:
    """Mark the candidates whose cost cannot be distinguished from that of the first, the cheapest."""
    best, *others = candidates
    if best.price is None:
        return list(candidates)
    high = best.price.high
    return [best, *(replace(c, tied=c.price is not None and c.price.low <= high) for c in others)]


def _candidate(
    line: Line,
    column: tuple[str, str],
    steps: Mapping[float, Sequence[Plain]],
    costs: Mapping[tuple[Any, ...], Cost],
) -> Candidate:
    passing = {dt: all(mark_of(r) in ("pass", "none") for r in rows) for dt, rows in steps.items()}
    order = sorted(passing, reverse=True)
    # A step counts only if every smaller one passes too: a single pass may be luck.
    safe = [dt for k, dt in enumerate(order) if all(passing[finer] for finer in order[k:])]
    price = costs.get((*line, *column, safe[0])) if safe else None
    bad = [row for rows in steps.values() for row in rows if mark_of(row) not in ("pass", "none")]
    worst = max(bad, key=lambda row: (ratio_of(row) or 0.0, severity(row)), default=None)
    families = dict.fromkeys(family_of(row["metric"]) for row in bad)
    failing = ""
    if worst is not None:
        ratio = ratio_of(worst)
        failing = joined(families) + (f" (worst: {number(ratio, 2)} tolerances)" if ratio else "")
    return Candidate(
        *column,
        [(format_dt(dt), passing[dt]) for dt in order],
        format_dt(safe[0]) if safe else "",
        price,
        failing,
    )


def _answer(candidates: Sequence[Candidate], timed: bool) -> str:
    good = [c for c in candidates if c.largest]
    if not good:
        return "No engine passes every check at any step that ran."
    priced = [c for c in good if c.cost_text]
    names = joined(f"{c.engine}/{c.profile} (from dt = {c.largest} s)" for c in good)
    if not priced:
        missing = "" if timed else "; run crosscheck bench for their cost"
        return f"{names} {'pass' if len(good) > 1 else 'passes'} every check{missing}."
    best = priced[0]
    also = [f"{c.engine}/{c.profile} at {c.largest} s ({c.cost_text})" for c in priced[1:] if not c.tied][:3]
    cheap = " or ".join(f"{c.engine}/{c.profile}" for c in priced if c.tied or c is best)
    said = f"Use {cheap} at dt = {best.largest} s: "
    said += f"the cheapest that passes every check, {best.cost_text} of CPU per simulated second."
    return said + (f" Next: {joined(also)}." if also else "")


@dataclass(frozen=True)
class Cure:
    """An engine as shipped on one scene, and the profile that does better, with its changes.

    ``pasted`` describes the lines in ``paste``, or says why there are none. ``like`` is a scene with the same changes,
    which are shown there; empty if there is none.
    """

    scene: str
    dimension: int
    engine: str
    before_profile: str
    profile: str
    before: Mark
    after: Mark
    check: str
    before_text: str
    after_text: str
    changes: list[Change]
    paste: str
    pasted: str
    measured: str
    like: str = ""


def cures(source: Source) -> list[Cure]:
    """Engines that fail as shipped, with tuned profiles that are nearer to the truth in the same worst check."""
    found = []
    asked = {engine: (profile_of(engine, "shipped"), profile_of(engine, "tuned")) for engine in source.engines}
    for scene, dimension in source.lines:
        for engine, (shipped, better) in asked.items():
            cure = _cure(source, scene, dimension, engine, shipped, better) if shipped and better else None
            if cure is not None:
                found.append(cure)
    return found


def _cure(source: Source, scene: str, dimension: int, engine: str, shipped: str, better: str) -> Cure | None:
    every = source.of(scene=scene, dimension=dimension, engine=engine)
    before = [row for row in every if row["profile"] == shipped and row["physics"]]
    after = {(str(row["params"]), row["dt"], row["iterations"], row["metric"]): row
             for row in every if row["profile"] == better and row["physics"]}  # fmt: skip
    failing = [row for row in before if row["physics"] == "fail" and row["iterations"] is None]
    pairs = [(row, after.get((str(row["params"]), row["dt"], None, row["metric"]))) for row in failing]
    known = [(a, b) for a, b in pairs if b is not None]
    if not known:
        return None
    # Checks that the better profile passes are preferred to those that it still fails.
    known = [pair for pair in known if pair[1]["physics"] == "pass"] or known
    # The default case of the scene is the best known, and its first check the plainest; without one, the worst.
    plain = [pair for pair in known if not pair[0]["slot"]["params"]]
    plain.sort(key=lambda pair: abs(math.log(pair[0]["dt"] / QUICK_DT)))
    worst, same = plain[0] if plain else max(known, key=lambda pair: ratio_of(pair[0]) or 0.0)
    if (ratio_of(same) or 0.0) >= (ratio_of(worst) or 0.0):
        return None
    seen = source.seen(engine, scene)
    found = changes(seen, scene, dimension, engine, shipped, better)
    where = " ".join(f"{name}={value:g}" for name, value in worst["slot"]["params"].items())
    return Cure(
        scene, dimension, engine, shipped, better, Mark(mark_of(worst), ""), Mark(mark_of(same), ""),
        f"{worst['metric']}{' at ' + where if where else ''}", _value(worst), _value(same),
        sorted(found, key=lambda change: change.role in (ROLES[""], "")),  # decisive settings first
        *fix(worst, seen, better),
        how_measured(engine, scene, dimension, shipped, better),
    )  # fmt: skip


def _value(row: Plain) -> str:
    unit = "" if row["unit"] == "1" else f" {row['unit']}"
    return f"{number(row['value'], 4)}{unit} (truth {number(row['truth'], 4)}, tolerance {number(row['tolerance'], 2)})"
