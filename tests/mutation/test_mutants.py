"""Changes that are drawn: each is one change of one function or constant, found again by its seed."""

import ast
import importlib
import sys
from itertools import islice
from pathlib import Path

import pytest

FOLDER = Path(__file__).parent


@pytest.fixture
def tools(monkeypatch):
    """`tools(name)`: a module of this folder; what it brought is forgotten afterwards."""
    monkeypatch.syspath_prepend(str(FOLDER))
    yield importlib.import_module
    for name in ("faults", "mutants"):
        sys.modules.pop(name, None)


def test_faults_of_one_statement_or_constant(tools):
    faults, only = tools("faults"), "reference_solver/textbook3/manifolds.py"
    chosen = list(islice(faults.faults(3, only), 40))
    told = [each.told for each in chosen]
    assert [each.told for each in islice(faults.faults(3, only), 20)] == told[:20]
    assert [each.told for each in islice(faults.faults(4, only), 20)] != told[:20]
    for each in chosen:
        before, after = (ast.parse(text).body for text in ((faults.ROOT / only).read_text(), each.made()))
        changed = [own for own, other in zip(before, after, strict=True) if ast.dump(own) != ast.dump(other)]
        assert len(changed) == 1
        name = changed[0].name if isinstance(changed[0], ast.FunctionDef) else changed[0].targets[0].id
        assert name == each.function


def test_constants_replaced_where_kernels_name_them(tools):
    faults, module = tools("faults"), "reference_solver/textbook2/pair_modes.py"
    fault = next(each for each in faults.faults_of(module) if (each.function, each.kind) == ("PARALLEL", "doubled"))
    assert "PARALLEL = 2.0 * 1e-12\n" in fault.made()
    lines = (faults.ROOT / module).read_text().splitlines()
    names = {
        lines[first - 1].partition("(")[0].removeprefix("def ") for name, first, _ in fault.places if name == module
    }
    assert names == {"try_sticking", "try_mode"}


TOY = "def twice(x):\n    if x < 0:\n        return 0\n    return 2 * x\n"
TESTS = """
import adapters.toy

def test_twice():
    assert adapters.toy.twice(2) == 4

def test_nothing():
    pass

def test_never():
    assert adapters.toy.twice(2) == 5
"""


@pytest.mark.long
def test_mutant_noticed_only_by_a_test_that_passes_without_it(tools, tmp_path):
    pytest.importorskip("coverage")
    faults, mutants = tools("faults"), tools("mutants")
    (tmp_path / "adapters").mkdir()
    for name, text in (("adapters/__init__.py", ""), ("adapters/toy.py", TOY), ("test_toy.py", TESTS)):
        (tmp_path / name).write_text(text)
    spoilt = faults.Change("adapters/toy.py", "twice", "", "2 * x -> 3 * x", (), lambda: TOY.replace("2 *", "3 *"))
    named = [f"test_toy.py::test_{name}" for name in ("nothing", "twice", "never")]
    assert mutants.verdict(tmp_path, spoilt, named[:2]) == (mutants.NOTICED, named[1])
    assert mutants.verdict(tmp_path, spoilt, named[:1]) == (mutants.SURVIVED, "")
    assert mutants.verdict(tmp_path, spoilt, named[2:]) == (mutants.SURVIVED, "")
    assert mutants.verdict(tmp_path, spoilt, []) == (mutants.UNREACHED, "")
    assert (tmp_path / "adapters/toy.py").read_text() == TOY
