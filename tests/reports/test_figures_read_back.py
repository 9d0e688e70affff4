"""A figure of the page, read back as SVG: its lines lie where axes and values say."""

import math
import re
from xml.etree import ElementTree

import numpy as np
import pandas as pd
import pytest

from reports.page import figures

COUNTS = (4, 20, 100)
ERRORS = {"chipmunk": (0.5, 0.05, 0.005), "bullet": (0.5, 0.5, 1e-12)}


def table(errors=ERRORS, counts=COUNTS):
    return pd.DataFrame([
        {"engine": engine, "profile": "default", "iterations": n, "error": error, "label": f"{engine} default"}
        for engine, own in errors.items() for n, error in zip(counts, own, strict=True)
    ])  # fmt: skip


def drawn(of, dt=1 / 240):
    figure = figures.error_against_iterations(of, "stack", 2, dt, "drift [m]")
    return figure, ElementTree.fromstring(str(figure.picture))


def corners(path):
    """Corners of a path whose moves are told in any of SVG's short forms [px]."""
    place, found = np.zeros(2), []
    for kind, text in re.findall(r"([MLmlHhVv])([^MLmlHhVv]*)", path):
        values = [float(x) for x in re.findall(r"-?\d*\.?\d+(?:e-?\d+)?", text)]
        step = 1 if kind in "HhVv" else 2
        for k in range(0, len(values), step):
            own = values[k : k + step]
            if kind in "Hh":
                own = [own[0], 0.0 if kind == "h" else place[1]]
            elif kind in "Vv":
                own = [0.0 if kind == "v" else place[0], own[0]]
            place = np.array(own) if kind in "MLHV" else place + own
            found.append(place)
    return np.array(found)


def lines(tree):
    return {
        node.get("data-is"): corners(node.get("d")) for node in tree.iter() if node.get("data-is") and node.get("d")
    }


def test_errors_over_iterations_lie_on_logarithmic_axes_and_what_is_exact_lies_in_the_gutter():
    _, tree = drawn(table())
    found = lines(tree)
    assert set(found) == {"chipmunk/default", "bullet/default"}
    one, other = found["chipmunk/default"], found["bullet/default"]
    # Counts in equal ratios are equally far apart; lines that would hide each other stand a little beside their place.
    assert (one[:, 0] + other[:, 0]) / 2.0 == pytest.approx(np.linspace(*(one + other)[[0, 2], 0] / 2.0, 3), abs=0.3)
    assert 0.0 < abs(one[0, 0] - other[0, 0]) < 10.0
    decade = one[1, 1] - one[0, 1]
    assert decade > 20.0 and one[2, 1] - one[1, 1] == pytest.approx(decade, abs=0.2)  # down is less
    assert other[0, 1] == other[1, 1] == one[0, 1]
    (gutter,) = [corners(n.get("d")) for n in tree.iter() if n.get("fill-opacity") == "0.07"]
    top, bottom = gutter[:, 1].min(), gutter[:, 1].max()
    assert top < other[2, 1] < bottom
    assert one[0, 1] + decade * math.log10(0.5 / figures.EXACT) <= top + 0.5 * decade


def test_the_axes_say_the_counts_that_were_run_and_the_quantity_and_the_caption_says_the_step():
    figure, tree = drawn(table(), 1 / 60)
    said = [node.text for node in tree.iter() if node.tag.endswith("text")]
    assert said[:4] == [*map(str, COUNTS), "iterations per step"] and said[-1] == "drift [m]"
    assert {"exact", "0.1", "1"} <= set(said)
    assert figure.title == "stack 2-D: error against iterations" and figure.id == "fig-iterations-stack-2"
    assert figure.caption.startswith("dt = 1/60 s.") and tree.get("aria-label", figure.title) == figure.title


def test_without_two_counts_there_is_nothing_to_draw():
    assert figures.error_against_iterations(table().iloc[:0], "stack", 2, 1 / 240, "drift") is None
    alone = table({"chipmunk": (0.5,), "bullet": (0.1,)}, (4,))
    assert figures.error_against_iterations(alone, "stack", 2, 1 / 240, "drift") is None
