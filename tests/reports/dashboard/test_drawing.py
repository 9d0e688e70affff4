"""The picture of a panel, read back as SVG: what stands where must be what the points say."""

import math
import re
from collections import Counter
from itertools import groupby, pairwise
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from reports.dashboard.drawing import ERROR, MANY, STRIP, TIME, panel
from reports.dashboard.series import Panel, Point
from reports.dashboard.steps import Step

KEY = ("engine", "<b>", "impact", 2)
#: Half a unit of the last digit that is drawn [px].
DRAWN = 0.05


def point(i, error=None, fails=0, judged=1, lost=0, mended=0, ratio=None):
    return Point(f"r{i} & s", f"run {i}", f"id{i}", "1", error, fails, judged, lost, mended, ratio)


def drawn(points, error_steps=(), time_steps=()):
    """The picture as a tree, in which any markup that is not escaped would be an error."""
    made = Panel(KEY, "runs", tuple(points), "m", "law", tuple(error_steps), tuple(time_steps))
    return ElementTree.fromstring(panel(made))


def of_class(tree, name):
    return [node for node in tree.iter() if node.get("class") == name]


def number(node, name):
    return float(node.get(name))


def middle(rect):
    return number(rect, "x") + 0.5 * number(rect, "width")


def line_of(tree, name):
    """Corners of a line [px]."""
    (line,) = of_class(tree, name)
    return np.array([[float(x) for x in pair.split(",")] for pair in line.get("points").split()])


def dots_of(tree):
    """Places of all dots [px]."""
    drawn_dots = "".join(node.get("d") for node in of_class(tree, "dots"))
    return [(float(x), float(y)) for x, y in re.findall(r"M([\d.]+) ([\d.]+)h0", drawn_dots)]


def size(tree):
    return [float(x) for x in tree.get("viewBox").split()][2:]


def test_points_between_labels_of_the_picture():
    tree = drawn([point(i, error=10.0 ** -(i % 3)) for i in range(7)])
    places = [x for x, _ in dots_of(tree)]
    assert len(places) == 7 and np.diff(places) == pytest.approx(np.full(6, places[1] - places[0]), abs=2 * DRAWN)
    axis = {node.text: node for node in tree.iter("text")}
    left, right = axis["r0 & s"], axis["r6 & s"]
    assert (number(left, "x"), number(right, "x")) == pytest.approx((places[0], places[-1]), abs=DRAWN)
    assert left.get("text-anchor") is None and right.get("text-anchor") == "end"  # both run into the picture
    width, height = size(tree)
    assert 0.0 < places[0] < places[-1] < width
    below = max(y for _, y in dots_of(tree))
    assert below < number(left, "y") == number(right, "y") < height


def test_place_and_label_of_a_single_point():
    alone, two = drawn([point(0, error=1.0)]), drawn([point(0, error=1.0), point(1, error=1.0)])
    (place,) = [x for x, _ in dots_of(alone)]
    assert place == pytest.approx(np.mean([x for x, _ in dots_of(two)]), abs=DRAWN)
    said = [node.text for node in alone.iter("text")]
    assert said.count("r0 & s") == 1
    assert place == pytest.approx(middle(of_class(alone, "good")[0]), abs=2 * DRAWN)


@pytest.mark.parametrize("name, kind, room", [("line", "error", ERROR), ("line time", "ratio", TIME)])
def test_logarithmic_heights_from_least_to_largest(name, kind, room):
    values = [3e-2, 1e-1, 3.0, 1.0]
    other = {"ratio": 1.0} if kind == "error" else {"error": 1.0}
    tree = drawn([point(i, **{kind: v}, **other) for i, v in enumerate(values)])
    heights = line_of(tree, name)[:, 1]
    assert heights[0] == pytest.approx(room[1], abs=DRAWN) and heights[2] == pytest.approx(room[0], abs=DRAWN)
    decade = (room[1] - room[0]) / math.log10(values[2] / values[0])
    for k, value in enumerate(values):
        assert heights[k] == pytest.approx(room[1] - decade * math.log10(value / values[0]), abs=DRAWN)


