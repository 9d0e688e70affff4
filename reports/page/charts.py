"""Static charts: Altair makes the specification, vl-convert the SVG; both work without a browser or a network.

Text and lines are ``currentColor``, so that one picture serves the light and the dark page. Charts have no legend: the
page shows one for all of them, made from `reports.palette`. The label of every point describes it, for screen readers
and for the page's hover text.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import altair as alt
import numpy as np
import pandas as pd
import vl_convert
from markupsafe import Markup

from reports.palette import HOLLOW, colours_of, dash_of, role_of, shape_of

WIDTH, HEIGHT = 330, 250
#: Width of the outline of a point [px].
POINT = 1.5
#: Smaller errors count as exact: 1e-9 and 1e-16 are the same for the choice of an engine.
EXACT = 1e-6
#: Place of exact errors: a gutter below the axis, labelled "exact".
GUTTER = 3e-7
#: Shift between marks that coincide, as a share of the axis.
DODGE = 0.016
_CONFIG: dict[str, Any] = {
    "background": "transparent",
    "font": "system-ui, sans-serif",
    "view": {"stroke": None},
    "axis": {
        "labelColor": "currentColor", "titleColor": "currentColor", "gridColor": "currentColor",
        "domainColor": "currentColor", "tickColor": "currentColor", "gridOpacity": 0.13, "domainOpacity": 0.5,
        "tickOpacity": 0.5, "labelFontSize": 12, "titleFontSize": 12.5, "titleFontWeight": "normal",
        "titlePadding": 8, "labelPadding": 5, "tickSize": 4,
    },
    "header": {"labelColor": "currentColor", "titleColor": "currentColor", "labelFontSize": 12.5},
    "title": {"color": "currentColor", "fontSize": 13.5, "fontWeight": 600, "anchor": "start"},
    "text": {"color": "currentColor", "fontSize": 11.5},
    "rule": {"color": "currentColor"},
}  # fmt: skip
#: Parts that screen readers skip, because a chart is a picture with one name, and attributes that are defaults of SVG.
_SKIPPED = re.compile(
    r' (?:class|role|aria-hidden|aria-roledescription|pointer-events|stroke-miterlimit|font-family)="[^"]*"'
    r'| (?:opacity|fill-opacity|stroke-width)="1"| transform="translate\(0,0\)"| aria-label="[XY]-axis[^"]*"'
    r'| stroke-dasharray="1,0"'
    r'|<path class="(?:background|foreground)" aria-hidden="true" d="[^"]*"(?: (?:pointer-events|display)="none")*/>'
)
#: Lines of a grid, and ticks: beside each other, of one colour.
_LINES = re.compile(
    r'<line transform="translate\([^)]*\)" x2="[^"]*" y2="[^"]*" (stroke="[^"]*" stroke-opacity="[^"]*")/>'
    r'(?:<line transform="translate\([^)]*\)" x2="[^"]*" y2="[^"]*" \1/>)+'
)
_LINE = re.compile(r'<line transform="translate\(([^)]*)\)" x2="([^"]*)" y2="([^"]*)" [^>]*/>')
#: Attributes with places and lengths; tenths of a pixel are visible, smaller digits are not.
_PLACES = re.compile(r' (?:d|transform|[xy][12]?)="[^"]*"')
_DIGITS = re.compile(r"-?\d+\.\d{2,}(?:e-?\d+)?")
#: A curve through several points.
_CURVE = re.compile(r' d="M([-\d.]+,[-\d.]+(?:L[-\d.]+,[-\d.]+)+)"')
#: A zero before the point, and a comma before a sign.
_NEEDLESS = re.compile(r"(?<!\d)0(?=\.)|,(?=-)")


def _from_point_to_point(curve: re.Match[str]) -> str:
    """The curve by steps, which have fewer digits than places: in whole tenths of a pixel, so that none is lost."""
    places = [[round(10.0 * float(value)) for value in place.split(",")] for place in curve[1].split("L")]
    steps = "".join(f"l{(b[0] - a[0]) / 10.0:g},{(b[1] - a[1]) / 10.0:g}" for a, b in pairwise(places))
    return f' d="M{curve[1].partition("L")[0]}{_NEEDLESS.sub("", steps)}"'


def svg(chart: alt.TopLevelMixin, title: str) -> Markup:
    """SVG text of ``chart``, for inlining, with ``title`` as its accessible name."""
    spec = chart.to_dict(validate=False)  # validation takes a tenth of a second each; a wrong spec would not draw
    spec["config"] = _CONFIG
    text = _SKIPPED.sub("", vl_convert.vegalite_to_svg(spec)).replace(" aria-label=", " data-is=")
    text = _PLACES.sub(lambda place: _DIGITS.sub(lambda m: f"{float(m[0]):.1f}".removesuffix(".0"), place[0]), text)
    text = _CURVE.sub(_from_point_to_point, text)
    text = _LINES.sub(lambda lines: _LINE.sub(r"M\1l\2,\3", f'<path d="{lines[0]}" {lines[1]}/>'), text)
    return Markup(text.replace("<svg", f'<svg role="img" aria-label="{Markup.escape(title)}"', 1))


def log_axis(low: float, high: float) -> list[float]:
    """Decades from ``low`` to ``high``, at most eight; for less than two decades also 2 and 5 times each."""
    first, last = math.floor(math.log10(low)), math.ceil(math.log10(high))
    stride = max(1, math.ceil((last - first) / 8))
    steps = (1.0, 2.0, 5.0) if high < 100.0 * low else (1.0,)
    ticks = [step * 10.0**k for k in range(first, last + 1, stride) for step in steps]
    return [tick for tick in ticks if low <= tick <= high]


def log_scale(values: Sequence[float], pad: float = 1.3) -> tuple[alt.Scale, list[float]]:
    """Logarithmic scale with some room at both ends, and its ticks."""
    positive = [v for v in values if v > 0.0 and math.isfinite(v)] or [1.0]
    low, high = min(positive) / pad, max(positive) * pad
    if high / low < 10.0:
        low, high = low / math.sqrt(10.0), high * math.sqrt(10.0)
    return alt.Scale(type="log", domain=[low, high], nice=False), log_axis(low, high)


def gutter(errors: Any) -> Any:
    """Errors as a series, those below `EXACT` moved to the `GUTTER`."""
    values = pd.Series(errors, dtype=float)
    return values.mask(values < EXACT, GUTTER)


def error_axis(values: Sequence[float], title: str, pad: float = 2.0) -> tuple[alt.Scale, alt.Axis, float]:
    """Scale and axis of errors from `gutter`, and the smallest error above the gutter."""
    shown = [v for v in values if v >= EXACT] or [1e-3]
    exact = any(v < EXACT for v in values)
    scale, ticks = log_scale(shown, pad)
    low, high = scale["domain"]
    if exact:
        low, ticks = EXACT, log_axis(EXACT, high)
        scale = alt.Scale(type="log", domain=[GUTTER / 1.8, high], nice=False)
        ticks = [GUTTER, *ticks]
    return scale, alt.Axis(title=title, values=ticks, labelExpr=ERROR, labelOverlap=True), low


def gutter_band(values: Sequence[float], scale: alt.Scale, axis: alt.Axis) -> list[alt.Chart]:
    """Pale band behind the gutter, if there is one."""
    if not any(v < EXACT for v in values):
        return []
    band = pd.DataFrame([{"from": scale["domain"][0], "to": GUTTER * 1.8}])
    mark = alt.Chart(band).mark_rect(color="currentColor", opacity=0.07, aria=False)
    return [mark.encode(y=alt.Y("from:Q", scale=scale, axis=axis), y2="to:Q")]


def dodged(table: pd.DataFrame, x: str, y: str, logarithmic: bool = True) -> pd.DataFrame:
    """Marks of different series at the same place, set side by side along x.

    Two marks coincide if they lie within a fiftieth of a decade (of a unit, on linear axes) of each other.
    """
    if len(table) == 0:
        return table
    table = table.astype({x: float})
    size = (lambda v: np.log10(v.clip(lower=1e-30))) if logarithmic else (lambda v: v)
    place = [(50.0 * size(table[name])).round() for name in (x, y)]
    span = float(np.ptp(size(table[x]))) or 1.0
    for _, group in table.groupby(place, sort=False):
        if len(group) == 1:
            continue
        order = group.groupby(["engine", "profile"], sort=False).ngroup()
        shift = DODGE * span * (order - order.max() / 2.0)
        table.loc[group.index, x] = group[x] * 10.0**shift if logarithmic else group[x] + shift
    return table


#: Plain numbers between 0.01 and 100, 2e-6 elsewhere.
POWER = (
    "datum.value >= 0.0099 && datum.value <= 101 ? format(datum.value, '~r') : "
    "replace(format(datum.value, '.0e'), '+', '')"
)
#: The same, with a word for the gutter.
ERROR = f"datum.value < 0.9e-6 ? 'exact' : {POWER}"


def power_axis(title: str, ticks: list[float], **more: Any) -> alt.Axis:
    """Axis in powers of ten."""
    return alt.Axis(title=title, values=ticks, labelExpr=POWER, labelOverlap=True, **more)


def with_unit(name: str, unit: str) -> str:
    """Title of an axis; a ratio has no unit."""
    return name if unit == "1" else f"{name} [{unit}]"


def styled(table: pd.DataFrame) -> dict[str, Any]:
    """Encodings of points by the columns ``engine`` and ``profile``: colour, shape, and hollow as shipped."""
    engines, profiles = sorted(set(table["engine"])), sorted(set(table["profile"]))
    colours = colours_of(engines)
    colour = alt.Scale(domain=engines, range=[colours[name] for name in engines])
    shapes = alt.Scale(domain=profiles, range=[shape_of(name) for name in profiles])
    hollow = alt.FieldOneOfPredicate(field="profile", oneOf=[name for name in profiles if role_of(name) in HOLLOW])
    filled = alt.Fill("engine:N", scale=colour, legend=None)
    return {
        "fill": alt.condition(hollow, alt.value("transparent"), filled),
        "color": alt.Color("engine:N", scale=colour, legend=None),
        "shape": alt.Shape("profile:N", scale=shapes, legend=None),
    }


def named(table: pd.DataFrame) -> pd.DataFrame:
    """The table with ``engine/profile`` in a column: the name of a line, for which the page's filter searches."""
    return table.assign(who=table["engine"].astype(str) + "/" + table["profile"].astype(str))


