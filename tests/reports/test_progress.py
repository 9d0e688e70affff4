"""The progress line: what it counts, and what is said where a plan does not end."""

import io
import re
from dataclasses import replace

import pytest
from rich.console import Console

from reports import progress
from validation.cells import Observation, Outcome, Slot
from validation.records.store import Store
from validation.running.warming import Part, key_of

SLOTS = [Slot("impact", (("v", float(v)),), 2, "toy", "default", 1 / 240) for v in range(1, 5)]


def answer(slot):
    return Observation(slot, "c", 1, "1", Outcome.OK)


@pytest.fixture
def planned(tmp_path, monkeypatch):
    """`planned(cells, slots, **options)`: the run of a plan that `cells(todo, leave)` answers, and the text."""
    store = Store(tmp_path)
    monkeypatch.setattr(progress, "missing", lambda slots: [])

    def make(cells, slots=SLOTS, terminal=True, **options):
        def run_cells(todo, jobs, timeout, keep, shown, record, leave, parts, compiled):
            make.parts = parts
            for part in parts:
                compiled(part)
            return cells(todo, leave)

        monkeypatch.setattr(progress, "run_cells", run_cells)
        text = io.StringIO()
        console = Console(file=text, force_terminal=terminal, width=120, color_system=None, highlight=False)
        return progress.run_plan(store, "quick: impact", slots, console, **options), text.getvalue()

    make.store = store
    yield make
    store.close()


def counted(text):
    """What the progress line counted, in order: done and of how many."""
    return [(int(a), int(b)) for a, b in re.findall(r"(\d+)/(\d+)", text)]


def test_progress_line_with_count_and_last_cell(planned):
    run, said = planned(lambda todo, leave: map(answer, todo))
    assert counted(said)[-1] == (4, 4) and "impact on toy" in said
    assert run.finished and {o.slot for o in planned.store.observations(run)} == set(SLOTS)


def test_missing_kernels_compiled_beside_the_cells(planned, monkeypatch, tmp_path):
    part = Part(key_of(SLOTS[0]), tuple(SLOTS), tmp_path / "mark")
    monkeypatch.setattr(progress, "missing", lambda slots: [part] if slots else [])
    _, said = planned(lambda todo, leave: map(answer, todo))
    assert planned.parts == [part]
    assert "compiling the kernels of toy, once: one to three minutes on idle cores\n" in said
    assert "compiled toy/default 2-D" in said and "4 cases: " in said
    _, said = planned(lambda todo, leave: map(answer, todo), [*SLOTS, replace(SLOTS[0], engine="other")])
    assert "; other engines run meanwhile\n" in said
    _, said = planned(lambda todo, leave: map(answer, todo), SLOTS[:2], known=[answer(slot) for slot in SLOTS])
    assert (
        planned.parts == [] and "compil" not in said and "0 cases" not in said
    )  # results that are known need no kernels
    monkeypatch.setattr(progress, "run_cells_on", lambda where, todo, *rest: map(answer, todo))
    _, said = planned(None, cluster="tcp://elsewhere:1", fresh=True)
    assert "compil" not in said  # its machines have caches of their own


def test_no_progress_line_when_output_is_a_file(planned):
    _, said = planned(lambda todo, leave: map(answer, todo), terminal=False)
    assert counted(said) == [] and "\x1b" not in said


def test_resumed_plan_after_a_stop_with_reasons(planned):
    def cells(todo, leave):
        yield answer(todo[0])
        for slot in todo[1:3]:
            leave(slot, "three time-outs [of toy]")
        leave(todo[3], "another")

    run, said = planned(cells)
    lines = [line.strip() for line in said.splitlines()]
    assert "not run: 2 cases, three time-outs [of toy]" in lines and "not run: 1 case, another" in lines
    assert "this run is not complete; the same command resumes it" in lines and not run.finished
    asked = []
    again, said = planned(lambda todo, leave: map(answer, asked.extend(todo) or todo))
    assert asked == SLOTS[1:] and again.id == run.id and again.finished
    assert f"resuming run {run.id}: 1 of 4 cases done" in said
    assert min(counted(said)) == (1, 4) and max(counted(said)) == (4, 4)


def test_a_run_with_missing_cases_is_not_finished(planned):
    run, said = planned(lambda todo, leave: map(answer, todo[:3]))
    assert not run.finished and "the same command resumes it" in said
    asked = []
    again, _ = planned(lambda todo, leave: map(answer, asked.extend(todo) or todo))
    assert asked == SLOTS[3:] and again.id == run.id and again.finished


def test_ctrl_c_during_a_run_loses_nothing(planned):
    def cells(todo, leave):
        yield answer(todo[0])
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        planned(cells)
    (run,) = planned.store.runs()
    assert [o.slot for o in planned.store.observations(run)] == SLOTS[:1] and not run.finished
    _, said = planned(lambda todo, leave: map(answer, todo))
    assert "1 of 4 cases done" in said


def test_known_answers_kept_and_not_asked_again(planned):
    asked = []
    elsewhere = Slot("impact", (("v", 9.0),), 2, "toy", "default", 1 / 240)
    run, said = planned(
        lambda todo, leave: map(answer, asked.extend(todo) or todo), known=[answer(SLOTS[1]), answer(elsewhere)]
    )
    assert asked == [SLOTS[0], SLOTS[2], SLOTS[3]] and counted(said)[-1] == (4, 4)
    assert {o.slot for o in planned.store.observations(run)} == set(SLOTS) and run.finished


def test_a_bench_ends_its_run_itself(planned):
    run, _ = planned(lambda todo, leave: map(answer, todo), finish=False)
    assert not run.finished
