"""Listing findings: nothing becomes known without somebody's reason, and what must not be listed is refused."""

import math
from dataclasses import replace

import numpy as np
import pytest

from adapters.law import Deviation
from validation.canonical import Check
from validation.catalogue import CATALOGUE
from validation.cells import Observation, Outcome, Slot, prepare
from validation.findings import Family, Finding, Findings, Unsupported, row_key
from validation.judging import acceptance
from validation.judging.acceptance import MOVES, accepted, band, propose, slots_to_move
from validation.judging.rows import rows_of
from validation.metrics import UNAVAILABLE

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


def test_new_row_before_and_after_acceptance():
    proposal = propose(rows(), "nameless", listed(FAMILY))
    (change,) = proposal.changes
    assert (list(change.new), change.asks, change.is_draft) == ([KEY], True, False)
    assert accepted(proposal, []) == {}
    assert accepted(proposal, ["creeps"]) == {KEY: Finding(FAMILY, 0.5, pytest.approx(4e-3))}


def test_draft_for_rows_without_a_family():
    proposal = propose(rows(), "nameless", None)
    (change,) = proposal.changes
    assert change.is_draft and change.family.profiles == ("default",) and change.family.metrics == ("creep",)
    assert change.family.releases == "==1.2.*"
    assert accepted(proposal, [change.family.id]) == {}


def test_drifted_row_keeps_its_entry_until_accepted():
    old = Finding(FAMILY, 0.51, 1e-3)
    proposal = propose(rows(), "nameless", listed(FAMILY, creep=old))
    (change,) = proposal.changes
    assert list(change.drifted) == [KEY] and change.asks
    assert accepted(proposal, []) == {KEY: old}
    assert accepted(proposal, ["creeps"])[KEY].value == 0.5


def test_row_within_its_band_kept_without_a_question():
    old = Finding(FAMILY, 0.5009, 1e-3)
    proposal = propose(rows(), "nameless", listed(FAMILY, creep=old))
    assert not proposal.changes[0].asks
    assert accepted(proposal, []) == accepted(proposal, ["creeps"]) == {KEY: old}


def test_passing_row_before_and_after_acceptance():
    old = Finding(FAMILY, 0.5, 1e-3)
    proposal = propose(rows(creep=0.0), "nameless", listed(FAMILY, creep=old))
    assert list(proposal.changes[0].gone) == [KEY]
    assert accepted(proposal, []) == {KEY: old}
    assert accepted(proposal, ["creeps"]) == {}


@pytest.mark.parametrize(
    "outcome", ["unsupported", "invalid", "refused", "crashed", "timed_out", "not_installed", "missing"]
)
def test_entries_of_unanswered_cells_kept(outcome):
    old = Finding(FAMILY, 0.5, 1e-3)
    proposal = propose(rows(outcome=Outcome(outcome)), "nameless", listed(FAMILY, creep=old))
    assert accepted(proposal, ["creeps"]) == {KEY: old}
    assert bool(proposal.refused) == (outcome != "not_installed")  # an engine that only crashes is not accepted


def test_entries_of_cells_outside_the_run_kept():
    old = Finding(FAMILY, 0.5, 1e-3)
    other = rows(replace(SLOT, dimension=3))
    proposal = propose(other, "nameless", listed(FAMILY, creep=old))
    assert accepted(proposal, ["creeps"])[KEY] == old


@pytest.mark.parametrize("part", range(6), ids=["profile", "scene", "dimension", "params", "dt", "iterations"])
def test_entries_of_another_cell_kept_without_their_check(part):
    """At iterations asked for a cell is another one: what was listed there was dropped by a run without them."""
    other = {0: "tuned", 1: "stack", 2: "3", 3: "ratio=0.9", 4: "1/960", 5: "20"}[part]
    key = (*KEY[:part], other, *KEY[part + 1 :])
    findings = Findings("nameless", {"creeps": FAMILY}, (), {key: Finding(FAMILY, 1.0, 0.1)})
    proposal = propose(rows(), "nameless", findings)
    assert key in proposal.kept and not any(change.gone for change in proposal.changes)


def test_entry_of_a_check_no_longer_stated_dropped():
    key = row_key(SLOT, "slides")
    family = replace(FAMILY, metrics=("creep", "slides"))
    findings = Findings("nameless", {"creeps": family}, (), {key: Finding(family, 1.0, 0.1)})
    proposal = propose(rows(), "nameless", findings)
    assert list(proposal.changes[0].gone) == [key]


