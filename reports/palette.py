"""Colours and marks in pictures: one colour per engine, from its own folder, and one shape per role of a profile.

Colours lie in the band of luminance that keeps a contrast of 3:1 on white and on the dark page alike, and stay apart
under the three common kinds of colour blindness (`tests/reports/test_palette.py` computes both). Shape and dash carry
the profile, so that no mark is told by colour alone.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache

from adapters import registry
from adapters.engine import Role

#: Engines that bring no colour, in the order of their names.
OTHERS = ("#8a7a00", "#7a6cf0", "#d4504e", "#5d8a99")
#: The truth is no engine and has no colour of its own.
TRUTH = "currentColor"
#: Paper and ink of the page, light and dark.
PAPER = {"light": "#ffffff", "dark": "#15181d"}
INK = {"light": "#1c2128", "dark": "#e3e6ea"}

#: Role of a profile -> (point shape of Vega, dash pattern of its line).
MARKS: Mapping[Role, tuple[str, tuple[int, ...]]] = {
    "shipped": ("circle", (5, 3)),
    "textbook": ("circle", (5, 3)),
    "tuned": ("square", ()),
    "solution": ("diamond", ()),
    "one": ("triangle-up", (2, 2)),
    "matched": ("cross", (8, 2, 2, 2)),
}
OTHER_MARK: tuple[str, tuple[int, ...]] = ("triangle-down", (1, 2))


def colours_of(engines: list[str]) -> dict[str, str]:
    """Colour of each engine; those that bring none share `OTHERS` in the order of their names."""
    plain = sorted(name for name in engines if not _own_colour(name))
    given = {name: OTHERS[k % len(OTHERS)] for k, name in enumerate(plain)}
    return {name: _own_colour(name) or given[name] for name in engines}


@cache
def _own_colour(engine: str) -> str:
    facts = registry.facts(engine)
    return facts.colour if facts else ""


def shape_of(profile: str) -> str:
    """Point shape of a profile."""
    return _mark_of(profile)[0]


def dash_of(profile: str) -> tuple[int, ...]:
    """Dash pattern of a profile's lines [px]; empty is a full line."""
    return _mark_of(profile)[1]


@cache
def _mark_of(profile: str) -> tuple[str, tuple[int, ...]]:
    """Mark of the first engine that gives a profile of this name a role: pictures tell profiles by name."""
    for engine in registry.names():
        facts = registry.facts(engine)
        role = facts.roles.get(profile) if facts else None
        if role is not None:
            return MARKS[role]
    return OTHER_MARK
