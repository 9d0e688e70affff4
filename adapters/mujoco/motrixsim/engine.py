"""The adapter of MotrixSim: spatial, generalized coordinates, contacts solved in sweeps, single precision.

    step:  detect  ->  v += g dt  ->  sweeps over contacts, springs or hard ones  ->  x += v dt

It reads MJCF, which `adapters.mujoco` writes.
"""

from __future__ import annotations

from types import MappingProxyType
from typing import final

from adapters.checked_engine import CheckedEngine
from adapters.engine import Declared, EngineFacts, Expected, Quirk, Scheme
from adapters.mujoco.motrixsim.profiles import KINDS, PROFILES
from adapters.mujoco.motrixsim.simulation import MotrixSimulation, imported
from adapters.mujoco.motrixsim.springs import OFF, Spring
from adapters.needs import Needs

#: Phases of a step over which a rebound is declared.
PHASES = 128
SPRING = "contacts are springs and dampers: the rebound depends on the phase of the step, not on e"
OVERLAP = "a step removes the share erp of an overlap by adding velocity, which remains after the rebound"


@final
class MotrixSimEngine(CheckedEngine):
    """Spatial engine; see the module's docstring for its step."""

    facts = EngineFacts(
        name="motrixsim",
        title="MotrixSim",
        package="motrixsim-core",
        dimensions=frozenset({3}),
        scheme=Scheme("detect, velocity, position", 1),
        customary_dt=1.0 / 500.0,
        roles=MappingProxyType({"default": "shipped", "tuned": "tuned"}),
        precision="single",
        apart=True,
        abilities=frozenset({"course", "capsule", "cylinder", "hull"}),
        quirks=(
            Quirk(
                "contacts are springs with MuJoCo's impedance: no restitution",
                "unchanged in `default`; for blows hard ones with restitution in `tuned`, which MJCF has no word for",
                "msd.ConstraintForceModel",
            ),
            Quirk(
                "sweeps end at a change of 1e-4, where the MJCF reference says 1e-8",
                "unchanged in `default`; 1e-7 in `tuned`",
                "measured: msd.SimulateOption of a model that states none",
            ),
            Quirk(
                "a hard contact adds erp times the overlap over the step to the speed of a rebound",
                "erp is 0.01 in scenes of blows in `tuned`, 0 without gravity",
                "measured: 3.70 m/s after 3.15 m/s with e = 1",
            ),
            Quirk(
                "friction is a square: 1.41 times mu g at 45 degrees between its axes",
                "unchanged; solver = Newton has a cone, on which boxes hop",
                "msd.ContactPair, friction; measured: another friction_model ends the process as not yet implemented",
            ),
            Quirk("forces act for one step", "they are added in every step", "Link.add_external_force; measured"),
        ),
    )
    expected = (
        Expected(
            "memory",
            "a built model keeps 24 kB after its end; a world alone leaves no more than that",
            "measured with 0.10.1: msd.World.build in a loop",
        ),
    )
    module = "motrixsim"
    simulation = MotrixSimulation
    profiles = PROFILES
    kinds = KINDS

    def version(self) -> str:
        """Version of the installed distribution."""
        imported()  # without the output of its first import
        return super().version()

    def declares(self, profile: str, needs: Needs, dt: float) -> dict[str, Declared]:
        """Rebound of springs, which is none of e; of hard contacts with what an overlap adds to it."""
        if needs.regime != "impact":
            return {}
        settings = {each.name: each.value for each in self.settings(profile, needs, dt)}
        share = settings["erp"]
        if share is None:
            spring = Spring.of_settings(settings, dt)
            ratios = [spring.rebound_ratio(1.0, (k + 0.5) / PHASES) for k in range(PHASES)]
            return {"restitution": Declared.over(ratios, OFF, SPRING)}
        half = 0.5 * share  # of an overlap between none and the way of a step
        return {"restitution": Declared(needs.restitution + half, half + self.facts.round_off, OVERLAP)}
