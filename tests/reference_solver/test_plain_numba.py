"""On a release of numba that nobody tried, kernels are compiled by what it offers to all: slowly, and right."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from reference_solver.compilation import config
from reference_solver.structures import TRIED

ROOT = Path(__file__).parents[2]
pytestmark = pytest.mark.skipif(bool(config.DISABLE_JIT), reason="NUMBA_DISABLE_JIT: nothing is compiled")

#: A process in which numba calls itself a release that is not there yet.
PLAIN = """
import sys
from importlib import metadata

version = metadata.version
metadata.version = lambda name: "99.0" if name == "numba" else version(name)

from reference_solver.structures import KNOWN

assert not KNOWN
import pytest

status = pytest.main(["-q", "-p", "no:cacheprovider", "-p", "no:xdist", *sys.argv[1:]])
ours = {"reference_solver.linking", "reference_solver.structure_types"}
assert "reference_solver.compilation" in sys.modules and not ours & set(sys.modules)
sys.exit(status)
"""


@pytest.mark.parametrize(
    "tests",
    [
        # 8 s of CPU where nothing is compiled before
        pytest.param(
            ["test_structures.py", "direct/test_matrix.py"],
            marks=pytest.mark.long,
        ),
        pytest.param(["direct"], marks=pytest.mark.long),  # 31 s
    ],
    ids=["structures, a matrix", "the direct solver"],
)
def test_solver_on_an_untried_release(tests):
    paths = [f"tests/reference_solver/{name}" for name in tests]
    done = subprocess.run([sys.executable, "-c", PLAIN, *paths], cwd=ROOT, capture_output=True, text=True, timeout=500)
    assert done.returncode == 0, done.stdout + done.stderr
    assert re.search(r"\d\d passed", done.stdout)


def test_releases_stated_by_the_project():
    said = re.search(r"# Tried: numba (.+?)[;.] ", (ROOT / "pyproject.toml").read_text())
    assert said and tuple(said[1].split(", ")) == TRIED
    pinned = re.search(r"^numba==(.+)$", (ROOT / "constraints.txt").read_text(), re.MULTILINE)
    assert pinned and pinned[1] in TRIED
