"""What the small steps make of a leaning box that lands on one corner, as a law: its motion step by step.

As in `ball_on_plane`, but the corner is held at an arm of its own, so that what stops it turns it and moves it along
the floor; one sweep in each small step does not see both. The rebound comes last and knows no friction: it turns the
box more and drives the end along the floor, where the law that the scene states has both at once.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from adapters.box2d3.ball_on_plane import Chosen
from adapters.box2d3.shipped import SEEN_AHEAD
from adapters.ground import reach
from adapters.law import Law, Measure, Prediction
from adapters.scene import Box, HalfSpace, Scene
from adapters.single_motions import lowest
from adapters.single_precision import ROUNDINGS, UNIT
from adapters.stepping import step_count
from adapters.trajectory import Trajectory


def corner_on_plane_law(metric: str, chosen: Chosen) -> Law:
    """A leaning free box above the level floor, without gravity, load or spin; nothing is said of an overlap."""

    def law(scene: Scene, dt: float, measure: Measure) -> Prediction | None:
        if not _is_told(scene):
            return None
        share = ROUNDINGS * UNIT
        found = []
        # A point is told in the axes of the ground's polygon, in singles as coarse as that is large: turned, shifted
        # there and back, and halved.
        place = 4.0 * UNIT * reach(scene)
        for higher, faster, moved in (
            (0.0, 0.0, (0.0, 0.0)),
            (share, 0.0, (0.0, 0.0)),
            (-share, 0.0, (0.0, 0.0)),
            (0.0, share, (0.0, 0.0)),
            (0.0, 0.0, (place, 0.0)),
            (0.0, 0.0, (0.0, place)),
        ):
            motion = _Corner(scene, dt, chosen(scene, dt), higher, faster, moved).moved()
            value = None if motion is None else measure(scene, motion)[metric][0]
            if value is None:
                return None
            found.append(value)
        value, *others = found
        return value, sum(abs(other - value) for other in others) + share * (1.0 + abs(value))

    return law


def _is_told(scene: Scene) -> bool:
    if len(scene.bodies) != 2 or scene.dimension != 2 or any(scene.gravity):
        return False
    floor, box = scene.bodies
    if not isinstance(box.shape, Box) or box.motion != "free" or any((*box.force, *box.torque)):
        return False
    tilted = abs(math.remainder(box.pose[2], 0.5 * math.pi)) > 1e-3
    return floor.shape == HalfSpace((0.0, 1.0), 0.0) and tilted and box.twist[2] == 0.0


class _Corner:
    """Place and velocity of the box, and what its one contact holds."""

    def __init__(
        self,
        scene: Scene,
        dt: float,
        settings: Mapping[str, Any],
        higher: float,
        faster: float,
        moved: tuple[float, float],
    ) -> None:
        floor, box = scene.bodies
        assert isinstance(box.inertia, float | int)
        self.scene, self.dt, self.settings, self.h = scene, dt, settings, dt / settings["substeps"]
        material = scene.material(floor.name, box.name)
        self.e, self.mu, self.m, self.inertia = material.restitution, material.friction, box.mass, float(box.inertia)
        across, below = lowest(box)
        self.across, self.below = across + moved[0], below + moved[1]
        self.x, self.y, self.turn = box.pose[0], box.pose[1] + higher * below, box.pose[2]
        self.u, self.v, self.w = (speed * (1.0 + faster) for speed in box.twist)
        self.normal = self.friction = 0.0
        self.pushed = False

    def moved(self) -> Trajectory | None:
        """The motion at every step; None where the corner overlaps or comes again."""
        rows, struck = [self._row()], False
        for _ in range(step_count(self.scene.duration, self.dt)):
            if not struck:
                if not self._step():
                    return None
                struck = self.pushed
            else:
                for _ in range(self.settings["substeps"]):
                    self._drift()
            rows.append(self._row())
        t = np.arange(len(rows), dtype=np.float64) * self.dt
        pose = np.broadcast_to(np.array([body.pose for body in self.scene.bodies]), (len(t), 2, 3)).copy()
        twist = np.zeros((len(t), 2, 3))
        told = np.array(rows)
        pose[:, 1], twist[:, 1] = told[:, :3], told[:, 3:]
        return Trajectory(t, pose, twist, None, self.dt, "completed")

    def _row(self) -> tuple[float, ...]:
        return self.x, self.y, self.turn, self.u, self.v, self.w

    def _step(self) -> bool:
        """One step until the blow is over; False for an overlap, which a spring would push."""
        gap, height, turned = self.y - self.below, self.y, self.turn
        if gap >= SEEN_AHEAD / self.settings["units_per_metre"]:
            for _ in range(self.settings["substeps"]):
                self._drift()
            return True
        # Held in the middle of the gap; arms stay as they are for the step.
        arm = self.across, self.below + 0.5 * gap
        before = self._normal_speed(arm)

        def left() -> float:
            off = self.turn - turned
            lifted = arm[0] * math.sin(off) + arm[1] * (1.0 - math.cos(off))
            return gap + self.y - height + lifted

        for _ in range(self.settings["substeps"]):
            self._give(self.friction, self.normal, arm)
            self._solve(left(), arm)
            self._drift()
            self._solve(left(), arm)
        if self.pushed and before <= -self.settings["restitution_threshold"]:
            self._push(-(self._normal_speed(arm) + self.e * before), arm)
        return True

    def _drift(self) -> None:
        self.x += self.u * self.h
        self.y += self.v * self.h
        self.turn += self.w * self.h

    def _normal_speed(self, arm: tuple[float, float]) -> float:
        return self.v + self.w * arm[0]

    def _give(self, along: float, up: float, arm: tuple[float, float]) -> None:
        self.u += along / self.m
        self.v += up / self.m
        self.w += (arm[0] * up + arm[1] * along) / self.inertia

    def _solve(self, gap: float, arm: tuple[float, float]) -> None:
        self._push(-(self._normal_speed(arm) + max(gap, 0.0) / self.h), arm)
        lightness, most = 1.0 / self.m + arm[1] ** 2 / self.inertia, self.mu * self.normal
        wanted = min(max(self.friction - (self.u + self.w * arm[1]) / lightness, -most), most)
        self._give(wanted - self.friction, 0.0, arm)
        self.friction = wanted

    def _push(self, speed: float, arm: tuple[float, float]) -> None:
        impulse = max(speed / (1.0 / self.m + arm[0] ** 2 / self.inertia), -self.normal)
        self.normal += impulse
        self.pushed = self.pushed or self.normal > 0.0
        self._give(0.0, impulse, arm)
