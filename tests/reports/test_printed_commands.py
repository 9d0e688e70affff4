"""Commands below brackets and field notes ask for exactly the cell that they prove."""

import math
import shlex

import pytest

from adapters.registry import facts
from reports.command.benching import bench
from reports.command.running import run
from reports.command.selection import Cases, taken
from reports.page import again
from reports.wording import reproduce
from validation.field import notes
from validation.posed import resolve
from validation.questions.frontier import QUICK_RATIO, axes, brackets, fate_of, search, slot_at
from validation.running.execution import execute
from validation.running.plan import slots

ENGINES = ("reference", "chipmunk", "bullet", "mujoco")


def asked_by(command):
    """Cells of a command, planned as the command plans them."""
    words = shlex.split(command)
    assert words[:2] == ["crosscheck", "run"]
    return slots(taken(Cases, run.make_context("run", words[2:]).params).request())


@pytest.mark.parametrize(
    "line",
    [
        pytest.param("", marks=pytest.mark.long),  # plans every cell of every scene twice
        "--engine chipmunk --standard",
        "bounce --param e=0.8 --param height=1.03 --engine bullet --engine mujoco --profile tuned --dt 1/120 --dim 3",
        "impact stack --iterations 7 --ulp -1",
        "'{}/a b.toml' --engine mujoco --dim 2",
    ],
)
def test_command_that_repeats_the_run_of_a_page(line, tmp_path):
    """It named scenes and suite alone: of a run of one profile at one step the command made another run."""
    (tmp_path / "a b.toml").write_text(
        'name = "b"\ndimension = 2\ngravity = [0.0, -9.81]\nduration = 0.1\n'
        '[[bodies]]\nname = "ball"\nshape = { type = "disc", radius = 0.5 }\n'
    )
    cases = taken(Cases, run.make_context("run", shlex.split(line.format(tmp_path))).params)
    request = cases.request()
    said = again("run", f"{request.suite}: {cases.words(request.scenes)}")
    assert said.endswith("--out again") and len(said) < 250  # all of our scenes are not named one by one
    assert asked_by(said) == slots(request)


def test_page_with_the_command_of_its_bench():
    words = "impact --engine chipmunk --profile tuned --dt 1/60 --full"
    cases = taken(Cases, bench.make_context("bench", shlex.split(words)).params)
    said = again("bench", f"full: {cases.words(cases.request().scenes)}")
    assert said == "crosscheck bench impact --engine chipmunk --profile tuned --dt 1/60 --full --out again"


def between(own):
    """Values of an axis: its ends, and some that a bisection may come to."""
    ends = (own.easy, own.hard, own.hardest)
    if own.axis == "iterations":
        return {int(value) for value in ends}
    return {*ends, math.sqrt(abs(own.easy * own.hard)) or own.hard / 3.0} if not own.whole else {*ends}


@pytest.mark.few(4)
@pytest.mark.parametrize(("scene", "own"), axes(), ids=lambda x: x if isinstance(x, str) else x.name)
def test_command_of_an_end_of_a_bracket(scene, own):
    found = brackets([scene], ENGINES, (), (), quick=True)
    mine = [each for each in found if each.frontier == own]
    assert mine
    for each in mine:
        for value in between(own):
            slot = slot_at(each, value)
            (again,) = asked_by(reproduce(slot.as_dict()))
            canonical = resolve(scene)
            assert canonical.complete(dict(again.params)) == canonical.complete(dict(slot.params))
            assert (again.engine, again.profile, again.dimension, again.dt, again.iterations) == (
                slot.engine, slot.profile, slot.dimension, slot.dt, slot.iterations,
            )  # fmt: skip


@pytest.mark.parametrize("note", notes(), ids=lambda note: note.source)
def test_command_of_a_field_note(note):
    (again,) = asked_by(reproduce(note.slot.as_dict()))
    canonical = resolve(note.scene)
    assert canonical.complete(dict(again.params)) == canonical.complete(dict(note.slot.params))
    assert (again.engine, again.profile, again.dimension, again.dt) == (
        note.engine, note.profile, note.dimension, note.dt,
    )  # fmt: skip


def test_cells_of_a_bracket_run_again():
    pytest.importorskip("pymunk")
    assert facts("chipmunk")
    (one,) = brackets(["thin_wall"], ["chipmunk"], ["tuned"], [2], quick=True)
    list(search([one], QUICK_RATIO))
    for end in (one.survives, one.fails):
        (slot,) = asked_by(reproduce(end.slot.as_dict()))
        assert fate_of(one.frontier, execute(slot)) == end.fate
