"""The sample of all mutants as it is kept: sample.csv, and its part of score.md."""

from __future__ import annotations

import csv
from dataclasses import astuple, dataclass, fields
from pathlib import Path

from scipy.stats import binomtest
from subjects import PACKAGES

DRAWN = Path(__file__).resolve().parent / "sample.csv"
#: Engines that are set apart: their tests are skipped where they are not installed.
APART = tuple(f"adapters/{name}/" for name in ("box2d", "box2d3", "rapier", "dart", "drake", "physx", "newton"))
#: Seconds of CPU of a test file that are recorded, and of tests that are run against one mutant.
RECORDED, SPENT = 30.0, 30.0
#: Seconds of CPU of the shared fixtures of test files that are run against one mutant.
SHARED = 30.0
#: What lives meets further tests that reach its statements: seconds of CPU of these, and of their files' fixtures.
FURTHER, SHARED_FURTHER = 90.0, 60.0
#: Test files whose record ended early of which the rest meets what survives, and seconds of CPU of each.
REST_OF, LONGEST = 2, 30.0
KILLED, SURVIVED, TIMED, UNREACHED, UNSHOWN = "killed", "survived", "time", "unreached", "unshown"
#: What became of a mutant whose statements have changed since it was drawn.
GONE = "gone"
#: Verdicts that count as noticed: what only time ended is noticed as well.
NOTICED = (KILLED, TIMED)


@dataclass(frozen=True)
class Drawn:
    """A mutant that was drawn, and what became of it.

    ``of`` is the hash of everything that could be drawn, ``now`` what became of a survivor since, with tests that were
    written for it: the estimate is made of ``verdict`` alone, for what is mended because it was drawn says nothing of
    the others. ``met`` says what could notice it: a sample stays what it was drawn with.
    """

    seed: int
    number: int
    of: str
    module: str
    function: str
    change: str
    verdict: str
    tests: int
    failed: str
    now: str = ""
    reason: str = ""
    met: str = ""


#: What a mutant meets that is drawn today.
MEETS = (
    f"the tests that reach its statements, the cheapest first, its file's fixtures and each earlier case counted, "
    f"for up to {SPENT:g} s of CPU, of those "
    f"that a test file begins within {RECORDED:g} s beside its shared fixtures; then, unless its form tells that it "
    f"changes words, for up to {FURTHER:g} s more the others of them, and for {LONGEST:g} s "
    f"what {REST_OF} of the files that go on has beyond them"
)
#: Without a record: test files that are asked because they name its module, and seconds of CPU of each.
NEAR, NEAR_SECONDS = 8, 20.0
MEETS_NEAR = (
    f"up to {NEAR} test files that name its module or function, nearest first and kept tables last, for "
    f"{NEAR_SECONDS:g} s of CPU each, one case of every test first, whether or not they reach it"
)


def stored() -> list[Drawn]:
    """What was drawn before."""
    if not DRAWN.exists():
        return []
    with DRAWN.open(newline="", encoding="utf-8") as stream:
        return [Drawn(**{**row, **{key: int(row[key]) for key in ("seed", "number", "tests")}})
                for row in csv.DictReader(stream)]  # fmt: skip


def write(rows: list[Drawn]) -> None:
    """Write what was drawn, in place of what stood there."""
    with DRAWN.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(field.name for field in fields(Drawn))
        writer.writerows(astuple(row) for row in sorted(rows, key=lambda row: (row.seed, row.number)))


def table(rows: list[Drawn]) -> list[str]:
    """Lines for score.md: share that is noticed with its exact (Clopper-Pearson) 95 % interval, and the survivors."""
    if not rows:
        return []
    noticed = [row for row in rows if row.verdict in NOTICED]
    interval = binomtest(len(noticed), len(rows)).proportion_ci(0.95, method="exact")
    seeds = {seed: [row for row in rows if row.seed == seed] for seed in dict.fromkeys(row.seed for row in rows)}
    each = (f"{seed} ({sum(row.verdict in NOTICED for row in own)} of {len(own)})" for seed, own in seeds.items())
    lines = [
        "", "## A sample of all modules", "",
        f"Written by `make mutants-sample`: {len(rows)} mutants, drawn by the seed {' and '.join(each)} from all of "
        f"the three packages but {', '.join(APART)}, whose tests need engines that are set apart; sources "
        f"`{rows[0].of}`. "
        f"A mutant met {rows[0].met}. A survivor may be one that other tests notice.", "",
        f"**{len(noticed)} of {len(rows)} are noticed, {100.0 * len(noticed) / len(rows):.1f} % (95 %: "
        f"{100.0 * interval.low:.1f} to {100.0 * interval.high:.1f} %).**", "",
        "| package | drawn | killed | ended by time | survived | no test reaches it | test fails without it |",
        "|---|---|---|---|---|---|---|",
    ]  # fmt: skip
    for package in PACKAGES:
        own = [row.verdict for row in rows if row.module.startswith(f"{package}/")]
        each = (own.count(verdict) for verdict in (KILLED, TIMED, SURVIVED, UNREACHED, UNSHOWN))
        lines.append(f"| {package} | {len(own)} | {' | '.join(map(str, each))} |")
    missed = [row for row in rows if row.verdict not in NOTICED]
    because = sum(bool(row.reason) for row in missed)
    lines += [
        "", f"Of the {len(missed)} that are not noticed {because} have a reason: they change words only, or nothing "
        "that can be seen. They count as not noticed all the same. *Since* is what tests that were written for them "
        f"make of the others, *{GONE}* where the code is another:", "",
        "| function | change | verdict | since | reason |", "|---|---|---|---|---|",
    ]  # fmt: skip
    for row in rows:
        if row.verdict not in NOTICED:
            change = row.change.replace("|", "\\|")
            lines.append(f"| {row.function} | `{change}` | {row.verdict} | {row.now} | {row.reason} |")
    return lines
