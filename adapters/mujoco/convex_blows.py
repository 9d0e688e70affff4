"""MuJoCo's convex problem of a blow where contacts share it, or where friction does: solved here as it is documented.

    f = argmin 1/2 f (A + R) f - f aref,  f in its cones;      v <- v + dt M^-1 J^T f,   x <- x + dt v

A is what impulses at the contacts do to the velocities there, ``R = (1 - d)/d D`` of each contact, D the sum of the two
bodies' translational inverse masses, ``aref = -b u`` of the closing velocity u, b the damping over d. A contact stands
half-way into the overlap in which a step finds it, which is where a rod's arm is taken.

    balls that meet without friction, many at once     f >= 0
    a rod that lands on an edge, with friction         |f_t| <= mu f_n: a cone that a slip leaves by lifting

The same rod under Newton's and Coulomb's laws is what profile ``matched`` makes of it: at the place where a step finds
the end, half-way into the overlap, its arm is shorter by that.

Source: MuJoCo documentation, "Computation: constraint model" and "Modeling: solver parameters". Nothing here runs it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from adapters.law import Law, Measure, Prediction
from adapters.mujoco.blows import edge_of, moment_of
from adapters.mujoco.predictions import GAP_ROUND_OFF, PERTURBATIONS, SPREAD_FACTOR, SUM_ROUND_OFF, settings_of
from adapters.scene import Box, Disc, HalfSpace, Scene, Sphere
from adapters.stepping import step_count
from adapters.trajectory import Trajectory

Array = NDArray[np.float64]
#: Sweeps over the contacts of a step until nothing changes by more than round-off; more contacts than these are not
#: followed.
SWEEPS, MOST_CONTACTS = 20_000, 60
#: Contacts of a box that lands on an edge.
CORNERS_OF_AN_EDGE = 2


def convex_blow_law(profile: str, metric: str) -> Law:
    """What the documented problem makes of ``metric``, in planar scenes without gravity or load."""

    def law(scene: Scene, dt: float, measure: Measure) -> Prediction | None:
        chosen = settings_of(profile, scene, dt)
        # Reflecting contacts without stiffness: elsewhere a blow takes several steps and depends on the depth.
        reflects = chosen["solref"] == "reflect" and not chosen["kappa_elastic"] and not chosen["kappa_plastic"]
        if scene.dimension != 2 or any(scene.gravity) or not reflects or chosen["margin"] or chosen["tolerance"]:
            return None
        d = float(chosen["solimp"][0])
        sticks = chosen["solreffriction"] == "stick" and chosen["impratio"] == 1.0

        def motion(moved: float) -> Trajectory | None:
            balls = _balls(scene, dt, d, moved)
            return _rod(scene, dt, moved, partial(_yielding, d=d)) if balls is None and sticks else balls

        return _told_alike(scene, metric, measure, motion)

    return law


def matched_blow_law(profile: str, metric: str) -> Law:
    """What Newton's and Coulomb's laws make of ``metric`` at the place where the engine finds a rod's end."""

    def law(scene: Scene, dt: float, measure: Measure) -> Prediction | None:
        if scene.dimension != 2 or any(scene.gravity):
            return None
        return _told_alike(scene, metric, measure, lambda moved: _rod(scene, dt, moved, _rigid))

    return law


def _told_alike(
    scene: Scene, metric: str, measure: Measure, motion: Callable[[float], Trajectory | None]
) -> Prediction | None:
    """Value of a motion, and a band from starts that are moved by round-off."""
    found = []
    for moved in (0.0, *(k * GAP_ROUND_OFF for k in PERTURBATIONS)):
        path = motion(moved)
        value = None if path is None else measure(scene, path)[metric][0]
        if value is None:
            return None
        found.append(value)
    value, *others = found
    speed = max(float(np.linalg.norm(body.twist[:2])) for body in scene.bodies)
    spread = SPREAD_FACTOR * max(abs(other - value) for other in others)
    return value, spread + SUM_ROUND_OFF * max(1.0, speed)


def _balls(scene: Scene, dt: float, d: float, moved: float) -> Trajectory | None:
    """Smooth balls in free space, ``moved`` [m] further apart along x one by one; None for anything else."""
    free = all(isinstance(body.shape, Disc | Sphere) and body.motion == "free" for body in scene.bodies)
    pairs = [scene.material(scene.bodies[i].name, scene.bodies[j].name) for i, j, _ in scene.contact_pairs()]
    if not free or not pairs or any(pair.friction > 0.0 for pair in pairs):
        return None
    radius = np.array([body.shape.radius for body in scene.bodies if isinstance(body.shape, Disc | Sphere)])
    lightness = np.array([1.0 / body.mass for body in scene.bodies])
    x = np.array([body.pose[:2] for body in scene.bodies])
    x[:, 0] += moved * np.arange(len(x))
    v = np.array([body.twist[:2] for body in scene.bodies])
    poses, speeds = [x], [v]
    for _ in range(step_count(scene.duration, dt)):
        touching = []
        for i, j in combinations(range(len(x)), 2):
            between = x[j] - x[i]
            far = float(np.linalg.norm(between))
            if far < radius[i] + radius[j]:
                e = scene.material(scene.bodies[i].name, scene.bodies[j].name).restitution
                touching.append((i, j, between / far, e))
        if len(touching) > MOST_CONTACTS:
            return None
        if touching:
            parted = _parted(v, lightness, touching, d)
            if parted is None:
                return None
            v = parted
        x = x + dt * v
        poses.append(x)
        speeds.append(v)
    pose, twist = (np.pad(np.array(part), ((0, 0), (0, 0), (0, 1))) for part in (poses, speeds))
    return _told(dt, pose, twist)


