"""Capsules, polygons, cylinders and hulls: refusals, exact sizes, and closed forms on the engines that claim them."""

import itertools
import math

import numpy as np
import pytest

from adapters.engine import EngineError
from adapters.needs import needs
from adapters.registry import load
from adapters.scene import (
    Body,
    Box,
    Capsule,
    Cylinder,
    Disc,
    HalfSpace,
    Hull,
    Pair,
    Polygon,
    Scene,
    SceneError,
    Sphere,
    scene_from_dict,
)
from adapters.scene.lift import lift, lowered
from adapters.scene.shapes import area_and_centroid, reach
from adapters.stepping import posed_for, run
from adapters.trajectory import Sampling

G, DT = 9.81, 1.0 / 240.0
HALF = (0.5, 0.25)
RECTANGLE = Polygon(((0.5, 0.25), (-0.5, 0.25), (-0.5, -0.25), (0.5, -0.25)))
BRICK = Hull(tuple(itertools.product((-0.5, 0.5), (-0.4, 0.4), (-0.3, 0.3))))
BRICK_MOMENTS = (0.25 / 3.0, 0.34 / 3.0, 0.41 / 3.0)
TRIANGLE = Polygon(((-0.5, -math.sqrt(3) / 6), (0.5, -math.sqrt(3) / 6), (0.0, math.sqrt(3) / 3)))
PLANAR = [("chipmunk", "tuned"), ("mujoco", "tuned"), ("reference", "classical")]


def planar(shape, inertia, height, twist=(0.0, 0.0, 0.0), mu=0.3, e=0.0, duration=0.5, gravity=G, turn=0.0):
    bodies = (
        Body("floor", HalfSpace((0.0, 1.0)), motion="fixed"),
        Body("body", shape, 1.0, inertia, (0.0, height, turn), twist),
    )
    return Scene("shape", 1, 2, bodies, (Pair(friction=mu, restitution=e),), (0.0, -gravity), duration)


def spatial(shape, moments, height, attitude=(1.0, 0.0, 0.0, 0.0), twist=(0.0,) * 6, mu=0.3, e=0.0, gravity=G, t=0.5):
    bodies = (
        Body("floor", HalfSpace((0.0, 0.0, 1.0)), motion="fixed"),
        Body("body", shape, 1.0, moments, (0.0, 0.0, height, *attitude), twist),
    )
    return Scene("shape", 1, 3, bodies, (Pair(friction=mu, restitution=e),), (0.0, 0.0, -gravity), t)


def made(engine, profile, asked, **switched):
    pytest.importorskip({"chipmunk": "pymunk", "bullet": "pybullet"}.get(engine, "numpy"))
    found = load(engine)
    settings = {setting.name: setting.value for setting in found.settings(profile, needs(asked), DT)}
    return run(found, asked, DT, settings | switched, Sampling(1, None))


@pytest.mark.parametrize(("engine", "profile"), PLANAR)
def test_slide_of_a_rectangle_as_a_polygon(engine, profile):
    box, polygon = (
        made(engine, profile, planar(shape, 1.25 / 12.0, 0.25, (1.0, 0.0, 0.0))) for shape in (Box(HALF), RECTANGLE)
    )
    # MuJoCo keeps corners in single precision, and takes its own mean size for a hull's.
    bound = 1e-5 if engine == "mujoco" else 1e-9
    assert polygon.pose[-1, 1] == pytest.approx(box.pose[-1, 1], abs=bound)
    assert box.pose[-1, 1, 0] == pytest.approx(0.5 / (0.3 * G), abs=DT)


@pytest.mark.parametrize(("engine", "profile"), PLANAR)
def test_rebound_and_slide_of_a_triangle(engine, profile):
    height = math.sqrt(3.0) / 6.0
    flat = planar(TRIANGLE, 1.0 / 12.0, height + 0.05, (0.0, -1.0, 0.0), mu=0.0, e=0.5, duration=0.2, gravity=0.0)
    found = made(engine, profile, flat)
    assert found.twist[-1, 1] == pytest.approx([0.0, 0.5, 0.0], abs=2e-3)
    slid = made(engine, profile, planar(TRIANGLE, 1.0 / 12.0, height, (1.0, 0.0, 0.0)))
    assert slid.pose[-1, 1, 0] == pytest.approx(0.5 / (0.3 * G), abs=DT)


