"""The tools of the mutation runs, imported as their own folder has them, for one test at a time."""

import importlib
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).parent


@pytest.fixture
def imported(monkeypatch):
    """`imported(name)`: a module of this folder; what it brought is forgotten afterwards."""
    pytest.importorskip("mutmut")
    monkeypatch.syspath_prepend(str(FOLDER))
    kept = set(sys.modules)
    yield importlib.import_module
    for name in set(sys.modules) - kept:
        if (FOLDER / f"{name}.py").exists():
            del sys.modules[name]
