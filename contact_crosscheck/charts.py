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
from reports.palette import colours_of, shape_of
from validation.cells import format_dt
from validation.metrics import free_bodies
from validation.posed import primary_of

with extra("plot"):
    import altair as alt
    import vl_convert  # noqa: F401  (writes PDF, SVG and PNG; asked for before anything is drawn)

#: Largest number of drawn samples of a motion; a page has fewer points.
MOST_SAMPLES = 4000
#: Smallest error on a logarithmic axis; smaller ones are drawn there.
EXACT = 1e-16
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


def motion_chart(scene: Scene, trajectory: Trajectory | None, what: str, title: str) -> alt.Chart:
    """Draw a component of the pose or the velocity of each free body over time.

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
    values, unit = known[what]
    stride = max(1, math.ceil(len(trajectory.t) / MOST_SAMPLES))
    records = [
        {"t": float(t), "value": float(value), "body": scene.bodies[body].name}
        for body in free_bodies(scene)
        for t, value in zip(trajectory.t[::stride], values[::stride, body], strict=True)
    ]
    lines = alt.Chart(_data(records)).mark_line(strokeWidth=1.5)
    return lines.encode(
        x=alt.X("t:Q", title="time [s]"),
        y=alt.Y("value:Q", title=f"{what} [{unit}]", scale=alt.Scale(zero=False)),
        color=alt.Color("body:N", title="body", sort=None),
    ).properties(title=title, width=420, height=260)


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
    records = [
        {
            "who": f"{row['engine']}/{row['profile']}",
            "dimension": f"{row['scene']} {row['dimension']}-D",
            "cost": float(row["cost"]),
            "error": max(float(row["error"]), EXACT),
            "step": format_dt(float(row["dt"])) + ("" if pd.isna(row["iterations"]) else f" x{row['iterations']:.0f}"),
            "best": bool(row["on_front"]),
        }
        for row in used.to_dict("records")
    ]
    series = list(dict.fromkeys(zip(used["engine"], used["profile"], strict=True)))
    names, colours = [f"{engine}/{profile}" for engine, profile in series], colours_of([each for each, _ in series])
    who = {
        "color": alt.Color(
            "who:N", title=None, scale=alt.Scale(domain=names, range=[colours[engine] for engine, _ in series])
        ),
        "shape": alt.Shape(
            "who:N", title=None, scale=alt.Scale(domain=names, range=[shape_of(profile) for _, profile in series])
        ),
    }
    unit = "" if primary.unit == "1" else f" [{primary.unit}]"
    exact = f", {EXACT:g} where it is exact" if any(row["error"] == EXACT for row in records) else ""
    x = alt.X("cost:Q", scale=alt.Scale(type="log"), title="CPU time per simulated second [s/s]")
    y = alt.Y("error:Q", scale=alt.Scale(type="log"), title=f"{primary.name}{unit}{exact}")
    base = alt.Chart().encode(x=x, y=y)
    best = base.transform_filter("datum.best")
    chart = alt.layer(
        best.mark_line(strokeWidth=1.2).encode(color=who["color"]),
        base.mark_point(filled=True, size=45).encode(tooltip=["who:N", "step:N", "error:Q", "cost:Q"], **who),
        best.mark_text(align="left", dx=6, dy=-4, fontSize=10).encode(text="step:N", color=who["color"]),
        data=_data(records),
    )
    return chart.properties(width=340, height=280).facet(column=alt.Column("dimension:N", title=None))


def _data(records: Sequence[Mapping[str, Any]]) -> alt.InlineData:
    """Data inside the chart, for any number of rows."""
    return alt.InlineData(values=list(records))
