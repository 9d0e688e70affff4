"""Bounce explorer: the law h_n = e^(2n) h0 beside measured heights; restitution set against restitution measured.

Scenes declare which of their metrics show a restitution (`validation.canonical.Restitution`).
"""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import altair as alt
import numpy as np
import pandas as pd

from reports.page.charts import POINT, dashes, dodged, named, styled, svg
from reports.page.figures import Figure
from reports.page.opening import SECOND, called, shown, word_of
from reports.page.source import Plain, Source
from reports.palette import HOLLOW, colours_of, role_of, shape_of
from reports.wording import number
from validation.canonical import Restitution
from validation.catalogue import CATALOGUE

#: Familiar materials, with the coefficient that is usually quoted for them.
PRESETS = (("rubber", 0.8), ("billiard ball", 0.95), ("clay", 0.0))
FAINT = (0.9, 0.5)
#: Width of a panel of restitution [px], and the distance from the diagonal below which a point counts as on it
#: [restitution].
MAP, BAND = 300, 0.02
#: Height of a line of text in it, and width of a letter [restitution].
LINE, LETTER = 0.065, 0.026


@dataclass(frozen=True)
class Explorer:
    """Data of the slider, its picture without JavaScript, and the pictures of restitution with their scene.

    ``shown`` are the engines and profiles with points in the picture.
    """

    data: dict[str, Any]
    shown: list[tuple[str, str]]
    figure: Figure
    maps: list[Figure]
    scene: str


def explorer(source: Source) -> Explorer | None:
    """None if no scene of the run shows restitution."""
    bounced, struck = shown(source, True), shown(source, False)
    heights = _heights(source, *bounced) if bounced else {}
    rebounds = _rebounds(source, *struck) if struck else []
    if not heights and not rebounds:
        return None
    colours, own = colours_of(source.engines), [column for column in source.columns if heights.get(column)]
    series: list[dict[str, Any]] = [
        {
            "name": f"{engine}/{profile}", "colour": colours[engine], "shape": shape_of(profile),
            "hollow": role_of(profile) in HOLLOW,
            "heights": {f"{e:g}": values for e, values in sorted(heights.get((engine, profile), {}).items())},
        }
        for engine, profile in own
    ]  # fmt: skip
    measured = sorted({float(e) for entry in series for e in entry["heights"]})
    apexes = bounced[1].heights if bounced else 0
    data = {"presets": PRESETS, "faint": FAINT, "apexes": apexes, "measured": measured, "series": series}
    scene, scale = (struck[0], struck[1].scale) if struck else ("", "")
    return Explorer(data, own, _picture(heights, 0.8), _maps(rebounds, scene, scale), scene)


def _heights(source: Source, scene: str, shown: Restitution) -> dict[tuple[str, str], dict[float, list[float]]]:
    """Mean apex heights over drop heights, h_n/h0 for n = 1.., by engine and profile and restitution (planar first)."""
    sums: dict[tuple[str, str], dict[float, dict[int, list[float]]]] = defaultdict(lambda: defaultdict(dict))
    first = f"{shown.metric}["
    rows = [r for r in source.of(scene=scene) if r["metric"].startswith(first) and r["value"] is not None]
    for row in sorted(rows, key=lambda r: r["dimension"]):
        place = sums[row["engine"], row["profile"]][row["params"][shown.asked]]
        n = int(row["metric"][len(first) : -1])
        if row["iterations"] is None and row["dimension"] == min(r["dimension"] for r in rows):
            place.setdefault(n, []).append(row["value"] / row["params"][shown.scale])
    found: dict[tuple[str, str], dict[float, list[float]]] = defaultdict(dict)
    for column, by_e in sums.items():
        for e, by_n in by_e.items():
            if by_n:
                found[column][e] = [round(sum(by_n[n]) / len(by_n[n]), 5) for n in sorted(by_n)]
    return found


def _rebounds(source: Source, scene: str, shown: Restitution) -> list[Plain]:
    """Ratios of speeds with the set restitution and the speed: ``asked``, ``got``, ``speed``."""
    rows = source.of(scene=scene, metric=shown.metric)
    return [
        {**row, "asked": row["params"][shown.asked], "got": row["value"], "speed": row["params"][shown.scale]}
        for row in rows if row["value"] is not None and row["iterations"] is None
    ]  # fmt: skip


