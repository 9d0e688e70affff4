"""The section of each scene: figure, law, verdicts of every check, error against step and iterations."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass

import pandas as pd

from reports.page import figures
from reports.page.charts import with_unit
from reports.page.figures import Figure
from reports.page.source import Source
from reports.page.verdicts import SceneVerdicts, scene_verdicts, slug
from reports.wording import number
from validation.canonical import CanonicalScene, Primary
from validation.posed import resolve
from validation.questions.convergence import (
    Convergence,
    DeclaredErrors,
    Extrapolation,
    convergence,
    declared_errors,
    extrapolations,
)
from validation.running.plan import QUICK_DT


@dataclass(frozen=True)
class SceneSection:
    """One scene: its description, its verdicts by dimension, its figures."""

    name: str
    anchor: str
    canonical: CanonicalScene
    prose: list[str]
    drawing: str
    primary: Primary | None
    verdicts: list[SceneVerdicts]
    figures: list[list[Figure]]
    convergence: list[Convergence]
    extrapolations: list[Extrapolation]


def scene_sections(source: Source) -> list[SceneSection]:
    """Sections in the order of the run."""
    observations = [*(source.bench.observations if source.bench else ()), *source.observations]
    declared = declared_errors(observations)
    orders, limits, errors = convergence(declared), extrapolations(observations), _iteration_table(declared)
    return [_section(source, scene, orders, limits, errors) for scene in source.scenes]


def _section(
    source: Source,
    scene: str,
    orders: Sequence[Convergence],
    limits: Sequence[Extrapolation],
    errors: pd.DataFrame,
) -> SceneSection:
    canonical = resolve(scene)
    dimensions = [dimension for name, dimension in source.lines if name == scene]
    rows = []
    for dimension in dimensions:
        found = [figures.error_against_step(orders, scene, dimension)]
        if source.bench is not None:
            found.append(figures.work_precision(source.bench.tables["work_points"], scene, dimension))
        found.append(_iterations(errors, scene, dimension))
        rows.append([figure for figure in found if figure is not None])
    return SceneSection(
        scene,
        slug("scene", scene),
        canonical,
        *split_figure(canonical.figure),
        canonical.primary,
        [scene_verdicts(source, scene, dimension) for dimension in dimensions],
        [row for row in rows if row],
        [entry for entry in orders if entry.scene == scene],
        [entry for entry in limits if entry.scene == scene],
    )


def _iteration_table(declared: DeclaredErrors) -> pd.DataFrame:
    """Headline error at dt = 1/240 for every iteration count that was set."""
    rows = []
    for (scene, dimension, engine, profile), errors in declared.items():
        for (dt, iterations), error in errors.items():
            if dt == QUICK_DT and iterations is not None:
                said = f"{engine}/{profile}, {iterations} iterations: error {number(error, 2)}"
                rows.append((scene, dimension, engine, profile, iterations, error, said))
    return pd.DataFrame(rows, columns=["scene", "dimension", "engine", "profile", "iterations", "error", "label"])


def _iterations(errors: pd.DataFrame, scene: str, dimension: int) -> Figure | None:
    table = errors[(errors["scene"] == scene) & (errors["dimension"] == dimension)]
    primary = resolve(scene).primary
    if primary is None:
        return None
    return figures.error_against_iterations(table, scene, dimension, QUICK_DT, with_unit(primary.name, primary.unit))


def split_figure(figure: str) -> tuple[list[str], str]:
    """Paragraphs and drawing of a scene's figure: indented blocks are the drawing, the others text."""
    blocks = [block for block in re.split(r"\n\s*\n", figure.strip("\n")) if block.strip()]
    drawn = [block for block in blocks if block.startswith(" ")]
    said = [" ".join(block.split()) for block in blocks if not block.startswith(" ")]
    said = [text.replace("``", "") for text in said]
    return said, textwrap.dedent("\n\n".join(drawn)).strip("\n")
