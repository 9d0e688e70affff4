"""Bisection: few questions, silent releases passed over, and nothing claimed that was not asked."""

import math
from dataclasses import replace

import pytest

from validation.cells import Observation, Outcome, Slot
from validation.judging.comparison import Kind
from validation.releases.bisection import Found, Unchanged, bisect, search
from validation.releases.history import told_by

SLOT = Slot("impact", (("e", 0.5), ("v", 4.0)), 2, "toy", "default", 1 / 240)


@pytest.mark.parametrize("count", [2, 3, 7, 16, 41, 100])
def test_number_of_questions_of_a_bisection(count):
    for first_bad in range(1, count):
        asked = []

        def like_first(index, asked=asked, first_bad=first_bad):
            asked.append(index)
            return index < first_bad

        assert search(count, like_first) == (first_bad - 1, first_bad)
        assert len(asked) <= math.ceil(math.log2(count)) and len(set(asked)) == len(asked)


def test_silent_releases_skipped():
    answers = [True, None, True, None, None, False, None, False]
    before, after = search(8, lambda index: answers[index])
    assert (before, after) == (2, 5)
    assert search(3, lambda index: None) == (0, 2)


class Engine:
    """Rebound ratio per release; None where a release does not answer. Cells moved by ulps scatter by ``noise``."""

    metric = "rebound_ratio"

    def __init__(self, ratios, noise=0.0):
        self.ratios, self.noise, self.asked = ratios, noise, []

    def __call__(self, index, cells):
        self.asked.append(index)
        ratio = self.ratios[index]
        if ratio is None:
            lost = [Observation(slot, "", 0, str(index), Outcome.NOT_INSTALLED, "no wheel") for slot in cells]
            return told_by("toy", str(index), lost)
        found = []
        for slot in cells:
            metrics = {self.metric: (ratio + slot.ulp * self.noise, "")}
            found.append(Observation(slot, "c", 1, str(index), Outcome.OK, metrics=metrics))
        return told_by("toy", str(index), found)


def test_a_flip_is_found_and_both_sides_are_shown():
    engine = Engine([0.5] * 6 + [0.4] * 3)
    found = bisect(9, [SLOT], "rebound_ratio", engine)
    assert isinstance(found, Found) and (found.before, found.after) == (5, 6)
    assert found.change.kind is Kind.FLIP and found.change.regressed
    assert "0.5" in found.change.before and "0.4" in found.change.after
    assert len(engine.asked) == len(set(engine.asked)) <= 2 + math.ceil(math.log2(9))
    assert found.others is None


@pytest.mark.parametrize("name", ["rebound_ratio", "impact/rebound_ratio"])
def test_three_releases_one_silent_need_two_answers(name):
    engine = Engine([0.5, None, 0.4])
    found = bisect(3, [SLOT], name, engine)
    assert (found.before, found.after, found.unknown) == (0, 2, [1])
    assert found.silent == {1: "no wheel"}


def test_value_that_moves_within_its_floor():
    assert isinstance(bisect(3, [SLOT], "rebound_ratio", Engine([0.4, 0.401, 0.402], noise=0.01)), Unchanged)
    found = bisect(3, [SLOT], "rebound_ratio", Engine([0.4, 0.4, 0.402], noise=1e-5))
    assert (found.before, found.after) == (1, 2) and found.change.kind is Kind.ERROR


def test_end_of_a_bisection_without_an_answer():
    found = bisect(3, [SLOT], "rebound_ratio", Engine([0.5, 0.5, None]))
    assert isinstance(found, Unchanged) and "no wheel" in found.reason


def test_all_names_the_other_changes_of_the_row():
    ratios = [0.5, 0.4, 0.5, 0.5, 0.4, 0.4]
    assert bisect(6, [SLOT], "rebound_ratio", Engine(ratios), every=True).others == ((0, 1), (1, 2))
    assert bisect(4, [SLOT], "rebound_ratio", Engine([0.5, 0.5, 0.4, 0.4]), every=True).others == ()


def test_the_most_serious_cell_is_followed():
    """Both cells fail on both sides or move; only that with e = 0.5 loses its verdict."""
    other = replace(SLOT, params=(("e", 0.7), ("v", 4.0)))
    found = bisect(2, [other, SLOT], "rebound_ratio", Engine([0.5, 0.4]))
    assert found.change.kind is Kind.FLIP and "e=0.5" in found.change.params


def test_check_without_a_row_told():
    found = bisect(2, [SLOT], "rebound", Engine([0.5, 0.4]))
    assert isinstance(found, Unchanged) and "no such check" in found.reason


