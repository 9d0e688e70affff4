"""Which modules are mutated, and which tests must notice."""

from __future__ import annotations

import hashlib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
#: Module -> the tests that must notice, each file below `tests`. In the order of what a verdict hangs on.
SUBJECTS = {
    "validation/judging/verdicts.py": ("validation/test_verdicts.py",),
    "validation/findings/__init__.py": ("validation/test_findings.py", "validation/test_acceptance.py"),
    "validation/findings/files.py": ("validation/test_findings.py",),
    "validation/judging/acceptance.py": ("validation/test_acceptance.py",),
    "validation/bounds.py": (
        "validation/test_worked_bounds.py",
        "validation/test_tolerances.py",
        "validation/test_planes.py",
    ),
    "validation/truths/columns.py": ("validation/test_worked_bounds.py", "validation/scenes/test_columns.py"),
    "validation/scenes/impact.py": (
        "validation/scenes/test_impact.py",
        "validation/test_worked_bounds.py",
        "validation/test_bench_primary.py",
    ),
    "validation/scenes/bounce.py": (
        "validation/scenes/test_bounce.py",
        "validation/test_worked_bounds.py",
        "validation/test_tolerances.py",
    ),
    "validation/scenes/stack.py": ("validation/scenes/test_stack.py", "validation/test_worked_bounds.py"),
    "validation/scenes/incline.py": ("validation/scenes/test_incline.py", "validation/test_worked_bounds.py"),
    "validation/truths/pivoting.py": ("validation/scenes/test_worked_falls.py", "validation/scenes/test_pivoting.py"),
    "validation/truths/sliding.py": ("validation/scenes/test_worked_slides.py", "validation/scenes/test_standing.py"),
    "validation/scenes/tilt_table.py": ("validation/scenes/test_worked_falls.py", "validation/scenes/test_tilting.py"),
    "validation/scenes/rocker.py": ("validation/scenes/test_worked_rocking.py", "validation/scenes/test_rocker.py"),
    "validation/scenes/seam.py": (
        "validation/scenes/test_worked_slides.py",
        "validation/scenes/test_seams.py",
        "validation/test_units.py",
    ),
    "validation/scenes/overlap.py": (
        "validation/scenes/test_worked_blows.py",
        "validation/scenes/test_overlaps.py",
        "validation/test_units.py",
    ),
    "validation/scenes/closing_wall.py": (
        "validation/scenes/test_worked_blows.py",
        "validation/scenes/test_moved_blows.py",
    ),
    "validation/questions/nulls.py": ("validation/test_nulls.py",),
    "validation/questions/residuals.py": ("validation/test_residuals.py",),
    "validation/records/keeping.py": ("validation/test_keeping.py",),
    "validation/releases/history.py": ("validation/releases/test_history.py",),
    "validation/releases/bisection.py": ("validation/releases/test_bisection.py",),
    "validation/metrics.py": ("validation/test_metrics.py",),
    "validation/files/quantities.py": ("validation/test_quantities.py", "validation/test_scene_files.py"),
    "adapters/law.py": (
        "adapters/test_law.py",
        "validation/test_verdicts.py",
        "validation/test_deviations_chipmunk.py",
        "validation/test_worked_bounds.py",
    ),
    "reports/exports.py": ("reports/test_exports.py", "reports/test_what_is_shown.py"),
    "reports/wording.py": ("reports/test_wording.py", "reports/test_what_is_shown.py"),
    "reports/changes.py": ("reports/test_changes.py",),
    "reports/findings.py": ("reports/test_findings_shown.py", "reports/test_what_is_shown.py"),
    "reports/matrix.py": ("reports/test_matrix.py", "reports/test_what_is_shown.py"),
    "reports/command/statuses.py": ("reports/test_statuses.py",),
    "validation/judging/rows.py": (
        "validation/test_rows.py",
        "validation/test_findings.py",
        "validation/test_acceptance.py",
    ),
    "validation/judging/comparison.py": ("validation/test_comparison.py",),
    "adapters/lift.py": ("adapters/test_lift.py", "validation/test_planes.py"),
    "adapters/plain.py": ("adapters/test_plain.py",),
    "adapters/needs.py": ("adapters/test_needs.py",),
    "adapters/scene.py": ("adapters/test_scene.py",),
    "adapters/shapes.py": ("adapters/test_scene.py", "adapters/test_shapes.py", "validation/test_solids.py"),
    "adapters/materials.py": ("adapters/test_needs.py", "adapters/test_scene.py"),
    "adapters/trajectory.py": ("adapters/test_stepping.py",),
    "adapters/stepping.py": ("adapters/test_stepping.py",),
    "adapters/receipts.py": ("adapters/test_receipts.py",),
    "validation/geometry.py": (
        "validation/test_geometry.py",
        "validation/test_solids.py",
        "validation/test_metrics.py",
    ),
    "validation/solids.py": ("validation/test_solids.py",),
    "validation/files/invariants.py": ("validation/test_invariants.py",),
    "validation/files/mass_properties.py": ("validation/test_invariants.py", "validation/test_solids.py"),
    "validation/questions/convergence.py": ("validation/test_convergence.py",),
    "validation/bench/statistics.py": ("validation/test_bench_statistics.py",),
}
PACKAGES = ("validation", "adapters", "reports")


def tests_of(module: str) -> list[str]:
    """Paths of the tests of a module, from the root of the checkout."""
    return [f"tests/{name}" for name in SUBJECTS[module]]


def hash_of(module: str) -> str:
    """Hash of a module and its tests: another one means that its score is of something else."""
    return hashlib.sha256(b"".join((ROOT / name).read_bytes() for name in [module, *tests_of(module)])).hexdigest()[:12]
