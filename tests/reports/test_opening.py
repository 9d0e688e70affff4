"""The first screen: its headline follows the rows, and its picture shows who leaves the diagonal, read back as SVG."""

import re
from itertools import pairwise, product

import numpy as np
import pytest

from adapters import registry
from reports.page import Source
from reports.page.explorer import explorer
from reports.page.opening import called, halves, headline, rebounds
from validation.records.store import Run

ASKED = (0.0, 0.2, 0.5, 0.8, 1.0)


def row(engine, profile, asked, got, speed=6.0, scene="impact", metric="rebound_ratio"):
    passed = abs(got - asked) < 1e-3
    return {
        "engine": engine, "profile": profile, "scene": scene, "dimension": 2, "dt": 1 / 240, "iterations": None,
        "metric": metric, "value": got, "truth": asked, "error": got - asked, "tolerance": 1e-3, "unit": "1",
        "params": {"e": asked, "v": speed}, "physics": "pass" if passed else "fail",
        "standing": None if passed else "known", "outcome": "ok", "reason": "", "engine_version": "1",
        "slot": {"params": {"e": asked, "v": speed}}, "because": "so", "source": "law",
    }  # fmt: skip


def made(laws, speeds=(6.0,), **more):
    """A run of engines and profiles that rebound by the given laws of the restitution that was set."""
    rows = [row(*column, e, law(e), v, **more) for (column, law), v, e in product(laws.items(), speeds, ASKED)]
    return Source(Run("r", "2026-01-01", "c", {}, "t", (), True), rows, [])


def right(e):
    return e


def dead(e):
    return 0.1


@pytest.mark.parametrize(
    ("laws", "said"),
    [
        ({("a", "default"): dead, ("a", "tuned"): right},
         "As shipped, a does not rebound as set; tuned, it does (scene impact)"),
        ({("a", "default"): dead, ("a", "tuned"): right, ("b", "default"): dead, ("b", "tuned"): right,
          ("c", "default"): right, ("c", "tuned"): right},
         "As shipped, a and b do not rebound as set; tuned, both do (scene impact)"),
        ({("a", "default"): dead, ("a", "tuned"): right, ("b", "default"): dead, ("b", "tuned"): dead},
         "As shipped, a and b do not rebound as set; tuned, a does (scene impact)"),
        ({("a", "default"): dead, ("a", "tuned"): dead, ("b", "default"): dead, ("b", "tuned"): dead},
         "a and b do not rebound as set, neither as shipped nor tuned (scene impact)"),
        ({("a", "default"): dead, ("b", "default"): right}, "As shipped, a does not rebound as set (scene impact)"),
        ({("a", "default"): right, ("b", "default"): right}, "As shipped, every engine passes every check"),
        ({("a", "default"): right, ("a", "tuned"): right}, "As shipped, a passes every check"),
        ({("a", "of mine"): dead}, "a (of mine) fails 100 % of its checks"),
        ({("a", "default"): lambda e: e + 0.01 * (e > 0.5), ("a", "tuned"): right, ("b", "default"): right},
         "As shipped, a fails 40 % of its checks, the most of all engines; tuned, none"),
    ],
)  # fmt: skip
def test_headline_from_the_rows(laws, said):
    assert headline(made(laws)) == said


def test_headline_without_restitution():
    laws = {("a", "default"): dead, ("a", "tuned"): lambda e: e + 0.1 * (e == 1.0), ("b", "default"): right}
    source = made(laws, scene="incline", metric="speed")
    assert not rebounds(source)
    assert headline(source) == "As shipped, a fails 100 % of its checks, the most of all engines; tuned, 20 %"
    assert headline(Source(source.run, [], [])) == "No check has a result."


def test_first_matrix_with_shipped_beside_tuned():
    laws = dict.fromkeys([("a", "one"), ("a", "tuned"), ("a", "default"), ("b", "mine"), ("b", "x"), ("b", "y")], right)
    found = {engine: [(half.profile, half.word, half.place) for half in own] for engine, own in halves(made(laws))}
    assert found == {
        "a": [("default", "as shipped", 2), ("tuned", "tuned", 1)],
        "b": [("mine", "mine", 3), ("x", "x", 4)],
    }


def test_names_of_engines():
    names = {name: called(name) for name in registry.names()}
    assert len(set(names.values())) == len(names) and max(map(len, names.values())) < 12
    assert called("of somebody") == "of somebody"


