"""Columns of bodies at rest: bodies 1, 2, ... stand on each other, body 0 is the floor.

Truth, metrics and checks for a scene whose bodies start in equilibrium, each on the one before it: nothing moves, and
interface i carries the weight of the bodies from i upwards. Where several bodies stand side by side, an interface
consists of all contacts between two ``layers`` (indices of bodies, from the floor up): their shares of the load are not
determined, only the sum.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise, product

from adapters.scene import Box, Scene
from adapters.trajectory import Sampling, Trajectory
from validation import bounds, metrics
from validation.bounds import WINDOW
from validation.canonical import Check, Measured

#: Bodies side by side, by their indices; the first layer is the floor.
Layers = Sequence[Sequence[int]]


def exact(scene: Scene, layers: Layers = ()) -> dict[str, float]:
    """Equilibrium; loads are relative to the weight above."""
    truth = dict.fromkeys(("settle_time", "drift", "penetration", "kinetic_energy", "impulse_scatter"), 0.0)
    return truth | {f"interface_impulse[{i}]": 1.0 for i in range(1, len(layers or scene.bodies))}


def measure(scene: Scene, trajectory: Trajectory, layers: Layers = ()) -> dict[str, Measured]:
    """Everything from poses and impulses, the same routine for every engine."""
    layers = layers or [(i,) for i in range(len(scene.bodies))]
    neighbours = [list(product(below, above)) for below, above in pairwise(layers)]
    g = math.hypot(*scene.gravity)
    speed = metrics.body_speeds(scene, trajectory)
    late = trajectory.t > trajectory.t[-1] - WINDOW
    energy = metrics.kinetic_energy(scene, trajectory)
    measured: dict[str, Measured] = {
        "settle_time": metrics.last_motion(trajectory.t, speed.max(axis=1), bounds.STILL * g * trajectory.dt),
        "drift": (metrics.lateral_drift(trajectory), ""),
        "penetration": (
            metrics.deepest_overlap(scene, trajectory, [pair for pairs in neighbours for pair in pairs]),
            "",
        ),
        "kinetic_energy": (float(energy[late].mean()), ""),
    }
    scatter: list[float | None] = []
    for i, pairs in enumerate(neighbours, 1):
        above = sum(scene.bodies[k].mass for layer in layers[i:] for k in layer) * g * trajectory.dt
        mean, deviation = metrics.interface_load(trajectory, pairs, above, WINDOW)
        measured[f"interface_impulse[{i}]"] = mean
        scatter.append(deviation)
    known = [deviation for deviation in scatter if deviation is not None]
    none = (None, metrics.UNAVAILABLE)  # those of one interface are enough, as it may be the one that shakes
    measured["impulse_scatter"] = (metrics.largest(known), "") if known and len(known) == len(scatter) else none
    return measured


def checks(scene: Scene, dt: float, truth: dict[str, float]) -> list[Check]:
    """Positions add up along the column, overlaps do not: n g dt^2 of drift, g dt^2 of overlap however high it is."""
    loads = [name for name in truth if name.startswith("interface_impulse")]
    n, g, mass = len(loads), math.hypot(*scene.gravity), sum(body.mass for body in scene.bodies[1:])
    top = scene.bodies[-1].pose[scene.dimension - 1]  # heights are rounded relative to the column's
    allowed = {
        "settle_time": ("s", bounds.settled(n, dt, scene.duration)),
        "drift": ("m", bounds.slips(n, g, dt)),
        "penetration": ("m", bounds.found_late(g, dt, top)),
        "kinetic_energy": ("J", bounds.still_energy(mass, g, dt)),
        "impulse_scatter": ("1", bounds.steady()),
    }
    source = "static equilibrium"
    found = [bound.check(name, unit, truth[name], source) for name, (unit, bound) in allowed.items()]
    return found + [bounds.carried(dt).check(name, "1", truth[name], "weight above the interface") for name in loads]


def sampling(scene: Scene) -> Sampling:
    """Every step; contacts over the last second."""
    return Sampling(1, max(0.0, scene.duration - WINDOW))


#: A column stands while no body is off by half a side, overlaps by a tenth of one, or has the energy of a fall by one.
OFF, DEEP = 0.5, 0.1
STANDS = (
    "stood: at the end no body is half a side off its place or a tenth of a side inside another, and the kinetic "
    "energy of the last second is below that of a fall by a side"
)


def fate(scene: Scene, found: Mapping[str, Measured]) -> str:
    """``exploded``, ``toppled``, ``sank``; empty for a column that stood, however inexactly."""
    shape = scene.bodies[1].shape
    side = 2.0 * (shape.half_extents[-1] if isinstance(shape, Box) else math.nan)
    drift, overlap, energy = (found.get(name, (None, ""))[0] for name in ("drift", "penetration", "kinetic_energy"))
    fall = sum(body.mass for body in scene.bodies[1:]) * math.hypot(*scene.gravity) * side
    if energy is None or drift is None or overlap is None:
        return "NaN"
    if energy > fall:
        return "exploded"
    if drift > OFF * side:
        return "toppled"
    return "sank" if overlap > DEEP * side else ""


def displacement(found: Mapping[str, Measured], size: float) -> Measured:
    """Larger of the drift and the deepest overlap, in units of ``size`` [m]."""
    drift, penetration = found["drift"], found["penetration"]
    if drift[0] is None or penetration[0] is None:
        return None, drift[1] or penetration[1]
    return metrics.largest([drift[0], penetration[0]]) / size, ""