def test_flat_line_for_noise_below_a_decade():
    heights = line_of(drawn([point(i, error=e) for i, e in enumerate([1.0, 1.1, 1.0])]), "line")[:, 1]
    assert max(heights) - min(heights) == pytest.approx((ERROR[1] - ERROR[0]) * math.log10(1.1), abs=2 * DRAWN)
    assert 0.5 * (max(heights) + min(heights)) == pytest.approx(sum(ERROR) / 2, abs=2 * DRAWN)


def labels(tree):
    """Texts left of the line, with their heights, and where they end."""
    return {node.text: (number(node, "y"), number(node, "x")) for node in tree.iter("text") if " & s" not in node.text}


def test_extremes_beside_their_heights_and_equal_ones_once():
    tree = drawn([point(i, error=e) for i, e in enumerate([0.25, 2.5, 0.5])])
    said = labels(tree)
    assert list(said) == ["2.5", "0.25"]
    first = min(x for x, _ in dots_of(tree))
    high, low = said["2.5"], said["0.25"]
    # A text's baseline: of the largest below its height so that it is not cut, of the least at it.
    assert ERROR[0] < high[0] < ERROR[0] + 8.0 and low[0] == ERROR[1]
    assert high[1] == low[1] < first
    same = labels(drawn([point(i, error=0.25) for i in range(3)]))
    assert list(same) == ["0.25"] and same["0.25"][0] == pytest.approx(sum(ERROR) / 2 + 3, abs=DRAWN)


def test_round_off_error_called_exact_and_a_time_never():
    tree = drawn([point(0, error=1e-17, ratio=1e-17), point(1, error=0.0, ratio=2e-17)])
    said = [node.text for node in tree.iter("text")]
    assert said.count("exact") == 1 and "1.0e-17" in said and "2.0e-17" in said
    assert len({y for _, y in dots_of(tree)[:2]}) == 1  # both are the same answer


def test_signs_of_errors_ignored():
    assert line_of(drawn([point(0, error=-0.2), point(1, error=0.4)]), "line").tolist() == pytest.approx(
        line_of(drawn([point(0, error=0.2), point(1, error=-0.4)]), "line")
    )


def test_gaps_without_error_or_time():
    tree = drawn([point(0, error=1.0), point(1), point(2, error=4.0)])
    assert len(dots_of(tree)) == 2 and len(line_of(tree, "line")) == 2
    assert of_class(tree, "line time") == []
    untimed, timed = size(tree)[1], size(drawn([point(0, error=1.0, ratio=2.0)]))[1]
    assert untimed < TIME[0] + 16 and timed > TIME[1]  # no room is kept for times that are not there
    assert of_class(drawn([point(0), point(1)]), "line") == []


def test_corners_left_out_only_where_nothing_changes():
    errors = [1.0] * 5 + [2.0] * 5 + [1.0]
    tree = drawn([point(i, error=e) for i, e in enumerate(errors)])
    corners = line_of(tree, "line")
    places = [x for x, _ in dots_of(tree)]
    assert corners[:, 0] == pytest.approx([places[i] for i in (0, 4, 5, 9, 10)], abs=DRAWN)
    dots = dots_of(tree)
    assert len(dots) == 11
    for x, y in dots:  # whoever reads the line sees every point on it
        assert np.interp(x, *corners.T) == pytest.approx(y, abs=4 * DRAWN)


@pytest.mark.parametrize("factor, says", [(2.0, "step worse"), (0.5, "step better")])
@pytest.mark.parametrize("timed", [False, True])
def test_step_mark_half_way_between_two_points(timed, factor, says):
    steps = [(3, Step(3, 1.0, factor))]
    points = [point(i, error=1.0, ratio=1.0) for i in range(8)]
    tree = drawn(points, **{"time_steps" if timed else "error_steps": steps})
    (mark,) = of_class(tree, says)
    places = sorted({x for x, _ in dots_of(tree)})
    assert number(mark, "x1") == number(mark, "x2") == pytest.approx((places[2] + places[3]) / 2, abs=3 * DRAWN)
    room, other = (TIME, ERROR) if timed else (ERROR, TIME)
    assert number(mark, "y1") < room[0] < room[1] < number(mark, "y2")
    assert number(mark, "y2") < other[0] or number(mark, "y1") > other[1]


