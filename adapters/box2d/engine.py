"""The adapter of Box2D 2.3: planar, sequential impulses, warm starting, and position correction afterwards.

    step:  detect  ->  v += (g + f/m) dt  ->  restitution from v  ->  warm start  ->  N sweeps over velocities
           ->  x += v dt  ->  sweeps over positions (no velocities)  ->  sweep what moves against what does not

It computes in single precision. Names in sources are Box2D's own files.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from types import MappingProxyType
from typing import Any, final

from adapters.box2d.profiles import KINDS, PROFILES
from adapters.box2d.script import python
from adapters.box2d.simulation import Box2DSimulation
from adapters.checked_engine import CheckedEngine
from adapters.engine import Declared, EngineFacts, Quirk, Scheme
from adapters.needs import Needs
from adapters.receipts.probes import HALF_EXTENTS, LANDING_SPEED
from adapters.scene import Scene


@final
class Box2DEngine(CheckedEngine):
    """Planar engine; see the module's docstring for its step."""

    facts = EngineFacts(
        name="box2d",
        title="Box2D 2.3",
        package="Box2D",
        dimensions=frozenset({2}),
        scheme=Scheme("detect, forces, sample restitution, solve, position, correct positions, sweep", 1),
        customary_dt=1.0 / 60.0,
        roles=MappingProxyType({"default": "shipped", "tuned": "tuned"}),
        precision="single",
        apart=True,
        quirks=(
            Quirk(
                "polygons have a skin of 1 cm: boxes rest 1.5 cm above the ground",
                "unchanged in `default`, 0 in `tuned`",
                "b2Settings.h, b2_polygonRadius",
            ),
            Quirk(
                "restitution is 0 below 1 unit/s, and 5 mm of overlap stay uncorrected; neither can be set",
                "unchanged in `default`; `tuned` uses a smaller unit of length",
                "b2Settings.h, b2_velocityThreshold, b2_linearSlop",
            ),
            Quirk(
                "motion beyond 2 units and rotation beyond 90 degrees in a step are cut off",
                "`tuned` chooses its unit of length by the scene's speeds",
                "b2Settings.h, b2_maxTranslation, b2_maxRotation",
            ),
            Quirk(
                "restitution uses the velocity after gravity of this step, so rebounds are e g dt too fast",
                "unchanged",
                "b2Island.cpp, Solve: velocities are integrated before constraints are initialised",
            ),
            Quirk(
                "friction of a pair is the root of a product, restitution the larger of two",
                "where pairs differ, each contact gets its values when it begins",
                "b2Contact.h, b2MixFriction, b2MixRestitution",
            ),
            Quirk(
                "manifolds do not store impulses of swept bodies",
                "a listener sums the impulses that the solver reports",
                "b2Island.cpp, SolveTOI: impulses are not stored for warm starting",
            ),
            Quirk(
                "bodies sleep even in a world made with doSleep=False",
                "every body is made with allowSleep=False",
                "measured with 2.3.10",
            ),
            Quirk(
                "an edge shape keeps boxes at a distance of 2 cm, whatever their skin",
                "the ground is a polygon with its own frame",
                "b2CollideEdge.cpp, m_radius",
            ),
        ),
    )
    module = "Box2D"
    simulation = Box2DSimulation
    profiles = PROFILES
    kinds = KINDS
    exports = MappingProxyType({"python": python})

    def declares(self, profile: str, needs: Needs, dt: float) -> dict[str, Declared]:
        """The skin around both shapes of a landing."""
        settings = {setting.name: setting.value for setting in self.settings(profile, needs, dt)}
        skin = settings["skin"] / settings["units_per_metre"]
        declared = {}
        if skin > 0.0:
            step = (1.0 + needs.restitution) * LANDING_SPEED * dt
            most = 2.0 * skin
            because = "skins around the ground and the box, and one step of motion"
            declared["size"] = Declared(
                1.0 + 0.5 * most / HALF_EXTENTS[0], (0.5 * most + step) / HALF_EXTENTS[0], because
            )
        return declared

    def snippet(self, settings: Mapping[str, Any], names: Collection[str], scene: Scene, dt: float) -> str:
        """Python: arguments of a step, attributes of the world and of shapes, and the unit of length."""
        lines = [
            f"# world: your b2World, stepped with world.Step({dt:.9g}, {settings['iterations']}, "
            f"{settings['position_iterations']})"
        ]
        if "continuous" in names:
            lines.append(f"world.continuousPhysics = {settings['continuous']}")
        if "skin" in names:
            lines.append(f"shape.radius = {settings['skin']:g}  # of every polygon, before CreateFixture")
        if "units_per_metre" in names:
            lines.append(f"# and measure in units of 1/{settings['units_per_metre']:g} m: lengths, gravity, forces")
        return "\n".join(lines)
