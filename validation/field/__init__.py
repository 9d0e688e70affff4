"""Known reports: public questions and reports, each with a cell that shows it, and the result of our run.

``notes.toml`` has the reports: repository and number as source, the symptom in our words, the cell and check that show
it, and the fix. ``said`` is the result of a run, which a test keeps up to date:

    reproduced       the check fails
    not seen         it passes on the installed release
    cured            it fails, and passes with the cure

A report about an engine that is not among ours (``about``) runs on one of ours with the same or another approach, which
the note names.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from importlib.resources import files
from typing import Any

from adapters.registry import find
from adapters.settings import text_of
from validation.cells import Slot, parse_dt
from validation.posed import resolve
from validation.running.plan import QUICK_DT
from validation.settings.switching import Reading, observe, reading, switched

#: Results of a run for a note.
REPRODUCED, NOT_SEEN, CURED = "reproduced", "not seen", "cured"
ABSENT = "not installed"


@dataclass(frozen=True, eq=False)
class Note:
    """One public question or report.

    Parameters
    ----------
    source
        ``owner/repository#number``.
    about
        Engine of the report.
    symptom
        What was seen, in our words.
    engine, profile, scene, dimension, params, dt, metric
        The check that shows it.
    cure
        Settings that fix it (``profile`` means all of that profile's); empty if none are known.
    said
        Result of a run: `REPRODUCED`, `NOT_SEEN` or `CURED`.
    """

    source: str
    about: str
    symptom: str
    engine: str
    profile: str
    scene: str
    metric: str
    said: str
    dimension: int = 2
    params: Mapping[str, float] = field(default_factory=dict)
    dt: float = QUICK_DT
    cure: Mapping[str, Any] = field(default_factory=dict)

    @property
    def slot(self) -> Slot:
        """The cell that shows it."""
        params = resolve(self.scene).minimal(self.params)
        return Slot(self.scene, params, self.dimension, self.engine, self.profile, self.dt)

    @property
    def cured_slot(self) -> Slot | None:
        """The cell with the fix."""
        if not self.cure:
            return None
        settings = {name: tuple(v) if isinstance(v, list) else v for name, v in self.cure.items() if name != "profile"}
        profile = str(self.cure.get("profile", self.profile))
        return switched(replace(self.slot, profile=profile), settings)

    @property
    def cure_text(self) -> str:
        """The fix in words."""
        words = [f"profile {v}" if name == "profile" else f"{name}={text_of(v)}" for name, v in self.cure.items()]
        return ", ".join(words)


@dataclass(frozen=True)
class Finding:
    """Result of a run for a note; ``now`` is empty for an engine that is not installed."""

    note: Note
    now: str
    before: Reading | None = None
    after: Reading | None = None

    @property
    def as_said(self) -> bool:
        """Whether the note is still true, as far as it can run here."""
        return self.now in (ABSENT, self.note.said)


@cache
def notes() -> tuple[Note, ...]:
    """All notes, in their order.

    Raises
    ------
    KeyError, TypeError, ValueError
        If the file is not one of notes.
    """
    data = tomllib.loads(files(__name__).joinpath("notes.toml").read_text(encoding="utf-8"))
    return tuple(_note(raw) for raw in data["note"])


def _note(raw: Mapping[str, Any]) -> Note:
    values = dict(raw)
    if "dt" in values:
        values["dt"] = parse_dt(str(values["dt"]))
    return Note(**values)


def ask(chosen: Iterable[Note], jobs: int = 1) -> list[Finding]:
    """Run the cells of some notes, each once."""
    chosen = list(chosen)
    here = [note for note in chosen if find(note.engine).engine is not None]
    slots = [slot for note in here for slot in (note.slot, note.cured_slot) if slot is not None]
    seen = observe(slots, jobs)
    return [_finding(note, seen) if note in here else Finding(note, ABSENT) for note in chosen]


def _finding(note: Note, seen: Mapping[Slot, Any]) -> Finding:
    before = reading(seen[note.slot], note.metric)
    cured = note.cured_slot
    after = reading(seen[cured], note.metric) if cured is not None else None
    if before.badness <= 1.0:
        return Finding(note, NOT_SEEN, before, after)
    mended = after is not None and after.value is not None and after.badness <= 1.0
    return Finding(note, CURED if mended else REPRODUCED, before, after)


def matching(words: Sequence[str]) -> list[Note]:
    """Notes whose source, engines or scene contain one of the words; all if none is given."""
    texts = {note: f"{note.source} {note.about} {note.engine} {note.scene}".lower() for note in notes()}
    return [note for note, text in texts.items() if not words or any(word.lower() in text for word in words)]
