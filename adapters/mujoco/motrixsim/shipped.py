"""Defaults of MotrixSim, as it reads them from a model of MJCF that states none."""

from __future__ import annotations

#: Sweeps of the solver at most, and the change below which it stops.
ITERATIONS, TOLERANCE = 100, 1e-4
#: Time constant [s] and damping ratio of a contact's spring, and its impedance.
SOLREF, SOLIMP = (0.02, 1.0), (0.9, 0.95, 0.001, 0.5, 2.0)
