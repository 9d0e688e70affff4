"""Charts of cases and benches, for notebooks and papers: ``chart.save("figure.pdf")`` needs no browser."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from adapters.engine import Array
from adapters.scene import Scene, SceneError
from adapters.trajectory import Trajectory
from reports.command.reporting import extra
from reports.palette import HOLLOW, colours_of, dash_of, role_of, shape_of
from validation.cells import format_dt
from validation.files.distance import primary_of
from validation.metrics import free_bodies

with extra("plot"):
    import altair as alt
    import vl_convert  # noqa: F401  (writes PDF, SVG and PNG; asked for before anything is drawn)

    from reports.page.charts import error_axis, gutter, log_scale, power_axis, with_unit

#: Largest number of drawn samples of a motion; a page has fewer points.
MOST_SAMPLES = 4000
#: Columns that the figure of error against time draws.
COLUMNS = ["cost", "shown", "error", "who", "panel", "step", "end", "best", "on_front"]
#: Smallest drawn share of a tolerance; below it, differences do not matter for the choice of an engine.
LEAST = 1e-3
#: Colours of checks within and beyond their tolerance, distinct in the common kinds of colour blindness.
VERDICTS = {"pass": "#3b75af", "fail": "#d4504e"}


def checks_chart(rows: Sequence[Mapping[str, Any]], title: str) -> alt.LayerChart | alt.FacetChart:
    """Error of each check over its tolerance, on a logarithmic axis; beyond 1 a check fails.

    Raises
    ------
    SceneError
        If no check has an error and a tolerance.
    """
    shown = [
        {
            "check": row["metric"],
            "ratio": max(abs(row["error"]) / row["tolerance"], LEAST),
            "verdict": row["physics"],
        }
        for row in rows
        if row["error"] is not None and row["tolerance"] and row["physics"]
    ]
    if not shown:
        raise SceneError(f"plot: no check has an error to draw: {rows[0]['reason'] if rows else 'nothing is judged'}")
    x = alt.X(
        "ratio:Q", scale=alt.Scale(type="log", domainMin=LEAST), title=f"error / tolerance ({LEAST:g}: that or less)"
    )
    colour = alt.Color(
        "verdict:N", scale=alt.Scale(domain=list(VERDICTS), range=list(VERDICTS.values())), title="verdict"
    )
    points = alt.Chart(_data(shown)).mark_point(filled=True, size=70)
    limit = alt.Chart(_data([{"ratio": 1.0}])).mark_rule(strokeDash=[4, 3]).encode(x="ratio:Q")
    drawn = points.encode(x=x, y=alt.Y("check:N", sort=None, title=None), color=colour)
    return alt.layer(drawn, limit).properties(title=title, width=420)


def motion_chart(
    scene: Scene, trajectory: Trajectory | None, what: str, title: str, truth: Trajectory | None = None
) -> alt.Chart:
    """Draw a component of the pose or the velocity of each free body over time, dashed of the true motion.

    Raises
    ------
    SceneError
        If there is no such component, or no motion.
    """
    if trajectory is None:
        raise SceneError("plot: the engine gave no motion to draw")
    known = components(trajectory)
    if what not in known:
        raise SceneError(f"plot: there is no {what!r}, only checks, {', '.join(known)}")
    unit, records = known[what][1], []
    for of, motion in (("engine", trajectory), ("truth", truth)):
        if motion is None:
            continue
        values, stride = components(motion)[what][0], max(1, math.ceil(len(motion.t) / MOST_SAMPLES))
        records += [
            {"t": float(t), "value": float(value), "body": scene.bodies[body].name, "of": of}
            for body in free_bodies(scene)
            for t, value in zip(motion.t[::stride], values[::stride, body], strict=True)
        ]
    lines = alt.Chart(_data(records)).mark_line(strokeWidth=1.5)
    drawn: alt.Chart = lines.encode(
        x=alt.X("t:Q", title="time [s]"),
        y=alt.Y("value:Q", title=f"{what} [{unit}]", scale=alt.Scale(zero=False)),
        color=alt.Color("body:N", title="body", sort=None),
        strokeDash=alt.StrokeDash(
            "of:N", title=None, scale=alt.Scale(domain=["engine", "truth"], range=[[1, 0], [5, 3]])
        ),
    )
    return drawn.properties(title=title, width=420, height=260)


def components(trajectory: Trajectory) -> dict[str, tuple[Array, str]]:
    """Components of poses and velocities by name, (s, n) each, with their units."""
    d = trajectory.dimension
    axes = "xyz"[:d]
    found = {axis: (trajectory.pose[:, :, k], "m") for k, axis in enumerate(axes)}
    if d == 2:
        found["angle"] = trajectory.pose[:, :, 2], "rad"
    found |= {f"v{axis}": (trajectory.twist[:, :, k], "m/s") for k, axis in enumerate(axes)}
    found["speed"] = np.linalg.norm(trajectory.twist[:, :, :d], axis=2), "m/s"
    return found


def work_chart(points: pd.DataFrame) -> alt.FacetChart:
    """Error over cost of all work points, one panel for each dimension.

    Raises
    ------
    SceneError
        If no point has an error and a cost.
    """
    used = points[points["cost"].notna() & points["error"].notna()] if len(points) else points
    if len(used) == 0:
        raise SceneError("plot: no case has an error and a time")
    primary = primary_of(str(used["scene"].iloc[0]))
    used = used.assign(shown=gutter(used["error"]), who=used["engine"] + "/" + used["profile"])
    used["panel"] = used["scene"] + " " + used["dimension"].astype(str) + "-D"
    used["step"] = [
        format_dt(float(dt)) + ("" if pd.isna(count) else f" x{count:.0f}")
        for dt, count in zip(used["dt"], used["iterations"], strict=True)
    ]
    # As on the page: the first and the last point of the front over all engines show their step.
    fronts = [own[own["best"]].sort_values("cost").drop_duplicates("shown") for _, own in used.groupby("panel")]
    ends = pd.concat([own.iloc[[0, -1][: len(own)]] for own in fronts])
    used["end"] = used["step"].where(used.index.isin(ends.index), "")
    series = list(dict.fromkeys(zip(used["engine"], used["profile"], strict=True)))
    colours = colours_of([engine for engine, _ in series])
    own_colours = [colours[engine] for engine, _ in series]
    fills = ["white" if role_of(profile) in HOLLOW else colours[engine] for engine, profile in series]
    shapes, patterns = ([mark(profile) for _, profile in series] for mark in (shape_of, dash_of))

    def by(channel: Any, values: Sequence[Any]) -> Any:
        """One legend of all channels: they have the same domain."""
        domain = [f"{engine}/{profile}" for engine, profile in series]
        legend = None if channel is alt.StrokeDash else alt.Legend(title=None, labelLimit=0, symbolLimit=0)
        return channel("who:N", scale=alt.Scale(domain=domain, range=values), legend=legend)

    colour = by(alt.Color, own_colours)
    x_scale, ticks = log_scale([*used["cost"]], 1.3)
    y_scale, y_axis, _ = error_axis(list(used["shown"]), with_unit(primary.name, primary.unit), 3.0)
    x = alt.X("cost:Q", scale=x_scale, axis=power_axis("CPU time per simulated second [s/s]", ticks))
    base = alt.Chart().encode(x=x, y=alt.Y("shown:Q", scale=y_scale, axis=y_axis))
    fine = base.transform_filter("datum.on_front")
    dash = by(alt.StrokeDash, [list(each) or [1, 0] for each in patterns])
    chart = alt.layer(
        base.transform_filter("datum.best").mark_line(interpolate="step-after", color="#d8d8d8", strokeWidth=5),
        fine.mark_line(strokeWidth=1.2).encode(color=colour, strokeDash=dash),
        base.mark_point(size=45, opacity=1.0).encode(
            tooltip=["who:N", "step:N", "error:Q", "cost:Q"],
            color=colour,
            fill=by(alt.Fill, fills),
            shape=by(alt.Shape, shapes),
        ),
        base.mark_text(align="left", dx=6, dy=-7, fontSize=10).encode(text="end:N"),
        data=_data(used[COLUMNS].to_dict("records")),
    )
    return chart.properties(width=340, height=280).facet(column=alt.Column("panel:N", title=None))


def _data(records: Sequence[Mapping[Any, Any]]) -> alt.InlineData:
    """Data inside the chart, for any number of rows."""
    return alt.InlineData(values=list(records))
