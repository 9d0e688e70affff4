"""Box on an incline: the scene, what is measured of it, and the threshold that several ratios tell together."""

import math

import numpy as np
import pytest

from adapters.trajectory import Trajectory
from validation.canonical import Member
from validation.catalogue import CATALOGUE
from validation.scenes import incline

#: tan(theta) = 3/4: sine and cosine are .6 and .8.
SLOPE, MU, G = 0.75, 0.5, 10.0


def scene(dimension=2, ratio=SLOPE / MU, **params):
    return CATALOGUE["incline"].scene(dimension, {"ratio": ratio, "mu": MU, "g": G, **params})


@pytest.mark.parametrize("dimension", [2, 3])
def test_turned_gravity_on_a_level_floor(dimension):
    made = scene(dimension, mass=2.0, duration=4.0)
    floor, box = made.bodies
    level = (0.0,) * (dimension - 2)
    assert made.gravity == pytest.approx((6.0, *level, -8.0), rel=1e-15)
    assert (floor.shape.normal, floor.motion) == ((0.0, *level, 1.0), "fixed")
    assert (box.name, box.mass, box.shape.half_extents) == ("box", 2.0, (0.5,) * dimension)
    assert box.pose[:dimension] == (0.0, *level, 0.5) and not any(box.twist)
    material = made.material("box", "floor")
    assert (material.restitution, material.friction) == (0.0, MU)
    assert (made.name, made.version, made.duration, made.params["ratio"]) == ("incline", 1, 4.0, 1.5)


def test_stick_up_to_the_cone_edge_and_slide_beyond():
    assert incline.exact(scene(ratio=0.5)) == incline.exact(scene(ratio=1.0)) == {"creep": 0.0}
    assert incline.exact(scene()) == {"acceleration": pytest.approx(10.0 * (0.6 - 0.5 * 0.8))}
    steeper = incline.exact(scene(ratio=1.0000001))
    assert 0.0 < steeper["acceleration"] < 1e-5


def moving(x, v, dt=0.25):
    pose, twist = np.zeros((len(x), 2, 3)), np.zeros((len(x), 2, 3))
    pose[:, 1, 0], twist[:, 1, 0] = x, v
    pose[:, 0, 0], twist[:, 0, 0], pose[:, 1, 1] = 99.0, 99.0, 77.0
    return Trajectory(np.arange(len(x)) * dt, pose, twist, None, dt, "completed")


def test_creep_and_acceleration_are_means_over_the_second_half():
    t = np.arange(9) * 0.25
    late = t >= 1.0
    found = incline.measure(scene(), moving(np.where(late, 3.0 * t, 50.0), np.where(late, 7.0 * t, -50.0)))
    assert found == {"creep": (pytest.approx(3.0), ""), "acceleration": (pytest.approx(7.0), "")}


@pytest.mark.parametrize("dimension", [2, 3])
def test_incline_truth_at_rest_or_on_a_parabola(dimension):
    level = (0.0,) * (dimension - 2)
    sliding, stuck = incline.track(scene(dimension)), incline.track(scene(dimension, ratio=0.5))
    assert sliding.body == stuck.body == "box"
    assert sliding.position(3.0) == pytest.approx((9.0, *level, 0.5), rel=1e-12)  # 2 m/s^2 for three seconds
    assert stuck.position(3.0) == (0.0, *level, 0.5)


def test_error_of_a_side_in_units_of_g():
    slides, sticks = scene(duration=4.0), scene(ratio=0.5, duration=4.0)
    assert incline.error(slides, 0.1, {"acceleration": (1.0, "")}) == (pytest.approx(0.1), "")
    assert incline.error(slides, 0.1, {"acceleration": (3.0, "")}) == (pytest.approx(0.1), "")
    assert incline.error(sticks, 0.1, {"creep": (-2.0, "")}) == (pytest.approx(2.0 * 2.0 / 40.0), "")
    assert incline.error(sticks, 0.1, {"creep": (None, "it left")}) == (None, "it left")


