"""Detection power: every planted fault is caught by a named receipt or check that the healthy toy passes."""

import math

import numpy as np
import pytest

from adapters.conformance import CHECKS
from adapters.lift import lower_pose
from adapters.needs import Needs
from adapters.planted_faults import CAUGHT_BY, _turned
from adapters.receipts import receipts

#: A spatial impact with friction: the one kind of scene whose receipts measure every quantity.
EVERYTHING = Needs(3, True, 0.5, 0.5, "impact", True, 1.0, 6.0, 1.0, 9.81)
DT = 1 / 60


def broken(engine, name):
    kind, what = name.split()
    if kind == "check":
        try:
            return CHECKS[what](engine)
        except Exception as error:  # as `check_adapter` does: what a faulty engine raises is a finding
            return f"{type(error).__name__}: {error}"
    return [slip for slip in receipts(engine, "default", EVERYTHING, DT) if slip.quantity == what and not slip.holds]


@pytest.mark.parametrize("name", sorted(set(CAUGHT_BY.values())))
def test_healthy_toy_passes(toy, name):
    assert not broken(toy(), name)


@pytest.mark.parametrize("fault, name", CAUGHT_BY.items())
def test_planted_fault_is_caught(toy, fault, name):
    assert broken(toy(fault), name)


def test_every_fault_that_can_be_planted_is_in_the_table(faults):
    assert set(faults) == set(CAUGHT_BY)


#: Faults of one parameter, and all receipts they break: the others must not be drawn in.
ALONE = {
    "restitution ignored": {"restitution"},
    "friction applied twice": {"friction", "friction_impulse"},
    "friction 2 % low": {"friction", "friction_impulse"},
    "impulses reported 2 % low": {"impulse"},
    "friction reported 2 % low": {"friction_impulse"},
    "state sampled one step late": {"sampling", "friction"},  # the last step of a slide is missing, its weight is not
    "disc inertia given to a sphere": {"inertia"},
    "angle sign": {"turn"},
    "mass ignored": {"mass"},
    "spin damped": {"inertia", "angular_damping"},
    "impulse of the wrong body": {"impulse"},
    "world shared between builds": set(),
}


@pytest.mark.parametrize("fault, quantities", ALONE.items())
def test_a_fault_breaks_the_receipts_it_concerns_and_no_other(toy, fault, quantities):
    slips = receipts(toy(fault), "default", EVERYTHING, DT)
    assert {slip.quantity for slip in slips if not slip.holds} == quantities


@pytest.mark.parametrize("dt", [1 / 60, 1 / 240])
def test_healthy_toy_holds_every_receipt_in_both_dimensions(toy, dt):
    engine = toy()
    for dimension in (2, 3):
        needs = Needs(dimension, True, 0.5, 0.8, "impact", True, 1.0, 6.0, 1.0, 9.81)
        assert [slip for slip in receipts(engine, "default", needs, dt) if not slip.holds] == []


def test_a_twirl_turns_spatial_poses_as_the_lift_lowers_them():
    """A turn from x towards the vertical, whatever the pose was before."""
    half = 0.3
    pose = np.array([[1.0, 0.0, 2.0, math.cos(half), 0.0, -math.sin(half), 0.0]])
    lowered, outside = lower_pose(_turned(pose, 0.25))
    assert lowered[0] == pytest.approx([1.0, 2.0, 2.0 * half + 0.25], abs=1e-15) and outside == 0.0
    assert _turned(lowered, -0.25)[0, 2] == pytest.approx(2.0 * half, abs=1e-15)
