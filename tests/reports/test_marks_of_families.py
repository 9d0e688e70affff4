"""A mark of a family on the page, of each kind of row there is: its words, its share, and whether it leads to rows."""

from collections import Counter

import pytest

from reports.matrix import UNJUDGED, Field
from reports.page import verdicts
from reports.page.verdicts import Mark, family_mark
from reports.wording import LABELS, MARKS

#: There is nothing to measure: no row to lead to.
NOWHERE = {"unsupported", "declined", "not_installed"}


@pytest.mark.parametrize("mark", sorted({*MARKS, *LABELS}))
def test_link_of_a_mark_to_its_rows(mark):
    found = family_mark(Field(Counter({mark: 3})), "there")
    judged, passing = mark not in UNJUDGED, mark == "pass"
    if mark in NOWHERE:
        assert found == Mark(mark, "")
        assert not judged
        return
    assert found.href == "#there" and found.title == ""
    assert found.text == ("" if not judged else "3" if passing else "3/3")
    assert found.share == (1.0 if judged and not passing else 0.0)


def test_matrix_of_no_rows_unsupported_and_without_links():
    assert family_mark(None, "there") == Mark("unsupported", "")


def judged_row(**changed):
    """A row that fails, of one engine and profile in one cell."""
    slot = {"scene": "bounce", "params": {}, "dimension": 2, "engine": "toy", "profile": "default", "dt": 1 / 240,
            "iterations": None, "ulp": 0}  # fmt: skip
    row = {
        "scene": "bounce", "dimension": 2, "engine": "toy", "profile": "default", "iterations": None,
        "metric": "apex[2]",
        "engine_version": "1", "unit": "m", "value": 0.5, "truth": 0.640001234, "error": -0.14, "tolerance": 1e-3,
        "because": "so", "outcome": "ok", "reason": "", "dt": 1 / 240, "source": "law", "physics": "fail",
        "floor": None,
        "standing": "known", "params": {"e": 0.8}, "slot": slot, "skill": None, "explained": "", "known": "it sinks",
    }  # fmt: skip
    return {**row, **changed}


def test_worst_row_of_each_column():
    """A cell at its scene's defaults is called so; what stands in brackets is which of the same kind it is."""
    other = judged_row(metric="apex", value=0.64, error=1e-6, physics="pass", standing=None)
    asked = judged_row(metric="apex", params={"e": 0.8}, iterations=7, error=-0.2)
    asked["slot"] = {**asked["slot"], "params": {"e": 0.9}, "iterations": 7}
    worst = judged_row(skill=0.78)
    found = verdicts._worst(("toy", "default"), [other, worst])
    assert (found.engine, found.profile, found.row) == ("toy", "default", worst)
    assert (found.mark.mark, found.mark.text) == ("known", "140")
    assert (found.where, found.value, found.truth, found.tolerance) == ("[2]", "0.5", "0.640001", "0.001")
    assert (found.ratio, found.passing, found.skill) == ("140", "1/2", "0.78")
    assert verdicts._worst(("toy", "default"), [judged_row(skill=0.25)]).skill == "0.25"
    assert verdicts._worst(("toy", "default"), [other]).skill == ""  # what passes needs no null beside it
    assert found.command.startswith("crosscheck run bounce") and found.why == ""
    assert verdicts._worst(("toy", "default"), [other]).where == "defaults"
    assert verdicts._worst(("toy", "default"), [asked, other]).where == "e=0.9 it=7"
