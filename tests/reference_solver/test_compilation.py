"""Machine code is kept per state of the sources, and a missing cache costs time only."""

import ast
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
#: Import of the loop's own decorators.
LOOP = "from reference_solver.compilation import cache_folder, compiled\n"


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
        ("exact/kernels/rows.py", False),
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
    for name in compilation.APART:
        found = [folder / name] if name.endswith(".py") else [*(folder / name).rglob("*.py")]
        assert found
        for path in found:
            text = path.read_text().replace(ENTRY, "").replace(LOOP, "")
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


def test_kernels_without_a_wrapper_are_called_by_kernels_alone():
    """Python that calls one ends in a crash of the process."""
    folder = Path(compilation.__file__).parent / "exact"
    inner = {
        function.name
        for path in (folder / "kernels").glob("*.py")
        for function in ast.parse(path.read_text()).body
        if isinstance(function, ast.FunctionDef) and "inner_kernel" in map(ast.unparse, function.decorator_list)
    }
    assert len(inner) > 20
    for path in [*folder.glob("*.py"), *(Path(__file__).parent / "exact").glob("*.py")]:
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ImportFrom) and "exact.kernels" in (node.module or ""):
                assert not inner & {each.name for each in node.names}, path


#: A box that falls on a floor, in both dimensions; then the kernels of the loop that were compiled more than once.
TWICE = """
from importlib import import_module
from pkgutil import iter_modules

from reference_solver import Body, Box, HalfSpace, Model, Settings, Simulation
from reference_solver.exact import kernels

floors = HalfSpace((0.0, 1.0)), HalfSpace((0.0, 0.0, 1.0))
boxes = Box((0.5, 0.5)), Box((0.5, 0.5, 0.5))
for d, turn in ((2, (0.2,)), (3, (0.8, 0.6, 0.0, 0.0))):
    above = (*(0.0,) * (d - 1), 1.0, *turn)
    floor = Body(floors[d - 2], motion="fixed", pose=(*(0.0,) * d, *((0.0,), (1.0, 0.0, 0.0, 0.0))[d - 2]))
    bodies = [floor, Body(boxes[d - 2], 1.0, 0.2 if d == 2 else (0.2,) * 3, above, (0.5,) * (3 * d - 3))]
    Simulation(Model(d, bodies, (*(0.0,) * (d - 1), -9.81), 0.5, 0.5), Settings.reference(1 / 240)).advance(240)
modules = [import_module(f"{kernels.__name__}.{each.name}") for each in iter_modules(kernels.__path__)]
found = {name: each for module in modules for name, each in vars(module).items() if hasattr(each, "signatures")}
print([len(found) > 30, *sorted(name for name, each in found.items() if len(each.signatures) > 1)])
"""


@pytest.mark.long  # 40 s of CPU: nothing is kept in the folder
@pytest.mark.skipif(bool(compilation.config.DISABLE_JIT), reason="NUMBA_DISABLE_JIT: nothing is compiled")
def test_compilations_of_the_loop_in_plane_and_space(tmp_path):
    assert run(TWICE, NUMBA_CACHE_DIR=str(tmp_path)) == "[True]"
