"""Colours and symbols of engines and profiles as CSS and as small pictures for the page's legend."""

from __future__ import annotations

from markupsafe import Markup

from reports.page.verdicts import slug
from reports.palette import colours_of, dash_of, shape_of

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


def symbol(engines: list[str], engine: str, profile: str) -> Markup:
    """Point and line of an engine and profile, as they look in the charts."""
    colour, dash = colours_of(engines)[engine], " ".join(map(str, dash_of(profile)))
    pattern = f' stroke-dasharray="{dash}"' if dash else ""
    return Markup(
        f'<svg class="symbol" width="26" height="16" viewBox="-5 0 26 16" aria-hidden="true" fill="{colour}">'
        f'<path d="M-5 8h26" stroke="{colour}" stroke-width="1.4"{pattern}/>{_SHAPES[shape_of(profile)]}</svg>'
    )
