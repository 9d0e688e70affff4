"""Things as lines of text that can be kept and compared: ``path = value``, one number or sentence each.

A table is a list of sections. The first has all of its lines; a later one of its kind (of the same first word: a cell,
a set of settings) has those in which it differs from the first, so that a table says what a parameter changes. A
spatial cell is compared with the planar cell of the same parameters, and what changes in the first such pair is
expected of every later one (`expected`): the third axis of gravity is written once. Numbers have 12 digits and are
compared to nine: libraries of mathematics differ in the last place, and sums of a thousand terms in more.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import fields, is_dataclass
from difflib import unified_diff
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np

#: Title of a section and its lines.
Sections = dict[str, dict[str, str]]
#: Share of a number by which machines may differ, and below which it is nothing.
SHARE, NOTHING = 1e-9, 1e-14
KEPT = Path(__file__).parent / "kept"
#: Stands for a line of the first section that a later one does not have.
ABSENT = "(absent)"
#: How often a band that is nothing beside other numbers may go into that of another machine, or the other into it: it
#: may be round-off altogether. Wider ones are numbers like all others.
ROUND_OFFS = 30.0
_NUMBER = re.compile(r"(?<![\w.])-?\d+\.?\d*(?:e[+-]?\d+)?(?![\w.])")
_BANDED = re.compile(rf"({_NUMBER.pattern}) \+- ({_NUMBER.pattern})")


def lines(thing: Any, path: str = "") -> Iterator[tuple[str, str]]:
    """Every number, word and truth of a thing, with the way to it."""
    if isinstance(thing, Enum):
        yield path, str(thing.value)
    elif is_dataclass(thing):
        if path.endswith("shape"):
            yield path, type(thing).__name__
        for field in (field for field in fields(thing) if not field.name.startswith("_")):
            yield from lines(getattr(thing, field.name), f"{path}.{field.name}".lstrip("."))
    elif isinstance(thing, Mapping):
        yield from ((path, "{}") for _ in range(not thing))
        for key, value in thing.items():
            yield from lines(value, f"{path}.{key}".lstrip("."))
    elif isinstance(thing, np.ndarray) and thing.ndim:
        yield from lines(thing.tolist(), path)
    elif isinstance(thing, list | tuple):
        if all(isinstance(each, bool | int | float | np.number) for each in thing):
            yield path, f"({', '.join(map(word, thing))})"
        else:
            for k, each in enumerate(thing):
                yield from lines(each, f"{path}[{k}]")
    elif isinstance(thing, set | frozenset):
        yield path, f"{{{', '.join(sorted(map(word, thing)))}}}"
    elif not callable(thing) or isinstance(thing, type):
        yield path, word(thing)


def word(thing: Any) -> str:
    """A number to 12 digits, a text in one line."""
    if isinstance(thing, bool | np.bool_ | int | None):
        return str(thing)
    if isinstance(thing, float | np.floating):
        return f"{float(thing) + 0.0:.12g}"
    return (
        repr(str(thing)) if str(thing) != str(thing).strip() or not str(thing) else "\\n".join(str(thing).split("\n"))
    )


def section(**things: Any) -> dict[str, str]:
    """Lines of things by their names.

    Raises
    ------
    ValueError
        If two lines have one name.
    """
    found: dict[str, str] = {}
    for name, thing in things.items():
        for path, told in lines(thing, name):
            if path in found:
                raise ValueError(f"two lines are called {path}")
            found[path] = told
    return found


def expected(title: str, sections: Sections) -> dict[str, str]:
    """Lines that a section of this title is expected to have, given those before it; only the others are written.

    A planar cell: those of the first cell. A spatial cell: those of the planar cell of the same parameters, but lines
    that the first planar cell has as well change as they do from it to its spatial twin.
    """
    head, first = next(iter(sections.items()), ("", {}))
    twin = sections.get(_in_the_plane(title))
    if not title.startswith("3-D") or twin is None:
        alike = _in_the_plane(title).partition(" ")[0] == _in_the_plane(head).partition(" ")[0]
        return first if alike else {}
    pair = next((name for name in sections if name.startswith("3-D") and _in_the_plane(name) in sections), "")
    if not pair:
        return twin
    flat, space = sections[_in_the_plane(pair)], sections[pair]
    as_there = {path: space.get(path, ABSENT) for path in flat if twin.get(path) == flat[path]}
    added = {path: told for path, told in space.items() if path not in flat and path not in twin}
    return {path: told for path, told in (twin | as_there | added).items() if told != ABSENT}


def _in_the_plane(title: str) -> str:
    return title.replace("3-D", "2-D", 1)


def as_text(sections: Sections) -> str:
    """The table as it is kept."""
    out, told_before = list[str](), Sections()
    for title, own in sections.items():
        base = expected(title, told_before)
        out.append(f"[{title}]")
        missing = {path: ABSENT for path in base if path not in own}
        out += [f"{path} = {told}" for path, told in (own | missing).items() if base.get(path) != told]
        told_before[title] = own
    return "\n".join(out) + "\n"


def from_text(text: str) -> Sections:
    """Inverse of `as_text`."""
    found: Sections = {}
    own: dict[str, str] = {}
    for line in text.splitlines():
        if line.startswith("[") and line.endswith("]") and " = " not in line:
            own = found[line[1:-1]] = dict(expected(line[1:-1], found))
        else:
            path, _, told = line.partition(" = ")
            if told == ABSENT:
                del own[path]
            else:
                own[path] = told
    return found


def agree(told: str, kept: str, share: float = SHARE, nothing: float = NOTHING) -> bool:
    """Whether two values are one: texts letter by letter, numbers in them to what machines may differ by."""
    if told == kept:
        return True
    if _NUMBER.sub("#", told) != _NUMBER.sub("#", kept):
        return False
    pairs = zip(_NUMBER.findall(told), _NUMBER.findall(kept), strict=True)
    alike = all(math.isclose(float(a), float(b), rel_tol=share, abs_tol=nothing) for a, b in pairs)
    return alike and _bands_agree(told, kept, share)


def _bands_agree(told: str, kept: str, share: float) -> bool:
    """Of ``value +- band``: whether bands are of one size, and values apart by less than half of it.

    What is nothing beside other numbers may be all that a band is.
    """
    both = _BANDED.fullmatch(told), _BANDED.fullmatch(kept)
    if both[0] is None or both[1] is None:
        return True
    (value, band), (before, wide) = ([float(each) for each in found.groups()] for found in both if found)
    within = max(NOTHING, 0.5 * wide)
    near = math.isclose(value, before, rel_tol=share, abs_tol=within)
    return near and max(band, wide) <= ROUND_OFFS * min(band, wide)


def differences(made: Sections, kept: Sections, share: float = SHARE, nothing: float = NOTHING) -> list[str]:
    """What is no longer as it was kept, a line each."""
    out = [f"[{title}] is {'new' if title in made else 'gone'}" for title in made.keys() ^ kept.keys()]
    for title in made.keys() & kept.keys():
        now, before = made[title], kept[title]
        out += [
            f"[{title}] {path}: {before.get(path, ABSENT)} -> {now.get(path, ABSENT)}"
            for path in dict.fromkeys([*before, *now])
            if not agree(now.get(path, ABSENT), before.get(path, ABSENT), share, nothing)
        ]
    return sorted(out)


def check(name: str, make: Callable[[], Sections], share: float = SHARE, nothing: float = NOTHING) -> None:
    """Fail with what differs between a table and what is made today, by more than a share or an amount that is some."""
    kept = from_text((KEPT / f"{name}.txt").read_text(encoding="utf-8"))
    found = differences(make(), kept, share, nothing)
    told = "\n".join(found[:20])
    assert not found, f"{len(found)} lines of {name} are others. If that is meant: make tables, and say why\n{told}"


def screen_differences(printed: str, kept: str, share: float = 1e-7, nothing: float = 1e-10) -> list[str]:
    """Lines of a screen that are others, as a diff tells them; numbers in them may differ by what machines do."""
    now, before = printed.splitlines(), kept.splitlines()
    if len(now) == len(before):
        now = [old if agree(new, old, share, nothing) else new for new, old in zip(now, before, strict=True)]
    return [line for line in unified_diff(before, now, lineterm="", n=0) if not line.startswith(("---", "+++", "@@"))]


def check_screen(name: str, make: Callable[[], str]) -> None:
    """Fail with what differs between a screen and what is printed today."""
    found = screen_differences(make(), (KEPT / f"{name}.txt").read_text(encoding="utf-8"))
    told = "\n".join(found[:40])
    assert not found, f"{name} is printed otherwise. If that is meant: make tables, and say why\n{told}"
