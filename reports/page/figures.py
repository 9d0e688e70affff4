"""The figures of the page: each makes an SVG with a title from a table, or None if there is nothing to draw."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import altair as alt
import numpy as np
import pandas as pd
from markupsafe import Markup

from reports.page.charts import (
    EXACT,
    HEIGHT,
    POINT,
    WIDTH,
    dashes,
    dodged,
    error_axis,
    gutter,
    gutter_band,
    lines,
    log_scale,
    named,
    power_axis,
    styled,
    svg,
    with_unit,
)
from reports.speed import duration
from reports.wording import number
from validation.cells import format_dt
from validation.files.distance import primary_of
from validation.questions.convergence import Convergence

#: Caption of charts with moved marks.
DODGED = "Marks that coincide stand side by side; below 1e-6 an error counts as exact."


@dataclass(frozen=True)
class Figure:
    """One picture: anchor, title, caption and SVG."""

    id: str
    title: str
    caption: str
    picture: Markup


def _error_text(error: float) -> str:
    return number(error, 2)


def _guides(x: Sequence[float], anchor: tuple[float, float], scale_x: alt.X, scale_y: alt.Y, low: float) -> alt.Chart:
    """Faint lines of slope 1 and 2 from ``anchor`` down to the smallest x, or to the lower edge of the picture."""
    parts = []
    for order in (1, 2):
        edge = anchor[0] * (low / anchor[1]) ** (1.0 / order)
        ends = np.array([max(min(x), edge), anchor[0]])
        parts.append(pd.DataFrame({"dt": ends, "error": anchor[1] * (ends / anchor[0]) ** order, "order": str(order)}))
    mark = alt.Chart(pd.concat(parts)).mark_line(color="currentColor", opacity=0.22, strokeDash=[2, 3], aria=False)
    guides: alt.Chart = mark.encode(x=scale_x, y=scale_y, detail="order:N")
    return guides


def error_against_step(entries: Iterable[Convergence], scene: str, dimension: int) -> Figure | None:
    """Headline error over dt, one line per engine and profile."""
    rows = [
        {
            "engine": c.engine, "profile": c.profile, "dt": dt, "error": error,
            "label": f"{c.engine}/{c.profile}, dt {format_dt(dt)} s: error {_error_text(error)} ({c.because})",
        }
        for c in entries if (c.scene, c.dimension) == (scene, dimension)
        for dt, error in zip(c.dts, c.errors, strict=True)
    ]  # fmt: skip
    table = pd.DataFrame(rows)
    if len(table) == 0 or table["dt"].nunique() < 2:
        return None
    primary = primary_of(scene)
    ticks = sorted(set(table["dt"]))
    names = " : ".join(f"abs(datum.value - {dt!r}) < 1e-9 ? '{format_dt(dt)}'" for dt in ticks) + " : ''"
    scale = alt.Scale(type="log", domain=[ticks[0] / 1.25, ticks[-1] * 1.25], nice=False)
    x = alt.X("dt:Q", scale=scale, axis=alt.Axis(title="step dt [s]", values=ticks, labelExpr=names))
    table["error"] = gutter(table["error"])
    error_scale, axis, low = error_axis(list(table["error"]), with_unit(primary.name, primary.unit))
    y = alt.Y("error:Q", scale=error_scale, axis=axis)
    # The guides start at the most exact engine of the coarsest step, so that converging engines run along them.
    coarsest = table[(table["dt"] == ticks[-1]) & (table["error"] >= EXACT)]["error"]
    start = float(coarsest.min()) if len(coarsest) else float(table["error"].max())
    guides = [_guides(ticks, (ticks[-1], start), x, y, low)] if start >= EXACT else []
    table = dodged(table, "dt", "error")
    title = f"{scene} {dimension}-D: {primary.name} against step"
    caption = f"Supremum over the phases of an impact where there is one. Dotted: slopes of order 1 and 2. {DODGED}"
    picture = svg(lines(table, x, y, below=[*gutter_band(list(table["error"]), error_scale, axis), *guides]), title)
    return Figure(f"fig-step-{scene}-{dimension}", title, caption, picture)


def error_against_iterations(table: pd.DataFrame, scene: str, dimension: int, dt: float, what: str) -> Figure | None:
    """Error over the iteration count at one step; columns engine, profile, iterations, error, label."""
    if len(table) == 0 or table["iterations"].nunique() < 2:
        return None
    x_scale, _ = log_scale(list(table["iterations"]), 1.15)
    x = alt.X(
        "iterations:Q",
        scale=x_scale,
        axis=alt.Axis(title="iterations per step", values=sorted(set(table["iterations"])), format="d"),
    )
    table = table.assign(error=gutter(table["error"]))
    y_scale, axis, _ = error_axis(list(table["error"]), what)
    y = alt.Y("error:Q", scale=y_scale, axis=axis)
    title = f"{scene} {dimension}-D: error against iterations"
    table = dodged(table, "iterations", "error")
    picture = svg(lines(table, x, y, below=gutter_band(list(table["error"]), y_scale, axis)), title)
    return Figure(f"fig-iterations-{scene}-{dimension}", title, f"dt = {format_dt(dt)} s. {DODGED}", picture)


def work_precision(points: pd.DataFrame, scene: str, dimension: int) -> Figure | None:
    """Error over cost, log-log; the line of a series joins its own front, the grey steps are the front over all."""
    table = points[(points["scene"] == scene) & (points["dimension"] == dimension)].copy()
    table = table[table["cost"].notna() & table["error"].notna()]
    if len(table) == 0:
        return None
    primary = primary_of(scene)
    table["shown"] = gutter(table["error"])
    table["label"] = [_point_text(row) for row in table.to_dict("records")]
    x_scale, x_ticks = log_scale([*table["cost_low"], *table["cost_high"]], 1.2)
    y_scale, axis, _ = error_axis(list(table["shown"]), with_unit(primary.name, primary.unit))
    x = alt.X("cost:Q", scale=x_scale, axis=power_axis("CPU time per simulated second [s/s]", x_ticks))
    y = alt.Y("shown:Q", scale=y_scale, axis=axis)
    style = styled(table)
    best = table[table["best"]].sort_values("cost")
    front = alt.Chart(best).mark_line(
        interpolate="step-after", color="currentColor", opacity=0.25, strokeWidth=5, aria=False
    )
    plain = named(table[["cost", "cost_low", "cost_high", "shown", "engine", "profile", "label", "on_front"]])
    own = alt.Chart(plain[plain["on_front"]]).mark_line(strokeWidth=1, opacity=0.55)
    mark = alt.Chart(plain).mark_point(size=46, strokeWidth=POINT, opacity=0.9)
    chart = alt.layer(
        *gutter_band(list(table["shown"]), y_scale, axis),
        front.encode(x=x, y=y),
        own.encode(x=x, y=y, color=style["color"], detail=["engine:N", "profile:N"], description="who:N"),
        intervals(plain, x, y, style["color"]),
        mark.encode(x=x, y=y, description="label:N", **style),
    ).properties(width=WIDTH, height=HEIGHT)
    title = f"{scene} {dimension}-D: {primary.name} against cost"
    caption = (
        "Lower left is better. Hollow: as shipped. Bars: interval of the median time. Grey steps: the best of all "
        "engines. Lines join the best settings of one profile."
    )
    return Figure(f"fig-work-{scene}-{dimension}", title, caption, svg(chart, title))


def intervals(table: pd.DataFrame, x: alt.X, y: alt.Y, colour: alt.Color) -> alt.Chart:
    """Error bars along x, from ``cost_low`` to ``cost_high``."""
    bar = alt.Chart(table).mark_rule(strokeWidth=1.6, opacity=0.6)
    low = alt.X("cost_low:Q", scale=x["scale"], axis=x["axis"])
    bars: alt.Chart = bar.encode(x=low, x2="cost_high:Q", y=y, color=colour, description="who:N")
    return bars


def _point_text(row: Mapping[Hashable, Any]) -> str:
    own = (
        "own iterations"
        if row["iterations"] is None or pd.isna(row["iterations"])
        else f"{row['iterations']:.0f} iterations"
    )
    return (
        f"{row['engine']}/{row['profile']}, dt {format_dt(row['dt'])} s, {own}: error {_error_text(row['error'])}, "
        f"{duration(row['cost'])} per simulated second ({duration(row['cost_low'])} to {duration(row['cost_high'])})"
    )


def motion(table: pd.DataFrame, truth: pd.DataFrame | None, what: str, title: str) -> Figure:
    """One coordinate over time for every engine; the truth is a broad grey line. Without it the axis is logarithmic."""
    x = alt.X("t:Q", axis=alt.Axis(title="time [s]", tickCount=8), scale=alt.Scale(nice=False))
    if truth is None:
        scale, ticks = log_scale(list(table["value"]), 2.0)
        y = alt.Y("value:Q", scale=scale, axis=power_axis(what, ticks))
    else:
        y = alt.Y("value:Q", axis=alt.Axis(title=what), scale=alt.Scale(zero=False))
    style = styled(table)
    own = alt.Chart(named(thinned(table))).mark_line(strokeWidth=1.6, opacity=0.9).encode(
        x=x, y=y, color=style["color"], strokeDash=dashes(table), detail=["engine:N", "profile:N"], description="who:N"
    )  # fmt: skip
    layers = [own]
    if truth is not None:
        ghost = alt.Chart(truth).mark_line(strokeWidth=7, opacity=0.18, color="currentColor", aria=False)
        layers = [ghost.encode(x=x, y=y), own]
    chart = alt.layer(*layers).properties(width=620, height=HEIGHT)
    caption = "Broad grey line: the exact motion." if truth is not None else "At 1e-6 m and below: at rest."
    return Figure("fig-" + title, title, caption, svg(chart, title))


def thinned(table: pd.DataFrame, most: int = 150) -> pd.DataFrame:
    """At most ``most`` samples of each series, evenly; a picture 600 pixels wide shows no more."""
    parts = []
    for _, group in table.groupby(["engine", "profile"], sort=False):
        stride = max(1, -(-len(group) // most))
        parts.append(group.iloc[::stride])
    return pd.concat(parts)
