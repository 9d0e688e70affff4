"""Engines in numbers: what is measured and kept of each engine, one text for each property.

Nothing is stated here: the order of a step is a fact of the adapter, numbers are kept measurements
(`validation.settings.kept_numbers`), in the words of the engine's `adapters.unset` table where they agree with it; the
groups come from the published results, and the force call from the kept readings.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from adapters import registry
from adapters.engine_folder import unset_of
from adapters.unset import Unset
from reports import readings
from reports.symptoms import table
from reports.wording import number
from validation.canonical import FAMILIES
from validation.catalogue import CATALOGUE
from validation.settings.kept_numbers import AGAIN, FRICTION, HEADINGS, known_of

#: Properties that the tables of `adapters.unset` have, by the words with which a row begins, the first that there is.
UNSET: Mapping[str, tuple[str, ...]] = {
    "friction": ("friction of a pair",),
    "combined_friction": ("friction of 0.2 and 0.9",),
    "restitution": ("restitution of a pair",),
    "combined_restitution": ("restitution of 0.4 and 0.9",),
    "threshold": ("no rebound below",),
    "linear_damping": ("linear damping",),
    "angular_damping": ("angular damping",),
    "limit": ("limit of speed",),
    "sleep": ("at 1 mm/s asleep after", "rolling slower than 1 mm/s asleep after"),
    "gap_at_rest": ("gap at rest",),
    "overlap_left": ("left of 0.2 m of overlap",),
}
#: All properties with their headings, in the order of the page's tables.
COLUMNS: Mapping[str, Mapping[str, str]] = {
    "Contact": {
        "cone": "friction by heading",
        "combined_friction": "friction of 0.2 and 0.9",
        "combined_restitution": "restitution of 0.4 and 0.9",
        "threshold": "no rebound below [m/s]",
        "gap_at_rest": "gap at rest [m]",
        "overlap_left": "left of 0.2 m of overlap in 2 s [m]",
    },
    "Motion": {
        "precision": "precision",
        "friction": "friction of a pair",
        "restitution": "restitution of a pair",
        "linear_damping": "linear damping [1/s]",
        "angular_damping": "angular damping [1/s]",
        "limit": "limit of speed [m/s]",
        "sleep": "asleep at 1 mm/s after [s]",
        "step": "order of a step",
    },
    "Results as shipped": {
        "strongest": "strongest groups",
        "weakest": "weakest groups",
        "same_again": "the same again in the same bits",
        "force_call": "best call for contact forces, what it lacks, where it is off",
    },
}
#: A cone is round if friction is the same in all headings, to the tolerance of its check or this share.
ROUND = 0.01


def of_engine(name: str) -> dict[str, str]:
    """Properties of an engine as shipped, by the names in `COLUMNS`; empty where nothing is kept."""
    facts, kept = registry.facts(name), known_of(name)
    found = dict.fromkeys((key for group in COLUMNS.values() for key in group), "")
    for key, words in UNSET.items():
        found[key] = next((_unset(row, kept.get(row.what)) for row in unset_of(name) if row.what.startswith(words)), "")
    if facts is not None:
        found |= {"step": facts.scheme.order, "precision": facts.precision}
    found["cone"] = _cone({heading: kept.get(FRICTION.format(heading)) for heading in HEADINGS})
    found["strongest"], found["weakest"] = _groups(name)
    if AGAIN in kept:
        found["same_again"] = "yes" if kept[AGAIN] == 1.0 else f"in {number(100.0 * kept[AGAIN], 2)} % of cases"
    told = readings.told(name)
    off = f" ({'; '.join(told['off'])})" if told["off"] else ""
    found["force_call"] = f"{told['best']}{off}" if told["best"] else "none is right" if told["readings"] else ""
    return found


def _unset(row: Unset, measured: float | None) -> str:
    """The documented words where the kept number agrees with them, or where there is none; else that number."""
    if measured is None or row.agrees(measured):
        return row.documented
    if math.isinf(measured):
        return "never" if row.what.endswith("after [s]") else "none"
    if row.value is not None:
        return f"{number(measured)}, differs from the documented {row.documented}"
    return number(measured) + ("" if "not documented" in row.documented else f": {row.documented}")


def _cone(by_heading: Mapping[float, float | None]) -> str:
    shares = {heading: share for heading, share in by_heading.items() if share is not None}
    if len(shares) < 2:
        return ""
    told = ", ".join(f"{number(share, 3)} at {heading:g}°" for heading, share in sorted(shares.items()))
    least, greatest = min(shares.values()), max(shares.values())
    kind = {least: "pyramidal", greatest: "a box"}.get(shares.get(45.0, math.nan), "not round")
    return "round" if greatest - least <= ROUND else f"{kind}: {told} of mu N"


def _groups(engine: str) -> tuple[str, str]:
    """Groups of scenes with the largest and the smallest share of passed checks, with both counts."""
    scenes = table()["engines"].get(engine, {}).get("scenes", {})
    counts: dict[str, list[int]] = {}
    for scene, rows in scenes.items():
        own = counts.setdefault(CATALOGUE[scene].family, [0, 0])
        for _, failed, judged, _ in rows:
            own[0] += judged - failed
            own[1] += judged
    shares = {name: counts[name][0] / counts[name][1] for name in FAMILIES if counts.get(name, [0, 0])[1]}
    if not shares:
        return "", ""
    told = []
    for end in (max(shares.values()), min(shares.values())):
        named = [f"{name} ({counts[name][0]} of {counts[name][1]})" for name in shares if shares[name] == end]
        told.append(", ".join(named))
    return told[0], told[1]
