"""Tables and marks of the page, from rows made up for one thing each."""

import re
from collections import Counter
from types import SimpleNamespace

import pandas as pd
import pytest

from reports import fixes as told_fixes
from reports.matrix import Field
from reports.page import cost, fairness
from reports.page.charts import log_scale
from reports.page.conclusions import NAMED, scenes_text
from reports.page.source import Bench
from reports.page.styling import heat_style
from reports.page.verdicts import family_mark
from reports.palette import PAPER, heat
from reports.spread import spread_lines
from reports.wording import MARKS
from validation.cells import Slot
from validation.questions.spread import Spread

SLOT = Slot("impact", (), 2, "chipmunk", "tuned", 1 / 240)


def told(engine, **changed):
    """A row of the table of times at equal error."""
    plain = {
        "engine": engine, "profile": "tuned", "scene": "impact", "dimension": 2, "level": 1e-3, "cost": 2e-3,
        "reason": "", "times_cheapest": 1.0, "tied": True, "rank": 1, "dt": 1 / 240, "iterations": None,
        "slot": SLOT.as_dict(),
    }  # fmt: skip
    return plain | changed


def test_cheapest_cell_with_cost_and_ties():
    cell = cost._cheapest_cell([told("chipmunk"), told("bullet"), told("mujoco", profile="default")])
    assert (cell.text, cell.best, cell.ties) == ("chipmunk/tuned", True, ("bullet/tuned", "mujoco/default"))
    assert cell.detail == "2 ms, dt 1/240" and "crosscheck run impact" in cell.title
    assert cost._cheapest_cell([]) == cost.LevelCell("none reaches it", "", False, "")


def test_legend_of_cost_charts_in_page_order():
    """A profile without a rank is run for its verdicts, and its name above charts without it would be a riddle."""
    columns = [("bullet", "one"), ("mujoco", "matched"), ("mujoco", "tuned"), ("chipmunk", "tuned")]
    points = pd.DataFrame([{"engine": "mujoco", "profile": "tuned"}, {"engine": "bullet", "profile": "one"}])
    sizes = pd.DataFrame([{"engine": "chipmunk", "profile": "tuned"}])
    source = SimpleNamespace(columns=columns)
    assert cost._timed(source, {"work_points": points, "scaling": sizes}) == [columns[0], columns[2], columns[3]]
    assert cost._timed(source, {"work_points": points, "scaling": pd.DataFrame()}) == [columns[0], columns[2]]


def test_table_of_iteration_levels_with_unsupported_engines():
    assert cost._level_tables(pd.DataFrame(columns=list(told("a"))), "cost", 0.0) == []
    rows = [
        told("chipmunk"), told("chipmunk", level=1e-6, cost=8e-3),
        told("bullet", cost=6e-3, times_cheapest=3.0, tied=False, rank=2),
        told("bullet", level=1e-6, cost=float("nan"), reason="no step reaches it"),
        told("box2d", cost=float("nan"), reason="unsupported: no such shape"),
    ]  # fmt: skip
    (table,) = cost._level_tables(pd.DataFrame(rows), "cost", 0.0)
    assert (table.anchor, table.scene, table.dimension) == ("level-cost-impact-2", "impact", 2)
    assert table.refused == "box2d/tuned"
    assert [(engine, profile) for engine, profile, _ in table.rows] == [("chipmunk", "tuned"), ("bullet", "tuned")]
    (first, _), (second, missing) = (cells for _, _, cells in table.rows)
    assert first.best and (first.text, first.detail) == ("2 ms", "dt 1/240")
    assert not second.best and second.text == "6 ms" and second.detail.endswith(", ×3")
    assert (missing.text, missing.title, missing.best) == ("–", "no step reaches it", False)
    assert len(table.levels) == 2
    (coarse,) = cost._level_tables(pd.DataFrame(rows), "cost", 1e-4)
    assert len(coarse.levels) == 1


def test_failure_count_in_the_mark_of_a_family():
    passing, failing = MARKS[-1], "known"
    assert passing == "pass" and failing in MARKS
    mixed = family_mark(Field(Counter({failing: 2, passing: 3})), "there")
    assert (mixed.mark, mixed.text, mixed.href) == (failing, "2/5", "#there")
    assert "2 " in mixed.title and "3 " in mixed.title and ", " in mixed.title
    alone = family_mark(Field(Counter({passing: 3})), "there")
    assert (alone.mark, alone.text, alone.href, alone.title) == (passing, "3", "#there", "")
    assert family_mark(None, "there").mark == "unsupported" and family_mark(None, "there").href == ""


@pytest.mark.parametrize("values", [[1e-3, 10.0], [2.0, 3.0], [5.0]])
def test_ends_and_ticks_of_a_logarithmic_scale(values):
    scale, ticks = log_scale([*values, 0.0, float("inf")])
    low, high = scale.to_dict()["domain"]
    assert low < min(values) <= max(values) < high and high / low >= 10.0
    assert min(values) / low == pytest.approx(high / max(values)), "as much room below as above"
    assert ticks and all(low <= tick <= high for tick in ticks)


def test_scenes_named_up_to_the_length_of_a_sentence():
    few, many = [f"s{k}" for k in range(NAMED)], [f"s{k}" for k in range(NAMED + 1)]
    assert all(name in scenes_text(few, 51) for name in few) and "of 51" not in scenes_text(few, 51)
    assert scenes_text(many, 51) == f"{NAMED + 1} of 51 scenes"