def _parted(v: Array, lightness: Array, touching: list[tuple[int, int, Array, float]], d: float) -> Array | None:
    """Velocities after a step in which these contacts are solved together; ``f >= 0`` by projected sweeps.

    None where `SWEEPS` of them do not come to rest: what is not solved predicts nothing.
    """
    rows = np.zeros((len(touching), *v.shape))
    for row, (i, j, normal, _) in zip(rows, touching, strict=True):
        row[i], row[j] = -normal, normal
    flat = rows.reshape(len(touching), -1)
    given = (rows * lightness[:, None]).reshape(len(touching), -1)
    soft = np.array([(1.0 - d) / d * (lightness[i] + lightness[j]) for i, j, _, _ in touching])
    whole = flat @ given.T + np.diag(soft)
    aim = -(1.0 + np.array([e for *_, e in touching])) * (flat @ v.ravel()) / d
    f = np.zeros(len(touching))
    for _ in range(SWEEPS):
        before = f.copy()
        for k in range(len(f)):
            f[k] = max(0.0, f[k] - (whole[k] @ f - aim[k]) / whole[k, k])
        # A row adds as many products as there are contacts, each rounded: the last of them may go to and fro for ever.
        if np.abs(f - before).max() <= len(f) * np.finfo(float).eps * np.abs(f).max():
            return np.asarray(v + (given.T @ f).reshape(v.shape))
    return None


#: ``blow(mobility, closing, restitution, friction)``: impulse on a rod's end over its mass, normal and tangent [m/s],
#: of an end with this mobility over the mass (2, 2) that closes with this velocity (2,) [m/s]; None without one answer.
Blow = Callable[[Array, Array, float, float], Array | None]


def _rod(scene: Scene, dt: float, moved: float, blow: Blow) -> Trajectory | None:
    """A box that lands on an edge, ``moved`` [m] higher up, without turning before; None for anything else."""
    if len(scene.bodies) != 2:
        return None
    floor, rod = scene.bodies
    level = HalfSpace((0.0, 1.0), 0.0)
    if floor.shape != level or floor.motion != "fixed" or not isinstance(rod.shape, Box) or not rod.pose[2]:
        return None
    material = scene.material(floor.name, rod.name)
    along, down, spin = rod.twist
    arm, below = edge_of(rod)
    gap = rod.pose[1] - below + moved
    if spin or down >= 0.0 or material.friction == 0.0:
        return None
    struck = math.ceil(gap / (-down * dt))  # the first step that begins in the overlap
    depth = -down * dt * struck - gap
    if min(depth, -down * dt - depth) <= 100.0 * GAP_ROUND_OFF:
        return None  # round-off decides which step it is
    lever = below - 0.5 * depth
    share = rod.mass / moment_of(rod)
    mobility = np.array([[1.0 + arm * arm * share, arm * lever * share], [arm * lever * share, 1.0 + lever**2 * share]])
    struck_with = blow(mobility, np.array([down, along]), material.restitution, material.friction)
    if struck_with is None:
        return None
    normal, tangent = struck_with
    after = np.array([along + tangent, down + normal, (arm * normal + lever * tangent) * share])
    steps = step_count(scene.duration, dt)
    late = (np.arange(steps + 1) > struck)[:, None]
    speeds = np.where(late, after, np.array(rod.twist))
    poses = np.array(rod.pose) + np.vstack([np.zeros(3), np.cumsum(speeds[1:], axis=0) * dt])
    pose, twist = (np.stack([np.zeros_like(part), part], axis=1) for part in (poses, speeds))
    return _told(dt, pose, twist)


def _yielding(mobility: Array, closing: Array, e: float, friction: float, d: float) -> Array:
    """Impulse of contacts of impedance ``d`` that ask for reflection and for no slip, in one convex problem."""
    whole = mobility + (1.0 - d) / d / CORNERS_OF_AN_EDGE * np.eye(2)
    return _in_cone(whole, -np.array([(1.0 + e) * closing[0], closing[1]]) / d, friction)


def _rigid(mobility: Array, closing: Array, e: float, friction: float) -> Array | None:
    """Impulse by Newton's and Coulomb's laws: it sticks, or slips to a side; None where they have not one answer."""
    normal, tangent = closing
    found = []
    sticking = np.linalg.solve(mobility, [-(1.0 + e) * normal, -tangent])
    if abs(sticking[1]) <= friction * sticking[0]:
        found.append(sticking)
    for way in (1.0, -1.0):
        ease = mobility[0] @ (1.0, -way * friction)
        slipping = -(1.0 + e) * normal / ease * np.array([1.0, -way * friction]) if ease > 0.0 else np.zeros(2)
        if slipping[0] > 0.0 and way * (tangent + mobility[1] @ slipping) > 0.0:
            found.append(slipping)
    return found[0] if len(found) == 1 else None


def _in_cone(whole: Array, aim: Array, friction: float) -> Array:
    """Least of ``f W f/2 - f aim`` with ``|f_t| <= mu f_n``: inside, or on one of the cone's two sides."""
    inside = np.linalg.solve(whole, aim)
    if abs(inside[1]) <= friction * inside[0]:
        return np.asarray(inside)
    sides = [np.array([1.0, way * friction]) for way in (1.0, -1.0)]
    on_them = [max(0.0, float(side @ aim) / float(side @ whole @ side)) * side for side in sides]
    return min(on_them, key=lambda f: float(0.5 * f @ whole @ f - f @ aim))


def _told(dt: float, pose: Array, twist: Array) -> Trajectory:
    """A motion, every step."""
    return Trajectory(np.arange(len(pose), dtype=np.float64) * dt, pose, twist, None, dt, "completed")
