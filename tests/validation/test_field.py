"""Field notes: complete, sourced, and true on the engines that are installed."""

import re

import pytest
from click.testing import CliRunner

from adapters.registry import find
from reports.command import main
from validation.cells import Observation, Outcome
from validation.field import ABSENT, CURED, NOT_SEEN, REPRODUCED, Finding, Note, ask, matching, notes
from validation.posed import resolve
from validation.settings.switching import readings

HERE = [note for note in notes() if find(note.engine).engine is not None]


def test_twenty_field_notes_with_source_symptom_and_check():
    assert len(notes()) >= 20 and len({note.source for note in notes()}) == len(notes())
    for note in notes():
        assert re.fullmatch(r"[\w.-]+/[\w.-]+#\d+", note.source)
        assert 20 < len(note.symptom) < 160 and note.said in (REPRODUCED, NOT_SEEN, CURED)
        canonical = resolve(note.scene)
        scene = canonical.scene(note.dimension, dict(note.slot.params))
        assert note.metric in {check.metric for check in canonical.checks(scene, note.dt) if check.bound is not None}
        assert note.cure or note.said != CURED


@pytest.mark.long
def test_field_notes_against_our_run():
    """All cells of all notes: 5 s of CPU."""
    if not HERE:
        pytest.skip("none of the engines that the notes ask is installed")
    found = ask(notes())
    assert [(each.note.source, each.now) for each in found if not each.as_said] == []
    assert {each.now for each in found if each.note not in HERE} <= {ABSENT}


def observed(slot, value):
    """An answer of which every check has this error over its tolerance."""
    blank = Observation(slot, "c", 1, "1", Outcome.OK)
    metrics = {r.check.metric: (r.check.truth + value * r.check.bound, "") for r in readings(blank)}
    return Observation(slot, "c", 1, "1", Outcome.OK, metrics=metrics)


@pytest.mark.parametrize(
    ("before", "after", "says"),
    [(3.0, 0.5, CURED), (3.0, 2.0, REPRODUCED), (1.1, 1.1, REPRODUCED), (0.5, 0.5, NOT_SEEN), (0.5, 3.0, NOT_SEEN)],
)
def test_field_note_verdict_with_and_without_the_cure(monkeypatch, before, after, says):
    from validation import field

    monkeypatch.setattr(field, "find", lambda name: type("Found", (), {"engine": object()}))
    monkeypatch.setattr(
        field, "observe", lambda slots, jobs: {s: observed(s, after if s.switched else before) for s in slots}
    )
    note = Note("a/b#1", "toy", "it creeps", "toy", "default", "pinch", "creep", CURED, cure={"cone": "elliptic"})
    (found,) = ask([note])
    assert found.now == says and found.as_said is (says == CURED)


def test_field_note_of_an_absent_engine_unchanged(monkeypatch):
    from validation import field

    monkeypatch.setattr(field, "find", lambda name: type("Found", (), {"engine": None}))
    note = Note("a/b#1", "toy", "it creeps", "toy", "default", "pinch", "creep", CURED)
    (found,) = ask([note])
    assert found.now == ABSENT and found.as_said


def test_notes_are_chosen_by_words():
    assert {note.source for note in matching(["pymunk"])} == {"viblo/pymunk#231"}
    assert len(matching(["mujoco"])) >= 8 and matching([]) == list(notes())


def test_source_numbers_at_80_columns(monkeypatch):
    """Folded by the width alone, 3328 was shown as 33 and 28."""
    found = [Finding(note, note.said) for note in notes()]
    monkeypatch.setattr("reports.command.fielding.ask", lambda notes, jobs: found)
    shown = CliRunner(env={"COLUMNS": "80"}).invoke(main, ["field"]).stdout
    assert max(map(len, shown.splitlines())) <= 80
    words = shown.split()
    for note in notes():
        assert note.source in words or note.source.partition("/")[2] in words
