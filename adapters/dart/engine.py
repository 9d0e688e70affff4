"""The adapter of DART: spatial, velocity-level contact, with friction pyramids and exact cones in one engine.

    step:  v += (g + f/m) dt  ->  detect  ->  restitution from v  ->  solve the contact problem of all islands
           ->  v += M^-1 J  ->  x += v dt

Profiles differ in the solver of the contact problem only.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, final

from adapters.checked_engine import CheckedEngine
from adapters.dart.profiles import CONES, KINDS, MOST_BOXES, PROFILES, checked, solved
from adapters.dart.releases import RELEASES, refusal
from adapters.dart.script import python
from adapters.dart.shipped import MIXING, PUSH_OUT, SMOOTH, THRESHOLD, restitution
from adapters.dart.simulation import DartSimulation
from adapters.dart.translation import frictions, restitutions
from adapters.engine import Declared, EngineFacts, Quirk, Scheme
from adapters.needs import Needs
from adapters.receipts.probes import MOST_FRICTION, REBOUND_SPEED
from adapters.scene import Box, Scene


@final
class DartEngine(CheckedEngine):
    """Spatial engine; see the module's docstring for its step."""

    facts = EngineFacts(
        name="dart",
        title="DART",
        package="dartpy",
        dimensions=frozenset({3}),
        scheme=Scheme("forces, detect, sample restitution, solve, position", 1),
        customary_dt=1.0 / 1000.0,
        roles=MappingProxyType({"default": "shipped", "nsgs": "tuned", "fbf": "one"}),
        apart=True,
        quirks=(
            Quirk(
                "bodies fall asleep: deactivation is on as shipped",
                "it is off in every profile",
                "World.getDeactivationOptions; measured with 6.20.0",
            ),
            Quirk(
                "a plane has one contact point with a box, which tips over its corners",
                "half-spaces are slabs, which have four",
                "measured with 6.20.0, all detectors",
            ),
            Quirk(
                "friction of a pair is the smaller of two values, restitution their product",
                "values per body are chosen that give the values of the pairs; a table without such values is refused",
                "measured with 6.20.0",
            ),
            Quirk(
                "solvers with a friction pyramid have no constructor in Python",
                "PGS is taken from another world, where it is the fallback solver",
                "dartpy 6.20.0, PgsBoxedLcpSolver",
            ),
            Quirk(
                "a PGS result above its tolerance is discarded, and a fallback solver of 30 iterations is used",
                "profile pgs gives the fallback solver the same iterations, whose result is used in any case",
                "BoxedLcpConstraintSolver, secondary solver; measured: 200 and 20 000 sweeps gave the same bits",
            ),
            Quirk(
                "Dantzig's solver limits friction by the loads that contacts would have without friction",
                "declared; the findings say where it matters",
                "DantzigBoxedLcpSolver, findex; measured: a ladder that friction holds with the other solvers slides",
            ),
            Quirk(
                "contacts yield by 1e-5 of the speed that they change; a rebound has 0.1 m/s to 100 m/s",
                "declared; the contact laws predict its effect on blows",
                "ContactConstraint: constraint force mixing, bouncing velocities; measured: 0.8 comes out as 0.799982",
            ),
            Quirk(
                f"friction of {SMOOTH:g} and less counts as none",
                "declared: a body that slides where it should not gives a FAIL",
                "ContactConstraint, friction coefficient threshold; measured with 6.20.0",
            ),
            Quirk(
                "there is no swept collision detection: a fast body passes through a thin one",
                "left alone",
                "measured with 6.20.0",
            ),
        ),
    )
    module = "dartpy"
    simulation = DartSimulation
    profiles = PROFILES
    releases = RELEASES
    kinds = KINDS
    exports = MappingProxyType({"python": python})

    def refuses(self, scene: Scene, profile: str) -> str | None:
        """Refuse bodies with prescribed motion, pairs that no body values give, and piles with exact cones."""
        for body in scene.bodies:
            if body.motion == "prescribed":
                return f"{body.name}.motion: the adapter does not support prescribed motion"
        boxes = sum(isinstance(body.shape, Box) and body.motion == "free" for body in scene.bodies)
        if profile in CONES and boxes > MOST_BOXES:
            return f"bodies: {boxes} free boxes; with more than {MOST_BOXES} {profile} takes minutes"
        if restitutions(scene) is None:
            return "pairs: restitution of a pair is a product of two factors here; no factors give this table"
        if frictions(scene) is None:
            return "pairs: friction of a pair is the smaller of two values here; no values per body give this table"
        return refusal(profile)

    def checked(self, settings: Mapping[str, Any]) -> dict[str, Any]:
        """See `CheckedEngine.checked`."""
        return checked(settings)

    def profile_of(self, settings: Mapping[str, Any]) -> str:
        """Name of the solver, which is also the name of the profiles with cones."""
        return str(settings["solver"])

    def declares(self, profile: str, needs: Needs, dt: float) -> dict[str, Declared]:
        """Restitution with the compliance of contacts, and no friction below the engine's threshold."""
        smooth = Declared(0.0, self.facts.round_off, f"friction up to {SMOOTH:g} counts as none")
        told = dict.fromkeys(("friction", "friction_impulse"), smooth) if needs.friction <= SMOOTH else {}
        if needs.regime != "impact" or (profile in CONES and needs.friction > MOST_FRICTION):
            return told
        if needs.restitution * REBOUND_SPEED <= THRESHOLD:
            half = 0.5 * PUSH_OUT / REBOUND_SPEED
            return {
                **told,
                "restitution": Declared(half, half + MIXING, "overlaps are corrected, at up to 1 mm/s"),
            }
        value, left = restitution(needs.restitution, REBOUND_SPEED), solved(profile, needs.friction > 0.0)
        return {
            **told,
            "restitution": Declared(value, left, "a contact yields by 1e-5 of the speed that it changes"),
        }
