"""Machine code is kept per state of the sources, and a missing cache costs time only."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from reference_solver import compilation

#: Imports of the event loop's entry to the direct solver.
ENTRY = """from reference_solver.compilation import kernel
from reference_solver.direct import problem as direct
from reference_solver.direct.rounds import solve_problem
"""


def run(code, folder=None, **environment):
    return subprocess.run(
        [sys.executable, "-c", code],
        cwd=folder,
        capture_output=True,
        text=True,
        env=os.environ | environment,
        check=True,
    ).stdout.strip()


def test_name_of_the_cache_folder():
    assert compilation.CACHE_FOLDER is None or compilation.source_hash() in compilation.CACHE_FOLDER.name


@pytest.mark.parametrize(
    ("file", "covered"),
    [
        ("model.py", True),
        ("textbook2/rows.py", True),
        ("piles.py", False),
        ("certificate/truth.py", False),
        ("certificate/audit/run.py", False),
        ("geometry.py", False),
    ],
)
def test_sources_in_the_hash_of_kernels(tmp_path, monkeypatch, file, covered):
    source = tmp_path / file
    source.parent.mkdir(parents=True, exist_ok=True)
    source.write_text("x = 1")
    monkeypatch.setattr(compilation, "__file__", str(tmp_path / "compilation.py"))
    before = compilation.source_hash()
    source.write_text("x = 2")
    assert (compilation.source_hash() != before) == covered


def test_cache_folder_of_another_python(monkeypatch):
    """A mark in the folder says that kernels are compiled: it is true of one Python only."""
    before = compilation.source_hash()
    monkeypatch.setattr(sys.implementation, "cache_tag", "cpython-399")
    assert compilation.source_hash() != before


def test_kernels_outside_the_hash():
    """An edit there would leave machine code of what stood there before.

    The event loop has folders of its own. Its entry to the direct solver calls nothing else, and numba itself notices
    that the file of a kernel has changed.
    """
    folder = Path(compilation.__file__).parent
    for name in compilation.WITHOUT_KERNELS:
        found = [folder / name] if name.endswith(".py") else [*(folder / name).rglob("*.py")]
        assert found
        for path in found:
            text = path.read_text().replace("from reference_solver.compilation import base_folder\n", "")
            text = text.replace(ENTRY, "")
            assert "reference_solver.compilation" not in text, path


def test_unusable_cache_folder(tmp_path):
    blocked = tmp_path / "file"
    blocked.write_text("not a folder")
    code = "import reference_solver, reference_solver.compilation as c; print(c.CACHE_FOLDER)"
    assert run(code, NUMBA_CACHE_DIR=str(blocked)) == "None"


def test_machine_code_of_another_checkout(tmp_path):
    code = (
        "import reference_solver.coulomb as c; print(c.__file__);"
        "print(c.into_cone(1.0, 2.0, 0.5), sum(c.into_cone.stats.cache_hits.values()))"
    )
    answers = []
    for name in ("one", "two"):
        shutil.copytree(
            Path(compilation.__file__).parent,
            tmp_path / name / "reference_solver",
            ignore=shutil.ignore_patterns("__pycache__"),
        )
        said = run(code, tmp_path / name, NUMBA_CACHE_DIR=str(tmp_path / "kernels")).split("\n")
        assert str(tmp_path / name) in said[0]
        answers.append(said[1])
    assert [answer.rpartition(" ")[2] for answer in answers] == ["0", "1"]
    assert answers[0][:-1] == answers[1][:-1]


def test_numba_settings_of_the_caller(tmp_path):
    code = (
        "from numba.core import config; kept = lambda: (config.CACHE_DIR, config.CACHE_LOCATOR_CLASSES);"
        "before = kept(); import reference_solver.textbook2; print(kept() == before)"
    )
    assert run(code, NUMBA_CACHE_DIR=str(tmp_path), NUMBA_DISABLE_JIT="1") == "True"


def test_imports_of_the_solver():
    rest = {"adapters", "validation", "reports"}
    code = f"import sys, reference_solver.textbook2; print({rest} & {{name.split('.')[0] for name in sys.modules}})"
    assert run(code, NUMBA_DISABLE_JIT="1") == "set()"
