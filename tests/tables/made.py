"""All tables by name, and what makes each."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import of_engines
import of_kit
import of_laws
import of_motions
import of_options
import of_other_worlds
import of_print
import of_questions
import of_refusals
import of_results
import of_scenes
import of_shown
from telling import Sections

from adapters.registry import find
from validation.catalogue import CATALOGUE

Makers = dict[str, Callable[[], Sections]]

SCENES: Makers = {f"scenes/{name}": partial(of_scenes.table, name) for name in CATALOGUE}
MOTIONS: Makers = {f"motions/{name}": partial(of_motions.table, name) for name in CATALOGUE}
LAWS: Makers = {
    f"laws/{engine}-{scene}": partial(of_laws.table, engine, scene)
    for engine in of_laws.ENGINES + of_laws.APART
    for scene in of_laws.scenes(engine)
}
KIT: Makers = {
    "kit/scenes": of_kit.table_of_scenes,
    "kit/faults": of_kit.table_of_faults,
    "kit/words": of_kit.table_of_words,
    "kit/probes": of_kit.table_of_probes,
}

QUESTIONS: Makers = {
    **{f"questions/posed-{name}": partial(of_questions.table_of_poses, name) for name in of_questions.POSED},
    "questions/plans": of_questions.table_of_plans,
    "questions/replays": of_questions.table_of_replays,
    "questions/frontiers": of_questions.table_of_frontiers,
    "questions/planted": of_questions.table_of_planted,
    "questions/bench": of_questions.table_of_units,
}
#: Options are told apart from what commands print: no run is kept for them.
OPTIONS: Makers = {"print/options": of_options.table}
PRINTED: Makers = of_print.makers()
#: How the names of those end that are files, pages, or parts of them.
PAGES = ("files", "bench", "frame", "page", "charts", "dashboard")


def of_installed() -> Makers:
    """Tables that ask an engine, of those that are installed."""
    found: Makers = {}
    for name in of_laws.ENGINES:
        if (engine := find(name).engine) is not None:
            for profile in engine.profiles:
                found[f"settings/{name}-{profile}"] = partial(of_engines.settings_table, engine, profile)
                found[f"held/{name}-{profile}"] = partial(of_engines.held_table, engine, profile)
            found[f"scripts/{name}"] = partial(of_refusals.scripts, name)
    return found


def tables() -> Makers:
    """All of them that can be made here."""
    return (
        SCENES
        | MOTIONS
        | LAWS
        | of_other_worlds.MAKERS
        | KIT
        | QUESTIONS
        | OPTIONS
        | PRINTED
        | of_results.MAKERS
        | of_shown.MAKERS
        | of_refusals.MAKERS
        | of_installed()
    )
