"""Picture of tall stacks with too few sweeps: ``python -m reports.starved FOLDER``.

A tile per height and number of sweeps, coloured by the sinking of the top box within 4 s at 60 Hz, in box heights.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import altair as alt
import numpy as np
import pandas as pd
import vl_convert

from reference_solver.model import Body, Box, HalfSpace, Model
from reference_solver.settings import Settings
from reference_solver.simulation import Simulation
from reports.palette import INK, PAPER
from reports.pictures import labelled

#: Range of sunk depths for the colours [box heights]. Below, the slop of a tenth of a millimetre per contact counts.
RANGE = (1e-3, 0.2)
#: Pale to dark, also readable in grey.
COLOURS = {"light": ("#eef3f8", "#8d2f1f"), "dark": ("#1d2733", "#ff9b7d")}
TILE = 62
#: Boxes in the stack, and sweeps per step.
HEIGHTS = (1, 2, 5, 10, 20, 40)
SWEEPS = (1, 2, 4, 10, 20, 50, 100)
#: Standard gravity [m/s^2].
GRAVITY = 9.81


@dataclass(frozen=True)
class Starved:
    """A stack of unit boxes after some time at a number of sweeps per step.

    Parameters
    ----------
    height, sweeps
        Boxes, and sweeps per step.
    sunk
        Sinking of the top box [box heights].
    leaning
        Largest angle of a box [rad].
    load
        Largest error of an interface's impulse in the last step, of its exact value.
    stands
        Whether every box is still within half its width of its place.
    """

    height: int
    sweeps: int
    sunk: float
    leaning: float
    load: float
    stands: bool


def starved_stack(height: int, sweeps: int, dt: float = 1.0 / 60.0, duration: float = 4.0) -> Starved:
    """Simulate exactly placed boxes for ``duration`` [s] with `Settings.classical` and ``sweeps`` sweeps per step."""
    floor = Body(HalfSpace((0.0, 1.0)), motion="fixed")
    boxes = [Body(Box((0.5, 0.5)), 1.0, 1.0 / 6.0, (0.0, 0.5 + i, 0.0)) for i in range(height)]
    simulation = Simulation(
        Model(2, [floor, *boxes], (0.0, -GRAVITY), 0.0, 0.5), Settings.classical(dt, iterations=sweeps)
    )
    simulation.advance(round(duration / dt))
    pose, contacts = simulation.pose[1:], simulation.contacts()
    away = np.abs(pose[:, :2] - [(0.0, 0.5 + i) for i in range(height)]).max()
    loads = np.zeros(height)
    for a, b, impulse in zip(contacts.body_a, contacts.body_b, contacts.impulse, strict=True):
        if b == a + 1:
            loads[a] += impulse[1]
    error = float(np.abs(loads / (GRAVITY * dt * (height - np.arange(height))) - 1.0).max())
    sunk = height - 0.5 - float(pose[-1, 1])
    return Starved(height, sweeps, sunk, float(np.abs(pose[:, 2]).max()), error, bool(away < 0.5))


def starved() -> Iterator[Starved]:
    """Yield one row per height and number of sweeps."""
    for height in HEIGHTS:
        for sweeps in SWEEPS:
            yield starved_stack(height, sweeps)


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
    drawn: dict[str, Any] = whole.to_dict()
    return drawn | {"config": config | {"title": {"color": ink, "fontSize": 15, "anchor": "start"}}}


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
