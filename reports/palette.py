"""Colours and marks in pictures: one colour per engine, from its own folder, and one shape per role of a profile.

The luminance of colours has a contrast of 3:1 both on white and on the dark page, and they are distinct in the three
common kinds of colour blindness (`tests/reports/test_palette.py` computes both). Shape and dash show the profile, so
colour is never the only sign.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache

from adapters import registry
from adapters.engine import Role

#: Colours of engines without their own, in the order of their names.
OTHERS = ("#8a7a00", "#7a6cf0", "#d4504e", "#5d8a99")
#: Colour of the truth, which is no engine.
TRUTH = "currentColor"
#: Paper and ink of the page, light and dark.
PAPER = {"light": "#ffffff", "dark": "#15181d"}
INK = {"light": "#1c2128", "dark": "#e3e6ea"}
#: Colour for 100 % failed: as strong as a contrast of 4.5:1 with the ink allows.
HOT = {"light": "#ec6a47", "dark": "#a5331c"}

#: Role of a profile -> (point shape of Vega, dash pattern of its line).
MARKS: Mapping[Role, tuple[str, tuple[int, ...]]] = {
    "shipped": ("circle", (5, 3)),
    "textbook": ("circle", (5, 3)),
    "tuned": ("square", ()),
    "solution": ("diamond", ()),
    "one": ("triangle-up", (2, 2)),
    "matched": ("cross", (8, 2, 2, 2)),
}
#: Roles with hollow marks: they are not tuned. All others are filled.
HOLLOW: frozenset[Role] = frozenset({"shipped", "textbook"})
OTHER_MARK: tuple[str, tuple[int, ...]] = ("triangle-down", (1, 2))


def colours_of(engines: list[str]) -> dict[str, str]:
    """Colour of each engine; engines without their own share `OTHERS` in the order of their names."""
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


def _mark_of(profile: str) -> tuple[str, tuple[int, ...]]:
    role = role_of(profile)
    return OTHER_MARK if role is None else MARKS[role]


@cache
def role_of(profile: str) -> Role | None:
    """Role of a profile of this name in the first engine: pictures distinguish profiles by name."""
    told = (registry.facts(engine) for engine in registry.names())
    return next((facts.roles[profile] for facts in told if facts and profile in facts.roles), None)


def heat(scheme: str, twentieths: int) -> str:
    """Colour of a field by twentieths of failed checks: one hue from the paper on, visible for any failure."""
    ends = [[int(colour[k : k + 2], 16) for k in (1, 3, 5)] for colour in (PAPER[scheme], HOT[scheme])]
    part = 0.15 + 0.85 * twentieths / 20 if twentieths else 0.0
    return "#" + "".join(f"{round(low + part * (high - low)):02x}" for low, high in zip(*ends, strict=True))
