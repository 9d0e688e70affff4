"""A profile with settings of a user's own: what it is called, what is planned, run, measured and judged of it."""

import json
from dataclasses import asdict, replace
from pathlib import Path

import pytest

from adapters import registry
from adapters.engine import EngineError
from validation.bench import sweep
from validation.bench.sweep import Sweep
from validation.cells import Outcome, Slot, prepare, settings_of, slot_from_dict
from validation.judging.rows import OWN_SETTINGS, predictions_of, rows_of
from validation.posed import pinned
from validation.releases.history import told_by
from validation.running.execution import execute
from validation.running.plan import QUICK_DT, Request, is_standard, knowing, slots
from validation.settings.switching import switched

MODELS = Path(__file__).parents[1] / "models"
pytest.importorskip("pymunk", reason="pymunk is an optional engine")
SLOT = Slot("bounce", (), 2, "chipmunk", "default", QUICK_DT)
OWN = SLOT.with_own((("collision_slop", 0.01), ("damping", 0.5)))


def asked(engine, *sets, scene="bounce", **more):
    return slots(Request([scene], [engine], sets=sets, **more))


def test_own_profile_named_after_its_settings():
    assert OWN.profile == "default+collision_slop=0.01+damping=0.5"
    assert OWN.is_own and OWN.base == "default" and OWN.stock == SLOT
    assert SLOT.with_own(()) == SLOT and not SLOT.is_own and SLOT.base == "default"
    again = slot_from_dict(json.loads(json.dumps(OWN.as_dict())))
    assert again == OWN and again.key() == OWN.key() != SLOT.key() and not is_standard(OWN)


def test_experiment_not_counted_as_an_own_profile():
    experiment = switched(SLOT, dict(OWN.switched))
    assert not experiment.is_own and experiment.base == experiment.profile == "default"
    assert experiment.key() != OWN.key()
    # A profile of another package may have the sign in its name.
    odd = replace(experiment, profile="a+b")
    assert odd.base == "a+b" and odd.with_own(OWN.switched).base == "a+b"


def test_rank_of_a_matched_profile_with_settings():
    assert registry.is_ranked("mujoco", "default+cone=elliptic")
    assert not registry.is_ranked("mujoco", "matched+cone=elliptic")


@pytest.mark.parametrize("more", [{}, {"params": {"e": 0.8}}, {"suite": "standard"}, {"suite": "full"}])
def test_shipped_profile_cells_with_own_settings(more):
    found = asked("chipmunk", ("damping", 0.5), **more)
    plain = slots(Request(["bounce"], ["chipmunk"], profiles=["default"], **more))
    assert [slot.stock for slot in found] == plain and plain
    assert {slot.profile for slot in found} == {"default+damping=0.5"}


def test_named_profiles_with_settings():
    found = asked("chipmunk", ("damping", 0.5), profiles=["tuned", "default"])
    assert {slot.profile for slot in found} == {"default+damping=0.5", "tuned+damping=0.5"}


def test_request_through_json_unchanged():
    """A release is asked by another process."""
    request = Request(["bounce"], ["chipmunk"], sets=(("damping", 0.5), ("collision_slop", 1)))
    assert slots(Request(**json.loads(json.dumps(asdict(request))))) == slots(request)


@pytest.mark.parametrize(
    ("sets", "said"),
    [((("dampin", 0.5),), "set: chipmunk has no setting 'dampin'; near it: damping"),
     ((("damping", 2.0),), "set: damping=2: must be a number from 0 to 1"),
     ((("start_overlap", 1.0),), "set: start_overlap: must not exceed collision_slop")],
)  # fmt: skip
def test_a_wrong_setting_is_refused_before_anything_runs(sets, said):
    with pytest.raises(EngineError, match=said):
        asked("chipmunk", *sets)


def test_an_iteration_count_is_asked_for_once():
    found = asked("chipmunk", ("iterations", 7), scene="stack")
    assert {slot.iterations for slot in found} == {None}
    slot = found[0]
    values = {s.name: s.value for s in settings_of(registry.load("chipmunk"), slot, prepare(slot).scene)}
    assert values["iterations"] == 7
    with pytest.raises(EngineError, match="set: --iterations sets iterations as well"):
        asked("chipmunk", ("iterations", 7), iterations=[8])


