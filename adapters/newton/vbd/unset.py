"""VBD without any settings, as documented; see `adapters.unset`."""

from __future__ import annotations

from adapters.newton import shapes
from adapters.newton.vbd.profiles import ITERATIONS
from adapters.unset import Unset

_PAIR = "vbd/rigid_vbd_kernels.py, _average_contact_material"
UNSET = (
    shapes.FRICTION_UNSET,
    Unset("friction of 0.2 and 0.9", "0.424, the root of the product", _PAIR, 0.4243),
    *shapes.SPRINGS_UNSET,
    Unset("iterations", f"{ITERATIONS}", "SolverVBD, iterations", ITERATIONS),
    shapes.GAP_UNSET,
)
