"""Boxes that slide to a stop, worked out once more by hand: how they start, what is forgiven, ghost and error."""

import math
from dataclasses import replace

import numpy as np
import pytest
from planted import stated, still

from adapters.trajectory import Trajectory
from validation.catalogue import CATALOGUE

DT = 1 / 64
SOURCE = "Coulomb's law, kinetic: friction mu N against the motion, whatever the heading"
#: 2 m in 1 s: v = 4 m/s, mu g = 4 m/s^2.
PARAMS = {"v": 4.0, "mu": 0.5, "g": 8.0, "aspect": 2.0}


def made(name, dimension=2, **params):
    canonical = CATALOGUE[name]
    return canonical, canonical.scene(dimension, PARAMS | params)


def near(value):
    """Near enough to tell a round-off of 1e-12 of a place from one of another place."""
    return pytest.approx(value, rel=1e-13)


def test_start_of_a_box_along_its_heading():
    _, scene = made("slide", 3, heading=30.0, mass=3.0)
    box = scene.bodies[-1]
    assert (scene.name, scene.version, box.name, box.mass, scene.duration) == ("slide", 1, "box", 3.0, 1.5)
    assert box.shape.half_extents == (0.5, 0.5, 0.25)
    assert box.pose == (0.0, 0.0, 0.25, 1.0, 0.0, 0.0, 0.0)
    assert box.twist == pytest.approx((2.0 * math.sqrt(3.0), 2.0, 0.0, 0.0, 0.0, 0.0))
    _, ahead = made("slide", 3)
    assert ahead.bodies[-1].twist == (4.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    _, long = made("slide", g=4.0)
    assert (long.bodies[-1].pose, long.bodies[-1].twist) == ((0.0, 0.25, 0.0), (4.0, 0.0, 0.0))
    assert long.duration == 3.0  # half as long again as the 2 s that it slides


def test_length_of_five_plates():
    """Half a plate, 3 m and a width of 1 m are 4.5 m of plates of 1 m."""
    _, scene = made("seam", 3, plate=1.0)
    *plates, box = scene.bodies
    assert (scene.name, scene.version, box.name, scene.gravity) == ("seam", 1, "box", (0.0, 0.0, -8.0))
    assert [plate.name for plate in plates] == ["plate1", "plate2", "plate3", "plate4", "plate5"]
    assert [plate.pose for plate in plates] == [(float(k), 0.0, -0.25, 1.0, 0.0, 0.0, 0.0) for k in range(5)]
    assert {plate.shape.half_extents for plate in plates} == {(0.5, 2.0, 0.25)}
    assert {plate.motion for plate in plates} == {"fixed"} and box.motion == "free"
    assert box.pose == (0.0, 0.0, 0.25, 1.0, 0.0, 0.0, 0.0) and box.twist == (4.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    assert scene.duration == 1.5 and (scene.pairs[0].restitution, scene.pairs[0].friction) == (0.0, 0.5)
    assert len(made("seam", plate=0.5)[1].bodies) == 9 + 1  # 4.25 m


def test_slide_allowance_of_one_step():
    """At 1/64 s and 8 m/s^2: v dt = 1/16 m, g dt^2 = 1/512 m, g dt/100 = 1/800 m/s; places to 1e-12 of 2 m."""
    canonical, scene = made("slide", 3)
    fall, still = 1 / 512, 1 / 800
    assert stated(canonical.checks(scene, DT)) == {
        "stopping_distance": ("m", near(1.5 / 16 + 1.5 * fall + 2e-12)),
        "braking": ("m/s^2", near(still / (31 / 64))),
        "end_speed": ("m/s", near(still)),
        "hop": ("m", near(fall + 2e-12)),
        "turned": ("m", near(fall + 2e-12)),
        "astray": ("m", near(fall + 2e-12)),
        # 2 g dt/100 of momentum left over the half second, or in one step, as a share of what gravity gives in it
        **{f"{force}[mean]": ("1", near(0.02 * DT / 0.5)) for force in ("normal", "friction")},
        **{f"{force}[{by}]": ("1", 0.02) for force in ("normal", "friction") for by in ("least", "greatest")},
    }
    of_forces = {"the floor carries the weight", "Coulomb's law, kinetic: mu N"}
    assert {check.source for check in canonical.checks(scene, DT)} == {SOURCE} | of_forces


def test_slide_of_two_steps():
    canonical, scene = made("slide", v=0.125)
    found = stated(canonical.checks(scene, DT))
    assert found["braking"] == ("m/s^2", near(64 / 800))
    assert found["hop"] == ("m", near(1 / 512 + 1e-12 / 512))  # the way is 1/512 m


def test_round_off_of_places_on_plates():
    canonical, scene = made("seam", 3, plate=1.0)
    found = stated(canonical.checks(scene, DT))
    for metric in ("hop", "turned", "astray"):
        assert found[metric] == ("m", near(1 / 512 + 4e-12))
    assert found["stopping_distance"] == ("m", near(1.5 / 16 + 1.5 / 512 + 4e-12))
    # Plates that end before the way does add nothing.
    canonical, short = made("far_origin", far=0.0)
    assert stated(canonical.checks(short, DT))["hop"] == ("m", near(1 / 512 + 2e-12))


def moved(scene, dt=DT):
    """A box that does all that can be measured: brakes as (2 - t)^2/4 does, ends 1.2 m on, hops, turns and goes on."""
    box, t = len(scene.bodies) - 1, np.arange(round(scene.duration / dt) + 1) * dt
    pose, twist = still(scene, len(t))
    twist[:, box, 0] = (2.0 - t) ** 2 / 4.0
    twist[-1, box, :3] = (0.3, 0.4, 1.2)
    pose[-1, box, :2] += (1.2, 0.5)
    pose[10, box, 2] -= 0.02
    pose[20:, box, 3:] = (math.cos(0.05), 0.0, 0.0, math.sin(0.05))
    return Trajectory(t, pose, twist, None, dt, "completed")


@pytest.mark.parametrize("name", ["seam", "far_origin"])
def test_measures_of_a_slide(name):
    canonical, scene = made(name, 3, g=4.0)  # it slides for 2 s
    assert canonical.measure(scene, moved(scene)) == {
        "stopping_distance": (pytest.approx(1.2), ""),
        "braking": (pytest.approx((1.5**2 - 0.5**2) / 4.0 / 1.0), ""),
        "end_speed": (pytest.approx(1.3), ""),
        "hop": (pytest.approx(0.02), ""),
        "turned": (pytest.approx(0.1 * 0.75), ""),  # the corners are at (1/2, 1/2, 1/4) m
        "astray": (pytest.approx(0.5), ""),
    }


def test_a_slide_within_one_step_has_no_braking():
    canonical, scene = made("slide", 3, v=0.04)
    _, long = made("slide", 3)
    assert canonical.measure(scene, moved(long))["braking"] == (None, "the slide lasts less than two steps")


def test_parabola_of_the_truth_in_a_replay():
    """x = 4 t - 2 t^2 until 1 s."""
    _, scene = made("slide", 3, heading=60.0)
    ghost = CATALOGUE["slide"].track(scene)
    assert ghost.body == "box"
    for t, way in ((0.0, 0.0), (0.25, 0.875), (0.5, 1.5), (1.0, 2.0), (1.4, 2.0)):
        assert ghost.position(t) == pytest.approx((0.5 * way, way * math.sqrt(0.75), 0.25), abs=1e-15)
    _, plates = made("seam", plate=1.0)
    assert CATALOGUE["seam"].track(plates).body == "box"
    assert CATALOGUE["seam"].track(plates).position(0.5) == pytest.approx((1.5, 0.25))
    _, far = made("far_origin", far=1024.0)
    start = far.bodies[-1].pose
    assert CATALOGUE["far_origin"].track(far).position(0.5) == pytest.approx((start[0] + 1.5, start[1]), rel=1e-15)


def test_slide_error_relative_to_the_stopping_distance():
    canonical, scene = made("slide", 3)
    error = canonical.primary.error
    assert error(scene, DT, {"stopping_distance": (2.3, ""), "astray": (0.4, "")}) == (pytest.approx(0.25), "")
    assert error(scene, DT, {"stopping_distance": (1.7, "")}) == (pytest.approx(0.15), "")
    assert error(scene, DT, {"stopping_distance": (2.0, ""), "astray": (None, "lost")}) == (0.0, "")
    assert error(scene, DT, {"stopping_distance": (None, "lost")}) == (None, "lost")


def test_place_round_off_by_distance_or_farthest_plate():
    """A step of 10 ns sinks by 1e-15 m: what is left of a bound on height is 1e-12 of the largest coordinate."""
    for name, params, place in (("slide", {"v": 0.1}, 0.01 / (0.8 * 9.81)), ("seam", {"v": 10.0, "plate": 5.0}, None)):
        canonical = CATALOGUE[name]
        scene = canonical.scene(2, params)
        (hop,) = (check for check in canonical.checks(scene, 1e-8) if check.metric == "hop")
        farthest = place or scene.bodies[-2].pose[0]
        assert hop.bound == pytest.approx(9.81e-16 + 1e-12 * farthest, rel=1e-3, abs=0.0)


def test_start_of_the_replay_truth_in_space():
    canonical, scene = made("slide", 3, heading=30.0)
    box = scene.bodies[-1]
    moved = replace(scene, bodies=(*scene.bodies[:-1], replace(box, pose=(1.0, -2.0, *box.pose[2:]))))
    assert canonical.track(moved).position(0.0) == pytest.approx((1.0, -2.0, box.pose[2]))
