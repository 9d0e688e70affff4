"""The one lift: planar states survive the way to three dimensions and back, and what leaves the plane is seen."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from adapters.engine import Contacts
from adapters.scene import Body, Box, Capsule, Disc, HalfSpace, Harmonic, Hull, Pair, Polygon, Scene, Sphere
from adapters.scene.lift import lift, lower_contacts, lower_pose, lower_twist, lowered, out_of_plane


def planar_scene(pose: tuple[float, ...], twist: tuple[float, ...]) -> Scene:
    bodies = (
        Body("floor", HalfSpace((-0.6, 0.8), 0.25), motion="fixed"),
        Body("box", Box((0.5, 0.2)), 2.0, 0.3, pose, twist, force=(1.0, -2.0), torque=(0.7,)),
        Body("disc", Disc(0.4), 1.5, 0.12, (1.0, 2.0, 3.0), (4.0, 5.0, 6.0), "prescribed"),
    )
    pairs = (Pair(restitution=0.4, friction=0.3), Pair("box", "disc", 0.1, 0.2))
    return Scene("planar", 3, 2, bodies, pairs, (1.5, -9.0), 2.0, {"e": 0.4})


def turn(q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Rotate v by the quaternion q = (w, x, y, z), from the definition q v q*."""
    w, u = q[0], q[1:]
    return v + 2.0 * w * np.cross(u, v) + 2.0 * np.cross(u, np.cross(u, v))


def test_pose_and_twist_survive_the_round_trip() -> None:
    rng = np.random.default_rng(7)
    for _ in range(200):
        pose = (*rng.normal(size=2), rng.uniform(-math.pi, math.pi))
        twist = tuple(rng.normal(size=3))
        lifted = lift(planar_scene(pose, twist)).bodies[1]
        back, speed = lower_pose(np.array([lifted.pose])), lower_twist(np.array([lifted.twist]))
        # Half-angle sine and cosine and one arctangent: a few units of round-off of an angle up to pi.
        assert np.allclose(back[0], pose, rtol=0.0, atol=2e-15)
        assert tuple(speed[0]) == twist
        assert out_of_plane(np.array([[lifted.pose]]), np.array([1.0])) == 0.0


def test_a_body_point_lands_where_the_plane_says() -> None:
    theta = 0.7
    lifted = lift(planar_scene((2.0, 3.0, theta), (0.0, 0.0, 0.0))).bodies[1]
    point = np.array(lifted.pose[:3]) + turn(np.array(lifted.pose[3:]), np.array([0.5, 0.0, 0.2]))
    c, s = math.cos(theta), math.sin(theta)
    assert np.allclose(point, [2.0 + c * 0.5 - s * 0.2, 0.0, 3.0 + s * 0.5 + c * 0.2], atol=1e-15)


def test_lifted_counter_clockwise_spin() -> None:
    lifted = lift(planar_scene((0.0, 0.0, 0.0), (0.0, 0.0, 2.0))).bodies[1]
    arm = np.array([0.5, 0.0, 0.0])
    assert np.allclose(np.cross(lifted.twist[3:], arm), [0.0, 0.0, 1.0])  # a point to the right goes up


def test_axis_of_a_lifted_torque() -> None:
    body = lift(planar_scene((0.0, 0.0, 0.0), (0.0, 0.0, 2.0))).bodies[1]
    assert np.allclose(np.array(body.torque) / 0.7, np.array(body.twist[3:]) / 2.0)


