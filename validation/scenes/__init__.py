"""The catalogue of canonical scenes."""

from __future__ import annotations

import difflib
import fnmatch

from adapters.scene import SceneError
from validation.canonical import CanonicalScene
from validation.scenes.bounce import BOUNCE
from validation.scenes.impact import IMPACT
from validation.scenes.incline import INCLINE
from validation.scenes.stack import STACK

CATALOGUE: dict[str, CanonicalScene] = {scene.name: scene for scene in (IMPACT, BOUNCE, STACK, INCLINE)}


def matching(pattern: str) -> list[CanonicalScene]:
    """Scenes whose name is, or matches the glob, ``pattern``.

    Raises
    ------
    SceneError
        If there is none ("did you mean").
    """
    found = [scene for name, scene in CATALOGUE.items() if fnmatch.fnmatchcase(name, pattern)]
    if not found:
        close = difflib.get_close_matches(pattern, CATALOGUE, n=1)
        hint = f"did you mean {close[0]!r}?" if close else f"known: {', '.join(CATALOGUE)}"
        raise SceneError(f"scene: there is no scene called {pattern!r}, {hint}")
    return found
