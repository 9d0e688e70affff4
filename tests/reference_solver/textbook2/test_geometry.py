"""Contact points of every pair of shapes, seen through one step without motion.

Tolerances: one rotation and a few sums of lengths of order one, so 1e-15 to 1e-14 m.
"""

import math

import numpy as np
import pytest

from reference_solver import Body, Disc, HalfSpace


@pytest.fixture
def touch(build, fixed_step):
    """Contacts of a set of resting bodies."""

    def contacts(*bodies):
        simulation = build.simulation(list(bodies), fixed_step)
        simulation.advance(1)
        return simulation.contacts()

    return contacts


def turned(angle, x, y):
    return np.array([math.cos(angle) * x - math.sin(angle) * y, math.sin(angle) * x + math.cos(angle) * y])


@pytest.mark.parametrize("angle", [0.0, 0.3, 2.0, -1.2])
@pytest.mark.parametrize("gap", [-0.02, 0.0, 0.001])
def test_disc_on_a_tilted_half_space(touch, angle, gap):
    normal = turned(angle, 0.0, 1.0)
    plane = Body(HalfSpace(tuple(normal), 0.7), motion="fixed")
    centre = normal * (0.7 + 0.5 + gap) + turned(angle, 1.3, 0.0)
    found = touch(plane, Body(Disc(0.5), 1.0, 0.1, (*centre, 0.4)))
    assert found.gap == pytest.approx([gap], abs=1e-15)
    assert found.normal[0] == pytest.approx(normal, abs=1e-15)
    assert found.point[0] == pytest.approx(centre - 0.5 * normal, abs=1e-15)


def test_half_space_moved_by_its_pose(touch, build):
    """A floor turned by 90 degrees and moved to x = -1 is a wall whose free side looks to -x."""
    wall = Body(HalfSpace((0.0, 1.0), 0.25), pose=(-1.0, 5.0, math.pi / 2.0), motion="fixed")
    found = touch(wall, build.disc(-1.75, 0.0))
    assert found.gap == pytest.approx([0.0], abs=1e-15)
    assert found.normal[0] == pytest.approx([-1.0, 0.0], abs=1e-15)


@pytest.mark.parametrize("angle", [0.0, 0.4])
@pytest.mark.parametrize("quarter", range(4))
def test_flat_box_touches_with_two_corners(touch, build, angle, quarter):
    normal = turned(angle, 0.0, 1.0)
    plane = Body(HalfSpace(tuple(normal)), motion="fixed")
    half = (0.5, 0.3)
    height, width = (half[1], half[0]) if quarter % 2 == 0 else half
    found = touch(plane, build.box(*(normal * (height - 0.01)), half=half, angle=angle + quarter * math.pi / 2.0))
    assert found.gap == pytest.approx([-0.01, -0.01], abs=1e-15)
    along = sorted(found.point @ turned(angle, 1.0, 0.0))
    assert along == pytest.approx([-width, width], abs=1e-15)
    assert len(set(found.feature.tolist())) == 2


def test_number_of_a_turning_box_s_corner(touch, build):
    """Corner (-, -) of the box stays the same contact on both sides of 45 degrees."""
    numbers = set()
    for angle in (0.2, 0.7, math.pi / 4.0, 0.9, 1.3):
        depth = -turned(angle, -0.5, -0.5)[1]
        found = touch(build.floor(), build.box(0.0, depth - 1e-4, angle=angle))
        assert found.gap[0] == pytest.approx(-1e-4, abs=1e-15)
        assert found.point[0] == pytest.approx(turned(angle, -0.5, -0.5) + np.array([0.0, depth - 1e-4]), abs=1e-15)
        numbers.add(int(found.feature[0]))
    assert len(numbers) == 1


@pytest.mark.parametrize("gap", [-0.1, 0.0])
def test_contact_point_of_free_and_fixed_discs(touch, build, gap):
    direction = turned(0.7, 1.0, 0.0)
    for motion, reach in (("free", 0.5 + gap / 2.0), ("fixed", 0.5 + gap)):
        small = Body(Disc(0.25), 1.0, 0.1, (*(direction * (0.75 + gap)), 0.0))
        found = touch(build.disc(0.0, 0.0, motion=motion), small)
        assert found.gap == pytest.approx([gap], abs=1e-15)
        assert found.point[0] == pytest.approx(direction * reach, abs=1e-15)
        assert found.normal[0] == pytest.approx(direction, abs=1e-15)


