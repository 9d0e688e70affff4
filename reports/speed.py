"""Speed against error for the terminal and as files; everything comes from the tables of `validation.bench`."""

from __future__ import annotations

import json
import math
from collections import defaultdict
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.box import SIMPLE_HEAD
from rich.table import Table
from rich.text import Text

from adapters import registry
from adapters.whole import write
from reports.wording import csv_of, number, plural
from validation.bench import agreement, reading, work
from validation.cells import Observation, Outcome, checks_of, format_dt
from validation.files.distance import primary_of
from validation.judging.verdicts import judge_physics
from validation.records.store import Run, Store

if TYPE_CHECKING:
    import pandas as pd

Tables = dict[str, "pd.DataFrame"]
#: Levels that fit into a terminal.
SHOWN_LEVELS = (1e-1, 1e-2, 1e-3, 1e-5)


def tables_of(store: Store, run: Run, observations: Sequence[Observation] | None = None) -> Tables:
    """All tables of a bench run by name; ``observations`` are its own, if already read."""
    timings = reading.timings_summary(store, run)
    points, scaling = work.work_points(store, run, observations, timings), reading.scaling(timings)
    return {
        "work_points": points,
        "time_at_equal_error": work.time_at_equal_error(points),
        "error_at_equal_time": work.error_at_equal_time(points),
        "scaling": scaling,
        "scaling_fits": reading.scaling_fits(scaling),
        "overhead": reading.overhead(timings),
        "ratios": agreement.ratios(store, run),
        "timings": timings,
    }


def plain(table: pd.DataFrame) -> list[dict[str, Any]]:
    """Rows as JSON-ready data; NaN becomes null."""
    return [{str(k): _plain(v) for k, v in row.items()} for row in table.to_dict("records")]


def _plain(value: Any) -> Any:
    value = value.item() if hasattr(value, "item") else value
    return None if isinstance(value, float) and not math.isfinite(value) else value


def as_json(run: Run, protocol: Mapping[str, Any], tables: Tables) -> str:
    """One object: the run with its machine, the protocol, and every table as a list of rows."""
    head = {"id": run.id, "date": run.date, "commit": run.commit, "machine": run.machine, "title": run.title}
    data = {"run": head, "protocol": dict(protocol)} | {name: plain(table) for name, table in tables.items()}
    return json.dumps(data, indent=1, allow_nan=False, default=str)


def write_all(folder: Path, run: Run, protocol: Mapping[str, Any], tables: Tables, raw: pd.DataFrame) -> list[Path]:
    """Write bench.json, one CSV per table, and the raw timings into ``folder/bench``."""
    target = folder / "bench"
    target.mkdir(parents=True, exist_ok=True)
    write(target / "bench.json", as_json(run, protocol, tables) + "\n")
    for name, table in {**tables, "raw_timings": raw}.items():
        flat = table.drop(columns=["slot"], errors="ignore")
        write(target / f"{name}.csv", csv_of(flat))
    return sorted(target.iterdir())


def raw_of(store: Store, run: Run) -> pd.DataFrame:
    """Raw timings, one row each."""
    import pandas as pd

    return pd.json_normalize([timing.as_dict() for timing in store.timings(run)])


def cheapest_passing(store: Store, run: Run) -> dict[tuple[str, int, str, str], float]:
    """Cost [s/s] of the largest step from which on a profile passes every check of its bench cases.

    Keys are (scene, dimension, engine, profile). A step counts only if every smaller one passes as well: a single pass
    may be luck.
    """
    passes: dict[tuple[Any, ...], dict[float, bool]] = defaultdict(lambda: defaultdict(lambda: True))
    observations = store.observations(run)
    for observation in observations:
        slot = observation.slot
        if slot.iterations is None:
            good = all(row["physics"] == "pass" or row["value"] is None for row in physics(observation))
            passes[slot.scene, slot.dimension, slot.engine, slot.profile][slot.dt] &= (
                good and observation.outcome is Outcome.OK
            )
    points = work.work_points(store, run, observations)
    own = points[points["iterations"].isna()].to_dict("records") if len(points) else []
    cost = {(p["scene"], p["dimension"], p["engine"], p["profile"], p["dt"]): p["cost"] for p in own}
    found = {}
    for key, steps in passes.items():
        order = sorted(steps, reverse=True)
        safe = [dt for k, dt in enumerate(order) if all(steps[finer] for finer in order[k:])]
        if safe and math.isfinite(cost.get((*key, safe[0]), math.nan)):
            found[key] = cost[*key, safe[0]]
    return found