@pytest.mark.parametrize(("engine", "profile"), PLANAR)
@pytest.mark.parametrize("turn", [0.0, 1.2])
def test_roll_and_landing_of_a_capsule(engine, profile, turn):
    """No friction, no gravity: the lowest point of a capsule is h |sin a| + r under its centre; flat it keeps e."""
    low = 0.4 * abs(math.sin(turn)) + 0.2
    asked = planar(Capsule(0.4, 0.2), 0.1, low + 0.05, (0.0, -1.0, 0.0), 0.0, 0.5, 0.2, 0.0, turn)
    found = made(engine, profile, asked)
    arm = 0.4 * math.cos(turn) if turn else 0.0
    impulse = 1.5 / (1.0 + arm * arm / 0.1)
    # Met at its lower end, at -h along its axis for a positive turn: the push turns it by -arm J / I.
    assert found.twist[-1, 1] == pytest.approx([0.0, impulse - 1.0, -arm * impulse / 0.1], abs=5e-3)


@pytest.mark.parametrize("shape", [Cylinder(0.5, 0.3), Capsule(0.5, 0.3)])
def test_rolling_to_two_thirds_of_its_speed_on_mujoco(shape):
    across = 0.25 * 0.09 + 0.25 / 3.0
    asked = spatial(shape, (0.045, across, across), 0.3, twist=(0.0, 1.0, 0.0, 0.0, 0.0, 0.0), t=1.0)
    found = made("mujoco", "tuned", asked)
    assert found.twist[-1, 1, :3] == pytest.approx([0.0, 2.0 / 3.0, 0.0], abs=1e-3)
    assert found.twist[-1, 1, 3] == pytest.approx(-2.0 / 0.9, abs=2e-3)
    slid = 1.0 / (3.0 * 0.3 * G)  # t = v k / ((1 + k) mu g), k = 1/2
    path = slid - 0.5 * 0.3 * G * slid**2 + 2.0 / 3.0 * (1.0 - slid)
    assert found.pose[-1, 1, 1] == pytest.approx(path, abs=DT)


@pytest.mark.parametrize("engine", ["mujoco", "bullet"])
@pytest.mark.parametrize("kind", ["hull", "cylinder", "capsule"])
def test_shapes_standing_and_landing_in_space(engine, kind):
    """At rest for half a second, and Newton's e flat on the floor; Bullet's margin is 1 mm, and its ends turn.

    Its tuned slop of 1e-5 m takes off a rebound, over dt, what an impact is found less deep than that: none here.
    """
    upright = (math.sqrt(0.5), 0.0, -math.sqrt(0.5), 0.0)
    shape, height, attitude = {
        "hull": (BRICK, 0.3, (1.0, 0.0, 0.0, 0.0)),
        "cylinder": (Cylinder(0.5, 0.3), 0.5, upright),
        "capsule": (Capsule(0.5, 0.3), 0.8, upright),
    }[kind]
    if kind != "capsule":  # on its end it is a needle
        rests = made(engine, "tuned", spatial(shape, BRICK_MOMENTS, height, attitude))
        assert rests.pose[-1, 1, :3] == pytest.approx([0.0, 0.0, height], abs=1.1e-3 if engine == "bullet" else 1e-4)
    down = (0.0, 0.0, -1.0, 0.0, 0.0, 0.0)
    falling = spatial(shape, BRICK_MOMENTS, height + 0.1, attitude, down, 0.0, 0.5, 0.0, 0.2)
    lands = made(engine, "tuned", falling, **({"contactSlop": 0.0} if engine == "bullet" else {}))
    assert lands.twist[-1, 1, 2] == pytest.approx(0.5, abs=0.03 if (engine, kind) == ("bullet", "cylinder") else 2e-4)


