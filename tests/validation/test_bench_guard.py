"""The guard against a slower textbook step: its naive sweeps solve, and it says which step is too slow."""

import numpy as np
import pytest

from validation.bench import guard
from validation.bench.statistics import spread


def test_the_naive_sweeps_end_at_rest():
    """A body between two contacts that push it apart along one axis: no contact sinks after many sweeps."""
    bodies = np.array([[0, 1], [1, 2]], np.uint64)
    arms = np.zeros((2, 2, 2, 3))
    arms[:, 0, 0, 0], arms[:, 0, 1, 0] = -1.0, 1.0  # normals along x
    arms[:, 1, 0, 1], arms[:, 1, 1, 1] = -1.0, 1.0  # friction along y
    velocity, impulse = np.array([[1.0, 0.1, 0.0], [0.0, 0.0, 0.0], [-1.0, 0.0, 0.0]]), np.zeros((2, 2))
    before = velocity.sum(axis=0)
    guard.naive(200, bodies, arms, impulse, velocity)
    assert np.allclose(velocity.sum(axis=0), before) and np.allclose(np.diff(velocity[:, :2], axis=0), 0.0)
    assert (impulse[:, 0] > 0.0).all() and (np.abs(impulse[:, 1]) <= guard.MU * impulse[:, 0]).all()


@pytest.mark.parametrize(("median", "status"), [(1.0, 0), (1.59, 0), (1.61, 1), (0.1, 0)])
def test_a_step_is_too_slow_beyond_the_margin(monkeypatch, capsys, median, status):
    monkeypatch.setattr(guard, "ratio", lambda told, sweeps: spread([median * told["ratio"]] * 3))
    assert guard.main() == status
    assert ("TOO SLOW" in capsys.readouterr().out) == bool(status)


@pytest.mark.long
def test_watched_steps_run(monkeypatch):
    pytest.importorskip("numba")
    monkeypatch.setattr(guard, "ROUNDS", 1)
    assert guard.main() in (0, 1)
