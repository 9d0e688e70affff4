"""Scenes of ours on two solvers that nobody here wrote: Siconos, and `solve_nivp` where nothing rubs.

They pass the checks of each scene, whose tolerances follow from the step alone; what a program does not tell is not
judged. With 5 % more friction and restitution they fail. `make nightly` runs them, or `CROSSCHECK_ALL=1 pytest
tests/oracles`.
"""

import subprocess
import sys
from functools import cache
from importlib.util import find_spec
from pathlib import Path

import pytest
from planted import failing

from adapters.pipe import PipeEngine
from adapters.stepping import run
from validation.catalogue import CATALOGUE

pytestmark = pytest.mark.long
#: Python that has Siconos: Debian's package is for Debian's own.
DEBIAN = "/usr/bin/python3"
RIGHT, WRONG = "1", "1.05"
DT = 1e-3
SCENES = [
    ("siconos", "impact", 3, {"e": 0.5}),
    ("siconos", "bounce", 2, {"e": 0.5}),
    ("siconos", "head_on", 3, {}),
    ("siconos", "cradle", 2, {}),
    ("siconos", "stacked_balls", 2, {}),
    ("siconos", "galperin", 2, {}),
    ("siconos", "thin_wall", 2, {}),
    ("siconos", "off_centre", 2, {}),
    ("siconos", "oblique", 3, {}),
    ("siconos", "flat_box", 3, {}),
    ("siconos", "edge_drop", 3, {}),
    ("siconos", "painleve", 2, {}),
    ("siconos", "pair_matrix", 2, {}),
    ("siconos", "hilltop", 2, {}),
    ("siconos", "slide", 2, {}),
    ("siconos", "slide_to_roll", 3, {}),
    ("siconos", "roll_incline", 2, {}),
    ("siconos", "rolling_spin", 3, {}),
    ("siconos", "incline", 2, {"ratio": 2.0}),
    ("siconos", "shove", 2, {}),
    ("siconos", "stack", 2, {"n": 3, "duration": 1.0}),
    ("siconos", "rack", 2, {}),
    ("siconos", "kane", 2, {}),
    ("siconos", "rocking_block", 2, {}),
    ("siconos", "pivot", 2, {}),
    ("siconos", "rocker", 2, {}),
    ("siconos", "pinch", 2, {}),
    ("siconos", "ladder", 2, {"ratio": 0.8}),
    ("siconos", "v_groove", 2, {}),
    ("siconos", "scales", 2, {}),
    ("siconos", "overlap", 2, {}),
    ("nivp", "impact", 2, {"e": 0.5}),
    ("nivp", "head_on", 2, {}),
    ("nivp", "cradle", 2, {}),
    ("nivp", "rack", 2, {}),
]
#: Scenes in which the planted fault moves something.
MOVED = [each for each in SCENES if each[1] in ("impact", "head_on", "off_centre", "oblique", "slide", "slide_to_roll")]


@cache
def has(name: str) -> bool:
    if name == "nivp":
        return find_spec("solve_nivp") is not None
    asked = [DEBIAN, "-c", "import siconos.kernel"]
    return Path(DEBIAN).exists() and subprocess.run(asked, capture_output=True).returncode == 0


def wrong(name, scene, dimension, params, fault):
    """Checks that fail although the program tells their values; at least one is judged."""
    if not has(name):
        pytest.skip("needs Debian's package python3-siconos" if name == "siconos" else "needs solve-nivp")

    class Oracle(PipeEngine):
        command = (DEBIAN if name == "siconos" else sys.executable, f"{name}_world.py", fault)
        folder = Path(__file__).parent

    canonical, engine = CATALOGUE[scene], Oracle()
    posed = canonical.scene(dimension, params)
    settings = {setting.name: setting.value for setting in engine.profiles["plain"](None, DT)}
    trajectory = run(engine, posed, DT, settings, canonical.sampling(posed))
    told = {metric for metric, (value, _) in canonical.measure(posed, trajectory).items() if value is not None}
    assert told & {check.metric for check in canonical.checks(posed, DT) if check.bound is not None}
    return failing(canonical, posed, trajectory) & told


@pytest.mark.parametrize(("name", "scene", "dimension", "params"), SCENES)
def test_scene_passes_on_an_outside_solver(name, scene, dimension, params):
    assert wrong(name, scene, dimension, params, RIGHT) == set()


@pytest.mark.parametrize(("name", "scene", "dimension", "params"), MOVED)
def test_planted_fault_fails(name, scene, dimension, params):
    assert wrong(name, scene, dimension, params, WRONG)
