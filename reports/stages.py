"""Stages of a long command on stderr: name, expected time, actual time."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

from rich.console import Console
from rich.text import Text

from validation.running.warming import Part

#: How long all kernels of our solver take: 1 min 10 s and 2 min 40 s on idle machines with 2 cores of two kinds.
WAIT = "one to three minutes"


def clock(seconds: float) -> str:
    """``8 s``, ``3 min 05 s``."""
    whole = round(seconds)
    return f"{whole} s" if whole < 60 else f"{whole // 60} min {whole % 60:02d} s"


def say(console: Console, text: str) -> None:
    """One line, without wrapping and markup."""
    console.print(Text(text), soft_wrap=True)


@contextmanager
def stage(console: Console, name: str) -> Iterator[None]:
    """Print the time of the block, unless it fails."""
    started = time.monotonic()
    yield
    say(console, f"{name}: {clock(time.monotonic() - started)}")


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
