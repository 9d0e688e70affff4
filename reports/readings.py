"""What engines say of contact forces, as plain data for the terminal, the report and the docs."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from adapters import registry
from adapters.engine_folder import force_script_of, readings_of
from adapters.readings import Cause, Reading
from reports.wording import number, setting_text
from validation.questions.kept_readings import Known, known_of
from validation.questions.readings import SITUATIONS, STOPPED, WRONG, Judged, causes_of

Plain = dict[str, Any]
#: What the numbers of a table mean.
SCALE = (
    "largest error of a step over the largest true force of that pair or body; then the largest error of any, in "
    "newtons; (1/480): in 1 of 480 steps"
)
#: What a call has that has no whole vector.
PARTS = {"normal": "normal parts", "size": "sizes of normal parts"}
#: What is known in each situation.
LAWS = {each.name: each.what for each in SITUATIONS}


def said(judged: Judged) -> str:
    """The verdict in a word or a number, with the steps in which it is wrong if those are not all."""
    if judged.verdict != WRONG:
        return judged.verdict
    if judged.where == "reads 0":
        return judged.where
    assert judged.off is not None
    some = f" ({judged.wrong}/{judged.steps})" if judged.wrong != judged.steps else ""
    force = "" if judged.most is None else f", {number(judged.most, 3)} N"
    return f"off {number(100.0 * judged.off, 2)} %{force}{some}"


def told(engine: str, entries: Iterable[Known] | None = None) -> Plain:
    """Readings of an engine with their verdicts, the best as shipped and where it is off, and a bare script.

    Parameters
    ----------
    entries
        What was measured; None: the kept table.
    """
    found, facts = list(known_of(engine) if entries is None else entries), registry.facts(engine)
    calls = [_of_reading(reading, [e for e in found if e.call == reading.call]) for reading in readings_of(engine)]
    best, off = _best(calls)
    return {
        "engine": engine,
        "title": facts.title if facts else engine,
        "version": found[0].version if found else "",
        "best": best,
        "off": off,
        "readings": calls,
        "script": force_script_of(engine),
    }


def _best(calls: Sequence[Plain]) -> tuple[str, list[str]]:
    """The call that is wrong as shipped in the fewest situations, and in which; none if it is wrong in most."""
    wrong = {}
    for each in calls:
        cells = each["rows"][0]["cells"] if each["rows"] else {}
        wrong[each["call"]] = [f"{name}: {said}" for name, said in cells.items() if said not in ("right", "not run")]
    best = min(wrong, key=lambda call: len(wrong[call]), default="")
    if not best or 2 * len(wrong[best]) > len(LAWS):
        return "", []
    part = next(each["part"] for each in calls if each["call"] == best)
    return best, [*([] if part == "vector" else [f"{PARTS[part]} alone"]), *wrong[best]]


def _of_reading(reading: Reading, entries: Sequence[Known]) -> Plain:
    """One call: its meaning, a row for each profile or one for all, and why it is wrong or did not run."""
    by_profile: dict[str, dict[str, Judged]] = {}
    for each in entries:
        by_profile.setdefault(each.profile, {})[each.judged.situation] = each.judged
    rows = [
        {"profile": name, "cells": {k: said(judged) for k, judged in own.items()}} for name, own in by_profile.items()
    ]
    if len(rows) > 1 and all(row["cells"] == rows[0]["cells"] for row in rows):
        rows = [rows[0] | {"profile": "all"}]
    reasons: dict[str, list[str]] = {}
    for name, own in by_profile.items():
        for judged in own.values():
            texts = [judged.where] if judged.verdict == STOPPED else []
            if judged.verdict == WRONG:
                texts = [_text(cause) for cause in causes_of(reading, name, judged.situation)] or ["not explained"]
            for text in texts:
                reasons.setdefault(text, []).append(judged.situation)
    return {
        "call": reading.call,
        "part": reading.part,
        "means": f"{reading.gives} of {reading.of}; {reading.on}; {reading.frame}; over {reading.over}",
        "correction": reading.correction,
        "hint": reading.hint,
        "rows": rows,
        "causes": [f"{', '.join(dict.fromkeys(where))}: {text}" for text, where in reasons.items()],
    }


def _text(cause: Cause) -> str:
    changes = ", ".join(f"{name} = {setting_text(value)}" for name, value in cause.set.items())
    return f"{cause.because}; right with {changes}" if changes else cause.because


def engines() -> list[str]:
    """Engines that list readings, in the order of the registry."""
    return [name for name in registry.names() if readings_of(name)]
