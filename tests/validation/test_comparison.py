"""What changed between two runs: each kind of change with its direction, its size and its words."""

import json
import math
from dataclasses import replace

import pytest

from validation.cells import Slot
from validation.judging.comparison import (
    PRACTICAL,
    Change,
    Kind,
    by_seriousness,
    compare_rows,
    compare_speeds,
    failing,
    families,
)

SLOT = Slot("stack", (("n", 2.0),), 3, "toy", "soft", 1 / 240)
ROW = {
    "slot": SLOT.as_dict(), "metric": "drift", "engine": "toy", "profile": "soft", "scene": "stack", "dimension": 3,
    "engine_version": "1.0", "outcome": "ok", "physics": "pass", "value": 0.25, "error": 0.25, "truth": 0.0,
    "tolerance": 1.0, "unit": "m", "floor": None, "reason": "",
}  # fmt: skip
NEWER = {**ROW, "engine_version": "1.1"}
SAME, MOVED = "same engine version 1.0", "toy 1.0 -> 1.1"


def change(before, after):
    (found,) = compare_rows([before], [after])
    assert (found.engine, found.profile, found.scene, found.dimension) == ("toy", "soft", "stack", 3)
    assert (found.params, found.metric, found.slot) == ("n=2", "drift", ROW["slot"])
    return found


def brief(found):
    return found.kind, found.regressed, found.before, found.after, found.size, found.note


# ---- one row -------------------------------------------------------------------------------------------------------


def test_cell_with_another_outcome_worse_unless_answered():
    crashed = {**ROW, "outcome": "crashed", "physics": None, "value": None, "error": None, "reason": "signal 11"}
    ended = (Kind.OUTCOME, True, "0.25 m (pass)", "crashed", 0.0, "signal 11")
    assert brief(change(ROW, crashed)) == ended
    assert brief(change(crashed, ROW)) == (Kind.OUTCOME, False, "crashed", "0.25 m (pass)", 0.0, "")


def test_growth_of_a_flipped_verdict_in_tolerances():
    fails = {**ROW, "physics": "fail", "value": -2.25, "error": -2.25}
    flipped = (Kind.FLIP, True, "0.25 m (pass)", "-2.25 m (fail)", 2.0, SAME)
    assert brief(change(ROW, fails)) == flipped
    assert brief(change(fails, NEWER)) == (Kind.FLIP, False, "-2.25 m (fail)", "0.25 m (pass)", -2.0, MOVED)
    wide = {**fails, "tolerance": 4.0}
    assert change(ROW, wide).size == 0.5


@pytest.mark.parametrize("missing", [{"error": None}, {"tolerance": None}, {"tolerance": 0.0}])
def test_size_of_a_flip_without_error_or_tolerance(missing):
    assert change(ROW, {**ROW, "physics": "fail", "value": 9.0, "error": 9.0, **missing}).size == 0.0
    assert change({**ROW, "error": None}, {**ROW, "physics": "fail"}).size == 0.0


def test_missing_value_worse_and_returned_value_not():
    none = {**ROW, "value": None, "error": None, "reason": "it never touched"}
    gone = (Kind.ERROR, True, "0.25 m (pass)", "no value (pass)", 0.0, "it never touched")
    assert brief(change(ROW, none)) == gone
    assert brief(change(none, ROW)) == (Kind.ERROR, False, "no value (pass)", "0.25 m (pass)", 0.0, "")
    unjudged = {**none, "physics": None}
    assert change({**ROW, "physics": None}, unjudged).before == "0.25 m (not judged)"
    assert compare_rows([none], [none]) == []


def moved_to(value, **more):
    return {**ROW, "value": value, "error": value, **more}


def test_change_beyond_a_hundredth_of_the_tolerance():
    assert compare_rows([moved_to(0.0)], [moved_to(0.01)]) == []
    found = change(moved_to(0.0), moved_to(0.5))
    note = f"more than a hundredth of its tolerance; {SAME}"
    assert brief(found) == (Kind.ERROR, True, "0 m (pass)", "0.5 m (pass)", 0.5, note)
    assert brief(change(moved_to(-0.5), moved_to(0.25, engine_version="1.1"))) == (
        Kind.ERROR, False, "-0.5 m (pass)", "0.25 m (pass)", -0.25, note.replace(SAME, MOVED))  # fmt: skip


def test_change_to_the_other_side_of_the_truth():
    found = change(moved_to(-0.25), moved_to(0.25))
    assert (found.kind, found.regressed, found.size) == (Kind.ERROR, False, 0.0)


