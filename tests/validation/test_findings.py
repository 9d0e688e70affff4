"""The lists of known findings: every row has a reason with a source, and lists are written only with reasons."""

from dataclasses import replace

import pytest

from validation import findings
from validation.acceptance import accept
from validation.cells import Observation, Outcome, Slot
from validation.rows import rows_of

ENGINES = ("reference", "chipmunk", "bullet", "mujoco")
SLOT = Slot("incline", (("ratio", 0.99),), 2, "mujoco", "default", 1 / 240)


def observed(slot, **metrics):
    values = {name: (value, "") for name, value in metrics.items()}
    return Observation(slot, "cell", 1, "0", Outcome.OK, metrics=values)


@pytest.mark.parametrize("engine", ENGINES)
def test_every_listed_row_is_covered_by_the_reason_it_names(engine):
    for key, finding in (findings.listed(engine) or {}).items():
        assert finding.reason.covers(engine, key), key
        assert finding.status in ("known", "marginal")


def test_every_reason_has_a_text_and_a_source():
    for reason in findings.reasons().values():
        assert len(reason.text) > 20
        assert reason.source
        assert reason.engine in ENGINES


def test_a_fail_without_a_written_reason_is_refused(tmp_path):
    slot = replace(SLOT, engine="nameless")
    rows = rows_of("run", [observed(slot, creep=1.0)])
    counts, unexplained = accept(rows, ["nameless"], tmp_path)
    assert counts == {"nameless": 0}
    assert [row.metric for row in unexplained] == ["creep"]


@pytest.fixture
def listing(tmp_path, monkeypatch):
    """Lists live in an empty folder, and one reason covers everything of the engine `nameless`."""
    reason = findings.Reason("why", "a long enough text", "manual", "nameless", "*", "*", "*")
    monkeypatch.setattr(findings, "reasons", lambda: {"why": reason})
    monkeypatch.setattr(findings, "files", lambda name: tmp_path)
    findings.listed.cache_clear()
    yield
    findings.listed.cache_clear()


def test_a_listed_row_is_known_and_keeps_its_fail(tmp_path, listing):
    slot = replace(SLOT, engine="nameless")
    assert [(r.physics, r.standing) for r in rows_of("run", [observed(slot, creep=1.0)])] == [("fail", None)]
    accept(rows_of("run", [observed(slot, creep=1.0)]), ["nameless"], tmp_path)
    (row,) = rows_of("run", [observed(slot, creep=1.0)])
    assert (row.physics, row.standing) == ("fail", "known")
    assert not row.alarming
    (row,) = rows_of("run", [observed(slot, creep=0.0)])
    assert (row.physics, row.standing) == ("pass", "drifted")
    assert row.alarming


def test_rows_of_slots_that_did_not_run_stay_listed(tmp_path, listing):
    first = replace(SLOT, engine="nameless")
    second = replace(first, dimension=3)
    for slot in (first, second):
        accept(rows_of("run", [observed(slot, creep=1.0)]), ["nameless"], tmp_path)
    assert {key[2] for key in findings.listed("nameless")} == {"2", "3"}


def test_outside_the_quick_suite_a_reason_s_pattern_makes_a_fail_known_and_a_pass_nothing_special(tmp_path, listing):
    accept([], ["nameless"], tmp_path)
    slot = replace(SLOT, engine="nameless", dt=1 / 1000)
    assert [(r.physics, r.standing) for r in rows_of("run", [observed(slot, creep=1.0)])] == [("fail", "known")]
    assert [(r.physics, r.standing) for r in rows_of("run", [observed(slot, creep=0.0)])] == [("pass", None)]
    inside = replace(slot, dt=1 / 240)
    assert [(r.physics, r.standing) for r in rows_of("run", [observed(inside, creep=1.0)])] == [("fail", "new")]
