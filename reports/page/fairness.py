"""Fairness sheet: everything that a maintainer needs to check, or to contest, the treatment of an engine."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from adapters import registry
from adapters.conformance.faults import FAULTS
from adapters.engine import EngineFacts
from adapters.engine_folder import laws_of
from reports.fixes import Change
from reports.page.choosing import Cure, cures
from reports.page.conclusions import FindingFamily, findings
from reports.page.source import Source
from reports.page.verdicts import slug
from reports.wording import number, setting_text
from validation.cells import Observation, slot_from_dict
from validation.findings import Unsupported
from validation.findings.files import findings_of


@dataclass(frozen=True)
class SettingLine:
    """One setting of a profile; ``where`` names the scenes if the value depends on the needs of a scene."""

    name: str
    value: str
    where: str
    because: str
    source: str


@dataclass(frozen=True)
class ReceiptLine:
    """One property check of a profile, in the case whose measurement is farthest from the declared value."""

    quantity: str
    asked: str
    declared: str
    measured: str
    holds: str
    differs: bool
    because: str


@dataclass(frozen=True)
class ProfileSheet:
    """A profile's settings, property checks, and necessary changes of the start state."""

    name: str
    settings: list[SettingLine]
    receipts: list[ReceiptLine]
    changes: list[str]


@dataclass(frozen=True)
class Law:
    """Deviation laws of one mechanism."""

    profiles: str
    where: str
    because: str
    source: str
    explained: int


@dataclass(frozen=True)
class Listed:
    """One cause of the list of known failures, with the number of its rows in this run."""

    id: str
    text: str
    source: str
    where: str
    count: int


@dataclass(frozen=True)
class EngineSheet:
    """Everything about one engine."""

    name: str
    anchor: str
    facts: EngineFacts | None
    versions: str
    profiles: list[ProfileSheet]
    laws: list[Law]
    listed: list[Listed]
    has_list: bool
    unsupported: list[tuple[str, str, int]]


@dataclass(frozen=True)
class Fairness:
    """The whole sheet; the failures of our own ``solver`` are shown first."""

    solver: str
    ours: list[tuple[str, int, list[FindingFamily]]]
    cures: list[Cure]
    engines: list[EngineSheet]
    planted: Mapping[str, str]


def fairness(source: Source) -> Fairness:
    """Compute the sheet."""
    solver = registry.solver()
    own = [(mark, sum(f.count for f in fs), fs) for mark, _, every in findings(source)
           if (fs := [f for f in every if f.engine == solver])]  # fmt: skip
    return Fairness(solver, own, _once(cures(source)), [_sheet(source, name) for name in source.engines], _planted())


def _planted() -> dict[str, str]:
    """Each planted fault of the conformance kit's self-test, its sizes, and the check that must notice it."""
    return {
        f"{name} ({', '.join(f'{size:g}' for size in fault.sizes)} {fault.unit})" if fault.sizes else name: fault.check
        for name, fault in FAULTS.items()
    }


def _once(every: Iterable[Cure]) -> list[Cure]:
    """One fix per engine and scene, since a fix in 2-D also fixes 3-D; each table of settings is shown once.

    Lines to paste are left out where they equal those of the scene with the table.
    """
    first: dict[tuple[str, str], Cure] = {}
    first_with: dict[tuple[str, tuple[Change, ...]], Cure] = {}
    for cure in every:
        if (cure.engine, cure.scene) not in first:
            same = first_with.setdefault((cure.engine, tuple(cure.changes)), cure)
            if same is not cure:
                cure = replace(cure, like=same.scene, paste="" if cure.paste == same.paste else cure.paste)
            first[cure.engine, cure.scene] = cure
    return list(first.values())


def _sheet(source: Source, engine: str) -> EngineSheet:
    own = [o for o in source.observations if o.slot.engine == engine]
    profiles = list(dict.fromkeys(o.slot.profile for o in own))
    sheets = [_profile(name, [o for o in own if o.slot.profile == name]) for name in profiles]
    versions = ", ".join(dict.fromkeys(o.engine_version for o in own if o.engine_version))
    return EngineSheet(
        engine, slug("fairness", engine), registry.facts(engine), versions, sheets, _laws(source, engine),
        _listed(source, engine), findings_of(engine) is not None, _unsupported(own),
    )  # fmt: skip


def _profile(name: str, observations: Sequence[Observation]) -> ProfileSheet:
    changes = dict.fromkeys(text for o in observations for text in o.initial_change)
    return ProfileSheet(name, _settings(observations), _receipts(observations), list(changes))