def test_row_without_a_value_listed_so():
    proposal = propose(rows(creep=None, moved=0.0), "nameless", listed(FAMILY))
    assert accepted(proposal, ["creeps"]) == {KEY: Finding(FAMILY, None)}


def test_a_divergence_is_listed_as_one():
    proposal = propose(rows(outcome=Outcome.DIVERGED, creep=None, moved=0.0), "nameless", listed(FAMILY))
    assert accepted(proposal, ["creeps"]) == {KEY: Finding(FAMILY, None, diverged=True)}


def test_pass_that_fails_from_a_moved_start():
    near = 0.9 * TOLERANCE
    wide = propose(rows(creep=near, moved=0.2 * TOLERANCE), "nameless", listed(FAMILY))
    assert list(wide.changes[0].new) == [KEY]
    for value, moved in ((near, 0.09), (0.9999999 * TOLERANCE, 1e-12)):  # the band of a failure would reach beyond
        tight = propose(rows(creep=value, moved=moved * TOLERANCE), "nameless", listed(FAMILY))
        assert not tight.changes[0].asks
    pass_and_fail = {KEY: (near, near, 1.1 * TOLERANCE)}
    told = propose(rows(creep=near), "nameless", listed(FAMILY), draws=pass_and_fail)
    assert list(told.changes[0].new) == [KEY]


def test_unsupported_case_refused_until_listed():
    """With a list the refusal is new, and the run fails: a first list has what every profile refuses."""
    refused = rows(outcome=Outcome.UNSUPPORTED, creep=None, moved=0.0)
    here = Unsupported("slopes", ("*",), "incline", 2, "no slopes", "its manual")
    other = replace(here, scene="stack")
    (row,) = propose(refused, "nameless", replace(listed(FAMILY), unsupported=(other,))).refused
    assert "[[unsupported]]" in row[1]
    assert not propose(refused, "nameless", replace(listed(FAMILY), unsupported=(here,))).refused


def test_value_that_the_engine_does_not_tell():
    untold = observed(SLOT, creep=None)
    untold.metrics["creep"] = (None, UNAVAILABLE)
    assert not propose(rows_of("run", [untold]), "nameless", listed(FAMILY)).refused


def test_refused_scenes_of_a_first_list():
    def ran(scene, dimension, outcome, profile="default"):
        slot = replace(SLOT, scene=scene, params=(), dimension=dimension, profile=profile)
        return rows_of("run", [replace(observed(slot, outcome=outcome), reason=f"no {scene}")])

    no, yes = Outcome.UNSUPPORTED, Outcome.OK
    mixed = [*ran("stack", 2, no), *ran("stack", 2, yes, "other")]
    run = [*ran("incline", 2, yes), *ran("bounce", 2, no), *ran("bounce", 3, no), *ran("stack", 3, no), *mixed]
    proposal = propose(run, "nameless", None)
    assert [(each.scene, each.dimension, each.reason) for each in proposal.unsupported] == [
        ("*", 3, "no bounce"), ("bounce", 2, "no bounce")
    ]  # fmt: skip
    assert {row.profile for row, why in proposal.refused if "[[unsupported]]" in why} == {"default"}
    assert {row.scene for row, why in proposal.refused if "[[unsupported]]" in why} == {"stack"}


# ---- refusals ------------------------------------------------------------------------------------------------------


def refusals(proposal):
    assert accepted(proposal, [change.family.id for change in proposal.changes]) == {}
    return {why for _, why in proposal.refused}


def test_row_contradicting_its_law_refused(monkeypatch):
    law = Deviation(
        "nameless", ("default",), "incline", "creep", lambda scene, dt, measure: (0.4, 0.01), "by design", "manual"
    )
    monkeypatch.setattr("validation.judging.predicting.covering", lambda *where: iter([law]))
    (why,) = refusals(propose(rows(), "nameless", listed(FAMILY)))
    assert "a contact law predicts another value" in why
    # What the law predicts is explained and needs no entry.
    assert not propose(rows(creep=0.405), "nameless", listed(FAMILY)).refused