def test_a_tetrahedron_rests_on_its_face():
    corners = 0.5 * np.array([(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)])
    axis = np.cross(-corners[0], (0.0, 0.0, -1.0))
    angle = math.acos(1.0 / math.sqrt(3.0))
    turn = (math.cos(0.5 * angle), *(math.sin(0.5 * angle) * axis / np.linalg.norm(axis)))
    shape = Hull(tuple(map(tuple, corners.tolist())))
    found = made("mujoco", "tuned", spatial(shape, (0.1, 0.1, 0.1), math.sqrt(0.75) / 3.0, turn))
    assert np.abs(found.pose[-1, 1] - found.pose[0, 1]).max() < 1e-5


@pytest.mark.parametrize(
    ("shape", "said"),
    [
        (Polygon(((0.0, 0.0), (1.0, 0.0))), "3 to 64 points"),
        (Polygon(((-1.0, -1.0), (0.0, 2.0), (1.0, -1.0))), "not convex and counter-clockwise"),
        (Polygon(((-0.5, -0.5), (0.5, -0.5), (0.0, 0.0), (0.5, 0.5))), "not convex"),
        (Polygon(((0.0, 0.0), (1.0, 0.0), (0.0, 1.0))), "centroid"),
        (Polygon(((0.5, math.nan), (-0.5, 0.25), (-0.5, -0.25))), "not a finite number"),
        (Polygon(((0.5, 0.2, 0.1), (-0.5, 0.25), (-0.5, -0.25))), "components"),
        (Capsule(0.0, 1.0), "half_length"),
        (Capsule(1.0, math.inf), "radius"),
        (Cylinder(1.0, 1.0), "cannot be used in 2-D"),
        (BRICK, "cannot be used in 2-D"),
    ],
)
def test_invalid_shape_refused_by_its_field(shape, said):
    with pytest.raises(SceneError, match=said) as refusal:
        planar(shape, 1.0, 1.0)
    assert str(refusal.value).startswith("body.shape")


