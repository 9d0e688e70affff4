"""Numbers of Newton's XPBD solver as it ships them."""

from __future__ import annotations

#: Sweeps over positions, and over rebounds. [`SolverXPBD`, iterations, rigid_contact_restitution_iterations]
ITERATIONS, REBOUND_ITERATIONS = 2, 2
#: Sweeps over the contacts of one pair in each sweep over rebounds. [_restitution_manifold_inner_iterations]
INNER = 8
#: Share of an overlap that a sweep takes back. [`SolverXPBD`, rigid_contact_relaxation]
RELAXATION = 0.8
#: Friction about the normal and against rolling [m]. [`ModelBuilder.ShapeConfig`, mu_torsional, mu_rolling]
TORSIONAL, ROLLING = 0.005, 0.0001
#: Distance at which contacts are made, of each of two shapes [m]. [`ModelBuilder.rigid_gap`]
GAP = 0.1
#: Speed [m/s] and spin [rad/s] below which a sweep stops a body. [xpbd/kernels.py, `apply_body_deltas`]
STOPPED = 1e-4
#: Approach below which nothing rebounds, in units of g dt. [xpbd/restitution_kernels.py, impact_threshold]
LEAST_APPROACH = 2.0