def drawn(figure):
    """Words and marks of a picture: text with its colour and place, and what its points say."""
    words = re.findall(
        r'<text[^>]*translate\(([-\d.]+),([-\d.]+)\)[^>]*fill="([^"]+)"[^>]*>([^<]*)</text>', figure.picture
    )
    points = re.findall(r'data-is="([^"]*set [^"]*)"[^>]*?transform="translate\(([-\d.]+),([-\d.]+)\)', figure.picture)
    return words, points


def test_names_of_lines_off_the_diagonal_in_the_picture():
    laws = {("mujoco", "default"): dead, ("mujoco", "tuned"): right, ("bullet", "default"): lambda e: 0.5 * e,
            ("bullet", "tuned"): right, ("chipmunk", "default"): right, ("chipmunk", "tuned"): right}  # fmt: skip
    (figure,) = explorer(made(laws)).maps
    words, points = drawn(figure)
    told = {text: (float(x), float(y), colour) for x, y, colour, text in words if not re.match(r"[\d.]+$", text)}
    named = {"MuJoCo as shipped", "Bullet as shipped", "every tuned profile", "Chipmunk as shipped"}
    assert named <= set(told) and not any("tuned" in text for text in set(told) - named)
    colours = {engine: told[f"{called(engine)} as shipped"][2] for engine in ("mujoco", "bullet", "chipmunk")}
    assert colours["mujoco"] != colours["bullet"] and colours["chipmunk"] == "currentColor"
    assert told["Bullet as shipped"][1] < told["MuJoCo as shipped"][1], "the higher line has the higher name"
    # Every value that was measured is a point, and stands at its own value: none is moved aside.
    at = {text: (float(x), float(y)) for text, x, y in points}
    assert len(points) == len(laws) * len(ASKED)
    for e in ASKED:
        assert len({x for text, (x, _) in at.items() if f"set {e:g}," in text}) == 1
    assert at["bullet/default: set 1, measured 0.5"][1] == pytest.approx(at["chipmunk/tuned: set 0.5, measured 0.5"][1])


def test_picture_at_the_speed_where_most_engines_deviate():
    def at(speed, law):
        return [row(engine, "default", e, law(engine, e), speed) for engine in ("bullet", "mujoco") for e in ASKED]

    rows = [
        *at(1.0, lambda engine, e: 0.0), *at(6.0, lambda engine, e: e if engine == "bullet" else 0.0),
        *at(50.0, lambda engine, e: e),
    ]  # fmt: skip
    found = explorer(Source(Run("r", "2026-01-01", "c", {}, "t", (), True), rows, [])).maps
    assert [figure.id for figure in found] == ["fig-map-1", "fig-map-6", "fig-map-50"]
    assert "everybody else" not in found[0].picture and "as it should be" in found[0].picture
    assert "1 engines" not in found[1].picture and "Bullet as shipped" in found[1].picture
    assert "every engine" in found[2].picture


def test_label_that_another_line_would_cross():
    """ "MuJoCo as shipped", above its own level line, was crossed by Bullet's at 6 m/s."""
    laws = {("mujoco", "default"): lambda e: 0.105, ("bullet", "default"): lambda e: max(0.0, 0.58 * (e - 0.5))}
    (figure,) = explorer(made(laws)).maps
    words, points = drawn(figure)
    ((right, level),) = [(float(x), float(y)) for x, y, _, text in words if text == "MuJoCo as shipped"]
    line = sorted((float(x), float(y)) for text, x, y in points if text.startswith("bullet/default"))
    along = np.linspace(right - 7.5 * len("MuJoCo as shipped"), right, 50)
    assert np.abs(np.interp(along, *zip(*line, strict=True)) - level).min() > 8.0, "a line of text is 13 px high"
    own = {float(y) for text, x, y in points if text.startswith("mujoco/default")}
    assert len(own) == 1 and 8.0 < abs(own.pop() - level) < 25.0, "it stands beside its own line"


def test_reports_of_all_suites_begin_with_the_same_speed():
    """The standard suite began with 50 m/s, the quick one with 6."""
    rows = [row("mujoco", "default", e, 0.0, speed) for speed in (0.1, 1.0, 6.0, 50.0) for e in ASKED]
    found = explorer(Source(Run("r", "2026-01-01", "c", {}, "t", (), True), rows, [])).maps
    assert found[0].id == "fig-map-6"


def test_labels_of_lines_with_a_common_end_stacked():
    laws = {(engine, "default"): dead for engine in ("bullet", "mujoco", "drake", "dart", "rapier")}
    (figure,) = explorer(made(laws)).maps
    heights = sorted(float(y) for _, y, _, text in drawn(figure)[0] if text.endswith("as shipped"))
    assert len(heights) == 5
    assert min(b - a for a, b in pairwise(heights)) > 12.0, "a line of text is 13 px high"
