"""The one planar box: gaps of its corners to planes, of its outline to discs, and when they close (O6)."""

from __future__ import annotations

import math

import numpy as np

from reference_solver.model import Array
from tests.verification.event_driven.bodies import BALL, PLANE, Bodies
from tests.verification.event_driven.flight import Flight
from tests.verification.event_driven.prediction import GRAZE, TOUCH, first_fall, first_touch

CORNERS = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])


class BoxGaps:
    """Distances of the box from the other bodies along its flight."""

    def __init__(self, bodies: Bodies, flight: Flight) -> None:
        self.bodies, self.flight, self.box = bodies, flight, bodies.box
        self.corners = CORNERS * bodies.half_extents[bodies.box]

    def partners(self) -> list[int]:
        """Bodies that the box can meet."""
        return [j for j in range(self.bodies.count) if j != self.box]

    def levers(self, t: float) -> Array:
        """Corners relative to the centre of mass (4, 2) [m], world axes."""
        angle = float(self.flight.orientation(self.box, t)[0])
        if angle == 0.0:
            return self.corners.copy()
        c, s = math.cos(angle), math.sin(angle)
        return self.corners @ np.array([[c, s], [-s, c]])

    def corner_gaps(self, plane: int, t: float) -> Array:
        """Gaps of the four corners to a plane (4,) [m]."""
        n = self.bodies.normal[plane]
        away = n @ (self.flight.position(self.box, t) - self.flight.position(plane, t)) - self.bodies.offset[plane]
        gaps: Array = away + self.levers(t) @ n
        return gaps

    def nearest(self, disc: int, t: float) -> tuple[float, Array, Array]:
        """Return gap to a disc [m], lever (2,) of the box's nearest point, direction (2,) from there to the disc."""
        angle = float(self.flight.orientation(self.box, t)[0])
        c, s = math.cos(angle), math.sin(angle)
        turn = np.array([[c, -s], [s, c]])
        centre = turn.T @ (self.flight.position(disc, t) - self.flight.position(self.box, t))
        half = self.bodies.half_extents[self.box]
        inside = np.clip(centre, -half, half)
        outward = centre - inside
        distance = float(np.hypot(*outward))
        if distance == 0.0:
            return -float(self.bodies.radius[disc]), turn @ inside, np.zeros(2)
        return distance - float(self.bodies.radius[disc]), turn @ inside, turn @ (outward / distance)

    def touch(self, partner: int, t: float) -> float:
        """Gap that is round-off [m]."""
        x, y = self.flight.position(self.box, t), self.flight.position(partner, t)
        size = np.abs(x).sum() + np.abs(y).sum() + self.bodies.reach[[self.box, partner]].sum()
        speed = np.abs(self.flight.v0[[self.box, partner]]).sum()
        return float(TOUCH * (size + abs(self.bodies.offset[partner]) + t * speed))

    def next_meeting(self, resting: set[int]) -> tuple[float, int]:
        """Time and partner of the next contact, ``resting`` partners aside; (inf, -1) if there is none."""
        best = (math.inf, -1)
        for j in self.partners():
            if j in resting:
                continue
            if self.bodies.kind[j] == PLANE:
                t = min(self._meet_corner(j, corner) for corner in range(4))
            elif self.bodies.kind[j] == BALL:
                t = self._meet_disc(j)
            best = min(best, (t, j))
        return best

    def _meet_corner(self, plane: int, corner: int) -> float:
        """Time at which one corner meets a plane: a quadratic, plus a sine where the box turns."""
        f, i, n = self.flight, self.box, self.bodies.normal[plane]
        base = max(f.t0[i], f.t0[plane])
        spin, a = float(f.w0[i, 0]), float(n @ f.a0[i])
        lever = float(np.hypot(*self.corners[corner]))

        def gap(tau: float) -> float:
            return float(self.corner_gaps(plane, base + tau)[corner])

        def rate(tau: float) -> float:
            r = self.levers(base + tau)[corner]
            v = f.velocity(i, base + tau) - f.v0[plane]
            return float(n @ v + spin * (n[1] * r[0] - n[0] * r[1]))

        touch = self.touch(plane, base)
        start = max(gap(0.0), 0.0)
        start = start if start > touch else 0.0
        speed = np.abs(f.v0[i]).sum() + np.abs(f.v0[plane]).sum() + abs(spin) * lever
        first_rate = rate(0.0)
        if start == 0.0 and abs(first_rate) <= GRAZE * speed:
            first_rate = 0.0
        if spin == 0.0:
            return base + first_fall(start, first_rate, a)
        if start == 0.0 and first_rate < 0.0:
            return base
        # |second derivative| <= |n.a| + omega^2 |r|: the gap stays above the parabola of that curvature
        curvature = abs(a) + spin * spin * lever

        def step(tau: float) -> float:
            return first_fall(max(gap(tau), 0.0), rate(tau), -curvature)

        begin = 0.0
        if start == 0.0:
            # it leaves with this acceleration, which changes by at most omega^3 |r|: the gap is open until then
            lift = a - spin * spin * float(n @ self.levers(base)[corner])
            begin = max(first_fall(0.0, first_rate, -curvature), 1.5 * lift / (abs(spin) ** 3 * lever))
        return base + first_touch(gap, step, touch, begin, self._clear_time(plane, base, a, lever, spin))

    def _clear_time(self, plane: int, base: float, a: float, lever: float, spin: float) -> float:
        """Time after which no corner can reach a plane, however the box turns; inf where it must come back [s]."""
        f, n = self.flight, self.bodies.normal[plane]
        height = float(n @ (f.position(self.box, base) - f.position(plane, base)) - self.bodies.offset[plane])
        rise = float(n @ (f.velocity(self.box, base) - f.v0[plane]))
        if a < 0.0 or (a == 0.0 and rise < 0.0):
            return math.inf
        if a == 0.0 and rise == 0.0:
            return 2.0 * math.pi / abs(spin)
        lacking = max(lever - height, 0.0)  # rise t + a t^2 / 2 = lacking, the later root
        root = math.sqrt(rise * rise + 2.0 * a * lacking)
        return 2.0 * lacking / (rise + root) if rise > 0.0 else (root - rise) / a

    def _meet_disc(self, disc: int) -> float:
        """Time at which the outline meets a disc, by steps that the fastest possible closing cannot outrun."""
        f, i = self.flight, self.box
        base = max(f.t0[i], f.t0[disc])
        touch = self.touch(disc, base)
        turning = abs(float(f.w0[i, 0])) * float(self.bodies.reach[i])
        a = float(np.hypot(*(f.a0[disc] - f.a0[i])))
        v = f.velocity(disc, base) - f.velocity(i, base)

        def gap(tau: float) -> float:
            return self.nearest(disc, base + tau)[0]

        def step(tau: float) -> float:
            now = f.velocity(disc, base + tau) - f.velocity(i, base + tau)
            closing = float(np.hypot(*now)) + turning
            return first_fall(gap(tau), -closing, -a) if closing > 0.0 or a > 0.0 else math.inf

        begin = 0.0
        if gap(0.0) <= touch:
            if self._closing(disc, base):
                return base
            # leave the touching range: one step of the contact's own size at the fastest rate
            begin = 1e-9 * float(self.bodies.reach[disc]) / max(float(np.hypot(*v)) + turning, 1e-300)
        return base + first_touch(gap, step, touch, begin, self._passing_time(disc, base, v, a))

    def _passing_time(self, disc: int, base: float, v: Array, a: float) -> float:
        """Time after which a disc is out of the box's reach for good, or has seen a whole turn of it [s]."""
        speed, spin = float(np.hypot(*v)), abs(float(self.flight.w0[self.box, 0]))
        away = np.hypot(*(self.flight.position(disc, base) - self.flight.position(self.box, base)))
        way = float(away + self.bodies.reach[[disc, self.box]].sum())
        if a > 0.0:
            return first_fall(way, speed, -a)  # a t^2 / 2 - speed t beats the distance and both reaches
        if speed > 0.0:
            return way / speed
        return 2.0 * math.pi / spin if spin > 0.0 else 0.0

    def _closing(self, disc: int, t: float) -> bool:
        f, i = self.flight, self.box
        _gap, r, n = self.nearest(disc, t)
        spin = float(f.w0[i, 0])
        v = f.velocity(disc, t) - f.velocity(i, t) - spin * np.array([-r[1], r[0]])
        speed = np.abs(f.v0[i]).sum() + np.abs(f.v0[disc]).sum() + abs(spin) * self.bodies.reach[i]
        return bool(n @ v < -GRAZE * speed)
