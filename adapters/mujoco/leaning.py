"""MuJoCo's contact law for boxes on each other, in the plane: blocks that lean, tip and slide, step by step.

      z ^     [_____]        state  x, z, theta (counter-clockwise) of each box, and their rates
        |   [_____]          a contact of the figure stands for two of the boxes, one in front, one behind
        | [_____]
        +=========---> x     box 1 stands on a level face, box k + 1 on box k

One step minimises over the accelerations a of all boxes

    1/2 (a - a0)' M (a - a0) + sum over contacts s(J a - aref)

as in `box_on_face`, whose one box this is with others on it. Two boxes meet along the axis that separates them most,
one of the normals of either; the face of the other box is clipped to the face that has it, and each end of what is left
that is nearer than the margin is a contact, half-way between the faces.
[MuJoCo documentation, "Computation: constraint model"; google-deepmind/mujoco, src/engine/engine_collision_box.c]
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from adapters.law import Law, Measure, Prediction
from adapters.mujoco.contact_law import ContactLaw
from adapters.mujoco.motions import as_trajectory
from adapters.mujoco.predictions import EITHER, EPS, PERTURBATIONS, SPREAD_FACTOR, SUM_ROUND_OFF, law_of, settings_of
from adapters.scene import Box, HalfSpace, Scene
from adapters.stepping import step_count
from adapters.trajectory import Trajectory

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Path = tuple[Array, Array, Array]
#: Contacts of the engine that each contact of the figure stands for.
SHARE = 2.0
#: Newton steps, and halvings of a step.
NEWTON_STEPS, HALVINGS = 60, 40
#: A gradient this small against the loads in it is round-off.
SOLVED = 1e-13
#: A step that lowers the cost by less than this share cannot be judged by the cost: it is the last one.
UNSEEN = 1e-15


@dataclass(frozen=True)
class Touch:
    """One contact: bodies (-1: the face below), its place [m], normal from the first to the second, distance [m]."""

    below: int
    above: int
    place: tuple[float, float]
    normal: tuple[float, float]
    distance: float


@dataclass(frozen=True)
class LeaningBoxes:
    """Constants of the problem.

    Parameters
    ----------
    law
        Normal law of a contact with an elliptic cone; friction rows are damped alike.
    mu, impratio
        Friction coefficient, ratio of normal to friction regularisers.
    sizes
        Half length and half height of each box [m], from below.
    masses, inertias
        [kg], [kg m^2].
    gravity
        Acceleration upwards [m/s^2].
    """

    law: ContactLaw
    mu: float
    impratio: float
    sizes: tuple[tuple[float, float], ...]
    masses: tuple[float, ...]
    inertias: tuple[float, ...]
    gravity: float

    def path(self, start: tuple[tuple[float, ...], ...], steps: int, off: float = 0.0) -> Path:
        """Poses and twists (steps + 1, n, 3), impulses (steps + 1, n) upwards on each box from below.

        Boxes start with the poses ``start``, at rest but for a turn with the energy of a speed ``off`` [m/s].
        """
        n = len(self.sizes)
        pose, twist = np.array(start, dtype=float), np.zeros((n, 3))
        twist[:, 2] = off * np.sqrt(np.array(self.masses) / np.array(self.inertias))
        states = np.zeros((steps + 1, 2, n, 3))
        lifted = np.zeros((steps + 1, n))
        states[0] = pose, twist
        acceleration = np.tile((0.0, self.gravity, 0.0), n)
        for k in range(1, steps + 1):
            touches = self.touches(pose)
            acceleration, forces = self._solve(touches, pose, twist, acceleration)
            twist = twist + self.law.dt * acceleration.reshape(n, 3)
            pose = pose + self.law.dt * twist
            states[k] = pose, twist
            for touch, (push, rub) in zip(touches, forces, strict=True):
                lifted[k, touch.above] += self.law.dt * (touch.normal[1] * push - touch.normal[0] * rub)
        return states[:, 0], states[:, 1], lifted

    def touches(self, pose: Array) -> list[Touch]:
        """Contacts of the lowest box with the face, and of each box with the next."""
        found = []
        (x, z, turn), (length, height) = pose[0], self.sizes[0]
        c, s = math.cos(turn), math.sin(turn)
        for along in (-length, length):
            place = (x + c * along + s * height, z + s * along - c * height)
            if place[1] < self.law.margin:
                found.append(Touch(-1, 0, (place[0], 0.5 * place[1]), (0.0, 1.0), place[1]))
        for k in range(len(pose) - 1):
            own = self._facing(pose, k)
            if own is not None:
                found += self._clipped(pose, k, own)
        return found

    def _facing(self, pose: Array, k: int) -> int | None:
        """Which of boxes k and k + 1 has the level face that separates them most; None if they are apart or side on."""
        best, facing = -math.inf, None
        for own, other in ((k, k + 1), (k + 1, k)):
            offset, (reach, depth) = _seen_from(pose[own], pose[other]), self.sizes[other]
            c, s = abs(math.cos(offset[2])), abs(math.sin(offset[2]))
            for axis, span in enumerate((c * reach + s * depth, s * reach + c * depth)):
                apart = abs(offset[axis]) - self.sizes[own][axis] - span
                if apart > self.law.margin:
                    return None
                if apart > best:
                    best, facing = apart, own if axis == 1 else None
        return facing

    def _clipped(self, pose: Array, k: int, own: int) -> list[Touch]:
        """Ends of the other box's face, clipped to the level face of box ``own``, of boxes k and k + 1."""
        other = 2 * k + 1 - own
        x, z, phi = _seen_from(pose[own], pose[other])
        side = math.copysign(1.0, z)
        (length, height), (reach, depth) = self.sizes[own], self.sizes[other]
        c, s = math.cos(phi), math.sin(phi)
        x, z = x + side * s * depth, z - side * c * depth  # the middle of the face that looks back
        co, so = math.cos(pose[own, 2]), math.sin(pose[own, 2])
        found = []
        for along in (-reach, reach):
            end = x + c * along
            if abs(end) > length:
                along = (math.copysign(length, end) - x) / c
            distance = side * (z + s * along) - height
            if abs(along) <= reach and distance <= self.law.margin:
                u, w = x + c * along, side * (height + 0.5 * distance)
                place = (pose[own, 0] + co * u - so * w, pose[own, 1] + so * u + co * w)
                found.append(Touch(k, k + 1, place, (-so, co), distance))
        return found

    def _rows(self, touches: list[Touch], pose: Array, twist: Array) -> tuple[Array, Array, Array]:
        """Jacobians (c, 2, 3 n) of normal and friction rows, what they ask for, and their stiffnesses (c, 2)."""
        jacobian = np.zeros((len(touches), 2, len(pose), 3))
        asked, stiff = np.empty((len(touches), 2)), np.empty((len(touches), 2))
        for row, touch in enumerate(touches):
            (nx, nz), inverse = touch.normal, 0.0
            for body, sign in ((touch.above, 1.0), (touch.below, -1.0)):
                if body < 0:
                    continue
                along, up = touch.place[0] - pose[body, 0], touch.place[1] - pose[body, 1]
                for which, (x, z) in enumerate(((nx, nz), (nz, -nx))):
                    jacobian[row, which, body] = sign * x, sign * z, sign * (along * z - up * x)
                inverse += 1.0 / self.masses[body]
            gap = touch.distance - self.law.margin
            d = self.law.impedance(gap)
            asked[row] = -self.law.damping * np.einsum("knj,nj->k", jacobian[row], twist)
            asked[row, 0] -= self.law.stiffness * d * gap
            stiff[row] = SHARE * d / (self.law.softness * (1.0 - d) * inverse) * np.array((1.0, self.impratio))
        return jacobian.reshape(len(touches), 2, -1), asked, stiff

    def _solve(
        self, touches: list[Touch], pose: Array, twist: Array, guess: Array
    ) -> tuple[Array, list[tuple[float, float]]]:
        """Accelerations (3 n,), and normal and friction force of each contact [N]."""
        mass = np.array([[m, m, i] for m, i in zip(self.masses, self.inertias, strict=True)]).ravel()
        free = np.tile((0.0, self.gravity, 0.0), len(pose))
        if not touches:
            return free, []
        rows = self._rows(touches, pose, twist)
        scale = float(np.abs(mass * free).max())
        a = guess
        cost, gradient, hessian = self._model(rows, mass, free, a)
        for _ in range(NEWTON_STEPS):
            if float(np.abs(gradient).max()) <= SOLVED * scale:
                break
            step = np.linalg.solve(hessian, gradient)
            if float(step @ gradient) <= UNSEEN * cost:
                a = a - step
                break
            for halving in range(HALVINGS):
                trial = a - 0.5**halving * step
                new = self._model(rows, mass, free, trial)
                if new[0] < cost:
                    break
            else:
                break  # no descent left but round-off
            a, (cost, gradient, hessian) = trial, new
        return a, [(push, rub) for push, rub in zip(*self._forces(rows, a), strict=True)]

    def _zones(self, rows: tuple[Array, Array, Array], a: Array) -> tuple[Array, Array, Mask, Mask]:
        """What each contact lacks of its lift-off and slips too much (c,), and whether it sticks or slips."""
        jacobian, asked, stiff = rows
        off = jacobian @ a - asked
        lack, drift = -off[:, 0], off[:, 1]
        sticks = stiff[:, 1] * np.abs(drift) <= self.mu * stiff[:, 0] * lack
        slips = ~sticks & (lack > -self.mu * np.abs(drift))
        return lack, drift, sticks, slips

    def _edge(self, stiff: Array, lack: Array, drift: Array) -> tuple[Array, Array]:
        """On the edge of its cone a contact acts along it: stiffness there, and what is lacking along it (c,)."""
        return 1.0 / (1.0 / stiff[:, 0] + self.mu**2 / stiff[:, 1]), lack + self.mu * np.abs(drift)

    def _forces(self, rows: tuple[Array, Array, Array], a: Array) -> tuple[list[float], list[float]]:
        """Normal and friction force of each contact [N]."""
        lack, drift, sticks, slips = self._zones(rows, a)
        stiff, missing = self._edge(rows[2], lack, drift)
        slipping = np.where(slips, stiff * missing, 0.0)
        push = np.where(sticks, rows[2][:, 0] * lack, slipping)
        rub = np.where(sticks, -rows[2][:, 1] * drift, -self.mu * np.sign(drift) * slipping)
        return push.tolist(), rub.tolist()

    def _model(
        self, rows: tuple[Array, Array, Array], mass: Array, free: Array, a: Array
    ) -> tuple[float, Array, Array]:
        """Cost, gradient and Hessian at ``a``."""
        jacobian, _, stiff = rows
        lack, drift, sticks, slips = self._zones(rows, a)
        edge, missing = self._edge(stiff, lack, drift)
        along = jacobian[slips, 0] - (self.mu * np.sign(drift[slips]))[:, None] * jacobian[slips, 1]
        j = np.vstack((jacobian[sticks, 0], jacobian[sticks, 1], along))
        d = np.concatenate((stiff[sticks, 0], stiff[sticks, 1], edge[slips]))
        jar = np.concatenate((-lack[sticks], drift[sticks], -missing[slips]))
        off = a - free
        cost = 0.5 * float(mass @ off**2) + 0.5 * float(d @ jar**2)
        return cost, mass * off + j.T @ (d * jar), np.diag(mass) + j.T @ (d[:, None] * j)


