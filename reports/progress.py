"""Runs a plan with a progress line on stderr; what finished is kept, the same command resumes."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from adapters.trajectory import load_trajectory
from reports.stages import stage, warm_up
from validation.cells import Slot, prepare
from validation.store import Run, Store
from validation.tracks import record, representatives
from validation.workers import TIMEOUT, run_cells


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
) -> Run:
    """Run what the store does not have yet of this plan; the observations are in the store afterwards.

    ``finish`` marks the run as complete; a bench does so itself, after its timings.
    """
    run, done = store.start(title, slots, fresh)
    todo = [slot for slot in slots if slot.key() not in done]
    if done:
        console.print(f"resuming run {run.id}: {len(done)} of {len(slots)} cells are done")
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
    )
    jobs = jobs or min(len(todo) or 1, os.cpu_count() or 1)
    warm_up(todo, jobs, console)
    if keep is not None:
        keep.mkdir(parents=True, exist_ok=True)
    shown = representatives(slots) if finish else set()
    with (
        stage(console, f"{len(todo)} cells"),
        TemporaryDirectory(prefix="crosscheck-") as scratch,
        Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as progress,
    ):
        task = progress.add_task("running cells", total=len(slots), completed=len(slots) - len(todo))
        try:
            folder = Path(scratch)
            paths = {slot: (keep or folder) / f"{slot.key()}.npz" for slot in todo if keep or slot in shown}
            for observation in run_cells(todo, jobs, timeout, keep=paths.get):
                if observation.slot in shown:
                    _keep_recording(store, run, observation.slot, paths[observation.slot])
                store.add(run, observation)
                progress.update(task, advance=1, description=f"{observation.slot.scene} on {observation.slot.engine}")
        except KeyboardInterrupt:
            console.print("interrupted: what finished is kept, the same command resumes")
            raise
    if finish:
        store.finish(run)
    return run


def _keep_recording(store: Store, run: Run, slot: Slot, path: Path) -> None:
    """Keep what a replay shows; a cell that was refused or crashed left no trajectory."""
    if path.exists():
        prepared = prepare(slot)
        store.add_recording(run, slot, record(prepared.canonical, prepared.scene, load_trajectory(path)))
