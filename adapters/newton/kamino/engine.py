"""The adapter of Kamino in Newton: spatial, velocity-based contact as one problem a step, single precision.

    step:  detect  ->  impulses of all contacts that overlap, from velocities at the step's end  ->  v, then x += v dt

PADMM solves the nonlinear problem of Coulomb's cone with De Saxce's correction; DVI sweeps over its contacts.
"""

from __future__ import annotations

from dataclasses import replace
from types import MappingProxyType
from typing import Any, final

from adapters.engine import Declared, Quirk, Scheme
from adapters.needs import Needs
from adapters.newton.family import FACTS, NewtonFamily
from adapters.newton.kamino.profiles import KINDS, PROFILES
from adapters.newton.simulation import NewtonSimulation

#: What PADMM and DVI leave of a speed of the probe, as a share: tolerances of 1e-6 and 1e-5 m/s, and round-off.
SOLVED = 1e-4


class KaminoSimulation(NewtonSimulation):
    """A model with Kamino's solver."""

    def _room(self) -> int:
        """Eight contacts for each pair of touching bodies, of which there are at most three for each free body.

        The engine estimates a thousand, all of which its kernels visit: 23 ms a step, and 0.2 ms with those that count.
        """
        pairs, free = len(list(self.scene.contact_pairs())), sum(body.motion == "free" for body in self.scene.bodies)
        return 8 * max(1, min(pairs, 3 * free))

    def _materials(self, index: int) -> dict[str, float]:
        return {}

    def _solver(self, newton: Any) -> Any:
        chosen, method = self.settings, self.settings["method"]
        held = self.config = newton.solvers.SolverKamino.Config(dynamics_solver=method)
        held.constraints.gamma, held.constraints.delta = chosen["recovery"], chosen["left"]
        held.materials.restitution_mix_mode = "average"
        own = getattr(held, method)
        own.warmstart_mode = "containers" if chosen["warm_start"] else "none"
        if method == "padmm":
            own.max_iterations = chosen["iterations"]
            own.primal_tolerance = own.dual_tolerance = own.compl_tolerance = chosen["tolerance"]
        else:
            own.max_alternating_iterations, own.tolerance = chosen["iterations"], chosen["tolerance"]
        return newton.solvers.SolverKamino(self.model, config=held)

    def _numbers(self) -> dict[str, Any]:
        held = self.config
        own = getattr(held, held.dynamics_solver)
        padmm = held.dynamics_solver == "padmm"
        return {
            "method": held.dynamics_solver,
            "iterations": int(own.max_iterations if padmm else own.max_alternating_iterations),
            "tolerance": float(own.primal_tolerance if padmm else own.tolerance),
            "recovery": float(held.constraints.gamma),
            "left": float(held.constraints.delta),
            "warm_start": own.warmstart_mode != "none",
        }


@final
class KaminoEngine(NewtonFamily):
    """Spatial engine; see the module's docstring for its step."""

    facts = replace(
        FACTS,
        name="newton_kamino",
        title="Kamino (Newton)",
        scheme=Scheme("detect, solve velocities, then positions", 1),
        customary_dt=1.0 / 1000.0,
        roles=MappingProxyType({"default": "shipped", "tuned": "tuned"}),
        quirks=(
            Quirk(
                "restitution of a pair is the smaller of two values",
                "the mean, as for friction",
                "MaterialManagerConfig, restitution_mix_mode",
            ),
            Quirk(
                "each step removes 1 % of an overlap by adding velocity, which remains after a rebound",
                "unchanged: rebounds are up to e + 0.01",
                "ConstraintStabilizationConfig, gamma; measured",
            ),
            Quirk(
                "a model has room for a thousand contacts, all of which the solvers visit: 23 ms a step of one box",
                "room for those that the scene's pairs can have: 0.2 ms, and the same bits",
                "CollisionPipeline, rigid_contact_max; measured",
            ),
            Quirk(
                "contacts count from the overlap on",
                "unchanged",
                "ConstrainedDynamicsConfig, cull_speculative_contacts; newton#3779",
            ),
        ),
    )
    simulation = KaminoSimulation
    profiles = PROFILES
    kinds = KINDS

    def declares(self, profile: str, needs: Needs, dt: float) -> dict[str, Declared]:
        """Rebounds with a share of the overlap of their step, which is at most the motion of it."""
        if needs.regime != "impact":
            return {}
        half = 0.5 * next(x.value for x in self.settings(profile, needs, dt) if x.name == "recovery")
        because = "the step of a blow removes 1 % of the overlap by adding velocity, which remains after the rebound"
        return {"restitution": Declared(needs.restitution + half, half + SOLVED, because)}