@pytest.mark.parametrize("follows", [False, True])
def test_law_at_requested_iterations_only_if_it_follows_them(monkeypatch, follows):
    """What a profile's own sweeps do says nothing of others; one that follows them says of each count its own."""
    asked = (lambda scene, dt, measure, sweeps: (0.05 * sweeps, 0.01)) if follows else None
    law = Deviation(
        "nameless", ("default",), "incline", "creep", lambda scene, dt, measure: (0.5, 0.01), "by design", "manual",
        asked=asked,
    )  # fmt: skip
    monkeypatch.setattr("validation.judging.predicting.covering", lambda *where: iter([law]))

    def explained(sweeps, creep):
        (row,) = rows(replace(SLOT, iterations=sweeps), moved=None, creep=creep)
        return row.standing == "explained"

    assert explained(None, 0.5) and not explained(None, 0.4)
    assert explained(8, 0.4) == follows and not explained(8, 0.5)
    assert explained(10, 0.5) == follows and not explained(10, 0.4)


def test_rows_with_failed_receipts_refused():
    (why,) = refusals(propose(rows(outcome=Outcome.INVALID), "nameless", listed(FAMILY)))
    assert why.startswith("invalid: ")


def test_failures_of_an_engine_that_realises_another_restitution():
    """A list would make a regression of the engine known."""
    judged = rows()
    own = replace(judged[0], metric="realised_restitution", physics="fail", standing="new")
    found = propose([*judged, own], "nameless", listed(FAMILY)).refused
    assert {row.metric for row, _ in found} == {row.metric for row in judged if row.physics == "fail"} | {own.metric}
    assert {why for _, why in found} == {"its property checks do not hold"}


def test_rows_of_the_solver_profile_refused():
    slot = replace(SLOT, engine="reference", profile="reference")
    family = replace(FAMILY, profiles=("reference",))
    findings = Findings("reference", {"creeps": family}, (), {})
    (why,) = refusals(propose(rows(slot), "reference", findings))
    assert "fixed, not listed" in why


def test_row_of_a_release_outside_its_family_refused():
    (why,) = refusals(propose(rows(version="2.0"), "nameless", listed(FAMILY)))
    assert "holds for >=1,<2, not for 2.0" in why


def test_row_with_unknown_scatter_refused():
    (why,) = refusals(propose(rows(moved=0.0), "nameless", listed(FAMILY)))
    assert "its scatter is unknown" in why


# ---- bands ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("value", "tolerance", "scatter", "expected"),
    [(1.0, 1e-3, 0.0, 1e-5), (1.0, 1e-12, 0.0, 1e-6), (-1.0, 1e-12, 0.0, 1e-6), (1.0, 1e-3, 0.01, 0.04)],
)
def test_band_by_scatter_relevance_and_round_off(value, tolerance, scatter, expected):
    assert band(value, tolerance, scatter) == pytest.approx(expected)


#: Seventeen values of a row of truth 0 and tolerance .1: as it is posed, and from sixteen moved starts.
TWO_WAYS = (3.0, *(3.0, 2.0) * 8)


def wide(values, **fields):
    """A row with the scatter of its first five values, and what is listed of it."""
    floor = max(abs(value - values[0]) for value in values[1:5])
    row = row_of(**{"truth": 0.0, "tolerance": 0.1, "value": values[0], "physics": "fail", "floor": floor, **fields})
    return row, acceptance._entry(row, values)[1]


def test_band_containing_the_truth_from_sixteen_starts():
    row, (value, _, _, ends) = wide(TWO_WAYS)
    assert acceptance.hides(row, (3.0 - 4.0, 3.0 + 4.0)) and not acceptance.hides(row, ends)
    values, logs, widths = np.array(TWO_WAYS), np.log(TWO_WAYS), 4.015 * math.sqrt(18 / 17)
    near = math.exp(logs.mean() - widths * logs.std(ddof=1))
    assert (value, *ends) == pytest.approx((3.0, near, values.mean() + widths * values.std(ddof=1)))
    assert 0.7 < ends[0] < 2.0 and 3.0 < ends[1] < 6.0
    below = wide(tuple(-each for each in TWO_WAYS))[1]
    assert below[3] == pytest.approx((-ends[1], -ends[0]))
    shifted = wide(tuple(each + 7.0 for each in TWO_WAYS), truth=7.0)[1]
    assert shifted[3] == pytest.approx((7.0 + ends[0], 7.0 + ends[1]))


def test_student_quantile_against_the_table():
    from scipy.stats import t

    assert {n: round(float(t.ppf(1.0 - 0.0005, n)), 4) for n in acceptance.STUDENT} == acceptance.STUDENT
    assert 1 + len(MOVES) + len(acceptance.MORE_MOVES) == 1 + max(acceptance.STUDENT)


