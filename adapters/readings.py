"""What an engine says of contact forces: each public way to read them, and what its numbers mean.

An engine's folder states its own in ``readings.py`` as `READINGS`: the call as people write it, what it returns in
words, and a function that turns it into what can be compared between engines: impulses of the step just made, in world
axes, on a body. Nothing is corrected on the way: what the engine says wrongly comes out wrongly.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from adapters.engine import Array, Engine, Simulation
from adapters.scene import Scene

#: What a reading has: the whole vector, the part along the normal alone, or the sum of sizes of normal parts.
Part = Literal["vector", "normal", "size"]


@dataclass(frozen=True)
class Read:
    """What a reading says after a step of one contact, or of several at once.

    Parameters
    ----------
    other
        The other body by the scene's index; None where the reading does not tell bodies apart.
    impulse
        On the body that was asked for, over the step, in world axes (d,) [N s]; of a `Reading` with ``part="size"``
        one number (1,).
    point
        Where it acts (d,) [m]; None where that is not said.
    """

    other: int | None
    impulse: Array
    point: Array | None = None


@dataclass(frozen=True)
class Cause:
    """Why a reading is wrong.

    Parameters
    ----------
    situations
        Where (`validation.questions.readings.SITUATIONS`); with ``profile`` only there.
    because
        In words.
    set
        Settings with which it is right there; empty where the call itself is so.
    """

    situations: tuple[str, ...]
    because: str
    set: Mapping[str, Any] = field(default_factory=dict)
    profile: str = ""


#: Asks after a step what acts on a body, by the scene's index; None: it cannot say that of this body.
Ask = Callable[[int], list[Read] | None]


#: Both bodies of a contact by the scene's index, the impulse on the second (d,) [N s], and its place (d,) [m].
Told = tuple[int, int, Array, Array | None]


def acting_on(body: int, told: Iterable[Told]) -> list[Read]:
    """What acts on a body: the impulse on the second of a contact, and minus it on the first."""
    found = []
    for first, second, impulse, point in told:
        if body in (first, second):
            other, sign = (first, 1.0) if body == second else (second, -1.0)
            found.append(Read(other, sign * impulse, point))
    return found


def cleared(simulation: Simulation, heard: list[Told]) -> Ask:
    """Ask for what a listener has added to ``heard`` in the step just made; the list is emptied before each step."""
    advance = simulation.advance

    def fresh(steps: int) -> None:
        heard.clear()
        advance(steps)

    # Of this world alone: the list is emptied wherever the world is stepped, also by code that knows of no readings.
    simulation.advance = fresh  # type: ignore[method-assign]
    return lambda body: acting_on(body, heard)


@dataclass(frozen=True)
class Reading:
    """One public way of an engine to read a contact force or impulse.

    Parameters
    ----------
    call
        As people write it.
    gives
        ``force`` [N] or ``impulse`` [N s].
    of, on, frame, over, correction
        In words: of which points it is, on which body it acts, in which axes, over which time, and whether the
        correction of overlaps is in it.
    begin
        Takes a world that has made no step, and returns what asks it after each; it may add what listens.
    part
        What of the vector it has.
    hint
        What to know before its first use.
    causes
        Why it is wrong where it is.
    """

    call: str
    gives: Literal["force", "impulse"]
    of: str
    on: str
    frame: str
    over: str
    correction: str
    begin: Callable[[Any], Ask]
    part: Part = "vector"
    hint: str = ""
    causes: tuple[Cause, ...] = ()


@dataclass(frozen=True)
class Heard:
    """A run and what a reading said in it, over s steps of n bodies in d dimensions.

    Parameters
    ----------
    pose, twist
        Before the first step and after each, (s + 1, n, 3 | 7) and (s + 1, n, 3 | 6).
    read
        For each step and body what was read, or None.
    dt
        Step [s].
    """

    pose: Array
    twist: Array
    read: list[list[list[Read] | None]]
    dt: float


def heard(engine: Engine, scene: Scene, dt: float, settings: Mapping[str, Any], reading: Reading) -> Heard:
    """Run a scene and ask after every step."""
    simulation: Simulation = engine.build(scene, dt, settings)
    try:
        ask = reading.begin(simulation)
        poses, twists, said = [simulation.pose()], [simulation.twist()], []
        for _ in range(round(scene.duration / dt)):
            simulation.advance(1)
            poses.append(simulation.pose())
            twists.append(simulation.twist())
            said.append([ask(body) for body in range(len(scene.bodies))])
    finally:
        simulation.close()
    return Heard(np.array(poses), np.array(twists), said, dt)
