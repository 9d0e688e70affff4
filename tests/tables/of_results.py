"""Tables of how results are told that take an engine to find: experiments, cures, frontiers, relations, field notes.

The results are made up, or are those that are kept; what tells them is the commands' own.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from unittest.mock import patch

from of_print import folder, numbered, on, screen
from rich.console import Console
from telling import Sections

from reports import history as written
from reports import releases as shown
from reports.command import asking, curing, driving, posing, proving, weighing
from reports.command.posing import Judged
from reports.dashboard.series import panels
from validation.canonical import Check
from validation.cells import Slot
from validation.field import Finding, notes
from validation.judging.verdicts import Standing
from validation.questions import frontier
from validation.questions.invariance import RELATIONS, Change
from validation.questions.residuals import LAWS, Residuals
from validation.records.store import Store
from validation.releases import history
from validation.settings.cures import Unsearched, cures_of
from validation.settings.proofs import Proof, experiments_on, slot_of
from validation.settings.switching import Reading

CHECK = Check("m", "m/s", 0.8, 0.1, "because", "source")


def printed(show: Callable[[Console], object], width: int = 110) -> dict[str, str]:
    """What is printed to a console of its own."""
    console = screen(width)
    show(console)
    return on(console)


def told(data: object) -> dict[str, str]:
    """Data as JSON, line by line."""
    return numbered(json.dumps(data, indent=1, default=str), "data")


def proofs() -> Sections:
    """Experiments that hold, and that fail in each of the ways in which one can."""
    found = Sections()
    for engine in ("chipmunk", "bullet", "mujoco"):
        experiment = next(each for each in experiments_on(engine) if each.idle)
        slot = slot_of(engine, experiment)
        fails, passes = Reading(slot, CHECK, 0.5, ""), Reading(slot, CHECK, 0.81, "")
        nothing = Reading(slot, CHECK, None, "the body left")
        for name, (before, after, idle) in {
            "holds": (fails, passes, fails), "passes": (passes, passes, fails), "fails": (fails, fails, passes),
            "nothing": (fails, nothing, nothing),
        }.items():  # fmt: skip
            proof = Proof(engine, experiment, before, after, (idle,) * len(experiment.idle))
            found[f"{engine} {name}"] = {f"line {k}": str(line) for k, line in enumerate(proving.lines(proof))}
            found[f"{engine} {name}"] |= told(proving._plain(proof))
    return found


def cures() -> Sections:
    """Every fifth cure that is kept, and why there is none."""
    found = Sections()
    for engine in ("chipmunk", "bullet", "mujoco"):
        for (scene, dimension), cure in list(cures_of(engine).items())[::5]:
            found[f"{engine} {scene} {dimension} axes"] = printed(
                lambda console, args=(engine, scene, dimension, cure): curing._show(*args, console)
            )
    for asked in (True, False):
        none = Unsearched(asked=asked, reason="it says so")
        found[f"asked: {asked}"] = printed(lambda console, none=none: curing._show("toy", "stack", 2, none, console))
    return found


def frontiers() -> Sections:
    """Brackets that are closed, half open and refused, with and without their commands."""
    found = []
    for k, bracket in enumerate(frontier.brackets([], ["mujoco"], [], [], True)):
        each = bracket.frontier
        if k % 4 < 3:
            bracket.survives = frontier.End(each.easy, frontier.slot_at(bracket, each.easy), "")
        if k % 4 in (1, 2):
            bracket.fails = frontier.End(each.hard, frontier.slot_at(bracket, each.hard), "fell")
        if k % 4 == 3:
            bracket.refused = "it has none of these"
        bracket.cells = k
        found.append(bracket)
    out = {
        f"commands: {commands}": printed(lambda console, c=commands: driving._show(found, c, console))
        for commands in (True, False)
    }
    return out | {"data": told([driving._as_plain(each) for each in found])}


def relations() -> Sections:
    """Answers that depend on nothing, on what they must not, and engines that have none."""
    changes = [
        Change("again"), Change("mirrored", "drift", 1e-3, 1e-6), Change("moved", refused="it crashed", lost=True),
        Change("boosted", refused="something is fixed"), Change("turned 90", "drift", 1e-9, 1e-6),
    ]  # fmt: skip
    standings = (None, Standing.NEW, Standing.KNOWN, None, Standing.DRIFTED)
    judged = [
        Judged(change, standing, "a reason" if standing else "")
        for change, standing in zip(changes, standings, strict=True)
    ]
    none = [Judged(Change(each.name, refused="it is planar"), None, "") for each in RELATIONS]
    slots = [Slot("stack", (("n", 2.0),), 2, engine, "tuned", 1 / 240) for engine in ("chipmunk", "mujoco")]
    found = [(slots[0], judged), (slots[1], none), (Slot("impact", (), 3, "mujoco", "tuned", 1 / 240), judged[:1])]
    return {
        "text": printed(lambda console: posing._show(found, console)),
        "data": told([posing._plain(slot, own) for slot, own in found]),
    }


def field_notes() -> Sections:
    """Public questions as they are told: as said, otherwise, cured, without an answer."""
    found = []
    for k, note in enumerate(notes()):
        before = Reading(note.slot, CHECK, (0.5, None)[k % 4 == 3], "no answer" if k % 4 == 3 else "")
        after = Reading(note.slot, CHECK, 0.81, "") if k % 2 else None
        found.append(Finding(note, note.said if k % 3 else "not seen", before, after))
    out = Sections()
    for commands in (True, False):
        console = screen(120)
        with patch.object(asking, "terminal", lambda console=console: console):
            asking._show(found, commands)
        out[f"commands: {commands}"] = on(console)
    return out | {"data": told([asking._as_plain(each) for each in found])}


def laws_of_contact() -> Sections:
    """Residuals of contacts, and why there are none."""
    slots = [Slot("stack", (("n", 2.0),), 2, engine, "tuned", 1 / 240) for engine in ("chipmunk", "mujoco")]
    some = {name: (10.0**-k, "") for k, name in enumerate(LAWS)}
    none = dict.fromkeys(LAWS, (None, "nothing touched"))
    console = screen(120)
    with patch.object(weighing, "terminal", lambda: console):
        weighing._show([Residuals(slots[0], some, 7), Residuals(slots[1], none)])
    return {"text": on(console)}


def releases() -> Sections:
    """A history over releases: on the terminal, as Markdown, as data, as the page of it; what is kept of it."""
    store = Store(folder(), create=False)
    try:
        own = history.told(store, "mujoco")
        steps = history.steps(own)
        kept = [(panel.name, panel.over, len(panel.points)) for panel in panels(store, folder())]
        return {
            "text": printed(lambda console: shown.as_text(own, steps, console)),
            "markdown": numbered(shown.as_markdown(own, steps), "line"),
            "data": numbered(shown.as_json(own, steps), "line"),
            "page": numbered(written.page(store), "line"),
            "panels": {f"{k:03d}": str(panel) for k, panel in enumerate(kept)},
        }
    finally:
        store.close()


MAKERS: dict[str, Callable[[], Sections]] = {
    "results/proofs": proofs, "results/cures": cures, "results/frontiers": frontiers, "results/relations": relations,
    "results/field": field_notes, "results/residuals": laws_of_contact, "results/releases": releases,
}  # fmt: skip
