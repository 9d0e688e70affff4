"""A package for an engine of somebody else's, to begin with: it works, and its test runs the conformance kit.

NAME/
pyproject.toml                  the entry point that registers the engine
crosscheck_NAME/__init__.py     the adapter, an engine of discs until another one stands in its place
                engine.py       with --pipe: that engine as a program, in place of one in any language
                PROTOCOL.txt    what such a program answers
tests/test_conformance.py       one test for each check
"""

from __future__ import annotations

import builtins
import keyword
import re
import sys
from importlib.resources import files
from importlib.util import find_spec
from inspect import cleandoc
from pathlib import Path

import adapters.pipe
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
PIPE = '''"""NAME: the program beside this file is the engine; `command` starts it here."""

from adapters.pipe import PipeEngine


class CLASS(PipeEngine):
    """A program in any language: ("node", "engine.mjs"), ("./engine",)."""

    command = ("python3", "engine.py")
'''
TEST = '''"""The adapter keeps its promises: one test for each check of the kit."""

import pytest
from adapters.conformance import items
from PACKAGE import CLASS


@pytest.mark.parametrize("item", items(CLASS()), ids=str)
def test_conformance(item):
    item.hold()
'''


def write_package(name: str, into: Path, pipe: bool = False) -> list[Path]:
    """Write a package for the engine called ``name`` below ``into``; the files that were written.

    Parameters
    ----------
    pipe
        Whether the engine is a program of its own, which speaks the protocol of `adapters.pipe`.

    Raises
    ------
    EngineError
        If that is no name for a module, if Python, an engine or a package has it already, or if there is such a folder.
    """
    if not re.fullmatch(r"[a-z][a-z0-9_]*", name) or len(name) > NAME:
        raise EngineError(f"name: {one_line(name, NAME)!r} must be made of a-z, 0-9 and _, and begin with a letter")
    if name in {*keyword.kwlist, *sys.stdlib_module_names, *dir(builtins), "nan", "inf", "infinity"}:
        raise EngineError(f"name: {name!r} is a word, module or number of Python")
    if name in registry.names():
        raise EngineError(f"name: there is an engine called {name!r} already")
    folder, package = into / name, f"crosscheck_{name}"
    if find_spec(package):
        raise EngineError(f"name: there is a package {package!r} already")
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
        f"{package}/__init__.py": PIPE if pipe else (files(__name__) / "engine.py.txt").read_text(),
        "tests/test_conformance.py": TEST,
    }
    if pipe:
        texts[f"{package}/engine.py"] = (files(__name__) / "program.py.txt").read_text()
    for path, text in texts.items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_text(re.sub("|".join(words), lambda found: words[found[0]], text))
    if pipe:
        texts[f"{package}/PROTOCOL.txt"] = protocol = cleandoc(adapters.pipe.__doc__ or "") + "\n"
        (folder / package / "PROTOCOL.txt").write_text(protocol)
    return [folder / path for path in texts]
