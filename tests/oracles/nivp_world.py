"""`solve_nivp` as a program: backward Euler, its complementarity problem with Newton's impact law, without friction.

y = (q, v),   v' = v + dt f/m + M^-1 J^T p,   0 <= p  perp  v_n' + e v_n >= 0 where the gap is closed
"""

from importlib.metadata import version

import numpy as np
import solve_nivp
from worlds import World, hello, serve

TOLERANCE = {"tolerance": {"value": 1e-12, "because": "residual of the solver of a step"}}


class Nivp(World):
    def __init__(self, scene, dt, settings):
        super().__init__(scene, dt, settings)
        for i, j, _ in self.touch:
            if self.pair(i, j)[1]:
                raise ValueError("no friction")
        inertia, load = zip(*[self.mass(k) for k in self.free], strict=True)
        self.inertia, self.load = np.concatenate(inertia), np.concatenate(load)
        self.width = len(inertia[0])
        self.time = 0.0

    def step(self):
        n, posed = self.inertia.size, list(self.rows())
        normal = np.zeros((len(posed), n))
        for row, (_, _, _, jacobian) in enumerate(posed):
            for place, k in enumerate(self.free):
                if k in jacobian:
                    normal[row, place * self.width : (place + 1) * self.width] = jacobian[k][0]
        gaps, pull = np.array([gap for _, _, gap, _ in posed]), self.load / self.inertia
        pushed = normal.T / self.inertia[:, None]
        v = np.concatenate([self.twist[k] for k in self.free])
        told = np.array([self.pair(i, j)[0] for i, j, _ in self.touch])
        law = {
            "gap": lambda t, y: gaps,
            "u_map": lambda t, y: normal @ y[n:],
            "J_u": lambda t, y: np.hstack([0.0 * normal, normal]),
            "G_apply": lambda t, y, impulse: np.concatenate([np.zeros(n), pushed @ impulse]),
            "e": told if told.size > 1 else told.item(),  # numpy 2 makes no number of a row of one
            "gap_tol": 1e-12,
        }
        told = solve_nivp.solve_ivp_ns(
            lambda t, y: np.concatenate([y[n:], pull]), (0.0, self.dt), np.concatenate([np.zeros(n), v]),
            method="backward_euler", projection="unilateral", projection_opts=law, adaptive=False, h0=self.dt,
            solver_opts={"tol": self.settings["tolerance"]}, integrator_opts={"pass_prev_state": True},
        )  # fmt: skip
        moved, v = told[1][-1][:n], told[1][-1][n:]
        for place, k in enumerate(self.free):
            own = slice(place * self.width, (place + 1) * self.width)
            self.turn(k, moved[own])
            self.twist[k] = v[own]
        self.tell(posed, [None] * len(posed))


if __name__ == "__main__":
    serve(hello("solve_nivp", version("solve_nivp"), "implicit Euler, impulses of contacts", TOLERANCE), Nivp)
