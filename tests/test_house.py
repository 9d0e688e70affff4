"""The house: four packages in one line, no engine imported by importing them, no stray rooms."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
LINE = ["reference_solver", "adapters", "validation", "reports"]
ENGINES = ["pymunk", "pybullet", "mujoco"]


def imported(path):
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name.split(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            yield node.module.split(".")[0]


@pytest.mark.parametrize("package", LINE)
def test_each_package_imports_only_what_stands_to_its_left(package):
    forbidden = set(LINE[LINE.index(package) + 1 :])
    for path in (ROOT / package).rglob("*.py"):
        assert not forbidden & set(imported(path)), path


def test_only_adapters_import_engines():
    for package in ("reference_solver", "validation", "reports"):
        for path in (ROOT / package).rglob("*.py"):
            assert not set(ENGINES) & set(imported(path)), path


def test_engines_are_named_in_validation_only_by_deviations_experiments_and_findings():
    names = ("chipmunk", "pymunk", "bullet", "mujoco")
    for path in (ROOT / "validation").rglob("*.py"):
        if {"deviations", "experiments", "findings"} & set(path.parts):
            continue
        text = path.read_text().lower()
        assert not [name for name in names if name in text], path


@pytest.mark.parametrize("module", ["adapters", "validation.rows", "reports.command"])
def test_importing_the_vocabulary_imports_no_engine_and_no_compiler(module):
    code = f"import sys, {module}; print(*(set({[*ENGINES, 'numba']!r}) & set(sys.modules)))"
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert out.stdout.split() == []


def test_no_utils_and_no_packages_among_the_tests():
    assert not list(ROOT.glob("[!.]*/**/*utils*.py"))
    assert not list((ROOT / "tests").rglob("__init__.py"))
