"""Columns at rest: each number is read from motions and loads that are written down by hand."""

import math
from dataclasses import replace

import numpy as np
import pytest
from planted import carried, still

from adapters.scene import Box, Disc, Sphere
from adapters.trajectory import Sampling, Trajectory
from validation.catalogue import CATALOGUE
from validation.metrics import UNAVAILABLE
from validation.truths import columns

DT, G = 1 / 64, 8.0  # powers of two: sums and quotients below are exact
STEPS = 192  # three seconds
STILL = 0.01 * G * DT


def column(dimension=2, n=3, mass=2.0):
    return CATALOGUE["stack"].scene(dimension, {"n": n, "mass": mass, "g": G, "duration": STEPS * DT})


def resting(scene, shares=None, first=0):
    """The scene at rest; interface i carries ``shares[i]`` (one number, or one per step) of the weight above it."""
    d, n = scene.dimension, len(scene.bodies) - 1
    pose, twist = still(scene, STEPS + 1)
    contacts = None
    if shares is not None:
        impulse = np.zeros((STEPS + 1 - first, n, d))
        for i in range(n):
            impulse[:, i, -1] = np.broadcast_to(shares[i], STEPS + 1)[first:] * (n - i) * 2.0 * G * DT
        contacts = carried([(i, i + 1) for i in range(n)], impulse, first)
    return Trajectory(np.arange(STEPS + 1) * DT, pose, twist, contacts, DT, "completed")


def values(scene, trajectory):
    return {name: value for name, (value, _) in columns.measure(scene, trajectory).items()}


@pytest.mark.parametrize("dimension", [2, 3])
def test_measures_of_a_column_at_rest(dimension):
    scene = column(dimension)
    measured = columns.measure(scene, resting(scene, [1.0, 1.0, 1.0]))
    assert {name: value for name, (value, _) in measured.items()} == columns.exact(scene)
    assert {said for _, said in measured.values()} == {""}


def test_column_loads_of_the_last_second_relative_to_weight():
    scene, late = column(), np.arange(STEPS + 1) * DT > 2.0
    shares = [
        np.where(late, 0.5, 9.0),
        np.where(late, 1.25, 9.0),
        np.where(late, 1.0 + 0.25 * (-1.0) ** np.arange(193), 9),
    ]
    found = values(scene, resting(scene, shares))
    assert [found[f"interface_impulse[{i}]"] for i in (1, 2, 3)] == [0.5, 1.25, 1.0]
    assert found["impulse_scatter"] == 0.25  # the largest of all interfaces


def test_reasons_of_unrecorded_loads():
    scene = column()
    measured = columns.measure(scene, resting(scene))
    assert measured["interface_impulse[1]"] == (None, "contacts were not recorded")
    assert measured["impulse_scatter"] == (None, UNAVAILABLE)


def test_scatter_without_impulses_at_an_interface():
    """The one that is missing may be the one that shakes."""
    scene = column()
    measured = columns.measure(scene, resting(scene, [1.0, math.nan, 1.0]))
    assert measured["interface_impulse[1]"] == measured["interface_impulse[3]"] == (1.0, "")
    assert measured["interface_impulse[2]"][0] is None
    assert measured["impulse_scatter"] == (None, UNAVAILABLE)


def test_mean_energy_and_rest_time_of_a_column():
    scene = column(n=1)
    trajectory = resting(scene)
    twist = trajectory.twist.copy()
    twist[:64, 1, 0] = 4.0  # before: counts for neither
    twist[129:, 1, 1] = 2.0 * STILL
    assert values(scene, replace(trajectory, twist=twist))["kinetic_energy"] == pytest.approx(
        0.5 * 2 * (2 * STILL) ** 2
    )
    twist[130:] = 0.0
    found = values(scene, replace(trajectory, twist=twist))
    assert found["kinetic_energy"] == pytest.approx((2 * STILL) ** 2 / 64)
    assert found["settle_time"] == 130 * DT


def test_column_at_rest_by_its_fastest_body():
    scene = column()
    trajectory = resting(scene)
    twist = trajectory.twist.copy()
    twist[:100, 2, 0] = math.nextafter(STILL, 1.0)
    twist[:180, 1, 0] = STILL
    assert values(scene, replace(trajectory, twist=twist))["settle_time"] == 100 * DT


def test_displacements_of_a_column_detected():
    scene = column()
    trajectory = resting(scene)
    pose = trajectory.pose.copy()
    pose[-1, 3, 0] += 0.25
    pose[50, 2:, 1] -= 0.125
    found = values(scene, replace(trajectory, pose=pose))
    assert (found["drift"], found["penetration"]) == (0.25, 0.125)


