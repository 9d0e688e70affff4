"""Speed: cost at equal error, error at equal cost, scaling, cost of the binding, and how everything was timed."""

from __future__ import annotations

import math
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import altair as alt
import pandas as pd

from reports import speed as tables_of_speed
from reports.page.charts import (
    POINT,
    dashes,
    error_axis,
    gutter,
    gutter_band,
    log_scale,
    named,
    power_axis,
    styled,
    svg,
    with_unit,
)
from reports.page.figures import Figure, intervals
from reports.page.source import Bench, Source
from reports.page.verdicts import slug
from reports.speed import duration
from reports.wording import number, reproduce
from validation.cells import format_dt
from validation.files.distance import primary_of

Plain = Mapping[Hashable, Any]
#: Share of a panel's width up to which a label fits to the right of a point: "1/1920" takes 40 of 215 pixels.
ROOM = 0.8


@dataclass(frozen=True)
class LevelCell:
    """Cost of an engine at one error (or its error at one cost); ``ties`` are indistinguishable from it."""

    text: str
    detail: str
    best: bool
    title: str
    ties: tuple[str, ...] = ()


@dataclass(frozen=True)
class LevelTable:
    """One scene and dimension: engines x levels; ``refused`` names engines that cannot run it and have no line."""

    anchor: str
    scene: str
    dimension: int
    name: str
    levels: list[str]
    rows: list[tuple[str, str, list[LevelCell]]]
    refused: str


@dataclass(frozen=True)
class Speed:
    """Everything of the section."""

    run: str
    columns: list[tuple[str, str]]
    quality: str
    busy: str
    cheapest: list[tuple[str, str, list[LevelCell]]]
    cheapest_levels: list[str]
    at_error: list[LevelTable]
    at_cost: list[LevelTable]
    multiples: list[Figure]
    scaling: list[Figure]
    fits: Sequence[Plain]
    overhead: Sequence[Plain]
    protocol: list[tuple[str, str]]
    voided: list[str]


def speed(source: Source) -> Speed | None:
    """None without a bench run."""
    bench = source.bench
    if bench is None:
        return None
    tables = bench.tables
    busy = tables_of_speed.busy(tables["timings"])
    at_error = _level_tables(tables["time_at_equal_error"], "cost", 1e-6, ranked=not busy)
    return Speed(
        bench.run.id,
        _timed(source, tables),
        tables_of_speed.quality_line(tables["timings"]),
        busy,
        *_cheapest(tables["time_at_equal_error"]),
        at_error,
        _level_tables(tables["error_at_equal_time"], "error", 0.0),
        _multiples(bench),
        _scaling_figures(tables["scaling"]),
        tables["scaling_fits"].to_dict("records"),
        _overhead(tables["overhead"], source.columns),
        _protocol(bench),
        _voided(tables["timings"]),
    )


def _timed(source: Source, tables: Mapping[str, pd.DataFrame]) -> list[tuple[str, str]]:
    """Timed columns of the page, in its order: profiles without a rank run, but are not timed."""
    timed_tables = [tables[name] for name in ("work_points", "scaling") if len(tables[name])]
    timed = {who for table in timed_tables for who in zip(table["engine"], table["profile"], strict=True)}
    return [column for column in source.columns if column in timed]


def level_text(level: float) -> str:
    """``1e-3``."""
    return f"{level:.0e}".replace("e-0", "e-").replace("e+00", "")


def _cheapest(table: pd.DataFrame) -> tuple[list[tuple[str, str, list[LevelCell]]], list[str]]:
    """Per scene and dimension the cheapest engine at each error level."""
    if len(table) == 0:
        return [], []
    levels = sorted(set(table["level"]), reverse=True)
    out = []
    for (scene, dimension), group in table.groupby(["scene", "dimension"], sort=False):
        cells = []
        for level in levels:
            found = group[(group["level"] == level) & group["tied"]].sort_values("cost")
            cells.append(_cheapest_cell(found.to_dict("records")))
        out.append((f"{scene} {dimension}-D", primary_of(str(scene)).name, cells))
    return out, [level_text(level) for level in levels]


def _cheapest_cell(tied: Sequence[Plain]) -> LevelCell:
    """The cheapest profile, and those that are indistinguishable from it."""
    if not tied:
        return LevelCell("none reaches it", "", False, "")
    row, *others = tied
    ties = tuple(f"{other['engine']}/{other['profile']}" for other in others)
    text = f"{row['engine']}/{row['profile']}"
    return LevelCell(text, f"{duration(row['cost'])}, {_setting(row)}", True, reproduce(row["slot"]), ties)


def _setting(row: Plain) -> str:
    own = "" if row["iterations"] is None or pd.isna(row["iterations"]) else f" × {row['iterations']:.0f} it."
    return f"dt {format_dt(row['dt'])}{own}"


