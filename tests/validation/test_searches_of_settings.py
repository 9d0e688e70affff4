"""Searches over settings, from the first cell to the answer, on an engine whose settings do what a table says.

Nothing is simulated: how many tolerances each check of a cell is off is read from the settings that it is asked with,
so that every number of an answer is known beforehand.
"""

import math
from dataclasses import replace
from types import SimpleNamespace

import pytest

from adapters.engine import Setting
from adapters.experiment import Cured
from validation.bench.units import Unit
from validation.cells import Observation, Outcome, Slot
from validation.fixes import kept
from validation.fixes import search as cures
from validation.fixes.kept import Cure
from validation.fixes.panel import Cost, Panel
from validation.fixes.search import Unsearched
from validation.settings import decisive, tuning
from validation.settings.decisive import ALONE, COMPLETES, NEEDED, Part
from validation.settings.switching import readings
from validation.settings.tuning import Score

DT = 1 / 240
#: Bounds of blows are so small that a value a few of them off is rounded in their fifth digit.
ROUNDED = 1e-4


class Asked:
    """What is asked of the engine, and answers of which the first checks are off by ``off(slot)`` tolerances."""

    def __init__(self, off, unmeasured=()):
        self.off, self.unmeasured, self.calls = off, unmeasured, []

    def __call__(self, slots, jobs=1):
        self.calls.append((list(slots), jobs))
        return {slot: self.answer(slot) for slot in slots}

    def answer(self, slot):
        blank = Observation(slot, "c", 1, "1", Outcome.OK)
        checks = [each.check for each in readings(blank)]
        by = [*self.off(slot), *[0.0] * len(checks)]
        told = {c.metric: (c.truth + k * c.bound, "") for c, k in zip(checks, by, strict=False)}
        return replace(blank, metrics={name: own for name, own in told.items() if name not in self.unmeasured})

    @property
    def slots(self):
        return [slot for slots, _ in self.calls for slot in slots]


def decades(*off):
    """Decades of error over tolerance above a thousandth of it, where nothing counts beyond a thousand."""
    return pytest.approx(sum(math.log10(min(max(each, 1e-3), 1e3) / 1e-3) for each in off), abs=1e-9)


# ---- a profile is searched again ----

#: As the profile has it, and as it is shipped.
OWN, SHIPPED = {"a": 0, "b": 0, "c": 5, "d": 7}, {"a": 0, "b": 0, "c": 0, "d": 7}


def searched_again(monkeypatch, off, candidates, **more):
    """A search of blocks that stand, two of them searched with and one held out."""
    asked = Asked(off)
    cells = {False: (("stack", {"n": 2.0}),), True: (("stack", {"n": 1.0}),)}
    engine = SimpleNamespace(settings=lambda profile, needs, dt: [
        Setting(name, value, "so") for name, value in SHIPPED.items() if (profile, dt) == ("default", DT)
    ])  # fmt: skip
    monkeypatch.setattr(tuning, "observe", asked)
    monkeypatch.setattr(tuning, "cells_of", lambda group, held_out=False: cells[held_out] if group == "stand" else ())
    monkeypatch.setattr(tuning, "candidates_of", lambda engine: candidates if engine == "toy" else {})
    monkeypatch.setattr(tuning, "_own", lambda slot, name: OWN.get(name))
    monkeypatch.setattr(tuning, "load", lambda name: engine)
    monkeypatch.setattr(tuning, "has_iterations", lambda engine, slot: True)
    monkeypatch.setattr(tuning, "profile_of", lambda engine, role: "default" if role == "shipped" else None)
    return tuning.search("toy", "tuned", "stand", dimensions=(2,), **more), asked


def of_blocks(slot):
    """Two checks are mended by two settings; what mends both at once harms one block, and another hurries."""
    s, n = dict(slot.switched), dict(slot.params)["n"]
    if n == 1.0:
        return (2.0 if s.get("a") == 2 else 0.5,)
    if slot.iterations is not None:
        return (4.0, 2.0 if s.get("e") else 0.5)
    both = s.get("a") == 2 or s.get("e")
    first, second = (0.5 if s.get("a") or both else 9.0), (0.5 if s.get("b") or both else 30.0)
    return first, second, 0.0, 2.0 if s.get("b") == 2 else 0.1


