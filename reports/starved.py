"""Picture of what too few sweeps do to tall stacks: ``python -m reports.starved FOLDER`` (data: `hard_cases.starved`).

A tile per height and number of sweeps, coloured by what the top box has sunk within 4 s at 60 Hz, in its own height.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import altair as alt
import pandas as pd
import vl_convert

from reference_solver.hard_cases.starved import Starved, starved
from reports.palette import INK, PAPER
from reports.pictures import labelled

#: Sunk depths between which colours run [box heights]. Below, the slop of a tenth of a millimetre per contact counts.
RANGE = (1e-3, 0.2)
#: Pale to dark, read as little to much also in grey.
COLOURS = {"light": ("#eef3f8", "#8d2f1f"), "dark": ("#1d2733", "#ff9b7d")}
TILE = 62


def table(rows: Iterable[Starved]) -> pd.DataFrame:
    """Heights, sweeps, sunk depth within `RANGE`, and the words on each tile."""
    low, high = RANGE
    return pd.DataFrame(
        {
            "height": row.height,
            "sweeps": row.sweeps,
            "depth": min(max(row.sunk, low), high) if row.stands else high,
            "word": _word(row),
            "deep": row.sunk > 0.02 or not row.stands,
        }
        for row in rows
    )


def _word(row: Starved) -> str:
    if not row.stands:
        return "falls"
    return "stands" if row.sunk < RANGE[0] else f"{float(f'{100.0 * row.sunk:.1g}'):g} %"


def chart(rows: Iterable[Starved], scheme: str) -> dict[str, Any]:
    """Vega-Lite specification of the picture in one scheme, ``light`` or ``dark``."""
    data = table(rows)
    ink, paper = INK[scheme], PAPER[scheme]
    base = alt.Chart(data).encode(
        x=alt.X("sweeps:O", title="sweeps per step", axis=alt.Axis(labelAngle=0)),
        y=alt.Y("height:O", title="boxes in the stack", sort="descending"),
    )
    scale = alt.Scale(type="log", domain=list(RANGE), range=list(COLOURS[scheme]), interpolate="rgb")
    tiles = base.mark_rect(stroke=paper, strokeWidth=2).encode(color=alt.Color("depth:Q", scale=scale, legend=None))
    word = alt.condition("datum.deep", alt.value(paper), alt.value(ink))
    words = base.mark_text(fontSize=13).encode(text="word:N", color=word)
    whole = (tiles + words).properties(
        width=alt.Step(TILE), height=alt.Step(0.7 * TILE), title="How far the top box has sunk after 4 s at 60 Hz"
    )
    axis = {
        "labelColor": ink,
        "titleColor": ink,
        "domain": False,
        "ticks": False,
        "labelFontSize": 13,
        "titleFontSize": 13,
    }
    config = {"background": paper, "font": "system-ui, sans-serif", "view": {"stroke": None}, "axis": axis}
    return whole.to_dict() | {"config": config | {"title": {"color": ink, "fontSize": 15, "anchor": "start"}}}


def main(folder: str) -> None:
    """Write ``starved-light.png`` and ``starved-dark.png``."""
    target, rows = Path(folder), list(starved())
    target.mkdir(parents=True, exist_ok=True)
    for scheme in PAPER:
        picture = vl_convert.vegalite_to_png(chart(rows, scheme), scale=1.5)
        said = "classical profile at 60 Hz, unit boxes, mu = 0.5: python -m reports.starved"
        (target / f"starved-{scheme}.png").write_bytes(labelled(picture, said))


if __name__ == "__main__":
    main(*sys.argv[1:])
