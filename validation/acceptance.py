"""Turns the FAIL rows of a run into an engine's list of known findings; never without a written reason."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from pathlib import Path

from validation.canonical import Check
from validation.cells import Slot, slot_from_dict
from validation.findings import Key, listed, reason_for, row_key, write_list
from validation.plan import in_quick_suite
from validation.rows import Row
from validation.verdicts import is_marginal


def accept(rows: Iterable[Row], engines: Iterable[str], folder: Path | None = None) -> tuple[dict[str, int], list[Row]]:
    """List what fails in ``rows`` of the quick suite, keeping listed rows of slots that did not run.

    Returns
    -------
    Number of listed rows per engine, and the rows for which no reason is written (they stay *new*).
    """
    chosen = set(engines)
    entries: dict[str, dict[Key, tuple[str, str]]] = {name: {} for name in chosen}
    seen: dict[str, set[Key]] = defaultdict(set)
    unexplained = []
    for row in rows:
        if row.engine not in chosen:
            continue
        slot = slot_from_dict(row.slot)
        key = row_key(slot, row.metric)
        seen[row.engine].add(key)
        if not in_quick_suite(slot):
            continue
        status = _status(row)
        if status is None:
            continue
        reason = reason_for(row.engine, key)
        if reason is not None:
            entries[row.engine][key] = (status, reason.id)
        elif row.physics == "fail":
            unexplained.append(row)
    for engine in chosen:
        kept = {k: (f.status, f.reason.id) for k, f in (listed(engine) or {}).items() if k not in seen[engine]}
        write_list(engine, [(k, *entry) for k, entry in {**kept, **entries[engine]}.items()], folder)
    return {engine: len(found) for engine, found in entries.items()}, unexplained


def _status(row: Row) -> str | None:
    """``known``, ``marginal`` or None (nothing to list)."""
    if row.outcome == "diverged":
        return "known"
    if row.value is None or row.physics is None or row.standing == "explained":
        return None
    check = Check(row.metric, row.unit, row.truth, row.tolerance, row.because, row.source)
    # A margin is listed only where the answer may depend on the last bits: cells with many coupled contacts.
    if is_marginal(row.value, check) and _chaotic(slot_from_dict(row.slot), row):
        return "marginal"
    return "known" if row.physics == "fail" else None


def _chaotic(slot: Slot, row: Row) -> bool:
    """Several coupled contacts that are not solved to the end: last bits may decide on another CPU."""
    return float(row.params.get("n", 1.0)) > 1.0