def test_search_of_a_profile_by_setting_with_all_numbers(monkeypatch):
    heard = []
    candidates = {"a": (0, 1, 2), "b": (1, 2), "c": (5,), "e": (1,)}
    found, asked = searched_again(
        monkeypatch, of_blocks, candidates, jobs=3, progress=lambda changes, score: heard.append((dict(changes), score))
    )
    assert (found.engine, found.profile, found.group) == ("toy", "tuned", "stand")
    assert found.before == Score(2, decades(9.0, 30.0, 0.1)) and found.after == Score(0, decades(0.5, 0.5, 0.1))
    # b first, for it gains more than a; the two that mend all at once harm one block, or take what stops at a count.
    assert found.changes == {"b": 1, "a": 1}
    assert found.held_out == (Score(0, decades(0.5)), Score(0, decades(0.5)))
    tried = [(dict(t.changes), t.score.failing, t.broken) for t in found.trials]
    broken = ("stack 2-D n=2 kinetic_energy",)
    assert tried == [
        ({"a": 1}, 1, ()), ({"a": 2}, 0, ()), ({"b": 1}, 1, ()), ({"b": 2}, 2, broken), ({"e": 1}, 0, ()),
        ({"b": 1, "a": 1}, 0, ()), ({"b": 1, "a": 2}, 0, ()), ({"b": 2}, 2, broken), ({"b": 1, "e": 1}, 0, ()),
        ({"b": 1, "a": 0}, 1, ()), ({"b": 1, "a": 2}, 0, ()), ({"b": 2, "a": 1}, 1, broken),
        ({"b": 1, "a": 1, "e": 1}, 0, ()),
    ]  # fmt: skip
    assert heard == [(dict(t.changes), t.score) for t in found.trials]
    assert found.trials[0].score == Score(1, decades(0.5, 30.0, 0.1))
    assert found.trials[2].score == Score(1, decades(9.0, 0.5, 0.1))
    # What the profile sets otherwise than it is shipped, and as well: c. Without a or b checks fail; d is as shipped.
    assert found.needless == {"c": 0}
    assert {jobs for _, jobs in asked.calls} == {3} and len(asked.slots) == len(set(asked.slots))
    assert {slot.iterations for slot in asked.slots} == {None, 1, 10}


def test_fewer_own_sweeps_at_more_requested_ones(monkeypatch):
    def off(slot):
        asked = slot.iterations
        return (0.5,) if asked == 100 else (9.0,) if asked is None else (0.5 if not slot.switched else 9.0,)

    found, _ = searched_again(monkeypatch, off, {"iterations": (100,)})
    # One block held out fares better with them as well, and passes.
    assert found.changes == {"iterations": 100} and [score.failing for score in found.held_out] == [1, 0]


def test_search_without_a_visible_gain_and_limit_of_rounds(monkeypatch):
    found, _ = searched_again(monkeypatch, lambda slot: (8.0 if dict(slot.switched).get("a") else 9.0,), {"a": (1,)})
    assert found.changes == {} and found.before == found.after  # a twentieth of a decade
    many = {name: (1,) for name in "efghij"}
    found, _ = searched_again(monkeypatch, lambda slot: (9.0 * 0.5 ** len(slot.switched),), many)
    assert len(found.changes) == tuning.ROUNDS == 4 and found.after.failing == 0


def test_settings_of_an_engine_without_a_shipped_profile(monkeypatch):
    asked = Asked(lambda slot: (0.5,))
    monkeypatch.setattr(tuning, "observe", asked)
    monkeypatch.setattr(tuning, "profile_of", lambda engine, role: None)
    bench = tuning._Bench([Slot("stack", (), 2, "toy", "tuned", DT)], 1)
    assert tuning._needless("toy", bench, {}) == {} and not asked.calls