@pytest.mark.parametrize("side", [0, 1])
def test_change_within_the_larger_floor_is_noise(side):
    pair = [moved_to(0.0, floor=0.125), moved_to(0.25, floor=0.125)]
    pair[side]["floor"] = 0.25
    assert compare_rows(*[[row] for row in pair]) == []
    pair[side]["floor"] = 0.2
    assert change(*pair).note == f"more than its floor 0.2; {SAME}"


def test_comparison_of_rows_without_a_floor():
    del (before := moved_to(0.0))["floor"], (after := moved_to(0.5))["floor"]
    assert "hundredth" in change(before, after).note


def test_rows_without_a_tolerance_changed_by_any_bit():
    bare = {"tolerance": None, "truth": None, "error": None, "physics": None}
    before, after = ({**ROW, **bare, "value": v} for v in (0.25, math.nextafter(0.25, 1.0)))
    assert brief(change(before, after)) == (
        Kind.ERROR, False, "0.25 m (not judged)", "0.25 m (not judged)", 0.0,
        f"has no tolerance: any changed bit counts; {SAME}")  # fmt: skip


def test_rows_of_one_side_neither_better_nor_worse():
    (removed,) = compare_rows([ROW], [])
    (added,) = compare_rows([], [ROW])
    assert brief(removed) == (Kind.REMOVED, False, "0.25 m (pass)", "-", 0.0, "")
    assert brief(added) == (Kind.ADDED, False, "-", "0.25 m (pass)", 0.0, "")
    assert removed.engine == added.engine == "toy" and removed.slot == added.slot == ROW["slot"]


@pytest.mark.parametrize(("physics", "kind"), [("fail", Kind.FLIP), ("pass", Kind.ADDED)])
def test_failure_without_a_row_on_the_other_side(physics, kind):
    """A restitution that is realised too low has a check only where it is; `compare` called it "only in B", exit 0."""
    realised = {**ROW, "metric": "realised_restitution", "value": 0.9, "error": -0.1, "physics": physics}
    (change,) = compare_rows([ROW], [ROW, realised])
    assert (change.kind, change.regressed) == (kind, kind is Kind.FLIP)
    (elsewhere,) = compare_rows([], [realised])
    assert (elsewhere.kind, elsewhere.regressed) == (Kind.ADDED, False)


def test_question_by_differently_written_slots():
    turned = {**ROW, "slot": dict(reversed(list(ROW["slot"].items())))}
    assert compare_rows([ROW], [turned]) == []
    assert len(compare_rows([ROW], [{**ROW, "metric": "sink"}])) == 2
    assert len(compare_rows([ROW], [{**ROW, "slot": replace(SLOT, iterations=4).as_dict()}])) == 2


def test_a_ratio_is_told_without_a_unit():
    assert change({**ROW, "unit": "1"}, {**ROW, "unit": "1", "physics": "fail"}).before == "0.25 (pass)"


# ---- order, families, plain data -----------------------------------------------------------------------------------

CHANGE = Change(Kind.ERROR, True, "toy", "soft", "stack", 3, "n=2", "drift", "a", "b", 1.0, {"iterations": None})


def test_the_most_serious_change_comes_first():
    ordered = [
        replace(CHANGE, kind=Kind.FLIP, size=0.0),
        replace(CHANGE, kind=Kind.FLIP, size=9.0, regressed=False),
        replace(CHANGE, kind=Kind.OUTCOME),
        replace(CHANGE, size=math.inf),
        replace(CHANGE, size=math.nan, engine="zoo"),
        replace(CHANGE, size=-8.0),
        replace(CHANGE, size=3.0),
        CHANGE,
        replace(CHANGE, slot={"iterations": 1}),
        replace(CHANGE, slot={"iterations": 4}),
        replace(CHANGE, slot={"iterations": 30}),
        replace(CHANGE, metric="sink"),
        replace(CHANGE, params="n=3"),
        replace(CHANGE, dimension=4),
        replace(CHANGE, scene="tower"),
        replace(CHANGE, profile="stiff"),
        replace(CHANGE, engine="zoo"),
        replace(CHANGE, regressed=False, size=50.0),
        replace(CHANGE, kind=Kind.SPEED),
        replace(CHANGE, kind=Kind.ADDED),
        replace(CHANGE, kind=Kind.REMOVED),
    ]
    assert sorted(ordered[::-1], key=by_seriousness) == ordered
    assert by_seriousness(replace(CHANGE, slot={})) == by_seriousness(CHANGE)


def test_change_as_plain_data():
    plain = CHANGE.as_dict()
    assert (plain["kind"], plain["size"], plain["slot"]) == ("value changed", 1.0, {"iterations": None})
    for size in (math.inf, math.nan):
        plain = replace(CHANGE, size=size).as_dict()
        assert plain["size"] is None and set(plain) == set(CHANGE.as_dict())
        json.dumps(plain, allow_nan=False)


