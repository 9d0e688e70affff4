"""All tables by name, and what makes each."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import of_engines
import of_laws
import of_motions
import of_scenes
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


def of_installed() -> Makers:
    """Tables that ask an engine, of those that are installed."""
    return {
        f"settings/{name}-{profile}": partial(of_engines.settings_table, engine, profile)
        for name in of_laws.ENGINES
        if (engine := find(name).engine) is not None
        for profile in engine.profiles
    }


def tables() -> Makers:
    """All of them that can be made here."""
    return SCENES | MOTIONS | LAWS | of_installed()
