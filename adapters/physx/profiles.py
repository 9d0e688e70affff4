"""Profiles of PhysX: settings and their reasons.

default   as SAPIEN ships it: TGS, whose iterations are substeps
pgs       the same with projected Gauss-Seidel, PhysX's own default
tuned     TGS without losses, with friction and restitution for all contacts
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from types import MappingProxyType

from adapters import settings
from adapters.engine import ProfileRule, Setting
from adapters.needs import Needs
from adapters.physx.shipped import (
    ANGULAR_DAMPING,
    BOUNCE_THRESHOLD,
    CONTACT_OFFSET,
    FASTEST_SPIN,
    ITERATIONS,
    PUSH_OUT,
    TOLERANCE_LENGTH,
    VELOCITY_ITERATIONS,
)

#: Largest iteration count: a byte. [PxRigidDynamic.setSolverIterationCounts]
MOST_ITERATIONS = 255
KINDS: Mapping[str, settings.Check] = MappingProxyType(
    {
        "solver": settings.word("tgs", "pgs"),
        "iterations": settings.whole(1, MOST_ITERATIONS),
        "velocity_iterations": settings.whole(0, MOST_ITERATIONS),
        "bounce_threshold": settings.number(1e-30, 1e30),
        "contact_offset": settings.number(1e-9, 1e9),
        "tolerance_length": settings.number(1e-6, 1e9),
        "push_out": settings.number(1e-6, 1e32),
        "angular_damping": settings.number(0.0, 1e6),
        "fastest_spin": settings.number(0.0, 1e15),
        "friction_every_iteration": settings.flag,
        "persistent_manifolds": settings.flag,
    }
)
_BODY, _SCENE, _SHAPE = "sapien.physx.get_body_config", "sapien.physx.get_scene_config", "sapien.physx.get_shape_config"


def _shipped(solver: str, why: str, needs: Needs, dt: float) -> list[Setting]:
    said = "as shipped"
    return [
        Setting("solver", solver, why, _SCENE),
        Setting("iterations", ITERATIONS, f"{said}: iterations that move bodies; substeps of TGS", _BODY),
        Setting("velocity_iterations", VELOCITY_ITERATIONS, f"{said}: iterations on velocities only", _BODY),
        Setting("bounce_threshold", BOUNCE_THRESHOLD, f"{said}: restitution is 0 below this speed [m/s]", _SCENE),
        Setting("contact_offset", CONTACT_OFFSET, f"{said}: contacts act from this distance, of each shape", _SHAPE),
        Setting("tolerance_length", TOLERANCE_LENGTH, f"{said}: friction needs a gap below 0.04 of it", "PhysxEngine"),
        Setting("push_out", PUSH_OUT, f"{said}: overlaps are corrected at any speed", "PhysxRigidDynamicComponent"),
        Setting(
            "angular_damping",
            ANGULAR_DAMPING,
            f"{said}: share of the spin lost per second",
            "PhysxRigidDynamicComponent",
        ),
        Setting("fastest_spin", FASTEST_SPIN, f"{said}: largest spin of a body [rad/s]", "PhysxRigidDynamicComponent"),
        Setting("friction_every_iteration", True, said, _SCENE),
        Setting("persistent_manifolds", True, f"{said}: PCM", _SCENE),
    ]


def least_rebound(needs: Needs, dt: float) -> float:
    """Threshold speed of restitution in `tuned` [m/s].

    Above the speed of one step of gravity, else a body at rest would hop.
    """
    return max(2.0 * needs.gravity * dt, 1e-4)


def tuned_profile(needs: Needs, dt: float) -> list[Setting]:
    """Best stock settings for what the scene needs."""
    least = least_rebound(needs, dt)
    ahead = max(CONTACT_OFFSET, needs.top_speed * dt)
    changed = {
        "iterations": (50, "more substeps and iterations, for loads on light bodies", "measured: columns"),
        "bounce_threshold": (
            least,
            "twice the speed that gravity adds in a step, so that resting bodies do not hop",
            "derived",
        ),
        "tolerance_length": (ahead / 0.04, "every contact of a step has friction", "measured: blows"),
        "angular_damping": (0.0, "the scene has no drag", "PhysxRigidDynamicComponent"),
        "fastest_spin": (1e9, "small bodies turn faster than the shipped 100 rad/s", "PhysxRigidDynamicComponent"),
    }
    return [
        Setting(each.name, *changed[each.name]) if each.name in changed else each
        for each in _shipped("tgs", "as shipped: an iteration of TGS is a substep", needs, dt)
    ]


PROFILES: Mapping[str, ProfileRule] = MappingProxyType(
    {
        "default": partial(_shipped, "tgs", "as SAPIEN ships it: substeps of one iteration each"),
        "pgs": partial(_shipped, "pgs", "PhysX's own default: iterations over one step, as in textbooks"),
        "tuned": tuned_profile,
    }
)
