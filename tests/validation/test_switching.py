"""Switch one setting: replaced, added, counted; the machine that tuning and proofs share."""

import json
import math
from dataclasses import replace

import pytest

from adapters import registry
from adapters.engine_folder import candidates_of, instead_of, local_of
from adapters.experiment import Experiment
from adapters.needs import needs
from adapters.settings.own import kinds_of
from validation.canonical import Check
from validation.cells import Observation, Outcome, Slot, prepare, slot_from_dict
from validation.findings.files import findings_of
from validation.posed import resolve
from validation.running.plan import QUICK_DT, is_standard
from validation.settings import proofs
from validation.settings.proofs import Proof, experiments_on
from validation.settings.switching import Reading, reading, readings, side_by_side, switched
from validation.settings.tuning import Score, broken, score

pymunk = pytest.importorskip("pymunk", reason="pymunk is an optional engine")

SLOT = Slot("stack", (("n", 2.0),), 2, "chipmunk", "default", QUICK_DT)
OURS = [name for name in registry.names() if registry.is_ours(registry.entry(name))]


@pytest.mark.parametrize(
    "changed",
    [{"scene": "impact"}, {"params": (("n", 3.0),)}, {"dimension": 3}, {"engine": "bullet"}, {"profile": "tuned"},
     {"dt": 1 / 960}, {"iterations": 20}, {"ulp": 1}, {"switched": (("iterations", 3),)}],
    ids=lambda changed: next(iter(changed)),
)  # fmt: skip
def test_cell_key_with_every_question_of_a_cell(changed):
    """A moved start that was stored as its unmoved cell would be its answer, and leave it no floor."""
    assert replace(SLOT, **changed).key() != SLOT.key()


def test_switched_cell_through_json_and_never_listed():
    other = switched(SLOT, {"collision_slop": 1e-5, "solref": (0.02, 1.0)})
    again = slot_from_dict(json.loads(json.dumps(other.as_dict())))
    assert again == other and again.key() == other.key() != SLOT.key()
    assert is_standard(SLOT) and not is_standard(other)
    assert switched(SLOT, {}) == SLOT
    assert "switched" not in SLOT.as_dict()


def test_cell_identity_after_a_replaced_setting():
    other = switched(SLOT, {"collision_slop": 1e-5})
    cells = [prepare(slot).cell for slot in (SLOT, other)]
    assert cells[0].settings_hash != cells[1].settings_hash
    assert cells[0].scene_hash == cells[1].scene_hash


def test_iterations_are_the_slot_s_own_field():
    other = switched(switched(SLOT, {"iterations": 7}), {"collision_slop": 1e-5})
    assert other.iterations == 7 and other.switched == (("collision_slop", 1e-5),)


def test_cell_with_a_switched_setting():
    own, more, wrong = side_by_side(SLOT, [{"iterations": 1000}, {"no_such_setting": 1}])
    assert reading(own, "penetration").badness > 1.0 > reading(more, "penetration").badness
    assert {s["name"]: s["value"] for s in more.settings}["iterations"] == 1000
    assert wrong.outcome is Outcome.CRASHED and "no_such_setting" in wrong.reason
    assert math.isinf(reading(wrong, "penetration").badness)


