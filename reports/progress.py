"""Runs a plan with a progress line on stderr; finished cases are stored, and the same command resumes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import nullcontext
from functools import partial
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from reports.stages import compiling, stage
from reports.wording import plural
from validation.cells import Observation, Slot
from validation.records.store import Run, Store
from validation.running.tracks import representatives
from validation.running.warming import key_of, missing
from validation.workers import TIMEOUT, run_cells
from validation.workers.cluster import run_cells_on


def progress_on(console: Console) -> Progress:
    """A line of progress that goes when it is done, with the time that is left; nothing where no terminal shows it."""
    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
    )
    return Progress(*columns, console=console, transient=True, disable=not console.is_terminal)


def run_plan(
    store: Store,
    title: str,
    slots: Sequence[Slot],
    console: Console,
    jobs: int = 0,
    timeout: float = TIMEOUT,
    keep: Path | None = None,
    fresh: bool = False,
    finish: bool = True,
    recorded: bool = True,
    cluster: str = "",
    known: Sequence[Observation] = (),
    heard: Callable[[Run, Observation], None] = lambda run, observation: None,
    beside: tuple[str, Sequence[Slot]] = ("", ()),
) -> Run:
    """Run the cases of this plan that the store lacks; the observations are in the store afterwards.

    ``finish`` marks the run as complete; others do so themselves, after their timings or files. A run with missing
    cases, as of those left after time-outs, is not complete: it prints that, and the same command resumes it. Motions
    are recorded for replays if ``recorded``. ``cluster`` is the address of a Dask cluster to run on; its motions are
    not recorded, and OUT/cluster.jsonl lists which worker ran each case. ``known`` are results of another run for cases
    of this plan, which are stored instead of being run again. ``beside`` are title and cases of a run that the same
    workers begin: those that this plan lacks are stored there.
    """
    other, more = _begun(store, *beside, fresh, slots)
    run, done = store.start(title, slots, fresh)
    todo = [slot for slot in slots if slot.key() not in done]
    if done:
        console.print(f"resuming run {run.id}: {len(done)} of {plural(len(slots), 'case')} done")
        for observation in store.observations(run):
            heard(run, observation)
    left: dict[str, int] = {}

    def leave(slot: Slot, reason: str) -> None:
        left[reason] = left.get(reason, 0) + 1

    todo = [*_without(known, store, run, todo), *more]
    parts = [] if cluster else missing(todo)  # machines of a cluster have kernels of their own
    waiting = {part.key for part in parts}
    compiled = compiling(parts, console, any(key_of(slot) not in waiting for slot in todo))
    if keep is not None:
        keep.mkdir(parents=True, exist_ok=True)
    shown = representatives(slots) if recorded else set()
    paths = {slot: keep / f"{slot.key()}.npz" for slot in todo} if keep else {}
    with (
        stage(console, plural(len(todo), "case")) if todo else nullcontext(),
        progress_on(console) as progress,
    ):
        total = len(slots) + len(more)
        task = progress.add_task("running cases", total=total, completed=total - len(todo))
        try:
            record = partial(store.add_recording, run)
            if cluster:
                cells = run_cells_on(cluster, todo, timeout, store.path.parent / "cluster.jsonl", leave)
            else:
                cells = run_cells(todo, jobs, timeout, keep=paths.get, shown=shown, record=record, leave=leave,
                                  parts=parts, compiled=compiled)  # fmt: skip
            apart = set(more)
            for observation in cells:
                if other is not None and observation.slot in apart:
                    store.add(other, observation)
                else:
                    store.add(run, observation)
                    heard(run, observation)
                progress.update(task, advance=1, description=f"{observation.slot.scene} on {observation.slot.engine}")
        except KeyboardInterrupt:
            console.print("interrupted: finished cases are kept; the same command resumes")
            raise
    for reason, count in left.items():
        console.print(f"not run: {plural(count, 'case')}, {reason}", markup=False, highlight=False, soft_wrap=True)
    if store.missing(run):
        console.print("this run is not complete; the same command resumes it", markup=False)
    elif finish:
        store.finish(run)
    return store.run(run.id)


def _begun(
    store: Store, title: str, slots: Sequence[Slot], fresh: bool, others: Sequence[Slot]
) -> tuple[Run | None, list[Slot]]:
    """A run of these cases, and those of them that neither it nor ``others`` have; none without cases."""
    if not slots:
        return None, []
    run, done = store.start(title, slots, fresh)
    known = {slot.key() for slot in others} | done
    return run, [slot for slot in slots if slot.key() not in known]


def _without(known: Sequence[Observation], store: Store, run: Run, todo: Sequence[Slot]) -> list[Slot]:
    """Cases left to run after the known results are stored."""
    asked, answered = set(todo), set()
    for observation in known:
        if observation.slot in asked:
            store.add(run, observation)
            answered.add(observation.slot)
    return [slot for slot in todo if slot not in answered]
