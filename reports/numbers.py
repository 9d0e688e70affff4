"""Engines in numbers: what is measured and kept of each engine, one text for each property.

Nothing is stated here: the order of a step is a fact of the adapter, what holds where nothing is set comes from the
engine's `adapters.unset` table, the cone and the groups from the published results, the same bits from the kept breaks
of metamorphic tests, and the force call from the kept readings.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

from adapters import registry
from adapters.engine_folder import unset_of
from reports import readings
from reports.symptoms import table
from reports.symptoms.published import values
from reports.tables import unset_text
from reports.wording import number
from validation.canonical import FAMILIES
from validation.catalogue import CATALOGUE
from validation.questions.breaks import breaks_of

#: Properties that the tables of `adapters.unset` have, by the words with which a row begins.
UNSET = {
    "friction": "friction of a pair",
    "combined_friction": "friction of 0.2 and 0.9",
    "restitution": "restitution of a pair",
    "combined_restitution": "restitution of 0.4 and 0.9",
    "threshold": "no rebound below",
    "linear_damping": "linear damping",
    "angular_damping": "angular damping",
    "sleep": "at 1 mm/s asleep after",
    "gap_at_rest": "gap at rest",
    "overlap_left": "left of 0.2 m of overlap",
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
        "sleep": "asleep at 1 mm/s after [s]",
        "step": "order of a step",
    },
    "Results as shipped": {
        "strongest": "strongest groups",
        "weakest": "weakest groups",
        "same_again": "the same again in the same bits",
        "force_call": "best call for contact forces, and where it is off",
    },
}
#: Relation of a metamorphic test by which the same case runs twice.
AGAIN = "again"
#: A cone is round if friction is the same in all headings, to the tolerance of its check or this share.
ROUND = 0.01


def of_engine(name: str, unset: Sequence[Mapping[str, Any]] | None = None) -> dict[str, str]:
    """Properties of an engine as shipped, by the names in `COLUMNS`; empty where nothing is kept.

    Parameters
    ----------
    unset
        Rows of `reports.listing.describe` with measured numbers; None: what is documented.
    """
    facts = registry.facts(name)
    found = dict.fromkeys((key for group in COLUMNS.values() for key in group), "")
    for key, what in UNSET.items():
        found[key] = next((_unset(row) for row in unset or _documented(name) if row["what"].startswith(what)), "")
    if facts is not None:
        found |= {"step": facts.scheme.order, "precision": facts.precision}
        found["cone"] = _cone(name, facts.profile("shipped") or "")
    found["strongest"], found["weakest"] = _groups(name)
    breaks = breaks_of(name)
    if breaks.families:
        found["same_again"] = "no" if any(relation == AGAIN for *_, relation in breaks.members) else "yes"
    found["force_call"] = _call(readings.told(name)["readings"])
    return found


def _documented(name: str) -> list[dict[str, Any]]:
    return [{"what": row.what, "documented": row.documented, "measured": None} for row in unset_of(name)]


def _unset(row: Mapping[str, Any]) -> str:
    """The measured number, or the documented words where they agree with it, or where there is none."""
    return str(row["documented"]) if row["measured"] is None or row["agrees"] else unset_text(row)


@cache
def _friction() -> Mapping[tuple[str, str], Mapping[float, float]]:
    """Mean friction over mu N by engine, profile and heading [degrees], of the published report."""
    found: dict[tuple[str, str], dict[float, float]] = {}
    rows = values()
    rows = rows[(rows.metric == "friction[mean]") & rows.params.str.contains("heading=") & rows.value.notna()]
    for row in rows.to_dict("records"):
        params = dict(part.split("=") for part in str(row["params"]).split())
        own = found.setdefault((str(row["engine"]), str(row["profile"])), {})
        own[float(params["heading"])] = float(row["value"])
    return found


def _cone(engine: str, profile: str) -> str:
    by_heading = _friction().get((engine, profile))
    if not by_heading or len(by_heading) == 1:
        return ""
    told = ", ".join(f"{number(share, 3)} at {heading:g}°" for heading, share in sorted(by_heading.items()))
    least, greatest = min(by_heading.values()), max(by_heading.values())
    kind = "round" if greatest - least <= ROUND else "pyramidal" if by_heading.get(45.0) == least else "not round"
    return f"{kind}: {told} of mu N"


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


def _call(told: Sequence[Mapping[str, Any]]) -> str:
    """The call that is wrong as shipped in the fewest situations, and in which; none if it is wrong in most."""
    wrong = {}
    for each in told:
        cells = each["rows"][0]["cells"] if each["rows"] else {}
        wrong[each["call"]] = [f"{name}: {said}" for name, said in cells.items() if said not in ("right", "not run")]
    best = min(wrong, key=lambda call: len(wrong[call]), default="")
    if not best or 2 * len(wrong[best]) > len(readings.LAWS):
        return ""
    return f"{best} ({'; '.join(wrong[best])})" if wrong[best] else best