# ---- a cure is searched ----

#: Three cells of a pinch; each states creep, turn, two mean loads, the least and greatest of both, and their balance.
JUDGED = 3 * (1 + 1 + 2 + 4 + 1)


def first(engine, trials, failing, found):
    """No panel: the best fix of the scene."""
    return (found[0] if found else None), None


def cured(
    monkeypatch, off, candidates, whole=None, unmeasured=(), ranked=("default", "tuned", "other"), panel=first, **more
):
    """A search on the standard cells of a box in a pinch; `clocked` is told twice and three times a millisecond."""
    asked, whole = Asked(off, unmeasured), whole or {}
    engine = SimpleNamespace(profiles=("default", "tuned", "other", "matched"))
    monkeypatch.setattr(cures, "observe", asked)
    monkeypatch.setattr(cures, "values_of", lambda slot: {"a": 0, "b": 0, "c": 0, "iterations": 4})
    monkeypatch.setattr(cures, "load", lambda name: engine)
    monkeypatch.setattr(cures, "find", lambda name: SimpleNamespace(version=f"{name} 2.1"))
    monkeypatch.setattr(cures, "profile_of", lambda engine, role: "default" if role == "shipped" else None)
    monkeypatch.setattr(cures, "is_ranked", lambda engine, profile: profile in ranked)
    monkeypatch.setattr(cures, "candidates_of", lambda engine: candidates)
    monkeypatch.setattr(cures, "belongs_of", lambda engine: {"c": "b"})
    monkeypatch.setattr(cures, "has_iterations", lambda engine, slot: more.get("counts", False))
    monkeypatch.setattr(cures, "changes_of", lambda slot, name: dict(whole.get(name, {})))
    monkeypatch.setattr(cures, "carried", lambda changes, here, there: changes)
    monkeypatch.setattr(cures, "on_panel", panel)
    clocks = []
    monkeypatch.setattr(cures, "clocked", lambda slots: clocks.append(slots) or (2e-3, 3e-3))
    return cures.search("toy", "pinch", 2, jobs=2), asked, clocks


def of_a_pinch(slot):
    """The margin of the cell sets how far it is off; ``a`` mends what turns, but not where the margin is 100."""
    s, margin = dict(slot.switched), dict(slot.params).get("margin", 1.0)
    return 0.5, (0.25 if s.get("a") == 1 and margin < 100.0 else 2.0 * margin)


def test_cure_with_mended_checks_and_cost(monkeypatch):
    found, asked, clocks = cured(
        monkeypatch, of_a_pinch, {"a": (1,), "d": (1,)}, {"tuned": {"a": 1}, "other": {"b": 1}}
    )
    assert isinstance(found, Cure)
    bound = found.tolerance
    assert bound == pytest.approx(4.0875e-4, rel=1e-6)  # of `turned` at this step, as the scene states it
    (shown,) = found.shown
    assert (shown.metric, shown.before, shown.after) == ("turned", found.before, found.after)
    assert replace(found, shown=()) == Cure(
        "toy", "toy 2.1", "default", "pinch", 2, ({}, {"margin": 1.05}, {"margin": 100.0}), failing=3, left=1,
        judged=JUDGED, metric="turned", unit="m/s", params={"margin": 1.05}, truth=0.0, tolerance=bound,
        before=2.1 * bound, after=0.25 * bound, changes={"a": 1}, profile="tuned", others=(), tried=8, cost_before=2e-3,
        cost_after=3e-3,
    )  # fmt: skip
    # Alone: a, d and b; then a with itself, with d and with b; then all of either profile.
    assert found.helps and found.tried == 3 + 3 + 2
    shipped, with_it = clocks[0]
    assert (shipped.params, shipped.switched) == ((("margin", 1.05),), ()) and shipped.engine == "toy"
    assert (with_it.params, with_it.switched) == (shipped.params, (("a", 1),)) and len(clocks) == 1
    assert {jobs for _, jobs in asked.calls} == {2} and {slot.dt for slot in asked.slots} == {DT, cures.ELSEWHERE[1]}


