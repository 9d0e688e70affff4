"""Colours and symbols of engines and profiles as CSS, with small pictures for names and legends."""

from __future__ import annotations

from collections.abc import Sequence
from urllib.parse import quote

from reports.page.verdicts import slug
from reports.palette import HOLLOW, colours_of, dash_of, heat, role_of, shape_of

_SHAPES = {
    "circle": '<circle cx="8" cy="8" r="4.2"/>',
    "square": '<path d="M4.3 4.3h7.4v7.4h-7.4z"/>',
    "diamond": '<path d="M8 2.6 13.4 8 8 13.4 2.6 8z"/>',
    "triangle-up": '<path d="M8 3 13 12H3z"/>',
    "triangle-down": '<path d="M8 13 3 4h10z"/>',
    "cross": '<path d="M6 3h4v3h3v4h-3v3H6v-3H3V6h3z"/>',
}


def engine_style(engines: list[str]) -> str:
    """CSS that gives each engine its colour: class ``e-<name>`` sets ``--engine``."""
    return "".join(f".e-{slug(name)}{{--engine:{colour}}}" for name, colour in colours_of(engines).items())


def heat_style() -> str:
    """CSS for shares of failed checks, in twentieths (`reports.page.verdicts.Mark.twentieths`): ``w0`` to ``w20``."""
    return "".join(f".w{k}{{background:light-dark({heat('light', k)},{heat('dark', k)})}}" for k in range(21))


def symbols(columns: Sequence[tuple[str, str]]) -> str:
    """CSS that draws point and line of an engine and profile, as in charts, before its name.

    The class is ``s`` and the place among ``columns``, because it occurs a thousand times on a page.
    """
    colours = colours_of(list(dict.fromkeys(engine for engine, _ in columns)))
    rules = []
    for k, (engine, profile) in enumerate(columns):
        dash = " ".join(map(str, dash_of(profile)))
        pattern = f' stroke-dasharray="{dash}"' if dash else ""
        line = f'<path d="M-5 8h26" stroke="{colours[engine]}" stroke-width="1.4"{pattern}/>'
        inner = "none" if role_of(profile) in HOLLOW else colours[engine]
        head = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="-5 0 26 16" fill="{inner}">'
        mark = f'<g stroke="{colours[engine]}" stroke-width="1.5">{_SHAPES[shape_of(profile)]}</g>'
        drawn = quote(f"{head}{line}{mark}</svg>", safe=" /:=")
        rules.append(f".s{k}::before{{background-image:url('data:image/svg+xml,{drawn}')}}")
    return "".join(rules)
