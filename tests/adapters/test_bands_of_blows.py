"""Bands of MuJoCo's laws of blows: what starts that are off by round-off make of a value, and the sums of its steps."""

from types import SimpleNamespace

import pytest

from adapters.mujoco.convex_blows import GAP_ROUND_OFF, PERTURBATIONS, SPREAD_FACTOR, SUM_ROUND_OFF, _told_alike
from validation.catalogue import CATALOGUE


def moving(speed):
    """Two balls of which the first is the faster [m/s]."""
    return CATALOGUE["head_on"].scene(2, {"v1": speed, "v2": -0.5 * speed})


def told(speed, slope, lost=None):
    """What is told of a value that grows with how far a start is moved; nothing at the start ``lost``."""
    scene, asked = moving(speed), []

    def motion(moved):
        asked.append(moved)
        return None if lost is not None and len(asked) > lost else SimpleNamespace(moved=moved)

    def measure(given, path):
        assert given is scene
        return {"impulse": (3.0 + slope * path.moved, ""), "other": (None, "")}

    return _told_alike(scene, "impulse", measure, motion), asked, _told_alike(scene, "other", measure, motion)


@pytest.mark.parametrize(("speed", "sums"), [(0.25, 1.0), (8.0, 8.0)])
def test_a_band_has_the_spread_of_moved_starts_and_the_roundings_of_the_fastest_body(speed, sums):
    (value, band), asked, nothing = told(speed, 0.0)
    assert value == 3.0 and band == SUM_ROUND_OFF * sums
    assert asked[: 1 + len(PERTURBATIONS)] == [0.0, *(k * GAP_ROUND_OFF for k in PERTURBATIONS)] and nothing is None
    (value, wider), _, _ = told(speed, 1e3)
    most = max(abs(k) for k in PERTURBATIONS) * GAP_ROUND_OFF * 1e3
    assert value == 3.0 and wider - band == pytest.approx(SPREAD_FACTOR * most, rel=1e-3)


@pytest.mark.parametrize("lost", [0, 1, len(PERTURBATIONS)])
def test_where_one_of_the_starts_has_no_motion_the_law_is_silent(lost):
    assert told(1.0, 0.0, lost)[0] is None
