"""Reasons of MuJoCo's findings that no setting switches off, shown by closed forms and by what they grow with."""

import math

import numpy as np
import pytest

from validation.catalogue import CATALOGUE
from validation.cells import Slot
from validation.running.execution import execute
from validation.scenes.kane import answers
from validation.settings.switching import switched
from validation.truths.corners import landing_corner

pytest.importorskip("mujoco")
DT = 1 / 240


def struck(profile, params):
    """Speed upwards, along the floor and spin of a rod after its blow, and how deep a step found its end [m]."""
    canonical = CATALOGUE["kane"]
    scene = canonical.scene(2, params)
    found = execute(Slot("kane", canonical.minimal(params), 2, "mujoco", profile, DT)).metrics
    late = -scene.params["delay"] / DT % 1.0
    return np.array([found[name][0] for name in ("rise", "ahead", "spin")]), late * scene.params["v"] * DT


def end_of(params):
    """A rod's end against its centre: along the floor and below it [m], and its numbers."""
    p = CATALOGUE["kane"].scene(2, params).params
    return *landing_corner(p["aspect"], 1.0, math.radians(90.0 - p["lean"])), p


def textbook(params, shorter):
    """The same by Newton's and Coulomb's laws, of an arm that is ``shorter`` [m]."""
    x, below, p = end_of(params)
    square, y = (1.0 + p["aspect"] ** 2) / 12.0, below - shorter
    mobility = np.array([[1.0 + x * x / square, x * y / square], [x * y / square, 1.0 + y * y / square]])
    ((normal, tangent),) = answers(mobility, np.array([-p["v"], p["along"] * p["v"]]), p["e"], p["mu"])
    return np.array([normal - p["v"], p["along"] * p["v"] + tangent, (x * normal + y * tangent) / square])


@pytest.mark.parametrize("delay", [0.0507, 0.0525, 0.0539])
@pytest.mark.parametrize("params", [{}, {"e": 0.5, "mu": 0.1}])
def test_matched_strikes_a_rod_half_way_into_the_overlap_that_a_step_finds(params, delay):
    params = params | {"delay": delay}
    found, depth = struck("matched", params)
    assert depth > 1e-4 and np.abs(found - textbook(params, 0.5 * depth)).max() < 1e-9
    assert np.abs(found - textbook(params, 0.0)).max() > 1e-5


def test_tuned_strikes_there_as_well_and_falls_short_by_its_impedance():
    """Of a change of 2.5 rad/s at most 1e-4, which the impedance lacks."""
    found, depth = struck("tuned", {})
    assert np.abs(found - textbook({}, 0.5 * depth)).max() < 2.5e-4
    assert np.abs(found - textbook({}, 0.0)).max() > 2.5e-3


def test_an_end_that_slips_is_lifted_by_mu_times_its_slip_with_profile_tuned():
    """A cone that is convex without complementarity: u_n + e u_n0 = mu |u_t|, but for the 1e-4 of the impedance."""
    params = {"e": 0.5, "mu": 0.1}
    (rise, ahead, spin), depth = struck("tuned", params)
    x, below, p = end_of(params)
    normal, slip = rise + spin * x, ahead + spin * (below - 0.5 * depth)
    lifted = normal - p["e"] * p["v"]
    assert lifted == pytest.approx(p["mu"] * abs(slip), rel=1e-2) and lifted > 1e-2


def test_what_a_rack_loses_with_profile_tuned_grows_with_what_its_impedance_lacks():
    rack = Slot("rack", (), 2, "mujoco", "tuned", DT)
    lost = [
        execute(switched(rack, {"solimp": (d, d, 0.001, 0.5, 1.0)})).metrics["energy_defect"][0]
        for d in (0.9999, 0.999, 0.99)
    ]
    assert lost[1] / lost[0] == pytest.approx(10.0, rel=0.02) and lost[2] / lost[1] == pytest.approx(10.0, rel=0.2)
