"""The adapter of Rapier: spatial, soft contacts, substeps with warm starting, single precision.

    step:  detect  ->  n times: v += g dt/n, contacts as springs that are solved with the velocities, x += v dt/n,
           contacts once more without their springs  ->  restitution

Readings of a step cover all of its substeps: impulses are their sum.
"""

from __future__ import annotations

from types import MappingProxyType
from typing import final

from adapters.checked_engine import CheckedEngine
from adapters.engine import Declared, EngineFacts, Quirk, Scheme
from adapters.needs import Needs
from adapters.rapier.profiles import KINDS, PROFILES, SUBSTEPS, TUNED_SUBSTEPS
from adapters.rapier.releases import RELEASES
from adapters.rapier.script import python
from adapters.rapier.simulation import RapierSimulation
from adapters.receipts import ROUNDINGS


@final
class RapierEngine(CheckedEngine):
    """Spatial engine; see the module's docstring for its step."""

    facts = EngineFacts(
        name="rapier",
        title="Rapier 3D",
        package="rapier3d",
        dimensions=frozenset({3}),
        scheme=Scheme("detect, then substeps of velocity and position, restitution last", 1.0 / SUBSTEPS),
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
                "unchanged in `default`, as stiff as a step resolves in `tuned`",
                "rapier3d, IntegrationParameters: contact_softness, static_contact_softness",
            ),
            Quirk(
                "friction is solved once for a manifold, and its impulse is not reported",
                "impulses of contacts with friction are not stated (NaN)",
                "rapier3d, FrictionModel.SIMPLIFIED; measured: tangent_impulse stays 0",
            ),
            Quirk(
                "the other friction model has less friction along the axes of a box",
                "it is not used",
                "measured with 0.36.1: FrictionModel.COULOMB, 0.936 mu g at 0 degrees",
            ),
            Quirk(
                "restitution is applied after friction, which is limited by the impulse of compression only: mu / "
                "(1 + e)",
                "unchanged",
                "measured with 0.36.1: pair_matrix, 0.2 / 1.9 = 0.10526 and 0.1 / 1.6 = 0.0625",
            ),
            Quirk(
                "mass properties of a body are 0 until the first step",
                "they are computed when the body is created",
                "measured with 0.36.1",
            ),
            Quirk(
                "a collider adds mass of its own",
                "colliders have density 0, the scene's mass and inertia are added",
                "rapier3d, RigidBodyBuilder.additional_mass_properties",
            ),
            Quirk(
                "the speed of a body is limited to 400 m/s",
                "unchanged in `default`, no limit in `tuned`",
                "rapier3d, IntegrationParameters.normalized_max_linear_velocity; measured: scales at 1000 m",
            ),
            Quirk("bodies sleep", "no body may", "rapier3d, can_sleep"),
        ),
    )
    module = "rapier3d"
    simulation = RapierSimulation
    profiles = PROFILES
    releases = RELEASES
    kinds = KINDS
    exports = MappingProxyType({"python": python})

    def declares(self, profile: str, needs: Needs, dt: float) -> dict[str, Declared]:
        """Spin except for round-off of all substeps, which adds up: each in single precision, to within 2 units."""
        small = next(each.value for each in self.settings(profile, needs, dt) if each.name == "substeps") / dt
        because = "each substep rounds a spin, always upwards: measured, 1 unit of the last digit"
        return {"angular_damping": Declared(0.0, (ROUNDINGS + 2.0 * small) * self.facts.epsilon, because)}
