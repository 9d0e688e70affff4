"""Finds the scene that shows a symptom: a user's words in scenes and known reports."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass

from validation.catalogue import CATALOGUE
from validation.field import Note, notes

#: Words without meaning for contact.
IDLE = frozenset(re.findall(r"\w+", """
    a after an and are as at be before by can cant do does doesnt dont every for from get gets go goes have how i in is
    isnt it its just keep my not object of off on one or should so some than that the them they thing this to too up we
    what when which while why with wont
"""))  # fmt: skip
ENDINGS = re.compile(r"(?:ions?|ing|ed|es|er|s|e|y)$")
#: Symptoms that no scene shows, with the command that helps.
COMMANDS = {
    "results changed with a release, version, upgrade or update of the engine":
        "crosscheck bisect ENGINE OLD..NEW SCENE names the release that changed them",
    "the simulation or sim is slow, too expensive, costs too much time, speed":
        "crosscheck bench SCENE shows error against time",
}  # fmt: skip


@dataclass(frozen=True)
class Match:
    """A scene that shows a symptom.

    Parameters
    ----------
    scene
        Its name; empty for a symptom that no scene shows.
    score
        Sum of the weights of the words found; rarer words weigh more.
    words
        Words of the question that were found.
    report
        Known report about the scene with most of these words, if any.
    command
        Command that helps where no scene shows it.
    """

    scene: str
    score: float
    words: tuple[str, ...]
    report: Note | None = None
    command: str = ""


def stem(word: str) -> str:
    """Return a word without its ending: ``slips``, ``slipping`` and ``slip`` are one."""
    for _ in range(2):
        shorter = ENDINGS.sub("", word)
        word = shorter if len(shorter) >= 3 else word
        word = word[:-1] if len(word) > 3 and word[-1] == word[-2] else word
    return word


def stems(text: str) -> dict[str, str]:
    """Meaningful words of a text, by their stem."""
    words = re.findall(r"[a-z0-9#]+", re.sub("['\N{RIGHT SINGLE QUOTATION MARK}]", "", text.lower()))
    return {stem(word): word for word in words if word not in IDLE}


def matches(words: str, engines: Sequence[str] = ()) -> list[Match]:
    """Scenes that show a symptom, the best first.

    Parameters
    ----------
    words
        A user's words, or the end of the source of a known report (``repository#number``).
    engines
        Engines in the question: reports about others count less.

    Notes
    -----
    A word weighs ``log(1 + scenes / scenes that have it)`` (inverse document frequency, Spärck Jones 1972).
    """
    asked = stems(words)
    reports = {name: [note for note in notes() if note.scene == name] for name in CATALOGUE}
    told = {note: stems(note.symptom).keys() for note in notes()}
    own = {name: [stems(text).keys() for text in (name, scene.title, *scene.symptoms)]
           for name, scene in CATALOGUE.items()}  # fmt: skip
    own |= {text: [stems(text).keys()] for text in COMMANDS}
    known = {name: set().union(*own[name], *(told[note] for note in reports.get(name, ()))) for name in own}
    weight = {word: math.log(1 + len(known) / max(1, sum(word in has for has in known.values()))) for word in asked}
    found = []
    for name, has in known.items():
        common = asked.keys() & has
        close = max(len(asked.keys() & one) for one in own[name])  # words of one sentence count once more
        near = sorted(
            reports.get(name, ()), key=lambda note: (note.about not in engines, -len(asked.keys() & told[note]))
        )
        named = [note for note in near if "#" in words and note.source.lower().endswith(words.lower().strip())]
        report = next((note for note in named or near if named or asked.keys() & told[note]), None)
        if common or named:
            score = math.inf if named else sum(weight[word] for word in common) + close
            said = tuple(asked[word] for word in asked if word in common)
            scene = name if name in CATALOGUE else ""
            found.append(Match(scene, score, said, report, COMMANDS.get(name, "")))
    return sorted(found, key=lambda match: (-match.score, bool(match.scene)))
