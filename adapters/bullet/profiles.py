"""Bullet's profiles: settings and their reasons.

default   Featherstone multibody path, as shipped: `createMultiBody` without further settings
tuned     rigid-body path; settings for rebounds where the scene has impacts, else settings for rest; faces are clipped
          where there are hulls
one       rigid-body path, one compromise for every scene
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from adapters.bullet.contact_law import ContactLaw
from adapters.bullet.shipped import BREAKING_THRESHOLD, ITERATIONS, SLOP
from adapters.engine import ProfileRule, Setting
from adapters.needs import Needs
from adapters.settings import LARGEST_INT, Check, number, whole

WORLD = frozenset(
    {
        "allowedCcdPenetration",
        "constraintSolverType",
        "contactBreakingThreshold",
        "contactERP",
        "contactSlop",
        "deterministicOverlappingPairs",
        "enableConeFriction",
        "enableSAT",
        "erp",
        "frictionERP",
        "globalCFM",
        "minimumSolverIslandSize",
        "numSubSteps",
        "restitutionVelocityThreshold",
        "solverResidualThreshold",
        "splitImpulsePenetrationThreshold",
        "useSplitImpulse",
        "warmStartingFactor",
    }
)
BODY = frozenset(
    {
        "angularDamping",
        "ccdSweptSphereRadius",
        "collisionMargin",
        "contactDamping",
        "contactProcessingThreshold",
        "contactStiffness",
        "linearDamping",
        "maxJointVelocity",
        "rollingFriction",
        "spinningFriction",
    }
)
#: Settings of a body that replace the correction of overlaps of its contacts.
SOFT = frozenset({"contactDamping", "contactStiffness"})
#: Integer settings of PyBullet.
WHOLE = frozenset(
    {
        "constraintSolverType",
        "deterministicOverlappingPairs",
        "enableConeFriction",
        "iterations",
        "minimumSolverIslandSize",
        "numSubSteps",
        "useMaximalCoordinates",
        "useSplitImpulse",
    }
)
_OTHERS = {"enableSAT": whole(0, 1), "iterations": whole(1, LARGEST_INT), "useMaximalCoordinates": whole(0, 1)}
KINDS: Mapping[str, Check] = MappingProxyType(
    {name: whole(0, LARGEST_INT) if name in WHOLE else number(0.0, math.inf) for name in sorted(WORLD | BODY)} | _OTHERS
)


def _breaking_threshold() -> Setting:
    because = "shipped value; set because it is a C global that all clients of the process share"
    return Setting("contactBreakingThreshold", BREAKING_THRESHOLD, because, "PhysicsServerCommandProcessor.cpp:11525")


def _wide_breaking_threshold() -> Setting:
    because = (
        "contact points that drift farther in a step than this share of the body are dropped; with the shipped 0.02 a "
        "box that slides 1.7 cm a step loses some of them, and their friction; no contact acts at a distance, since "
        "contactProcessingThreshold is 0"
    )
    return Setting("contactBreakingThreshold", 0.1, because, "crosscheck tune bullet --group slide; also --profile one")


def default(needs: Needs, dt: float) -> list[Setting]:
    """As shipped: multibody path, damping 0.04, contact ERP 0.08, speculative contacts."""
    return [
        Setting("useMaximalCoordinates", 0, "shipped: createMultiBody makes a Featherstone multibody"),
        Setting("iterations", ITERATIONS, "shipped", "PhysicsServerCommandProcessor.cpp:2800"),
        _breaking_threshold(),
    ]


def _rigid_body() -> list[Setting]:
    """Common settings of all tuned scenes."""
    solver = "btSequentialImpulseConstraintSolver.cpp"
    return [
        Setting(
            "useMaximalCoordinates",
            1,
            "the multibody path has no warm start or split impulse, and applies restitution to gravity's g dt as well",
            "btMultiBodyConstraintSolver.cpp:779,812",
        ),
        Setting("iterations", ITERATIONS, "shipped; ten boxes carry their weight to 1e-8"),
        Setting("solverResidualThreshold", 0.0, "the shipped 1e-7 stops at velocity changes of 3e-4 m/s"),
        Setting("warmStartingFactor", 0.85, "the shipped 0.1 hardly warm starts; 1.0 adds energy", f"{solver}:988"),
        Setting("restitutionVelocityThreshold", 1e-4, "below the shipped 0.2 m/s nothing rebounds", f"{solver}:494"),
        Setting("deterministicOverlappingPairs", 1, "the result of Gauss-Seidel depends on the order of pairs"),
        Setting("numSubSteps", 0, "with substeps the reported contact forces are wrong", "bullet3 #2797"),
        _wide_breaking_threshold(),
        Setting("linearDamping", 0.0, "the scene has no drag"),
        Setting("angularDamping", 0.0, "the scene has no drag"),
        Setting("rollingFriction", 0.0, "the scene has no rolling resistance"),
        Setting("spinningFriction", 0.0, "the scene has no torsional resistance"),
        Setting(
            "contactProcessingThreshold",
            0.0,
            "speculative contacts subtract gap/dt from a rebound",
            f"{solver}:949-953; bullet3 #3094",
        ),
    ]


def _faces(needs: Needs) -> list[Setting]:
    """Clipping of faces where there are hulls: two boxes have their own algorithm without it."""
    if not needs.hulls:
        return []
    because = (
        "otherwise one contact point a step is found between hulls, on a margin of 1 mm, and a block on a wedge stands "
        "on one point of four; boxes, balls and half-spaces do not need it"
    )
    return [Setting("enableSAT", 1, because, "btConvexConvexAlgorithm.cpp; of bodies from URDF files alone")]


def tuned(needs: Needs, dt: float) -> list[Setting]:
    """Choose between settings for impacts and for rest: the split impulse improves one and harms the other."""
    if needs.regime == "rest":
        return [
            *_rigid_body(),
            *_faces(needs),
            Setting("contactSlop", SLOP, "shipped; resting contacts stay closed"),
        ]
    return [
        *_rigid_body(),
        *_faces(needs),
        Setting("useSplitImpulse", 1, "overlaps are corrected without adding to a rebound"),
        Setting(
            "splitImpulsePenetrationThreshold",
            0.0,
            "the split impulse acts on every overlap, not only beyond 4 cm, so that none adds to a rebound; "
            "not for rest",
            "pybullet.c:1825",
        ),
        Setting(
            "contactERP",
            0.0,
            "correction would add energy to every impact that is found late; with e = 1 rebounds would grow",
            "crosscheck tune bullet --group impact",
        ),
        Setting(
            "contactSlop",
            1e-6,
            "an impact found within the slop loses slop/dt of its rebound; with 0 resting boxes chatter",
        ),
    ]


def one(needs: Needs, dt: float) -> list[Setting]:
    """One setting for all scenes: rebounds within 1 %, stacks of ten stand."""
    return [
        *_rigid_body(),
        Setting("contactSlop", SLOP, "shipped; resting contacts stay closed"),
        Setting(
            "contactERP", 0.01, "a rebound gains at most this fraction of v, and overlaps in stacks are still corrected"
        ),
    ]


PROFILES: Mapping[str, ProfileRule] = MappingProxyType({"default": default, "tuned": tuned, "one": one})


def law_of(profile: str, needs: Needs, dt: float) -> ContactLaw:
    """Contact law of a profile, from its own settings."""
    return ContactLaw.of({setting.name: setting.value for setting in PROFILES[profile](needs, dt)})


def by_call(settings: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Valid settings as arguments of `setPhysicsEngineParameter` and of `changeDynamics`."""
    world = {name: value for name, value in settings.items() if name in WORLD}
    body = {name: value for name, value in settings.items() if name in BODY}
    return world | {"numSolverIterations": settings.get("iterations", ITERATIONS)}, body