def dashes(table: pd.DataFrame) -> alt.StrokeDash:
    """Dash pattern by ``profile``."""
    profiles = sorted(set(table["profile"]))
    # Vega needs a pattern for a full line too.
    patterns = [list(dash_of(name)) or [1, 0] for name in profiles]
    return alt.StrokeDash("profile:N", scale=alt.Scale(domain=profiles, range=patterns), legend=None)


def lines(
    table: pd.DataFrame,
    x: alt.X,
    y: alt.Y,
    width: int = WIDTH,
    height: int = HEIGHT,
    order: str | None = None,
    below: Sequence[alt.Chart] = (),
) -> alt.LayerChart | alt.FacetChart:
    """Points with thin lines per engine and profile; the column ``label`` describes each point."""
    table, style = named(table), styled(table)
    base = alt.Chart(table)
    detail = [alt.Detail("engine:N"), alt.Detail("profile:N")]
    ordered: dict[str, Any] = {"order": alt.Order(f"{order}:Q")} if order else {}
    thin = base.mark_line(strokeWidth=1.4, opacity=0.75).encode(
        x=x, y=y, color=style["color"], strokeDash=dashes(table), detail=detail, description="who:N", **ordered
    )
    points = base.mark_point(size=52, strokeWidth=POINT, opacity=0.95).encode(x=x, y=y, description="label:N", **style)
    return alt.layer(*below, thin, points).properties(width=width, height=height)