def test_settings_that_a_fix_needs_on_the_panel(monkeypatch):
    """``a`` alone breaks two cases, which ``b`` of the profile mends; its ``d`` and ``e`` do nothing."""

    def tried(here, change, jobs):
        broken = Cost("a body at rest", "drift", "m", 0.0, 1.0, 0.0, here)
        return Panel(20, 1, () if "b" in change else (broken, broken))

    monkeypatch.setattr(cures, "tried", tried)
    monkeypatch.setattr(cures, "local_of", lambda engine: ())
    monkeypatch.setattr(cures, "instead_of", lambda engine: ())
    whole = {"tuned": {"a": 1, "b": 1, "d": 1, "e": 1}}
    turned = {True: 0.25, False: 2.0}
    found, *_ = cured(
        monkeypatch, lambda slot: (0.5, turned["a" in dict(slot.switched)]), {"a": (1,)}, whole, panel=cures.on_panel
    )
    assert found.changes == {"a": 1, "b": 1} and found.panel == Panel(20, 1, ())


def test_search_without_a_cure_told_by_the_worst_failure(monkeypatch):
    found, _, clocks = cured(monkeypatch, lambda slot: (0.5, 2.0 * dict(slot.params).get("margin", 1.0)), {"a": (1, 2)})
    assert not found.helps and (found.failing, found.left, found.judged, found.changes) == (3, 3, JUDGED, {})
    assert (found.metric, found.params, found.profile, found.others) == ("turned", {"margin": 100.0}, "", ())
    assert found.before == found.after == pytest.approx(200.0 * found.tolerance)
    assert (found.cost_before, found.cost_after, found.mends, found.tried) == (None, None, (), 2) and not clocks


def test_equivalent_single_settings_and_profile_of_a_whole_cure(monkeypatch):
    def off(slot):
        s = dict(slot.switched)
        return (0.5 if s.get("a") == 2 or s.get("b") == 3 or slot.iterations == 40 else 9.0,)

    found, _, _ = cured(
        monkeypatch, off, {"a": (1, 2), "b": (3,)}, {"tuned": {"a": 1}, "other": {"b": 3, "c": 1}}, counts=True
    )
    assert (found.failing, found.left, found.changes, found.profile) == (3, 0, {"a": 2}, "")
    # b comes alone and as its profile has it, with what belongs to it; ten times the sweeps do as well.
    assert found.others == ({"b": 3}, {"iterations": 40})
    assert found.mends == ("creep",) and found.tried == 5


@pytest.mark.parametrize(
    ("unmeasured", "off", "answer"),
    [
        ((), 0.5, Unsearched(True, f"it passes all {JUDGED} checks")),
        (("creep",), 0.5, None),
    ],
)
def test_passed_cells_not_searched_and_unmeasured_ones_failed(monkeypatch, unmeasured, off, answer):
    found, _, _ = cured(monkeypatch, lambda slot: (off,), {}, unmeasured=unmeasured)
    if answer:
        assert found == answer
    else:
        assert (found.failing, found.left, found.metric, found.before) == (3, 3, "creep", None)


def test_no_cure_from_a_profile_without_rank(monkeypatch):
    def off(slot):
        return (0.5 if dict(slot.switched).get("b") == 3 else 9.0,)

    for ranked, helps in ((("default", "other"), True), (("default", "tuned"), False)):
        found, _, _ = cured(monkeypatch, off, {}, {"other": {"b": 3}}, ranked=ranked)
        assert found.helps is helps and found.profile == ("other" if helps else "")


class FakeLane:
    """Laps of a table, in the order in which they are asked; whether it was started and stopped."""

    made: list["FakeLane"]

    def __init__(self, patience):
        self.patience, self.started, self.stopped, self.units = patience, 0, 0, []
        FakeLane.made.append(self)

    def start(self):
        self.started += 1

    def stop(self):
        self.stopped += 1

    def time(self, unit):
        self.units.append(unit)
        seconds, void = self.table[(unit.slot.scene, self.units.count(unit))]
        if void == "raise":
            raise RuntimeError("a lap that nobody foresaw")
        return SimpleNamespace(seconds=seconds, void=void)


