"""The adapter of Newton's VBD: spatial, contacts as springs in an implicit step that is solved body by body.

step:  detect  ->  x + v dt + g dt^2  ->  n sweeps: each body to the minimum of its energy  ->  v from positions
"""

from __future__ import annotations

from dataclasses import replace
from types import MappingProxyType
from typing import Any, final

from adapters.engine import Declared, Expected, Quirk, Scheme
from adapters.law.single_precision import UNIT
from adapters.needs import Needs
from adapters.newton import shapes
from adapters.newton.family import FACTS, NewtonFamily
from adapters.newton.simulation import NewtonSimulation
from adapters.newton.vbd.profiles import KINDS, PROFILES
from adapters.receipts import FRICTION_SHARE
from adapters.receipts.probes import LOAD_ACCELERATION, LOAD_SPIN_UP, STEPS
from adapters.scene import Scene

#: Largest coordinate of a probe's body, times four [m], and roundings of a rotation in a step [rad].
FARTHEST, TURNED = 128.0, 32.0


class VbdSimulation(NewtonSimulation):
    """A model with the VBD solver."""

    tells_forces = False

    def _materials(self, index: int) -> dict[str, float]:
        return {"ke": self.settings["stiffness"], "kd": self.settings["damping"]}

    def _finished(self, builder: Any) -> Any:
        builder.color()
        return super()._finished(builder)

    def _solver(self, newton: Any) -> Any:
        return newton.solvers.SolverVBD(self.model, iterations=self.settings["iterations"])

    def _numbers(self) -> dict[str, Any]:
        return {
            "iterations": int(self.solver.iterations),
            "stiffness": [float(x) for x in self.model.shape_material_ke.numpy()],
            "damping": [float(x) for x in self.model.shape_material_kd.numpy()],
        }


@final
class VbdEngine(NewtonFamily):
    """Spatial engine; see the module's docstring for its step."""

    facts = replace(
        FACTS,
        name="newton_vbd",
        title="VBD (Newton)",
        scheme=Scheme("detect, an implicit step, velocities from positions", 1),
        customary_dt=1.0 / 600.0,
        roles=MappingProxyType({"default": "shipped", "tuned": "tuned"}),
        quirks=(
            shapes.spring_quirk("unchanged; `tuned` has stiffer ones"),
            Quirk(
                "forces of contacts are those after the last sweep: in a blow 2.8 N s where it gives 1.9 N s",
                "impulses are not stated (NaN)",
                "SolverVBD, ObservableKind.CONTACT_F; measured",
            ),
            Quirk(
                "friction of a pair is the root of a product",
                "tables of several values are refused",
                "vbd/rigid_vbd_kernels.py, _average_contact_material",
            ),
        ),
    )
    simulation = VbdSimulation
    profiles = PROFILES
    kinds = KINDS
    expected = (
        Expected(
            "free_fall",
            "speeds are differences of places over a step, in single precision: off by 2^-24 of a place in each",
            "vbd/rigid_vbd_kernels.py, update_body_velocity; measured: 0.3 mm/s at a place of 10 m",
        ),
    )

    def refuses(self, scene: Scene, profile: str) -> str | None:
        """Refuse tables of several frictions: those of pairs are roots of products."""
        if len({friction for _, friction in scene.materials()}) > 1:
            return "pairs: friction of a pair is the root of a product here; one value only"
        return super().refuses(scene, profile)

    def declares(self, profile: str, needs: Needs, dt: float) -> dict[str, Declared]:
        """Rebounds of springs, friction of loads that they carry, and speeds that are differences of places."""
        because = "speeds are differences of places over a step, which are rounded to single precision"
        gained = 0.5 * STEPS * dt
        told = {
            "mass": Declared(1.0, FARTHEST * UNIT / dt / (LOAD_ACCELERATION * gained), because),
            "inertia": Declared(1.0, TURNED * UNIT / dt / (LOAD_SPIN_UP * gained), because),
            "angular_damping": Declared(0.0, TURNED * UNIT / dt**2, because),
        }
        if needs.friction > 0.0:
            half, why = 0.5 * needs.friction, "a soft contact throws a sliding box up, and it slides less"
            told["friction"] = Declared(half, half + FRICTION_SHARE * needs.friction + self.facts.round_off, why)
        if needs.regime == "impact":
            told["restitution"] = Declared(0.5, 0.5 + self.facts.round_off, shapes.SPRING_REBOUND)
        return told
