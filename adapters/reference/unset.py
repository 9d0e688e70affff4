"""Our own solver without any settings; see `adapters.unset`."""

from __future__ import annotations

import math
from functools import partial

from adapters import unset
from adapters.unset import HALF_HEIGHT, HALF_WIDTH, RADIUS, Asked, Told, Unset


class Bare:
    """A planar model of one body above a half-space, with settings as constructed."""

    #: What its documentation steps with [s]: settings have no step of their own.
    dt = 1.0 / 240.0

    def __init__(self, asked: Asked) -> None:
        from reference_solver import Body, Box, Disc, HalfSpace, Model, Settings, Simulation

        shape = Disc(RADIUS) if asked.shape == "ball" else Box((HALF_WIDTH, HALF_HEIGHT))
        twist = (asked.along, asked.up, asked.spin)
        body = Body(shape, mass=1.0, inertia=0.1, pose=(0.0, asked.height, 0.0), twist=twist)
        ground = Body(HalfSpace((0.0, 1.0)), motion="fixed")
        # A model has no numbers of bodies: those of the pair must be stated.
        restitution, friction = (0.0 if each is None else each[0] for each in (asked.restitution, asked.friction))
        gravity = (0.0, -(asked.gravity or 0.0))
        model = Model(2, [ground, body], gravity=gravity, restitution=restitution, friction=friction)
        self._solver = Simulation(model, Settings(dt=self.dt))
        self._lowest = asked.height - asked.gap

    def advance(self, steps: int) -> None:
        """See `adapters.unset.World`."""
        self._solver.advance(steps)

    def told(self) -> Told:
        """See `adapters.unset.World`."""
        along, up, spin = (float(each) for each in self._solver.twist[1])
        return Told(float(self._solver.pose[1, 1]) - self._lowest, along, up, spin)


_MODEL, _SETTINGS, _NONE = "reference_solver/model.py", "reference_solver/settings.py", "docs/solver/step.md"
UNSET = (
    Unset("friction of a pair", "none: must be stated", _MODEL),
    Unset("friction of two bodies", "does not combine: pairs have it", _MODEL),
    Unset("restitution of a pair", "none: must be stated", _MODEL),
    Unset("no rebound below [m/s]", "no threshold", _NONE, 0.0, partial(unset.least_rebound, Bare)),
    Unset("linear damping [1/s]", "0", _NONE, 0.0, partial(unset.damping, Bare, "along"), 1e-9),
    Unset("angular damping [1/s]", "0", _NONE, 0.0, partial(unset.damping, Bare, "spin"), 1e-9),
    Unset("limit of speed [m/s]", "none", _NONE, math.inf, partial(unset.limit, Bare)),
    Unset("at 1 mm/s asleep after [s]", "never", _NONE, math.inf, partial(unset.sleep, Bare)),
    Unset("gap at rest [m]", "0", _NONE, 0.0, partial(unset.rest, Bare), 1e-9),
    Unset("left of 0.2 m of overlap [m]", "1e-4: slop", _SETTINGS, 1e-4, partial(unset.left, Bare), 1e-6),
    Unset("gravity, step", "none: must be stated", _SETTINGS),
)
