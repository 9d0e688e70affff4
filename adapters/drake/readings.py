"""Drake's ways to read contact forces; see `adapters.readings`."""

from __future__ import annotations

import numpy as np

from adapters.drake.simulation import DrakeSimulation
from adapters.readings import Ask, Cause, Read, Reading, Told, acting_on

_STEP = "the step just made, for a plant of discrete steps"
_SOFT = "one force: what is pushed out of an overlap is in it, and in the velocity"


def _contact_results(simulation: DrakeSimulation) -> Ask:
    def ask(body: int) -> list[Read]:
        plant, owner, dt = simulation.plant, simulation.owner, simulation.dt
        results = plant.get_contact_results_output_port().Eval(simulation.context)
        told: list[Told] = []
        for k in range(results.num_point_pair_contacts()):
            info = results.point_pair_contact_info(k)
            pair = info.point_pair()
            force, place = dt * np.array(info.contact_force()), np.array(info.contact_point())
            told.append((owner[pair.id_A], owner[pair.id_B], force, place))
        for k in range(results.num_hydroelastic_contacts()):
            surface = results.hydroelastic_contact_info(k)
            force = -dt * np.array(surface.F_Ac_W().translational())
            both = surface.contact_surface()
            told.append((owner[both.id_M()], owner[both.id_N()], force, None))
        return acting_on(body, told)

    return ask


def _generalized(simulation: DrakeSimulation) -> Ask:
    plant = simulation.plant

    def ask(body: int) -> list[Read] | None:
        if simulation.scene.bodies[body].motion != "free":
            return None
        port = plant.get_generalized_contact_forces_output_port(simulation.bodies[body].model_instance())
        first = simulation.bodies[body].floating_velocities_start_in_v()
        told = np.array(port.Eval(simulation.context))[first + 3 : first + 6]
        return [Read(None, simulation.dt * told)]

    return ask


_COARSE = Cause(("blow",), "not explained: with TAMSI one step of a blow is off by a fifty-thousandth", profile="tamsi")
READINGS = (
    Reading(
        "contact results: point_pair_contact_info(k).contact_force(), hydroelastic_contact_info(k).F_Ac_W()", "force",
        "each pair of points, or each surface", "contact_force: on body B; F_Ac_W: on the body of id_M", "world axes",
        _STEP, _SOFT, _contact_results, causes=(_COARSE,),
    ),
    Reading(
        "plant.get_generalized_contact_forces_output_port(model)", "force", "all contacts of a free body",
        "on the body", "world axes: torque, then force, at floating_velocities_start_in_v",
        _STEP, _SOFT, _generalized, causes=(_COARSE,),
    ),
)  # fmt: skip
