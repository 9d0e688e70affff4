"""Listing findings: nothing becomes known without somebody's reason, and what must not be listed is refused."""

from dataclasses import replace

import pytest

from validation import acceptance
from validation.acceptance import MOVES, accepted, band, propose, slots_to_move
from validation.canonical import Check
from validation.cells import Observation, Outcome, Slot
from validation.deviation import Deviation
from validation.findings import Family, Finding, Findings, row_key
from validation.rows import rows_of

SLOT = Slot("incline", (("ratio", 0.99),), 2, "nameless", "default", 1 / 240)
SLIDES = replace(SLOT, params=())
FAMILY = Family("creeps", ("default",), "incline", ("creep",), "it is soft", "its manual", ">=1,<2")
KEY = row_key(SLOT, "creep")
#: A tolerance of incline/creep: g dt^2 over 2 s is 8.5e-5 m/s.
TOLERANCE = 9.81 / 240**2 / 2


def observed(slot, version="1.2", outcome=Outcome.OK, **metrics):
    values = {name: (value, "") for name, value in metrics.items()}
    return Observation(slot, "cell", 1, version, outcome, metrics=values)


def rows(slot=SLOT, moved=1e-3, **kwargs):
    """Rows of a cell that creeps at 0.5 m/s, and at up to ``moved`` more from moved starts."""
    kwargs = {"creep": 0.5, **kwargs}
    others = [observed(replace(slot, ulp=n), creep=kwargs["creep"] + moved * n / 2) for n in MOVES] if moved else []
    return rows_of("run", [observed(slot, **kwargs), *others])


def listed(*families, **members):
    entries = {KEY: members["creep"]} if members else {}
    return Findings("nameless", {family.id: family for family in families}, (), entries)


def test_a_new_row_is_listed_with_value_and_band_only_once_its_family_is_accepted():
    proposal = propose(rows(), "nameless", listed(FAMILY))
    (change,) = proposal.changes
    assert (list(change.new), change.asks, change.is_draft) == ([KEY], True, False)
    assert accepted(proposal, []) == {}
    assert accepted(proposal, ["creeps"]) == {KEY: Finding(FAMILY, 0.5, pytest.approx(4e-3))}


def test_rows_without_a_family_become_a_draft_that_cannot_be_accepted_without_a_reason():
    proposal = propose(rows(), "nameless", None)
    (change,) = proposal.changes
    assert change.is_draft and change.family.profiles == ("default",) and change.family.metrics == ("creep",)
    assert change.family.releases == "==1.2.*"
    assert accepted(proposal, [change.family.id]) == {}


def test_a_drifted_row_keeps_its_old_entry_until_its_family_is_accepted_again():
    old = Finding(FAMILY, 0.51, 1e-3)
    proposal = propose(rows(), "nameless", listed(FAMILY, creep=old))
    (change,) = proposal.changes
    assert list(change.drifted) == [KEY] and change.asks
    assert accepted(proposal, []) == {KEY: old}
    assert accepted(proposal, ["creeps"])[KEY].value == 0.5


def test_a_row_within_its_band_stays_as_it_is_listed_and_asks_nothing():
    old = Finding(FAMILY, 0.5009, 1e-3)
    proposal = propose(rows(), "nameless", listed(FAMILY, creep=old))
    assert not proposal.changes[0].asks
    assert accepted(proposal, []) == accepted(proposal, ["creeps"]) == {KEY: old}


def test_a_row_that_passes_now_is_dropped_only_once_its_family_is_accepted():
    old = Finding(FAMILY, 0.5, 1e-3)
    proposal = propose(rows(creep=0.0), "nameless", listed(FAMILY, creep=old))
    assert list(proposal.changes[0].gone) == [KEY]
    assert accepted(proposal, []) == {KEY: old}
    assert accepted(proposal, ["creeps"]) == {}


@pytest.mark.parametrize("outcome", ["unsupported", "invalid", "crashed", "timed_out", "not_installed", "missing"])
def test_entries_of_cells_without_an_answer_are_never_dropped(outcome):
    old = Finding(FAMILY, 0.5, 1e-3)
    proposal = propose(rows(outcome=Outcome(outcome)), "nameless", listed(FAMILY, creep=old))
    assert accepted(proposal, ["creeps"]) == {KEY: old}
    assert bool(proposal.refused) == (outcome == "invalid")


def test_entries_of_cells_that_the_run_does_not_have_stay():
    old = Finding(FAMILY, 0.5, 1e-3)
    other = rows(replace(SLOT, dimension=3))
    proposal = propose(other, "nameless", listed(FAMILY, creep=old))
    assert accepted(proposal, ["creeps"])[KEY] == old


def test_an_entry_of_a_check_that_its_cell_no_longer_states_goes():
    key = row_key(SLOT, "slides")
    family = replace(FAMILY, metrics=("creep", "slides"))
    findings = Findings("nameless", {"creeps": family}, (), {key: Finding(family, 1.0, 0.1)})
    proposal = propose(rows(), "nameless", findings)
    assert list(proposal.changes[0].gone) == [key]