def test_recorded_contacts_of_the_last_second():
    assert columns.sampling(column()) == Sampling(1, 2.0)
    assert columns.sampling(replace(column(), duration=0.5)) == Sampling(1, 0.0)


def test_overlap_rounding_by_the_height_of_the_column():
    found = {check.metric: check.bound for check in columns.checks(column(n=3), DT, columns.exact(column(n=3)))}
    assert found["penetration"] == pytest.approx(G * DT**2 + 1e-12 * 2.5, rel=1e-13, abs=0.0)


@pytest.mark.parametrize(
    ("drift", "penetration", "found"),
    [
        ((0.5, ""), (0.25, ""), (2.0, "")),
        ((0.125, ""), (0.25, ""), (1.0, "")),
        ((None, "it left"), (0.25, ""), (None, "it left")),
        ((0.5, ""), (None, "no shape"), (None, "no shape")),
        ((None, "it left"), (None, "no shape"), (None, "it left")),
    ],
)
def test_displacement_in_sizes(drift, penetration, found):
    assert columns.displacement({"drift": drift, "penetration": penetration}, 0.25) == found


def found(drift=0.0, penetration=0.0, energy=0.0):
    return {"drift": (drift, ""), "penetration": (penetration, ""), "kinetic_energy": (energy, "")}


#: What three boxes of 2 kg with a side of a metre gain in a fall by one, under 8 m/s^2 [J].
FALL = 3 * 2.0 * 8.0


@pytest.mark.parametrize(
    ("measured", "said"),
    [
        (found(), ""),
        (found(0.5, 0.1, FALL), ""),  # as far as it may and still stand
        (found(0.51, 0.0, 0.0), "toppled"),
        (found(0.5, 0.11, 0.0), "sank"),
        (found(0.51, 0.11, 0.0), "toppled"),
        (found(9.0, 9.0, 1.01 * FALL), "exploded"),
        (found(0.5, 0.0, 0.99 * FALL), ""),
        (found(drift=None), "NaN"),
        (found(penetration=None), "NaN"),
        (found(energy=None), "NaN"),
        ({}, "NaN"),
    ],
)
def test_fate_of_a_column(measured, said):
    assert columns.fate(column(), measured) == said


@pytest.mark.parametrize(("half", "side"), [((0.25, 0.125), 0.25), ((0.5, 0.5), 1.0), ((3.0, 2.0), 4.0)])
def test_a_side_is_the_height_of_the_lowest_body(half, side):
    scene = column()
    flat = replace(scene, bodies=(scene.bodies[0], replace(scene.bodies[1], shape=Box(half)), *scene.bodies[2:]))
    assert columns.fate(flat, found(0.51 * side)) == "toppled"
    assert columns.fate(flat, found(0.49 * side)) == ""
    assert columns.fate(flat, found(0.0, 0.11 * side)) == "sank"
    assert columns.fate(flat, found(0.0, 0.09 * side)) == ""
    assert columns.fate(flat, found(energy=1.01 * 48.0 * side)) == "exploded"
    assert columns.fate(flat, found(energy=0.99 * 48.0 * side)) == ""


def test_in_space_a_side_is_the_height_as_well():
    scene = column(3)
    flat = replace(scene.bodies[1], shape=Box((0.5, 0.5, 0.25)))
    lower = replace(scene, bodies=(scene.bodies[0], flat, *scene.bodies[2:]))
    assert columns.fate(lower, found(0.26)) == "toppled" and columns.fate(lower, found(0.24)) == ""


def test_side_and_fate_of_bodies_other_than_boxes():
    for dimension, shape in ((2, Disc(0.5)), (3, Sphere(0.5))):
        scene = column(dimension)
        ball = replace(scene.bodies[1], shape=shape)
        balls = replace(scene, bodies=(scene.bodies[0], ball, *scene.bodies[2:]))
        assert columns.fate(balls, found(9.0, 9.0, 9e9)) == ""


def test_overlaps_between_and_within_layers():
    """Two boxes side by side on the floor, one upon both; the two overlap each other by a quarter, the upper one by an
    eighth, and in the list of bodies each is the neighbour of the next."""
    scene = column(n=3)
    pose = resting(scene).pose.copy()
    pose[:, 1, :2], pose[:, 2, :2], pose[:, 3, :2] = (-0.375, 0.5), (0.375, 0.5), (0.0, 1.375)
    layers = ((0,), (1, 2), (3,))
    trajectory = replace(resting(scene), pose=pose)
    assert columns.measure(scene, trajectory, layers)["penetration"] == (0.125, "")
    assert columns.exact(scene, layers) == columns.exact(column(n=2))  # two interfaces
