"""One MotrixSim world and its readings; its model is MuJoCo's, as `adapters.mujoco.spec` writes it.

A step detects contacts at its start, then come velocities, then positions: contacts and gaps are one step older than
the poses, and forces times the step are the impulses of the last step.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from importlib import import_module
from itertools import starmap
from typing import Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from adapters.copied import Copied, by_pair
from adapters.engine import Array, Contacts, EngineError
from adapters.isolation.quiet import quiet
from adapters.mujoco.profiles import SHIPPED
from adapters.mujoco.releases import Mjcf
from adapters.mujoco.spec import Spec, has_joint, rotation, start
from adapters.plain import one_line
from adapters.readback import free_parts
from adapters.scene import Scene
from adapters.scene.drives import velocity_over

#: Options of MJCF that MotrixSim reads; it warns of others.
OPTIONS = frozenset({"timestep", "gravity"})
#: What a contact tells, in the engine's order, in numbers: force in axes of the contact, gap, point, normal, tangent.
TOLD = ("force", "dist", "pos", "normal", "tangent")
WIDTH = 13
#: Points of a pair that fit.
MOST_POINTS = 8


@cache
def imported() -> Any:
    """Import the engine without its line about a profiler, and with one thread, as cells run side by side."""
    with quiet():
        module = import_module("motrixsim")
        module.init_thread_pool(1)
    return module


def model_text(scene: Scene, dt: float, settings: Mapping[str, Any]) -> str:
    """MJCF of a scene, with the options that MotrixSim reads."""
    import mujoco

    asked = {each.name: each.value for each in SHIPPED} | {
        name: settings[name] for name in ("solref", "solimp", "margin")
    }
    written = Mjcf(mujoco)
    Spec(scene, dt, asked, written)
    root = ElementTree.fromstring(written.text())
    option = root.find("option")
    assert option is not None
    kept = {name: value for name, value in option.attrib.items() if name in OPTIONS}
    option.clear()
    option.attrib.update(kept)
    return ElementTree.tostring(root, encoding="unicode")


class MotrixSimulation(Copied):
    """One world; free and prescribed bodies are its links, in the scene's order."""

    def __init__(self, scene: Scene, dt: float, settings: Mapping[str, Any]) -> None:
        engine = imported()
        self.scene, self.dt, self.settings = scene, dt, settings
        self.pairs = [(i, j) for i, j, _ in scene.contact_pairs()]
        self.names = list(starmap("{}-{}".format, self.pairs))
        try:
            self.model: Any = self._world(engine).build()
        except (RuntimeError, ValueError) as error:
            raise EngineError(f"scene: MotrixSim does not build it: {one_line(error)}") from None
        self.data: Any = engine.SceneData(self.model)
        self.moving = [i for i, body in enumerate(scene.bodies) if has_joint(body)]
        _, velocity = start(scene, dt)
        self.data.set_dof_vel(np.array(velocity, np.float32))
        links = {i: self.model.get_link(f"body{i}") for i in self.moving}
        self.links = [links.get(i) for i in range(len(scene.bodies))]
        self.loads = [
            (links[i], np.array(body.force, np.float32), np.array(body.torque, np.float32))
            for i, body in enumerate(scene.bodies)
            if body.is_loaded
        ]
        self.driven = [
            (6 * row, scene.bodies[i]) for row, i in enumerate(self.moving) if scene.bodies[i].course is not None
        ]
        self.poses = np.array([body.pose for body in scene.bodies], float)
        self.steps = 0

    def _world(self, engine: Any) -> Any:
        """The model before it is built: contacts, solver, and what tells contacts."""
        msd, settings = engine.msd, self.settings
        world = msd.from_str(model_text(self.scene, self.dt, settings))
        option = world.simulate_option
        option.solver_type = getattr(msd.SolverType, settings["solver"])
        option.constraint_solver_iterations = settings["iterations"]
        option.constraint_solver_tolerance = settings["tolerance"]
        if settings["erp"] is not None:
            hard = msd.ConstraintForceModel.hard
            said = {(i, j): pair.restitution for i, j, pair in self.scene.contact_pairs()}
            stated = world.contact_pairs.pairs
            for pair in stated:
                i, j = map(int, pair.name.removeprefix("pair").split("-"))
                pair.contact_model = hard(said[i, j], settings["erp"])
            if not stated and said:  # one material
                option.override_contact_force = msd.ForceOverride.hard(next(iter(said.values())), settings["erp"])
        world.sensors.contact = [self._sensor(msd, *pair) for pair in self.pairs]
        return world

    def _sensor(self, msd: Any, i: int, j: int) -> Any:
        made = msd.ContactSensor()
        made.name, made.max_num = f"{i}-{j}", MOST_POINTS
        made.match_ = msd.ContactMatch.geom_pair(f"geom{i}", f"geom{j}")
        for name in ("found", *TOLD):
            setattr(made.report, name, True)
        return made

    def advance(self, steps: int) -> None:
        """See `Simulation.advance`; loads act for one step."""
        for _ in range(steps):
            if self.loads:  # turned into body axes with the links' poses, which are one step old without this
                self.model.forward_kinematic(self.data)
            for link, force, torque in self.loads:
                link.add_external_force(self.data, force, local=False)
                link.add_external_torque(self.data, torque, local=False)
            if self.driven:
                velocity = self.data.dof_vel.copy()
                for row, body in self.driven:
                    velocity[row : row + 3] = velocity_over(body, self.dt, self.steps)
                self.data.set_dof_vel(velocity)
            self.model.step(self.data)
            self.steps += 1

    def copy_pose(self) -> Array:
        """Positions and quaternions (x, y, z, w) of links."""
        return np.array(self.data.dof_pos, float)

    def poses_of(self, copies: Sequence[Array]) -> Array:
        """See `Copied.poses_of`."""
        told = np.array(copies).reshape(len(copies), -1, 7)
        found = np.tile(self.poses, (len(copies), 1, 1))
        found[:, self.moving] = told[..., [0, 1, 2, 6, 3, 4, 5]]
        return found

    def copy_twist(self) -> tuple[Array, Array]:
        """Poses and velocities of links."""
        return self.copy_pose(), np.array(self.data.dof_vel, float)

    def twists_of(self, copies: Sequence[tuple[Array, Array]]) -> Array:
        """See `Copied.twists_of`; the engine keeps angular velocity in body axes."""
        told = np.array([velocity for _, velocity in copies]).reshape(len(copies), -1, 6)
        turns = self.poses_of([pose for pose, _ in copies])[:, self.moving, 3:]
        turn = rotation(turns.reshape(-1, 4)).reshape(*turns.shape[:2], 3, 3)
        x, y, z = (turn[..., axis] * told[..., [3 + axis]] for axis in range(3))
        found = np.zeros((len(copies), len(self.poses), 6))
        found[:, self.moving] = np.concatenate([told[..., :3], x + y + z], axis=2)
        return found

    def copy_contacts(self) -> tuple[NDArray[np.int64], Array]:
        """Indices of the pairs that touch, and what each tells: how many points, and their numbers.

        Raises
        ------
        EngineError
            If a pair has more points than fit.
        """
        if not self.names:
            return np.zeros(0, np.int64), np.zeros((0, 1 + WIDTH * MOST_POINTS))
        told = np.array(self.model.get_sensor_values(self.names, self.data)).reshape(len(self.names), -1)
        touching = np.flatnonzero(told[:, 0])
        if touching.size and told[:, 0].max() > MOST_POINTS:
            raise EngineError(f"memory: a pair has {told[:, 0].max():g} points, more than {MOST_POINTS}")
        return touching, told[touching]

    def contacts_of(self, copies: Sequence[tuple[NDArray[np.int64], Array]]) -> tuple[NDArray[np.int64], Contacts]:
        """See `Copied.contacts_of`; contacts of the last step's start, with its impulses."""
        told = np.concatenate([rows for _, rows in copies]).astype(float)
        points = told[:, 0].astype(np.int64)
        sizes = [
            int(points_of.sum()) for points_of in np.split(points, np.cumsum([len(rows) for _, rows in copies])[:-1])
        ]
        pairs = np.array(self.pairs).reshape(-1, 2)[np.concatenate([which for which, _ in copies])]
        there = np.arange(MOST_POINTS) < points[:, None]
        each = told[:, 1:].reshape(-1, MOST_POINTS, WIDTH)[there]
        force, gap, point, normal, tangent = np.split(each, (3, 4, 7, 10), axis=1)
        along = force[:, :1] * normal + force[:, 1:2] * tangent + force[:, 2:] * np.cross(normal, tangent)
        rows = np.column_stack([np.repeat(pairs, points, axis=0), point, normal, self.dt * along, gap])
        counts = np.array(sizes, np.int64)
        return counts, by_pair(counts, rows)

    def readback(self) -> dict[str, Any]:
        """Values that the engine holds."""
        option = self.model.options
        values: dict[str, Any] = {
            "dt": float(option.timestep),
            "gravity": np.ravel(option.gravity).tolist(),
            "iterations": int(option.max_iterations),
            "tolerance": float(option.solver_tolerance),
        }
        for name, link in free_parts(self.scene, self.links):
            values[f"{name}.size"] = np.ravel(link.geoms[0].size).tolist()
            values[f"{name}.mass"] = float(link.mass)
            values[f"{name}.inertia"] = np.ravel(link.get_inertia_override(self.data)).tolist()
        return values