# ---- the threshold -------------------------------------------------------------------------------------------------


def member(ratio, acceleration, dimension=2):
    """A cell at a ratio whose box was seen to accelerate so; ``None``: it gave no answer."""
    params = {"ratio": ratio, "mu": MU, "g": G, "mass": 1.0, "duration": 2.0}
    return Member(dimension, 1 / 240, params, {} if acceleration is ... else {"acceleration": (acceleration, "")})


def coulomb(ratio):
    """Acceleration of a box that slides at this ratio [m/s^2]."""
    theta = math.atan(ratio * MU)
    return G * (math.sin(theta) - MU * math.cos(theta))


@pytest.mark.parametrize(
    ("answers", "value", "said"),
    [
        # Sticks below, slides above: the truth, in the middle of the bracket.
        ({0.9: 0.0, 0.99: 0.0, 1.01: coulomb(1.01), 1.5: coulomb(1.5)}, 1.0, "sticks at 0.99, slides at 1.01"),
        # An engine that lets go too late: 1.01 still sticks.
        ({0.9: 0.0, 0.99: 0.0, 1.01: 0.0, 1.5: coulomb(1.5)}, 1.255, "sticks at 1.01, slides at 1.5"),
        # One that lets go too early, and one whose stick above an earlier slide does not count.
        ({0.8: 0.0, 0.9: coulomb(1.1), 1.1: coulomb(1.1)}, 0.85, "sticks at 0.8, slides at 0.9"),
        ({0.8: 0.0, 0.9: coulomb(1.1), 1.1: 0.0, 1.5: coulomb(1.5)}, 0.85, "sticks at 0.8, slides at 0.9"),
        ({0.9: 0.0, 1.1: 0.0, 1.5: 0.0}, 1.5, "it never slides"),
        ({0.5: coulomb(1.5), 0.9: coulomb(1.1), 1.1: coulomb(1.1)}, 0.5, "it never sticks"),
        # It slides if it has more than half of the acceleration that is due, and a creep has none.
        ({0.5: 0.49 * coulomb(1.5), 1.5: 0.51 * coulomb(1.5)}, 1.0, "sticks at 0.5, slides at 1.5"),
        ({0.5: 0.51 * coulomb(1.5), 1.5: 0.49 * coulomb(1.5)}, 0.5, "it never sticks"),
        # What has no answer is left out.
        ({0.9: 0.0, 0.99: None, 1.01: ..., 1.1: coulomb(1.1)}, 1.0, "sticks at 0.9, slides at 1.1"),
        # On the edge itself both are right.
        ({0.9: 0.0, 1.0: coulomb(1.5), 1.1: coulomb(1.1)}, 1.0, "sticks at 0.9, slides at 1.1"),
    ],
)
@pytest.mark.parametrize("dimension", [2, 3])
def test_incline_threshold_between_last_stick_and_first_slide(answers, value, said, dimension):
    found, why, check = incline.threshold([member(ratio, a, dimension) for ratio, a in answers.items()])
    assert (found, why) == (pytest.approx(value), said)
    usable = [ratio for ratio, a in answers.items() if a not in (None, ...)]
    below, above = max(r for r in usable if r < 1.0), min(r for r in usable if r > 1.0)
    assert (check.metric, check.unit, check.truth) == ("threshold", "1", 1.0)
    assert check.bound == pytest.approx(0.5 * (above - below))
    assert check.because == f"half the distance between the ratios tried next to 1, {below:g} and {above:g}"
    assert check.source == "Coulomb's law: sticks iff tan(theta) <= mu"


@pytest.mark.parametrize(
    "answers", [{}, {0.9: 0.0}, {1.1: 1.0}, {1.0: 0.0}, {0.9: 0.0, 1.0: 1.0}, {0.9: 0.0, 1.1: None}, {0.9: ..., 1.1: 1}]
)
def test_ratios_on_one_side_alone_tell_no_threshold(answers):
    assert incline.threshold([member(ratio, a) for ratio, a in answers.items()]) is None
