"""A round body that slides, rolls and spins on a fixed face under the drag of Bullet's multibody path, step by step.

free velocities    u = v + (g + F/m) dt - k (1 + |v|) v dt        k: drag, of the spin as well
                   s = w - k (1 + |w|) w dt
slip               c = u - a (s x n), without its part along n    n: normal of the face, a: arm of the contact
friction           J = -c/(1/m + a^2/I), at most mu times the normal impulse of `ContactLaw.contact`
v <- u + J/m,  w <- s - a (n x J)/I
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from adapters.bullet.profiles import law_of
from adapters.engine import Array, Contacts
from adapters.law import Law, Measure, Prediction
from adapters.law.moved_starts import GAP_ROUND_OFF
from adapters.law.single_precision import Held
from adapters.needs import needs
from adapters.scene import Disc, HalfSpace, Scene, Sphere
from adapters.scene.lift import lift, lower_contacts, lower_pose, lower_twist
from adapters.stepping import step_count
from adapters.trajectory import ContactRecord, Measured, Trajectory


def rolling_law(metric: str, profile: str) -> Law:
    """``metric`` of a body that touches the face from the start.

    The band is that of the point of contact, which is somewhere within the slop, and of round-off.
    """

    def law(scene: Scene, dt: float, measure: Measure) -> Prediction | None:
        found = [each.get(metric, (None, ""))[0] for each in _measured(profile, Held(scene), dt, measure)]
        if len(found) < 2 or found[0] is None or found[1] is None:
            return None
        return found[0], abs(found[1] - found[0]) + GAP_ROUND_OFF / dt * (1.0 + abs(found[0]))

    return law


@lru_cache(maxsize=256)
def _measured(profile: str, held: Held, dt: float, measure: Measure) -> list[dict[str, Measured]]:
    """All metrics on arms to both ends of the slop; empty where the body does not touch, or something else acts."""
    scene = held.scene
    if not _is_on_a_face(scene):
        return []
    slop = law_of(profile, needs(scene), dt).slop
    return [measure(scene, _rolled(profile, scene, dt, short)) for short in (0.0, slop)]


def _is_on_a_face(scene: Scene) -> bool:
    """A fixed half-space and one free round body, which touches it and moves along it."""
    if len(scene.bodies) != 2:
        return False
    face, body = scene.bodies
    if not isinstance(face.shape, HalfSpace) or not isinstance(body.shape, Disc | Sphere):
        return False
    d, normal = scene.dimension, np.array(face.shape.normal)
    gap = normal @ body.pose[:d] - face.shape.offset - body.shape.radius
    still = face.motion == "fixed" and not any(face.surface_velocity) and not any(body.torque)
    pressed = normal @ (np.array(scene.gravity) + np.array(body.force) / body.mass) < 0.0
    return bool(still and pressed and abs(gap) <= 1e-9 * body.shape.radius and normal @ body.twist[:d] == 0.0)


def _rolled(profile: str, scene: Scene, dt: float, short: float) -> Trajectory:
    """The motion with friction on an arm shorter than the radius by ``short`` [m]; how it is turned is left out."""
    posed = scene if scene.dimension == 3 else lift(scene)
    (face, body), law = posed.bodies, law_of(profile, needs(scene), dt)
    assert isinstance(face.shape, HalfSpace) and isinstance(body.shape, Sphere) and isinstance(body.inertia, tuple)
    normal, arm = np.array(face.shape.normal), body.shape.radius - short
    pull, moment = np.array(posed.gravity) + np.array(body.force) / body.mass, body.inertia[1]
    steps, material = step_count(scene.duration, dt), posed.material(face.name, body.name)
    pose: Array = np.empty((steps + 1, 2, 7))
    twist: Array = np.zeros((steps + 1, 2, 6))
    pose[:] = [each.pose for each in posed.bodies]
    twist[0, 1] = body.twist
    pushed, gap = np.zeros((steps + 1, 3)), np.zeros(steps + 1)
    place, v, w = np.array(body.pose[:3]), np.array(body.twist[:3]), np.array(body.twist[3:])
    for k in range(1, steps + 1):
        free = v + pull * dt - law.damping * (1.0 + np.linalg.norm(v)) * v * dt
        w = w - law.damping * (1.0 + np.linalg.norm(w)) * w * dt
        after, moved = law.contact(gap[k - 1], float(normal @ v), float(normal @ free), material.restitution, dt)
        weight = body.mass * (after - float(normal @ free))
        slip = free - arm * np.cross(w, normal)
        push = -(slip - normal * (normal @ slip)) / (1.0 / body.mass + arm**2 / moment)
        size = float(np.linalg.norm(push))
        push *= min(1.0, material.friction * weight / size) if size > 0.0 else 1.0
        pushed[k] = push + weight * normal
        v = free + pushed[k] / body.mass
        w = w - arm * np.cross(normal, push) / moment
        place = place + (v + moved * normal) * dt
        gap[k] = gap[k - 1] + (after + moved) * dt
        pose[k, 1, :3], twist[k, 1] = place, (*v, *w)
    first, up = np.zeros(steps + 1, np.int64), np.ones((steps + 1, 1)) * normal
    rows = Contacts(first, first + 1, np.zeros_like(up), up, pushed, gap)
    if posed is not scene:
        rows = lower_contacts(rows)
        pose = np.array([lower_pose(each) for each in pose])
        twist = np.array([lower_twist(each) for each in twist])
    record = ContactRecord(np.arange(steps + 1), np.arange(steps + 2), rows)
    times = np.array([k * dt for k in range(steps + 1)])
    return Trajectory(times, pose, twist, record, dt, "completed")
