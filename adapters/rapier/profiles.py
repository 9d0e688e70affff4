"""Profiles of Rapier: settings and their reasons.

default   as shipped
tuned     stiffer contacts and more substeps
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from adapters import settings
from adapters.engine import ProfileRule, Setting
from adapters.needs import Needs

#: Substeps of a step, as shipped. [`IntegrationParameters.num_solver_iterations`]
SUBSTEPS = 4
#: Substeps of `tuned`: more of them have more round-off.
TUNED_SUBSTEPS = 8
#: Rates of the springs of contacts between moving bodies, and against fixed ones [1/s].
FREQUENCY, STATIC_FREQUENCY = 30.0, 60.0
#: Damping ratio of both.
DAMPING = 10.0
#: Overlap without correction, and prediction distance of contacts, in units of length.
ALLOWED, PREDICTION = 0.005, 0.02
#: Largest speed of a body, and largest correction speed of overlaps, in units of length per second.
FASTEST, PUSH_OUT = 400.0, 3.0
#: A speed without effect: no scene of ours moves faster.
NO_LIMIT = 1e9

KINDS: Mapping[str, settings.Check] = MappingProxyType(
    {
        "iterations": settings.whole(1, 10**6),
        "substeps": settings.whole(1, 10**6),
        "relaxations": settings.whole(0, 10**6),
        "frequency": settings.number(0.0, 1e9),
        "static_frequency": settings.number(0.0, 1e9),
        "damping_ratio": settings.number(0.0, 1e9),
        "allowed_error": settings.number(0.0, 1e9),
        "prediction": settings.number(0.0, 1e9),
        "fastest": settings.number(0.0, 1e30),
        "push_out": settings.number(0.0, 1e30),
        "friction_model": settings.word("simplified", "coulomb"),
        "recycling": settings.flag,
        "clustering": settings.flag,
    }
)


def default_profile(needs: Needs, dt: float) -> list[Setting]:
    """As shipped: what ``IntegrationParameters()`` holds."""
    said, source = "as shipped", "rapier3d, IntegrationParameters"
    return [
        Setting("iterations", 1, f"{said}: one iteration in each substep", source),
        Setting("substeps", SUBSTEPS, f"{said}: substeps of a step", source),
        Setting("relaxations", 1, f"{said}: one iteration without springs in each substep", source),
        Setting("frequency", FREQUENCY, f"{said}: contacts of moving bodies are springs of 30 Hz", source),
        Setting("static_frequency", STATIC_FREQUENCY, f"{said}: against static bodies 60 Hz", source),
        Setting("damping_ratio", DAMPING, said, source),
        Setting("allowed_error", ALLOWED, f"{said}: overlap that is not corrected", source),
        Setting("prediction", PREDICTION, f"{said}: contacts act from this distance", source),
        Setting("fastest", FASTEST, f"{said}: largest speed of a body [m/s]", source),
        Setting("push_out", PUSH_OUT, f"{said}: largest speed of overlap correction [m/s]", source),
        Setting("friction_model", "simplified", f"{said}: one friction constraint per manifold", source),
        Setting("recycling", True, f"{said}: manifolds of bodies that hardly moved are reused", source),
        Setting("clustering", True, f"{said}: manifolds of a pair with like normals are merged", source),
    ]


def tuned_profile(needs: Needs, dt: float) -> list[Setting]:
    """Best stock settings for what the scene needs."""
    stiff = 1.0 / dt
    source = "measured: columns, unequal masses"
    return [
        Setting("iterations", 4, "more iterations in each substep, for loads on light bodies", source),
        Setting("substeps", TUNED_SUBSTEPS, "twice the substeps: impulses pass farther up a column", source),
        Setting("relaxations", 1, "as shipped", "rapier3d, IntegrationParameters"),
        Setting("frequency", stiff, "the stiffness that a step resolves, so that bodies do not sink in", source),
        Setting("static_frequency", stiff, "the same against static bodies", source),
        Setting(
            "damping_ratio", DAMPING, "as shipped: over-damped, so overlapping bodies are not thrown apart", source
        ),
        Setting(
            "allowed_error", 1e-5 * needs.smallest_size, "the shipped value leaves 5 mm of overlap uncorrected", source
        ),
        Setting("prediction", PREDICTION, "as shipped", "rapier3d, IntegrationParameters"),
        Setting("fastest", NO_LIMIT, "the shipped 400 m/s is too slow for scenes in kilometres", "measured: scales"),
        Setting("push_out", PUSH_OUT, "as shipped", "rapier3d, IntegrationParameters"),
        Setting(
            "friction_model",
            "simplified",
            "as shipped: the other model has less friction along the axes of a box than along its diagonal",
            "measured: 0.936 mu g at 0 degrees, mu g at 45",
        ),
        Setting("recycling", False, "contacts are detected anew in every step", "rapier3d, contact_recycling"),
        Setting("clustering", True, "as shipped", "rapier3d, IntegrationParameters"),
    ]


PROFILES: Mapping[str, ProfileRule] = MappingProxyType({"default": default_profile, "tuned": tuned_profile})
