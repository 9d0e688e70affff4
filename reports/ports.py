"""Ports of an engine beside it: a line for each case, from the rows that the table keeps."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from adapters import registry
from adapters.law.single_precision import ROUNDINGS
from validation.releases.ports import LOST, MOVES, SHARE, proof_of

Row = Mapping[str, str]
#: Verdicts without a comparison of motions, in words.
UNMOVED = {
    "unsupported": "unsupported",
    "lost": "lost in round-off",
    "failed": "failed",
}


def sentence(row: Row) -> str:
    """What was found in one case."""
    if row["verdict"] in UNMOVED:
        return ": ".join(filter(None, (UNMOVED[row["verdict"]], row["because"])))
    until = f"{row['until']} s" + ("" if row["until"] == row["end"] else f" of {row['end']} s")
    if row["verdict"] == "same":
        proof = f"; to the end with {row['proof']}" if row["proof"] else ""
        return f"same but for round-off (up to {row['apart']} m) until {until}{proof}"
    how = (
        f": {row['because']}"
        if row["because"]
        else f": by {row['apart']} m in {row['body']} from {row['since']} s on, until {until}"
    )
    return f"differs{how}; the same with {row['proof']}" if row["proof"] else f"differs, no cause found{how}"


def case_of(row: Row) -> str:
    """``stack 3-D n=5 default``."""
    return " ".join(text for text in (row["scene"], f"{row['dimension']}-D", row["params"], row["profile"]) if text)


def counts(rows: Sequence[Row], port: str) -> str:
    """Number of cases by verdict; of those that differ also how many are the same with no setting."""
    own = [row for row in rows if row["port"] == port]
    count = Counter(row["verdict"] for row in own)
    unknown = sum(not row["proof"] for row in own if row["verdict"] == "differs")
    words = {"same": "same", "differs": "differ" + (f" ({unknown} with no cause found)" if unknown else ""), **UNMOVED}
    return f"{port}: {', '.join(f'{count[verdict]} {said}' for verdict, said in words.items() if count[verdict])}"


def causes(rows: Sequence[Row], ports: Sequence[str]) -> list[tuple[str, str, list[str]]]:
    """Causes of differences, the settings that prove them, and the number of cases by port; most frequent first."""
    found: dict[tuple[str, str], Counter[str]] = {}
    for row in rows:
        if row["verdict"] == "differs" and row["proof"]:
            engine = registry.adapter(row["port"])
            switches = {proof_of(switched): cause for cause, switched in engine.switches.items()} if engine else {}
            found.setdefault((switches.get(row["proof"], ""), row["proof"]), Counter())[row["port"]] += 1
    often = sorted(found, key=lambda each: -found[each].total())
    return [(cause, proof, [str(found[cause, proof][port] or "") for port in ports]) for cause, proof in often]


def told(rows: Sequence[Row]) -> dict[str, Any]:
    """What the page shows of a kept table: a row for each case, a column for each port."""
    ports = sorted({row["port"] for row in rows})
    cases: dict[str, dict[str, str]] = {}
    for row in rows:
        cases.setdefault(case_of(row), {})[row["port"]] = sentence(row)
    return {
        "releases": " and ".join(sorted({row["release"] for row in rows})),
        "ports": ports,
        "causes": causes(rows, ports),
        "counts": [counts(rows, port) for port in ports],
        "cases": [(case, [cells.get(port, "not run") for port in ports]) for case, cells in sorted(cases.items())],
        "moves": MOVES,
        "roundings": ROUNDINGS,
        "share": SHARE,
        "lost": 100.0 * LOST,
    }
