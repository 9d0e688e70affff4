"""Constants of MuJoCo: shipped values, limits, and checked releases."""

from __future__ import annotations

#: Prefixes of the releases on which laws were checked.
CHECKED_ON = ("4.0.",)
#: Releases with wrong results, and why.
KNOWN_BAD = {"4.0.0": "wrong sparse Newton factor: wrong accelerations, divergence (fixed in 4.0.1)"}

#: Source of its documented behaviour.
DOC = "MuJoCo documentation"

#: Time constant [s] and damping ratio of a contact.
SOLREF = (0.02, 1.0)
#: Impedance at the surface and deep, width [m], midpoint and power of the curve between them.
SOLIMP = (0.9, 0.95, 0.001, 0.5, 2.0)
#: Most Newton steps in a step, and the gain at which they end.
ITERATIONS, TOLERANCE = 100, 1e-8
#: The gain at which no-slip iterations end, if there are any.
NOSLIP_TOLERANCE = 1e-6

#: Impedances are clamped to this range (mjMINIMP, mjMAXIMP), friction coefficients from below (mjMINMU).
IMPEDANCE_RANGE = (0.0001, 0.9999)
SMALLEST_FRICTION = 1e-5