def test_shapes_materials_and_loads_keep_their_meaning() -> None:
    flat = planar_scene((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    lifted = lift(flat)
    floor, box, disc = lifted.bodies
    assert floor.shape == HalfSpace((-0.6, 0.0, 0.8), 0.25)
    assert isinstance(box.shape, Box) and (box.shape.half_extents[0], box.shape.half_extents[2]) == (0.5, 0.2)
    assert disc.shape == Sphere(0.4) and disc.motion == "prescribed"
    assert box.mass == 2.0 and box.inertia == (0.3, 0.3, 0.3)
    assert box.force == (1.0, 0.0, -2.0) and lifted.gravity == (1.5, 0.0, -9.0)
    assert lifted.pairs == flat.pairs and lifted.duration == flat.duration
    assert lifted.material("disc", "box") == flat.material("disc", "box")


def test_moment_of_a_lifted_disc() -> None:
    assert lift(planar_scene((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))).bodies[2].inertia == (0.12, 0.12, 0.12)


@pytest.mark.parametrize("axis", [0, 2], ids=["about x", "about z"])
@pytest.mark.parametrize("angle", [1e-9, 0.3, 3.0])
@pytest.mark.parametrize("turned", [0.0, 0.7])
def test_outermost_point_of_a_tilted_body_off_the_plane(axis: int, angle: float, turned: float) -> None:
    """Whatever the body's own turn in the plane: the axis that stood across the plane is tilted by the angle."""
    half = np.zeros(3)
    half[axis] = math.sin(0.5 * angle)
    w, c, s = math.cos(0.5 * angle), math.cos(0.5 * turned), -math.sin(0.5 * turned)
    own = np.array([0.0, s, 0.0])
    q = np.array([w * c - half @ own, *(w * own + c * half + np.cross(half, own))])  # tilted after it was turned
    across = turn(q, np.array([0.0, 1.0, 0.0]))
    pose = np.array([[[5.0, 0.0, 5.0, *q]]])
    assert np.linalg.norm(across - [0.0, 1.0, 0.0]) == pytest.approx(2.0 * math.sin(0.5 * angle), rel=1e-6)
    assert out_of_plane(pose, np.array([0.5])) == pytest.approx(math.sin(0.5 * angle), rel=1e-12)


def test_largest_distance_from_the_plane() -> None:
    pose = np.zeros((3, 2, 7))
    pose[..., 3] = 1.0
    reach = np.array([1.0, 0.25])
    assert out_of_plane(pose, reach) == 0.0
    pose[1, 1, 1], pose[2, 0, 1] = -0.5, 0.375
    assert out_of_plane(pose, reach) == 0.5
    pose[1, 1, 3:] = (0.0, 1.0, 0.0, 0.0)  # head over heels beside the plane: 0.5 and a chord of twice its reach
    assert out_of_plane(pose, reach) == 1.0


def test_departure_from_the_plane_beside_a_nan() -> None:
    """A run that ends in NaN says how far it was out of the plane before; one of nothing else was never seen to be."""
    pose = np.zeros((3, 1, 7))
    pose[..., 3] = 1.0
    pose[1, 0, 1] = -0.5
    for lost in (0, 2):
        pose[lost] = math.nan
        assert out_of_plane(pose, np.array([1.0])) == 0.5
    nothing = np.full((2, 1, 7), math.nan)
    assert out_of_plane(nothing, np.array([1.0])) == out_of_plane(nothing[:0], np.array([1.0])) == 0.0


def test_angle_by_either_sign_of_the_quaternion() -> None:
    q = np.array([math.cos(1.2), 0.0, -math.sin(1.2), 0.0])
    pose = np.array([[0.0, 0.0, 0.0, *q], [0.0, 0.0, 0.0, *-q]])
    assert np.allclose(lower_pose(pose)[:, 2], 2.4, atol=1e-15)


def test_contacts_lowered_without_their_out_of_plane_part() -> None:
    row = (0, 1, (1.0, 2.0, 3.0), (0.6, 0.0, 0.8), (4.0, 5.0, 6.0), -0.1)
    flat = lower_contacts(Contacts.from_rows([row], 3))
    assert flat.point.tolist() == [[1.0, 3.0]]
    assert flat.normal.tolist() == [[0.6, 0.8]]
    assert flat.impulse.tolist() == [[4.0, 6.0]]
    assert (flat.a[0], flat.b[0], flat.gap[0]) == (0, 1, -0.1)


def test_a_lifted_scene_lowers_to_itself() -> None:
    rng = np.random.default_rng(3)
    for _ in range(50):
        pose = (*rng.normal(size=2), rng.uniform(-math.pi, math.pi))
        flat = planar_scene(pose, tuple(rng.normal(size=3)))
        back = lowered(lift(flat))
        assert back is not None
        # The angle goes through a half-angle's sine and cosine: a few units of round-off of pi.
        assert back.bodies[1].pose == pytest.approx(pose, rel=0.0, abs=2e-15)
        own = [replace(body, pose=body.pose[:2]) for body in flat.bodies]
        assert [replace(body, pose=body.pose[:2]) for body in back.bodies] == own
        assert replace(back, bodies=flat.bodies) == flat


def test_lift_and_return_of_belts_and_courses() -> None:
    scene = replace(planar_scene((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)), pairs=(Pair(),))
    belt = replace(scene.bodies[0], surface_velocity=(0.8, 0.6))
    shaken = replace(scene.bodies[2], course=Harmonic((0.02, 0.03), 2.0))
    lifted = lift(replace(scene, bodies=(belt, scene.bodies[1], shaken)))
    assert lifted.bodies[0].surface_velocity == (0.8, 0.0, 0.6)
    assert lifted.bodies[2].course == Harmonic((0.02, 0.0, 0.03), 2.0) and lifted.bodies[1].course is None
    assert lowered(lifted) is None  # a course has no way back
    back = lowered(lift(replace(scene, bodies=(belt, scene.bodies[1]))))
    assert back is not None and back.bodies[0].surface_velocity == (0.8, 0.6)


def test_lift_of_a_polygon_to_a_prism_and_of_a_capsule() -> None:
    scene = replace(planar_scene((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)), pairs=(Pair(),))
    corners = ((0.3, 0.4), (-0.3, 0.4), (-0.3, -0.4), (0.3, -0.4))
    odd = replace(scene.bodies[1], shape=Polygon(corners))
    round_ = replace(scene.bodies[1], name="round", shape=Capsule(0.4, 0.1))
    prism, capsule = lift(replace(scene, bodies=(odd, round_))).bodies
    assert isinstance(prism.shape, Hull)
    assert set(prism.shape.vertices) == {(x, y, z) for x, z in corners for y in (-0.5, 0.5)}
    assert capsule.shape == round_.shape
    back = lowered(lift(replace(scene, bodies=(round_,))))
    assert back is not None and back.bodies[0].shape == round_.shape
    assert lowered(lift(replace(scene, bodies=(odd,)))) is None  # nobody knows that a hull was a polygon


def spatial_scene(**changes: object) -> Scene:
    """A box in the plane whose three sides and moments all differ."""
    values = {
        "pose": (1.0, 0.0, 2.0, math.cos(0.2), 0.0, -math.sin(0.2), 0.0), "twist": (3.0, 0.0, 4.0, 0.0, 5.0, 0.0),
        "force": (6.0, 0.0, 7.0), "torque": (0.0, 8.0, 0.0),
    } | changes  # fmt: skip
    floor = Body("floor", HalfSpace((0.6, 0.0, 0.8), 0.25), motion="fixed", pose=(0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0))
    # A dictionary of fields of several types: the checker knows none of them.
    box = Body("box", Box((0.5, 0.3, 0.2)), 2.0, (0.1, 0.2, 0.3), **values)  # type: ignore[arg-type]
    return Scene("solid", 1, 3, (floor, box), (Pair(),), (1.0, 0.0, -9.0), 1.0)


def test_a_spatial_scene_in_the_plane_is_planar() -> None:
    flat = lowered(spatial_scene())
    assert flat is not None
    floor, box = flat.bodies
    assert (flat.dimension, flat.gravity) == (2, (1.0, -9.0))
    assert floor.shape == HalfSpace((0.6, 0.8), 0.25)
    assert (box.shape, box.mass, box.inertia) == (Box((0.5, 0.2)), 2.0, 0.2)
    assert box.pose == pytest.approx((1.0, 2.0, 0.4), abs=1e-15)
    assert (box.twist, box.force, box.torque) == ((3.0, 4.0, -5.0), (6.0, 7.0), (-8.0,))


def test_moment_of_a_body_that_does_not_move_freely() -> None:
    scene = spatial_scene()
    fixed = replace(scene.bodies[1], inertia=0.7, motion="fixed", twist=(0.0,) * 6)
    flat = lowered(replace(scene, bodies=(scene.bodies[0], fixed)))
    assert flat is not None and flat.bodies[1].inertia == 0.7


@pytest.mark.parametrize(
    "changes",
    [
        {"pose": (1.0, 1e-300, 2.0, 1.0, 0.0, 0.0, 0.0)},
        {"pose": (1.0, 0.0, 2.0, math.cos(0.2), math.sin(0.2), 0.0, 0.0)},
        {"pose": (1.0, 0.0, 2.0, math.cos(0.2), 0.0, 0.0, math.sin(0.2))},
        {"twist": (3.0, 1.0, 4.0, 0.0, 5.0, 0.0)},
        {"twist": (3.0, 0.0, 4.0, 1.0, 5.0, 0.0)},
        {"twist": (3.0, 0.0, 4.0, 0.0, 5.0, 1.0)},
        {"force": (6.0, 1.0, 7.0)},
        {"torque": (1.0, 8.0, 0.0)},
        {"torque": (0.0, 8.0, 1.0)},
    ],
)
def test_bodies_motions_and_loads_out_of_the_plane_not_planar(changes: dict[str, object]) -> None:
    assert lowered(spatial_scene(**changes)) is None


def test_scene_with_gravity_or_a_face_across_the_plane() -> None:
    scene = spatial_scene()
    assert lowered(replace(scene, gravity=(1.0, 0.5, -9.0))) is None
    across = replace(scene.bodies[0], shape=HalfSpace((0.0, 0.6, 0.8), 0.25))
    assert lowered(replace(scene, bodies=(across, scene.bodies[1]))) is None
    running = replace(scene.bodies[0], shape=HalfSpace((0.0, 0.0, 1.0)), surface_velocity=(0.0, 1.0, 0.0))
    assert lowered(replace(scene, bodies=(running, scene.bodies[1]))) is None
