"""A figure of the page, read back as SVG: its lines lie where axes and values say."""

import math
import re
from xml.etree import ElementTree

import numpy as np
import pandas as pd
import pytest

from reports.page import figures
from reports.page.scenes import _iteration_table, _iterations
from validation.cells import Observation, Outcome, Slot
from validation.posed import resolve
from validation.questions.convergence import declared_errors

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
    """Corners of a path of straight lines [px]; small letters are steps, one along an axis is told by one number."""
    place, found = np.zeros(2), []
    axes = {"M": np.eye(2), "l": np.eye(2), "h": np.eye(2)[:1], "v": np.eye(2)[1:]}
    for kind, text in re.findall(r"([Mlhv])([^MlhvZ]*)", path):
        place = place * kind.islower() + [float(x) for x in re.findall(r"-?[\d.]+", text)] @ axes[kind]
        found.append(place)
    return np.array(found)


def lines(tree):
    """Corners of what is drawn with a name and is no point, whose outline has arcs."""
    named = [node for node in tree.iter() if node.get("data-is") and "A" not in node.get("d", "A")]
    return {node.get("data-is"): corners(node.get("d")) + moved(node) for node in named}


def moved(node):
    """Where a part is moved to [px]."""
    found = re.fullmatch(r"translate\((.*),(.*)\)", node.get("transform", "translate(0,0)"))
    return np.array(found.groups(), float)


def test_axes_and_exact_engines_of_error_over_iterations():
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
    (gutter,) = [corners(n.get("d")) for n in tree.iter() if n.get("opacity") == "0.07"]
    top, bottom = gutter[:, 1].min(), gutter[:, 1].max()
    assert top < other[2, 1] < bottom
    assert one[0, 1] + decade * math.log10(0.5 / figures.EXACT) <= top + 0.5 * decade


def test_axis_labels_and_caption_of_error_over_iterations():
    figure, tree = drawn(table(), 1 / 60)
    said = [node.text for node in tree.iter() if node.tag.endswith("text")]
    assert said[:4] == [*map(str, COUNTS), "iterations per step"] and said[-1] == "drift [m]"
    assert {"exact", "0.1", "1"} <= set(said)
    assert figure.title == "stack 2-D: error against iterations" and figure.id == "fig-iterations-stack-2"
    assert figure.caption.startswith("dt = 1/60 s.") and tree.get("aria-label", figure.title) == figure.title


def test_no_figure_without_two_iteration_counts():
    assert figures.error_against_iterations(table().iloc[:0], "stack", 2, 1 / 240, "drift") is None
    alone = table({"chipmunk": (0.5,), "bullet": (0.1,)}, (4,))
    assert figures.error_against_iterations(alone, "stack", 2, 1 / 240, "drift") is None


def observed(who, iterations, off, dt=1 / 240):
    """Balls that rebound with a ratio that is off by so much, at an iteration count; None is the profile's own.

    In every cell that the scene's declared error is the worst of.
    """
    canonical = resolve("impact")
    for params in canonical.primary.variations(dt):
        e = canonical.complete(params)["e"]
        of = Slot("impact", tuple(sorted(params.items())), 2, *who, dt, iterations=iterations)
        yield Observation(of, "c", 1, "1", Outcome.OK, metrics={"rebound_ratio": (e + off, "")})


def test_lines_by_engine_and_profile_at_several_iterations():
    one, other = ("chipmunk", "default"), ("bullet", "tuned")
    asked = [*observed(one, 4, 0.1), *observed(one, 40, 0.01), *observed(other, 4, 0.2), *observed(other, 40, 0.2)]
    beside = [*observed(one, None, 0.4), *observed(one, 10, 0.3, 1 / 60)]  # nobody chose a count; another step
    found = _iteration_table(declared_errors([*asked, *beside]))
    assert sorted(found["error"]) == pytest.approx([0.01, 0.1, 0.2, 0.2])
    assert sorted(found[["engine", "profile", "iterations"]].itertuples(index=False, name=None)) == [
        ("bullet", "tuned", 4), ("bullet", "tuned", 40), ("chipmunk", "default", 4), ("chipmunk", "default", 40)
    ]  # fmt: skip
    assert "chipmunk/default, 4 iterations: error 0.1" in set(found["label"])
    figure = _iterations(found, "impact", 2)
    tree = ElementTree.fromstring(str(figure.picture))
    said = {node.get("data-is") for node in tree.iter()} - {None}
    assert said == {"chipmunk/default", "bullet/tuned", *found["label"]}  # lines, and points to hover over
    primary = resolve("impact").primary
    assert any(primary.name in (node.text or "") for node in tree.iter())
    assert _iterations(found, "impact", 3) is None and _iterations(found, "bounce", 2) is None


def test_times_drawn_with_the_interval_of_their_median():
    """A half and twice as long are as far from the mark as a factor of two is on the axis of times."""
    spread = {"chipmunk": 10.0**0.25, "bullet": 2.0}
    points = pd.DataFrame([
        {"scene": "impact", "dimension": 2, "engine": engine, "profile": "default", "dt": 1 / 240, "iterations": None,
         "cost": cost, "cost_low": cost / factor, "cost_high": cost * factor, "error": error, "best": True,
         "on_front": True}
        for engine, factor in spread.items() for cost, error in ((1e-3, 0.1), (1e-2, 0.01))
    ])  # fmt: skip
    tree = ElementTree.fromstring(str(figures.work_precision(points, "impact", 2).picture))
    points = [node for node in tree.iter() if node.get("data-is") and "A" in node.get("d", "")]
    marks = {(node.get("data-is").partition("/")[0], moved(node)[1]): moved(node)[0] for node in points}
    assert len(marks) == 4
    decade = max(marks.values()) - min(marks.values())
    bars = {(node.get("data-is").partition("/")[0], moved(node)[1]): moved(node)[0] + [0.0, float(node.get("x2"))]
            for node in tree.iter() if node.get("stroke-width") == "1.6"}  # fmt: skip
    assert set(bars) == set(marks)
    for (engine, height), (low, high) in bars.items():
        here = decade * math.log10(spread[engine])
        assert (low, high) == pytest.approx((marks[engine, height] - here, marks[engine, height] + here), abs=0.3)
