"""The adapter of Box2D 3.1: planar, soft contacts, substeps with warm starting, single precision.

    step:  detect  ->  n times: v += g dt/n, contacts as springs that are solved with the velocities, x += v dt/n,
           contacts once more without their springs  ->  restitution  ->  sweep what moves against what does not

Names in sources are Box2D's own files.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from types import MappingProxyType
from typing import Any, final

from adapters.box2d3.profiles import KINDS, PROFILES, TUNED_SUBSTEPS
from adapters.box2d3.releases import RELEASES
from adapters.box2d3.script import python
from adapters.box2d3.shipped import SUBSTEPS
from adapters.box2d3.simulation import Box2D3Simulation
from adapters.box2d3.translation import frictions, restitutions
from adapters.checked_engine import CheckedEngine
from adapters.engine import Declared, EngineFacts, Quirk, Scheme
from adapters.needs import Needs
from adapters.scene import Scene


@final
class Box2D3Engine(CheckedEngine):
    """Planar engine; see the module's docstring for its step."""

    facts = EngineFacts(
        name="box2d3",
        title="Box2D 3.1",
        package="pyb2d3",
        dimensions=frozenset({2}),
        scheme=Scheme("detect, then substeps of velocity and position, restitution last, sweep", 1.0 / SUBSTEPS),
        profile_schemes=MappingProxyType(
            {"tuned": Scheme("as shipped, with twice the substeps", 1.0 / TUNED_SUBSTEPS)}
        ),
        customary_dt=1.0 / 60.0,
        roles=MappingProxyType({"default": "shipped", "tuned": "tuned"}),
        precision="single",
        apart=True,
        quirks=(
            Quirk(
                "contacts are springs of 30 Hz, 60 Hz against static bodies: columns sink by millimetres at every "
                "step size",
                "unchanged in `default`, as stiff as the substeps resolve in `tuned`",
                "types.c, b2DefaultWorldDef: contactHertz; solver.c, staticSoftness",
            ),
            Quirk(
                "restitution is 0 below 1 m/s",
                "unchanged in `default`; in `tuned` the speed that gravity adds in a step",
                "types.c, b2DefaultWorldDef: restitutionThreshold",
            ),
            Quirk(
                "restitution is applied after friction, which is limited by the impulse of compression only: mu / "
                "(1 + e)",
                "unchanged; the contact laws predict it",
                "contact_solver.c, b2ApplyRestitutionTask; measured with 0.11.1",
            ),
            Quirk(
                "the bindings give no contacts; the debug drawing has points and normals, and impulses that sum "
                "solve and relaxation of each substep: twice a weight, no rebound",
                "points and normals come from the drawing, impulses are not stated (NaN)",
                "pyb2d3 0.11.1; contact_solver.c, totalNormalImpulse; measured",
            ),
            Quirk(
                "friction of a pair is the root of a product, restitution the larger of two",
                "values per body are chosen that give the values of the pairs; a table without such values is refused",
                "types.h, b2WorldDef: frictionCallback, restitutionCallback, which the bindings leave out",
            ),
            Quirk(
                "its angle approximates the arc tangent, with an error of 1e-4",
                "angles are computed from its cosine and sine",
                "math_functions.c, b2Atan2",
            ),
            Quirk(
                "bodies sleep", "worlds and bodies are made so that they cannot sleep", "types.h, b2WorldDef, b2BodyDef"
            ),
            Quirk("there is room for 128 worlds", "a world is destroyed when its run ends", "core.h, B2_MAX_WORLDS"),
        ),
    )
    module = "pyb2d3"
    simulation = Box2D3Simulation
    profiles = PROFILES
    releases = RELEASES
    kinds = KINDS
    exports = MappingProxyType({"python": python})

    def refuses(self, scene: Scene, profile: str) -> str | None:
        """Refuse values beyond single precision, and pairs that no body values give."""
        if restitutions(scene) is None:
            return "pairs: restitution of a pair is the larger of two values here; no values per body give this table"
        if frictions(scene) is None:
            return (
                "pairs: friction of a pair is the root of a product of two values here; no values per body give "
                "this table"
            )
        return super().refuses(scene, profile)

    def declares(self, profile: str, needs: Needs, dt: float) -> dict[str, Declared]:
        """No deviations so far."""
        return {}

    def snippet(self, settings: Mapping[str, Any], names: Collection[str], scene: Scene, dt: float) -> str:
        """Python: arguments of a step and attributes of the world."""
        lines = [f"# world: your pyb2d3.World, stepped with world.step({dt:.9g}, {settings['substeps']})"]
        if {"hertz", "damping_ratio", "push_speed"} & set(names):
            springs = ", ".join(f"{settings[name]:g}" for name in ("hertz", "damping_ratio", "push_speed"))
            lines.append(f"world.set_contact_tuning({springs})")
        if "restitution_threshold" in names:
            lines.append(f"world.restitution_threshold = {settings['restitution_threshold']:g}")
        if "continuous" in names:
            lines.append(f"world.continuous_enabled = {settings['continuous']}")
        if "maximum_speed" in names:
            lines.append(f"# and make it with pyb2d3.World(maximum_linear_speed={settings['maximum_speed']:g})")
        return "\n".join(lines)
