"""The semi-implicit solver without any settings, as documented; see `adapters.unset`."""

from __future__ import annotations

from adapters.newton.semi_implicit.profiles import SLOPE, SPIN_DAMPING
from adapters.newton.shipped import DAMPING, GAP, STIFFNESS
from adapters.unset import Unset

_SHAPE = "ModelBuilder.ShapeConfig"
UNSET = (
    Unset("friction of a pair", "1: mu", _SHAPE, 1.0),
    Unset("friction of 0.2 and 0.9", "0.55, the mean", "semi_implicit/kernels_contact.py, _eval_body_contact", 0.55),
    Unset("restitution of a pair", "none: contacts are springs with dampers", _SHAPE),
    Unset("stiffness of a contact [N/m]", f"{STIFFNESS:g}: ke", _SHAPE, STIFFNESS),
    Unset("damping of a contact [N s/m]", f"{DAMPING:g}: kd", _SHAPE, DAMPING),
    Unset("friction over slip [N s/m]", f"{SLOPE:g}: kf", _SHAPE, SLOPE),
    Unset("angular damping [1/s]", f"{SPIN_DAMPING:g}", "SolverSemiImplicit, angular_damping", SPIN_DAMPING),
    Unset("contacts sought within [m]", f"{GAP:g} of each shape", "ModelBuilder.rigid_gap"),
)
