"""Impulses of the step before enter the next one inside its cone (E9)."""

import os
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from reference_solver import Settings
from tests.verification.space import GRAVITY, SPACES

#: Takes the disc away from warm starts, uncompiled.
WITHOUT = """
import sys; sys.path.insert(0, {!r})
from reference_solver.textbook3 import prepare
prepare.back_into_disc = lambda one, two, radius: (one, two)
import test_warm_starts as own
print(own.across(own.SPACES[1]))
"""


def across(space):
    """Largest impulse across the normal, as a share of that along it, of a ball that slips off another one."""
    below = replace(space.ball(0.0, 0.0), motion="fixed")
    bodies = [below, space.ball(0.1, (1.0 - 0.1**2) ** 0.5)]
    simulation = space.simulation(bodies, Settings.classical(1.0 / 240.0), GRAVITY)
    shares = []
    for _ in range(10):
        simulation.advance(1)
        found = simulation.contacts()
        along = (found.impulse * found.normal).sum(axis=1, keepdims=True)
        shares.append(np.abs(found.impulse - along * found.normal).max() / along.max())
    return max(shares)


@pytest.mark.parametrize("space", SPACES, ids=lambda space: space.name)
def test_impulse_of_a_frictionless_contact_that_turns(space):
    assert across(space) <= 4.0 * np.finfo(float).eps


def test_a_warm_start_outside_the_disc():
    """Where nothing rubs no row takes back what the old impulse has across the new normal, 8e-4 of it here.

    In the plane impulses are remembered along the axes of their contact, which turn with it, and each sweep leaves them
    inside the cone: without the interval the classical step has the same bits.
    """
    code, environment = WITHOUT.format(os.path.dirname(__file__)), os.environ | {"NUMBA_DISABLE_JIT": "1"}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment)
    assert done.returncode == 0, done.stderr
    assert float(done.stdout) > 1e-4
