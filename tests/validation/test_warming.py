"""What is compiled ahead of the clock is all that cells need, and takes no more than their first steps."""

import sys
import time

import pytest

from validation.catalogue import OURS
from validation.cells import Slot
from validation.running import warming
from validation.running.execution import execute
from validation.running.plan import Request, slots

SLOT = Slot("impact", (), 2, "chipmunk", "tuned", 1 / 240)


def compiled():
    """Every kernel with each kind of arguments it has machine code for."""
    modules = [module for name, module in sys.modules.items() if name.startswith("reference_solver.")]
    found = [kernel for module in modules for kernel in vars(module).values() if hasattr(kernel, "overloads")]
    return {(kernel.py_func.__module__, kernel.__name__, kinds) for kernel in found for kinds in kernel.overloads}


@pytest.mark.parametrize("dimension", [2, 3])
def test_whole_cells_call_no_kernel_that_first_steps_left_alone(dimension):
    """One cell of each scene and profile of the quick suite, moved by an ulp: run once, not again for a certificate."""
    request = Request(scenes=list(OURS), engines=["reference"], dimensions=[dimension], ulps=[1])
    group = [slot for found in warming._groups(slots(request)).values() for slot in found.values()]
    assert len(group) > 30
    warming._compile([slot.as_dict() for slot in group])
    ready = compiled()
    assert {"run_located", "run_steps"} <= {name for _, name, _ in ready}
    for slot in group:
        execute(slot)
        assert compiled() == ready, slot


def test_a_warmed_cell_makes_its_first_steps_and_no_more(monkeypatch):
    made = []
    run = warming.run
    monkeypatch.setattr(warming, "run", lambda *arguments: made.append(run(*arguments)))
    warming._compile([SLOT.as_dict()])
    assert [len(trajectory.t) - 1 for trajectory in made] == [warming.STEPS]


def test_what_fails_while_it_is_warmed_stops_nothing(monkeypatch):
    made = []

    def fail(*arguments):
        made.append(arguments)
        raise RuntimeError("planted")

    monkeypatch.setattr(warming, "run", fail)
    warming._compile([SLOT.as_dict(), SLOT.as_dict()])
    assert len(made) == 2


def test_a_compilation_is_remembered_by_its_cpu_time(monkeypatch):
    """Waiting is what a busy machine adds; it must not make the next estimate longer."""
    monkeypatch.setattr(warming, "first_steps", lambda slot: time.sleep(0.5))
    assert warming._compile([SLOT.as_dict()]) < 0.25
