"""VBD without any settings, as documented; see `adapters.unset`."""

from __future__ import annotations

from adapters.newton.shipped import DAMPING, GAP, STIFFNESS
from adapters.newton.vbd.profiles import ITERATIONS
from adapters.unset import Unset

_SHAPE, _PAIR = "ModelBuilder.ShapeConfig", "vbd/rigid_vbd_kernels.py, _average_contact_material"
UNSET = (
    Unset("friction of a pair", "1: mu", _SHAPE, 1.0),
    Unset(
        "friction of 0.2 and 0.9",
        "0.424, the root of the product",
        "vbd/rigid_vbd_kernels.py, _average_contact_material",
        0.4243,
    ),
    Unset("restitution of a pair", "none: contacts are springs with dampers", _SHAPE),
    Unset("stiffness of a contact [N/m]", f"{STIFFNESS:g}: ke", _SHAPE, STIFFNESS),
    Unset("damping of a contact [N s/m]", f"{DAMPING:g}: kd", _SHAPE, DAMPING),
    Unset("iterations", f"{ITERATIONS}", "SolverVBD, iterations", ITERATIONS),
    Unset("contacts sought within [m]", f"{GAP:g} of each shape", "ModelBuilder.rigid_gap"),
)
