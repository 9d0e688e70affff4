"""Stages of a command on stderr: what a long one is doing, and on request where the time of any went."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table
from rich.text import Text

from adapters import stages
from validation.running.warming import Part

#: Least time of a stage that is shown [s].
LEAST = 0.005
#: How long all kernels of our solver take: 1 min 10 s and 2 min 40 s on idle machines with 2 cores of two kinds.
WAIT = "one to three minutes on idle cores"


def clock(seconds: float) -> str:
    """``8 s``, ``3 min 05 s``."""
    whole = round(seconds)
    return f"{whole} s" if whole < 60 else f"{whole // 60} min {whole % 60:02d} s"


def say(console: Console, text: str) -> None:
    """One line, without wrapping and markup."""
    console.print(Text(text), soft_wrap=True)


@contextmanager
def stage(console: Console, name: str) -> Iterator[None]:
    """Print the time of the block, unless it fails; it is a stage of the command (`adapters.stages`)."""
    started = time.monotonic()
    with stages.stage(name):
        yield
    say(console, f"{name}: {clock(time.monotonic() - started)}")


def timings(console: Console) -> None:
    """Print where the time of the command went, by stage: the command itself, the processes of its cases, all others.

    The latter are known when they have ended, and by their CPU time alone.
    """
    own, cases, children = stages.taken(), stages.sent(), os.times()
    left = children.children_user + children.children_system - sum(cpu for *_, cpu in cases)
    table = Table(box=SIMPLE_HEAD, show_edge=False, pad_edge=False, padding=(0, 2, 0, 0))
    for heading in ("where the time went", "times", "wall [s]", "CPU [s]"):
        table.add_column(heading, justify="left" if heading.startswith("where") else "right")
    for title, sums in (("this process", own), ("processes of cases, together", cases)):
        if sums:
            total = [sum(column) for column in zip(*((wall, cpu) for *_, wall, cpu in sums), strict=True)]
            table.add_row(Text(title, style="bold"), "", *(f"{seconds:.2f}" for seconds in total))
        for name, count, wall, cpu in sorted(sums, key=lambda each: -each[3]):
            if max(wall, cpu) >= LEAST:
                table.add_row(Text(f"  {name}"), str(count or ""), f"{wall:.2f}", f"{cpu:.2f}")
    if left >= LEAST:
        table.add_row(Text("other processes, and starts of these", style="bold"), "", "", f"{left:.2f}")
    console.print(table)


def compiling(parts: Sequence[Part], console: Console, beside: bool = False) -> Callable[[Part], None]:
    """Say which kernels are compiled now; returns a function that says of each part when it is done.

    ``beside``: whether there are cases that run meanwhile.
    """
    started = time.monotonic()
    if parts:
        engines = ", ".join(dict.fromkeys(part.key[0] for part in parts))
        others = "; other engines run meanwhile" if beside else ""
        say(console, f"compiling the kernels of {engines}, once: {WAIT}{others}")

    def done(part: Part) -> None:
        say(console, f"compiled {part} after {clock(time.monotonic() - started)}")

    return done
