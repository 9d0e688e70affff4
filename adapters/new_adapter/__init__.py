"""A package for an engine of somebody else's, to begin with: it works, and its test runs the conformance kit.

NAME/
pyproject.toml                  the entry point that registers the engine
crosscheck_NAME/__init__.py     the adapter, an engine of discs until another one stands in its place
tests/test_conformance.py       one test for each check
"""

from __future__ import annotations

import keyword
import re
from importlib.resources import files
from pathlib import Path

from adapters import registry
from adapters.engine import EngineError
from adapters.plain import NAME, one_line

PYPROJECT = """[build-system]
requires = ["hatchling"]
build-backend = "hatchling.build"

[project]
name = "DISTRIBUTION"
version = "0.1"
requires-python = ">=3.11"
dependencies = ["contact-crosscheck", "numpy"]

[project.optional-dependencies]
test = ["pytest"]

[project.entry-points."contact_crosscheck.engines"]
NAME = "PACKAGE:CLASS"
"""
TEST = '''"""The adapter keeps its promises: one test for each check of the kit."""

import pytest
from adapters.conformance import items
from PACKAGE import CLASS


@pytest.mark.parametrize("item", items(CLASS()), ids=str)
def test_conformance(item):
    item.hold()
'''


def write_package(name: str, into: Path) -> list[Path]:
    """Write a package for the engine called ``name`` below ``into``; the files that were written.

    Raises
    ------
    EngineError
        If that is no name for a module, if an engine has it already, or if there is such a folder.
    """
    if not re.fullmatch(r"[a-z][a-z0-9_]*", name) or keyword.iskeyword(name) or len(name) > NAME:
        raise EngineError(f"name: {one_line(name, NAME)!r} must be made of a-z, 0-9 and _, and begin with a letter")
    if name in registry.names():
        raise EngineError(f"name: there is an engine called {name!r} already")
    folder, package = into / name, f"crosscheck_{name}"
    if folder.exists():
        raise EngineError(f"name: {folder} is there already")
    words = {
        "DISTRIBUTION": package.replace("_", "-"),
        "PACKAGE": package,
        "CLASS": "".join(part.capitalize() for part in name.split("_")),
        "NAME": name,
    }
    texts = {
        "pyproject.toml": PYPROJECT,
        f"{package}/__init__.py": (files(__name__) / "engine.py.txt").read_text(),
        "tests/test_conformance.py": TEST,
    }
    for path, text in texts.items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_text(re.sub("|".join(words), lambda found: words[found[0]], text))
    return [folder / path for path in texts]
