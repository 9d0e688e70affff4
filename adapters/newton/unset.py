"""Newton's XPBD solver without any settings, as documented; see `adapters.unset`."""

from __future__ import annotations

from adapters.newton import shapes
from adapters.newton.shipped import ROLLING, STOPPED, TORSIONAL
from adapters.unset import Unset

_SHAPE, _SOLVER = shapes.SHAPE, "SolverXPBD"
_PAIR = "xpbd/kernels.py, _solve_body_contact_positions"
UNSET = (
    shapes.FRICTION_UNSET,
    Unset("friction of 0.2 and 0.9", "0.55, the mean", _PAIR, 0.55),
    Unset("friction against rolling [m]", f"{ROLLING:g}: mu_rolling", _SHAPE, ROLLING),
    Unset("friction about the normal [m]", f"{TORSIONAL:g}: mu_torsional", _SHAPE, TORSIONAL),
    Unset("restitution of a pair", "0; ignored unless enable_restitution is set", f"{_SHAPE}; {_SOLVER}", 0.0),
    Unset("no rebound below [m/s]", "twice the speed that gravity gives in a step", "xpbd/restitution_kernels.py"),
    Unset("angular damping [1/s]", "0", _SOLVER, 0.0),
    Unset("stopped below [m/s]", f"{STOPPED:g}, and spins below as many rad/s", "xpbd/kernels.py, apply_body_deltas"),
    shapes.GAP_UNSET,
    Unset("mass of a cubic metre [kg]", "1000: density", _SHAPE, 1000.0),
    Unset("step [s]", "none: each call has its own", f"{_SOLVER}.step"),
)