def _level_tables(table: pd.DataFrame, column: str, smallest: float, ranked: bool = True) -> list[LevelTable]:
    out: list[LevelTable] = []
    if len(table) == 0:
        return out
    for (scene, dimension), group in table.groupby(["scene", "dimension"], sort=False):
        levels = [level for level in sorted(set(group["level"]), reverse=column == "cost") if level >= smallest]
        rows, refused = [], []
        for (engine, profile), own in group.groupby(["engine", "profile"], sort=False):
            if all(str(reason).startswith("unsupported") for reason in own["reason"]):
                refused.append(f"{engine}/{profile}")
                continue
            by_level = {row["level"]: row for row in own.to_dict("records")}
            rows.append((str(engine), str(profile), [_level_cell(by_level[level], column, ranked) for level in levels]))
        names = [level_text(level) if column == "cost" else duration(level) for level in levels]
        anchor = slug("level", column, scene, dimension)
        out.append(
            LevelTable(
                anchor, str(scene), int(str(dimension)), primary_of(str(scene)).name, names, rows, ", ".join(refused)
            )
        )
    return out


def _level_cell(row: Plain, column: str, ranked: bool) -> LevelCell:
    value = float(row[column])
    if not math.isfinite(value):
        return LevelCell("–", "", False, str(row["reason"]))
    factor = float(row["times_cheapest" if column == "cost" else "times_best"])
    text = duration(value) if column == "cost" else number(value, 2)
    apart = ranked and factor > 1.0 and math.isfinite(factor) and not row["tied"]
    times = f", ×{factor:.3g}" if apart else ", tie" if ranked and row["tied"] and row["rank"] != 1 else ""
    return LevelCell(text, _setting(row) + times, ranked and bool(row["tied"]), reproduce(row["slot"]))


def _multiples(bench: Bench) -> list[Figure]:
    """Small work-precision panels on one axis of cost: the best settings of every profile, scene by scene.

    A scene that was timed in 2-D and 3-D is shown in 2-D; its own section has both.
    """
    points = bench.tables["work_points"]
    if len(points) == 0:
        return []
    used = points[points["cost"].notna() & points["error"].notna() & points["on_front"]].copy()
    used["shown"] = gutter(used["error"])
    x_scale, ticks = log_scale([*used["cost_low"], *used["cost_high"]], 1.3)
    low, high = map(math.log, x_scale["domain"])
    used["right"] = used["cost"].map(lambda cost: (math.log(cost) - low) / (high - low) < ROOM)
    x = alt.X("cost:Q", scale=x_scale, axis=power_axis("CPU s per simulated s", ticks))
    figures = []
    for scene, table in used.groupby("scene", sort=False):
        dimension = int(table["dimension"].min())
        figures.append(_multiple(str(scene), dimension, table[table["dimension"] == dimension], x))
    return figures


def _multiple(scene: str, dimension: int, table: pd.DataFrame, x: alt.X) -> Figure:
    primary, style = primary_of(scene), styled(table)
    y_scale, axis, _ = error_axis(list(table["shown"]), with_unit(primary.name, primary.unit), 3.0)
    y = alt.Y("shown:Q", scale=y_scale, axis=axis)
    table = table.assign(label=[
        f"{r['engine']}/{r['profile']}, {_setting(r)}: error {number(r['error'], 2)}, {duration(r['cost'])}"
        for r in table.to_dict("records")
    ], step=table["dt"].map(format_dt))[
        ["cost", "cost_low", "cost_high", "shown", "engine", "profile", "label", "step", "best", "right"]
    ]  # fmt: skip
    table = named(table)
    on_front = table[table["best"]].sort_values("cost")
    best = alt.Chart(on_front)
    # Only the first and the last point show their time step: the others lie too close together. Of points with the
    # same error the cheapest counts.
    labelled = on_front.drop_duplicates("shown")
    labelled = labelled.iloc[[0, -1][: len(labelled)]]
    thin = alt.Chart(table).mark_line(strokeWidth=1.1, opacity=0.7)
    points = alt.Chart(table).mark_point(strokeWidth=POINT, size=40)
    detail = {"detail": ["engine:N", "profile:N"], "description": "who:N"}
    front: dict[str, Any] = {
        "interpolate": "step-after",
        "color": "currentColor",
        "opacity": 0.25,
        "strokeWidth": 5,
        "aria": False,
    }
    chart = alt.layer(
        *gutter_band(list(table["shown"]), y_scale, axis),
        best.mark_line(**front).encode(x=x, y=y),
        thin.encode(x=x, y=y, color=style["color"], strokeDash=dashes(table), **detail),
        intervals(table, x, y, style["color"]),
        points.encode(x=x, y=y, description="label:N", **style),
        *(_steps(own, bool(side)).encode(x=x, y=y) for side, own in labelled.groupby("right")),
    ).properties(width=215, height=180)
    title = f"{scene} {dimension}-D"
    return Figure(f"fig-multiple-{title}", title, "", svg(chart, f"Work and precision, {title}"))


