"""Reasons of MuJoCo's findings that no setting switches off, shown by closed forms and by what they grow with."""

import numpy as np
import pytest
from rods import DT, end_of, struck, textbook

from validation.cells import Slot
from validation.running.execution import execute
from validation.settings.switching import switched

pytest.importorskip("mujoco")


@pytest.mark.parametrize("delay", [0.0507, 0.0525, 0.0539])
@pytest.mark.parametrize("params", [{}, {"e": 0.5, "mu": 0.1}])
def test_matched_strike_of_a_rod_at_half_the_overlap(params, delay):
    params = params | {"delay": delay}
    found, depth = struck("mujoco", "matched", params)
    assert depth > 1e-4 and np.abs(found - textbook(params, 0.5 * depth)).max() < 1e-9
    assert np.abs(found - textbook(params)).max() > 1e-5


def test_tuned_strike_short_by_its_impedance():
    """Of a change of 2.5 rad/s at most 1e-4, which the impedance lacks."""
    found, depth = struck("mujoco", "tuned", {})
    assert np.abs(found - textbook({}, 0.5 * depth)).max() < 2.5e-4
    assert np.abs(found - textbook({})).max() > 2.5e-3


def test_lift_of_a_slipping_end_tuned():
    """A cone that is convex without complementarity: u_n + e u_n0 = mu |u_t|, but for the 1e-4 of the impedance."""
    params = {"e": 0.5, "mu": 0.1}
    (rise, ahead, spin), depth = struck("mujoco", "tuned", params)
    x, below, _, p = end_of(params)
    normal, slip = rise + spin * x, ahead + spin * (below - 0.5 * depth)
    lifted = normal - p["e"] * p["v"]
    assert lifted == pytest.approx(p["mu"] * abs(slip), rel=1e-2) and lifted > 1e-2


def test_loss_of_a_rack_by_impedance_tuned():
    rack = Slot("rack", (), 2, "mujoco", "tuned", DT)
    lost = [
        execute(switched(rack, {"solimp": (d, d, 0.001, 0.5, 1.0)})).metrics["energy_defect"][0]
        for d in (0.9999, 0.999, 0.99)
    ]
    assert lost[1] / lost[0] == pytest.approx(10.0, rel=0.02) and lost[2] / lost[1] == pytest.approx(10.0, rel=0.2)