#: Limits of an engine that no setting takes out: their reasons give the figures that settings change them by. Open: a
#: prediction of their size.
#: Those of Box3D are computed in `tests/adapters/test_box3d.py`, those of Rapier in
#: `tests/adapters/test_rebounds_of_rapier.py`, those of PhysX in `tests/adapters/test_findings_of_physx.py`, that of
#: Drake is in `tests/adapters/test_drake.py`, those of Newton in `tests/adapters/test_newton.py` and
#: `test_newton_solvers.py`, that of Bullet in `tests/adapters/test_bullet.py`. Those of MuJoCo are closed forms in
#: `tests/adapters/test_findings_of_mujoco.py`, those of both Box2D in `tests/adapters/test_rods_of_box2d.py`.
MEASURED_ONLY = {
    "box2d": {"kane-struck-half-way"},
    "box2d3": {"kane-rebound-after-friction"},
    "box3d": {
        "card-tent-friction-centre",
        "cradle-stopped-in-small-steps",
        "domino-friction-centre",
        "edge-drop-rebound-by-points",
        "flat-box-rebound-by-points",
        "kane-rebound-after-friction",
        "oblique-leaning-normal",
        "oblique-rebound-after-friction",
        "pair-matrix-compression-only",
        "pivot-friction-centre",
        "rack-order-of-pairs",
        "rocking-block-friction-centre",
        "tilt-table-friction-centre",
    },
    "bullet": {"arch-hull-grid"},
    "drake": {"shove-slanted-edge"},
    "motrixsim": {
        "edge-drop-in-singles",
        "far-origin-in-singles",
        "overlap-in-singles",
        "rack-in-singles",
        "rolling-spin-in-singles",
    },
    "mujoco": {"kane-struck-half-way", "kane-struck-half-way-by-a-cone", "rack-short-rebounds"},
    "newton": {
        "bounce-late-blows",
        "card-tent-friction-of-a-sweep",
        "far-origin-rounded",
        "impact-impulses-untold",
        "incline-friction-of-a-sweep",
        "ladder-friction-of-a-sweep",
        "masse-of-a-step",
        "pivot-of-a-step",
        "pressed-box-friction-of-a-sweep",
        "roll-incline-of-a-step",
        "rolling-spin-of-a-step",
        "rolling-spin-rounded",
        "starved-mean-of-contacts",
        "tilt-table-friction-of-a-sweep",
        "tilt-table-of-a-step",
    },
    "newton_kamino": {
        "bounce-in-singles",
        "cradle-in-singles",
        "edge-drop-in-singles",
        "galperin-in-singles",
        "oblique-in-singles",
        "rod-gas-in-singles",
    },
    "newton_semi_implicit": {"far-origin-in-singles", "rocker-ball-without-radius"},
    "newton_vbd": {
        "far-origin-in-singles",
        "hilltop-of-a-step",
        "incline-in-singles",
        "masse-of-a-step",
        "pivot-of-a-step",
        "pressed-box-in-singles",
        "rocker-of-a-step",
        "roll-incline-of-a-step",
        "rolling-spin-of-a-step",
        "slide-to-roll-of-a-step",
        "tilt-table-in-singles",
        "tumble-of-a-step",
    },
    "physx": {
        "closing-wall-places-in-singles",
        "flat-box-in-singles",
        "oblique-in-singles",
        "overlap-in-singles",
        "rolling-spin-rubbed-off",
    },
    "rapier": {
        "cradle-stopped-in-small-steps",
        "domino-rebound-last",
        "edge-drop-rebound-by-points",
        "kane-rebound-after-friction",
        "oblique-rebound-after-friction",
        "pair-matrix-rebound-after-friction",
        "rack-rebound-once",
    },
}


@pytest.mark.parametrize("engine", OURS)
def test_proof_of_every_family(engine):
    """A reason that nobody can prove or refute is not one."""
    findings = findings_of(engine)
    families = findings.families if findings else {}
    experiments = experiments_on(engine)
    # Where nothing is measured there is nothing to switch: such a reason is proven by a test of its engine.
    members = findings.members.values() if findings else ()
    silent = MEASURED_ONLY.get(engine, set()) | set(families) - {
        member.family.id for member in members if member.value is not None or member.diverged
    }
    # A family that speaks about rows outside the standard suite alone has no members, and its proofs all the same.
    proven = {experiment.family for experiment in experiments}
    assert set(families) - silent <= proven <= set(families) - MEASURED_ONLY.get(engine, set())
    for experiment in experiments:
        canonical = resolve(experiment.scene)
        assert experiment.dimension in canonical.dimensions
        assert set(experiment.params) <= {parameter.name for parameter in canonical.parameters}


@pytest.mark.parametrize("engine", OURS)
def test_second_proof_of_a_family_with_its_own_switch(engine):
    proofs = experiments_on(engine)
    switched_by = [{(str(dict(e.off)), str(dict(idle))) for idle in (*e.idle, {})} for e in proofs]
    for k, own in enumerate(proofs):
        others = (pairs for other, pairs in zip(proofs, switched_by, strict=True) if other.family == own.family)
        elsewhere = set().union(*(pairs for pairs in others if pairs is not switched_by[k]))
        assert switched_by[k] - elsewhere, (own.family, own.profile, own.params)