def test_a_row_without_a_value_is_listed_as_having_none():
    proposal = propose(rows(creep=None, moved=0.0), "nameless", listed(FAMILY))
    assert accepted(proposal, ["creeps"]) == {KEY: Finding(FAMILY, None)}


def test_a_divergence_is_listed_as_one():
    proposal = propose(rows(outcome=Outcome.DIVERGED, creep=None, moved=0.0), "nameless", listed(FAMILY))
    assert accepted(proposal, ["creeps"]) == {KEY: Finding(FAMILY, None, diverged=True)}


def test_a_pass_whose_scatter_reaches_beyond_the_tolerance_is_listed_and_any_other_is_not():
    near = 0.9 * TOLERANCE
    wide = propose(rows(creep=near, moved=0.2 * TOLERANCE), "nameless", listed(FAMILY))
    assert list(wide.changes[0].new) == [KEY]
    tight = propose(rows(creep=near, moved=0.001 * TOLERANCE), "nameless", listed(FAMILY))
    assert not tight.changes[0].asks


# ---- refusals ------------------------------------------------------------------------------------------------------


def refusals(proposal):
    assert accepted(proposal, [change.family.id for change in proposal.changes]) == {}
    return {why for _, why in proposal.refused}


def test_a_row_that_a_law_covers_and_misses_is_refused(monkeypatch):
    law = Deviation("nameless", ("default",), "incline", "creep", lambda scene, dt: (0.4, 0.01), "by design", "manual")
    monkeypatch.setattr("validation.rows.covering", lambda *where: iter([law]))
    (why,) = refusals(propose(rows(), "nameless", listed(FAMILY)))
    assert "a deviation law speaks about it and misses" in why
    # What the law predicts is explained and needs no entry.
    assert not propose(rows(creep=0.405), "nameless", listed(FAMILY)).refused


def test_rows_whose_receipts_do_not_hold_are_refused():
    (why,) = refusals(propose(rows(outcome=Outcome.INVALID), "nameless", listed(FAMILY)))
    assert "receipts" in why


def test_rows_of_the_profile_that_promises_a_solution_are_refused():
    slot = replace(SLOT, engine="reference", profile="reference")
    family = replace(FAMILY, profiles=("reference",))
    findings = Findings("reference", {"creeps": family}, (), {})
    (why,) = refusals(propose(rows(slot), "reference", findings))
    assert "mended, not listed" in why


def test_a_row_of_another_release_than_its_family_holds_for_is_refused():
    (why,) = refusals(propose(rows(version="2.0"), "nameless", listed(FAMILY)))
    assert "holds for >=1,<2, not for 2.0" in why


def test_a_row_whose_scatter_is_not_known_is_refused():
    (why,) = refusals(propose(rows(moved=0.0), "nameless", listed(FAMILY)))
    assert "its scatter is not known" in why


# ---- bands ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("value", "tolerance", "scatter", "expected"),
    [(1.0, 1e-3, 0.0, 1e-5), (1.0, 1e-12, 0.0, 1e-6), (-1.0, 1e-12, 0.0, 1e-6), (1.0, 1e-3, 0.01, 0.04)],
)
def test_a_band_is_the_scatter_but_no_less_than_what_matters_and_what_round_off_makes(
    value, tolerance, scatter, expected
):
    assert band(value, tolerance, scatter) == pytest.approx(expected)


def test_cells_that_fail_or_nearly_fail_are_moved_and_no_others():
    cells = [observed(SLOT, creep=0.5), observed(replace(SLOT, dimension=3), creep=0.0)]
    moved = slots_to_move(rows_of("run", cells), "nameless")
    assert moved == [replace(SLOT, ulp=n) for n in MOVES]
    assert slots_to_move(rows(), "nameless") == []  # their scatter is known
    assert slots_to_move(rows_of("run", cells), "another") == []


def test_a_study_needs_no_moved_starts():
    cells = [
        observed(replace(SLIDES, params=(("ratio", r),)), creep=0.0, acceleration=a)
        for r, a in ((0.9, 0.0), (1.01, 0.0), (1.1, 5.0))
    ]
    (study,) = [row for row in rows_of("run", cells) if row.metric == "threshold"]
    assert study.physics == "fail"
    family = replace(FAMILY, id="late", metrics=("threshold",))
    proposal = propose([study], "nameless", Findings("nameless", {"late": family}, (), {}))
    assert [finding.value for finding in accepted(proposal, ["late"]).values()] == [study.value]


def test_the_check_of_a_row_is_what_it_was_judged_by():
    (row,) = rows()
    assert acceptance._check(row) == Check("creep", "m/s", 0.0, row.tolerance, row.because, row.source)
    assert row.tolerance == pytest.approx(TOLERANCE)
