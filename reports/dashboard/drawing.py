"""Small multiples as SVG text: a strip of verdicts, the error, and the time, over runs or releases.

They do not use the report's charts: a dashboard has hundreds of pictures with a line and a few marks, and a charting
library takes a twentieth of a second for each. The page's style has the colours, and text uses the page's font.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import groupby

from markupsafe import Markup

from reports.dashboard.series import Panel, Point
from reports.dashboard.steps import Step
from reports.page.charts import EXACT
from reports.wording import number

#: Size of a panel [px]; the page scales it to its column.
WIDTH, LEFT, RIGHT = 330.0, 52.0, 8.0
#: Number of points from which on they are not drawn one by one.
MANY = 60
STRIP, ERROR, TIME = (4.0, 12.0), (22.0, 92.0), (104.0, 140.0)


def panel(of: Panel) -> Markup:
    """The picture of one panel; text beside it says the same in words."""
    timed = any(point.ratio is not None for point in of.points)
    bottom = TIME[1] if timed else ERROR[1]
    parts = [_strip(of.points), _axis(of.points, bottom)]
    parts.append(_line(of.points, [_clipped(p.error) for p in of.points], ERROR, "line", of.error_steps))
    if timed:
        parts.append(_line(of.points, [p.ratio for p in of.points], TIME, "line time", of.time_steps))
    marks = f"{len(of.error_steps)} steps of the error, {len(of.time_steps)} of the time, {len(of.flips)} flips"
    label = Markup.escape(f"{of.key[0]} {of.key[1]} {of.name}, {len(of.points)} points: {marks}")
    head = f'<svg role="img" aria-label="{label}" viewBox="0 0 {WIDTH:g} {bottom + 16:g}">'
    return Markup(head + "".join(parts) + "</svg>")


def _clipped(error: float | None) -> float | None:
    """Errors below `EXACT` are drawn as equal."""
    return None if error is None else max(abs(error), EXACT)


def _x(index: int, count: int) -> float:
    return LEFT + (WIDTH - LEFT - RIGHT) * (0.5 if count == 1 else index / (count - 1))


def _strip(points: Sequence[Point]) -> str:
    """One field per point: hollow passes, filled fails; a flip has its own mark above.

    If there are many points, neighbours of the same state share a field.
    """
    count = len(points)
    width = min(10.0, (WIDTH - LEFT - RIGHT) / max(1, count))
    out = []
    for state, cells in groupby(range(count), key=lambda i: (_state(points[i]), i if count <= MANY else 0)):
        first, *_, last = [*cells] * 2
        if state[0]:
            x, wide = _x(first, count) - width / 2, _x(last, count) - _x(first, count) + width
            out.append(f'<rect class="{state[0]}" x="{x:.1f}" y="{STRIP[0]}" width="{wide:.1f}" height="8"/>')
    for i, point in enumerate(points):
        if point.lost or point.mended:
            x = _x(i, count)
            shape = f"M{x - 4:.1f} 0h8l-4 6z" if point.lost else f"M{x - 4:.1f} 6h8l-4 -6z"
            out.append(f'<path class="{"lost" if point.lost else "mended"}" d="{shape}"/>')
    return "".join(out)


def _state(point: Point) -> str:
    return ("bad" if point.fails else "good") if point.judged else ""


def _axis(points: Sequence[Point], bottom: float) -> str:
    y, ends = bottom + 13, (points[0].label, points[-1].label)
    left = f'<text x="{LEFT:g}" y="{y:g}">{Markup.escape(ends[0])}</text>'
    right = f'<text x="{WIDTH - RIGHT:g}" y="{y:g}" text-anchor="end">{Markup.escape(ends[1])}</text>'
    return left + (right if len(points) > 1 else "")


def _line(
    points: Sequence[Point],
    values: Sequence[float | None],
    room: tuple[float, float],
    name: str,
    steps: Sequence[tuple[int, Step]],
) -> str:
    """Logarithmic line with its extremes as labels, and a dashed line at each step."""
    there = [(i, value) for i, value in enumerate(values) if value is not None and value > 0.0]
    if not there:
        return ""
    low, high = min(v for _, v in there), max(v for _, v in there)
    span = max(math.log10(high / low), 1.0)  # at least a decade, so that noise looks small
    middle = 0.5 * (math.log10(high) + math.log10(low))

    def y(value: float) -> float:
        return room[1] - (room[1] - room[0]) * (0.5 + (math.log10(value) - middle) / span)

    # A point between two equal values is on the line between them.
    bends = [
        p for k, p in enumerate(there) if not 0 < k < len(there) - 1 or not there[k - 1][1] == p[1] == there[k + 1][1]
    ]
    dots = " ".join(f"{_x(i, len(points)):.1f},{y(v):.1f}" for i, v in bends)
    out = [f'<polyline class="{name}" points="{dots}"/>']
    if len(points) <= MANY:
        marks = "".join(f"M{_x(i, len(points)):.1f} {y(v):.1f}h0" for i, v in there)  # round ends make a dot of each
        out.append(f'<path class="dots" d="{marks}"/>')
    labels = {high: room[0] + 4, low: room[1]} if high > 1.001 * low else {high: y(high) + 3}
    for value, place in labels.items():
        said = "exact" if value <= EXACT and "time" not in name else number(value, 2)
        out.append(f'<text x="{LEFT - 6:g}" y="{place:.1f}" text-anchor="end">{Markup.escape(said)}</text>')
    for at, step in steps:
        x = _x(at, len(points)) - 0.5 * (WIDTH - LEFT - RIGHT) / max(1, len(points) - 1)
        worse = "worse" if step.factor > 1.0 else "better"
        out.append(f'<line class="step {worse}" x1="{x:.1f}" x2="{x:.1f}" y1="{room[0] - 4:g}" y2="{room[1] + 2:g}"/>')
    return "".join(out)
