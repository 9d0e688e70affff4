"""The short answers: the best engine for a scene, the error of each, and its fix.

One line per engine and scene that fails, in words: "engine/profile bounce: rebounds at 0.105, whatever e is; profile
tuned fixes it". Everything follows from the judged rows at the profiles' own iteration counts.
"""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from adapters.registry import is_ranked
from reports.findings import REFUSED, has_answer, severity
from reports.fixes import can_be_searched, decided_by, is_standard, search_command, told_cures
from reports.matrix import UNJUDGED
from reports.wording import LABELS, NEVER, mark_of, measured, number, params_text, plural, quantity
from validation.metrics import SILENT, WORDS
from validation.posed import is_file, resolve

Plain = Mapping[str, Any]
#: (scene, dimension, engine, profile) -> cost [s of CPU per simulated s] of the cheapest step that passes.
Costs = Mapping[tuple[str, int, str, str], float]
#: Errors within one order of magnitude of the largest, in tolerances, are as large: the scene's first check is shown.
NEAR = 10.0
#: Values count as equal below this share of the truth's range.
SAME = 0.05


#: Texts of a scene without judged results, and without an engine that can run it.
UNJUDGED_SCENE = "no verdict: no check of it has a tolerance"
UNASKED = "no verdict: no engine of this run can run it"
#: Begin of the text about other, passing profiles.
FIXES = r"profiles? .+? fix(es)? it\b"


@dataclass(frozen=True)
class Answer:
    """Error of one engine and profile in one scene; ``better`` are the profiles that ``cure`` names."""

    engine: str
    profile: str
    scene: str
    failing: int
    judged: int
    wrong: str
    cure: str
    better: tuple[str, ...] = ()

    @property
    def line(self) -> str:
        """One line for people."""
        return f"{self.engine}/{self.profile} {self.scene}: {self.wrong}; {self.cure}"

    def as_dict(self) -> dict[str, Any]:
        """Plain data (JSON-ready)."""
        return asdict(self)


@dataclass(frozen=True)
class Choice:
    """Engines that pass every row of a scene, the cheapest first if costs were measured; else the nearest one, if any.

    ``asked`` is whether any engine of the run can run the scene.
    """

    scene: str
    good: tuple[str, ...]
    nearest: str
    asked: bool = True

    @property
    def line(self) -> str:
        """``engine/profile (0.2 ms/s), another/profile``."""
        if not self.good and not self.nearest:
            return UNJUDGED_SCENE if self.asked else UNASKED
        return ", ".join(self.good) if self.good else f"none passes every check; nearest: {self.nearest}"

    def as_dict(self) -> dict[str, Any]:
        """Plain data (JSON-ready)."""
        return asdict(self)


def configured(rows: Iterable[Plain]) -> list[Plain]:
    """Judged rows at the profile's own iteration count."""
    return [row for row in rows if row["iterations"] is None and mark_of(row) not in UNJUDGED]


def choices(rows: Sequence[Plain], costs: Costs | None = None) -> list[Choice]:
    """One choice per scene, in the order of the rows."""
    groups = _by_profile(rows)
    dimensions: dict[str, set[int]] = defaultdict(set)
    for row in rows:
        dimensions[row["scene"]].add(row["dimension"])
    found = []
    for scene in dimensions:
        own = {key[1:]: group for key, group in groups.items() if key[0] == scene and is_ranked(*key[1:])}
        good = [key for key, group in own.items() if not _failing(group)]
        price = {key: _price(costs or {}, scene, key) for key in good}
        good.sort(key=lambda key: price[key])
        untold = Counter(
            (row["engine"], row["profile"])
            for row in rows
            if row["scene"] == scene and row["outcome"] in ("unsupported", "refused") and row["iterations"] is None
        )
        names = [_named(key, own[key], dimensions[scene], price[key], untold[key]) for key in good]
        shares = {key: len(_failing(group)) / len(group) for key, group in own.items()}
        near = min(shares, key=lambda key: shares[key], default=None)
        nearest = "" if near is None else f"{'/'.join(near)} ({len(_failing(own[near]))} of {len(own[near])} fail)"
        asked = any(row["scene"] == scene and row["outcome"] not in REFUSED for row in rows)
        found.append(Choice(scene, tuple(names), nearest, asked))
    return found