@pytest.mark.parametrize("spread", [0.05, 0.4, 1.0])
def test_coverage_of_a_band_for_one_more_start(spread):
    """Of 4000 rows whose values are multiplied at random, 4 come nearer, on average; no more go away than of four."""
    dice = np.random.default_rng(2026)
    draws = np.exp(spread * dice.normal(size=(4000, 18)))
    bands = [acceptance.one_more(tuple(row[:17]), 0.0) for row in draws]
    assert sum(row[17] < low for (low, _), row in zip(bands, draws, strict=True)) <= 12
    beyond = sum(row[17] > high for (_, high), row in zip(bands, draws, strict=True))
    assert beyond <= 1.5 * sum(row[17] > row[0] + 4.0 * abs(row[1:5] - row[0]).max() for row in draws) + 10
    assert all(low <= row[:17].min() and row[:17].max() <= high for (low, high), row in zip(bands, draws, strict=True))


def test_band_of_starts_on_both_sides_of_the_truth():
    draws = (1.0, *(1.0, -1.0) * 8)
    row, (_, _, _, (low, high)) = wide(draws)
    assert low < -1.0 < 1.0 < high and acceptance.hides(row, (low, high))
    half = 4.015 * math.sqrt(18 / 17) * np.std(draws, ddof=1)
    assert (low, high) == pytest.approx((np.mean(draws) - half, np.mean(draws) + half))


def test_single_deviating_start_and_least_band():
    assert wide((3.0, *(1.0,) * 16))[1][3][1] > 3.0
    ends = wide((3.0, *(3.0,) * 16))[1][3]
    assert ends == pytest.approx((3.0 - 1e-3, 3.0 + 1e-3))
    assert wide(TWO_WAYS[:11])[1][3] is None  # too few of the moved starts had a value: half a width, as from four


@pytest.mark.parametrize(
    ("ends", "physics", "hidden"),
    [
        ((0.3, 2.0), "fail", True),  # a third of the distance, and nearer
        ((0.34, 2.0), "fail", False),
        ((-1.0, 3.0), "fail", True),
        ((-1.0, 3.0), "pass", True),
        ((0.5, 2.0), "fail", False),
    ],
)
def test_values_hidden_by_a_band(ends, physics, hidden):
    row = row_of(truth=0.0, tolerance=0.1, value=1.0, physics=physics)
    assert acceptance.hides(row, ends) is hidden
    assert acceptance.hides(replace(row, value=-1.0), (-ends[1], -ends[0])) is hidden


def test_band_that_reaches_the_tolerance_hides_a_pass():
    row = row_of(truth=0.0, tolerance=0.1, value=0.11, physics="fail")
    assert acceptance.hides(row, (0.1, 0.12)) and not acceptance.hides(row, (0.101, 0.12))
    assert not acceptance.hides(replace(row, value=0.09, physics="pass"), (0.08, 0.1))
    assert not acceptance.hides(replace(row, tolerance=None), (0.1, 0.12))


def scattered(*values):
    """Observations of a cell and its moved starts, in the order in which they are asked."""
    ulps = (0, *MOVES, *acceptance.MORE_MOVES)
    return [observed(replace(SLOT, ulp=n), creep=value) for n, value in zip(ulps, values, strict=False)]


def test_further_starts_only_for_hiding_bands_and_once():
    def further(values, about=lambda key: True):
        seen = scattered(*values)
        return acceptance.slots_to_move_further(rows_of("run", seen), "nameless", acceptance.draws_of(seen), about)

    asked = [replace(SLOT, ulp=n) for n in acceptance.MORE_MOVES]
    assert further((0.5, 0.5, 0.5, 0.4, 0.4)) == asked
    assert further((0.5, 0.5, 0.5, 0.49, 0.49)) == []
    assert further((0.5, 0.5, 0.5, 0.4, 0.4), lambda key: False) == []
    assert further(tuple(each / 6.0 for each in TWO_WAYS)) == []  # they have been
    assert further((0.5,)) == []  # their first moves come first


def test_order_of_draws_of_sound_cells():
    seen = scattered(*range(1, 18))
    seen[2] = replace(seen[2], outcome=Outcome.DIVERGED)
    assert acceptance.draws_of(reversed(seen)) == {KEY: (1, 2, *range(4, 18))}
    assert acceptance.draws_of(seen[1:]) == {}


