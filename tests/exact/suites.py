"""Pose cells of a suite to the event loop, as the adapter poses them to the reference solver.

    python tests/exact/suites.py FILE [--suite quick] [--only TEXT] [--reference]

runs each cell of the profile ``reference``, with the loop unless ``--reference`` is given, certifies and judges it, and
writes one line of JSON for it: outcome, CPU of the run, failed checks, errors of its checks. Of two such files

    python tests/exact/suites.py FILE --against FILE

prints each cell whose outcome or checks differ, and the CPU of both.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from types import MappingProxyType
from typing import Any

from compare import limited

from adapters.engine import EngineError, Setting
from adapters.reference import engine as adapter
from adapters.reference.profiles import REASONS, SOURCE
from adapters.reference.simulation import ReferenceSimulation
from reference_solver import Settings
from reference_solver.exact import Refused
from validation.catalogue import CATALOGUE
from validation.cells import Slot
from validation.judging.rows import rows_of
from validation.running.execution import execute
from validation.running.plan import QUICK_DT, Request, slots


class Posed(ReferenceSimulation):
    """A run whose refusals are those of an engine."""

    cpu = 0.0

    def _refused_as_engines_do(self, name: str, *asked: Any) -> Any:
        begin = time.process_time()
        try:
            return getattr(super(), name)(*asked)
        except Refused as refused:
            raise EngineError(str(refused)) from None
        finally:
            Posed.cpu += time.process_time() - begin

    def advance(self, steps: int) -> None:
        self._refused_as_engines_do("advance", steps)

    def record(self, samples: int, stride: int, contacts: bool) -> Any:
        return self._refused_as_engines_do("record", samples, stride, contacts)


def exact_profile(needs: Any, dt: float) -> list[Setting]:
    """Settings of the loop."""
    settings = vars(Settings.reference(dt))
    return [Setting(k, v, REASONS[k], SOURCE) for k, v in settings.items() if k not in ("dt", "iterations")]


def pose(change: Callable[[Any, str, Any], None] = setattr, reference: bool = False) -> None:
    """Have the profile ``reference`` run the loop from here on, if not ``reference``; ``change`` sets attributes."""
    engine = adapter.ReferenceEngine
    change(adapter, "ReferenceSimulation", Posed)
    if not reference:
        change(engine, "profiles", MappingProxyType({**engine.profiles, "reference": exact_profile}))
        change(engine, "kinds", MappingProxyType({**engine.kinds, "scheme": lambda value: None}))


def cells(suite: str, only: str = "") -> Iterator[tuple[str, Slot]]:
    """Yield the cells of a suite that the profile ``reference`` has, by a key."""
    asked = Request(list(CATALOGUE), ["reference"], ["reference"], dts=(QUICK_DT,), suite=suite)
    for slot in slots(asked):
        key = f"{slot.scene} {slot.dimension}-D {slot.params_text()} {slot.ulp or ''} 1/{1 / slot.dt:g}"
        if only in key:
            yield key, slot


def run(path: Path, suite: str, only: str, reference: bool, limit: float) -> None:
    """Write a line for each cell."""
    pose(reference=reference)
    with path.open("a") as lines:
        for key, slot in cells(suite, only):
            Posed.cpu, begin = 0.0, time.process_time()
            with limited(limit):  # the harness makes an outcome, or a reason of the certificate, of it
                found = execute(slot)
            cpu, whole = Posed.cpu, time.process_time() - begin
            rows = rows_of("", [found])
            full = found.certificate.get("full", {}) if found.certificate else {}
            said = {
                "key": key,
                "outcome": found.outcome.name,
                "reason": found.reason,
                "certified": found.certificate.get("certified") if found.certificate else None,
                "why": (full.get("reasons") or [""])[0],
                "horizon": full.get("horizon"),
                "cpu": cpu,
                "whole": whole,
                "checks": {row.check: [row.physics or row.outcome, row.error] for row in rows},
            }
            lines.write(json.dumps(said, default=str) + "\n")
            lines.flush()
            print(key, said["outcome"], said["certified"], f"{cpu:.2f} {whole:.2f} s", flush=True)


def main() -> None:
    """Run, or compare two files."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", type=Path)
    parser.add_argument("--suite", default="quick")
    parser.add_argument("--only", default="")
    parser.add_argument("--reference", action="store_true")
    parser.add_argument("--against", type=Path)
    parser.add_argument("--limit", type=float, default=60.0, help="CPU of a cell with its certificate")
    asked = parser.parse_args()
    if asked.against is None:
        run(asked.file, asked.suite, asked.only, asked.reference, asked.limit)
        return
    one, other = ({each["key"]: each for each in map(json.loads, path.open())} for path in (asked.file, asked.against))
    same = 0
    for key in [key for key in one if key in other]:
        mine, theirs = one[key], other[key]
        verdicts = [{name: each[0] for name, each in said["checks"].items()} for said in (mine, theirs)]
        if mine["outcome"] == theirs["outcome"] and verdicts[0] == verdicts[1]:
            same += 1
            continue
        differ = [name for name in verdicts[0] if verdicts[0].get(name) != verdicts[1].get(name)]
        print(f"{key}: {mine['outcome']} and {theirs['outcome']}; {differ[:3]}; {mine['reason'] or mine['why']}")
    print(f"{same} of {len(one)} the same; CPU of runs {sum(x['cpu'] for x in one.values()):.1f} s")
    print(f"and {sum(x['cpu'] for x in other.values()):.1f} s")


if __name__ == "__main__":
    main()
