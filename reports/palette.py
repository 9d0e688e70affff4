"""One colour per engine and one shape per profile, everywhere: defined here and nowhere else.

Colours lie in the band of luminance that keeps a contrast of 3:1 on white and on the dark page alike, and stay apart
under the three common kinds of colour blindness (`tests/reports/test_palette.py` computes both). Shape and dash carry
the profile, so that no mark is told by colour alone.
"""

from __future__ import annotations

#: Engines of this house.
ENGINES = {"reference": "#3568ad", "chipmunk": "#a8600c", "bullet": "#12a38d", "mujoco": "#d255f8"}
#: Engines that others bring, in the order of their names.
OTHERS = ("#8a7a00", "#7a6cf0", "#d4504e", "#5d8a99")
#: The truth is no engine and has no colour of its own.
TRUTH = "currentColor"
#: Paper and ink of the page, light and dark.
PAPER = {"light": "#ffffff", "dark": "#15181d"}
INK = {"light": "#1c2128", "dark": "#e3e6ea"}

#: Profile -> (point shape of Vega, dash pattern of its line).
PROFILES: dict[str, tuple[str, tuple[int, ...]]] = {
    "default": ("circle", (5, 3)),
    "classical": ("circle", (5, 3)),
    "tuned": ("square", ()),
    "reference": ("diamond", ()),
    "one": ("triangle-up", (2, 2)),
    "matched": ("cross", (8, 2, 2, 2)),
}
OTHER_PROFILE: tuple[str, tuple[int, ...]] = ("triangle-down", (1, 2))


def colours_of(engines: list[str]) -> dict[str, str]:
    """Colour of each engine; engines of others share `OTHERS` in the order of their names."""
    foreign = sorted(name for name in engines if name not in ENGINES)
    given = {name: OTHERS[k % len(OTHERS)] for k, name in enumerate(foreign)}
    return {name: ENGINES.get(name) or given[name] for name in engines}


def shape_of(profile: str) -> str:
    """Point shape of a profile."""
    return PROFILES.get(profile, OTHER_PROFILE)[0]


def dash_of(profile: str) -> tuple[int, ...]:
    """Dash pattern of a profile's lines [px]; empty is a full line."""
    return PROFILES.get(profile, OTHER_PROFILE)[1]
