"""The adapter of Drake: spatial, compliant contact, solved implicitly in discrete steps.

    step:  detect  ->  solve  M (v' - v) = dt (M g + f) + J^T j(x, v')  ->  q' = q + dt N(q) v'

Profiles differ in the approximation of ``j`` only, but for CENIC: an integrator of the continuous plant takes two such
steps, compares them with one of twice the size and chooses the size.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, final

from adapters.checked_engine import CheckedEngine
from adapters.drake.landing import slowest_rebound
from adapters.drake.profiles import CONTINUOUS, KINDS, OWN, PROFILES, checked
from adapters.drake.script import python
from adapters.drake.sdf import read
from adapters.drake.simulation import DrakeSimulation
from adapters.drake.translation import frictions
from adapters.engine import Declared, EngineFacts, Expected, Quirk, Scheme
from adapters.model import PROFILE
from adapters.needs import Needs
from adapters.receipts import FRICTION_SHARE, UNTOLD
from adapters.receipts.probes import REBOUND_SPEED, SLIDE_TIME, STEPS
from adapters.scene import Capsule, Cylinder, Scene, Sphere
from adapters.scene.meeting import meeting_pairs

#: Residual of a convex step's solver, as a share of the change, and of a speed [m/s]; measured 6e-6 at most.
SOLVED_SHARE, SOLVED = 1e-5, 1e-6
#: Profiles whose friction does not follow the load of the step, and why.
APPROXIMATE: Mapping[str, str] = MappingProxyType(
    {
        "default": "friction is limited by the load that the springs would have at the velocities of the step's "
        "start; for a rocking box that differs from the load of the step",
        CONTINUOUS: "friction is limited by the load at a step's start, and the first one starts without load",
        "sap": "slip lifts a body by a share of itself; the body glides and hops over the floor",
        "similar": "slip lifts a body by a share of itself; the body glides and hops over the floor",
    }
)


def _unsound(scene: Scene) -> str | None:
    """Why a capsule or a cylinder that can touch another shape than a ball is refused; see the quirk."""
    if not any(isinstance(body.shape, Capsule | Cylinder) for body in scene.bodies):
        return None
    for i, j, _ in meeting_pairs(scene):
        rod, other = scene.bodies[i], scene.bodies[j]
        if not isinstance(rod.shape, Capsule | Cylinder):
            rod, other = other, rod
        if isinstance(rod.shape, Capsule | Cylinder) and not isinstance(other.shape, Sphere):
            kind = type(rod.shape).__name__.lower()
            return (
                f"{rod.name}.shape: Drake's contact of a {kind} is exact with balls only, and it can touch {other.name}"
            )
    return None


@final
class DrakeEngine(CheckedEngine):
    """Spatial engine; see the module's docstring for its step."""

    facts = EngineFacts(
        name="drake",
        title="Drake",
        package="drake",
        dimensions=frozenset({3}),
        scheme=Scheme("detect, forces and contacts at once, position", 1),
        profile_schemes=MappingProxyType({CONTINUOUS: Scheme("two steps of half the size, if one of it agrees", 0)}),
        customary_dt=1.0 / 1000.0,
        roles=MappingProxyType({"default": "shipped", "sap": "one", "tamsi": "tuned"}),
        apart=True,
        abilities=frozenset({"capsule", "cylinder"}),
        quirks=(
            Quirk(
                "contacts have no coefficient of restitution; their dissipation depends on speed and step",
                "restitution above 0 is refused",
                "MultibodyPlant, Hunt & Crossley dissipation; measured with 1.51.1",
            ),
            Quirk(
                "a pair of shapes has one contact point, so a box rocks over its corners",
                "boxes and half-spaces are hydroelastic, with contact surfaces; pairs with a ball have one point",
                "ContactModel.kHydroelasticWithFallback; measured with 1.51.1",
            ),
            Quirk(
                "bodies overlap at rest: contacts are springs",
                "unchanged; stiffness and modulus are those of the engine",
                "SceneGraphConfig.default_proximity_properties",
            ),
            Quirk(
                "friction is viscous at slips below a tolerance, so a body that friction holds creeps",
                "unchanged: 0.1 mm/s as shipped",
                "MultibodyPlantConfig.stiction_tolerance",
            ),
            Quirk(
                "friction of a pair is the harmonic mean of two values",
                "values per body are chosen that give the values of the pairs; a table without such values is refused",
                "CalcContactFrictionFromSurfaceProperties",
            ),
            Quirk(
                "on a face a capsule or a cylinder has one contact point, on which it rocks for ever or sinks, or a "
                "surface of facets, on which it does not roll; where an end touches another one or a box, the "
                "normal is wrong by a tenth of a radian and more",
                "these pairs are refused, except in a model's own profile; with a ball the point is exact",
                "ComputePointPairPenetration, AddCompliantHydroelasticProperties; measured with 1.51.1, "
                "tests/adapters/test_rods_of_drake.py",
            ),
            Quirk(
                "CENIC finds contacts at the start of a step: a body that arrives in its last half sinks in without "
                "resistance, and no error is seen",
                "the bench's step is the longest that the integrator may take",
                "measured with 1.51.1: a ball of .1 m/s leaves with 20.0 for 19.70 mm/s at accuracies of 1e-3 to 1e-8; "
                "with 19.66 mm/s at a step of 1/64000 s",
            ),
            Quirk(
                "a plant without steps has forces of an instant, and no impulses of a step",
                "profile cenic reports no impulses",
                "MultibodyPlant.get_contact_results_output_port, time_step 0",
            ),
            Quirk(
                "there is no swept collision detection: a fast body passes through a thin one",
                "left alone",
                "measured with 1.51.1",
            ),
        ),
    )
    module = "pydrake"
    simulation = DrakeSimulation
    profiles = PROFILES
    kinds = KINDS
    exports = MappingProxyType({"python": python})
    reads = MappingProxyType({".sdf": read, ".world": read})
    expected = (
        Expected(
            "memory",
            "a plant and a scene graph that were built into a diagram are never freed by the bindings",
            "RobotLocomotion/drake issue 24529; measured with 1.51.1: an empty plant leaves 90 kB",
        ),
        Expected(
            "quarter_turn",
            "steps follow from errors of coordinates, so a turned scene takes others, and a blow with friction differs",
            "CenicIntegrator; measured with 1.51.1: .13 at an accuracy of 1e-4, .005 at 1e-6",
            CONTINUOUS,
        ),
    )

    def refuses(self, scene: Scene, profile: str) -> str | None:
        """Refuse restitution, moved bodies, pairs that no body values give, and some capsules and cylinders."""
        for body in scene.bodies:
            if body.motion == "prescribed":
                return f"{body.name}.motion: the adapter does not support prescribed motion"
        if any(restitution > 0.0 for restitution, _ in scene.materials()):
            return "pairs: contacts of drake have no coefficient of restitution"
        if profile != PROFILE and frictions(scene) is None:  # a model has its bodies' own values
            return "pairs: friction of a pair is a harmonic mean of two values here; no values per body give this table"
        return None if profile == PROFILE else _unsound(scene)

    def checked(self, settings: Mapping[str, Any]) -> dict[str, Any]:
        """See `CheckedEngine.checked`."""
        return checked(settings)

    def profile_of(self, settings: Mapping[str, Any]) -> str:
        """Profile of a model, if it has its bodies' own values."""
        return PROFILE if OWN in settings else ""

    def declares(self, profile: str, needs: Needs, dt: float) -> dict[str, Declared]:
        """Rebounds of springs, and friction where the approximation of contact does not follow the load."""
        declared = {}
        if profile == CONTINUOUS:
            because = "a step of h falls by g h^2/4 too far, and h is at most the bench's"
            declared["sampling"] = Declared(-0.125, 0.125 + SOLVED, because)
            declared["step"] = Declared(1.0 + 1.0 / (6.0 * STEPS), 1.0 / (6.0 * STEPS) + SOLVED, because)
        if needs.regime == "impact":
            most = slowest_rebound(profile, REBOUND_SPEED, dt) / REBOUND_SPEED
            declared["restitution"] = Declared(0.5 * most, 0.5 * most + SOLVED, "springs push overlapping bodies apart")
        if profile not in ("tamsi", CONTINUOUS):
            because = "a step is solved to 1e-5 of its change"
            declared["impulse"] = Declared(1.0, SOLVED_SHARE, because)
        if needs.friction > 0.0 and profile in APPROXIMATE:
            because = APPROXIMATE[profile]
            # A convex step satisfies its friction cone, to what its solver leaves of the load: friction is at most mu
            # times the load. In Lagged it may be more.
            half = 0.5 * needs.friction
            left = FRICTION_SHARE * needs.friction + SOLVED_SHARE
            capped = Declared(half, half + left, f"{because}: less than the scene's value, never more")
            told = Declared(needs.friction, UNTOLD, because) if profile == "default" else capped
            if profile == CONTINUOUS:
                told = Declared(needs.friction, (dt / SLIDE_TIME + FRICTION_SHARE) * needs.friction + SOLVED, because)
            declared |= {"friction": told, "friction_impulse": told}
            if profile == "sap":  # measured: 1 except for a box that lands in 3-D at 1/60 s: 1.42, without a known law
                declared["impulse"] = Declared(1.0, UNTOLD, because)
        return declared
