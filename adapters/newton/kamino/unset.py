"""Kamino without any settings, as documented; see `adapters.unset`."""

from __future__ import annotations

from adapters.newton import shapes
from adapters.newton.kamino.profiles import ITERATIONS, RECOVERY
from adapters.unset import Unset

_MIXED = "MaterialManagerConfig"
UNSET = (
    shapes.FRICTION_UNSET,
    Unset("friction of 0.2 and 0.9", "0.55, the mean", f"{_MIXED}, friction_mix_mode", 0.55),
    Unset("restitution of a pair", "0; the smaller of two", f"{shapes.SHAPE}; {_MIXED}, restitution_mix_mode", 0.0),
    Unset("solver", "padmm", "SolverKamino.Config, dynamics_solver"),
    Unset("iterations", f"{ITERATIONS['padmm']}", "PADMMSolverConfig, max_iterations", ITERATIONS["padmm"]),
    Unset("share of an overlap corrected in a step", f"{RECOVERY:g}", "ConstraintStabilizationConfig, gamma", RECOVERY),
    shapes.GAP_UNSET,
)