@pytest.mark.parametrize("name", OURS)
def test_settings_to_try_that_the_engine_has(name):
    engine = registry.find(name).engine
    if engine is None:
        pytest.skip(f"{name} is not installed")
    wanted = needs(resolve("impact").scene(resolve("impact").dimensions[-1]))
    profiles = [engine.settings(profile, wanted, QUICK_DT) for profile in engine.profiles]
    kinds = {setting: kind for profile in profiles for setting, kind in kinds_of(engine, profile).items()}
    for setting, values in candidates_of(name).items():
        assert len(set(values)) == len(values) > 1, setting
        assert not any(kinds[setting](value) for value in values), setting
    assert {*local_of(name), *(each for pair in instead_of(name) for part in pair for each in part)} <= set(kinds)


CHECK = Check("x", "m", 0.0, 1.0, "because", "source")


def read(value):
    return Reading(SLOT, CHECK, value, "")


@pytest.mark.parametrize(
    ("before", "after", "idle", "holds"),
    [
        (2.0, 0.5, (2.0,), True),
        (0.5, 0.5, (2.0,), False),  # the row does not fail
        (2.0, 1.5, (2.0,), False),  # it goes on failing with the mechanism off
        (2.0, 0.5, (0.9,), False),  # what others blame mends it as well
        (2.0, None, (), False),  # a cell without an answer proves nothing
        (None, 0.5, (), False),
        (2.0, 0.5, (None,), False),
    ],
)
def test_proof_by_the_mechanism_alone(before, after, idle, holds):
    experiment = Experiment(
        "f", "says", "default", "stack", "x", {"a": 1}, idle=tuple({"b": k} for k in range(len(idle)))
    )
    proof = Proof("chipmunk", experiment, read(before), read(after), tuple(read(value) for value in idle))
    assert proof.holds is holds
    assert bool(proof.why_not) is not holds


def test_a_score_counts_fails_before_it_counts_decades():
    assert score([read(10.0), read(0.1)]) == Score(1, 4.0 + 2.0)
    assert Score(0, 9.0).better_than(Score(1, 1.0))
    assert Score(1, 1.0).better_than(Score(1, 2.0))
    assert not Score(1, 1.95).better_than(Score(1, 2.0))  # nobody sees a tenth of a decade
    assert score([read(None)]).failing == 1


def test_broken_checks_of_those_that_passed_before():
    before, after = [read(0.5), read(2.0), read(0.5)], [read(1.5), read(3.0), read(0.9)]
    assert len(broken(before, after)) == 1


def test_an_unfinished_cell_has_readings_without_values():
    lost = Observation(SLOT, "", 0, "", Outcome.TIMED_OUT, "no answer")
    assert all(each.value is None and "no answer" in each.reason for each in readings(lost))


def test_study_without_answers_read_as_a_missing_value(monkeypatch):
    slot = Slot("impact", (), 2, "chipmunk", "tuned", QUICK_DT)
    check = Check("threshold", "1", 0.5, 0.01, "a step", "a law")
    observation = Observation(slot, "", 1, "1", Outcome.OK)
    monkeypatch.setattr(proofs, "_cells", lambda slot, metric: [slot, slot])
    monkeypatch.setattr(proofs, "study_of", lambda scene, metric: "a study")
    monkeypatch.setattr(proofs, "readings", lambda seen: [Reading(slot, check, 0.5, "")])
    monkeypatch.setattr(proofs, "results_of", lambda *asked: iter(()))
    said = "the cases of the study have no result"
    assert proofs._read(slot, "threshold", {slot: observation}) == Reading(slot, check, None, said)
    monkeypatch.setattr(proofs, "results_of", lambda *asked: iter([Reading(slot, check, 0.25, "told")]))
    assert proofs._read(slot, "threshold", {slot: observation}) == Reading(slot, check, 0.25, "told")