def test_families_of_changes_by_kind_direction_and_metric():
    first = replace(CHANGE, metric="impulse[1]", size=2.0)
    largest = replace(CHANGE, metric="impulse[12]", size=7.0)
    others = [
        replace(CHANGE, metric="impulse_scatter"), replace(CHANGE, metric="load[1]"),
        replace(CHANGE, metric="impulse[1]", regressed=False),
        replace(CHANGE, metric="impulse[1]", kind=Kind.FLIP), replace(CHANGE, metric="impulse[1]", scene="pile"),
        replace(CHANGE, metric="impulse[1]", engine="zoo"), replace(CHANGE, metric="impulse[1]", profile="stiff"),
    ]  # fmt: skip
    found = families([first, *others, largest])
    assert [family.changes for family in found if len(family.changes) > 1] == [(largest, first)]
    assert next(family for family in found if len(family.changes) > 1).first is largest
    assert len(found) == 8 and found[0].first.kind is Kind.FLIP
    # Numbers that are no series are families of their own.
    assert len(families([CHANGE, replace(CHANGE, metric="sink"), replace(CHANGE, metric="sink", params="n=3")])) == 2


@pytest.mark.parametrize(
    ("fail_on", "caught"),
    [("never", set()), ("flips", {"flip", "outcome"}), ("regressions", {"flip", "outcome", "error", "speed"}),
     ("changes", {"flip", "outcome", "error", "speed", "better"})],
)  # fmt: skip
def test_changes_that_fail_a_comparison(fail_on, caught):
    made = {
        "flip": replace(CHANGE, kind=Kind.FLIP), "outcome": replace(CHANGE, kind=Kind.OUTCOME), "error": CHANGE,
        "speed": replace(CHANGE, kind=Kind.SPEED), "better": replace(CHANGE, kind=Kind.FLIP, regressed=False),
    }  # fmt: skip
    assert {name for name, one in made.items() if failing([one], fail_on)} == caught
    assert not failing([], fail_on)


# ---- speed ---------------------------------------------------------------------------------------------------------


def timed(ratio, low=None, high=None, **more):
    unit = {"purpose": "work", "slot": SLOT.as_dict(), "opponent": "ball/default"}
    return unit | {"ratio": ratio, "ratio_low": low or ratio, "ratio_high": high or ratio} | more


def test_ratios_and_interval_of_a_change_of_speed():
    (found,) = compare_speeds([timed(2.0, 1.0, 4.0)], [timed(16.0, 8.0, 32.0)])
    assert found == Change(
        Kind.SPEED, True, "toy", "soft", "stack", 3, "n=2", "time", "2 x ball/default", "16 x ball/default", 8.0,
        SLOT.as_dict(), f"interval x2 to x32, threshold x{PRACTICAL:g}; work")  # fmt: skip
    (found,) = compare_speeds([timed(16.0)], [timed(2.0)])
    assert (found.regressed, found.size) == (False, 0.125)


@pytest.mark.parametrize(
    ("before", "after", "counts"),
    [
        (timed(1.0), timed(PRACTICAL), False),
        (timed(1.0), timed(math.nextafter(PRACTICAL, 2.0)), True),
        (timed(PRACTICAL), timed(1.0), False),
        (timed(1.2), timed(1.0), True),
        (timed(1.0), timed(1.5), True),
        (timed(1.0), timed(2.0, 1.05, 4.0), False),  # the interval does not clear the threshold
        (timed(1.0, 0.5, 1.95), timed(2.0), False),
        (timed(2.0, 1.05, 4.0), timed(1.0), False),
        (timed(1.0), timed(0.5, 0.25, 0.95), False),
    ],
)
def test_speed_change_with_its_interval_beyond_a_tenth(before, after, counts):
    found = compare_speeds([before], [after])
    assert bool(found) == counts and all(each.regressed == (after["ratio"] > before["ratio"]) for each in found)


def test_compared_units_and_opponents():
    for other in ({"purpose": "bodies"}, {"opponent": "box/default"}, {"slot": replace(SLOT, dimension=2).as_dict()}):
        assert compare_speeds([timed(1.0)], [timed(9.0, **other)]) == []
    turned = timed(9.0, slot=dict(reversed(list(SLOT.as_dict().items()))))
    assert len(compare_speeds([timed(1.0)], [turned])) == 1


def test_order_of_changes_of_speed():
    ratios = {f"p{k}": r for k, r in enumerate((1.0, 4.0, 0.25, 1.02, 8.0))}
    before = [timed(1.0, slot=replace(SLOT, profile=name).as_dict()) for name in ratios]
    after = [timed(r, slot=replace(SLOT, profile=name).as_dict()) for name, r in ratios.items()]
    assert [c.profile for c in compare_speeds(before, after)] == ["p4", "p1", "p2"]
