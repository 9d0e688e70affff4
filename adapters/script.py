"""Stand-alone Python scripts of a run: parts shared by all engines.

A script is for maintainers of the engine: it imports only the engine and builds the same world by the same calls as the
adapter, number by number. It prints the state at the start, at every tenth of the run and at the end, as lines of JSON
in the conventions of `adapters.scene`, so its last line has the bits of the original cell.

Each engine has its own writer (`adapters.engine.Engine.exports`); most record calls (`adapters.recording`).
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from adapters.scene import Body, Scene

#: Number of printed states, besides the start.
TOLD = 10


def literal(value: Any) -> str:
    """``value`` as a Python literal, exact to the bit: numpy numbers as Python ones, arrays as tuples."""
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, list | tuple):
        inside = ", ".join(literal(item) for item in value)
        return f"({inside},)" if len(value) == 1 else f"({inside})"
    return repr(value)


def keywords(values: Mapping[str, Any]) -> str:
    """``name=value, ...`` of a call."""
    return ", ".join(f"{name}={literal(value)}" for name, value in values.items())


def constants(dt: float, steps: int) -> list[str]:
    """Lines with the step [s] and the number of steps."""
    return [f"DT, STEPS = {dt!r}, {steps}"]


def imports(scene: Scene, *others: str, angles: bool = False) -> list[str]:
    """First lines of a script: imports, with those for courses of a scene or ``angles``."""
    needed = angles or any(body.course for body in scene.bodies)
    return ["import json", *(["import math"] if needed else []), "", *others, ""]


def velocity(body: Body) -> str:
    """Velocity over step number ``done`` (1 is the first) of a prescribed body, as `drives.velocity_over` has it."""
    straight, course = body.twist[: len(body.force)], body.course
    if course is None:
        return literal(straight)
    rate = 2.0 * math.pi * course.frequency
    late, early = (f"math.sin({rate!r} * ({k} * DT) + {course.phase!r})" for k in ("done", "(done - 1)"))
    parts = (f"{v!r} + {a!r} * (({late} - {early}) / DT)" for v, a in zip(straight, course.amplitude, strict=True))
    return f"({', '.join(parts)})"


def place(body: Body) -> str:
    """Place of a prescribed body at ``time`` [s]: `adapters.scene.drives.place_after`."""
    course, size = body.course, len(body.force)
    moving = zip(body.pose[:size], body.twist[:size], strict=True)
    straight = [f"{literal(x)} + {literal(v)} * time" for x, v in moving]
    if course is None:
        return f"({', '.join(straight)})"
    swung = f"(math.sin({2.0 * math.pi * course.frequency!r} * time + {course.phase!r}) - {math.sin(course.phase)!r})"
    return f"({', '.join(f'{x} + {a!r} * {swung}' for x, a in zip(straight, course.amplitude, strict=True))})"


def materials(scene: Scene) -> list[str]:
    """Lines of ``material(i, j)``: restitution and friction of two bodies by index, for engines that query each pair.

    The most common material is written once. No lines for a scene without pairs.
    """
    pairs = {(i, j): (m.restitution, m.friction) for i, j, m in scene.contact_pairs()}
    if not pairs:
        return []
    ((common, _),) = Counter(pairs.values()).most_common(1)
    return [
        "# Restitution and friction of pairs of bodies, by their numbers, and of all others.",
        f"MATERIALS, COMMON = {{{', '.join(f'{k}: {literal(m)}' for k, m in pairs.items() if m != common)}}}, "
        + literal(common),
        "",
        "",
        "def material(i, j):",
        "    return MATERIALS.get((min(i, j), max(i, j)), COMMON)",
        "",
        "",
    ]


def stepped(step: Iterable[str]) -> list[str]:
    """Lines of the loop around the lines of one ``step``; ``state()`` gives pose and twist of every body by name."""
    return [
        "",
        "",
        "def tell(steps):",
        '    bodies = {name: {"pose": list(pose), "twist": list(twist)} for name, (pose, twist) in state().items()}',
        '    print(json.dumps({"t": steps * DT, "bodies": bodies}))',
        "",
        "",
        "tell(0)",
        "for done in range(1, STEPS + 1):",
        *(f"    {line}" for line in step),
        f"    if done % max(1, STEPS // {TOLD}) == 0 or done == STEPS:",
        "        tell(done)",
    ]


def text(lines: Iterable[str]) -> str:
    """Lines as the text of a file."""
    return "\n".join(lines) + "\n"