@pytest.mark.parametrize(
    ("asked", "meant"),
    [("apex", ["apex[1]", "apex[2]"]), ("apex[1]", ["apex[1]"]), ("bounce/apex[1]", ["apex[1]"]), ("ape", []),
     ("apex[1", []), ("[1]", [])],
)  # fmt: skip
def test_check_by_name_series_or_index(asked, meant):
    from validation.releases.bisection import is_meant

    assert [metric for metric in ("apex[1]", "apex[2]", "rest[1][2]") if is_meant(metric, asked)] == meant
    assert not is_meant("rest[1][2]", "rest[1]") and is_meant("rest[1][2]", "rest")
    for word, found in (("ball.y", True), ("floor/ball.fy", False), ("ball", False), ("1", False)):
        assert is_meant("final[ball.y]", word) == found, "the file's own words for its check"
    assert is_meant("mean[floor/ball.fy]", "floor/ball.fy") and not is_meant("apex[1]", "1")


def test_order_of_asked_releases_and_cells_in_a_bisection():
    """The cell as it is and from starts moved by units in the last place: the floor of both sides."""
    cells = []

    class Listening(Engine):
        def __call__(self, index, slots):
            cells.append((index, [slot.ulp for slot in slots], {slot.params for slot in slots}))
            return super().__call__(index, slots)

    other = replace(SLOT, params=(("e", 0.7), ("v", 4.0)))
    found = bisect(5, [other, SLOT], "rebound_ratio", Listening([0.5, 0.5, 0.5, 0.4, 0.4]))
    assert found.asked == (0, 4, 2, 3) == tuple(index for index, *_ in cells)
    ends, between = cells[:2], cells[2:]
    assert all(params == {SLOT.params, other.params} for _, _, params in ends)
    assert all(params == {SLOT.params} and moved[0] == 0 and len(set(moved)) == len(moved) > 1
               for _, moved, params in between)  # fmt: skip


def test_flip_followed_by_its_verdict():
    """The value moves at 1 and stays right; the verdict goes at 3."""
    found = bisect(5, [SLOT], "rebound_ratio", Engine([0.5, 0.5 + 1e-13, 0.5 + 1e-13, 0.4, 0.3]))
    assert (found.before, found.after, found.change.kind) == (2, 3, Kind.FLIP)


def test_bisection_without_a_change_or_with_a_silent_end():
    assert bisect(3, [SLOT], "rebound_ratio", Engine([0.5, 0.4, 0.5])) == Unchanged("")
    first = bisect(3, [SLOT], "rebound_ratio", Engine([None, 0.5, 0.5]))
    assert first == Unchanged("release 0 cannot run: no wheel")
    last = bisect(3, [SLOT], "rebound_ratio", Engine([0.5, 0.5, None]))
    assert last == Unchanged("release 2 cannot run: no wheel")


def test_release_without_a_reason_takes_that_of_its_rows():
    class Refusing(Engine):
        def __call__(self, index, cells):
            told = super().__call__(index, cells)
            return replace(told, reason="") if self.ratios[index] is None else told

    found = bisect(3, [SLOT], "rebound_ratio", Refusing([0.5, None, 0.4]))
    assert "no wheel" in found.silent[1]


def test_value_that_changes_twice_between_two_releases():
    """It fails everywhere, and is .35 in the end: the release that is found is where it first left .4."""
    found = bisect(4, [SLOT], "rebound_ratio", Engine([0.4, 0.4, 0.37, 0.35], noise=1e-5))
    assert (found.before, found.after) == (1, 2)
    assert "0.4" in found.change.before and "0.37" in found.change.after


def test_creeping_value_within_its_floor_by_the_ends():
    """No two neighbours differ by more than the floor, of either of two cells; first and last do."""
    other = replace(SLOT, params=(("e", 0.6), ("v", 4.0)))
    engine = Engine([0.4, 0.4 + 0.9e-3, 0.4 + 1.8e-3, 0.4 + 2.7e-3], noise=1e-3)
    found = bisect(4, [SLOT, other], "rebound_ratio", engine)
    assert isinstance(found, Found) and found.after == found.before + 1
    assert "0.4" in found.change.before and "0.4027" in found.change.after


def test_two_ends_without_a_value_differ():
    class Silent(Engine):
        def __call__(self, index, cells):
            told = super().__call__(index, cells)
            rows = [
                replace(row, value=None, error=None, physics="fail", outcome="diverged", reason="no number")
                for row in told.rows
            ]
            return replace(told, rows=rows)

    found = bisect(4, [SLOT], "rebound_ratio", Silent([0.5, 0.5, 0.4, 0.4]))
    assert found == Unchanged("release 0 has no value of rebound_ratio, nor has release 3 : no number")
