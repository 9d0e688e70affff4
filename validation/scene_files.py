"""Scene files (TOML or JSON): checked completely before anything else sees them.

Their format is `validation.scene_format`. A scene from a file has no closed form: its final places, angles, velocities
and forces are shown without a truth, unless its author states a number for one (``[[checks]]``); what must hold in
any scene (`validation.invariants`) is judged.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pydantic import ValidationError

from adapters.plain import one_line
from adapters.scene import Scene, SceneError
from adapters.trajectory import Sampling, Trajectory
from validation import invariants
from validation.canonical import CanonicalScene, Check, Measured
from validation.quantities import force_window, quantity, unit
from validation.scene_format import CheckModel, SceneModel, Stated, shown_quantities, stated
from validation.scene_text import parsed, read_text, said


def json_schema() -> dict[str, Any]:
    """JSON Schema of a scene file, for editors."""
    return SceneModel.model_json_schema()


def load_scene(path: Path) -> Scene:
    """Read and check a scene file; raises as `load_stated`."""
    return load_stated(path).scene


def load_stated(path: Path) -> Stated:
    """Read and check a scene file, with what was filled in and what its author knows.

    Raises
    ------
    SceneError
        One line that names the file and every field that is wrong.
    """
    return stated_from_text(read_text(path), path)


def stated_from_text(text: str, path: Path) -> Stated:
    """Check the text of the scene file that lies, or lay, at ``path``; raises as `load_stated`."""
    shown = one_line(path)
    try:
        model = SceneModel.model_validate(parsed(text, path))
    except ValidationError as errors:
        raise SceneError(f"{shown}: {said(errors)}") from None
    try:
        return stated(model)
    except (SceneError, ArithmeticError) as error:  # arithmetic: numbers too large for masses and moments
        raise SceneError(f"{shown}: {one_line(error)}") from None


def canonical_from_file(path: Path) -> CanonicalScene:
    """Wrap a scene file so that it runs like a scene of the catalogue."""
    return canonical_from_text(read_text(path), path)


def canonical_from_text(text: str, path: Path) -> CanonicalScene:
    """Wrap the text of the scene file that lies, or lay, at ``path``; raises as `load_stated`."""
    read = stated_from_text(text, path)
    scene = read.scene
    return CanonicalScene(
        name=scene.name,
        version=scene.version,
        title=f"Scene file {path.name}",
        figure="",
        law="no closed form; energy never grows, bodies do not pass into each other",
        dimensions=(scene.dimension,),
        parameters=(),
        make=lambda dimension, params: scene,
        exact=lambda scene: _exact(read),
        measure=lambda scene, trajectory: _measure(read, trajectory),
        rule=lambda scene, dt, truth: _checks(read, dt),
        sampling=lambda scene: Sampling(1, scene.duration - force_window(scene)),
        notes=read.notes,
    )


def _exact(read: Stated) -> dict[str, float]:
    told = {_metric(check.quantity, check.at): check.value for check in read.checks}
    return {"energy_growth": 0.0, "penetration": 0.0, **told}


def _metric(name: str, at: float | None = None) -> str:
    """Name of a quantity's metric: ``final[ball.y]``, or ``at[0.25 s][ball.y]``."""
    return f"final[{name}]" if at is None else f"at[{at:.12g} s][{name}]"


def _measure(read: Stated, trajectory: Trajectory) -> dict[str, Measured]:
    beyond, depth = invariants.deepest(read.scene, trajectory)
    measured: dict[str, Measured] = {
        "energy_growth": invariants.energy_growth(read.scene, trajectory),
        "penetration": beyond,
        "deepest_overlap": depth,
    }
    shown = [(name, None) for name in shown_quantities(read.scene)]
    for name, at in [*shown, *((check.quantity, check.at) for check in read.checks)]:
        measured[_metric(name, at)] = quantity(read.scene, trajectory, name, at)
    return measured


def _checks(read: Stated, dt: float) -> list[Check]:
    told = {_metric(check.quantity, check.at): check for check in read.checks}
    final = "shown for comparison between engines: the file states no number for it"
    names = {_metric(name): name for name in shown_quantities(read.scene)}
    shown = [Check(metric, unit(name), None, None, final, "") for metric, name in names.items() if metric not in told]
    depth = Check("deepest_overlap", "m", None, None, "shown: what `penetration` grants is taken off there", "")
    return [*invariants.checks(read.scene, dt), *(_stated_check(m, c) for m, c in told.items()), depth, *shown]


def _stated_check(metric: str, check: CheckModel) -> Check:
    return Check(
        metric, unit(check.quantity), check.value, check.tolerance, check.because, "the scene file's [[checks]]"
    )
