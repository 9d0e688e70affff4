"""Stages of a long command on stderr: name, expected time, actual time."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from rich.console import Console
from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn
from rich.text import Text

from validation.cells import Slot
from validation.running.warming import Warming


def clock(seconds: float) -> str:
    """``8 s``, ``3 min 05 s``."""
    whole = round(seconds)
    return f"{whole} s" if whole < 60 else f"{whole // 60} min {whole % 60:02d} s"


def say(console: Console, text: str) -> None:
    """One line, without wrapping and markup."""
    console.print(Text(text), soft_wrap=True)


def _busy() -> str:
    """Addition to the expected time of a stage if cores are not idle."""
    load, cores = os.getloadavg()[0] if hasattr(os, "getloadavg") else 0.0, os.cpu_count() or 1
    return f"; longer now, the machine is busy (load {load:.0f} on {cores} cores)" if load > 0.5 * cores else ""


@contextmanager
def stage(console: Console, name: str) -> Iterator[None]:
    """Print the time of the block, unless it fails."""
    started = time.monotonic()
    yield
    say(console, f"{name}: {clock(time.monotonic() - started)}")


def warm_up(slots: Sequence[Slot], jobs: int, console: Console) -> list[str]:
    """Compile the code that the engines of these cases compile at their first steps, outside timings and time limits.

    Returns engine and dimension of each compilation.
    """
    warming = Warming(slots)
    names: list[str] = []
    if not len(warming):
        return names
    jobs = jobs or os.cpu_count() or 1
    expected = clock(warming.estimate(jobs))
    if warming.begun:
        say(console, "kernels are compiled; checking what else these cases need")
    else:
        say(console, f"compiling the solver's kernels (once): about {expected} on idle cores{_busy()}")
    columns = (SpinnerColumn(), TextColumn("{task.description}", markup=False), TimeElapsedColumn())
    with (
        stage(console, "compiled"),
        Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as progress,
    ):
        task = progress.add_task(f"compiling, about {expected}", total=len(warming))
        for done in warming.run(jobs):
            names.append(done)
            progress.update(task, advance=1, description=f"compiled {done}; about {expected} in all")
    return names