def test_engines_that_know_all_settings_asked_by_default():
    names = [name for name in registry.names() if registry.find(name).engine is not None]
    request = Request(["bounce"], names, sets=(("collision_slop", 0.01),))
    assert knowing(request) == ["chipmunk"]
    assert set(knowing(replace(request, sets=(("iterations", 3),)))) >= {"chipmunk", "reference"}
    with pytest.raises(EngineError, match="set: collision_slop=deep: must be a number of at least 0"):
        knowing(replace(request, sets=(("collision_slop", "deep"),)))
    with pytest.raises(
        EngineError, match="no installed engine has a setting 'collision_slot'; near it: collision_slop"
    ):
        knowing(replace(request, sets=(("iterations", 3), ("collision_slot", 1))))
    with pytest.raises(
        EngineError, match="no installed engine has a setting 'scheme'; the profile takes its place: reference"
    ):
        knowing(replace(request, sets=(("scheme", "located"),)))
    if "mujoco" in names:
        with pytest.raises(
            EngineError, match=r"no engine has all of these settings \(cone: mujoco; collision_slop: chip"
        ):
            knowing(replace(request, sets=(("cone", "elliptic"), ("collision_slop", 0.01))))


def test_refusal_of_a_setting_unknown_to_a_named_engine():
    with pytest.raises(EngineError, match="set: reference has no setting 'damping'"):
        slots(Request(["bounce"], ["chipmunk", "reference"], sets=(("damping", 0.5),)))


def test_profile_of_a_model_file():
    pytest.importorskip("mujoco")
    model = pinned(str(next(iter(sorted(MODELS.glob("*.xml"))))))
    for slot in slots(Request([model], ["mujoco"], sets=(("cone", "elliptic"),))):
        assert slot.profile == "model+cone=elliptic" and slot.base == "model"
        values = {s.name: s.value for s in settings_of(registry.load("mujoco"), slot, prepare(slot).scene)}
        assert values["cone"] == "elliptic" and values["solver"] == "NEWTON"  # what only a model states
        found = execute(replace(slot, params=(("duration", 0.05),)))
        assert found.outcome is Outcome.OK and found.readback["cone"] == "mjCONE_ELLIPTIC" and not found.receipts


def test_cell_with_own_settings_and_its_receipts():
    found = execute(OWN)
    assert found.outcome is Outcome.OK
    told = {setting["name"]: setting for setting in found.settings}
    assert told["damping"]["value"] == 0.5 and told["collision_slop"]["because"] == "set by the user"
    assert found.readback["damping"] == 0.5 and found.readback["collision_slop"] == 0.01
    slips = {slip["quantity"]: slip for slip in found.receipts}
    # The share of a speed that is lost in a second: half, as it was asked for.
    assert slips["linear_damping"]["asked"] == 0.0 and slips["linear_damping"]["measured"] == pytest.approx(0.5)
    assert not slips["linear_damping"]["holds"] and slips["gravity"]["asked"] == 1.0
    assert execute(SLOT).state_hash != found.state_hash
    assert not execute(switched(SLOT, dict(OWN.switched))).receipts  # an experiment is about what it changes


def test_row_of_own_settings_with_verdict_and_no_standing():
    rows = rows_of("run", [execute(OWN), execute(SLOT)])
    own = [row for row in rows if row.profile == OWN.profile]
    plain = [row for row in rows if row.profile == "default"]
    assert len(own) == len(plain) > 0 and own[0].slot == OWN.as_dict()
    failing = [row for row in own if row.physics == "fail"]
    assert failing and all(row.physics == "pass" for row in plain if row.tolerance)
    for row in failing:
        assert row.standing is None and not row.alarming and predictions_of(row) == []
        assert row.reason.startswith(OWN_SETTINGS) and "realised linear_damping = 0.5 of 0" in row.reason
    assert not any(row.alarming for row in own)


def test_release_without_the_setting():
    odd = SLOT.with_own((("slop_of_later_releases", 0.1),))
    found = execute(odd)
    assert found.outcome is Outcome.UNSUPPORTED and "no setting 'slop_of_later_releases'" in found.reason
    (row, *_) = rows_of("run", [found])
    assert row.standing is None and not row.alarming


def test_receipt_of_own_settings_not_counted_for_a_release():
    told = told_by("chipmunk", "7.3", [execute(OWN)])
    assert told.rows and all(row.outcome == "ok" for row in told.rows)


def test_a_bench_times_the_profile_with_the_settings(monkeypatch):
    request = Request(["bounce"], ["chipmunk"], dimensions=[2], sets=(("damping", 0.5),))
    wanted = Sweep(request, dts=(QUICK_DT,))
    cells = sweep.accuracy_slots(wanted)
    assert cells and all(slot.profile == "default+damping=0.5" for slot in cells)
    observations = [execute(slot) for slot in cells]
    units = sweep.timed_units(wanted, observations)
    assert {unit.purpose for unit in units} >= {"work", "overhead"}
    for unit in units:
        assert unit.slot.profile == "default+damping=0.5" and dict(unit.slot.switched) == {"damping": 0.5}
    counted = Sweep(replace(request, sets=(("iterations", 7),)), dts=(QUICK_DT,), iterations=(3,))
    assert {slot.iterations for slot in sweep.accuracy_slots(counted)} == {None}
