"""Flight in closed form from the anchor of each body's last event, never from an accumulated state (O1, O2)."""

from __future__ import annotations

import numpy as np

from reference_solver.model import Array, Model
from tests.verification.event_driven.bodies import Bodies


class Flight:
    """Anchors of n bodies: what each had at its last event, and its constant acceleration since.

    Attributes
    ----------
    t0, late
        (n,) [s]: the anchor is at t0 + late, where `late` is what rounding took from the event's time. Without it
        every event would shift the phase of all that follows by half a unit in the last place of the *time*.
    x0, v0, a0
        (n, d) [m], [m/s], [m/s^2].
    turn0
        Orientation at the anchor: (n, 1) angle [rad] or (n, 4) quaternion.
    w0, b0
        (n, r) angular velocity [rad/s] and acceleration [rad/s^2], r = 1 or 3.
    """

    def __init__(self, model: Model, bodies: Bodies) -> None:
        d = model.dimension
        pose = np.array([body.pose for body in model.bodies])
        twist = np.array([body.twist for body in model.bodies], dtype=np.float64)
        self.bodies = bodies
        self.t0, self.late = np.zeros(bodies.count), np.zeros(bodies.count)
        self.x0, self.turn0 = pose[:, :d].copy(), pose[:, d:].copy()
        self.v0, self.w0 = twist[:, :d].copy(), twist[:, d:].copy()
        self.a0, self.b0 = bodies.load.copy(), bodies.turning_load.copy()

    def since(self, i: int, t: float, late: float = 0.0) -> float:
        """Time from body i's anchor to t + late [s]; 0 where t is the rounded time of the anchor."""
        return 0.0 if t == self.t0[i] else float((t - self.t0[i]) + (late - self.late[i]))

    def position(self, i: int, t: float) -> Array:
        """Return x (d,) [m] of body i (O1)."""
        return self._position(i, self.since(i, t))

    def velocity(self, i: int, t: float) -> Array:
        """Return v (d,) [m/s] of body i (O1)."""
        return self._velocity(i, self.since(i, t))

    def spin(self, i: int, t: float) -> Array:
        """Return omega (r,) [rad/s] of body i (O2)."""
        return self._spin(i, self.since(i, t))

    def orientation(self, i: int, t: float) -> Array:
        """Return angle (1,) or quaternion (4,) of body i (O2); nan where its axis of rotation turns.

        A sphere that slides across its own rolling direction turns about a moving axis, which has no closed form;
        nothing that the oracle computes depends on it.
        """
        return self._orientation(i, self.since(i, t))

    def _position(self, i: int, tau: float) -> Array:
        x: Array = self.x0[i] + tau * (self.v0[i] + 0.5 * tau * self.a0[i])
        return x

    def _velocity(self, i: int, tau: float) -> Array:
        v: Array = self.v0[i] + tau * self.a0[i]
        return v

    def _spin(self, i: int, tau: float) -> Array:
        w: Array = self.w0[i] + tau * self.b0[i]
        return w

    def _orientation(self, i: int, tau: float) -> Array:
        if tau == 0.0:
            return self.turn0[i].copy()
        turned = tau * (self.w0[i] + 0.5 * tau * self.b0[i])
        if len(turned) == 1:
            return np.asarray(self.turn0[i] + turned)
        size = np.linalg.norm(self.w0[i]) * np.linalg.norm(self.b0[i])
        if np.linalg.norm(np.cross(self.w0[i], self.b0[i])) > 1e-12 * size:
            return np.full(4, np.nan)
        return _turned(self.turn0[i], turned)

    def anchor(self, i: int, t: float, late: float = 0.0) -> None:
        """Make time t + late the anchor of body i, its accelerations unchanged."""
        if t != self.t0[i]:
            tau = self.since(i, t, late)
            state = self._position(i, tau), self._velocity(i, tau), self._orientation(i, tau), self._spin(i, tau)
            self.x0[i], self.v0[i], self.turn0[i], self.w0[i] = state
            self.t0[i], self.late[i] = t, late

    def pose(self, t: float) -> Array:
        """Return poses (n, 3 | 7) at time t."""
        rows = [np.concatenate([self.position(i, t), self.orientation(i, t)]) for i in range(self.bodies.count)]
        return np.array(rows)

    def twist(self, t: float) -> Array:
        """Return twists (n, 3 | 6) at time t."""
        rows = [np.concatenate([self.velocity(i, t), self.spin(i, t)]) for i in range(self.bodies.count)]
        return np.array(rows)

    def energy(self, t: float) -> Array:
        """Kinetic energy less the work of constant loads, per free body (n,) [J]; 0 for immovable bodies."""
        energy = np.zeros(self.bodies.count)
        for i in map(int, np.flatnonzero(self.bodies.free)):
            v, w = self.velocity(i, t), self.spin(i, t)
            linear = 0.5 * v @ v - self.bodies.load[i] @ self.position(i, t)
            energy[i] = linear / self.bodies.inverse_mass[i] + 0.5 * w @ w / self.bodies.inverse_inertia[i]
        return energy


def _turned(quaternion: Array, vector: Array) -> Array:
    """Quaternion turned by a rotation vector in world axes."""
    angle = float(np.linalg.norm(vector))
    if angle == 0.0:
        return quaternion.copy()
    s = np.sin(0.5 * angle) / angle * vector
    c, w, v = np.cos(0.5 * angle), quaternion[0], quaternion[1:]
    return np.concatenate([[c * w - s @ v], c * v + w * s + np.cross(s, v)])
