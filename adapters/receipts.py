"""Parameter receipts: tiny probe scenes measure what an engine realises, through its own adapter."""

from __future__ import annotations

#: What the probes measure. ``restitution`` and ``friction`` are the pair's effective coefficients; ``mass``,
#: ``inertia``, ``gravity``, ``step`` and ``size`` are ratios measured / asked; the dampings are the fraction of
#: speed lost in one second.
QUANTITIES = (
    "gravity",
    "step",
    "mass",
    "inertia",
    "size",
    "linear_damping",
    "angular_damping",
    "restitution",
    "friction",
)
