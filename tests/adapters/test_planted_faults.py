"""Detection power: every planted fault is caught by what names it, which the healthy toy passes."""

import json
import math
from collections import Counter

import numpy as np
import pytest
from click.testing import CliRunner

from adapters.conformance import CHECKS, self_test
from adapters.conformance.faults import FAULTS, FaultyToy
from adapters.conformance.planted_faults import _turned
from adapters.needs import Needs
from adapters.receipts import QUANTITIES, receipts
from adapters.scene.lift import lower_pose, out_of_plane
from reports.command import main

EVERYTHING, DT = self_test.EVERYTHING, 1 / 60
#: Asked of a thousand worlds; `test_memory_of_worlds.py` plants it as well.
DEAR = "worlds are never freed"


def cases(*cases):
    """Cases of faults, each with its name first."""
    return [pytest.param(*case, marks=[pytest.mark.long] if case[0] == DEAR else []) for case in cases]


PLANTED = cases(*((name, size) for name, fault in FAULTS.items() for size in fault.sizes or (math.nan,)))


@pytest.mark.few(6)
@pytest.mark.parametrize("name", sorted({fault.check for fault in FAULTS.values()}))
def test_healthy_toy_passes(toy, name):
    assert self_test.broken(toy(), name) == ""


def test_a_step_of_its_own():
    """It is measured, where an engine that cannot be built would be noticed as well."""
    said = self_test.broken(FaultyToy("step of its own", 0.1), "receipt step")
    assert said.startswith("measured ")


def test_planted_faults_for_every_check_and_in_three_sizes():
    named = {fault.check for fault in FAULTS.values()}
    # Which packages lie on the path is no matter of an adapter.
    assert named == {*CHECKS, *(f"receipt {quantity}" for quantity in QUANTITIES)} - {"packages"}
    assert Counter(len(fault.sizes) for fault in FAULTS.values())[3] >= 25
    assert {len(fault.sizes) for fault in FAULTS.values()} == {0, 3}
    assert all(list(fault.sizes) == sorted(fault.sizes, reverse=True) for fault in FAULTS.values())


def told(monkeypatch, faults, *args):
    monkeypatch.setattr(self_test, "FAULTS", faults)
    monkeypatch.setattr(self_test, "check_adapter", lambda engine: [])
    return CliRunner().invoke(main, ["check-adapter", "--self-test", *args])


def test_rows_of_the_self_test_command(monkeypatch):
    few = {name: FAULTS[name] for name in ("states", "nothing read back", "start displaced") if name in FAULTS}
    done = told(monkeypatch, few, "--json")
    rows = json.loads(done.output)
    assert done.exit_code == 0 and [row["caught"] for row in rows] == [True] * 5
    assert [(row["fault"], row["check"], row["size"]) for row in rows[1:]] == [
        ("nothing read back", "readback", None),
        *(("start displaced", "states", size) for size in (1e-2, 1e-4, 1e-6)),
    ]
    text = told(monkeypatch, few).output
    assert "ok    start displaced, 0.0001 m: states" in text and "5 of 5 as they must be" in text
    assert max(map(len, text.splitlines())) <= 80


def test_unnoticed_fault_fails_the_self_test(monkeypatch):
    monkeypatch.setitem(CHECKS, "states", lambda engine: "")
    done = told(monkeypatch, {"start displaced": FAULTS["start displaced"]})
    assert done.exit_code == 1 and done.output.count("FAIL") == 3 and "1 of 4" in done.output


def test_engine_or_self_test_required():
    for args in ([], ["toy", "--self-test"]):
        assert CliRunner().invoke(main, ["check-adapter", *args]).exit_code == 2


#: Faults of one parameter, and all receipts they break: the others must not be drawn in.
ALONE = {
    "restitution ignored": {"restitution"},
    "friction too high": {"friction", "friction_impulse"},
    "friction too low": {"friction", "friction_impulse"},
    "impulses reported too low": {"impulse"},
    "friction reported too low": {"friction_impulse"},
    "state read late": {"sampling", "friction"},  # the last step of a slide is missing, its weight is not
    "inertia of a disc given to a ball": {"inertia"},
    "angles with the wrong sign": {"turn"},
    "mass too small": {"mass", "impulse"},  # impulses are compared with what the stated mass gains
    "spin that dies down": {"inertia", "angular_damping"},
    "impulse of the wrong body": {"impulse"},
    "state shared with another world": set(),
}


@pytest.mark.parametrize("fault, quantities", ALONE.items())
def test_fault_breaks_only_the_receipts_it_concerns(toy, fault, quantities):
    slips = receipts(toy(fault), "default", EVERYTHING, DT)
    assert {slip.quantity for slip in slips if not slip.holds} == quantities


@pytest.mark.parametrize("dt", [1 / 60, 1 / 240])
def test_property_checks_of_an_engine_without_faults(toy, dt):
    engine = toy()
    for dimension in (2, 3):
        needs = Needs(dimension, True, 0.5, 0.8, "impact", True, 1.0, 6.0, 1.0, 9.81, 9.81)
        assert [slip for slip in receipts(engine, "default", needs, dt) if not slip.holds] == []


def test_twirl_of_spatial_poses():
    """A turn from x towards the vertical, whatever the pose was before."""
    half = 0.3
    pose = np.array([[1.0, 0.0, 2.0, math.cos(half), 0.0, -math.sin(half), 0.0]])
    turned = _turned(pose, 0.25)
    lowered = lower_pose(turned)
    assert lowered[0] == pytest.approx([1.0, 2.0, 2.0 * half + 0.25], abs=1e-15)
    assert out_of_plane(turned[None], np.array([1.0])) == 0.0
    assert _turned(lowered, -0.25)[0, 2] == pytest.approx(2.0 * half, abs=1e-15)


@pytest.mark.few(6)
@pytest.mark.parametrize("fault", cases(*((name,) for name, fault in FAULTS.items() if fault.sizes)))
def test_fault_of_size_zero_is_no_fault(fault):
    """What is planted is as large as it says: with nothing of it the toy is healthy again."""
    assert self_test.broken(FaultyToy(fault, 0.0), FAULTS[fault].check) == ""


@pytest.mark.few(18)
@pytest.mark.parametrize(("fault", "size"), PLANTED)
def test_planted_fault_is_caught(fault, size):
    assert self_test.broken(FaultyToy(fault, size), FAULTS[fault].check)
