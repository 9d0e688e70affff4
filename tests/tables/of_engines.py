"""Tables of our engines' adapters: settings of every profile for what scenes need, what they declare, what is to paste.

Nothing is built or stepped, but for worlds of which what they hold is read back.
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
#: Scenes of which worlds are built: between them every shape, drive and kind of pair; of which settings are to paste.
BUILT = (
    "impact", "stack", "incline", "conveyor", "tumble", "v_groove", "card_tent", "closing_wall", "tilt_table", "scales",
    "pair_matrix", "pressed_box", "domino", "wedge",
)  # fmt: skip
PASTED = ("bounce", "stack", "incline", "conveyor")


def asked(engine: Engine) -> list[tuple[str, Scene]]:
    """Cells by name."""
    found = []
    for name, canonical in CATALOGUE.items():
        for dimension in canonical.dimensions:
            own = (cell for cell in cells(canonical) if cell[1] == dimension)
            for title, _, params in islice(own, CELLS):
                kind, _, rest = title.partition(" ")
                found.append((f"{kind} {name} {rest}".strip(), canonical.scene(dimension, params)))
    return found


def posed(engine: Engine, scene: Scene, profile: str) -> Scene | str:
    """The scene as the engine gets it, or why it does not."""
    try:
        own = posed_for(engine, scene)
    except EngineError as error:
        return str(error)
    return engine.refuses(own, profile) or own


def settings_table(engine: Engine, profile: str) -> Sections:
    """Settings of a profile for each cell, what it declares and what there is to paste; then all reasons, once each."""
    found, reasons = Sections(), dict[str, dict[str, None]]()
    for title, scene in asked(engine):
        own = posed(engine, scene, profile)
        if isinstance(own, str):
            found[title] = {"refused": own}
            continue
        what = needs(scene)
        told = engine.settings(profile, what, DT)
        values = {each.name: each.value for each in told}
        paste = engine.snippet(values, list(values), own, DT) if scene.name in PASTED else ""
        declared = engine.declares(profile, what, DT)
        found[title] = section(settings=values, declares=declared, paste=dict(enumerate(paste.splitlines())))
        for each in told:
            reasons.setdefault(each.name, {})[f"{each.because} ({each.source})"] = None
    found["reasons"] = section(because={name: list(said) for name, said in reasons.items()})
    return found


def held_table(engine: Engine, profile: str) -> Sections:
    """What worlds of the first cell of each scene hold before their first step, as the engine itself says."""
    found, met = Sections(), set[str]()
    for title, scene in asked(engine):
        own = posed(engine, scene, profile)
        if isinstance(own, str) or scene.name not in BUILT or (title[:4] + scene.name) in met:
            continue
        met.add(title[:4] + scene.name)
        settings = {each.name: each.value for each in engine.settings(profile, needs(scene), DT)}
        simulation = engine.build(own, DT, settings)
        try:
            found[title] = section(held=simulation.readback(), pose=simulation.pose(), twist=simulation.twist())
        finally:
            simulation.close()
    return found