def test_farthest_value_of_a_scene_first():
    found = [
        Spread("a", 2, "near", "p", 2.0, "ball", 1e-6, True),
        Spread("a", 2, "far", "p", 2.0, "box", 0.5, True),
        Spread("a", 3, "other", "p", 1.5, "ball", 0.25, False),
    ]
    lines = list(spread_lines(found))
    assert lines[1] == "How far from our own solution: a 2-D, after 2 s"
    assert lines[2].split()[0] == "far/p" and "(box)" in lines[2] and lines[3].split()[0] == "near/p"
    assert lines[5] == "How far from our own solution: a 3-D, after 1.5 s; that run is not certified"
    assert len({line.index("  (") for line in lines[2:4]}) == 1, "numbers stand below each other"


def slip(measured, holds=True, **changed):
    return {
        "quantity": "friction", "asked": 0.5, "declared": 0.5, "band": 0.01, "measured": measured, "holds": holds,
        "because": "a slide",
    } | changed  # fmt: skip


def test_receipt_farthest_from_its_declared_value():
    runs = [SimpleNamespace(receipts=(slip(0.5004567),)), SimpleNamespace(receipts=(slip(0.493456789),))]
    (line,) = fairness._receipts(runs)
    assert (line.quantity, line.asked, line.measured, line.holds) == ("friction", "0.5", "0.493457", "2/2")
    assert line.declared == "0.5 ± 0.01" and not line.differs and line.because == "a slide"
    broken = SimpleNamespace(receipts=(slip(0.5009, False, declared=0.4, band=10.0),))
    (line,) = fairness._receipts([*runs, broken])
    assert (line.holds, line.differs, line.measured) == ("2/3", True, "0.5009")
    (unmeasured,) = fairness._receipts([SimpleNamespace(receipts=(slip(None),))])
    assert (unmeasured.measured, unmeasured.holds, unmeasured.differs) == ("not measured", "1/1", False)


@pytest.mark.usefixtures("bullet")
def test_count_of_a_listed_reason(page_source):
    findings = fairness.findings_of("bullet")
    listed = {entry.id: entry.count for entry in fairness._listed(page_source, "bullet")}
    rows = [row for row in page_source.of(engine="bullet") if row["standing"] == "known"]
    assert listed.keys() == {*findings.families, *(entry.id for entry in findings.unsupported)}
    for name, family in findings.families.items():
        assert listed[name] == sum(family.reason in row["reason"] for row in rows), name
    assert len(rows) < sum(len(rows) - listed[name] for name in findings.families), "most reasons are of other rows"


@pytest.mark.usefixtures("bullet")
def test_changed_setting_with_its_other_one(page_source, monkeypatch):
    """Where it was measured what decides, a setting that only completes another says so."""
    kept = page_source.observations
    monkeypatch.setattr(told_fixes, "belongs_of", lambda engine: {"useMaximalCoordinates": f"the solver of {engine}"})
    monkeypatch.setattr(told_fixes, "decisive", lambda *asked: SimpleNamespace(parts=()))
    found = {change.name: change for change in told_fixes.changes(kept, "impact", 2, "bullet", "default", "tuned")}
    assert "part of the solver of bullet" in vars(found["useMaximalCoordinates"]).values()


@pytest.mark.parametrize(("standing", "covered"), [("known", True), ("known", False), ("new", True), (None, False)])
def test_row_counted_for_the_entry_that_covers_it(standing, covered):
    slot = Slot("impact", (), 2, "chipmunk", "tuned", 1 / 240)
    entry = SimpleNamespace(covers=lambda asked: covered and asked == slot)
    assert fairness._is_about({"standing": standing, "slot": slot.as_dict()}, entry) is (
        standing == "known" and covered
    )


@pytest.mark.parametrize(("missed", "judged", "length"), [(0, 8, 0), (1, 289, 1), (1, 20, 1), (26, 283, 2), (8, 8, 20)])
def test_shade_of_a_matrix_field_by_failing_share(missed, judged, length):
    found = family_mark(Field(Counter({"known": missed, "pass": judged - missed})), "there")
    assert found.twentieths == length
    assert f".w{length}{{background:light-dark({heat('light', length)},{heat('dark', length)})}}" in heat_style()
    assert (heat("light", length) == PAPER["light"]) is (missed == 0)
    said = {(0, 8): "0 %", (1, 289): "<1 %", (1, 20): "5 %", (26, 283): "9 %", (8, 8): "100 %"}
    assert found.percent == said[missed, judged]


def test_time_step_labels_at_both_ends_of_the_front():
    """Below a point lies the axis of cost, to the left of the first one that of the error."""
    points = [(1e-4, 1e-1, 1 / 60), (3e-4, 1e-3, 1 / 240), (1e-3, 1e-18, 1 / 960)]
    table = pd.DataFrame([
        {"scene": "bounce", "dimension": 2, "engine": "chipmunk", "profile": "tuned", "dt": dt, "iterations": None,
         "cost": price, "cost_low": price / 1.1, "cost_high": price * 1.1, "error": error, "on_front": True,
         "best": True}
        for price, error, dt in points
    ])  # fmt: skip
    (figure,) = cost._multiples(Bench(None, {}, {"work_points": table}, [], []))
    place = r"translate\(([-\d.]+),([-\d.]+)\)"
    numbers = re.findall(rf"<text[^>]*{place}[^>]*>(1/\d+)<", figure.picture)
    labels = {text: (float(x), float(y)) for x, y, text in numbers}
    numbers = re.findall(rf'data-is="[^"]*dt (1/\d+): error[^"]*" transform="{place}', figure.picture)
    marks = {text: (float(x), float(y)) for text, x, y in numbers}
    assert set(labels) == {"1/60", "1/960"} and set(marks) == {*labels, "1/240"}
    assert all(labels[text][1] < marks[text][1] for text in labels)
    assert {text: labels[text][0] > marks[text][0] for text in labels} == {"1/60": True, "1/960": False}
