"""The toy of the conformance kit with two profiles, in the plane as well: what it is asked, and worlds that keep it."""

import math
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from adapters.conformance import scenes
from adapters.conformance.faults import FAULTS, FaultyToy
from adapters.conformance.parameters import STEPS
from adapters.conformance.toy import ToyEngine
from adapters.engine import EngineError, Setting, Simulation
from adapters.needs import Needs
from adapters.scene import Box, Scene
from adapters.scene.lift import lift, lower_contacts, lower_pose, lower_twist

#: Sweeps of each profile: they tell at `build` which of the two it is for. Few: no check hangs on how far they come.
SWEEPS = {"first": 3, "second": 4}


class Heard(Simulation):
    """A world that keeps how many steps it made and whether it was closed; one in space shows as one in the plane."""

    def __init__(self, inner, profile, scene, dt):
        self.inner, self.flat, self.initial_change = inner, scene.dimension == 2, inner.initial_change
        self.profile, self.scene, self.dt, self.steps, self.closed = profile, scene, dt, 0, 0

    def advance(self, steps):
        assert not self.closed
        self.steps += steps
        self.inner.advance(steps)

    def pose(self):
        return lower_pose(self.inner.pose()) if self.flat else self.inner.pose()

    def twist(self):
        return lower_twist(self.inner.twist()) if self.flat else self.inner.twist()

    def contacts(self):
        return lower_contacts(self.inner.contacts()) if self.flat else self.inner.contacts()

    def record(self, samples, stride, contacts):
        told = self.inner.record(samples, stride, contacts)
        if told is None:
            return None
        self.steps += samples * stride
        if not self.flat:
            return told
        pose = np.array([lower_pose(each) for each in told.pose])
        twist = np.array([lower_twist(each) for each in told.twist])
        return replace(told, pose=pose, twist=twist, contacts=told.contacts and lower_contacts(told.contacts))

    def readback(self):
        held = self.inner.readback()
        if not self.flat or not held:
            return held
        x, _, y = held["gravity"]
        bodies = {name: {**own, "inertia": own["inertia"][1]} for name, own in held["bodies"].items()}
        return {**held, "gravity": [x, y], "bodies": bodies}

    def close(self):
        self.closed += 1


class Listening(ToyEngine):
    """Two profiles, in the plane and in space; it takes nothing but what the contract has it asked, and keeps that.

    The fault of that name is the profile's ``at`` alone, and of what is built for neither of the two.
    """

    facts = replace(ToyEngine.facts, dimensions=frozenset({2, 3}))

    def __init__(self, fault="", size=math.nan, at="second"):
        self.spoilt = FaultyToy(fault, size) if fault else ToyEngine()
        self.fault = FAULTS[fault] if fault else None
        self.at, self.asked, self.built = at, set(), []
        self.profiles = MappingProxyType({name: self._rule(name) for name in SWEEPS})

    def _rule(self, profile):
        def rule(needs, dt):
            assert isinstance(needs, Needs) and dt > 0.0
            given = [Setting("iterations", SWEEPS[profile], "which profile it is")]
            return self.fault.settings(given) if self._wrong(profile) and self.fault.settings else given

        return rule

    def _wrong(self, profile):
        return self.fault is not None and profile in (self.at, "")

    def refuses(self, scene, profile):
        assert isinstance(scene, Scene) and profile in (*self.profiles, "")
        self.asked.add(profile)
        said = super().refuses(scene if scene.dimension == 3 else lift(scene), profile)
        return self.fault.refuses(scene, said) if self._wrong(profile) and self.fault.refuses else said

    def declares(self, profile, needs, dt):
        assert profile in self.profiles and isinstance(needs, Needs) and dt in (scenes.DT, *STEPS)
        return {}

    def scheme(self, profile):
        assert profile in self.profiles
        return super().scheme(profile)

    def build(self, scene, dt, settings):
        assert isinstance(scene, Scene)
        profile = next((name for name, count in SWEEPS.items() if settings.get("iterations") == count), "")
        if (said := self.refuses(scene, profile)) and not (self.fault and self.fault.refuses):
            raise EngineError(said)
        maker = self.spoilt if self._wrong(profile) else ToyEngine()
        world = maker.build(scene if scene.dimension == 3 else lift(scene), dt, settings)
        self.built.append(Heard(world, profile, scene, dt))
        return self.built[-1]

    def worlds(self, profile):
        """Scene -> the steps that each of its worlds made, for one profile."""
        made = {}
        for world in self.built:
            if world.profile == profile:
                made.setdefault(label(world.scene), []).append(world.steps)
        return made


class Discs(Listening):
    """It takes no boxes."""

    def refuses(self, scene, profile):
        boxes = any(isinstance(body.shape, Box) for body in scene.bodies)
        return super().refuses(scene, profile) or ("shape: balls only" if boxes else None)


class Dull(Listening):
    """It takes no rebound."""

    def refuses(self, scene, profile):
        rebounds = any(restitution > 0.0 for restitution, _ in scene.materials())
        return super().refuses(scene, profile) or ("pairs: no restitution" if rebounds else None)


def label(scene):
    """What tells the kit's scenes apart: name, who stands first, restitution, whether there is a box, dimension."""
    bouncy = "" if all(pair.restitution == 0.0 for pair in scene.pairs) else " e"
    boxes = " box" if any(isinstance(body.shape, Box) for body in scene.bodies) else ""
    return f"{scene.name.removeprefix('check_')} {scene.bodies[0].name}{bouncy}{boxes} {scene.dimension}"