def _seen_from(own: Array, other: Array) -> tuple[float, float, float]:
    """Pose of another box as box ``own`` sees it."""
    c, s = math.cos(own[2]), math.sin(own[2])
    x, z = other[0] - own[0], other[1] - own[1]
    return float(c * x + s * z), float(c * z - s * x), float(other[2] - own[2])


# ---- the law -----------------------------------------------------------------------------------------------------


@lru_cache(maxsize=32)  # a megabyte each at most
def _path(boxes: LeaningBoxes, start: tuple[tuple[float, ...], ...], steps: int, off: float) -> Path:
    return boxes.path(start, steps, off)


def leaning_boxes(profile: str, scene: Scene, dt: float) -> LeaningBoxes | None:
    """The problem of a planar scene of boxes at rest, each on the one before; None if the scene is not that."""
    settings, (face, *boxes) = settings_of(profile, scene, dt), scene.bodies
    shapes = [body.shape for body in boxes if isinstance(body.shape, Box)]
    floor = face.shape
    if scene.dimension != 2 or settings["cone"] != "elliptic" or settings["solreffriction"] is not None:
        return None
    level = isinstance(floor, HalfSpace) and floor.normal == (0.0, 1.0) and floor.offset == 0.0
    if not level or scene.gravity[0] != 0.0:
        return None
    if len(shapes) != len(boxes) or any(b.motion != "free" or any((*b.twist, *b.force, *b.torque)) for b in boxes):
        return None
    return LeaningBoxes(
        law_of(profile, scene, dt),
        scene.material(face.name, boxes[0].name).friction,
        settings["impratio"],
        tuple((shape.half_extents[0], shape.half_extents[1]) for shape in shapes),
        tuple(body.mass for body in boxes),
        tuple(float(np.max(body.inertia)) for body in boxes),
        scene.gravity[1],
    )


