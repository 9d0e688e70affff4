"""Motion of balls and boxes whose contacts are springs with dampers, in explicit steps and in single precision.

    push    -(k d + c min(vn, 0))       while d < 0, along the normal, at each point; four points of a box on a plane
    across  s |slip|, at most mu push   against the slip

[semi_implicit/kernels_contact.py, _eval_body_contact; solver.py, integrate_rigid_body; collision_primitive.py]
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from adapters.law.single_precision import ROUNDINGS, UNIT
from adapters.scene import Box, HalfSpace, Scene, Sphere
from adapters.scene.drives import place_after, velocity_over
from adapters.scene.lift import lift, lower_pose, lower_twist
from adapters.stepping import step_count
from adapters.trajectory import Trajectory

#: Starts that differ by round-off, and by how many units at most: of the roundings of a blow, in places and velocities.
STARTS, MOST = 9, 3
#: Kinds of shapes that meet, in the order in which they are taken.
KINDS = {(HalfSpace, Sphere), (HalfSpace, Box), (Box, Sphere), (Sphere, Sphere)}
#: Slip that counts as none [m/s]: what divides by it is 0.
NONE = 1e-30

Singles = NDArray[np.float32]
CORNERS: Singles = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], np.float32)
BACK: Singles = np.array((1, -1, -1, -1), np.float32)


def motions(scene: Scene, dt: float, chosen: Mapping[str, Any]) -> list[Trajectory]:
    """Motions from all starts, the unmoved one first; none where shapes meet that are no balls, boxes and planes."""
    posed = scene if scene.dimension == 3 else lift(scene)
    if any(any(body.surface_velocity) for body in scene.bodies) or not all(_is_met(posed, i, j) for i, j in met(posed)):
        return []
    world, steps = Springs(posed, dt, chosen), step_count(scene.duration, dt)
    poses, twists = [world.pose()], [world.twist.copy()]
    with np.errstate(all="ignore"):
        for _ in range(steps):
            world.step()
            poses.append(world.pose())
            twists.append(world.twist.copy())
    pose, twist = np.array(poses, float), np.array(twists, float)
    if scene.dimension == 2:
        pose, twist = (
            lower(told.reshape(-1, told.shape[-1])).reshape(*told.shape[:3], 3)
            for lower, told in ((lower_pose, pose), (lower_twist, twist))
        )
    t = np.arange(steps + 1, dtype=np.float64) * dt
    return [Trajectory(t, pose[:, k], twist[:, k], None, dt, "completed") for k in range(STARTS)]


def met(scene: Scene) -> list[tuple[int, int]]:
    """Pairs of bodies that may touch, in the order of `KINDS`; other shapes are last."""
    order = [type(body.shape) for body in scene.bodies]
    return [(i, j) if (order[i], order[j]) in KINDS else (j, i) for i, j, _ in scene.contact_pairs()]


def _is_met(scene: Scene, i: int, j: int) -> bool:
    plane = scene.bodies[i]
    driven = isinstance(plane.shape, HalfSpace) and plane.motion != "fixed"
    return not driven and (type(plane.shape), type(scene.bodies[j].shape)) in KINDS


def turned(turn: Singles, arms: Singles) -> Singles:
    """Vectors turned by quaternions (w, x, y, z), with what rounding leaves of their length, as Warp does."""
    w, u = turn[..., :1], turn[..., 1:]
    along = (u * arms).sum(-1, keepdims=True)
    return np.asarray(arms * (2 * w * w - 1) + np.cross(u, arms) * w * 2 + u * along * 2)


class Springs:
    """A spatial scene from several starts at once."""

    def __init__(self, scene: Scene, dt: float, chosen: Mapping[str, Any]) -> None:
        self.scene, self.chosen, self.steps, self.seconds = scene, chosen, 0, dt
        bodies = scene.bodies
        self.free = [k for k, body in enumerate(bodies) if body.motion == "free"]
        self.driven = [k for k, body in enumerate(bodies) if body.motion == "prescribed"]
        self.pairs = [(i, j, scene.material(bodies[i].name, bodies[j].name).friction) for i, j in met(scene)]
        moves = ROUNDINGS * UNIT * np.random.default_rng(0).integers(-MOST, MOST + 1, (STARTS, len(bodies), 9))
        moves[0], moves[:, [k for k, body in enumerate(bodies) if body.motion != "free"]] = 0.0, 0.0
        pose, twist = (np.array(told) for told in ([body.pose for body in bodies], [body.twist for body in bodies]))
        self.place, self.turn = _singles(pose[:, :3] * (1.0 + moves[..., :3])), _singles([pose[:, 3:]] * STARTS)
        self.twist = _singles(twist * (1.0 + moves[..., 3:]))
        self.load = _singles([[(*body.force, *body.torque) for body in bodies]] * STARTS)
        self.mass = _singles([[bodies[k].mass] for k in self.free])
        self.inertia = _singles([np.broadcast_to(bodies[k].inertia, 3) for k in self.free])
        self.gravity, self.dt = _singles(scene.gravity), np.float32(dt)
        self.kept = np.float32(1) - np.float32(chosen["spin_damping"]) * self.dt
        #: Radius by which a ball's point is ahead of its centre: none of a fixed one, a fault of the engine.
        self.reach = [
            body.shape.radius if isinstance(body.shape, Sphere) and body.motion != "fixed" else 0.0 for body in bodies
        ]

    def pose(self) -> Singles:
        """Places and quaternions (starts, bodies, 7)."""
        return np.concatenate([self.place, self.turn], axis=-1)

    def step(self) -> None:
        """One step: contacts at its start, driven bodies where it ends."""
        self.steps += 1
        for k in self.driven:
            driven = self.scene.bodies[k]
            self.place[:, k] = place_after(driven, self.steps * self.seconds)
            self.twist[:, k, :3] = velocity_over(driven, self.seconds, self.steps - 1)
        force = self.load.copy()
        for a, b, mu in self.pairs:
            normal, arms, gap = self._touch(a, b)
            if not (gap < 0).any():
                continue
            slip = self._speed(b, arms[1]) - self._speed(a, arms[0])
            closing = (slip * normal).sum(-1, keepdims=True)
            push = -(self.chosen["stiffness"] * gap + self.chosen["damping"] * np.minimum(closing, 0)) * (gap < 0)
            slip -= closing * normal
            speed, limit, slope = np.linalg.norm(slip, axis=-1, keepdims=True), mu * push, self.chosen["slope"]
            across = np.where(slope * speed > limit, limit / np.maximum(speed, NONE), slope * (limit > 0))
            given = push * normal - across * slip
            for body, arm, sign in ((a, arms[0], -1), (b, arms[1], 1)):
                force[:, body, :3] += sign * given.sum(1)
                force[:, body, 3:] += sign * np.cross(arm, given).sum(1)
        self._move(force)

    def _move(self, force: Singles) -> None:
        twist, turn = self.twist[:, self.free], self.turn[:, self.free]
        twist[..., :3] += self.dt * (force[:, self.free, :3] / self.mass + self.gravity)
        self.place[:, self.free] += self.dt * twist[..., :3]
        spin, torque = turned(turn * BACK, twist[..., 3:]), turned(turn * BACK, force[:, self.free, 3:])
        spin = turned(turn, spin + self.dt * (torque - np.cross(spin, self.inertia * spin)) / self.inertia)
        w, u = turn[..., :1], turn[..., 1:]
        rate = np.concatenate([-(spin * u).sum(-1, keepdims=True), spin * w + np.cross(spin, u)], axis=-1)
        turn += rate * (self.dt / 2)
        twist[..., 3:] = spin * self.kept
        self.turn[:, self.free] = turn / np.linalg.norm(turn, axis=-1, keepdims=True)
        self.twist[:, self.free] = twist

    def _speed(self, body: int, arm: Singles) -> Singles:
        return np.asarray(self.twist[:, body, None, :3] + np.cross(self.twist[:, body, None, 3:], arm))

    def _touch(self, a: int, b: int) -> tuple[Singles, tuple[Singles, Singles], Singles]:
        """Normals from ``a`` to ``b``, arms of both and gaps (starts, points, 3 or 1)."""
        first, second = self.scene.bodies[a].shape, self.scene.bodies[b].shape
        between = (self.place[:, b] - self.place[:, a])[:, None]
        if isinstance(first, HalfSpace):
            normal = _singles(first.normal)
            if isinstance(second, Box):
                arm = turned(self.turn[:, b, None], CORNERS * _singles(second.half_extents))
            else:
                arm = np.broadcast_to(-normal * self.reach[b], between.shape)
            gap = _singles((self.place[:, b, None] + arm) @ normal - np.float32(first.offset))[..., None]
            deepest = np.argsort(gap, axis=1, kind="stable")[:, :4]
            arm, gap = np.take_along_axis(arm, deepest, 1), np.take_along_axis(gap, deepest, 1)
            return np.broadcast_to(normal, arm.shape), (_singles(between + arm - gap * normal), arm), gap
        if isinstance(first, Box):
            half, turn = _singles(first.half_extents), self.turn[:, a, None]
            local = turned(turn * BACK, between)
            near = np.clip(local, -half, half)
            inside = (np.abs(local) <= half).all(-1, keepdims=True)
            nearest = np.arange(3) == np.argmin(half - np.abs(local), axis=-1)[..., None]
            near = np.where(inside & nearest, np.copysign(half, local), near)
            away, sign = turned(turn, local - near), np.where(inside, -1, 1)
            start = turned(turn, near)
        else:
            away, sign, start = between, np.ones(1, np.float32), np.zeros_like(between)
        far = np.linalg.norm(away, axis=-1, keepdims=True)
        normal = sign * away / np.maximum(far, NONE)
        own, other = (shape.radius if isinstance(shape, Sphere) else 0.0 for shape in (first, second))
        return normal, (start + own * normal, -other * normal), sign * far - self.reach[a] - self.reach[b]


def _singles(told: Any) -> Singles:
    return np.array(told, np.float32)
