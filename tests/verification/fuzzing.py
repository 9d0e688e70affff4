"""``certify.py --random N``: compares random scenes with variants of themselves, in processes that may hang or die."""

from __future__ import annotations

import json
import math
import time
from collections import Counter, defaultdict, deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from typing import Any

import click
import numpy as np
from rich.console import Console
from rich.table import Table

from adapters.isolation import Child, Lost
from adapters.isolation.foreign import said_by
from reports.wording import number
from tests.verification.fuzz.trial import attack

#: Number of processes, and time limit for a scene [s], which for the first one includes compilation.
WORKERS, LIMIT = 2, 900.0
#: Message of a process that has imported our packages, and time limit for it [s]: enough on a busy machine with a cold
#: disk.
READY, START = b"ready", 120.0
#: Largest number of seeds in a line.
NAMED = 6
#: Distance from runs to other tolerances beyond which a refused result counts as wrong [m].
WRONG = 1e-6

#: Seed, dimension, and optionally the kind of scene that is drawn.
Job = tuple[int, int] | tuple[int, int, str]


@dataclass
class _Worker:
    child: Child | None = None
    job: Job | None = None
    until: float = 0.0


def serve(connection: Connection) -> None:
    """Compare one scene after the other until the other end closes."""
    connection.send_bytes(READY)
    while True:
        try:
            seed, dimension, *kind = json.loads(connection.recv_bytes())
        except EOFError:
            return
        try:
            answer = attack(seed, dimension, *kind).as_dict()
        except Exception as error:  # a scene that breaks the solver is a result too
            answer = {"seed": seed, "dimension": dimension, "broken": said_by(error)}
        connection.send_bytes(json.dumps(answer).encode())


def show_random(
    console: Console, as_json: bool, count: int, seed: int, dimensions: Sequence[int], chains: bool = False
) -> int:
    """Print the results of random scenes; return 1 for a certified one that differs or a missing one, else 0."""
    found: list[dict[str, Any]] = []
    seeds = range(seed, seed + count)
    jobs: list[Job] = [(s, d, "chains") if chains else (s, d) for d in dimensions for s in seeds]
    with console.status("attacking") as status:
        for answer in attacked(jobs):
            found.append(answer)
            status.update(f"{len(found)} of {len(jobs)}")
    found.sort(key=lambda answer: (answer["dimension"], answer["seed"]))
    if as_json:
        click.echo(json.dumps([{k: _finite(v) for k, v in answer.items()} for answer in found], indent=1))
    bad = 0
    for d in dimensions:
        bad += _print_results(console, d, [answer for answer in found if answer["dimension"] == d])
    return 1 if bad else 0


def attacked(jobs: Sequence[Job], limit: float = LIMIT) -> Iterator[dict[str, Any]]:
    """Yield the result of each scene (seed, dimension) as soon as it ends."""
    waiting, workers = deque(jobs), [_Worker() for _ in range(min(WORKERS, len(jobs)))]
    try:
        while True:
            for worker in workers:
                if worker.job is None and waiting:
                    worker.child = worker.child or _started()
                    worker.job, worker.until = waiting.popleft(), time.monotonic() + limit
                    worker.child.send(json.dumps(worker.job).encode())
            busy = [
                (worker, worker.child, worker.job)
                for worker in workers
                if worker.child is not None and worker.job is not None
            ]
            if not busy:
                return
            watched = [item for _, child, _ in busy for item in child.sentinels]
            wait(watched, max(0.0, min(worker.until for worker, _, _ in busy) - time.monotonic()))
            for worker, child, job in busy:
                late = time.monotonic() > worker.until
                if child.has_answer() or child.ended() or late:
                    try:
                        answer = json.loads(child.receive(0.0))
                    except Lost as lost:
                        child.stop()
                        worker.child = None
                        why = f"no answer after {limit:g} s" if late else str(lost)
                        answer = {"seed": job[0], "dimension": job[1], "broken": why}
                    worker.job = None
                    yield answer
    finally:
        for worker in workers:
            if worker.child is not None:
                worker.child.stop()


def _started() -> Child:
    """Return a process that is ready, so that the time limits of its scenes do not include its start.

    Raises
    ------
    Lost
        If it does not start.
    """
    child = Child(serve)
    child.receive(START)
    return child


def _print_results(console: Console, dimension: int, found: Sequence[dict[str, Any]]) -> int:
    """Print the results of one dimension; return the number of defects."""
    broken = [answer for answer in found if "broken" in answer]
    answered = [answer for answer in found if "broken" not in answer]
    certified = [answer for answer in answered if answer["certified"]]
    refused = [answer for answer in answered if not answer["certified"]]
    differs = [answer for answer in certified if answer["defects"]]
    console.print(
        f"{dimension}-D: {len(found)} scenes, {len(certified)} certified, {len(refused)} refused, "
        f"{len(differs)} certified but different from a variant, {len(broken)} without an answer"
    )
    if certified:
        bounds, distances = (np.array([answer[name] for answer in certified]) for name in ("bound", "off"))
        share = distances / bounds
        text = (
            f"bound X of the certified [m]: half below {np.median(bounds):.1e}, nine tenths {_ninth_decile(bounds):.1e}"
        )
        console.print(f"{text}, all {bounds.max():.1e}")
        text = f"farthest variant over X: half below {np.median(share):.2g}, nine tenths {_ninth_decile(share):.2g}"
        console.print(f"{text}, all {share.max():.2g}")
    if refused:
        console.print(_refusals(refused))
    for answer in differs:
        for name, t, apart, allowed in answer["defects"]:
            console.print(
                f"DEFECT seed {answer['seed']}, {name}: {apart:.2e} m apart at {t:.3g} s, both bounds {allowed:.2e} m"
            )
    for answer in broken:
        console.print(f"NO ANSWER seed {answer['seed']}: {answer['broken']}", soft_wrap=True)
    return len(differs) + len(broken)


def _refusals(refused: Sequence[dict[str, Any]]) -> Table:
    """Conditions that refused scenes, most frequent first: scenes, those refused by it alone, and wrong ones."""
    scenes: dict[str, list[dict[str, Any]]] = defaultdict(list)
    alone: Counter[str] = Counter()
    for answer in refused:
        for name in answer["conditions"]:
            scenes[name].append(answer)
        if len(answer["conditions"]) == 1:
            alone[next(iter(answer["conditions"]))] += 1
    table = Table(title="Refused by", title_justify="left")
    for heading in ("condition", "scenes", "alone", "off", "worst", "seeds"):
        table.add_column(heading, no_wrap=heading != "seeds")
    for name, those in sorted(scenes.items(), key=lambda item: -len(item[1])):
        values = [answer["conditions"][name] for answer in those]
        wrong = sum(not answer["off"] <= WRONG for answer in those)
        worst = max((value for value in values if value == value), default=math.nan)
        seeds = " ".join(str(answer["seed"]) for answer in those[:NAMED]) + (" ..." if len(those) > NAMED else "")
        table.add_row(name, str(len(those)), str(alone[name]), str(wrong), number(worst, 2), seeds)
    table.caption = f"off: those of them that are more than {WRONG:g} m off runs to other tolerances"
    return table


def _ninth_decile(values: Any) -> float:
    return float(np.quantile(values, 0.9))


def _finite(value: Any) -> Any:
    """Value with null for nan and infinity, which JSON does not have."""
    if isinstance(value, dict):
        return {k: _finite(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(v) for v in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
