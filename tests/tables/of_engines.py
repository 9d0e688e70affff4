"""Tables of our engines' adapters: settings of every profile for what scenes need, and what it declares of them.

Nothing is built or stepped.
"""

from __future__ import annotations

from itertools import islice

from of_scenes import cells
from telling import Sections, section

from adapters.engine import Engine, EngineError
from adapters.needs import needs
from adapters.scene import Scene
from adapters.stepping import posed_for
from validation.catalogue import CATALOGUE

DT = 1 / 240
#: Cells of each scene in each dimension.
CELLS = 2


def posed(engine: Engine, scene: Scene, profile: str) -> Scene | str:
    """The scene as the engine gets it, or why it does not."""
    try:
        own = posed_for(engine, scene)
    except EngineError as error:
        return str(error)
    return engine.refuses(own, profile) or own


def settings_table(engine: Engine, profile: str) -> Sections:
    """Every set of settings that a profile makes with what it declares, once; which scenes get which; all reasons."""
    sets, given, reasons = list[dict[str, str]](), dict[str, str](), dict[str, dict[str, None]]()
    for name, canonical in CATALOGUE.items():
        for dimension in canonical.dimensions:
            own = dict[str, None]()
            for _, _, params in islice((cell for cell in cells(canonical, "standard") if cell[1] == dimension), CELLS):
                scene = canonical.scene(dimension, params)
                if isinstance(refused := posed(engine, scene, profile), str):
                    own[f"refused: {refused}"] = None
                    continue
                what = needs(scene)
                told = engine.settings(profile, what, DT)
                values = {each.name: each.value for each in told}
                lines = section(settings=values, declares=engine.declares(profile, what, DT))
                if lines not in sets:
                    sets.append(lines)
                own[f"settings {1 + sets.index(lines)}"] = None
                for each in told:
                    reasons.setdefault(each.name, {})[f"{each.because} ({each.source})"] = None
            given[f"{name} {dimension}-D"] = "; ".join(own)
    found: Sections = {f"settings {k}": own for k, own in enumerate(sets, 1)}
    found["scenes"] = given
    found["reasons"] = section(because={name: list(said) for name, said in reasons.items()})
    return found