def test_cost_as_the_least_valid_lap_per_step(monkeypatch):
    """Two scenes in turns, one of which has no lap that counts; half a second is clocked, or all of a shorter run."""
    FakeLane.made = []
    laps = [(0.36, ""), (0.24, ""), (0.12, "void: it hung"), (0.0, ""), (0.48, ""), (0.6, ""), (0.3, "")]
    FakeLane.table = {("stack", k): lap for k, lap in enumerate(laps, 1)}
    FakeLane.table |= {("impact", k): (0.1, "died") for k in range(1, 8)}
    monkeypatch.setattr("validation.bench.lane.Lane", FakeLane)
    slots = [Slot("stack", (("n", 3.0),), 2, "toy", "tuned", DT), Slot("impact", (), 2, "toy", "tuned", DT)]
    monkeypatch.setattr(cures, "prepare", lambda slot: SimpleNamespace(
        scene=SimpleNamespace(bodies="abcd" if slot.scene == "stack" else "ab",
                              duration=5.0 if slot.scene == "stack" else 0.25)
    ))  # fmt: skip
    assert cures.clocked(slots) == (0.24 / 120, None)
    (lane,) = FakeLane.made
    assert (lane.patience, lane.started, lane.stopped) == (120.0, 1, 1)
    units = [Unit("work", slots[0], "", 4, 0, 120), Unit("work", slots[1], "", 2, 0, 60)]
    assert lane.units == units * cures.ROUNDS
    FakeLane.table["impact", 3] = (0.0, "raise")
    with pytest.raises(RuntimeError):
        cures.clocked(slots)
    assert FakeLane.made[1].stopped == 1


# ---- which setting of a cure decides ----


def measured(monkeypatch, enough, belongs=None, values=None, metrics=()):
    """A cure of three settings that passes with any of the sets in ``enough``, measured."""
    changes = values or {"a": 1, "b": 2, "c": (3, 4)}

    def off(slot):
        own = set(dict(slot.switched))
        worse = 3.0 * dict(slot.params).get("e", 1.0)
        return (0.5 if any(each <= own for each in enough) else worse + 0.25 * (3 - len(own)),)

    asked = Asked(off)
    monkeypatch.setattr(decisive, "observe", asked)
    monkeypatch.setattr(decisive, "changes_of", lambda slot, better: dict(changes) if better == "tuned" else {})
    monkeypatch.setattr(decisive, "belongs_of", lambda engine: belongs or {})
    monkeypatch.setattr(decisive, "find", lambda name: SimpleNamespace(version=f"{name} 2.1"))
    target = Cured("default", "tuned", "impact", ({"e": 0.5}, {"e": 0.75}), metrics)
    return decisive.measure("toy", target, jobs=2), asked, target


def test_equally_sufficient_settings_each_decisive_alone(monkeypatch):
    found, asked, target = measured(monkeypatch, [{"a"}, {"b"}])
    assert (found.engine, found.version, found.shipped, found.better) == ("toy", "toy 2.1", "default", "tuned")
    assert (found.scene, found.dimension, found.cells, found.metrics) == ("impact", 2, target.cells, ())
    # The worst of both cells: 3 x .75 and a quarter for each setting that is not there.
    assert (found.before, found.after) == (pytest.approx(3.0, rel=ROUNDED), pytest.approx(0.5, rel=ROUNDED))
    parts = [(p.setting, p.value, round(p.alone, 3), round(p.without, 3), p.decides) for p in found.parts]
    assert parts == [("a", "1", 0.5, 0.5, ALONE), ("b", "2", 0.5, 0.5, ALONE), ("c", "[3, 4]", 2.75, 0.5, "")]
    assert {jobs for _, jobs in asked.calls} == {2} and {slot.profile for slot in asked.slots} == {"default"}


