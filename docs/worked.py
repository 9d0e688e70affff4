"""The worked example of the documentation: one ball, from the formula to the verdict, with numbers and a figure."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import altair as alt
import pandas as pd
import vl_convert

import contact_crosscheck as cc
from adapters import registry
from reports.wording import number
from validation import bounds
from validation.canonical import GRAVITY
from validation.catalogue import CATALOGUE
from validation.running.plan import QUICK_DT
from validation.scenes.bounce import RADIUS

E, DT, G = 0.8, QUICK_DT, GRAVITY
HEIGHT = CATALOGUE["bounce"].complete({})["height"]
#: Engine of the example: the first that is installed.
ENGINES = ("mujoco", "bullet", "chipmunk", "reference")


@cache
def results() -> dict[str, cc.Result]:
    """The case as shipped and tuned."""
    engine = next(name for name in ENGINES if registry.find(name).engine is not None)
    profiles = list(registry.find(engine).engine.profiles)[:2]
    return {
        f"{engine}/{profile}": cc.run("bounce", engine=engine, profile=profile, dimension=2, e=E)
        for profile in profiles
    }


def example() -> dict[str, Any]:
    """Numbers of the page."""
    speed = math.sqrt(2.0 * G * HEIGHT)
    tolerance, apex = bounds.rebound_late(E, speed, DT) + G * DT * DT / 8.0, E * E * HEIGHT
    rows = []
    for name, result in results().items():
        checks = result.frame().set_index("metric")
        found = checks.loc["apex[1]"]
        rows.append({
            "who": name, "value": found.value, "error": found.error, "verdict": found.physics.upper(),
            "times": number(abs(found.error) / found.tolerance, 2),
        })  # fmt: skip
    said = {"e": E, "height": HEIGHT, "speed": speed, "after": E * speed, "apex": apex}
    return {
        **{name: number(value, 3) for name, value in said.items()},
        "rows": rows,
        "late": number(speed * DT, 3),
        "tolerance": number(tolerance),
    }


def truth() -> pd.DataFrame:
    """Height of the ball's centre over time by the law."""
    speed = math.sqrt(2.0 * G * HEIGHT)
    start = speed / G
    rows = [(start * k / 40, RADIUS + HEIGHT - 0.5 * G * (start * k / 40) ** 2) for k in range(41)]
    for _ in range(6):
        speed *= E
        flight = 2.0 * speed / G
        times = [flight * k / 40 for k in range(41)]
        rows += [(start + t, RADIUS + speed * t - 0.5 * G * t * t) for t in times]
        start += flight
    return pd.DataFrame(rows, columns=["t", "height"]).assign(who="truth")


def pictures() -> dict[str, str]:
    """The figure by the name of its file."""
    parts = [truth()]
    end = parts[0]["t"].max()
    for name, result in results().items():
        motion = result.trajectory
        parts.append(pd.DataFrame({"t": motion.t, "height": motion.pose[:, 1, 1], "who": name}))
    table = pd.concat(parts)
    names = list(dict.fromkeys(table["who"]))
    colours = alt.Scale(domain=names, range=["#8a8a8a", "#d4504e", "#3b75af"][: len(names)])
    shown = table[table["t"] <= end]
    layers = [
        alt.Chart(shown[shown["who"] == name]).mark_line(strokeWidth=6.0 if name == "truth" else 1.6) for name in names
    ]
    colour = alt.Color("who:N", title=None, sort=names, scale=colours, legend=alt.Legend(orient="top"))
    x = alt.X("t:Q", title="time [s]")
    y = alt.Y("height:Q", title="height of the centre [m]", scale=alt.Scale(zero=False))
    chart = alt.layer(*(lines.encode(x=x, y=y, color=colour) for lines in layers)).properties(width=560, height=260)
    return {"worked-example.svg": vl_convert.vegalite_to_svg(chart.to_dict())}