def _price(costs: Costs, scene: str, key: tuple[str, str]) -> float:
    """Cost in 2-D, else in 3-D; profiles without timing come last."""
    known = [costs[scene, d, *key] for d in (2, 3) if (scene, d, *key) in costs]
    return known[0] if known else math.inf


def _named(key: tuple[str, str], rows: Sequence[Plain], wanted: set[int], price: float, untold: int) -> str:
    """``engine/profile (2-D only, 1.2 ms/s)``; for a file also the number of checks without a value."""
    own = {row["dimension"] for row in rows}
    notes = [] if own >= wanted else [", ".join(f"{d}-D" for d in sorted(own)) + " only"]
    if untold and is_file(rows[0]["scene"]) and own >= wanted:
        notes.append(f"no value for {plural(untold, 'check')}")
    if math.isfinite(price):
        notes.append(f"{1e3 * price:.2g} ms/s")
    return "/".join(key) + (f" ({', '.join(notes)})" if notes else "")


def answers(rows: Sequence[Plain]) -> list[Answer]:
    """Errors of each engine as shipped, scene by scene; of other profiles only worse ones."""
    groups, found = _by_profile(rows), []
    engines, scenes = (list(dict.fromkeys(row[name] for row in rows)) for name in ("engine", "scene"))
    ordered = sorted(groups, key=lambda key: (engines.index(key[1]), scenes.index(key[0])))
    pairs = dict.fromkeys((engine, scene) for scene, engine, _ in ordered)
    for engine, scene in pairs:
        own = {key[2]: group for key, group in groups.items() if (key[0], key[1]) == (scene, engine)}
        shipped, *others = own
        wrong = [shipped] if _failing(own[shipped]) else [name for name in others if _failing(own[name])]
        for profile in wrong:
            group = own[profile]
            text = _wrong(group, _failing(group))
            found.append(
                Answer(engine, profile, scene, len(_failing(group)), len(group), text, *_cure(own, profile))
            )  # fmt: skip
    return found


def _by_profile(rows: Iterable[Plain]) -> dict[tuple[str, str, str], list[Plain]]:
    """Rows by scene, engine, profile."""
    groups: dict[tuple[str, str, str], list[Plain]] = defaultdict(list)
    for row in configured(rows):
        groups[row["scene"], row["engine"], row["profile"]].append(row)
    return groups


def _failing(rows: Iterable[Plain]) -> list[Plain]:
    return [row for row in rows if mark_of(row) != "pass"]


def _cure(own: Mapping[str, Sequence[Plain]], profile: str) -> tuple[str, tuple[str, ...]]:
    """The other profiles that pass every row, or the one that fails least, in words and by name."""
    failed = _failing(own[profile])
    if all(mark_of(row) == "invalid" for row in failed):
        return "the measurement contradicts itself, so it says nothing about the engine", ()
    row, dimensions = failed[0], sorted({row["dimension"] for row in failed if is_standard(row)})
    others = {
        name: group for name, group in own.items()
        if name != profile and is_ranked(row["engine"], name) and {*map(_case, failed)} <= {*map(_case, group)}
    }  # fmt: skip
    silent = [name for name, group in others.items() if not any(map(has_answer, group))]
    others = {name: group for name, group in others.items() if name not in silent}
    good = [name for name, group in others.items() if not _failing(group)]
    listed = told_cures(row["engine"], row["engine_version"], row["scene"], profile, dimensions)
    if good:
        which = (row["engine"], row["engine_version"], row["scene"], dimensions, profile)
        by = {name: decided_by(*which, name) for name in good} if dimensions and not listed else {}
        said = [f"{name if len(good) > 1 else ''} by {text}".strip() for name, text in by.items() if text]
        return "; ".join([", ".join([_fix(good), *said]), *listed]), tuple(good)
    unlisted = [] if listed or not can_be_searched(row) else [f"{search_command(row)} searches for settings"]
    share = {name: len(_failing(group)) / len(group) for name, group in others.items()}
    best = min(share, key=lambda name: share[name], default=None)
    if best is None:
        ran = any(name != profile and is_ranked(row["engine"], name) for name in own)
        none = "other profiles ran in other cases or at other steps" if ran else "no other profile was run in this case"
        none = f"profile {' and '.join(silent)} gave no result" if silent else none
        return "; ".join([none, *listed, *unlisted]), ()
    if share[best] >= len(failed) / len(own[profile]):
        return "; ".join(["no other profile does better", *listed, *unlisted]), ()
    failing = _failing(others[best])
    fewer = f"profile {best} fails less ({len(failing)} of {len(others[best])}): {_wrong(others[best], failing)}"
    return "; ".join([fewer, *listed, *unlisted]), (best,)