def _picture(heights: Mapping[tuple[str, str], Mapping[float, Sequence[float]]], e: float) -> Figure:
    """The explorer as a still picture: law, faint curves, and points of engines at one restitution."""
    n = range(0, 9)
    law = pd.DataFrame([{"n": k, "h": c ** (2 * k), "e": c} for c in (e, *FAINT) for k in n])
    rows = [
        {
            "n": k + 1, "h": h, "engine": engine, "profile": profile,
            "label": f"{engine}/{profile}: h{k + 1} = {h:.4g} h0",
        }
        for (engine, profile), by_e in heights.items() for k, h in enumerate(by_e.get(e, ()))
    ]  # fmt: skip
    x = alt.X("n:Q", axis=alt.Axis(title="bounce n", tickMinStep=1, format="d"), scale=alt.Scale(domain=[0, 8]))
    y = alt.Y("h:Q", axis=alt.Axis(title="apex height h_n / h0"), scale=alt.Scale(domain=[0, 1]))
    curves = alt.Chart(law).mark_line(color="currentColor", point=False, aria=False)
    opacity = alt.condition(f"datum.e == {e}", alt.value(0.8), alt.value(0.22))
    names = pd.DataFrame([{"n": 2.1, "h": c**4.2 + 0.03, "text": f"e = {c:g}"} for c in (e, *FAINT)])
    texts = alt.Chart(names).mark_text(align="left", color="currentColor", opacity=0.7, aria=False)
    layers = [curves.encode(x=x, y=y, detail="e:N", opacity=opacity), texts.encode(x=x, y=y, text="text:N")]
    if rows:
        table = dodged(pd.DataFrame(rows), "n", "h", logarithmic=False)
        points = alt.Chart(table).mark_point(strokeWidth=POINT, size=60)
        layers.append(points.encode(x=x, y=y, description="label:N", **styled(table)))
    title = f"Apex heights for e = {e:g}"
    picture = svg(alt.layer(*layers).properties(width=620, height=320), title)
    said = "Lines: h_n = e^(2n) h0. Points: measured; those that coincide stand side by side."
    return Figure("fig-explorer", title, said, picture)


def _maps(rebounds: Sequence[Plain], scene: str, scale: str) -> list[Figure]:
    """Measured over set restitution, one panel per approach speed, in 2-D if it ran; the most informative one first.

    That is the one in which most engines leave the diagonal; of equals the one with most points, then the one of most
    cases of the quick suite, so that reports of all suites begin with the same.
    """
    if not rebounds:
        return []
    quick = Counter(CATALOGUE[scene].complete(each.params).get(scale) for each in CATALOGUE[scene].quick)
    dimension = min(row["dimension"] for row in rebounds)
    panels: dict[float, list[Plain]] = defaultdict(list)
    for row in rebounds:
        if row["dimension"] == dimension:
            panels[row["speed"]].append(row)
    first = max(panels, key=lambda v: (len(_leaving(panels[v])), len(panels[v]), quick[v]))
    return [_map(panels[v], v, scene) for v in [first, *sorted(panels.keys() - {first})]]


def _leaving(rows: Sequence[Plain]) -> list[tuple[str, str]]:
    """Engines and profiles that visibly leave the diagonal anywhere."""
    off = [(row["engine"], row["profile"]) for row in rows if abs(row["got"] - row["asked"]) > BAND]
    return list(dict.fromkeys(off))


def _map(rows: Sequence[Plain], speed: float, scene: str) -> Figure:
    """One panel: a grey diagonal for all that rebound as set, and a named line for each that does not."""
    off = _leaving(rows)
    table = named(pd.DataFrame(
        {
            "engine": row["engine"], "profile": row["profile"], "asked": row["asked"], "got": row["got"],
            "label": f"{row['engine']}/{row['profile']}: set {row['asked']:g}, measured {number(row['got'], 4)}",
            "off": (row["engine"], row["profile"]) in off,
        }
        for row in rows
    ))  # fmt: skip
    ticks = alt.Axis(title="restitution that was set", values=[0, 0.2, 0.4, 0.6, 0.8, 1])
    x = alt.X("asked:Q", axis=ticks, scale=alt.Scale(domain=[-0.03, 1.03], nice=False))
    top = max(1.03, float(table["got"].max()) * 1.05)
    low = min(-0.03, float(table["got"].min()) * 1.05)
    y = alt.Y("got:Q", axis=alt.Axis(title="restitution measured", values=[0, 0.2, 0.4, 0.6, 0.8, 1]),
              scale=alt.Scale(domain=[low, top], nice=False))  # fmt: skip
    diagonal = alt.Chart(pd.DataFrame({"asked": [0.0, 1.0], "got": [0.0, 1.0]}))
    wide = 2.0 * BAND * MAP / (1.06 * math.sqrt(2.0))  # width across the line of `BAND` above and below it
    on, left = table[~table["off"]], table[table["off"]]
    layers = [
        diagonal.mark_line(color="currentColor", opacity=0.25, strokeWidth=wide, aria=False).encode(x=x, y=y),
        alt.Chart(on).mark_point(filled=True, size=14, color="currentColor", opacity=0.6)
        .encode(x=x, y=y, description="label:N"),
        _labels(_diagonal_label(on, off), x, y, "currentColor"),
    ]  # fmt: skip
    style = styled(table)
    if off:
        layers.append(alt.Chart(left).mark_line(strokeWidth=2.5).encode(
            x=x, y=y, color=style["color"], strokeDash=dashes(table), detail=["engine:N", "profile:N"],
            description="who:N",
        ))  # fmt: skip
        layers.append(
            alt.Chart(left).mark_point(strokeWidth=POINT, size=60).encode(x=x, y=y, description="label:N", **style)
        )
    layers += [_labels(places, x, y, colour) for places, colour in _end_labels(left)]
    chart = alt.layer(*layers).properties(width=MAP, height=0.9 * MAP)
    title = f"Impact at {speed:g} m/s"
    caption = f"{title}, scene {scene}. Grey band: what is measured is what was set, to within {BAND:g}."
    return Figure(f"fig-map-{speed:g}", title, caption, svg(chart, f"Restitution that was set and measured. {title}"))