def test_band_that_hides_replaced_when_its_family_is_accepted():
    seen = scattered(*(each / 6.0 for each in TWO_WAYS))
    draws, judged = acceptance.draws_of(seen), rows_of("run", seen)
    old = Finding(FAMILY, 0.5, 0.6)
    proposal = propose(judged, "nameless", listed(FAMILY, creep=old), draws=draws)
    (change,) = proposal.changes
    assert change.asks and list(change.bands) == [KEY] and not change.same and not change.drifted
    assert accepted(proposal, []) == {KEY: old}
    found = accepted(proposal, ["creeps"])[KEY]
    assert found.ends == acceptance.one_more(draws[KEY], 0.0) and found.holds(0.4) and not found.holds(0.1)
    narrow = Finding(FAMILY, 0.5, 0.1)
    assert not propose(judged, "nameless", listed(FAMILY, creep=narrow), draws=draws).changes[0].asks
    assert not propose(judged, "nameless", listed(FAMILY, creep=found), draws=draws).changes[0].asks


def test_moved_starts_of_failing_and_nearly_failing_cells_only():
    cells = [observed(SLOT, creep=0.5), observed(replace(SLOT, dimension=3), creep=0.0)]
    moved = slots_to_move(rows_of("run", cells), "nameless")
    assert moved == [replace(SLOT, ulp=n) for n in MOVES]
    assert slots_to_move(rows(), "nameless") == []  # their scatter is known
    assert slots_to_move(rows_of("run", cells), "another") == []
    assert slots_to_move(rows_of("run", cells), "nameless", lambda key: key[2] == "3") == []


def test_rows_of_other_families_kept_without_moved_starts():
    unmoved = rows(moved=None)
    proposal = propose(unmoved, "nameless", listed(FAMILY, creep=Finding(FAMILY, 0.4, 0.01)), lambda key: False)
    assert not proposal.refused and not any(change.asks for change in proposal.changes)
    assert [finding.value for finding in accepted(proposal, []).values()] == [0.4]


def test_new_row_of_another_family(monkeypatch):
    """Naming one family must not make silence of what the others would have said."""
    proposal = propose(rows(moved=None), "nameless", None, lambda key: False)
    assert [row.metric for row in proposal.left_out] == ["creep"]
    assert not proposal.changes
    law = Deviation(
        "nameless", ("default",), "incline", "creep", lambda scene, dt, measure: (0.4, 0.01), "by design", "manual"
    )
    monkeypatch.setattr("validation.judging.predicting.covering", lambda *where: iter([law]))
    proposal = propose(rows(moved=None), "nameless", None, lambda key: False)
    assert not proposal.left_out
    assert all("predicts another" in why for _, why in proposal.refused) and proposal.refused


def test_rows_told_of_other_families():
    """In the order of the run, whatever stands between; what is asked about afterwards is still proposed."""
    known = {row_key(SLOT, name): Finding(FAMILY, 0.5, 1e-3) for name in ("known", "drifted", "drifted pass")}
    cases = (
        ("passes", {"physics": "pass", "standing": None}, False),
        ("fails", {"physics": "fail", "standing": "new"}, True),
        ("explained", {"physics": "fail", "standing": "explained"}, False),
        ("explodes", {"outcome": "diverged", "value": None, "physics": None, "standing": "new"}, True),
        ("no value", {"value": None, "physics": None, "standing": "new"}, False),
        ("known", {"physics": "fail", "standing": "known"}, False),
        ("drifted", {"physics": "fail", "standing": "drifted"}, True),
        ("drifted pass", {"physics": "pass", "standing": "drifted"}, False),
    )
    run = [row_of(metric=name, **fields) for name, fields, _ in cases]
    proposal = propose([*run, *rows()], "nameless", replace(listed(FAMILY), members=known), lambda key: key == KEY)
    assert [row.metric for row in proposal.left_out] == [name for name, _, told in cases if told]
    assert [list(change.new) for change in proposal.changes] == [[KEY]]


def test_moved_starts_of_rows_after_those_of_other_families():
    steeper = rows(replace(SLOT, params=(("ratio", 0.9),)), moved=None)
    others = [replace(row, engine="another") for row in steeper]
    found = slots_to_move([*others, *steeper, *rows(moved=None)], "nameless", lambda key: key == KEY)
    assert found == [replace(SLOT, ulp=move) for move in MOVES]


def test_moved_starts_of_an_engine_of_singles():
    """Moved by units of doubles they would be the same numbers to it, and nothing would scatter."""
    for engine, kind in (("box2d", np.float32), ("mujoco", np.float64)):
        own = prepare(replace(SLOT, engine=engine)).scene.bodies[1].pose[1]
        moved = [prepare(replace(SLOT, engine=engine, ulp=ulp)).scene.bodies[1].pose[1] for ulp in (1, 2)]
        unit = float(np.spacing(kind(own)))
        assert np.round((np.array(moved) - own) / unit).tolist() == [1.0, 2.0]
        assert all(float(kind(place)) == place for place in moved)


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


