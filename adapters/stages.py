"""Where the time of a command goes: wall and CPU time of its stages, on request (``crosscheck --timings``).

    with stage("judging"):        or        @stage("judging")
        ...                                 def rows_of(...): ...

A stage within another one counts for itself only, unless the outer one counts whole. Until `begin` is called stages do
nothing. A process that runs cases sends its sums with its answers (`taken`), and the command adds them (`add`).
"""

from __future__ import annotations

import time
from collections.abc import Iterable
from contextlib import ContextDecorator

#: Stages of the command, and of processes that run cases.
START, OTHER = "start and imports", "other"
BUILDING, STEPPING, READING = "building worlds", "steps of the engine", "reading states back"
#: Name, how often, wall time [s] and CPU time [s] of a stage.
Sum = tuple[str, int, float, float]


class _Clock:
    """Sums of one process by stage, and those that other processes have sent."""

    def __init__(self, wall: float) -> None:
        self.sums: dict[str, list[float]] = {START: [1, wall, time.process_time()]}
        self.sent: dict[str, list[float]] = {}
        self.open = [OTHER]
        self.wholes = 0
        self.now = time.monotonic(), time.process_time()

    def charge(self, count: int) -> None:
        """Charge the time since the last change of stage to the innermost one."""
        now = time.monotonic(), time.process_time()
        add_to(self.sums, [(self.open[-1], count, now[0] - self.now[0], now[1] - self.now[1])])
        self.now = now


_clock: _Clock | None = None


class stage(ContextDecorator):
    """A part of a command's time.

    Parameters
    ----------
    name
        What a reader calls it.
    whole
        Whether stages within it count for it.
    """

    def __init__(self, name: str, whole: bool = False) -> None:
        self.name, self.whole = name, whole

    def __enter__(self) -> None:
        if _clock is not None:
            _clock.charge(0)
            _clock.open.append(_clock.open[-1] if _clock.wholes else self.name)
            _clock.wholes += self.whole

    def __exit__(self, *error: object) -> None:
        if _clock is not None:
            _clock.wholes -= self.whole
            _clock.charge(not _clock.wholes)
            _clock.open.pop()


def begin(wall: float = 0.0) -> None:
    """Measure from now on; ``wall`` [s] is the time that the process has taken so far, where it is known."""
    global _clock
    _clock = _Clock(wall)


def end() -> None:
    """Measure no longer."""
    global _clock
    _clock = None


def is_on() -> bool:
    """Whether stages are measured in this process."""
    return _clock is not None


def taken() -> list[Sum]:
    """Sums of this process since the last call."""
    if _clock is None:
        return []
    _clock.charge(0)
    found, _clock.sums = [(name, int(n), wall, cpu) for name, (n, wall, cpu) in _clock.sums.items()], {}
    return found


def add(sums: Iterable[Sum]) -> None:
    """Add the sums of another process."""
    if _clock is not None:
        add_to(_clock.sent, sums)


def sent() -> list[Sum]:
    """Sums of other processes together."""
    return [(name, int(n), wall, cpu) for name, (n, wall, cpu) in _clock.sent.items()] if _clock else []


def add_to(sums: dict[str, list[float]], more: Iterable[Sum]) -> None:
    """Add sums to others, by name."""
    for name, *numbers in more:
        old = sums.setdefault(name, [0, 0.0, 0.0])
        old[:] = (a + b for a, b in zip(old, numbers, strict=True))
