"""Detection power: a fault of two per cent cannot be blessed away, and every check sees one that is planted for it."""

import pytest

from adapters import registry
from adapters.needs import Needs
from adapters.planted_faults import SIZED, Planted
from adapters.receipts import receipts
from validation.detection import SIZES, detection, lines

DT = 1 / 240
NEEDS = {
    "impact": Needs(2, True, 0.0, 0.8, "impact", False, 1.0, 6.0, 1.0, 0.0),
    "bounce": Needs(2, True, 0.0, 0.8, "impact", True, 1.0, 6.0, 1.0, 9.81),
    "stack": Needs(2, True, 0.5, 0.0, "rest", True, 1.0, 6.0, 1.0, 9.81),
    "incline": Needs(2, True, 0.5, 0.0, "slide", True, 1.0, 6.0, 1.0, 9.81),
}
ATTACKS = [("impulse", scene) for scene in NEEDS] + [("friction", "stack"), ("friction", "incline")]


def broken(engine, profile, needs):
    return {slip.quantity for slip in receipts(engine, profile, needs, DT) if not slip.holds}


@pytest.mark.parametrize("name, package", [("chipmunk", "pymunk"), ("bullet", "pybullet"), ("mujoco", "mujoco")])
@pytest.mark.parametrize("fault, scene", ATTACKS)
def test_two_per_cent_of_impulses_or_friction_break_a_receipt_of_every_engine_and_profile(name, package, fault, scene):
    pytest.importorskip(package)
    engine = registry.load(name)
    for profile in engine.profiles:
        assert broken(engine, profile, NEEDS[scene]) == set(), profile
        assert broken(Planted(engine, fault, 0.02), profile, NEEDS[scene]), profile


@pytest.fixture(scope="module")
def seen():
    pytest.importorskip("pymunk")
    return detection(registry.load("chipmunk"), "tuned", 2)


def test_every_fault_is_seen_from_one_per_cent_on_by_something(seen):
    for fault in SIZED:
        sizes = [entry.size for entry in seen if entry.fault == fault and entry.size is not None]
        assert min(sizes) <= 0.01, fault
        # Sizes and shapes are told by a receipt to a step of motion, all else to a thousandth and better.
        assert fault == "extent" or min(sizes) == min(SIZES), fault


#: What sees no parameter that is off by less than a tenth, and the fault that it is there for.
ELSEWHERE = {
    "bounce/apex_growth": "test_tolerances: e above 1",
    "stack/kinetic_energy": "motion of the last second",
    "stack/settle_time": "motion of the last second",
    "stack/impulse_scatter": "impulses of the last second that differ from step to step",
    "linear_damping": "test_planted_faults: hidden damping",
    "angular_damping": "test_planted_faults: spin damped",
}


def test_every_check_and_receipt_sees_a_fault(seen):
    blind = {line["name"].removeprefix("receipt ") for line in lines(seen) if not any(list(line.values())[1:])}
    assert blind <= set(ELSEWHERE)


def test_a_fault_that_does_not_exist_cannot_be_planted():
    with pytest.raises(Exception, match="fault: 'colour' is none of"):
        Planted(registry.load("reference"), "colour", 0.1)
