"""Scene files (TOML or JSON): checked completely before anything else sees them.

The file's types are checked here by pydantic, its physics by `adapters.scene.Scene`. A scene from a file has no
closed form, so its final positions are shown without a truth; what must hold in any scene is judged: mechanical
energy never grows, bodies do not overlap deeper than one step of motion.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from adapters.needs import needs
from adapters.plain import one_line
from adapters.scene import Scene, SceneError, scene_from_dict
from adapters.trajectory import Sampling, Trajectory
from validation import metrics
from validation.canonical import CanonicalScene, Check, Measured
from validation.scene_text import parsed, read_text, said


class _Strict(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class DiscModel(_Strict):
    """Planar disc."""

    type: Literal["disc"]
    radius: float


class SphereModel(_Strict):
    """Ball."""

    type: Literal["sphere"]
    radius: float


class BoxModel(_Strict):
    """Box by half extents."""

    type: Literal["box"]
    half_extents: tuple[float, ...]


class HalfSpaceModel(_Strict):
    """Solid where normal . x <= offset."""

    type: Literal["half_space"]
    normal: tuple[float, ...]
    offset: float = 0.0


class BodyModel(_Strict):
    """A body; see `adapters.scene.Body`."""

    name: str
    shape: Annotated[DiscModel | SphereModel | BoxModel | HalfSpaceModel, Field(discriminator="type")]
    mass: float = 1.0
    inertia: float | tuple[float, float, float] = 1.0
    pose: tuple[float, ...] = ()
    twist: tuple[float, ...] = ()
    motion: Literal["free", "fixed", "prescribed"] = "free"
    force: tuple[float, ...] = ()
    torque: tuple[float, ...] = ()


class PairModel(_Strict):
    """Material of a pair; see `adapters.scene.Pair`."""

    a: str = "*"
    b: str = "*"
    restitution: float = 0.0
    friction: float = 0.0


class SceneModel(_Strict):
    """A scene file."""

    name: str = Field(min_length=1)
    version: int = 1
    dimension: Literal[2, 3]
    gravity: tuple[float, ...]
    duration: float
    impact_law: Literal["N-SIM", "N-SEQ"] = "N-SIM"
    bodies: tuple[BodyModel, ...]
    pairs: tuple[PairModel, ...] = ()


def json_schema() -> dict[str, Any]:
    """JSON Schema of a scene file, for editors."""
    return SceneModel.model_json_schema()


def load_scene(path: Path) -> Scene:
    """Read and check a scene file.

    Raises
    ------
    SceneError
        One line that names the file and every field that is wrong.
    """
    return scene_from_text(read_text(path), path)


def scene_from_text(text: str, path: Path) -> Scene:
    """Check the text of the scene file that lies, or lay, at ``path``; raises as `load_scene`."""
    shown = one_line(path)
    try:
        model = SceneModel.model_validate(parsed(text, path))
    except ValidationError as errors:
        raise SceneError(f"{shown}: {said(errors)}") from None
    try:
        return scene_from_dict(model.model_dump())
    except SceneError as error:
        raise SceneError(f"{shown}: {one_line(error)}") from None


def canonical_from_file(path: Path) -> CanonicalScene:
    """Wrap a scene file so that it runs like a scene of the catalogue."""
    return canonical_from_text(read_text(path), path)


def canonical_from_text(text: str, path: Path) -> CanonicalScene:
    """Wrap the text of the scene file that lies, or lay, at ``path``; raises as `load_scene`."""
    scene = scene_from_text(text, path)
    return CanonicalScene(
        scene.name,
        scene.version,
        f"Scene file {path.name}",
        "",
        "no closed form; energy never grows, bodies do not pass into each other",
        (scene.dimension,),
        (),
        lambda dimension, params: scene,
        _exact,
        _measure,
        lambda scene: Sampling(1, None),
        lambda scene: None,
        _checks,
    )


def _exact(scene: Scene) -> dict[str, float]:
    return {"energy_growth": 0.0, "penetration": 0.0}


def _measure(scene: Scene, trajectory: Trajectory) -> dict[str, Measured]:
    energy = mechanical_energy(scene, trajectory)
    gaps = metrics.separations(scene, trajectory)
    measured: dict[str, Measured] = {
        "energy_growth": (max(0.0, float((energy - energy[0]).max())), ""),
        "penetration": (max([0.0, *(-float(gap.min()) for gap in gaps.values())]), ""),
    }
    for name, i, k, axis in _coordinates(scene):
        measured[f"final[{name}.{axis}]"] = (float(trajectory.pose[-1, i, k]), "")
    return measured


def _coordinates(scene: Scene) -> list[tuple[str, int, int, str]]:
    axes = "xy" if scene.dimension == 2 else "xyz"
    free = metrics.free_bodies(scene)
    return [(scene.bodies[i].name, i, k, axis) for i in free for k, axis in enumerate(axes)]


def mechanical_energy(scene: Scene, trajectory: Trajectory) -> np.ndarray:
    """Kinetic plus potential energy in gravity and constant forces, (s,) [J]."""
    energy = metrics.kinetic_energy(scene, trajectory)
    for i in metrics.free_bodies(scene):
        body = scene.bodies[i]
        load = body.mass * np.array(scene.gravity) + np.array(body.force)
        energy = energy - trajectory.pose[:, i, : scene.dimension] @ load
    return energy


def _checks(scene: Scene, dt: float, truth: dict[str, float]) -> list[Check]:
    wanted = needs(scene)
    step = wanted.top_speed * dt + wanted.gravity * dt * dt
    free = [body for body in scene.bodies if body.motion == "free"]
    work = sum((body.mass * math.hypot(*scene.gravity) + math.hypot(*body.force)) * step for body in free) + sum(
        abs(component) * dt for body in free for component in body.torque
    )
    energy = "external loads may do the work of one step more or less than sampled"
    depth = "contact may be found one step of motion late"
    checks = [
        Check("energy_growth", "J", 0.0, work + 1e-12, energy, "contacts only take energy (e <= 1)"),
        Check("penetration", "m", 0.0, step + 1e-12, depth, "bodies are impenetrable"),
    ]
    if any(body.motion == "prescribed" for body in scene.bodies):
        checks = checks[1:]  # a driven body may feed energy in
    final = "shown for comparison between engines: a scene from a file has no closed form"
    return checks + [
        Check(f"final[{name}.{axis}]", "m", None, None, final, "") for name, _, _, axis in _coordinates(scene)
    ]
