"""Tables of laws: what each law of our engines predicts for cells of its scene; no engine runs."""

from __future__ import annotations

from fnmatch import fnmatchcase
from itertools import islice

import numpy as np
from of_other_worlds import speaks
from of_scenes import cells
from telling import Sections, word

from adapters.engine_folder import laws_of
from validation.catalogue import CATALOGUE

ENGINES = ("reference", "chipmunk", "bullet", "mujoco")
#: Engines that are set apart, whose laws need no engine.
APART = (
    *("box2d", "box2d3", "box3d", "rapier", "dart", "drake", "physx", "motrixsim"),
    *("newton", "newton_kamino", "newton_semi_implicit", "newton_vbd"),
)
#: Engines whose laws are asked in other worlds: ours, and one whose laws are those of all engines of single numbers.
ASKED_ELSEWHERE = (*ENGINES, "box2d")
#: Step of the predictions [s], and cells of a scene in each dimension.
DT, CELLS = 1 / 240, 3


def scenes(engine: str) -> list[str]:
    """Scenes that laws of an engine speak about."""
    return list(dict.fromkeys(law.scene for law in laws_of(engine)))


def table(engine: str, name: str) -> Sections:
    """Predicted values and bands of one scene, and in which other worlds its laws speak."""
    canonical, found = CATALOGUE[name], Sections()
    laws = [law for law in laws_of(engine) if law.scene == name]
    for dimension in canonical.dimensions:
        own = (cell for cell in cells(canonical, "standard") if cell[1] == dimension)
        for title, _, params in islice(own, CELLS):
            scene = canonical.scene(dimension, params)
            found[title] = {}
            stated = {check.metric for check in canonical.checks(scene, DT)}
            for law in laws:
                if not any(fnmatchcase(metric, law.metric) for metric in stated):
                    continue
                with np.errstate(all="ignore"):
                    said = law.says(scene, DT, canonical.measure)
                text = "says nothing" if said is None else f"{word(said[0])} +- {word(said[1])}"
                found[title][f"{'/'.join(law.profiles)} {law.metric}"] = text
    found["beside its cells"] = {
        f"{'/'.join(law.profiles)} {law.metric}": f"{law.because} ({law.source})" for law in laws
    }
    if engine in ASKED_ELSEWHERE:
        found["speaks"] = speaks(engine, name)
    return found