def test_concentric_discs_have_a_finite_normal(touch, build):
    found = touch(build.disc(0.0, 0.0), build.disc(0.0, 0.0))
    assert found.gap[0] == -1.0
    assert np.hypot(*found.normal[0]) == 1.0


@pytest.mark.parametrize("order", [False, True])
@pytest.mark.parametrize(
    ("place", "outward", "gap"),
    [
        ((0.3, 0.68), (0.0, 1.0), 0.28 - 0.3),
        ((-0.78, 0.1), (-1.0, 0.0), 0.28 - 0.3),
        ((0.5 + 0.15, 0.4 + 0.2), (0.6, 0.8), 0.25 - 0.3),
        ((0.45, 0.0), (1.0, 0.0), -0.05 - 0.3),
        ((0.0, -0.3), (0.0, -1.0), -0.1 - 0.3),
    ],
    ids=["above", "left", "corner", "inside near a side", "inside near the bottom"],
)
def test_disc_against_box_from_outside_corner_and_inside(touch, build, order, place, outward, gap):
    angle = 0.35
    disc = Body(Disc(0.3), 1.0, 0.1, (*turned(angle, *place), 0.0))
    box = build.box(0.0, 0.0, half=(0.5, 0.4), angle=angle)
    found = touch(box, disc) if order else touch(disc, box)
    sign = 1.0 if order else -1.0  # from A to B
    assert found.gap == pytest.approx([gap], abs=1e-15)
    assert found.normal[0] == pytest.approx(sign * turned(angle, *outward), abs=1e-14)
    middle = turned(angle, *place) - turned(angle, *outward) * (0.3 + 0.5 * gap)
    assert found.point[0] == pytest.approx(middle, abs=1e-14)


@pytest.mark.parametrize("angle", [0.0, 0.5, -2.0])
@pytest.mark.parametrize("side", [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)])
def test_contacts_of_faces_over_their_common_width(touch, build, angle, side):
    """Unit boxes side by side, shifted by 0.3 along the face: two points 0.7 apart."""
    shift = np.array([side[1], side[0]]) * 0.3
    offset = turned(angle, *(np.array(side) * (1.0 - 1e-3) + shift))
    found = touch(build.box(0.0, 0.0, angle=angle), build.box(*offset, angle=angle))
    assert found.gap == pytest.approx([-1e-3, -1e-3], abs=1e-14)
    assert found.normal == pytest.approx(np.tile(turned(angle, *side), (2, 1)), abs=1e-14)
    assert np.hypot(*(found.point[1] - found.point[0])) == pytest.approx(0.7, abs=1e-14)
    assert found.point.mean(axis=0) == pytest.approx(0.5 * offset, abs=1e-14)


@pytest.mark.parametrize("angle", [0.1, 0.7, math.pi / 4.0, 1.4])
def test_contact_of_a_turned_box_s_corner(touch, build, angle):
    corner = min((turned(angle, x, y) for x in (-0.5, 0.5) for y in (-0.5, 0.5)), key=lambda point: point[1])
    top = build.box(0.2 - corner[0], 0.5 - corner[1] - 1e-3, angle=angle)
    found = touch(build.box(0.0, 0.0, motion="fixed"), top)
    assert found.gap == pytest.approx([-1e-3], abs=1e-14)
    assert found.normal[0] == pytest.approx([0.0, 1.0], abs=1e-15)
    # The fixed box is the reference: the point is the free box's own corner.
    assert found.point[0] == pytest.approx([0.2, 0.499], abs=1e-14)


def test_boxes_that_miss_each_other_diagonally(touch, build):
    """Bounding boxes overlap, bodies do not."""
    found = touch(build.box(0.0, 0.0, angle=math.pi / 4.0), build.box(1.1, 1.1, angle=math.pi / 4.0))
    assert len(found) == 0


def test_contacts_about_another_origin(touch, build):
    """Shifted by powers of two no coordinate is rounded: the same bits."""
    for dx, dy in ((1024.0, -512.0), (2.0**20, 2.0**19)):
        here = touch(build.box(0.0, 0.0), build.box(0.25, 0.9375, angle=0.5))
        there = touch(build.box(dx, dy), build.box(0.25 + dx, 0.9375 + dy, angle=0.5))
        assert len(here) > 0
        assert (here.gap == there.gap).all()
        assert (here.normal == there.normal).all()


def test_contacts_between_fixed_bodies(touch, build):
    found = touch(build.floor(), build.box(0.0, 0.4, motion="fixed"), build.disc(0.0, 1.4))
    assert (found.body_b == 2).all()