def _fix(profiles: Sequence[str]) -> str:
    """``profile tuned fixes it``; see `FIXES`."""
    one = len(profiles) == 1
    return f"profile {profiles[0]} fixes it" if one else f"profiles {' and '.join(profiles)} fix it"


def _case(row: Plain) -> tuple[Any, ...]:
    """The case of a row, without the profile."""
    return row["dimension"], str(row["params"]), row["dt"], row["metric"]


# ---- in words ----

#: Kinds of metric that are speeds: the text says that they should be 0.
RATES = ("creep",)
#: Two numbers with this many digits are compared at a glance; if they need more, their difference is stated.
GLANCE = 5
#: Values below this share of the truth are described as none.
NOTHING = 1e-6


def _as_seen(row: Plain, metric: str) -> Plain | None:
    """A row with the usual quantity of its metric; None if that is the metric itself."""
    view = resolve(row["scene"]).seen_as.get(metric)
    if view is None or row["value"] is None or row["truth"] is None:
        return None
    value, truth = (view(row["params"], row[name]) for name in ("value", "truth"))
    return {**row, "value": value, "truth": truth, "unit": "1"}


def _wrong(rows: Sequence[Plain], failing: Sequence[Plain]) -> str:
    """The error in words, by the kind of `named_kind`."""
    lost = [row for row in failing if not has_answer(row)]
    if lost:
        return f"no result for {len(lost)} of {len(rows)} checks ({LABELS[mark_of(lost[0])]}: {lost[0]['reason']})"
    return wrong_of(rows, named_kind(failing), failing)


def wrong_of(rows: Sequence[Plain], kind: str, failing: Sequence[Plain]) -> str:
    """The error of a kind of metric in words: one value in all ``rows``, else that of the worst row of ``failing``."""
    members, worst = (
        [row for row in group if row["metric"].partition("[")[0] == kind and row["value"] is not None]
        for group in (rows, failing)
    )
    known_as = f"{kind}[1]"
    if any(row["metric"] == known_as for row in failing):
        members, worst = (
            [seen for row in group if row["metric"] == known_as and (seen := _as_seen(row, known_as))] or group
            for group in (members, worst)
        )
    # The truth of a scene file depends on no parameters.
    constant = "" if is_file(rows[0]["scene"]) else _constant(kind, members)
    return constant or _worst(kind, worst)


def named_kind(failing: Iterable[Plain]) -> str:
    """The kind of metric that a headline names: the first of the scene's with an error of the size of the largest.

    Sizes are in tolerances. A scene file has no order of kinds: there it is the worst.
    """
    worst: dict[str, float] = {}
    near = NEAR
    for row in failing:
        near = 1.0 if is_file(row["scene"]) else near
        kind = row["metric"].partition("[")[0]
        worst[kind] = max(worst.get(kind, 0.0), severity(row))
    return next(name for name, error in worst.items() if near * error >= max(worst.values()))


def _instead(row: Plain, kind: str, told_as_size: bool) -> str:
    """The truth beside a value; for a direction in words, its size, or its own words if it is the opposite."""
    truth = quantity(row["truth"], row["unit"], _digits(row))
    if not told_as_size:
        return f" instead of {truth}"
    if row["truth"] < 0.0:
        return f" instead of {truth.removeprefix('-')}"
    return f"; true: {spoken(row['scene'], kind, truth)}"


