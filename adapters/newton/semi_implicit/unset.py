"""The semi-implicit solver without any settings, as documented; see `adapters.unset`."""

from __future__ import annotations

from adapters.newton import shapes
from adapters.newton.semi_implicit.profiles import SLOPE, SPIN_DAMPING
from adapters.unset import Unset

UNSET = (
    shapes.FRICTION_UNSET,
    Unset("friction of 0.2 and 0.9", "0.55, the mean", "semi_implicit/kernels_contact.py, _eval_body_contact", 0.55),
    *shapes.SPRINGS_UNSET,
    Unset("friction over slip [N s/m]", f"{SLOPE:g}: kf", shapes.SHAPE, SLOPE),
    Unset("angular damping [1/s]", f"{SPIN_DAMPING:g}", "SolverSemiImplicit, angular_damping", SPIN_DAMPING),
    shapes.GAP_UNSET,
)
