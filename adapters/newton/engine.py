"""The adapter of Newton's XPBD solver: spatial, position-based contact, single precision.

    step:  detect  ->  v += g dt, x += v dt  ->  n iterations: each contact corrects its overlap, friction its slip,
           and v with them  ->  restitution, on velocities only

Overlaps at a step's end are corrected, all contacts at once; a body gets the mean of its contacts' corrections.
"""

from __future__ import annotations

from dataclasses import replace
from types import MappingProxyType
from typing import final

from adapters.engine import Declared, Quirk, Scheme
from adapters.needs import Needs
from adapters.newton.family import FACTS, NewtonFamily
from adapters.newton.profiles import KINDS, PROFILES, TUNED_ITERATIONS
from adapters.newton.script import python
from adapters.newton.shipped import ITERATIONS, LEAST_APPROACH, RELAXATION, STOPPED
from adapters.newton.simulation import NewtonSimulation
from adapters.receipts import FRICTION_SHARE
from adapters.receipts.probes import GRAVITY, SLIDE_TIME

#: Largest ratio of a box's mass to the effective mass at a corner, for any face: 1 + 3 a^2/(a^2 + c^2) + 3 b^2/(b^2 +
#: c^2).
LEAST_SHARE = 7.0


@final
class NewtonEngine(NewtonFamily):
    """Spatial engine; see the module's docstring for its step."""

    facts = replace(
        FACTS,
        name="newton",
        title="Newton (XPBD)",
        scheme=Scheme("detect, forces and position, then contacts on positions", 1),
        customary_dt=1.0 / 600.0,
        roles=MappingProxyType({"default": "shipped", "tuned": "tuned"}),
        abilities=FACTS.abilities | {"surface velocity"},
        quirks=(
            Quirk(
                "restitution is ignored unless enable_restitution is set",
                "set where a scene has any",
                "SolverXPBD, enable_restitution",
            ),
            Quirk(
                "materials of a pair are means of two bodies' values",
                "values per body are chosen that give the values of the pairs; a table without such values is refused",
                "xpbd/kernels.py, _solve_body_contact_positions",
            ),
            Quirk(
                "contacts with friction also resist rolling and spinning, by 0.1 mm and 5 mm times the load",
                "unchanged in `default` where a body has friction; 0 in `tuned`",
                "ModelBuilder.ShapeConfig, mu_rolling and mu_torsional",
            ),
            Quirk(
                "speeds below 0.1 mm/s and spins below 0.1 mrad/s are set to 0",
                "left alone",
                "xpbd/kernels.py, apply_body_deltas",
            ),
            Quirk(
                "two bodies with different numbers of contacts get different impulses from the contact between them",
                "unchanged; the impulse of such a contact is a mean",
                "SolverXPBD, rigid_contact_con_weighting",
            ),
            Quirk(
                "only impulses of position corrections are reported",
                "where rebounds are solved too, impulses are not stated (NaN)",
                "SolverXPBD, ObservableKind.CONTACT_F; xpbd/solver_xpbd.py: rebounds come after it",
            ),
            Quirk(
                "kernels are compiled at the first steps, into Warp's own cache",
                "unchanged: it happens before the first case, whose time it is not",
                "warp.config.kernel_cache_dir, ~/.cache/warp; measured: 41 s of CPU and 6 MB for all of them",
            ),
            Quirk(
                "launching a step costs a millisecond",
                "Warp records a step once and replays it, bit for bit",
                "warp.ScopedCapture; measured: 1.2 ms and 0.03 ms",
            ),
            Quirk(
                "the solver does not move a prescribed body",
                "before each step it is placed where the step ends, with the velocity of that motion",
                "BodyFlags.KINEMATIC, copy_kinematic_body_state_kernel",
            ),
        ),
    )
    simulation = NewtonSimulation
    profiles = PROFILES
    kinds = KINDS
    exports = MappingProxyType({"python": python})

    def declares(self, profile: str, needs: Needs, dt: float) -> dict[str, Declared]:
        """Residual approach speeds after two iterations, momentum lost by stopping, and rebounds without friction."""
        declared, sweeps = {}, TUNED_ITERATIONS if profile == "tuned" else ITERATIONS
        left = (1.0 - RELAXATION) ** sweeps
        if needs.regime == "impact" and needs.restitution == 0.0 and left > self.facts.epsilon:
            # Two steps of a ball: the first leaves a share of its overlap, which the second corrects.
            most = left * (1.0 - 2.0 * left)
            because = "the rest of an overlap is corrected in the next step"
            declared["restitution"] = Declared(0.5 * most, 0.5 * most + self.facts.round_off, because)
        # Each iteration stops slow bodies but still reports its impulse. Corrections fall with each iteration by the
        # corrected share of an overlap, for a box on four corners a seventh of the relaxation or more.
        stopped = STOPPED * min(sweeps, LEAST_SHARE / RELAXATION)
        because = "impulses of iterations that end below 0.1 mm/s are reported but not applied"
        band = stopped / (GRAVITY * dt) + self.facts.round_off
        declared["impulse"] = Declared(1.0, band, because)
        if needs.friction > 0.0 and needs.restitution > 0.0 and profile != "tuned":
            # A corner with an impact above 2 g dt rebounds, with an impulse of at most (1 + e) 3 g dt per mass.
            most = (1.0 + needs.restitution) * (LEAST_APPROACH + 1.0) * dt / SLIDE_TIME
            because = "rebounds of a rocking body have no friction"
            declared["friction"] = Declared(
                needs.friction * (1.0 - 0.5 * most), needs.friction * (0.5 * most + FRICTION_SHARE), because
            )
        return declared