def _told(scene: Scene, dt: float, path: Path) -> Trajectory:
    """What the step loop would have recorded."""
    poses, twists, lifted = path
    told = as_trajectory(scene, dt, np.stack((poses[:, :, 1], twists[:, :, 1], lifted), axis=1))
    told.pose[:, 1:], told.twist[:, 1:] = poses, twists
    return told


def leaning_law(profile: str, metric: str) -> Law:
    """Boxes that stand on each other's edges: what gives by a hair may tip them, at the rate of rigid bodies.

    Newton's method goes on until a step gains nothing that can be seen in the cost, which is the loads' work
    ``sum m g^2/2``: a box of mass m is then off by ``sqrt(2 eps cost/m)`` at most, or turns with that energy. What tips
    grows, so that this matters at the start: starts that turn so, either way, say how much. The law is silent once a
    box has turned so far that it meets others than its neighbours. It does not know what round-off makes of faces that
    touch to 1e-15 m: there the engine may keep one of two contacts, which throws the block out of its plane (seen with
    four blocks at 1/960 s).
    """

    def law(scene: Scene, dt: float, measure: Measure) -> Prediction | None:
        boxes = leaning_boxes(profile, scene, dt)
        if boxes is None:
            return None
        start, steps = tuple(body.pose for body in scene.bodies[1:]), step_count(scene.duration, dt)
        off = math.sqrt(EPS * sum(boxes.masses) / min(boxes.masses)) * abs(boxes.gravity) * dt
        paths = [_path(boxes, start, steps, k * off) for k in (0.0, *PERTURBATIONS)]
        if np.abs(paths[0][0][:, :, 2]).max() >= min(2.0 * up / (2.0 * out) for out, up in boxes.sizes):
            return None
        value, *others = (measure(scene, _told(scene, dt, path))[metric][0] for path in paths)
        if value is None or None in others:
            return None
        spread = max(abs(other - value) for other in others if other is not None)
        # Forces are differences over R, (1 - d)/d of an inertia.
        floor = (SUM_ROUND_OFF + EPS / (1.0 - boxes.law.impedance.deep)) * max(abs(value), 1.0)
        return (value, SPREAD_FACTOR * spread + floor) if spread <= EITHER * max(abs(value), floor) else None

    return law
