"""The core suite: which scenes it has, and how orders and bounds are judged."""

import math
from types import SimpleNamespace

import pytest

from adapters import registry
from validation.catalogue import CATALOGUE
from validation.cells import Observation, Outcome, Slot
from validation.questions import core
from validation.workers import run_cells

DOUBLE = SimpleNamespace(precision="double", dimensions=frozenset({2}))
SINGLE = SimpleNamespace(precision="single", dimensions=frozenset({2}), round_off=1e-4)


def test_scenes_of_the_core_suite():
    assert len(core.core()) == 12 and all(primary.order in (0, 1, 2) for primary in core.core().values())
    slots = core.slots_of("impact", SimpleNamespace(dimensions=frozenset({3})), "any", "plain")
    assert {slot.dimension for slot in slots} == {3} and {slot.dt for slot in slots} == set(core.DTS)
    assert len(slots) == len(core.DTS) * len(core.core()["impact"].variations(core.DTS[0]))


@pytest.fixture
def line(monkeypatch):
    """`line(scene, errors, facts)`: result of a scene with these declared errors, whose checks are within bounds."""

    def judge(scene, errors, facts=DOUBLE):
        found = {(dt, None): error for dt, error in zip(core.DTS, errors, strict=True)}
        monkeypatch.setattr(core, "declared_errors", lambda observations: {"any": found})
        monkeypatch.setattr(core, "rows_of", lambda run, observations: [])
        slot = Slot(scene, (), 2, "any", "plain", core.DTS[0])
        return core.judged(facts, [Observation(slot, "", 1, "1", Outcome.OK)])

    return judge


@pytest.mark.parametrize(
    ("scene", "errors", "said"),
    [("bounce", (0.08, 0.04, 0.02, 0.01), ""),
     ("bounce", (0.064, 0.016, 0.004, 0.001), ""),
     ("bounce", (1e-15, 1e-16, 0.0, 1e-15), ""),
     ("bounce", (0.08, 0.06, 0.045, 0.034), "order: order 0.41 +- 0.00 over 4 steps; at least order 1 is expected"),
     ("bounce", (0.08, 0.02, 0.02, 0.02), "order: levels off at an error of 0.02; at least order 1 is expected"),
     ("bounce", (0.01, 0.02, 0.04, 0.08), "order: the error grows as the step shrinks, order -1.00 +- 0.00; at least"),
     ("v_groove", (0.08, 0.04, 0.02, 0.01), "order: order 1.00 +- 0.00 over 4 steps; at least order 2 is expected"),
     ("impact", (1e-15, 1e-16, 0.0, 1e-15), ""),
     ("impact", (0.08, 0.04, 0.02, 0.01), "order: order 1.00 +- 0.00 over 4 steps; round-off is expected at every"),
     ("impact", (1e-6, 1e-6, 1e-6, 1e-6), "order: levels off at an error of 1e-06; round-off is expected at every")],
)  # fmt: skip
def test_order_of_the_error_over_steps(line, scene, errors, said):
    wrong = line(scene, errors).wrong
    assert "".join(wrong)[: len(said)] == said and len(wrong) == bool(said)


def test_round_off_of_single_precision_allowed_for(line):
    assert not line("impact", (1e-6, 1e-6, 1e-6, 1e-6), SINGLE).wrong
    assert line("impact", (1e-3, 1e-3, 1e-3, 1e-3), SINGLE).wrong


def test_refused_and_unfinished_cases(line):
    slot = Slot("impact", (), 2, "any", "plain", core.DTS[0])
    refused = core.judged(DOUBLE, [Observation(slot, "", 1, "1", Outcome.UNSUPPORTED, "box: no")])
    assert refused.refused == "box: no" and not refused.wrong and math.isnan(refused.errors[0])


def test_check_out_of_bounds_with_its_worst_case():
    seen = {}

    def row(value, dt, outcome="ok", why="", metric="speed"):
        slot = Slot("impact", (("e", 0.5),), 2, "any", "plain", dt)
        own = "" if outcome == "ok" else why
        seen[slot] = Observation(slot, "", 1, "1", Outcome(outcome), own, metrics={metric: (value, why)})
        found = {"value": value, "truth": 1.0, "tolerance": 0.1, "dt": dt, "slot": slot.as_dict(), "unit": "m/s"}
        reason = f"{why}; the engine has no list of findings"
        return SimpleNamespace(**found, outcome=outcome, reason=reason, metric=metric)

    told = [row(1.05, 1 / 60), row(1.2, 1 / 60), row(0.5, 1 / 120), row(None, 1 / 60, why="no apex", metric="apex")]
    told += [row(None, 1 / 240, "diverged", "step 3: not finite")]
    assert core._beyond(told, seen, 1e-9) == [
        "speed: 0.5, truth 1 +- 0.1 m/s at dt = 1/120 s, e=0.5, and 1 more",
        "apex: no apex at dt = 1/60 s, e=0.5",
        "diverged: step 3: not finite at dt = 1/240 s, e=0.5",
    ]
    assert core._beyond([row(1.0002, 1 / 60)], seen, 1e-9) == []
    exact, off = (SimpleNamespace(**vars(row(value, 1 / 60)) | {"tolerance": 0.0}) for value in (1.0, 1.0 + 1e-15))
    assert core._beyond([exact], seen, 0.0) == [] and len(core._beyond([off], seen, 0.0)) == 1
    no_number = core._beyond([row(math.nan, 1 / 60)], seen, 1e-9)
    assert no_number == ["speed: nan, truth 1 +- 0.1 m/s at dt = 1/60 s, e=0.5"]


@pytest.mark.few(2)
@pytest.mark.parametrize("scene", core.core())
def test_core_suite_of_the_reference_solver(scene):
    engine = registry.load("reference")
    slots = core.slots_of(scene, engine.facts, "reference", engine.facts.profile("solution"))
    found = core.judged(engine.facts, list(run_cells(slots)))
    assert not found.wrong and not found.refused and set(found.scene.split()) <= set(CATALOGUE)