def test_check_of_a_row_as_it_was_judged():
    (row,) = rows()
    assert acceptance._check(row) == Check("creep", "m/s", 0.0, row.tolerance, row.because, row.source)
    assert row.tolerance == pytest.approx(TOLERANCE)


# ---- what a proposal holds, in full --------------------------------------------------------------------------------


def test_draft_with_profile_scene_metric_kind_and_release():
    (row,) = rows(version="3.2.7+5f3a")
    draft = acceptance._draft(replace(row, metric="interface_impulse[3]", scene="stack"))
    assert draft == Family(
        "default-stack-interface-impulse", ("default",), "stack", ("interface_impulse",), "", "", "==3.2.*"
    )


@pytest.mark.parametrize(
    ("version", "releases"), [("4.1+5f3a", "==4.1.*"), ("7", "==7.*"), ("0.1.0+cbe56602", "==0.1.*")]
)
def test_release_of_a_draft(version, releases):
    assert acceptance._draft(rows(version=version)[0]).releases == releases


def test_proposal_of_one_engine_with_listed_and_found_values():
    old = Finding(FAMILY, 0.51, 1e-3)
    drifted = propose(rows(), "nameless", listed(FAMILY, creep=old))
    assert drifted.engine == "nameless"
    assert drifted.changes[0].drifted == {KEY: (old, Finding(FAMILY, 0.5, pytest.approx(4e-3)))}
    gone = propose(rows(creep=0.0), "nameless", listed(FAMILY, creep=old))
    assert gone.changes[0].gone == {KEY: old}
    other = row_key(SLOT, "slides")
    findings = Findings("nameless", {"creeps": replace(FAMILY, metrics=("*",))}, (), {other: old})
    assert propose(rows(creep=0.0), "nameless", findings).changes[0].gone == {other: old}


NONE, EXPLODED = Finding(FAMILY, None), Finding(FAMILY, None, diverged=True)


@pytest.mark.parametrize(
    ("old", "found"),
    [
        (NONE, {"outcome": Outcome.DIVERGED, "creep": None, "moved": 0.0}),
        (EXPLODED, {"creep": None, "moved": 0.0}),
        (EXPLODED, {}),
        (NONE, {}),
        (Finding(FAMILY, 0.5, 1e-3), {"creep": None, "moved": 0.0}),
        (Finding(FAMILY, 0.5, 1e-3), {"outcome": Outcome.DIVERGED, "creep": None, "moved": 0.0}),
    ],
)
def test_value_that_appears_vanishes_or_explodes_has_drifted(old, found):
    (change,) = propose(rows(**found), "nameless", listed(FAMILY, creep=old)).changes
    ((before, now),) = change.drifted.values()
    assert before == old and (now.value is None, now.diverged) != (old.value is None, old.diverged)
    assert not change.same and not change.new


@pytest.mark.parametrize(("old", "found"), [(NONE, {"creep": None}), (EXPLODED, {"outcome": Outcome.DIVERGED})])
def test_missing_and_exploded_values_that_stay_unchanged(old, found):
    found = {"creep": None, "moved": 0.0, **found}
    (change,) = propose(rows(**found), "nameless", listed(FAMILY, creep=old)).changes
    assert change.same == {KEY: old} and not change.asks


@pytest.mark.parametrize(("value", "same"), [(0.625, True), (0.6251, False)])
def test_row_at_the_edge_of_its_band_unchanged(value, same):
    old = Finding(FAMILY, 0.5, 0.125)
    (change,) = propose(rows(creep=value), "nameless", listed(FAMILY, creep=old)).changes
    assert (change.same == {KEY: old}, KEY in change.drifted) == (same, not same)


def test_rows_after_rows_without_a_message():
    silent = rows(replace(SLOT, dimension=3), outcome=Outcome.CRASHED)
    foreign = rows(replace(SLOT, engine="another"))
    outside = rows(replace(SLOT, dt=1 / 1000))
    proposal = propose([*foreign, *outside, *silent, *rows()], "nameless", listed(FAMILY))
    assert list(proposal.changes[0].new) == [KEY] and len(proposal.changes) == 1