def test_needed_and_interchangeable_settings_of_a_cure(monkeypatch):
    found, _, _ = measured(monkeypatch, [{"a", "b"}, {"a", "c"}])
    assert [p.decides for p in found.parts] == [NEEDED, "", COMPLETES] and found.text == "a with c"
    assert found.parts[0] == Part("a", "1", pytest.approx(2.75, rel=ROUNDED), pytest.approx(2.5, rel=ROUNDED), NEEDED)


def test_dependent_setting_switched_with_its_main_one(monkeypatch):
    found, asked, _ = measured(monkeypatch, [{"a", "c"}], belongs={"c": "a"})
    assert [(p.setting, p.decides) for p in found.parts] == [("a", ALONE), ("b", "")]
    assert all(("c" in dict(slot.switched)) == ("a" in dict(slot.switched)) for slot in asked.slots)


@pytest.mark.parametrize(
    ("enough", "metrics", "said"),
    [
        ([set()], (), "toy impact: 0.5 tolerances as shipped, 0.5 with every change, so this is no fix"),
        ([], (), "toy impact: 3 tolerances as shipped, 2.25 with every change, so this is no fix"),
    ],
)
def test_checks_always_passed_or_failed(monkeypatch, enough, metrics, said):
    with pytest.raises(ValueError, match="no fix") as refused:
        measured(monkeypatch, enough, metrics=metrics)
    assert str(refused.value) == said


def test_every_named_cure_measured_with_given_processes(monkeypatch):
    monkeypatch.setattr(decisive, "cured_of", lambda engine: (f"{engine} 1", f"{engine} 2"))
    monkeypatch.setattr(decisive, "measure", lambda engine, target, jobs=1: (engine, target, jobs))
    assert decisive.measure_all("toy", 4) == [("toy", "toy 1", 4), ("toy", "toy 2", 4)]
    assert [jobs for _, _, jobs in decisive.measure_all("toy")] == [1, 1]


def test_cure_without_effect_in_the_told_cell(monkeypatch):
    """Values of other profiles differ from cell to cell; one that is as the profile has it there changes nothing."""

    def off(slot):
        margin, s = dict(slot.params).get("margin", 1.0), dict(slot.switched)
        return (0.5 if s.get("b") == 3 or margin < 1.5 else 9.0, 1.5 if margin > 1.5 and s.get("b") == 3 else 0.5)

    found, _, _ = cured(monkeypatch, off, {"b": (3,)})
    assert (found.failing, found.helps) == (1, False)  # it breaks what passed
    monkeypatch.setattr(cures, "readings", lambda found: [])
    assert cures.search("toy", "pinch", 2) == Unsearched(False, "no check of its cases is judged")


def test_value_slightly_above_its_tolerance_not_mended(monkeypatch):
    def off(slot):
        s, margin = dict(slot.switched), dict(slot.params).get("margin", 1.0)
        mended = s.get("a") == 1
        return (1.5 if margin > 1.5 else 0.5) if mended else 9.0, 0.25 if mended else 9.0

    found, _, _ = cured(monkeypatch, off, {"a": (1,)})
    assert (found.failing, found.left, found.mends) == (6, 1, ("turned",))


def test_cure_table_with_three_digits_and_any_alphabet(tmp_path):
    cure = Cure(
        "toy", "2.1", "default", "pinch\u00e9", 2, ({},), 1, 0, 4, "creep", "m/s", {}, 0.0, 0.1, 0.9, 0.05, {"a": 1},
        "", (), 3,
        1.23456e-5, 2.34567e-5, ("creep",),
    )  # fmt: skip
    kept.write([cure], tmp_path / "cures.csv")
    assert kept.read(tmp_path / "cures.csv") == [replace(cure, cost_before=1.23e-5, cost_after=2.35e-5)]
    lines = (tmp_path / "cures.csv").read_bytes().decode("utf-8").split("\n")
    assert len(lines) == 3 and lines[0].startswith("engine,version,shipped,scene,dimension,cells,failing")
    assert not list(tmp_path.glob("*.new"))