def _settings(observations: Sequence[Observation]) -> list[SettingLine]:
    """One line per setting and value; iteration counts of a sweep are no part of a profile."""
    found: dict[str, dict[tuple[str, str, str], dict[str, None]]] = defaultdict(lambda: defaultdict(dict))
    for o in observations:
        if o.slot.iterations is None:
            for s in o.settings:
                key = (setting_text(s["value"]), s["because"], s["source"])
                found[s["name"]][key][f"{o.slot.scene} {o.slot.dimension}-D"] = None
    everywhere = {where for values in found.values() for scenes in values.values() for where in scenes}
    lines = []
    for name, values in found.items():
        merged: dict[tuple[str, str], list[str]] = defaultdict(list)
        for (value, because, origin), scenes in values.items():
            covered = scenes.keys() >= everywhere
            merged[because, origin].append(value if covered else f"{value} ({_where(scenes)})")
        for (because, origin), texts in merged.items():
            shown = "; ".join(texts[:4]) + (f"; and {len(texts) - 4} more" if len(texts) > 4 else "")
            lines.append(SettingLine(name, shown, "", because, origin))
    return lines


def _where(scenes: Iterable[str]) -> str:
    """``impact, stack 3-D``: the dimension only for scenes with just one of them."""
    dimensions: dict[str, list[str]] = defaultdict(list)
    for text in scenes:
        name, _, dimension = text.rpartition(" ")
        dimensions[name].append(dimension)
    return ", ".join(name if len(own) > 1 else f"{name} {own[0]}" for name, own in dimensions.items())


def _receipts(observations: Sequence[Observation]) -> list[ReceiptLine]:
    """Per quantity the property check that is closest to the edge of its band, or farthest outside."""
    groups: dict[str, list[Mapping[str, Any]]] = defaultdict(list)
    for o in observations:
        for slip in o.receipts:
            groups[slip["quantity"]].append(slip)
    lines = []
    for quantity, slips in groups.items():
        measured = [s for s in slips if isinstance(s["measured"], float | int) and s["measured"] == s["measured"]]
        held = sum(bool(s["holds"]) for s in slips)
        if not measured:
            lines.append(
                ReceiptLine(quantity, "–", "–", "not measured", f"{held}/{len(slips)}", False, slips[0]["because"])
            )
            continue
        worst = max(
            measured, key=lambda s: (not s["holds"], abs(s["measured"] - s["declared"]) / (s["band"] or 1e-300))
        )
        lines.append(ReceiptLine(
            quantity, number(worst["asked"], 4), f"{number(worst['declared'], 4)} ± {number(worst['band'], 2)}",
            number(worst["measured"], 6), f"{held}/{len(slips)}", worst["declared"] != worst["asked"], worst["because"],
        ))  # fmt: skip
    return lines


def _laws(source: Source, engine: str) -> list[Law]:
    """Laws by mechanism: their profiles, scenes and metrics, and the number of rows of this run that they explain."""
    groups: dict[tuple[str, str], dict[str, dict[str, None]]] = defaultdict(lambda: {"profiles": {}, "where": {}})
    for law in laws_of(engine):
        group = groups[law.because, law.source]
        group["profiles"] |= dict.fromkeys(law.profiles)
        group["where"][f"{law.scene}/{law.metric.replace('[[]', '[')}"] = None
    explained = [row["reason"] for row in source.of(engine=engine, standing="explained")]
    return [
        Law(", ".join(g["profiles"]), ", ".join(g["where"]), because, origin, sum(because in r for r in explained))
        for (because, origin), g in groups.items()
    ]


def _listed(source: Source, engine: str) -> list[Listed]:
    """Causes of known failures and of unsupported cases of this engine, with their numbers of rows in this run."""
    findings = findings_of(engine)
    if findings is None:
        return []
    rows = [row["reason"] for row in source.of(engine=engine) if row["standing"] == "known"]
    found = []
    for family in findings.families.values():
        where = f"{', '.join(family.profiles)} on {family.scene}/{', '.join(family.metrics)}"
        count = sum(family.reason in text for text in rows)
        found.append(Listed(family.id, family.reason, f"{family.source} (releases {family.releases})", where, count))
    for entry in findings.unsupported:
        asked = (f"{name}={value:g}" for name, value in entry.params)
        where = " ".join((entry.scene, *([f"{entry.dimension}-D"] if entry.dimension else []), *asked))
        count = sum(1 for row in source.of(engine=engine, outcome="unsupported") if _is_about(row, entry))
        found.append(Listed(entry.id, entry.reason, entry.source, where, count))
    return found


def _is_about(row: Mapping[str, Any], entry: Unsupported) -> bool:
    return row["standing"] == "known" and entry.covers(slot_from_dict(row["slot"]))


def _unsupported(observations: Iterable[Observation]) -> list[tuple[str, str, int]]:
    """Cases that the engine cannot run, with the reason."""
    counts: dict[tuple[str, str], int] = defaultdict(int)
    for o in observations:
        if o.outcome.value in ("unsupported", "not_installed"):
            counts[f"{o.slot.profile} on {o.slot.scene} {o.slot.dimension}-D", o.reason] += 1
    return [(where, reason, n) for (where, reason), n in counts.items()]