@pytest.mark.parametrize("slot", [replace(SLOT, engine="another"), replace(SLOT, dt=1 / 1000)])
def test_no_proposal_from_another_engine_or_suite(slot):
    assert not propose(rows(slot), "nameless", listed(FAMILY)).changes[0].asks


def test_listed_row_stays_with_its_family():
    second = replace(FAMILY, id="second", reason="another mechanism")
    old = Finding(second, 0.5, 1e-3)
    first, other = propose(rows(), "nameless", listed(FAMILY, second, creep=old)).changes
    assert (first.same, other.same) == ({}, {KEY: old})


def row_of(**fields):
    (row,) = rows()
    return replace(row, **fields)


@pytest.mark.parametrize(
    ("fields", "entry"),
    [
        # 0.0625 off and 0.0625 of scatter: within a tolerance of 0.125, to the last bit
        ({"value": 1.0625, "physics": "pass", "floor": 0.0625}, ("", None)),
        ({"value": 1.0625, "physics": "pass", "floor": 0.063}, ("", (1.0625, 0.252, False, None))),
        ({"value": 0.9375, "physics": "pass", "floor": 0.063}, ("", (0.9375, 0.252, False, None))),
        ({"value": 1.0624, "physics": "pass", "floor": 1.0}, ("", None)),
        ({"tolerance": None, "physics": None}, ("", None)),
        ({"truth": None, "physics": None}, ("", None)),
        ({"standing": "explained"}, ("", None)),
        ({"value": None, "physics": None}, ("", (None, 0.0, False, None))),
        ({"outcome": "diverged", "value": None}, ("", (None, 0.0, True, None))),
        ({"floor": None}, ("its scatter is unknown: the case was not run from moved starts", None)),
        ({"engine": "reference", "profile": "reference"},
         ("its profile is exact: a failure there must be fixed, not listed", None)),
    ],
)  # fmt: skip
def test_listing_or_refusal_of_a_row(fields, entry):
    given = {"truth": 1.0, "tolerance": 0.125, "value": 1.5, "physics": "fail", "floor": 0.0}
    why, found = acceptance._entry(row_of(**{**given, **fields}))
    assert why == entry[0]
    if entry[1] is None or entry[1][0] is None:
        assert found == entry[1]
    else:
        assert found == (entry[1][0], pytest.approx(entry[1][1], rel=1e-12), *entry[1][2:])


def test_the_reasons_of_refusals_in_full(monkeypatch):
    ((_, why),) = propose(rows(outcome=Outcome.INVALID), "nameless", listed(FAMILY)).refused
    assert why == "invalid: "
    ((_, why),) = propose(rows(version="2.0"), "nameless", listed(FAMILY)).refused
    assert why == "family creeps holds for >=1,<2, not for 2.0"
    law = Deviation(
        "nameless", ("default",), "incline", "creep", lambda scene, dt, measure: (0.4, 0.01), "by design", "manual"
    )
    monkeypatch.setattr("validation.judging.predicting.covering", lambda *where: iter([law]))
    ((_, why),) = propose(rows(), "nameless", listed(FAMILY)).refused
    assert why == "a contact law predicts another value: the law or the engine has changed"


def test_scatter_and_band_of_a_study():
    study = CATALOGUE["incline"].studies[0]
    why, (value, width, *_) = acceptance._entry(row_of(metric=study.name, floor=None, truth=1.0, tolerance=0.125))
    assert (why, value, width) == ("", 0.5, pytest.approx(0.00125))


@pytest.mark.parametrize(
    ("fields", "moved"),
    [
        ({}, True),
        ({"value": 0.75 * TOLERANCE, "physics": "pass"}, True),
        ({"value": 0.25 * TOLERANCE, "physics": "pass"}, False),
        ({"outcome": "invalid", "physics": None, "value": 0.75 * TOLERANCE}, False),
        ({"outcome": "diverged", "value": None}, False),
        ({"value": None, "physics": None}, False),
        ({"standing": "explained"}, False),
        ({"engine": "reference", "profile": "reference"}, False),
        ({"floor": 0.0}, False),
    ],
)
def test_which_rows_are_run_again_from_moved_starts(fields, moved):
    row = row_of(**{"floor": None, **fields})
    assert bool(slots_to_move([row], row.engine)) is moved


