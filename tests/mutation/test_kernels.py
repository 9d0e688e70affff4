"""Faults that are drawn for the solver's kernels: each is one change of one kernel, or of one constant."""

import ast
import importlib
import sys
from pathlib import Path

import pytest


@pytest.fixture
def kernels(monkeypatch):
    monkeypatch.syspath_prepend(str(Path(__file__).parent))
    kept = set(sys.modules)
    yield importlib.import_module("kernels")
    for name in set(sys.modules) - kept:
        if name in ("kernels", "checkout", "reach", "subjects", "pytest_apart"):
            del sys.modules[name]


def test_each_fault_changes_one_statement_of_a_kernel_or_one_constant(kernels):
    modules = ["reference_solver/stepping/phase.py", "reference_solver/planar/curve.py"]
    faults = [each for module in modules for each in kernels.faults_of(module)]
    chosen = kernels.draw(3, 40, faults)
    assert kernels.draw(3, 20, faults) == chosen[:20] and kernels.draw(4, 20, faults) != chosen[:20]
    assert {each.kind for each in chosen} == {each.kind for each in faults}
    for each in chosen:
        before, after = (
            ast.parse(text).body for text in ((kernels.ROOT / each.module).read_text(), kernels.planted(each))
        )
        changed = [own for own, other in zip(before, after, strict=True) if ast.dump(own) != ast.dump(other)]
        assert len(changed) == 1
        name = changed[0].name if each.function else changed[0].targets[0].id
        assert name == (each.function or each.constant)
        assert all(block.startswith("reference_solver.") for block in kernels.blocks_of(each, modules))


def test_the_constant_that_no_test_saw_is_among_them_and_reached_where_it_is_named(kernels):
    module = "reference_solver/stepping/turning_slips.py"
    fault = next(each for each in kernels.faults_of(module) if each.constant == "TURNED" and each.kind == "doubled")
    assert "TURNED = 2.0 * 0.5\n" in kernels.planted(fault)
    assert kernels.blocks_of(fault, [module]) == (
        "reference_solver.stepping.turning_slips.x_follow_slip:",
        "reference_solver.stepping.turning_slips.x_steady_slip:",
    )
