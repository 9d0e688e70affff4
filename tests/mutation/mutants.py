"""Draw changes of the code by a seed, run the tests that reach each, and print the share that the tests notice.

    coverage of a test run -> N changes -> the tests that reach each changed line, small ones first -> verdicts

`make mutants N=60 SEED=1` changes `adapters`, `validation` and `reports`, `make mutants KERNELS=1` the kernels of the
solver, which run as plain Python (NUMBA_DISABLE_JIT) and take the same bits as compiled ones. What tests reach is
recorded by pytest-cov once, in `make test`, or with CROSSCHECK_ALL=1 in all tests; remove the record when code or
tests have changed.

A change is noticed if a test fails that passes without it. The share is a lower bound: each change meets its tests for
`SPENT` seconds of CPU only, and what a test runs in another process is not recorded. Changes that change nothing stand
in `equivalent.csv`, each with the reason, and are not drawn.
"""

from __future__ import annotations

import argparse
import csv
import os
import re
import sqlite3
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from itertools import islice
from pathlib import Path

import psutil
from coverage import CoverageData
from faults import ROOT, Change, faults, mutants
from scipy.stats import binomtest

#: Seconds of CPU of the tests that one change meets, and of wall time.
SPENT, PATIENCE = 120, 1800
EQUIVALENT = Path(__file__).with_name("equivalent.csv")
NOTICED, TIMED, SURVIVED, UNREACHED = "noticed", "noticed: does not end", "SURVIVED", "NOT REACHED"
FAILED = re.compile(r"^(?:FAILED|ERROR) (\S+?::.*?)(?: - .*)?$", re.MULTILINE)


class Reach:
    """Which tests run which lines, as pytest-cov has recorded it."""

    def __init__(self, record: Path) -> None:
        self.data = CoverageData(str(record))
        self.data.read()
        with sqlite3.connect(record) as database:
            rows = database.execute(
                "select context, sum(length(numbits)) from line_bits join context on context.id = context_id group by 1"
            )
            self.lines = {name.partition("|")[0]: number for name, number in rows}

    def tests(self, change: Change) -> list[str]:
        """Tests that reach a change, those that run the fewest lines first."""
        found = set[str]()
        for module, first, last in change.places:
            lines = self.data.contexts_by_lineno(str(ROOT / module))
            named = (lines.get(line, ()) for line in range(last, first, -1))
            reached = ({name.partition("|")[0] for name in own} - {""} for own in named)
            found |= next(filter(None, reached), set())
        return sorted(found, key=lambda name: (self.lines[name], name))


def run(tree: Path, tests: Sequence[str]) -> tuple[int, str]:
    """Run tests in a copy of the checkout until one fails; pytest's exit status, and the test that failed."""
    with tempfile.NamedTemporaryFile("w", suffix=".txt") as names, tempfile.TemporaryFile("w+") as printed:
        names.write("\n".join(tests))
        names.flush()
        options = ("-x", "-q", *(f"-pno:{name}" for name in ("randomly", "xdist", "cacheprovider")))
        options += ("--hypothesis-profile=ci", f"@{names.name}")
        process = psutil.Popen(
            [sys.executable, "-m", "pytest", *options],
            cwd=tree, env={**os.environ, "PYTHONPATH": str(tree)}, stdout=printed, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        status = ended(process)
        printed.seek(0)
        failed = FAILED.search(printed.read())
    return status, failed.group(1) if failed and status >= 0 else ""


def ended(process: psutil.Popen) -> int:
    """Exit status of a process, -1 if it takes more than `SPENT` or `PATIENCE` and is killed.

    A limit of the kernel would do, but under RLIMIT_CPU the clock of a process counts whole ticks, and a benchmark
    measures zeros.
    """
    start = time.monotonic()
    while True:
        try:
            return int(process.wait(timeout=0.2))
        except psutil.TimeoutExpired:
            used = process.cpu_times()
            if used.user + used.system > SPENT or time.monotonic() - start > PATIENCE:
                for each in (*process.children(recursive=True), process):
                    with suppress(psutil.NoSuchProcess):
                        each.kill()
                process.wait()
                return -1


def verdict(tree: Path, change: Change, tests: Sequence[str]) -> tuple[str, str]:
    """What the tests that reach a change make of it, and the test that noticed it."""
    if not tests:
        return UNREACHED, ""
    path = tree / change.module
    plain = path.read_bytes()
    try:
        path.write_text(change.made(), encoding="utf-8")
        status, failed = run(tree, tests)
        alone = run(tree, tests[:1]) if status < 0 else (0, "")
    finally:
        path.write_bytes(plain)
    if status < 0:  # out of time: noticed where one small test alone does not end
        return (TIMED if alone[0] < 0 else SURVIVED), ""
    if status in (0, 5) or (failed and run(tree, [failed])[0] != 0):
        return SURVIVED, ""
    return NOTICED, failed or "collection of the tests"


@contextmanager
def copied() -> Iterator[Path]:
    """Check the commit out once more, into a temporary folder."""
    with tempfile.TemporaryDirectory(prefix="crosscheck-mutants-") as name:
        tree = Path(name) / "tree"
        subprocess.run(["git", "worktree", "add", "--quiet", "--detach", tree], cwd=ROOT, check=True)
        try:
            yield tree
        finally:
            subprocess.run(["git", "worktree", "remove", "--force", tree], cwd=ROOT, check=True)


def main() -> None:
    """Draw, run and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--record", type=Path, required=True, help="file that pytest-cov has written")
    parser.add_argument("--seed", type=int, default=1, help="of the draw")
    parser.add_argument("--count", type=int, default=60, help="how many are drawn")
    parser.add_argument("--kernels", action="store_true", help="change the solver's kernels")
    parser.add_argument("--only", default="", help="beginning of the paths of modules that are changed")
    options = parser.parse_args()
    with EQUIVALENT.open(newline="", encoding="utf-8") as stream:
        known = {(row["module"], row["change"]) for row in csv.DictReader(stream)}
    drawn = (faults if options.kernels else mutants)(options.seed, options.only)
    drawn = (each for each in drawn if (each.module, each.told) not in known)
    reach, found = Reach(options.record), list[str]()
    with copied() as tree:
        for number, change in enumerate(islice(drawn, options.count), 1):
            said, by = verdict(tree, change, reach.tests(change))
            found.append(said)
            print(f"{number}. {said}: {change.module} {change.function}: {change.told[:160]}\n   {by}", flush=True)
    number = sum(each in (NOTICED, TIMED) for each in found)
    interval = binomtest(number, len(found)).proportion_ci(0.95, method="exact")
    share = f"{number / len(found):.0%}, 95 %: {interval.low:.0%} to {interval.high:.0%}"
    print(f"{number} of {len(found)} are noticed: {share}")


if __name__ == "__main__":
    main()