def _constant(kind: str, rows: Sequence[Plain]) -> str:
    """``rebounds at 0.105, whatever e is``: a constant value while the truth depends on a parameter; else empty."""
    values, truths = [row["value"] for row in rows], [row["truth"] for row in rows]
    if None in truths or max(truths) == min(truths):
        return ""
    if max(values) - min(values) > SAME * (max(truths) - min(truths)):
        return ""
    asked = [name for name in rows[0]["params"] if _follows(rows, name)]
    nothing = max(map(abs, values)) < NOTHING * max(map(abs, truths))
    low, high = ("0", "0") if nothing else (number(value, 3) for value in (min(values), max(values)))
    spread = rows[0]["unit"] if rows[0]["unit"] != "1" else ""
    value = f"{low if low == high else f'{low} to {high}'} {spread if low != '0' or high != '0' else ''}".strip()
    what = f"whatever {' and '.join(asked)} {'is' if len(asked) == 1 else 'are'}" if asked else "in every case"
    return f"{spoken(rows[0]['scene'], kind, value)}, {what}"


def spoken(scene: str, kind: str, value: str) -> str:
    """Words for a value of a kind of metric: the scene's own, else those of `validation.metrics`."""
    own = resolve(scene).words
    words, signed = {**WORDS, **own}, own if kind in own else WORDS
    if value == "0" and f"{kind}=0" in words:
        return words[f"{kind}=0"]
    if value.startswith("-") and " to " not in value and f"{kind}<0" in signed:
        return signed[f"{kind}<0"].format(value=value[1:])
    return words.get(kind, kind + " {value}").format(value=value)


def _digits(row: Plain) -> int:
    """Fewest digits, at least three, that distinguish a wrong value from the truth."""
    value, truth = row["value"], row["truth"]
    if value is None or truth is None:
        return 3
    return next((n for n in range(3, 17) if number(value, n) != number(truth, n)), 17)


def _follows(rows: Sequence[Plain], name: str) -> bool:
    """Whether the truth of one metric changes with this parameter while all others are fixed."""
    seen: dict[str, set[float]] = defaultdict(set)
    for row in rows:
        rest = row["metric"] + repr(sorted((k, v) for k, v in row["params"].items() if k not in (name, "duration")))
        seen[rest].add(round(row["truth"], 9))
    return any(len(truths) > 1 for truths in seen.values())


def _worst(kind: str, rows: Sequence[Plain]) -> str:
    """The worst row in words, with the truth unless that is 0."""
    row = max(rows, key=severity)
    nothing = bool(row["truth"]) and abs(row["value"]) < NOTHING * abs(row["truth"])
    value = "0" if nothing else measured(row, _digits(row))
    # A file's own quantities have only the body's name and the read quantity.
    own = is_file(row["scene"]) and kind != row["metric"]

    def words(told: str) -> str:
        return f"{row['metric']} is {told}" if own else spoken(row["scene"], kind, told)

    text = "never settles" if value == NEVER else words(value)
    as_size = value.startswith("-") and value not in text
    if row["truth"] and value != NEVER and _digits(row) > GLANCE:
        text = words(_apart(row, as_size))
    elif row["truth"] == 0.0 and kind in RATES and row["value"] and "should" not in text:
        text += " instead of 0"
    elif row["truth"] and text != SILENT:
        text += _instead(row, kind, told_as_size=as_size)
    where = params_text(row["slot"]["params"])
    return text + (f" ({where})" if where else "")


def _apart(row: Plain, as_size: bool) -> str:
    """``2.0e-10 more than 1``, for nearly equal numbers; for their sizes if words give the direction."""
    value, truth = (abs(row[name]) if as_size else row[name] for name in ("value", "truth"))
    than = f"{'more' if value > truth else 'less'} than {quantity(truth, row['unit'], 3)}"
    return f"{'-' if as_size else ''}{quantity(abs(value - truth), row['unit'], 2)} {than}"