def _steps(table: pd.DataFrame, right: bool) -> alt.Chart:
    """Time steps beside points: above them, away from the axis, and on the side on which they fit into the plot."""
    side: dict[str, Any] = {"align": "left", "dx": 5} if right else {"align": "right", "dx": -5}
    steps: alt.Chart = alt.Chart(table).mark_text(dy=-8, fontSize=11, aria=False, **side).encode(text="step:N")
    return steps


def _scaling_figures(table: pd.DataFrame) -> list[Figure]:
    """Cost of a step over bodies or iterations."""
    out: list[Figure] = []
    if len(table) == 0:
        return out
    used = table[(table["void"] == "") & table["per_step"].notna()]
    for (purpose, scene, dimension), group in used.groupby(["purpose", "scene", "dimension"], sort=False):
        out.append(_scaling_figure(str(purpose), str(scene), int(str(dimension)), group))
    return out


def _scaling_figure(purpose: str, scene: str, dimension: int, group: pd.DataFrame) -> Figure:
    rows = [
        {
            "engine": r["engine"], "profile": r["profile"], "x": r["x"], "y": r["per_step"],
            "low": r["per_step_low"], "high": r["per_step_high"],
            "label": f"{r['engine']}/{r['profile']}, {r['x']:g} {purpose}: {duration(r['per_step'])} per step, "
            f"error {number(None if pd.isna(r['error']) else r['error'], 2)}",
        }
        for r in group.to_dict("records")
    ]  # fmt: skip
    data = named(pd.DataFrame(rows))
    style = styled(data)
    x_scale, x_ticks = log_scale(list(data["x"]), 1.3)
    y_scale, y_ticks = log_scale([*data["low"], *data["high"]], 1.3)
    x = alt.X("x:Q", scale=x_scale, axis=power_axis(purpose, x_ticks))
    y = alt.Y("y:Q", scale=y_scale, axis=power_axis("CPU time per step [s]", y_ticks))
    thin = alt.Chart(data).mark_line(strokeWidth=1.2, opacity=0.75)
    points = alt.Chart(data).mark_point(strokeWidth=POINT, size=40)
    bars = alt.Chart(data).mark_rule(strokeWidth=1.6, opacity=0.6)
    low = alt.Y("low:Q", scale=y_scale, axis=power_axis("CPU time per step [s]", y_ticks))
    detail = {"detail": ["engine:N", "profile:N"], "description": "who:N"}
    chart = alt.layer(
        thin.encode(x=x, y=y, color=style["color"], strokeDash=dashes(data), **detail),
        bars.encode(x=x, y=low, y2="high:Q", color=style["color"], description="who:N"),
        points.encode(x=x, y=y, description="label:N", **style),
    ).properties(width=330, height=220)
    title = f"{scene} {dimension}-D, cost against {purpose}"
    return Figure(f"fig-scaling-{title}", title, "", svg(chart, title))


def _overhead(table: pd.DataFrame, columns: Sequence[tuple[str, str]]) -> Sequence[Plain]:
    """One row per dimension, engine and profile, in the page's order: empty and free, plain and with states read."""
    rows: dict[tuple[Any, ...], dict[Hashable, Any]] = {}
    for r in table.to_dict("records"):
        key = (r["engine"], r["profile"], r["dimension"])
        row = rows.setdefault(key, {"engine": r["engine"], "profile": r["profile"], "dimension": r["dimension"]})
        value = duration(r["per_step"]) if math.isfinite(r["per_step"]) else "–"
        row[f"{r['scene']}{'_sampled' if r['sampled'] else ''}"] = value
    place = {column: k for k, column in enumerate(columns)}
    return sorted(rows.values(), key=lambda r: (r["dimension"], place.get((r["engine"], r["profile"]), len(place))))


def _protocol(bench: Bench) -> list[tuple[str, str]]:
    """The stored protocol, one line each, with nested tables flattened; headline errors are in the scenes' sections."""
    kept = {k: v for k, v in bench.protocol.items() if k != "primary" and v not in (None, "", [], {})}
    return [(name.replace("_", " "), _as_text(value)) for name, value in kept.items()]


def _as_text(value: Any) -> str:
    if isinstance(value, Mapping):
        return "; ".join(f"{k}: {_as_text(v)}" for k, v in value.items())
    if isinstance(value, list):
        return "; ".join(_as_text(item) for item in value)
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _voided(timings: pd.DataFrame) -> list[str]:
    """Timings that must not be used, with the reason."""
    if len(timings) == 0:
        return []
    void = timings[timings["void"] != ""].to_dict("records")
    said = (f"{r['engine']}/{r['profile']} {r['scene']} {r['dimension']}-D ({r['purpose']}): {r['void']}" for r in void)
    return list(dict.fromkeys(said))
