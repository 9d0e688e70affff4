"""Adapter of `toyphysics`, as somebody else's package would bring it; installed by the fixture `toy_releases`."""

import math
import os
import time
from typing import ClassVar

import numpy as np

from adapters.engine import Contacts, Engine, EngineError, EngineFacts, Scheme, Setting, Simulation
from adapters.scene import Disc, HalfSpace


def default(needs, dt):
    return [Setting("iterations", 1, "one contact needs one")]


class ToyEngine(Engine):
    facts = EngineFacts("toy", "Toy physics", "toyphysics", frozenset({2}), Scheme("velocity, position", 1), 1 / 60)
    profiles: ClassVar = {"default": default}

    def version(self):
        import toyphysics

        return toyphysics.__version__

    def refuses(self, scene, profile):
        kinds = [type(body.shape) for body in scene.bodies]
        floors = [body.shape for body in scene.bodies if isinstance(body.shape, HalfSpace)]
        if set(kinds) - {Disc, HalfSpace} or len(floors) > 1 or (kinds.count(Disc) > 1 and any(scene.gravity)):
            return "bodies: the toy knows discs that do not meet, and one floor"
        if floors and tuple(floors[0].normal) != (0.0, 1.0):
            return "floor: the toy knows a level one"
        return "pairs: the toy has no friction" if any(pair.friction for _, _, pair in scene.contact_pairs()) else None

    def declares(self, profile, needs, dt):
        return {}

    def build(self, scene, dt, settings):
        if not (math.isfinite(dt) and dt > 0):
            raise EngineError(f"dt: {dt!r} must be a positive, finite number of seconds")
        refusal = self.refuses(scene, "default")
        if refusal:
            raise EngineError(refusal)
        return ToySimulation(scene, dt)


class ToySimulation(Simulation):
    def __init__(self, scene, dt):
        import toyphysics

        self.scene, self.dt = scene, dt
        floor = next((body.shape for body in scene.bodies if isinstance(body.shape, HalfSpace)), None)
        bounce = max((pair.restitution for _, _, pair in scene.contact_pairs()), default=0.0)
        self.discs = {
            index: toyphysics.Disc(
                disc.pose, disc.twist, disc.mass, disc.inertia, disc.shape.radius,
                None if floor is None else floor.offset, bounce, scene.gravity, (*disc.force, *disc.torque),
            )
            for index, disc in enumerate(scene.bodies) if isinstance(disc.shape, Disc)
        }  # fmt: skip

    def advance(self, steps):
        time.sleep(float(os.environ.get("TOY_SLEEP", "0")))  # for tests of what becomes of a cell that takes long
        for _ in range(steps):
            for disc in self.discs.values():
                disc.step(self.dt)

    def pose(self):
        poses = np.array([body.pose for body in self.scene.bodies], float)
        for index, disc in self.discs.items():
            poses[index] = disc.pose
        return poses

    def twist(self):
        twists = np.zeros((len(self.scene.bodies), 3))
        for index, disc in self.discs.items():
            twists[index] = disc.twist
        return twists

    def contacts(self):
        floor = next((i for i, body in enumerate(self.scene.bodies) if isinstance(body.shape, HalfSpace)), None)
        rows = [
            (floor, index, (disc.pose[0], disc.pose[1] - disc.radius), (0.0, 1.0), (0.0, disc.impulse), 0.0)
            for index, disc in self.discs.items() if disc.impulse
        ]  # fmt: skip
        return Contacts.from_rows(rows, 2)

    def readback(self):
        return {"dt": self.dt, "radii": [disc.radius for disc in self.discs.values()]}
