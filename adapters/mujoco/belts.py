"""MuJoCo's laws of a box that slides to a stop, for a box on a belt."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from adapters.law import Law, Measure, Prediction
from adapters.mujoco.predictions import stopping_law
from adapters.scene import HalfSpace, Scene
from adapters.trajectory import Measured, Trajectory

#: Metrics of a box on a belt, and their names for a box that slides to a stop.
SEEN_AS = {"slipped": "stopping_distance", "pull": "braking"}


def on_a_belt(profile: str, metric: str) -> Law:
    """The law of a slide to a stop in the belt's frame, as friction depends on the velocity relative to the surface."""
    inner = stopping_law(profile, SEEN_AS.get(metric, metric))

    def law(scene: Scene, dt: float, measure: Measure) -> Prediction | None:
        seen = _from_the_belt(scene)
        if seen is None:
            return None
        run = np.array(scene.bodies[0].surface_velocity)

        def told(_: Scene, trajectory: Trajectory) -> dict[str, Measured]:
            found = measure(scene, _in_the_room(trajectory, run))
            return found | {old: found[new] for new, old in SEEN_AS.items() if new in found}

        return inner(seen, dt, told)

    return law


def _from_the_belt(scene: Scene) -> Scene | None:
    """The scene in the frame of the belt, the first body; None if that is not a half-space at rest."""
    belt = scene.bodies[0]
    if not any(belt.surface_velocity) or not isinstance(belt.shape, HalfSpace) or belt.motion != "fixed":
        return None
    run = belt.surface_velocity
    others = tuple(
        replace(body, twist=(*(v - u for v, u in zip(body.twist, run, strict=False)), *body.twist[len(run) :]))
        for body in scene.bodies[1:]
    )
    return replace(scene, bodies=(replace(belt, surface_velocity=()), *others))


def _in_the_room(trajectory: Trajectory, run: np.ndarray) -> Trajectory:
    pose, twist = trajectory.pose.copy(), trajectory.twist.copy()
    pose[:, 1:, : len(run)] += np.outer(trajectory.t, run)[:, None]
    twist[:, 1:, : len(run)] += run
    return replace(trajectory, pose=pose, twist=twist)
