"""What is compiled ahead of the clock is all that cells need, and takes no more than their first steps."""

import os
import sys
import time
from concurrent.futures import Future
from concurrent.futures.process import BrokenProcessPool
from dataclasses import replace
from types import MappingProxyType, SimpleNamespace

import pytest

from adapters.engine import Engine
from adapters.isolation import end_with
from validation.catalogue import OURS
from validation.cells import Slot
from validation.running import warming
from validation.running.execution import execute
from validation.running.plan import Request, slots
from validation.running.warming import Warming

SLOT = Slot("impact", (), 2, "chipmunk", "tuned", 1 / 240)


def compiled():
    """Every kernel with each kind of arguments it has machine code for."""
    modules = [module for name, module in sys.modules.items() if name.startswith("reference_solver.")]
    found = [kernel for module in modules for kernel in vars(module).values() if hasattr(kernel, "overloads")]
    return {(kernel.py_func.__module__, kernel.__name__, kinds) for kernel in found for kinds in kernel.overloads}


@pytest.mark.long
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


class Compiling(Engine):
    """An engine that compiles into a folder, of a version of its sources; nothing of it runs here."""

    profiles = MappingProxyType({})

    def __init__(self, folder, version):
        self.folder = folder / version

    def kernels(self):
        self.folder.mkdir(parents=True, exist_ok=True)
        return self.folder

    version = build = declares = refuses = None


PLAN = [replace(SLOT, engine="toy", dimension=d, scene=s, params=p) for d in (2, 3)
        for s, p in (("impact", ()), ("impact", (("e", 0.0),)), ("bounce", ()))]  # fmt: skip


@pytest.fixture
def toy(monkeypatch, tmp_path):
    """`toy(version, taken, fails)`: what is left to compile for `PLAN`, and the cells that are asked for it.

    Parts run in this process one after another, for ``taken`` seconds each; that of the dimension ``fails`` dies.
    """
    asked = []

    class Pool:
        def __init__(self, workers, context, begin, parent):
            asked.append(workers)
            assert (begin, parent) == (end_with, (os.getpid(),))

        def __enter__(self):
            return self

        def __exit__(self, *of):
            return None

        def submit(self, work, slots):
            future = Future()
            asked.append(slots)
            if slots[0]["dimension"] == self.fails:
                future.set_exception(BrokenProcessPool("it died"))
            else:
                future.set_result(self.taken)
            return future

    def make(version="a", taken=10.0, fails=0):
        Pool.taken, Pool.fails = taken, fails
        engine = Compiling(tmp_path, version)
        monkeypatch.setattr(warming, "find", lambda name: SimpleNamespace(engine=engine if name == "toy" else None))
        monkeypatch.setattr(warming, "ProcessPoolExecutor", Pool)
        return Warming(PLAN)

    make.asked = asked
    return make


def test_each_scene_and_profile_of_a_dimension_is_compiled_once_and_a_part_a_dimension(toy):
    left = toy()
    assert len(left) == 2 and sorted(left.run(8)) == ["toy 2-D", "toy 3-D"]
    workers, *parts = toy.asked
    assert workers == 2  # no more than there are parts
    assert [[(cell["dimension"], cell["scene"], cell["params"]) for cell in part] for part in parts] == [
        [(d, "impact", {}), (d, "bounce", {})] for d in (2, 3)
    ]


def test_what_was_compiled_is_not_again_until_the_sources_or_the_plan_are_others(toy, monkeypatch):
    list(toy().run(1))
    assert toy.asked[0] == 1 and len(toy()) == 0
    assert len(toy("b")) == 2
    monkeypatch.setitem(globals(), "PLAN", [*PLAN, replace(PLAN[0], profile="another")])
    assert len(toy()) == 1


def test_a_part_that_dies_is_told_and_left_for_the_next_time(toy):
    assert sorted(toy(fails=3).run(2)) == ["toy 2-D", "toy 3-D"]
    left = toy()
    assert len(left) == 1 and list(left.run(2)) == ["toy 3-D"]


def test_what_is_expected_is_the_longest_of_before_for_each_round_of_processes(toy):
    least = warming.FIRST / 2.0  # where none is known, or it found its kernels ready
    assert [toy().estimate(jobs) for jobs in (0, 1, 2, 3)] == [2.0 * least, 2.0 * least, least, least]
    list(toy(taken=10.0).run(1))
    assert toy("b").estimate(2) == least
    list(toy("b", taken=400.04).run(1))
    assert toy("c").estimate(1) == 800.0 and toy("c").estimate(2) == 400.0


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"cpu_seconds": null}', '{"cpu_seconds": "long"}'])
def test_a_mark_that_cannot_be_read_says_nothing_and_stops_nothing(toy, text, tmp_path):
    (tmp_path / "old").mkdir()
    (tmp_path / "old" / "warm-0.json").write_text(text)
    assert toy().estimate(2) == warming.FIRST / 2.0


def test_engines_that_compile_nothing_or_are_not_here_have_nothing_to_do(toy, monkeypatch):
    toy()
    monkeypatch.setattr(Compiling, "kernels", lambda self: None)
    assert len(Warming(PLAN)) == 0 and len(Warming([SLOT])) == 0 and len(Warming([])) == 0


@pytest.mark.parametrize(("before", "begun"), [([], False), ([2], True), ([3], False), ([3, 2], True)])
def test_kernels_that_other_cells_have_compiled_are_said_to_be_there(tmp_path, monkeypatch, before, begun):
    """A mark beside the kernels says of which dimension they are; new cells of one that is there wait for little."""

    class Compiling(Engine):
        profiles = MappingProxyType({})

        def kernels(self):
            return tmp_path

    Compiling.__abstractmethods__ = frozenset()
    monkeypatch.setattr(warming, "find", lambda name: SimpleNamespace(engine=Compiling()))
    for dimension in before:
        (tmp_path / f"warm-{dimension}.json").write_text(f'{{"cpu_seconds": 1.0, "dimension": {dimension}}}')
    assert Warming([SLOT]).begun is begun
    assert Warming([SLOT, replace(SLOT, dimension=3)]).begun is (len(before) == 2)
