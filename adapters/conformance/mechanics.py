"""Mechanics of every engine, whatever its contact model: free fall, momentum, impulses, symmetry."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from itertools import product

import numpy as np

from adapters.conformance.finding import NotAsked
from adapters.conformance.scenes import (
    DT,
    accepted,
    driven,
    flying,
    glancing,
    in_all_dimensions,
    mirrored,
    quarter_turned,
    resting,
    rolling,
    striking,
)
from adapters.engine import Array, Contacts, Engine
from adapters.needs import needs
from adapters.scene import Scene
from adapters.scene.lift import lower_pose, lower_twist
from adapters.trajectory import Trajectory

#: Error of impulses for a momentum of order 1 [N s]: a solver that stops at a tolerance reports the forces of its last
#: iterate. The root of a tolerance of 1e-8 on its cost is 1e-4 (2e-5 in a step, measured), times ten.
BOOKKEEPING = 1e-3
#: Effect of a solver's tolerance in a rotated, mirrored or reordered scene, for metres and metres per second of order
#: 1: the same root, over some tens of steps.
SYMMETRY = 1e-4


def loss(engine: Engine, profile: str, scene: Scene) -> tuple[float, float]:
    """Largest declared loss of speed and spin within the scene."""
    declared = engine.declares(profile, needs(scene), DT)
    lost = []
    for name in ("linear_damping", "angular_damping"):
        told = declared.get(name)
        rate = -math.log1p(-min(told.value + told.band, 0.99)) if told else 0.0
        lost.append(rate * scene.duration)
    return lost[0], lost[1]


def free_fall(engine: Engine) -> str:
    """A thrown and spinning ball follows the discrete law of the declared scheme at every step."""
    scene = flying()
    for profile in engine.profiles:
        asked = accepted(engine, profile, scene)
        # A declared delay of d steps is a distance d g t dt behind the scheme, with the band of d.
        late = engine.declares(profile, needs(asked), DT).get("sampling")
        offset = engine.scheme(profile).position_offset - 2.0 * (late.value if late else 0.0)
        linear, angular = loss(engine, profile, asked)
        found, g, body = driven(engine, asked, profile), np.array(scene.gravity), scene.bodies[0]
        t = found.t[:, None]
        velocity = np.array(body.twist[:2]) + g * t
        place = np.array(body.pose[:2]) + np.array(body.twist[:2]) * t + 0.5 * g * t * (t + offset * DT)
        # Drag takes at most its share of the largest speed and of the distance at it; it may grow with the square of a
        # speed above 1 m/s.
        fastest = float(np.linalg.norm(velocity, axis=1).max())
        slack = engine.facts.round_off + linear * fastest * max(1.0, fastest)
        # Quaternions that are rotated to first order and normalised lose (w dt)^3/12 a step.
        turn = abs(body.twist[2]) * DT
        vague = (late.band if late else 0.0) * float(np.linalg.norm(g)) * scene.duration * DT
        bent = len(found.t) * turn**3 / 12.0
        for what, off, band in (
            ("velocity", np.abs(found.twist[:, 0, :2] - velocity).max(), slack),
            (
                "place",
                np.abs(found.pose[:, 0, :2] - place).max(),
                engine.facts.round_off + slack * scene.duration + vague,
            ),
            ("spin", np.abs(found.twist[:, 0, 2] - body.twist[2]).max(), engine.facts.round_off + 2.0 * angular),
            (
                "angle",
                np.abs(found.pose[:, 0, 2] - body.pose[2] - body.twist[2] * found.t).max(),
                engine.facts.round_off + bent + 2.0 * angular,
            ),
        ):
            if not off <= band:
                return f"{profile}: {what} differs from free fall by {off:.2g}, {band:.2g} is allowed"
    return ""


def momentum(engine: Engine) -> str:
    """A collision of two bodies in free space conserves momentum."""
    return _conserved(engine, "momentum", _linear)


def spin(engine: Engine) -> str:
    """An off-centre collision of two bodies with friction conserves angular momentum."""
    return _conserved(engine, "angular momentum", _angular)


def _conserved(engine: Engine, what: str, measure: Callable[[Scene, Trajectory], tuple[Array, float]]) -> str:
    for profile, order in product(engine.profiles, (1, -1)):
        scene = accepted(engine, profile, glancing(), glancing(0.0))
        scene = scene if order == 1 else _swapped(scene)
        for given in in_all_dimensions(engine, scene):
            found = driven(engine, given, profile)
            planar = found if found.dimension == 2 else _lowered(found)
            if np.abs(planar.twist[-1] - planar.twist[0]).max() < 0.01:
                return f"{profile}: the balls passed through each other"
            total, slack = measure(scene, planar)
            lost = max(loss(engine, profile, scene))
            band = engine.facts.round_off + slack + lost
            off = float(np.abs(total - total[0]).max())
            if not off <= band:
                return f"{profile}: {given.dimension}-D: {what} changes by {off:.2g}, {band:.2g} is allowed"
    return ""


def _linear(scene: Scene, found: Trajectory) -> tuple[Array, float]:
    """Momentum (samples, 2); only round-off may change it: impulses on both bodies are the same numbers."""
    mass = np.array([body.mass for body in scene.bodies])
    return np.asarray((mass[:, None] * found.twist[:, :, :2]).sum(axis=1)), 0.0


def _angular(scene: Scene, found: Trajectory) -> tuple[Array, float]:
    """Angular momentum about the origin (samples,), and its allowed change.

    An impulse acts on both bodies at one point, or at the nearest point of each. In the second case, with an overlap or
    gap of up to a step of their approach before and one after, friction acts with that gap as a lever arm.
    """
    total = np.zeros(len(found.t))
    for i, body in enumerate(scene.bodies):
        x, v = found.pose[:, i], found.twist[:, i]
        assert isinstance(body.inertia, float | int)
        total += body.mass * (x[:, 0] * v[:, 1] - x[:, 1] * v[:, 0]) + body.inertia * v[:, 2]
    blow = scene.bodies[0].mass * float(np.linalg.norm(found.twist[-1, 0, :2] - found.twist[0, 0, :2]))
    approach = float(np.linalg.norm(found.twist[0, 0, :2] - found.twist[0, 1, :2]))
    return total, 2.0 * approach * DT * blow


def _swapped(scene: Scene) -> Scene:
    return replace(scene, bodies=scene.bodies[::-1])


def _lowered(found: Trajectory) -> Trajectory:
    pose = np.array([lower_pose(each) for each in found.pose])
    return replace(found, pose=pose, twist=np.array([lower_twist(each) for each in found.twist]))


# ---- contacts ------------------------------------------------------------------------------------------------------


def contacts(engine: Engine) -> str:
    """Contacts have the right bodies, places, and unit normals from the lower to the higher index."""
    for profile, order in product(engine.profiles, (1, -1)):
        scene = accepted(engine, profile, resting(order), resting(order, box=False))
        for given in in_all_dimensions(engine, scene):
            trajectory = driven(engine, given, profile, contacts=True)
            if trajectory.contacts is None or not len(trajectory.contacts.rows.a):
                return f"{profile}: a body resting on a floor has no contact"
            wrong = _wrong_contact(given, trajectory.contacts.rows, engine.facts.round_off)
            if wrong:
                return f"{profile}: {wrong}"
    return ""


def _wrong_contact(scene: Scene, rows: Contacts, round_off: float) -> str:
    floor, up = scene.index("floor"), scene.dimension - 1
    if not (rows.a < rows.b).all():
        return "the bodies of a contact are not in the scene's order"
    if not ((rows.a == floor) | (rows.b == floor)).all():
        return "bodies far apart are in contact"
    upwards = np.where(rows.a == floor, rows.normal[:, up], -rows.normal[:, up])
    # Written so that NaN is an error too, except for impulses and gaps, which are optional.
    if not np.abs(np.linalg.norm(rows.normal, axis=1) - 1.0).max() <= round_off:
        return "a normal is not of length 1"
    if not upwards.min() >= 1.0 - round_off:
        return "a normal does not point from the first to the second body"
    # 0.05 m: bodies sink by centimetres at most, and every other point of a body is farther from the floor.
    if not np.abs(rows.point[:, up]).max() <= 0.05 or (np.abs(rows.gap) > 0.05).any():
        return "a contact point or a gap does not fit the surfaces"
    pushes = (rows.impulse * rows.normal).sum(axis=1)
    if (pushes < -round_off).any():
        return "an impulse pulls: it must act on the second body, along the normal"
    return ""


def impulse(engine: Engine) -> str:
    """Impulses equal the momentum change of their body: sum J = m dv on b, and -J on a."""
    silent = ""
    for profile, order in product(engine.profiles, (1, -1)):
        for scene in in_all_dimensions(engine, accepted(engine, profile, striking(order), striking(order, 0.0))):
            total, gained = _exchanged(engine, scene, profile)
            if total is None:
                silent = f"{profile}: contact impulses are not reported"
                continue
            if np.abs(gained[1][-1]).max() < 0.1:
                return f"{profile}: the balls passed through each other"
            # Drag changes the momentum without contact: 0.2 s at 2 m/s and 8 %/s is 0.03.
            slack = BOOKKEEPING + 0.05 * float("linear_damping" in engine.declares(profile, needs(scene), DT))
            told = np.nansum(total, axis=0)
            for name, gain, sign in (("b", gained[1][-1], 1.0), ("a", gained[0][-1], -1.0)):
                if np.abs(gain - sign * told).max() > slack:
                    return f"{profile}: body {name} gained {gain} N s, its contacts report {sign * told} N s"
    if silent:
        raise NotAsked(silent)
    return ""


def sampling(engine: Engine) -> str:
    """State and contacts of a sample belong to the same step."""
    silent = ""
    for profile in engine.profiles:
        for scene in in_all_dimensions(engine, accepted(engine, profile, striking(), striking(restitution=0.0))):
            total, gained = _exchanged(engine, scene, profile)
            if total is None:
                silent = f"{profile}: contact impulses are not reported"
                continue
            late = np.abs(np.diff(gained[1], axis=0) - np.nan_to_num(total)).max(axis=1)
            slack = BOOKKEEPING + 0.05 * float("linear_damping" in engine.declares(profile, needs(scene), DT))
            if late.max() > slack:
                step = int(late.argmax()) + 1
                return f"{profile}: step {step} changed the momentum by {late.max():.2g} N s more than it reports"
    if silent:
        raise NotAsked(silent)
    return ""


def _exchanged(engine: Engine, scene: Scene, profile: str) -> tuple[Array | None, list[Array]]:
    """Reported impulse on the second body in each step, and the momentum gained by each body at each sample.

    The impulses are None where contacts are reported without impulses; no contact is an impulse of 0.
    """
    found = driven(engine, scene, profile, contacts=True)
    assert found.contacts is not None
    gained = [
        body.mass * (found.twist[:, i] - found.twist[0, i])[:, : scene.dimension] for i, body in enumerate(scene.bodies)
    ]
    silent = len(found.contacts.rows.a) > 0 and bool(np.isnan(found.contacts.rows.impulse).all())
    return None if silent else found.contacts.impulse_between(0, 1), gained


# ---- symmetry ------------------------------------------------------------------------------------------------------


def order(engine: Engine) -> str:
    """The order of the bodies in the scene does not change the motion."""
    for profile in engine.profiles:
        scene = accepted(engine, profile, rolling())
        one, other = driven(engine, scene, profile), driven(engine, _swapped(scene), profile)
        wrong = _differing(one.pose, other.pose[:, ::-1], one.twist, other.twist[:, ::-1])
        if wrong:
            return f"{profile}: {wrong} when the order of the bodies is reversed"
    return ""


def mirror(engine: Engine) -> str:
    """A mirrored scene has the mirrored motion."""
    for profile in engine.profiles:
        scene = accepted(engine, profile, rolling())
        one = driven(engine, scene, profile)
        other = driven(engine, accepted(engine, profile, mirrored(scene)), profile)
        flip = np.array([-1.0, 1.0, -1.0])
        wrong = _differing(one.pose, flip * other.pose, one.twist, flip * other.twist)
        if wrong:
            return f"{profile}: {wrong} when the scene is mirrored"
    return ""


def quarter_turn(engine: Engine) -> str:
    """A scene rotated by 90 degrees, with its gravity, has the rotated motion."""
    for profile in engine.profiles:
        scene = accepted(engine, profile, rolling())
        one = driven(engine, scene, profile)
        other = driven(engine, accepted(engine, profile, quarter_turned(scene)), profile)
        back = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
        pose = other.pose @ back.T
        pose[:, 1:, 2] -= 0.5 * math.pi  # the floor, the first body, is not rotated but gets another normal
        wrong = _differing(one.pose, pose, one.twist, other.twist @ back.T)
        if wrong:
            return f"{profile}: {wrong} when the scene is turned by 90 degrees"
    return ""


def _differing(pose: Array, other_pose: Array, twist: Array, other_twist: Array) -> str:
    """A difference of two motions above `SYMMETRY`, or nothing; angles are compared as rotations."""
    off = pose - other_pose
    off[..., 2] = np.arctan2(np.sin(off[..., 2]), np.cos(off[..., 2]))
    for what, difference in (("poses", off), ("twists", twist - other_twist)):
        # The largest numbers of the scene are of order 10: radians a second, and metres.
        if not np.abs(difference).max() <= 10.0 * SYMMETRY:
            return f"{what} differ by {np.abs(difference).max():.2g}"
    return ""
