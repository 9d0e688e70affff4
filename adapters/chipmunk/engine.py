"""The adapter of Chipmunk (Munk2D) through pymunk: planar, impulse-based, a fixed number of iterations.

    step:  x += (v + v_bias) dt  ->  detect  ->  bounce = e v.n (before forces)  ->  v += (g + f/m) dt
           ->  warm start  ->  N sweeps over the contacts (accumulated clamping, friction with the current total)

Position is advanced first, with the old velocity. Line numbers below are those of Munk2D's ``src/``.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from types import MappingProxyType
from typing import Any

from adapters.checked_engine import CheckedEngine
from adapters.chipmunk.profiles import KINDS, PROFILES, SLOP_SHARE, START_SHARE, checked
from adapters.chipmunk.releases import RELEASES
from adapters.chipmunk.script import python
from adapters.chipmunk.simulation import ChipmunkSimulation
from adapters.chipmunk.translation import factors, leaves_ground, moment
from adapters.engine import Declared, EngineFacts, Quirk, Scheme
from adapters.needs import Needs, needs
from adapters.receipts import IMPULSE_SHARE
from adapters.receipts.probes import SLIDE_TIME
from adapters.scene import Scene


class ChipmunkEngine(CheckedEngine):
    """Planar engine; see the module's docstring for its step."""

    facts = EngineFacts(
        name="chipmunk",
        title="Chipmunk 2D (Munk2D) through pymunk",
        package="pymunk",
        dimensions=frozenset({2}),
        scheme=Scheme("position, detect, sample restitution, forces, solve", -1),
        customary_dt=1.0 / 60.0,
        roles=MappingProxyType({"default": "shipped", "tuned": "tuned"}),
        colour="#a8600c",
        abilities=frozenset(
            {"surface velocity", "moving half-space", "course", "capsule", "polygon", "restitution above 1"}
        ),
        quirks=(
            Quirk("external forces are cleared by every step", "they are set again before each", "cpBody.c:502"),
            Quirk(
                "restitution and friction of a pair are products of the two shapes' values",
                "factors are chosen whose products are the pairs' values; a table without such factors is refused",
                "cpArbiter.c:334-335",
            ),
            Quirk(
                "one arbiter holds up to two points, but only their summed impulse is public",
                "the impulse of each point is read from the arbiter's structure; their sum is the public total",
                "cpArbiter.h:30",
            ),
            Quirk("Body.kinetic_energy is twice the energy", "energies are computed from twists", "cpBody.c:588"),
            Quirk(
                "mass, moment, elasticity, friction or iterations out of range abort the process",
                "every number is checked before it is set",
                "cpBody.c:258, cpShape.c:141, cpSpace.c:208",
            ),
            Quirk(
                "collision_persistence = 0 drops every contact before the solver",
                "refused as a setting",
                "cpSpaceStep.c:344",
            ),
            Quirk(
                "with the shipped persistence of 3, a contact that forms again within three steps keeps its old "
                "accumulated impulse although it is not applied: totals are too large and contacts can pull",
                "unchanged in `default`, persistence 1 in `tuned`",
                "cpArbiter.c:324 and :390",
            ),
            Quirk("the threaded solver gives a different result in each run", "it is not used", "cpHastySpace.c:594"),
            Quirk(
                "a shape query between a circle and a polygon flips the sign of the depth",
                "only its magnitude is used, in the search for touching pairs",
                "measured on pymunk 7.3.1",
            ),
            Quirk(
                "there is no swept collision detection: a fast body passes through a thin one",
                "the ground is 1 km thick",
                "cpSpaceStep.c:400",
            ),
        ),
    )
    module = "pymunk"
    simulation = ChipmunkSimulation
    profiles = PROFILES
    kinds = KINDS
    releases = RELEASES
    exports = MappingProxyType({"python": python})

    def refuses(self, scene: Scene, profile: str) -> str | None:
        """Pairs that are no product of two body values, and masses whose inverse overflows."""
        for body in scene.bodies:
            if body.motion == "free" and not math.isfinite(1.0 / body.mass + 1.0 / moment(body)):
                return f"{body.name}.mass: the inverse of mass or inertia overflows, the engine's state would be NaN"
        for quantity in ("restitution", "friction"):
            if factors(scene, quantity) is None:
                return f"pairs: {quantity} of a pair is a product of two factors here; no factors give this table"
        return None

    def too_coarse(self, scene: Scene, dt: float) -> str | None:
        """Steps in which a body could pass the ground's polygon."""
        return leaves_ground(scene, dt)

    def checked(self, settings: Mapping[str, Any]) -> dict[str, Any]:
        """See `CheckedEngine.checked`."""
        return checked(settings)

    def snippet(self, settings: Mapping[str, Any], names: Collection[str], scene: Scene, dt: float) -> str:
        """Python: attributes of the space, and the start overlap of touching bodies."""
        needed = needs(scene)
        told = {"collision_slop": "  # a thousandth of the smallest body"}
        if settings["collision_slop"] != SLOP_SHARE * needed.smallest_size:
            told = {}
        lines = [f"space.{name} = {settings[name]!r}{told.get(name, '')}" for name in names if name != "start_overlap"]
        if "start_overlap" in names and settings["start_overlap"]:
            deep = self.words(settings, scene, dt)["start_overlap"][1]
            lines.append(f"# bodies that touch start {deep} deep in each other, in units of your space")
        return "\n".join(["# space: your pymunk.Space", *lines]) if lines else ""

    def words(self, settings: Mapping[str, Any], scene: Scene, dt: float) -> dict[str, tuple[str, Any]]:
        """Chipmunk has no setting for the start overlap."""
        deep = settings["start_overlap"]
        is_share = deep > 0.0 and math.isclose(deep, START_SHARE * (needs(scene).pull * dt * dt))
        said = f"{START_SHARE:g}*g*dt^2" if is_share else deep
        return {"start_overlap": ("overlap of touching bodies at the start", said)}

    def declares(self, profile: str, needs: Needs, dt: float) -> dict[str, Declared]:
        """Single contacts and constant forces are exact here; totals of impulses are not where e = 1 and friction meet.

        A contact that opens and closes again within the persistence keeps its old impulse without applying it. It
        reports the sum of both: no less than the step's impulse, and no more than the sum of all impulses so far. Over
        the probe's N steps that is from 1 to N times the sum. With any loss the probe's box rests before its impulses
        count, and they are exact (measured: e = 0.99, 1/60 to 1/960 s).
        """
        kept = {s.name: s.value for s in self.settings(profile, needs, dt)}["collision_persistence"] > 1
        if not kept or needs.restitution < 1.0 or needs.friction == 0.0:
            return {}
        half, because = 0.5 * (SLIDE_TIME / dt - 1.0), "contacts that form again report their old impulses once more"
        return {"impulse": Declared(1.0 + half, half + IMPULSE_SHARE, because)}