def physics(observation: Observation) -> list[dict[str, Any]]:
    """Rows of a bench's case with PASS or FAIL only: standings belong to the run, and cost time."""
    slot = observation.slot
    same = {name: getattr(slot, name) for name in ("scene", "dimension", "engine", "profile", "dt", "iterations")}
    rows: list[dict[str, Any]] = []
    for check in checks_of(observation)[1]:
        value = observation.metrics.get(check.metric, (None, ""))[0]
        said = judge_physics(value, check) if observation.outcome is Outcome.OK else None
        error = None if value is None or check.truth is None else value - check.truth
        row = {"metric": check.metric, "value": value, "error": error, "tolerance": check.bound, "standing": None}
        rows.append({**same, **row, "physics": said and said.value, "outcome": observation.outcome.value})
    return rows


def key(ranked: bool) -> str:
    """Legend of the marks in a table of costs; a table without ranks has fewer."""
    ranks = "*: cheapest; =: no measurable difference from the cheapest; " if ranked else ""
    return f"{ranks}-: error not reached; 1/240 x30: time step, iterations"


def level_tables(points: pd.DataFrame, ranked: bool = True) -> list[Table]:
    """One table per scene and dimension: cost at equal error; of each level the cheapest and its ties are marked.

    Engines that cannot run there (a planar engine in 3-D) are in none.
    """
    levels = work.time_at_equal_error(points, SHOWN_LEVELS)
    out = []
    for (scene, dimension), group in reading.grouped(levels, ["scene", "dimension"]):
        primary = primary_of(scene)
        unit = "" if primary.unit == "1" else f" / {primary.unit}"
        title = f"{scene} {dimension}-D: CPU time per simulated second at {primary.name}{unit} of at most"
        table = _table(title)
        table.add_column("engine", no_wrap=True)
        for level in SHOWN_LEVELS:
            table.add_column(f"{level:.0e}".replace("e-0", "e-"), justify="right")
        table.add_column("best error", justify="right")
        for (engine, profile), rows in reading.grouped(group, ["engine", "profile"]):
            own = points[(points["scene"] == scene) & (points["dimension"] == dimension)]
            own = own[(own["engine"] == engine) & (own["profile"] == profile)]
            if len(own) and (own["outcome"] == Outcome.UNSUPPORTED.value).all():
                continue
            cells = [_level_cell(row, ranked) for row in rows.to_dict("records")]
            table.add_row(f"{engine}/{profile}", *cells, _smallest(own))
        out += [table] if table.row_count else []
    return out


def _table(title: str) -> Table:
    return Table(title=title, title_justify="left", box=SIMPLE_HEAD, show_edge=False, pad_edge=False)


def _level_cell(row: Mapping[Any, Any], ranked: bool) -> Text:
    import pandas as pd

    if not math.isfinite(row["cost"]):
        return Text("-")
    iterations = "" if row["iterations"] is None or pd.isna(row["iterations"]) else f" x{row['iterations']:.0f}"
    text = f"{duration(row['cost'])} {format_dt(row['dt'])}{iterations}"
    if not (ranked and row["tied"]):
        return Text(text)
    return Text(f"{'*' if row['rank'] == 1 else '='} {text}", style="bold")


def _smallest(points: pd.DataFrame) -> str:
    errors = points["error"].dropna()
    if len(errors) == 0:
        return str(points["outcome"].iloc[0]) if len(points) else "-"
    return number(float(errors.min()), 2)


def duration(seconds: float) -> str:
    """Time with a unit, three digits: ``412 us``, ``3.1 ms``."""
    for unit, size in (("s", 1.0), ("ms", 1e-3), ("us", 1e-6)):
        if abs(seconds) >= size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds / 1e-9:.3g} ns"


