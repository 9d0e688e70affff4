"""MuJoCo's contact law for one box on a level face, in 2-D: the motion of a box on an incline, step by step.

      z ^   +-------+         state  x, z, theta (counter-clockwise), vx, vz, omega
        |   |   o   |         per unit of mass, inertia i = I/m
        |   +-------+ each lower corner of the figure is two of the box
        +--------------> x

One step minimises over accelerations a

    1/2 (a - a0)' M (a - a0) + sum over contacts s(J a - aref)

with s(jar) = 1/2 D jar^2 over the rows that push. Four edges ``n +- mu t``, ``n +- mu s`` make a pyramid; an elliptic
contact has a normal and a friction row and, outside its cone, acts along the cone's edge only. The minimum is found by
Newton's method on three unknowns: the cost is convex and made of quadratic pieces.

Longer than other laws: it explains 70 rows of the standard suite, of creep, hops and stops in incline, pressed_box,
tilt_table, slide, far_origin and conveyor, at any step. [MuJoCo documentation, "Computation: constraint model",
friction cones and primal problem]
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self

from adapters.mujoco.contact_law import ContactLaw
from adapters.mujoco.pairs import contact_law, pair_solreffriction
from adapters.scene import Box, Scene

#: A row of the cost: Jacobian (3), reference acceleration, stiffness D.
Row = tuple[tuple[float, float, float], float, float]
Triple = tuple[float, float, float]
#: Lower triangle of a symmetric 3 x 3 matrix, row by row.
Lower = tuple[float, float, float, float, float, float]
#: Newton steps and halvings of a step: three unknowns and at most sixteen rows converge in a handful.
NEWTON_STEPS, HALVINGS = 60, 40
#: A gradient this small against the forces in it is round-off.
SOLVED = 1e-13
#: A step that lowers the cost by less than this share is the last one, as the cost cannot judge it.
UNSEEN = 1e-15


@dataclass(frozen=True)
class BoxOnFace:
    """Constants of the problem.

    Parameters
    ----------
    law
        Normal law of a contact; its ``softness`` is that of the cone.
    cone
        ``pyramidal`` or ``elliptic``.
    mu, friction_damping, impratio
        Friction coefficient, damping b of friction rows [1/s], ratio of normal to friction regularisers.
    half_length, half_height, inertia
        [m], [m], [m^2] (over the mass).
    load
        Acceleration without contact, along and up [m/s^2].
    share
        Number of the engine's contacts for each contact of the figure.
    """

    law: ContactLaw
    cone: str
    mu: float
    friction_damping: float
    impratio: float
    half_length: float
    half_height: float
    inertia: float
    load: tuple[float, float]
    share: float = 2.0

    @classmethod
    def of(cls, settings: Mapping[str, Any], scene: Scene, dt: float) -> Self:
        """The problem of a scene of a level face and one upright box, under ``settings``."""
        face, body = scene.bodies
        assert isinstance(body.shape, Box)
        material = scene.material(face.name, body.name)
        law = contact_law(settings, material.restitution, material.friction, dt)
        own = pair_solreffriction(settings, dt)
        damping = ContactLaw.of(dt, own, tuple(settings["solimp"]), 1.0).damping if any(own) else law.damping
        half, moments = body.shape.half_extents, body.inertia
        return cls(
            law,
            settings["cone"],
            material.friction,
            damping,
            settings["impratio"],
            half[0],
            half[-1],
            (moments[1] if isinstance(moments, tuple) else moments) / body.mass,
            (scene.gravity[0] + body.force[0] / body.mass, scene.gravity[-1] + body.force[-1] / body.mass),
        )

    def slide(self, steps: int, velocity: float = 0.0) -> list[tuple[float, float]]:
        """Position and velocity along the face from a touching start, at samples 0 ... ``steps``."""
        return [(pose[0], twist[0]) for pose, twist in self.motion(steps, velocity)]

    def motion(self, steps: int, velocity: float = 0.0) -> list[tuple[Triple, Triple]]:
        """Poses and twists (along, up, turn) from a touching start, at samples 0 ... ``steps``."""
        return self.path(steps, (0.0, self.half_height, 0.0), (velocity, 0.0, 0.0))

    def path(self, steps: int, pose: Triple, twist: Triple) -> list[tuple[Triple, Triple]]:
        """Poses and twists (along, up, turn) from any start, at samples 0 ... ``steps``."""
        path, acceleration = [(pose, twist)], (*self.load, 0.0)
        dt = self.law.dt
        for _ in range(steps):
            acceleration = self._solve(pose, twist, acceleration)
            twist = _along(twist, acceleration, dt)
            pose = _along(pose, twist, dt)
            path.append((pose, twist))
        return path

    def _contacts(self, pose: Triple) -> list[tuple[float, float, float]]:
        """Lever arm (along, up) and overlap of corners that touch; a contact lies halfway into the overlap."""
        c, s = math.cos(pose[2]), math.sin(pose[2])
        touching = []
        for along in (-self.half_length, self.half_length):
            for up in (-self.half_height, self.half_height):
                gap = pose[1] + s * along + c * up
                if gap < self.law.margin:
                    touching.append((c * along - s * up, 0.5 * gap - pose[1], gap - self.law.margin))
        return touching

    def _solve(self, pose: Triple, twist: Triple, guess: Triple) -> Triple:
        free = (*self.load, 0.0)
        contacts = self._contacts(pose)
        if not contacts:
            return free
        parts = [self._pyramid(twist, *c) if self.cone == "pyramidal" else self._ellipse(twist, *c) for c in contacts]
        a, (cost, gradient, hessian) = guess, self._model(parts, free, guess)
        scale = sum(abs(x) for x in free)
        for _ in range(NEWTON_STEPS):
            if max(map(abs, gradient)) <= SOLVED * scale:
                break
            step = _solve3(hessian, gradient)
            if _dot(step, gradient) <= UNSEEN * cost:
                return _along(a, step, -1.0)
            for halving in range(HALVINGS):
                trial = _along(a, step, -(0.5**halving))
                new = self._model(parts, free, trial)
                if new[0] < cost:
                    break
            else:
                break  # no descent left but round-off
            a, (cost, gradient, hessian) = trial, new
        return a

    def _pyramid(self, twist: Triple, along: float, up: float, overlap: float) -> list[Row]:
        """Rows of one corner of the figure: both corners' edges along x, and their edges across."""
        d = self.law.impedance(overlap)
        stiff = d / (4.0 * self.law.softness * (1.0 - d))
        rows: list[Row] = []
        for mu, weight in ((self.mu, self.share), (-self.mu, self.share), (0.0, 2.0 * self.share)):
            j = (mu, 1.0, along - mu * up)
            rows.append((j, -self.law.damping * _dot(j, twist) - self.law.stiffness * d * overlap, weight * stiff))
        return rows

    def _ellipse(self, twist: Triple, along: float, up: float, overlap: float) -> list[Row]:
        """Normal and friction row of one corner of the figure."""
        d = self.law.impedance(overlap)
        normal, slip = (0.0, 1.0, along), (1.0, 0.0, -up)
        stiff = self.share * d / (self.law.softness * (1.0 - d))
        reference = -self.law.damping * _dot(normal, twist) - self.law.stiffness * d * overlap
        return [
            (normal, reference, stiff),
            (slip, -self.friction_damping * _dot(slip, twist), stiff * self.impratio),
        ]

    def _pushing(self, rows: list[Row], a: Triple) -> list[Row]:
        """Rows that act at acceleration ``a``."""
        if self.cone == "pyramidal":
            a0, a1, a2 = a
            return [row for row in rows if row[0][0] * a0 + row[0][1] * a1 + row[0][2] * a2 < row[1]]
        (normal, rn, dn), (slip, rt, dt) = rows
        lack, drift = rn - _dot(normal, a), _dot(slip, a) - rt  # missing lift-off, excess slip
        # Forces of both rows alone: dn lack, -dt drift; within the cone if dt |drift| <= mu dn lack.
        if dt * abs(drift) <= self.mu * dn * lack:
            return rows
        if lack <= -self.mu * abs(drift):
            return []
        # On the edge the force is f (1, -mu sign(drift)) with f D = lack + mu |drift|, D = 1/dn + mu^2/dt.
        edge = math.copysign(self.mu, drift)
        j = (normal[0] - edge * slip[0], normal[1] - edge * slip[1], normal[2] - edge * slip[2])
        return [(j, rn - edge * rt, 1.0 / (1.0 / dn + self.mu**2 / dt))]

    def _model(self, parts: list[list[Row]], free: Triple, a: Triple) -> tuple[float, Triple, Lower]:
        """Cost, gradient and Hessian at ``a``.

        Written out, as a run takes half a million of these, and loops over three unknowns take twice the time.
        """
        a0, a1, a2 = a
        o0, o1, o2 = a0 - free[0], a1 - free[1], a2 - free[2]
        g0, g1, g2 = o0, o1, self.inertia * o2
        cost = 0.5 * (o0**2 + o1**2 + self.inertia * o2**2)
        h00, h10, h11, h20, h21, h22 = 1.0, 0.0, 1.0, 0.0, 0.0, self.inertia
        for rows in parts:
            for (j0, j1, j2), reference, stiff in self._pushing(rows, a):
                jar = j0 * a0 + j1 * a1 + j2 * a2 - reference
                cost += 0.5 * stiff * jar * jar
                push = stiff * jar
                g0 += push * j0
                g1 += push * j1
                g2 += push * j2
                s1, s2 = stiff * j1, stiff * j2
                h00 += stiff * j0 * j0
                h10 += s1 * j0
                h11 += s1 * j1
                h20 += s2 * j0
                h21 += s2 * j1
                h22 += s2 * j2
        return cost, (g0, g1, g2), (h00, h10, h11, h20, h21, h22)


def _dot(a: Triple, b: Triple) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _along(a: Triple, b: Triple, h: float) -> Triple:
    return (a[0] + h * b[0], a[1] + h * b[1], a[2] + h * b[2])


def _solve3(m: Lower, b: Triple) -> Triple:
    """Solution of a symmetric positive definite 3 x 3 system, given by its lower triangle, by Cholesky."""
    h00, h10, h11, h20, h21, h22 = m
    l00 = math.sqrt(h00)
    l10, l20 = h10 / l00, h20 / l00
    l11 = math.sqrt(h11 - l10 * l10)
    l21 = (h21 - l20 * l10) / l11
    l22 = math.sqrt(h22 - l20 * l20 - l21 * l21)
    y0 = b[0] / l00
    y1 = (b[1] - l10 * y0) / l11
    y2 = (b[2] - l20 * y0 - l21 * y1) / l22
    x2 = y2 / l22
    x1 = (y1 - l21 * x2) / l11
    return (y0 - l10 * x1 - l20 * x2) / l00, x1, x2
