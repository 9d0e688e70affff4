"""MuJoCo's ways to read contact forces; see `adapters.readings`.

After ``mj_step`` all of them are the forces that the step just made has used, at the places of its start.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from adapters.engine import Array
from adapters.mujoco.simulation import MujocoSimulation
from adapters.mujoco.spec import Spec
from adapters.readings import Ask, Cause, Read, Reading
from adapters.scene.shapes import reach

_STEP, _SOFT = "the step just made", "one force: what is pushed out of an overlap is in it, and in the velocity"


def _contacts(simulation: MujocoSimulation, body: int) -> Iterator[tuple[int, int, float]]:
    """Index of each contact of a body, the other body, and the sign of a force on the second geom."""
    contact = simulation._data.contact
    for k in range(simulation._data.ncon):
        first, second = (int(simulation._body_of_geom[geom]) for geom in contact.geom[k])
        if body in (first, second):
            yield k, first if body == second else second, 1.0 if body == second else -1.0


def _contact_force(simulation: MujocoSimulation) -> Ask:
    mujoco, model, data = simulation._mujoco, simulation._model, simulation._data

    def ask(body: int) -> list[Read]:
        force, found = np.zeros(6), []
        for k, other, sign in _contacts(simulation, body):
            mujoco.mj_contactForce(model, data, k, force)
            frame = data.contact.frame[k].reshape(3, 3)
            found.append(Read(other, sign * simulation._dt * (frame.T @ force[:3]), data.contact.pos[k].copy()))
        return found

    return ask


def _efc_force(simulation: MujocoSimulation) -> Ask:
    data = simulation._data

    def ask(body: int) -> list[Read]:
        found = []
        for k, other, sign in _contacts(simulation, body):
            first = int(data.contact.efc_address[k])
            normal = data.contact.frame[k][:3] * (float(data.efc_force[first]) if first >= 0 else 0.0)
            found.append(Read(other, sign * simulation._dt * normal, data.contact.pos[k].copy()))
        return found

    return ask


def _touch(simulation: MujocoSimulation) -> Ask:
    """A site around each body with a sensor; the world's model is made anew with them."""
    mujoco, scene = simulation._mujoco, simulation._scene
    spec = Spec(scene, simulation._dt, simulation._settings)
    rows: dict[int, int] = {}
    for body in simulation._moving:
        size = [2.0 * reach(scene.bodies[body].shape)] * 3
        spec.spec.body(f"body{body}").add_site(name=f"around{body}", size=size, type=mujoco.mjtGeom.mjGEOM_SPHERE)
        kinds = {"type": mujoco.mjtSensor.mjSENS_TOUCH, "objtype": mujoco.mjtObj.mjOBJ_SITE}
        spec.spec.add_sensor(name=f"touch{body}", objname=f"around{body}", **kinds)
        rows[body] = len(rows)
    simulation._model = spec.compile()
    simulation._data = mujoco.MjData(simulation._model)
    simulation._set_start()

    def ask(body: int) -> list[Read] | None:
        if body not in rows:
            return None
        return [Read(None, simulation._dt * simulation._data.sensordata[rows[body], None])]

    return ask


def _cfrc_ext(simulation: MujocoSimulation) -> Ask:
    mujoco, model, data = simulation._mujoco, simulation._model, simulation._data

    def ask(body: int) -> list[Read] | None:
        if body not in simulation._moving:
            return None
        mujoco.mj_rnePostConstraint(model, data)
        force: Array = data.cfrc_ext[model.body(f"body{body}").id, 3:]
        return [Read(None, simulation._dt * force)]

    return ask


_STOPS = Cause(
    ("rest", "grip"), "the solver stops at its tolerance, 1e-8, before forces and accelerations agree",
    {"tolerance": 0.0}, "default",
)  # fmt: skip
_PYRAMID = Cause(
    ("rest", "slope", "sliding", "blow", "grip"), "with pyramidal cones, the default, a row is an edge of the pyramid",
    {"cone": "elliptic", "tolerance": 0.0}, "default",
)  # fmt: skip
_LOADED = Cause(("grip",), "the load on the pad, xfrc_applied, is in it")
READINGS = (
    Reading(
        "mj_contactForce(model, data, i, force)", "force", "one contact i of data.contact",
        "on the body of contact.geom[1], from that of geom[0]", "axes of contact.frame, whose first row is the normal",
        _STEP, _SOFT, _contact_force, causes=(_STOPS,),
    ),
    Reading(
        "data.efc_force[contact.efc_address]", "force", "the first row of a contact's constraint",
        "on the body of contact.geom[1]", "along the normal, with elliptic cones or without friction",
        _STEP, _SOFT, _efc_force, "normal",
        hint="efc_address is -1 where a contact has no force: skip it, or the last row is read.", causes=(_PYRAMID,),
    ),
    Reading(
        "touch sensor", "force", "all contacts of a body inside the sensor's site", "on the site's body",
        "a number: the sum of sizes of normal forces", _STEP, _SOFT, _touch, "size", causes=(_STOPS,),
    ),
    Reading(
        "data.cfrc_ext[body]", "force", "all contacts of a body, and what was applied to it", "on the body",
        "world axes: torque, then force", _STEP, _SOFT, _cfrc_ext,
        hint="It reads 0 until mj_rnePostConstraint is called, or a sensor needs it.", causes=(_STOPS, _LOADED),
    ),
)  # fmt: skip
