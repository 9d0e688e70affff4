"""Every hard case ends in its certified answer, and the verdicts themselves rest on what is derived here again."""

import math
from dataclasses import replace

import numpy as np
import pytest

from reference_solver import Settings
from tests.verification.hard_cases.case import Verdict, doubts, energy, within
from tests.verification.hard_cases.cases import HARD_CASES
from tests.verification.hard_cases.collisions import PLACES, SPEEDS
from tests.verification.hard_cases.gates import of_case


@pytest.mark.parametrize("name", HARD_CASES)
def test_case_ends_in_its_certified_answer(name):
    rows = list(of_case(HARD_CASES[name]))
    assert rows
    assert [row for row in rows if not row.holds] == []


@pytest.mark.parametrize("name", HARD_CASES)
def test_textbook_on_hard_cases(name):
    """Whatever `classical` makes of a case: the certified answer again, or DIVERGED with a reason."""
    case = HARD_CASES[name]
    verdict = case.run(Settings.classical(case.settings.dt))
    if verdict.certified:
        assert all(verdict.measured[key] <= limit for key, limit in verdict.limits.items())
    else:
        assert verdict.answer == {}
        assert verdict.reason
        assert str(verdict).startswith("DIVERGED: ")


def test_doubts_of_a_run_with_one_fault():
    case = HARD_CASES["sizes 1e-4 to 1e4 m, masses 1e-9 to 1e9 kg"]
    run, broken, pushed = (case.played(case.settings) for _ in range(3))
    steps, faster, sunk = (case.played(Settings.fixed_step(case.settings.dt)) for _ in range(3))
    assert doubts(run) == doubts(steps) == ""
    broken.record.pose[-1, 1, 0] = math.nan
    assert "not finite" in doubts(broken)
    pushed.record.pieces.impulse[-1] *= 1.0 + 1e-6
    assert doubts(pushed) != ""
    assert "unsolved" in doubts(replace(steps, certificate=steps.certificate | {"natural": 1e-3}))
    faster.record.twist[-1, -1, 0] = 1e4  # of the heaviest: far more than all weights times half widths
    assert "energy grew" in doubts(faster)
    assert doubts(faster, excused=("gain",)) == ""
    sunk.record.contacts.gap[sunk.record.offset[-2] :] = -1e-3
    assert "overlap" in doubts(sunk)


def test_answers_beyond_a_limit_or_without_a_number():
    assert within({"x": 1.0}, {"x": 0.5}, "fits").answer == {"x": 0.5}
    for value in (1.5, -1.5, math.nan):
        verdict = within({"x": 1.0}, {"x": value}, "fits")
        assert isinstance(verdict, Verdict)
        assert not verdict.certified
        assert verdict.answer == {}


@pytest.mark.parametrize("key", SPEEDS, ids=lambda key: " ".join(key))
def test_speeds_of_a_law_from_its_impulses(key):
    places, law = key
    positions = np.array(PLACES[places])
    velocity = np.array([[1.0, 0.0], [0.0, 0.0], [0.0, 0.0]])
    pairs = [(a, b) for a, b in ((0, 1), (0, 2), (1, 2)) if math.dist(positions[a], positions[b]) < 1.001]
    normals = [positions[b] - positions[a] for a, b in pairs]
    rows = np.zeros((len(pairs), 3, 2))
    for row, (a, b), n in zip(rows, pairs, normals, strict=True):
        row[a], row[b] = -n, n
    jacobian = rows.reshape(len(pairs), 6)
    if law == "N-SIM":
        approach = jacobian @ velocity.ravel()
        closing = [i for i in range(len(pairs)) if not (places == "wedge" and pairs[i] == (1, 2))]
        j = jacobian[closing]
        p = np.linalg.solve(j @ j.T, -2.0 * np.minimum(approach[closing], 0.0) - np.maximum(approach[closing], 0.0))
        velocity = velocity + (j.T @ p).reshape(3, 2)
        assert (p > 0.0).all()
    else:
        while (approach := jacobian @ velocity.ravel()).min() < -1e-12:
            first = int(np.flatnonzero(approach < -1e-12)[0])
            velocity = velocity - (approach[first] * jacobian[first]).reshape(3, 2)
    assert np.hypot(*velocity.T) == pytest.approx(SPEEDS[key], abs=1e-15)
    assert (velocity**2).sum() == pytest.approx(1.0, abs=1e-15)


def test_energy_of_free_bodies():
    case = HARD_CASES["three discs, row, N-SIM"]
    run = case.played(case.settings)
    total = energy(run.model, run.record.pose, run.record.twist)
    assert total == pytest.approx([0.5, 0.5], abs=1e-15)