@pytest.mark.parametrize("count", [1, 2, 40, MANY])
def test_cells_of_judged_runs(count):
    points = [point(i, error=1.0, fails=i % 4 // 2, judged=2 * (i % 5 != 4)) for i in range(count)]
    tree = drawn(points)
    places = [x for x, _ in dots_of(tree)]
    for name, wanted in (
        ("good", [i for i, p in enumerate(points) if p.judged and not p.fails]),
        ("bad", [i for i, p in enumerate(points) if p.judged and p.fails]),
    ):
        cells = of_class(tree, name)
        assert [middle(cell) for cell in cells] == pytest.approx([places[i] for i in wanted], abs=3 * DRAWN)
        assert all(number(cell, "y") == STRIP[0] and number(cell, "height") == STRIP[1] - STRIP[0] for cell in cells)
    cells = sorted((number(c, "x"), number(c, "width")) for n in ("good", "bad") for c in of_class(tree, n))
    assert all(x + wide <= other + 3 * DRAWN for (x, wide), (other, _) in pairwise(cells))


@given(st.lists(st.sampled_from(["good", "bad", ""]), min_size=MANY + 1, max_size=2 * MANY))
def test_runs_of_equal_state_as_one_cell(states):
    kinds = {"good": (0, 1), "bad": (1, 1), "": (0, 0)}
    tree = drawn([point(i, 1.0, *kinds[state]) for i, state in enumerate(states)])
    assert dots_of(tree) == []
    groups = [(state, [i for i, _ in own]) for state, own in groupby(enumerate(states), key=lambda pair: pair[1])]
    found = [r for r in tree.iter("rect")]
    wanted = [(state, own[0], own[-1]) for state, own in groups if state]
    assert Counter(r.get("class") for r in found) == Counter(state for state, *_ in wanted)
    left, right = line_of(tree, "line")[[0, -1], 0]
    each = (right - left) / (len(states) - 1)
    for cell, (state, first, last) in zip(found, wanted, strict=True):
        assert cell.get("class") == state
        assert middle(cell) == pytest.approx(left + each * (first + last) / 2, abs=3 * DRAWN)
        # One place wide for each run, or a little less: no two cells overlap.
        assert each * (last - first) < number(cell, "width") + DRAWN < each * (last - first + 1) + 5 * DRAWN


def test_mark_of_a_flip_lost_or_mended():
    points = [point(i, error=1.0, lost=i == 1, mended=i in (1, 3)) for i in range(5)]
    tree = drawn(points)
    places = [x for x, _ in dots_of(tree)]
    (lost,), (mended,) = of_class(tree, "lost"), of_class(tree, "mended")  # both at once: what is lost matters
    for mark, at, tip in ((lost, 1, 6.0), (mended, 3, 0.0)):
        start, rest = mark.get("d")[1:].split("h")
        x, y = map(float, start.split())
        across, (dx, dy) = float(rest.split("l")[0]), map(float, rest.split("l")[1].removesuffix("z").split())
        assert x + across / 2 == pytest.approx(places[at], abs=2 * DRAWN)
        assert (x + across + dx, y + dy) == pytest.approx((places[at], tip), abs=2 * DRAWN)


def test_text_alternative_of_a_picture():
    points = [point(i, error=1.0, lost=i == 2) for i in range(6)]
    tree = drawn(points, [(3, Step(3, 1.0, 2.0))], [(4, Step(4, 1.0, 2.0)), (5, Step(5, 1.0, 2.0))])
    assert tree.get("role") == "img"
    assert tree.get("aria-label") == "engine <b> impact 2-D, 6 points: 1 steps of the error, 2 of the time, 1 flips"
