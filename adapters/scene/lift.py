"""Embedding of planar scenes in 3-D engines, and back.

    planar  (x, y, theta)   ->   spatial (x, 0, z = y), turned by theta about -Y

        y |  / theta             z |  / theta
          | /                      | /        Y points into the page: a turn from x to z
          +------ x                +------ x  is a right-handed turn about -Y.

Inertia is stated, not derived from the 3-D shape: a disc becomes a sphere that keeps the disc's own moment. The
distance from the plane is measured (`Trajectory.out_of_plane`) and judged: the embedded scene is symmetric about the
plane, so no contact law moves a body out of it.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from adapters.engine import Array, Contacts
from adapters.scene import Body, Box, Capsule, Cylinder, Disc, HalfSpace, Hull, Polygon, Scene, Shape, Sphere
from adapters.scene.shapes import reach


def lift(scene: Scene) -> Scene:
    """Spatial counterpart of a planar scene."""
    return replace(
        scene,
        dimension=3,
        bodies=tuple(_lift_body(body) for body in scene.bodies),
        gravity=_lift_vector(scene.gravity),
    )


def _lift_vector(v: tuple[float, ...]) -> tuple[float, float, float]:
    return (v[0], 0.0, v[1])


def _lift_shape(shape: Shape) -> Shape:
    if isinstance(shape, Disc):
        return Sphere(shape.radius)
    if isinstance(shape, Box):
        hx, hy = shape.half_extents
        return Box((hx, max(hx, hy), hy))  # as deep as it is wide or tall, so that it cannot fall sideways
    if isinstance(shape, Capsule):
        return shape
    if isinstance(shape, Polygon):  # a prism, as deep as it is wide
        deep = shape.reach
        return Hull(tuple((x, y, z) for x, z in shape.vertices for y in (-deep, deep)))
    assert isinstance(shape, HalfSpace)
    return HalfSpace(_lift_vector(shape.normal), shape.offset)


def _lift_body(body: Body) -> Body:
    x, y, theta = body.pose
    vx, vy, omega = body.twist
    moment = body.inertia if isinstance(body.inertia, float | int) else body.inertia[0]
    half = 0.5 * theta
    return replace(
        body,
        shape=_lift_shape(body.shape),
        # Only the moment about Y acts in the plane; the other two are set equal, so that a body that
        # leaves the plane by round-off meets no gyroscopic coupling.
        inertia=(moment, moment, moment),
        pose=(x, 0.0, y, float(np.cos(half)), 0.0, float(-np.sin(half)), 0.0),
        twist=(vx, 0.0, vy, 0.0, -omega, 0.0),
        force=_lift_vector(body.force),
        torque=(0.0, -body.torque[0], 0.0),
        surface_velocity=_lift_vector(body.surface_velocity),
        course=body.course and replace(body.course, amplitude=_lift_vector(body.course.amplitude)),
    )


def lowered(scene: Scene) -> Scene | None:
    """The planar scene equal to a spatial one whose bodies, motions and loads lie in the plane y = 0.

    None for other scenes: a body beside the plane or tilted out of it, or with a motion or load out of it.
    """
    bodies = [_lowered_body(body) for body in scene.bodies]
    if scene.gravity[1] != 0.0 or None in bodies:
        return None
    gravity = (scene.gravity[0], scene.gravity[2])
    return replace(scene, dimension=2, bodies=tuple(body for body in bodies if body is not None), gravity=gravity)


def _lowered_body(body: Body) -> Body | None:
    x, y, z, w, qx, qy, qz = body.pose
    vx, vy, vz, wx, wy, wz = body.twist
    shape = body.shape
    out = (y, qx, qz, vy, wx, wz, body.force[1], body.torque[0], body.torque[2], body.surface_velocity[1])
    if any(out) or body.course is not None or (isinstance(shape, HalfSpace) and shape.normal[1] != 0.0):
        return None
    if isinstance(shape, HalfSpace):
        flat: Shape = HalfSpace((shape.normal[0], shape.normal[2]), shape.offset)
    elif isinstance(shape, Capsule):
        flat = shape
    elif isinstance(shape, Cylinder | Hull):
        return None
    else:
        flat = Disc(shape.radius) if isinstance(shape, Sphere) else Box(_ends(shape))
    return replace(
        body,
        shape=flat,
        inertia=body.inertia[1] if isinstance(body.inertia, tuple) else body.inertia,
        pose=(x, z, float(-2.0 * np.arctan2(qy, w))),
        twist=(vx, vz, -wy),
        force=(body.force[0], body.force[2]),
        torque=(-body.torque[1],),
        surface_velocity=(body.surface_velocity[0], body.surface_velocity[2]),
    )


def _ends(shape: Shape) -> tuple[float, float]:
    """Half extents of a box within the plane [m]."""
    assert isinstance(shape, Box)
    return shape.half_extents[0], shape.half_extents[2]


def lower_pose(pose: Array) -> Array:
    """Planar poses (n, 3) of spatial ones (n, 7)."""
    w, qy = pose[:, 3], pose[:, 5]
    theta = -2.0 * np.arctan2(qy, w)
    theta = np.arctan2(np.sin(theta), np.cos(theta))
    return np.column_stack([pose[:, 0], pose[:, 2], theta])


def lower_twist(twist: Array) -> Array:
    """Planar twists (n, 3) of spatial ones (n, 6)."""
    return np.column_stack([twist[:, 0], twist[:, 2], -twist[:, 4]])


def size_across(scene: Scene) -> float:
    """Largest number whose round-off may move a planar scene across its plane: coordinates, distances of flight [m]."""
    place = max(math.hypot(*body.pose[:2]) + reach(body.shape) for body in scene.bodies)
    speed = max(math.hypot(*body.twist[:2]) + reach(body.shape) * abs(body.twist[2]) for body in scene.bodies)
    return max(place, speed * scene.duration)


def out_of_plane(pose: Array, reaches: Array) -> float:
    """Largest distance of a point of an embedded 2-D scene from its plane [m].

    A tilt by an angle a moves a point at distance r from the centre by at most the chord 2 r sin(a/2), and sin(a/2) is
    the length of the quaternion's part across the plane.

    Parameters
    ----------
    pose
        Spatial poses (samples, n, 7). Poses that are not finite are skipped, so a run that ends in NaN gives its
        distance before that.
    reaches
        Distance of each body's outermost point from its centre (n,) [m].
    """
    away = np.abs(pose[..., 1]) + 2.0 * np.hypot(pose[..., 4], pose[..., 6]) * reaches
    return float(np.fmax.reduce(away, axis=None, initial=0.0))


def lower_contacts(contacts: Contacts) -> Contacts:
    """Contacts with their y components dropped."""
    keep = [0, 2]
    return replace(
        contacts,
        point=contacts.point[:, keep],
        normal=contacts.normal[:, keep],
        impulse=contacts.impulse[:, keep],
    )
