"""The adapter of Box3D: spatial, soft contacts, substeps with warm starting, single precision.

    step:  detect  ->  n times: v += g dt/n, contacts as springs that are solved with the velocities, x += v dt/n,
           contacts once more without their springs  ->  restitution  ->  sweep what moves against what does not

Names in sources are Box3D's own files.
"""

from __future__ import annotations

from types import MappingProxyType
from typing import final

from adapters.box3d.profiles import KINDS, PROFILES, TUNED_SUBSTEPS
from adapters.box3d.shipped import SUBSTEPS
from adapters.box3d.simulation import Box3DSimulation
from adapters.checked_engine import CheckedEngine
from adapters.engine import Declared, EngineFacts, Quirk, Scheme
from adapters.needs import Needs
from adapters.receipts.probes import REBOUND_SPEED


@final
class Box3DEngine(CheckedEngine):
    """Spatial engine; see the module's docstring for its step."""

    facts = EngineFacts(
        name="box3d",
        title="Box3D",
        package="robox3d",
        dimensions=frozenset({3}),
        scheme=Scheme("detect, then substeps of velocity and position, restitution last, sweep", 1.0 / SUBSTEPS),
        profile_schemes=MappingProxyType(
            {"tuned": Scheme("as shipped, with twice the substeps", 1.0 / TUNED_SUBSTEPS)}
        ),
        customary_dt=1.0 / 60.0,
        roles=MappingProxyType({"default": "shipped", "tuned": "tuned"}),
        precision="single",
        apart=True,
        abilities=frozenset({"surface velocity", "moving half-space", "course", "capsule", "hull"}),
        quirks=(
            Quirk(
                "contacts are springs of 30 Hz, 60 Hz against static bodies: columns sink by millimetres at every "
                "step size",
                "unchanged in `default`, as stiff as the substeps resolve in `tuned`",
                "types.c, b3DefaultWorldDef: contactHertz; physics_world.c, staticSoftness",
            ),
            Quirk(
                "restitution is 0 below 1 m/s",
                "unchanged in `default`; in `tuned` the speed that gravity adds in a step",
                "types.c, b3DefaultWorldDef: restitutionThreshold",
            ),
            Quirk(
                "restitution is applied after friction, which is limited by the impulse of compression only: mu / "
                "(1 + e)",
                "unchanged; the contact laws predict it",
                "contact_solver.c, b3ApplyRestitution_Mesh",
            ),
            Quirk(
                "friction is one force at the mean of a contact's points, of which a tipping body has far ones in "
                "the air: its edge slides, and a tent of cards that should stand falls",
                "unchanged; friction of points is not stated (NaN)",
                "contact_solver.c, central friction, weighted by gaps since erincatto/box3d#71; measured",
            ),
            Quirk(
                "a contact tells the impulse of the last substep, and a sum over solve and relaxation of all: neither "
                "is the momentum of a step",
                "impulses are not stated (NaN), except with one substep",
                "types.h, b3ManifoldPoint: normalImpulse, totalNormalImpulse",
            ),
            Quirk(
                "friction of a pair is the root of a product, restitution the larger of two",
                "a callback gives each pair its own material where a scene has several",
                "types.h, b3WorldDef: frictionCallback, restitutionCallback",
            ),
            Quirk(
                "there is no half-space",
                "a large box, with its surface through the body's origin; on a face so wide normals lean by 1e-5",
                "types.h, b3ShapeType; measured: a ball that rebounds",
            ),
            Quirk(
                "moments of inertia in world axes are computed when a body is placed, not when its mass is set",
                "a body is placed once more after its mass is set",
                "measured: a torque has no effect in the first step",
            ),
            Quirk(
                "`b3World_EnableSpeculative` changes contacts of meshes only",
                "it is not used",
                "triangle_manifold.c; measured: the same bits",
            ),
            Quirk("a body turns by at most 45 degrees a step", "unchanged in `default`, no limit in `tuned`",
                  "constants.h, B3_MAX_ROTATION"),
            Quirk("bodies sleep", "no world or body may", "types.h, b3WorldDef, b3BodyDef"),
            Quirk("there is room for 128 worlds", "a world is destroyed at its end", "constants.h, B3_MAX_WORLDS"),
        ),
    )  # fmt: skip
    module = "robox3d"
    simulation = Box3DSimulation
    profiles = PROFILES
    kinds = KINDS

    def declares(self, profile: str, needs: Needs, dt: float) -> dict[str, Declared]:
        """Restitution of a slow probe, where gravity makes faster blows than it in a step."""
        threshold = next(x.value for x in self.settings(profile, needs, dt) if x.name == "restitution_threshold")
        if threshold <= REBOUND_SPEED:
            return {}
        return {"restitution": Declared(0.0, self.facts.round_off, "restitution is 0 below the threshold")}
