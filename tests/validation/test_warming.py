"""What is compiled before a cell's clock starts is all that cells need, and takes no more than first steps."""

import sys
from dataclasses import replace
from types import MappingProxyType, SimpleNamespace

import pytest

from adapters.engine import Engine
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


@pytest.mark.long
@pytest.mark.parametrize("dimension", [2, 3])
def test_kernels_of_whole_cells_compiled_by_first_steps(dimension, monkeypatch, tmp_path):
    """One cell of each scene of the quick suite, moved by an ulp: run once, not again for a certificate.

    The first steps are those of each scene.
    """
    monkeypatch.setattr(warming, "_folder", lambda name: tmp_path)
    parts = warming.missing(slots(Request(list(OURS), ["reference"], dimensions=[dimension], ulps=[1])))
    assert [part.key[1] for part in parts] == ["classical", "reference"]
    assert all(warming.compile_one(part.slots) for part in parts)
    ready = compiled()
    assert {"run_steps", "first_meeting"} <= {name for _, name, _ in ready}
    for slot in (slot for part in parts for slot in part.slots):
        execute(slot)
        assert compiled() == ready, slot


def test_compilation_by_first_steps_of_each_cell(monkeypatch):
    made = []
    run = warming.run
    monkeypatch.setattr(warming, "run", lambda *arguments: made.append(run(*arguments)))
    assert warming.compile_one([SLOT, replace(SLOT, params=(("v", 2.0),))])
    assert [len(trajectory.t) - 1 for trajectory in made] == [warming.STEPS] * 2


def test_compilation_with_refused_cells(monkeypatch):
    asked = []

    def first_steps(slot):
        asked.append(slot)
        if len(asked) < 3:
            raise RuntimeError("planted")

    monkeypatch.setattr(warming, "first_steps", first_steps)
    assert warming.compile_one([SLOT] * 4) and len(asked) == 4
    asked.clear()
    assert not warming.compile_one([SLOT] * 2)


class Compiling(Engine):
    """An engine that compiles into a folder; nothing of it runs here."""

    profiles = MappingProxyType({})

    def __init__(self, folder):
        self.folder = folder

    def kernels(self):
        if self.folder is not None:
            self.folder.mkdir(parents=True, exist_ok=True)
        return self.folder

    version = build = declares = refuses = None


PLAN = [Slot(scene, params, dimension, engine, profile, 1 / 240)
        for scene in ("impact", "bounce") for dimension in (2, 3) for engine in ("toy", "chipmunk")
        for profile in ("tuned", "default") for params in ((), (("e", 0.0),))]  # fmt: skip


@pytest.fixture
def toy(monkeypatch, tmp_path):
    """`toy(plan, version)`: kernels that a plan lacks; the toy engine alone compiles."""

    def make(plan=PLAN, version="a"):
        engine = Compiling(version and tmp_path / version)
        monkeypatch.setattr(warming, "find", lambda name: SimpleNamespace(engine=engine if name == "toy" else None))
        return warming.missing(plan)

    return make


def test_order_of_parts_to_compile(toy):
    parts = toy()
    assert [str(part) for part in parts] == ["toy/tuned 3-D", "toy/tuned 2-D", "toy/default 3-D", "toy/default 2-D"]
    for part in parts:  # one cell a scene
        assert [(slot.scene, slot.params) for slot in part.slots] == [("impact", ()), ("bounce", ())]
        assert {warming.key_of(slot) for slot in part.slots} == {part.key}


def test_compiled_parts_for_all_scenes(toy):
    first, *rest = toy(PLAN[:16])
    first.keep()
    assert first.mark.read_text() == "toy/tuned 3-D\n"
    assert toy(PLAN[:16]) == rest
    assert [part.key for part in toy()] == [part.key for part in rest]  # other scenes as well
    assert len(toy(version="b")) == 4  # other sources


def test_parts_of_a_profile_with_own_settings(toy):
    for part in toy():
        part.keep()
    own = [slot.with_own((("iterations", 9),)) for slot in PLAN]
    assert [part.key[1] for part in toy(own)] == ["tuned+iterations=9"] * 2 + ["default+iterations=9"] * 2
    assert toy([replace(slot, iterations=9, dt=1 / 60, ulp=1) for slot in PLAN]) == []


def test_engines_without_parts_to_compile(toy):
    assert toy(version=None) == [] and toy([SLOT]) == [] and toy([]) == []


def test_unwritable_mark_stops_nothing(toy):
    part = toy()[0]
    part.mark.parent.rmdir()
    part.keep()
    assert len(toy()) == 4