@pytest.mark.parametrize(
    ("shape", "said"),
    [
        (Hull(((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (1.0, 1.0, 0.0))), "in one plane"),
        (Hull(BRICK.vertices + BRICK.vertices[:1]), "is given twice"),
        (Hull(BRICK.vertices[:3]), "4 to 64"),
        (Cylinder(-1.0, 1.0), "half_length"),
        (RECTANGLE, "cannot be used in 3-D"),
        (Disc(1.0), "cannot be used in 3-D"),
    ],
)
def test_invalid_spatial_shape_refused_by_its_field(shape, said):
    with pytest.raises(SceneError, match=said):
        spatial(shape, (1.0, 1.0, 1.0), 1.0)


def test_shapes_from_plain_data():
    for asked in (
        planar(RECTANGLE, 1.0, 1.0),
        spatial(BRICK, (1.0,) * 3, 1.0),
        spatial(Cylinder(0.5, 0.3), (1.0,) * 3, 1.0),
    ):
        again = scene_from_dict(asked.as_dict())
        assert again == asked and again.hash() == asked.hash()


def test_sizes_of_shapes():
    assert reach(Capsule(0.5, 0.3)) == 0.8 and Capsule(0.5, 0.3).smallest_size == 0.6
    assert reach(Cylinder(0.4, 0.3)) == 0.5 and Cylinder(0.4, 0.3).smallest_size == 0.6
    assert reach(RECTANGLE) == math.hypot(*HALF) and RECTANGLE.smallest_size == 0.5
    assert reach(BRICK) == pytest.approx(math.sqrt(0.5)) and BRICK.smallest_size == pytest.approx(0.6)
    area, centre, second = area_and_centroid(tuple((x + 3.0, y - 2.0) for x, y in RECTANGLE.vertices))
    assert (area, *centre) == pytest.approx((0.5, 3.0, -2.0)) and second == pytest.approx(0.5 * 1.25 / 12.0)


def test_lift_makes_a_prism_and_keeps_a_capsule():
    raised = lift(planar(TRIANGLE, 1.0, 1.0))
    corners = np.array(raised.bodies[1].shape.vertices)
    assert len(corners) == 6 and {abs(y) for y in corners[:, 1]} == {TRIANGLE.reach}
    assert lowered(raised) is None
    capsule = lift(planar(Capsule(0.4, 0.2), 0.1, 1.0))
    assert lowered(capsule).bodies[1].shape == Capsule(0.4, 0.2)


def test_unsupported_shapes_refused_by_engines():
    with pytest.raises(EngineError, match=r"body\.shape: the adapter of reference has no hull"):
        posed_for(load("reference"), spatial(BRICK, (1.0,) * 3, 1.0))
    assert posed_for(load("reference"), planar(RECTANGLE, 1.0, 1.0)).dimension == 2


def test_polygons_double_winding_star_and_64_corners():
    """Every corner of a pentagram turns left by less than half a turn: only the sum tells."""
    five = [2.0 * math.pi * k / 5 for k in range(5)]
    corners = [(math.cos(a), math.sin(a)) for a in five]
    Polygon(tuple(corners)).validate("b")
    with pytest.raises(SceneError, match=r"^b.shape.vertices: go round the centre more than once$"):
        Polygon(tuple(corners[2 * k % 5] for k in range(5))).validate("b")
    many = tuple((math.cos(2.0 * math.pi * k / 64), math.sin(2.0 * math.pi * k / 64)) for k in range(64))
    Polygon(many).validate("b")
    Polygon(tuple((1e3 * x, 1e3 * y) for x, y in corners)).validate("b")  # what is round-off grows with the size


@pytest.mark.parametrize(
    ("shape", "said"),
    [
        (Sphere(-1.0), "b.shape.radius: "),
        (Cylinder(0.5, -1.0), "b.shape.radius: "),
        (HalfSpace((0.0, math.nan)), "b.shape.normal: "),
        (Hull(((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0))), "b.shape.vertices"),
        (Polygon(((1.0, 0.0), (0.0, 1.0), "c")), "b.shape.vertices.2: 'c' is not a point"),
    ],
    ids=str,
)
def test_refusal_of_a_shape_by_field(shape, said):
    with pytest.raises(SceneError) as refusal:
        shape.validate("b")
    assert str(refusal.value).startswith(said)


def test_how_far_a_shape_reaches():
    for shape, far in ((Disc(0.4), 0.4), (Sphere(0.3), 0.3), (Box((0.3, 0.4)), 0.5), (HalfSpace((0.0, 1.0)), 0.0)):
        assert reach(shape) == pytest.approx(far)


def test_polygon_without_collinear_or_reversed_corners():
    middle = ((1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (0.0, -1.0), (1.0, -1.0))
    with pytest.raises(SceneError, match=r"counter-clockwise at number 3, \(0\.0, -1\.0\)"):
        Polygon(middle).validate("b")
    with pytest.raises(SceneError, match=r"counter-clockwise at number 0, \(-1\.0, 0\.0\)"):
        Polygon(((-1.0, 0.0), (1.0, 0.0), (0.0, 0.0))).validate("b")
    with pytest.raises(SceneError, match="enclose an area"):
        area_and_centroid(((0.0, 0.0), (1.0, 0.0), (2.0, 0.0)))


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e3])
def test_degenerate_and_off_centre_shapes_at_any_size(size):
    """A part in a million of the size beside the centre is no round-off; so little thickness is nearly none."""

    def plate(thickness):
        corners = ((1.0, 0.0), (-0.5, 0.75), (-0.5, -0.75))
        return Hull(tuple((size * x, size * y, size * z) for x, y in corners for z in (-thickness, thickness)))

    plate(1e-5).validate("b")
    with pytest.raises(SceneError, match="in one plane"):
        plate(1e-7).validate("b")
    square = ((0.5, 0.5), (-0.5, 0.5), (-0.5, -0.5), (0.5, -0.5))
    Polygon(tuple((size * x, size * y) for x, y in square)).validate("b")
    with pytest.raises(SceneError, match="centroid"):
        Polygon(tuple((size * (x + 1e-6), size * y) for x, y in square)).validate("b")
