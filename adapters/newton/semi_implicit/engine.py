"""The adapter of Newton's semi-implicit solver: spatial, contacts as springs and dampers, explicit.

step:  detect  ->  forces of contacts from overlaps and speeds at its start  ->  v += f/m dt, x += v dt
"""

from __future__ import annotations

from dataclasses import replace
from types import MappingProxyType
from typing import Any, final

from adapters.engine import Declared, Quirk, Scheme
from adapters.needs import Needs
from adapters.newton import shapes
from adapters.newton.family import FACTS, NewtonFamily
from adapters.newton.semi_implicit.profiles import KINDS, PROFILES
from adapters.newton.semi_implicit.springs import declared
from adapters.newton.simulation import NewtonSimulation
from adapters.receipts import FRICTION_SHARE


class SemiImplicitSimulation(NewtonSimulation):
    """A model with the semi-implicit solver."""

    tells_forces = False

    def _materials(self, index: int) -> dict[str, float]:
        return {"ke": self.settings["stiffness"], "kd": self.settings["damping"], "kf": self.settings["slope"]}

    def _solver(self, newton: Any) -> Any:
        return newton.solvers.SolverSemiImplicit(self.model, angular_damping=self.settings["spin_damping"])

    def _numbers(self) -> dict[str, Any]:
        return {
            "stiffness": [float(x) for x in self.model.shape_material_ke.numpy()],
            "damping": [float(x) for x in self.model.shape_material_kd.numpy()],
            "slope": [float(x) for x in self.model.shape_material_kf.numpy()],
            "spin_damping": float(self.solver.angular_damping),
        }


@final
class SemiImplicitEngine(NewtonFamily):
    """Spatial engine; see the module's docstring for its step."""

    facts = replace(
        FACTS,
        name="newton_semi_implicit",
        title="Newton SI (semi-implicit)",
        scheme=Scheme("detect, forces, velocity, then position", 1),
        customary_dt=1.0 / 600.0,
        roles=MappingProxyType({"default": "shipped"}),
        quirks=(
            shapes.spring_quirk("unchanged"),
            Quirk(
                "forces of contacts are not reported",
                "impulses are not stated (NaN)",
                "SolverSemiImplicit.step, observables",
            ),
            Quirk(
                "a fixed ball is a point: its radius is left out, and what rolls on it falls through",
                "unchanged; a ball that is driven at no speed has its radius",
                "semi_implicit/kernels_contact.py, _eval_body_contact; measured",
            ),
        ),
    )
    simulation = SemiImplicitSimulation
    profiles = PROFILES
    kinds = KINDS

    def declares(self, profile: str, needs: Needs, dt: float) -> dict[str, Declared]:
        """Rebounds of springs, damped spins, and friction that slow slips have less of."""
        chosen = {setting.name: setting.value for setting in self.settings(profile, needs, dt)}
        lost = 1.0 - (1.0 - chosen["spin_damping"] * dt) ** (1.0 / dt)
        told = {"angular_damping": Declared(lost, self.facts.round_off, "as shipped spins are damped")}
        if needs.friction > 0.0:
            half = 0.5 * needs.friction
            because = "friction is a damper up to its cone: less than mu N where slips are slow or loads are large"
            told["friction"] = Declared(half, half + FRICTION_SHARE * needs.friction + self.facts.round_off, because)
        if needs.regime == "impact":
            told["restitution"] = declared(chosen["stiffness"], chosen["damping"], dt, self.facts.round_off)
        return told