def overhead_table(overhead: pd.DataFrame) -> Table:
    """Cost of a step of an empty scene and of one free body, plain and with the state read after each step."""
    table = Table(
        title="Overhead: cost of a step without contact",
        title_justify="left",
        box=SIMPLE_HEAD,
        show_edge=False,
        pad_edge=False,
    )
    columns = [("empty", False), ("empty", True), ("free", False), ("free", True)]
    table.add_column("engine", no_wrap=True)
    for scene, sampled in columns:
        table.add_column({"empty": "empty", "free": "free body"}[scene] + (", sampled" if sampled else ""))
    ordered = in_order(overhead, ["dimension"])
    for (dimension, engine, profile), rows in reading.grouped(ordered, ["dimension", "engine", "profile"]):
        found = {(row["scene"], row["sampled"]): row for row in rows.to_dict("records")}
        shown = [duration(found[c]["per_step"]) if c in found and not found[c]["void"] else "-" for c in columns]
        table.add_row(f"{engine}/{profile} {dimension}-D", *shown)
    return table


def in_order(table: pd.DataFrame, names: list[str]) -> pd.DataFrame:
    """Rows sorted by ``names``, then engines as everywhere else (timings come in random order)."""
    if len(table) == 0:
        return table
    rank = {name: k for k, name in enumerate(registry.names())}
    keyed = table.assign(_engine=table["engine"].map(rank))
    return keyed.sort_values([*names, "_engine", "profile"], kind="stable").drop(columns="_engine")


def scaling_table(scaling: pd.DataFrame, fits: pd.DataFrame) -> Table:
    """Cost per step at the largest size that ran, and the fitted exponent."""
    table = Table(
        title="Cost of a step ~ x^p (x: bodies, or iterations)",
        title_justify="left",
        box=SIMPLE_HEAD,
        show_edge=False,
        pad_edge=False,
    )
    for column in ("what", "engine", "x", "per step", "p"):
        table.add_column(column, no_wrap=True)
    lost_any = scaling["void"].ne("").any() if len(scaling) else False
    if lost_any:
        table.add_column("left out")
    names = ["purpose", *reading.SERIES]
    groups = {key: group for key, group in reading.grouped(scaling, names)}
    for fit in in_order(fits, ["purpose", "scene", "dimension"]).to_dict("records"):
        group = groups[tuple(fit[name] for name in names)]
        ran, lost = group[group["void"] == ""].sort_values("x"), group[group["void"] != ""].sort_values("x")
        table.add_row(
            f"{fit['scene']} {fit['dimension']}-D, {fit['purpose']}",
            f"{fit['engine']}/{fit['profile']}",
            f"{ran['x'].iloc[-1]:g}" if len(ran) else "-",
            duration(ran["per_step"].iloc[-1]) if len(ran) else "-",
            f"{fit['exponent']:.2f} +- {fit['standard_error']:.2f}" if math.isfinite(fit["exponent"]) else "-",
            *([f"x >= {lost['x'].iloc[0]:g}: {lost['void'].iloc[0]}" if len(lost) else ""] if lost_any else []),
        )
    return table


#: Wall over CPU time of a unit above which another process used its core, and the share of such units that makes ranks
#: invalid.
TAKEN, SPOILT = 1.2, 0.1


def busy(timings: pd.DataFrame) -> str:
    """Warning if the machine was busy during timings, else empty: on a free core wall and CPU time are equal."""
    used = timings[timings["void"] == ""] if len(timings) else timings
    if len(used) == 0:
        return ""
    taken = float((used["load"] > TAKEN).mean())
    if taken <= SPOILT:
        return ""
    return (
        f"The machine was busy: for {taken:.0%} of the cases wall time is more than {TAKEN:g} times CPU time. "
        "Therefore no engine is ranked; run the benchmark again on an idle machine."
    )


def quality_line(timings: pd.DataFrame) -> str:
    """Quality of the timings, in one line."""
    used = timings[timings["void"] == ""] if len(timings) else timings
    if len(used) == 0:
        return "nothing was timed"
    return (
        f"{plural(len(used), 'case')} timed in {int(used['rounds'].sum())} timings, good to about "
        f"{100 * used['width'].median():.1f} % (median); {int(used['drifts'].sum())} drifted, "
        f"{len(timings) - len(used)} not timed; wall time / CPU time {used['load'].median():.2f} (median)"
    )
