"""Siconos as a program: Moreau and Jean's time stepping, its impact law and its solvers of contacts with friction.

    M (v' - v) = dt f + J^T p,   0 <= p_n  perp  v_n' + e v_n >= 0,   |p_t| <= mu p_n,   q' = q + dt v'

A relation of Siconos is linear in the coordinates here, ``y = C q + b``; C and b are written before each step, and v_n
with them. With its usual theta = 1/2, q' = q + dt (v + v')/2, what swings on a contact of the step's start gains height
with each step. Only Debian's own Python can import `python3-siconos`.
"""

import numpy as np
import siconos.kernel as kernel
import siconos.numerics as numerics
from worlds import FAR, World, hello, serve

#: A gap that is closed but for its rounding [m]; what rests would fall for a step.
ROUNDING = 1e-12
TOLERANCE = {"tolerance": {"value": 1e-12, "because": "residual of the solver of contacts"}}


class Siconos(World):
    def __init__(self, scene, dt, settings):
        super().__init__(scene, dt, settings)
        self.model, self.systems = kernel.NonSmoothDynamicalSystem(0.0, 1e9), {}
        for k in self.free:
            inertia, load = self.mass(k)
            start = [*self.pose[k][: self.d], *[0.0] * (len(inertia) - self.d)]
            system = kernel.LagrangianLinearTIDS(start, self.twist[k].tolist(), np.diag(inertia).tolist())
            system.setFExtPtr(load)
            self.model.insertDynamicalSystem(system)
            self.systems[k] = system
        self.links = [self._link(i, j) for i, j, _ in self.touch]
        kind = numerics.SICONOS_FRICTION_2D_NSGS if self.d == 2 else numerics.SICONOS_FRICTION_3D_NSGS
        problem = kernel.FrictionContact(self.d, kind)
        options = problem.numericsSolverOptions()
        options.dparam[numerics.SICONOS_DPARAM_TOL] = settings["tolerance"]
        options.iparam[numerics.SICONOS_IPARAM_MAX_ITER] = 100_000
        clock = kernel.TimeDiscretisation(0.0, dt)
        self.steps = kernel.TimeStepping(self.model, clock, kernel.MoreauJeanOSI(1.0), problem)
        self._posed()
        self.steps.initialize()

    def _link(self, i, j):
        own = [k for k in (i, j) if k in self.systems]
        restitution, friction = self.pair(i, j)
        law = kernel.NewtonImpactFrictionNSL(restitution, 0.0, friction, self.d)
        columns = sum(len(self.mass(k)[0]) for k in own)
        constant = [FAR] + [0.0] * (self.d - 1)
        relation = kernel.LagrangianLinearTIR(np.zeros((self.d, columns)).tolist(), constant)
        interaction = kernel.Interaction(law, relation)
        self.model.link(interaction, *[self.systems[k] for k in own])
        return own, relation, interaction, law

    def _posed(self):
        """Write C and b of each relation; the first step needs them before Siconos starts."""
        posed = list(self.rows())
        for (_, _, gap, jacobian), (own, relation, *_) in zip(posed, self.links, strict=True):
            told, constant = relation.C(), relation.e()
            told[:] = np.hstack([jacobian[k] for k in own])
            constant[0] = gap - ROUNDING - told[0] @ np.concatenate([self.systems[k].q() for k in own])
        return posed

    def step(self):
        posed = self._posed()
        for _, _, interaction, _ in self.links:
            interaction.computeOutput(0.0, 1)
            interaction.swapInMemory()
        before = {k: np.array(system.q()) for k, system in self.systems.items()}
        self.steps.computeOneStep()
        pushed = [np.array(interaction.lambda_(1)) for _, _, interaction, _ in self.links]
        self.steps.nextStep()
        for k, system in self.systems.items():
            self.turn(k, np.array(system.q()) - before[k])
            self.twist[k] = np.array(system.velocity())
        self.tell(posed, pushed)


if __name__ == "__main__":
    order = "contacts and forces, then position"
    serve(hello("siconos", "4.4.0", order, TOLERANCE), Siconos)
