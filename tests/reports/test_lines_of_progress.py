"""What commands say on the other stream while they work: a faint line for each cell, and what is kept after each."""

import re

import pytest

from reports.command import posing
from validation.cells import Slot
from validation.findings import Family
from validation.judging.verdicts import Standing
from validation.questions.invariance import Change

SLOTS = [Slot("stack", (("n", 2.0),), d, engine, "tuned", 1 / 240) for d in (2, 3) for engine in ("toy[1]", "other")]
BREAK = Change("mirrored", "drift", 1e-3, 1e-6)


@pytest.fixture
def asked(monkeypatch):
    """Cells that were compared: each breaks one relation, which nobody has listed; on a terminal with colours."""
    for name, value in {"FORCE_COLOR": "1", "TERM": "xterm", "COLORTERM": "", "COLUMNS": "100"}.items():
        monkeypatch.setenv(name, value)
    monkeypatch.delenv("NO_COLOR", raising=False)
    slots = []
    monkeypatch.setattr(posing, "compare", lambda slot: (slots.append(slot), [Change("again"), BREAK])[1])
    monkeypatch.setattr(posing, "_judged", lambda slot, change: posing.Judged(change, None, ""))
    return slots


def test_progress_lines_of_a_cell_and_a_break(asked, capsys):
    assert posing.compare_and_show(SLOTS, True) is False and asked == SLOTS
    said = re.sub(r"\x1b\[([0-9;]*)m", r"{\1}", capsys.readouterr().err)
    assert said.splitlines() == [f"{{2}}{s.engine}/tuned stack {s.dimension}-D{{0}}" for s in SLOTS]


def test_breaks_kept_after_every_cell_with_a_family(asked, monkeypatch, capsys, tmp_path):
    written, families = [], {"other": [Family("f-1", ("tuned",), "stack", ("drift",), "", "", "")], "toy[1]": []}
    folders = {"other": tmp_path, "toy[1]": tmp_path}
    monkeypatch.setattr(posing, "findings_folder", folders.get)
    monkeypatch.setattr(posing, "breaks_of", lambda engine: type("Breaks", (), {"families": families[engine]}))
    monkeypatch.setattr(posing, "find", lambda engine: type("Entry", (), {"version": f"{engine} 1.2"}))
    monkeypatch.setattr(posing, "listed", lambda *given: given)
    monkeypatch.setattr(posing, "write", lambda folder, told: written.append((folder, told, len(asked))))
    posing.compare_and_show(SLOTS, True)
    assert written == []
    asked.clear()
    posing.compare_and_show(SLOTS, True, keep=True)
    own = [(k, slot) for k, slot in enumerate(SLOTS, 1) if slot.engine == "other"]
    assert written == [
        (tmp_path, ("other", "other 1.2", [(slot, Change("again")), (slot, BREAK)]), k) for k, slot in own
    ]  # fmt: skip
    folders.clear()
    posing.compare_and_show(SLOTS, True, keep=True)
    assert len(written) == 2


@pytest.mark.parametrize(
    ("change", "standing", "alarms"),
    [
        (Change("again"), None, False), (BREAK, None, True), (BREAK, Standing.KNOWN, False),
        (BREAK, Standing.NEW, True), (Change("again"), Standing.DRIFTED, True), (BREAK, Standing.DRIFTED, True),
    ],
)  # fmt: skip
def test_row_unlike_its_listing_is_an_alarm(change, standing, alarms):
    assert posing.Judged(change, standing, "").alarming == alarms
