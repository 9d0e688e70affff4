"""MotrixSim's ways to read contact forces; see `adapters.readings`."""

from __future__ import annotations

import numpy as np

from adapters.mujoco.motrixsim.simulation import MotrixSimulation
from adapters.readings import Ask, Read, Reading, acting_on


def _sensors(simulation: MotrixSimulation) -> Ask:
    def ask(body: int) -> list[Read]:
        told = simulation.contacts()
        return acting_on(body, zip(told.a.tolist(), told.b.tolist(), told.impulse, told.point, strict=True))

    return ask


def _net(simulation: MotrixSimulation) -> Ask:
    simulation.model.reports.contact_forces = True

    def ask(body: int) -> list[Read] | None:
        link = simulation.links[body]
        if link is None:
            return None
        force = simulation.model.get_link_net_contact_forces(simulation.data, [link.index])
        return [Read(None, simulation.dt * np.ravel(force)[:3].astype(float))]

    return ask


_OVER, _WITH = "the step just made", "with it: a spring's force is what pushes overlaps out"
READINGS = (
    Reading(
        "model.get_sensor_values(): force, normal and tangent of an msd.ContactSensor", "force",
        "each point of a pair", "on the second geom of the pair", "along normal, tangent and their cross product",
        _OVER, _WITH, _sensors,
    ),
    Reading(
        "model.get_link_net_contact_forces(data)", "force", "all points of a link", "on the link", "world axes",
        _OVER, _WITH, _net, hint="model.reports.contact_forces = True before a step.",
    ),
)  # fmt: skip
