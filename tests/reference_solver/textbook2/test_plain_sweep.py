"""The sweep that is read is the sweep that runs."""

import copy

import numpy as np
import pytest

from reference_solver import Settings
from reference_solver.compilation import from_python
from reference_solver.textbook2.columns import FRICTION, PN, PT
from reference_solver.textbook2.sequential_impulses import sweep_rows
from tests.reference_solver.textbook2.plain_sweep import plain_sweep

G = 9.81


@pytest.fixture(scope="module")
def fast_sweep():
    return from_python(sweep_rows)


def swept(build, sweep, friction=0.4):
    """Velocities and impulses after ten sweeps from impulses and velocities that solve nothing."""
    bodies = [build.floor(), build.box(0.0, 0.5), build.box(0.1, 1.5), build.disc(1.0, 0.5), build.box(0.8, 1.5)]
    simulation = build.simulation(bodies, Settings.classical(build.dt), (0.0, -G), 0.0, friction)
    simulation.advance(2)
    world, random = copy.copy(simulation)._world, np.random.default_rng(7)
    state, rows, options = world._bodies, world._rows, world._options
    state.twist[1:] += random.uniform(-1.0, 1.0, state.twist[1:].shape)
    rows.real[:, PN] = random.uniform(0.0, 0.2, len(rows.real))
    rows.real[:, PT] = rows.real[:, FRICTION] * rows.real[:, PN] * random.uniform(-1.0, 1.0, len(rows.real))
    for k in range(10):
        sweep(state, rows, options, k >= 5)
    count = rows.counts[0]
    assert count >= 5
    return np.concatenate([state.twist.ravel(), rows.real[:count, [PN, PT]].ravel()])


def test_plain_sweep_and_fast_sweep(build, fast_sweep):
    """Ten sweeps of a dozen operations that round: a hundred units in the last place of 1 m/s."""
    fast = swept(build, lambda state, rows, options, back: fast_sweep(state, rows, options, 1.0, int(back), 0))
    plain = swept(build, lambda state, rows, options, back: plain_sweep(state, rows, back))
    assert np.abs(plain - fast).max() < 2e-14
    in_one_order = swept(build, lambda state, rows, options, back: plain_sweep(state, rows, False))
    slippery = swept(build, lambda state, rows, options, back: plain_sweep(state, rows, back), 0.39)
    assert min(np.abs(other - fast).max() for other in (in_one_order, slippery)) > 1e-6
