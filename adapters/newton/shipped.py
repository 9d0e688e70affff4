"""Defaults of Newton: of shapes, and of the XPBD solver."""

from __future__ import annotations

#: Iterations over positions, and over restitution. [`SolverXPBD`, iterations, rigid_contact_restitution_iterations]
ITERATIONS, REBOUND_ITERATIONS = 2, 2
#: Inner iterations over the contacts of one pair in each iteration over restitution.
#: [_restitution_manifold_inner_iterations]
INNER = 8
#: Share of an overlap corrected in an iteration. [`SolverXPBD`, rigid_contact_relaxation]
RELAXATION = 0.8
#: Friction about the normal and against rolling [m]. [`ModelBuilder.ShapeConfig`, mu_torsional, mu_rolling]
TORSIONAL, ROLLING = 0.005, 0.0001
#: Contact distance of each of two shapes [m]. [`ModelBuilder.rigid_gap`]
GAP = 0.1
#: Speed [m/s] and spin [rad/s] below which an iteration stops a body. [xpbd/kernels.py, `apply_body_deltas`]
STOPPED = 1e-4
#: Threshold speed of restitution, in units of g dt. [xpbd/restitution_kernels.py, impact_threshold]
LEAST_APPROACH = 2.0
#: Stiffness [N/m] and damping [N s/m] of a contact where it is a spring. [`ModelBuilder.ShapeConfig`, ke, kd]
STIFFNESS, DAMPING = 2500.0, 100.0
