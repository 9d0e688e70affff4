"""Ports of an engine beside it: a line for each case, from the rows that the table keeps."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from adapters import registry
from reports.wording import number
from validation.releases.ports import LOST, MOVES, ROUNDED, SHARE, proof_of

Row = Mapping[str, str]
#: Verdicts without a comparison of motions, in words.
UNMOVED = {
    "unsupported": "unsupported",
    "lost": "lost in round-off",
    "failed": "no result",
}
#: A difference that cannot be seen [m].
SMALL = 1e-3
#: What is counted of a port, in this order.
KINDS = (
    "same",
    "same until round-off has grown",
    f"differ by less than {1e3 * SMALL:g} mm",
    "differ by more",
    "differ with no cause found",
    *UNMOVED.values(),
)


def sentence(row: Row) -> str:
    """What was found in one case."""
    if row["verdict"] in UNMOVED:
        return ": ".join(filter(None, (UNMOVED[row["verdict"]], row["because"])))
    until = f"{row['until']} s" + ("" if row["until"] == row["end"] else f" of {row['end']} s")
    if row["verdict"] == "same":
        proof = f"; to the end with {row['proof']}" if row["proof"] else ""
        grown = f", which grows {number(float(row['growth']))} times" if row["growth"] else ""
        return f"same but for round-off{grown} (up to {row['apart']} m) until {until}{proof}"
    how = (
        f": {row['because']}"
        if row["because"]
        else f": by {row['apart']} m in {row['body']} from {row['since']} s on, until {until}"
    )
    return f"differs{how}; the same with {row['proof']}" if row["proof"] else f"differs, no cause found{how}"


def case_of(row: Row) -> str:
    """``stack 3-D n=5 default``."""
    return " ".join(text for text in (row["scene"], f"{row['dimension']}-D", row["params"], row["profile"]) if text)


def kind_of(row: Row) -> str:
    """Which of `KINDS` a case is."""
    if row["verdict"] in UNMOVED:
        return UNMOVED[row["verdict"]]
    if row["verdict"] == "same":
        return KINDS[0] if row["until"] == row["end"] else KINDS[1]
    if not row["proof"]:
        return KINDS[4]
    return KINDS[2] if not row["because"] and float(row["apart"]) < SMALL else KINDS[3]


def tally(rows: Sequence[Row], port: str) -> dict[str, int]:
    """Number of cases of each of `KINDS`."""
    count = Counter(kind_of(row) for row in rows if row["port"] == port)
    return {kind: count[kind] for kind in KINDS}


def counts(rows: Sequence[Row], port: str) -> str:
    """The same in words; kinds without a case are left out."""
    return f"{port}: {', '.join(f'{count} {kind}' for kind, count in tally(rows, port).items() if count)}"


def causes(rows: Sequence[Row], ports: Sequence[str]) -> list[tuple[str, str, str, list[str]]]:
    """Causes of differences, settings that prove them, largest distance, and number of cases by port; by frequency."""
    found: dict[str, list[Row]] = {}
    told: dict[str, str] = {}  # a port may have no more the setting of a kept row, and another one has
    own: dict[str, dict[str, str]] = {}
    for port in ports:
        engine = registry.adapter(port)
        own[port] = {proof_of(switched): cause for cause, switched in engine.switches.items()} if engine else {}
        told |= own[port]
    for row in rows:
        if row["verdict"] == "differs" and row["proof"]:
            found.setdefault((told | own[row["port"]]).get(row["proof"], ""), []).append(row)
    lines = []
    for cause, cases in sorted(found.items(), key=lambda each: -len(each[1])):
        ends = any(row["because"] for row in cases)
        worst = "the port ends" if ends else f"{number(max(float(row['apart']) for row in cases))} m"
        count = Counter(row["port"] for row in cases)
        proofs = "; or ".join(dict.fromkeys(row["proof"] for row in cases))
        lines.append((cause, proofs, worst, [str(count[port] or "") for port in ports]))
    return lines


def told(rows: Sequence[Row]) -> dict[str, Any]:
    """What the page shows of a kept table: a row for each case, a column for each port."""
    ports = sorted({row["port"] for row in rows})
    cases: dict[str, dict[str, str]] = {}
    for row in rows:
        cases.setdefault(case_of(row), {})[row["port"]] = sentence(row)
    numbers = {kind: [tally(rows, port)[kind] for port in ports] for kind in KINDS}
    numbers["not run"] = [sum(port not in cells for cells in cases.values()) for port in ports]
    return {
        "releases": " and ".join(sorted({row["release"] for row in rows})),
        "ports": ports,
        "precisions": [known.precision if (known := registry.facts(port)) else "" for port in ports],
        "causes": causes(rows, ports),
        "counts": [
            (kind, [str(count or "") for count in counted]) for kind, counted in numbers.items() if any(counted)
        ],
        "cases": [(case, [cells.get(port, "not run") for port in ports]) for case, cells in sorted(cases.items())],
        "moves": MOVES,
        "rounded": ROUNDED,
        "share": SHARE,
        "lost": 100.0 * LOST,
    }