def test_number_of_starts_of_bands():
    """Twelve to sixteen moved starts that left a value; what nobody asked for, more of them, is a half width again."""
    truth, all_of = 0.0, (*TWO_WAYS, 2.5)
    for number in range(2, 19):
        draws = all_of[:number]
        row, (value, width, diverged, ends) = wide(draws)
        assert (value, diverged) == (3.0, False)
        if 13 <= number <= 17:
            assert width == 0.0 and ends == acceptance._ends(row, draws) == acceptance.one_more(draws, truth)
        else:
            assert ends is None and acceptance._ends(row, draws) == (3.0 - width, 3.0 + width)


@pytest.mark.parametrize(
    ("draws", "floor", "scatter"),
    [
        ((), 0.25, 0.25), ((2.0,), 0.25, 0.25), ((2.0,), None, 0.0),
        ((2.0, 2.5), 0.25, 0.5), ((2.0, 2.0), 0.25, 0.0), ((2.0, 1.0, 2.5), None, 1.0),
        ((2.0, 2.0, 2.0, 2.0, 2.125, 9.0), 0.25, 0.125),  # the sixth was moved further, for another row
    ],
)  # fmt: skip
def test_half_width_of_a_band(draws, floor, scatter):
    row = row_of(value=2.0, truth=1.0, tolerance=0.0, floor=floor)
    assert acceptance._width(row, draws) == max(4.0 * scatter, 2e-6)


def test_zero_values_and_tolerances():
    """A law that is exact has a tolerance of 0, and what stands still a value of 0: no band is made of either."""
    still = row_of(value=0.0, truth=1.0, tolerance=0.0, floor=0.0)
    assert acceptance._width(still, ()) == 0.0 and acceptance._ends(still, (0.0,)) == (0.0, 0.0)
    draws = (0.0,) * 17
    assert acceptance._ends(still, draws) == pytest.approx((0.0, 0.0), abs=1e-12)
    tolerant = row_of(value=0.0, truth=1.0, tolerance=0.5, floor=0.0)
    assert acceptance._ends(tolerant, draws) == pytest.approx((-0.005, 0.005), abs=1e-12)


def test_nan_not_counted_as_a_start():
    for value in (None, math.nan, math.inf):
        seen = [observed(SLOT, creep=0.5), observed(replace(SLOT, ulp=1), creep=value)]
        assert acceptance.draws_of(seen) == {KEY: (0.5,)}


def test_distances_from_a_truth_of_any_value():
    near, far = acceptance.one_more(TWO_WAYS, 0.0)
    for shift in (-10.0, 10.0):
        moved = tuple(each + shift for each in TWO_WAYS)
        assert acceptance.one_more(moved, shift) == pytest.approx((near + shift, far + shift))
    assert acceptance.one_more((3.0, *(0.0, 1.0) * 8), 0.0)[0] < 0.0  # what lies on the truth has no logarithm
    row = row_of(truth=10.0, tolerance=0.1, value=11.0, physics="fail")
    assert acceptance.hides(row, (10.3, 12.0)) and not acceptance.hides(row, (10.4, 12.0))
    assert not acceptance.hides(row, (10.9, 11.1)) and acceptance.hides(row, (9.0, 11.0))
    for missing in ("value", "truth", "tolerance"):
        assert not acceptance.hides(replace(row, **{missing: None}), (10.3, 12.0))
    exact = row_of(truth=10.0, tolerance=0.1, value=10.0, physics="pass")
    assert acceptance.hides(exact, (9.99, 10.01)) and not acceptance.hides(exact, (10.01, 10.02))


def test_band_about_a_listed_value_of_zero():
    row = row_of(truth=0.4, tolerance=0.01, value=0.1, physics="fail")
    found = Finding(FAMILY, 0.1, ends=(0.05, 0.2))
    for band_of_it, asks in ((0.38, True), (0.2, False)):
        change, old = acceptance.Change(FAMILY), Finding(FAMILY, 0.0, band_of_it)
        acceptance._place(change, KEY, found, {KEY: old}, row)
        assert (change.bands, change.same) == (({KEY: (old, found)}, {}) if asks else ({}, {KEY: old}))


def test_rows_moved_further_and_rows_without_starts_told_apart():
    judged = rows(moved=0.2)
    asked = [replace(SLOT, ulp=n) for n in acceptance.MORE_MOVES]
    assert acceptance.slots_to_move_further(judged, "nameless", {}) == asked  # by the floor that they have
    for number, more in ((5, asked), (6, [])):
        draws = {KEY: (0.5, 0.5, 0.5, 0.4, 0.4, 0.5)[:number]}
        assert acceptance.slots_to_move_further(judged, "nameless", draws) == more