def _labels(places: Sequence[tuple[float, float, str]], x: alt.X, y: alt.Y, colour: str) -> alt.Chart:
    """Text that ends at given places of a panel."""
    table = pd.DataFrame(places, columns=["asked", "got", "text"])
    mark = alt.Chart(table).mark_text(align="right", fontSize=13, fontWeight=600, color=colour, opacity=0.9, aria=False)
    labels: alt.Chart = mark.encode(x=x, y=y, text="text:N")
    return labels


def _end_labels(left: pd.DataFrame) -> list[tuple[list[tuple[float, float, str]], str]]:
    """Names of lines above or below them, as near to their right ends as no other line or name is in the way."""
    tracks = {who: own.sort_values("asked") for who, own in left.groupby("who", sort=False)}
    ends = left.sort_values("asked").drop_duplicates("who", keep="last").sort_values("got")
    found: list[tuple[list[tuple[float, float, str]], str]] = []
    colours, taken = colours_of(list(ends["engine"])), list[tuple[float, float]]()
    for end in ends.to_dict("records"):
        text, own = f"{called(end['engine'])} {word_of(end['profile'])}", tracks[end["who"]]
        others = [track for who, track in tracks.items() if who != end["who"]]
        x, y = _free_place(own, len(text) * LETTER, taken, others)
        taken.append((x, y))
        found.append(([(x, y, text)], colours[end["engine"]]))
    return found


def _free_place(
    own: pd.DataFrame, wide: float, taken: Sequence[tuple[float, float]], others: Sequence[pd.DataFrame]
) -> tuple[float, float]:
    """Where a name of this width may end: beside its line, away from other lines, the diagonal and other names."""

    def is_free(x: float, y: float) -> bool:
        along = np.linspace(x - wide, x, 25)
        tracks = [along, *(np.interp(along, each["asked"], each["got"]) for each in (own, *others))]
        names = any(abs(y - high) < 0.99 * LINE and abs(x - right) < wide for right, high in taken)
        return not names and y > 0.0 and all(np.abs(track - y).min() > 0.6 * LINE for track in tracks)

    top = float(own["got"].iloc[-1])
    stacked = (1.02, max([top, *(high for _, high in taken)]) + LINE)
    beside = [
        (x, float(np.interp(x, own["asked"], own["got"])) + side * LINE)
        for x in (0.9, 0.8, 0.7, 0.6) for side in (1, -1)
    ]  # fmt: skip
    places = [(1.02, top + LINE), (1.02, top - LINE), stacked, *beside]
    return next((place for place in places if is_free(*place)), stacked)


def _diagonal_label(on: pd.DataFrame, off: Sequence[tuple[str, str]]) -> list[tuple[float, float, str]]:
    """The engines on the diagonal, in two lines of text to the left of it."""
    kept = list(dict.fromkeys(zip(on["engine"], on["profile"], strict=True)))
    if not off:
        texts = ["every engine", "and profile"]
    elif not kept:
        texts = ["as it should be"]
    else:
        tuned = [column for column in (*kept, *off) if role_of(column[1]) in SECOND]
        shipped = [called(engine) for engine, profile in kept if word_of(profile) == "as shipped"]
        others = f"{shipped[0] if len(shipped) == 1 else f'{len(shipped)} engines'} as shipped" if shipped else ""
        tuning_fixes = bool(tuned) and not set(tuned) & set(off)
        texts = [text for text in ("every tuned profile" if tuning_fixes else "", others) if text] or ["everybody else"]
    return [(0.7, 0.86 - LINE * k, text) for k, text in enumerate(texts)]
