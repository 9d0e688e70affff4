"""Searches of settings where what each change does is made up: which is tried, which is kept, and when it ends."""

import math
from types import SimpleNamespace

import pytest

from validation.cells import Slot
from validation.settings import tuning
from validation.settings.tuning import GAIN, INVISIBLE, Score

SLOT = Slot("stack", (("n", 3.0),), 2, "toy", "tuned", 1 / 240)


def reading(badness, metric="creep", slot=SLOT):
    return SimpleNamespace(badness=badness, check=SimpleNamespace(metric=metric), slot=slot)


def key(changes):
    return tuple(sorted(changes.items()))


class World:
    """A bench of each kind of cells: ``said[kind][changes]`` are the badnesses of its two checks."""

    def __init__(self, monkeypatch, candidates, **said):
        self.asked, self.said, self.told = [], said, []
        monkeypatch.setattr(tuning, "candidates_of", lambda engine: candidates)
        monkeypatch.setattr(tuning, "_own", lambda slot, name: {"a": 1}.get(name))
        monkeypatch.setattr(tuning, "_starved", lambda slots: [("starved", *slots)])
        monkeypatch.setattr(tuning, "cells_of", lambda group, held_out=False: (group, held_out))
        monkeypatch.setattr(tuning, "slots_of", lambda *given: [given])
        monkeypatch.setattr(tuning, "_needless", lambda engine, bench, changes: {"for": (engine, key(changes))})
        world = self

        class Bench:
            def __init__(self, slots, jobs):
                self.slots, self.jobs = slots, jobs
                first = slots[0]
                self.kind = "starved" if first[0] == "starved" else "held" if first[2][1] else "searched"

            def prepare(self, many):
                world.asked.append((self.kind, self.jobs, [key(each) for each in many]))

            def readings(self, changes):
                told, usual = world.said.get(self.kind, {}), (10.0, 10.0) if self.kind == "searched" else (0.5, 0.5)
                both = zip(told.get(key(changes), usual), "xy", strict=True)
                return [reading(bad, metric) for bad, metric in both]

        monkeypatch.setattr(tuning, "_Bench", Bench)

    def search(self):
        return tuning.search("toy", "tuned", "rest", 3, (2,), lambda changes, score: self.told.append(key(changes)))


A2, A3, B5, BOTH = (("a", 2),), (("a", 3),), (("b", 5),), (("a", 2), ("b", 5))
CANDIDATES = {"a": (1, 2, 3), "b": (5,)}
SEARCHED = {
    (): (10.0, 10.0), A2: (0.5, 10.0), A3: (0.9, 10.0), B5: (10.0, 0.9), BOTH: (0.5, 0.9),
    (("a", 3), ("b", 5)): (0.9, 0.9),
}  # fmt: skip


def test_rounds_of_best_changes(monkeypatch):
    world = World(monkeypatch, CANDIDATES, searched=SEARCHED)
    found = world.search()
    assert (found.engine, found.profile, found.group) == ("toy", "tuned", "rest")
    assert found.changes == dict(BOTH) and found.needless == {"for": ("toy", BOTH)}
    assert (found.before.failing, found.after.failing) == (2, 0)
    assert found.before.decades == pytest.approx(2.0 * math.log10(10.0 / INVISIBLE))
    assert found.after == tuning.score([reading(0.5), reading(0.9)])
    # What the profile or the search has is not tried again; a value may go back to another one.
    wanted = [A2, A3, B5, (("a", 1),), A3, BOTH, (("a", 1), ("b", 5)), (("a", 3), ("b", 5))]
    assert world.told == wanted and [key(trial.changes) for trial in found.trials] == wanted
    rounds = [many for kind, jobs, many in world.asked if kind == "searched" and jobs == 3]
    assert rounds[:2] == [[A2, A3, B5], [(("a", 1),), A3, BOTH]]
    assert {jobs for _, jobs, _ in world.asked} == {3}
    held = [many for kind, _, many in world.asked if kind == "held"]
    assert held == [[A2, A3, B5], [BOTH], []]  # the helpful ones, the best first
    assert [many for kind, _, many in world.asked if kind == "starved"] == held
    assert found.held_out == (tuning.score([reading(0.5)] * 2),) * 2


@pytest.mark.parametrize(
    ("kind", "bad", "changes"),
    [
        ("held", (2.0, 0.5), (("a", 3), ("b", 5))), ("starved", (0.5, 2.0), (("a", 3), ("b", 5))),
        ("held", (0.9, 0.9), (("a", 3), ("b", 5))), ("starved", (0.9, 0.9), BOTH),
    ],
)  # fmt: skip
def test_change_that_harms_other_cells(monkeypatch, kind, bad, changes):
    world = World(monkeypatch, CANDIDATES, searched=SEARCHED, **{kind: {A2: bad}})
    if kind == "held" or bad[1] > 1.0:
        world.said[kind][BOTH] = bad
    assert key(world.search().changes) == changes


def test_change_of_the_iteration_count(monkeypatch):
    more = (("iterations", 50),)
    searched = {(): (10.0, 10.0), more: (0.5, 0.5)}
    for name, kept in (("iterations", True), ("other", False)):
        own = ((name, 50),)
        world = World(
            monkeypatch, {name: (50,)}, searched={(): (10.0, 10.0), own: (0.5, 0.5)}, starved={own: (2.0, 2.0)}
        )
        assert (key(world.search().changes) == own) == kept
    world = World(monkeypatch, {"iterations": (50,)}, searched=searched | {more: (0.5, 20.0)})
    assert key(world.search().changes) == more  # one fail less
    world = World(monkeypatch, {"b": (5,)}, searched={(): (0.5, 10.0), B5: (2.0, 0.5)})
    assert world.search().changes == {}  # as many fails, and one of them is new


def test_settings_changed_in_all_rounds(monkeypatch):
    names = [f"s{k}" for k in range(6)]

    class Better(dict):
        def get(self, changes, default):
            return (10.0 ** (1 - len(changes)), 100.0)

    world = World(monkeypatch, {name: (1,) for name in names}, searched=Better())
    found = world.search()
    assert len(found.changes) == tuning.ROUNDS and list(found.changes) == names[: tuning.ROUNDS]


def test_score_by_failures_and_visible_errors():
    told = tuning.score([reading(bad) for bad in (0.0, INVISIBLE, 0.1, 1.0, 1.001, 1e5, math.inf)])
    assert told.failing == 3
    assert told.decades == pytest.approx(2.0 + 3.0 + math.log10(1001.0) + 6.0 + 6.0)
    one = Score(2, 5.0)
    for other, better in (
        (Score(1, 9.0), True), (Score(3, 1.0), False), (Score(2, 5.0 - 1.01 * GAIN), True),
        (Score(2, 5.0 - 0.99 * GAIN), False), (Score(2, 5.0), False),
    ):  # fmt: skip
        assert other.better_than(one) == better


def test_broken_checks_by_scene_parameters_and_metric():
    plain = Slot("impact", (), 3, "toy", "tuned", 1 / 240)
    before = [reading(1.0), reading(0.5, "drift"), reading(2.0, "spin"), reading(0.1, "apex", plain)]
    after = [reading(1.01), reading(1.0, "drift"), reading(3.0, "spin"), reading(9.0, "apex", plain)]
    assert tuning.broken(before, after) == (f"stack 2-D {SLOT.params_text()} creep", "impact 3-D apex")
