"""The adapter of PhysX 5: spatial, velocity-level contact with positions in the same iterations, single precision.

    tgs:  detect  ->  v += g dt  ->  n times: solve contacts and friction for dt/n, x += v dt/n  ->  velocities alone
    pgs:  detect  ->  v += g dt  ->  n sweeps over contacts and friction  ->  x += v dt  ->  velocities alone

Contacts exist before a touch; bodies that do not touch within the step get no impulse.
"""

from __future__ import annotations

from types import MappingProxyType
from typing import final

from adapters.checked_engine import CheckedEngine
from adapters.engine import Declared, EngineFacts, Expected, Quirk, Scheme
from adapters.needs import Needs
from adapters.physx.profiles import KINDS, PROFILES
from adapters.physx.script import python
from adapters.physx.shipped import ANGULAR_DAMPING, BOUNCE_THRESHOLD
from adapters.physx.simulation import PhysxSimulation, imported
from adapters.receipts import ROUNDINGS
from adapters.receipts.probes import REBOUND_SPEED
from adapters.scene import Scene
from adapters.scene.means import no_means


@final
class PhysxEngine(CheckedEngine):
    """Spatial engine; see the module's docstring for its step."""

    facts = EngineFacts(
        name="physx",
        title="PhysX 5 (SAPIEN)",
        package="sapien",
        dimensions=frozenset({3}),
        scheme=Scheme("detect, forces, then substeps of contacts, friction and position", 1),
        customary_dt=1.0 / 100.0,
        profile_schemes=MappingProxyType({"pgs": Scheme("detect, forces, contacts and friction, position", 1)}),
        roles=MappingProxyType({"default": "shipped", "tuned": "tuned"}),
        precision="single",
        apart=True,
        abilities=frozenset({"course", "capsule", "hull"}),
        quirks=(
            Quirk(
                "a contact has friction only if its gap at the start of the step is below 0.04 of tolerance_length, "
                "4 mm as shipped; most blows have none",
                "unchanged in `default` and `pgs`; in `tuned` the length covers the motion of a step",
                "PxSceneDesc, frictionOffsetThreshold; measured: 0.00399 m have friction, 0.00401 m have none",
            ),
            Quirk(
                "a process has one tolerance_length",
                "each world sets its own; two worlds with different lengths at the same time are refused",
                "sapien, PhysxEngine; measured: a second value is ignored while a world exists",
            ),
            Quirk(
                "only normal impulses are reported",
                "impulses of contacts with friction are not stated (NaN)",
                "PxContactPairPoint.impulse; measured: a sliding box",
            ),
            Quirk(
                "materials of a pair are means of two bodies' values",
                "values per body are chosen that give the values of the pairs; a table without such values is refused",
                "PxCombineMode::eAVERAGE, which the bindings leave as it is; measured",
            ),
            Quirk(
                "restitution is 0 up to 2 m/s, spins lose 5 % a second and stay below 100 rad/s",
                "unchanged and declared in `default` and `pgs`; changed in `tuned`",
                "sapien.physx.get_scene_config, PhysxRigidDynamicComponent",
            ),
            Quirk(
                "there is no swept collision detection: the bindings have no flag for it",
                "unchanged; `enable_ccd` has no effect",
                "measured: 200 m/s at a wall of 1 cm",
            ),
            Quirk(
                "the normal of a plane is x, turned by a quaternion in single precision",
                "rotations to the world's axes consist of halves, which are exact",
                "measured: 1.2e-7 of a tilt with cosines of 45 degrees",
            ),
            Quirk(
                "a prescribed body gets target positions in single precision: its velocity has the rounding of a "
                "position over dt",
                "unchanged",
                "PxRigidDynamic::setKinematicTarget",
            ),
            Quirk(
                "importing warns that there is no Vulkan",
                "the warning is suppressed, no renderer is made",
                "sapien 3.0.3, _vulkan_tricks.py",
            ),
            Quirk("bodies sleep", "no body may", "PxRigidDynamic::setSleepThreshold"),
        ),
    )
    module = "sapien"
    simulation = PhysxSimulation
    profiles = PROFILES
    kinds = KINDS
    exports = MappingProxyType({"python": python})
    expected = (
        Expected(
            "order",
            "persistent manifolds store a contact's point on the surface of one of two balls: friction across a gap "
            "has a longer lever arm on the other, by up to 4 mm as shipped",
            "measured with 3.0.3: twists differ by 0.0012 with `pgs`, by 4e-6 without persistent manifolds",
        ),
    )

    def version(self) -> str:
        """Version of the installed bindings, which bring their own PhysX."""
        imported()  # without the warning at its first import
        return super().version()

    def refuses(self, scene: Scene, profile: str) -> str | None:
        """Refuse values beyond single precision, and pairs that no body values give."""
        return no_means(scene) or super().refuses(scene, profile)

    def declares(self, profile: str, needs: Needs, dt: float) -> dict[str, Declared]:
        """As shipped spins are damped and slow impacts do not rebound."""
        if profile == "tuned":
            return {}
        steps = round(1.0 / dt)
        # A spin is scaled by a root of its moment and back in every step, each rounded to single precision.
        left, band = (1.0 - ANGULAR_DAMPING * dt) ** steps, ROUNDINGS * self.facts.epsilon
        lost = Declared(1.0 - left, band, "5 % of a spin per second")
        declared = {"angular_damping": lost}
        if needs.regime == "impact" and REBOUND_SPEED <= BOUNCE_THRESHOLD:
            because = f"restitution is 0 up to {BOUNCE_THRESHOLD:g} m/s"
            declared["restitution"] = Declared(0.0, self.facts.round_off, because)
        return declared
