"""Checks without a closed form, for any scene: contacts add no energy, bodies do not overlap.

Both are measured against the motion itself, and bounded by what one step of the scene's loads can do:

    energy      grows by no more than the error of the scheme in a conserved energy, at the speed of that sample
    overlap     is no deeper than one step of the pair's own approach: a contact is found at most one step late

so that neither a long nor a fast run widens a bound. A body that sinks slowly is noticed after two steps of fall.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from adapters.engine import Array
from adapters.scene import Body, HalfSpace, Scene
from adapters.scene.drives import turns
from adapters.scene.shapes import ROUND, reach
from adapters.trajectory import Trajectory
from validation import metrics
from validation.bounds import ROUND_OFF
from validation.canonical import Check, Measured

#: A pair rests at this share of the speed of a fall of one step: at 1/240 s it is pushed out by 1 mm in 25 s.
RESTS = 1e-3
#: Metrics that are judged even if the lawful motion is not unique.
LAWS = ("energy_growth", "penetration", "deepest_overlap")


def checks(scene: Scene, dt: float) -> list[Check]:
    """Both checks; energy is shown without a truth where a prescribed body or the impact law may add it."""
    energy = Check(
        "energy_growth",
        "J",
        0.0,
        energy_bound(scene, dt),
        "velocity and position are half a step apart, which changes a conserved energy by half a step of the loads' "
        "work (subtracted at the speed of each sample), and the energy that separates bodies overlapping at the "
        "start is subtracted; what remains is the work of a load in the step in which it starts, F^2 dt^2/m, and "
        "round-off",
        "contacts do not add energy (e <= 1)",
    )
    depth = Check(
        "penetration",
        "m",
        0.0,
        overlap_bound(scene, dt),
        "a contact is found at most one step late: beyond one step of the pair's approach (subtracted) only the "
        "motion by loads in that step, (a_1 + a_2) dt^2, and round-off",
        "bodies are impenetrable",
    )
    why = fed_by(scene)
    return [replace(energy, truth=None, bound=None, because=f"shown: {why}") if why else energy, depth]


def fed_by(scene: Scene) -> str:
    """What may add energy to a scene although every e <= 1; empty if nothing.

    Newton's law of restitution relates normal speeds only. Where the normal misses a centre of mass, friction of the
    same impact turns the body, and energy can grow [T. R. Kane, D. A. Levinson, *Dynamics: Theory and Applications*,
    1985, on a rod that hits the floor]. The normals of round bodies pass through their centres.
    """
    if any(body.motion == "prescribed" for body in scene.bodies):
        return "a prescribed body may add energy"
    if any(any(body.surface_velocity) for body in scene.bodies):
        return "a surface with a velocity may add energy"
    boxes = [body.motion == "free" and not isinstance(body.shape, ROUND) for body in scene.bodies]
    if not any(boxes) or not any(e > 0.0 and mu > 0.0 for e, mu in scene.materials()):
        return ""  # without a loop over all pairs
    for i, j, material in scene.contact_pairs():
        if (boxes[i] or boxes[j]) and material.restitution > 0.0 and material.friction > 0.0:
            return (
                "Newton's restitution with friction can add energy where a box is hit off its centre (Kane's paradox)"
            )
    return ""


# ---- energy --------------------------------------------------------------------------------------------------------


def _load(scene: Scene, body: Body) -> Array:
    """Constant load on a body, m g + F, (d,) [N]; infinite where a scene file's numbers overflow."""
    return np.array([body.mass * pull + push for pull, push in zip(scene.gravity, body.force, strict=True)])


def _least_moment(body: Body) -> float:
    return min(body.inertia) if isinstance(body.inertia, tuple) else body.inertia


def mechanical_energy(scene: Scene, trajectory: Trajectory) -> Array:
    """Kinetic plus potential energy in gravity and constant loads, (s,) [J].

    Work of constant torques is integrated by the trapezoid rule, exact for a constant acceleration.
    """
    energy = metrics.kinetic_energy(scene, trajectory)
    d = scene.dimension
    for i in metrics.free_bodies(scene):
        body = scene.bodies[i]
        energy = energy - (trajectory.pose[:, i, :d] - trajectory.pose[0, i, :d]) @ _load(scene, body)
        if any(body.torque):
            power = trajectory.twist[:, i, d:] @ np.array(body.torque)
            steps = np.diff(trajectory.t) * 0.5 * (power[1:] + power[:-1])
            energy = energy - np.concatenate([[0.0], np.cumsum(steps)])
    return energy


#: Depth of the overlap of pairs of bodies at each sample, (s,) [m].
Overlaps = Mapping[tuple[int, int], Array]


def energy_growth(scene: Scene, trajectory: Trajectory, overlaps: Overlaps = MappingProxyType({})) -> Measured:
    """Largest growth of the mechanical energy since the start, less half a step of the loads' power [J].

    Semi-implicit steps conserve the energy with potentials half a step of the present velocity away, a mid-point step
    the usual one: samples differ by at most ``|L . v| dt/2``, now and at the start. Round-off of the energies is
    subtracted too, sample by sample.

    An overlap d at the start may be corrected: against the load with the work ``|L| d``, and in one step with the speed
    d/dt. Both are allowed to each body of a pair of ``overlaps``.
    """
    d = scene.dimension
    energy = mechanical_energy(scene, trajectory)
    ripple = ROUND_OFF * metrics.kinetic_energy(scene, trajectory) + _parting(scene, trajectory, overlaps)
    for i in metrics.free_bodies(scene):
        body = scene.bodies[i]
        power = np.abs(trajectory.twist[:, i, :d] @ _load(scene, body))
        power = power + np.abs(trajectory.twist[:, i, d:] @ np.array(body.torque))
        path = np.linalg.norm(trajectory.pose[:, i, :d] - trajectory.pose[0, i, :d], axis=1)
        ripple += 0.5 * trajectory.dt * (power + power[0])
        ripple += ROUND_OFF * math.hypot(*_load(scene, body)) * path
    # Python's max would skip NaN, and energies that overflow would count as no growth.
    return float(np.maximum(0.0, energy - energy[0] - ripple).max()), ""


def _parting(scene: Scene, trajectory: Trajectory, overlaps: Overlaps) -> float:
    """Allowed energy of bodies that overlap at the start: lifted out, and moved at overlap/dt [J]."""
    gain = 0.0
    for pair, depth in overlaps.items():
        for body in (scene.bodies[k] for k in pair):
            if body.motion == "free":
                lift = math.hypot(*_load(scene, body)) * depth[0]
                gain += float(lift + 0.5 * body.mass * (depth[0] / trajectory.dt) ** 2)
    return gain


def energy_bound(scene: Scene, dt: float) -> float:
    """Work of every load in its first step, and round-off of the energies [J]."""
    free = [body for body in scene.bodies if body.motion == "free"]
    bound, scale = 0.0, 0.0
    for body in free:
        load, torque = math.hypot(*_load(scene, body)), math.hypot(*body.torque)
        speed, spin = math.hypot(*body.twist[: scene.dimension]), math.hypot(*body.twist[scene.dimension :])
        moment = body.inertia if isinstance(body.inertia, float | int) else max(body.inertia)
        bound += (load * load / body.mass + torque * torque / _least_moment(body)) * dt * dt
        # Energies that are subtracted: at the start, and rounding by the distance from the origin.
        place = math.hypot(*body.pose[: scene.dimension])
        scale += 0.5 * body.mass * speed * speed + 0.5 * moment * spin * spin + load * place
        # A body at rest without load has a size with round-off, which a step turns into a speed.
        scale += 0.5 * body.mass * ROUND_OFF * (reach(body.shape) / dt) ** 2
    return bound + ROUND_OFF * scale


# ---- overlap -------------------------------------------------------------------------------------------------------


def deepest(scene: Scene, trajectory: Trajectory, overlaps: Overlaps | None = None) -> tuple[Measured, Measured]:
    """Deepest overlap beyond one step of the pair's approach, and deepest overlap of all, each >= 0 [m].

    ``overlaps`` are measured here if not given.
    """
    beyond, depth, fall = 0.0, 0.0, overlap_bound(scene, trajectory.dt)
    for (i, j), overlap in (metrics.overlaps(scene, trajectory) if overlaps is None else overlaps).items():
        depth = metrics.largest([depth, overlap.max()])
        granted = _granted(overlap, trajectory.dt * approach(scene, trajectory, i, j), fall)
        beyond = metrics.largest([beyond, (overlap - granted).max()])
    return (beyond, ""), (depth, "")


def _granted(overlap: Array, step: Array, fall: float) -> Array:
    """Allowed depth of each sample of an overlap, (s,) [m]: the longest step since the sample before it began.

    An overlap at the start is allowed. What an approach allows ends when the pair rests: when it closes or parts by no
    more than the share `RESTS` of the loads' ``fall`` in a step, a dt^2, for n steps in which they would have moved it
    by the depth, n^2 a dt^2/2. A blow turns round in fewer steps, as its force is far above the loads.
    """
    granted = np.zeros(len(overlap))
    longest = start = 0.0
    still = 0
    for k in range(len(overlap)):
        still = still + 1 if step[k] <= RESTS * fall else 0
        if overlap[k] <= 0.0:
            longest, start, still = float(step[k]), 0.0, 0
            continue
        if k == 0:
            start = float(overlap[0])
        rests = still > 0 and still * still * fall >= 2.0 * overlap[k]
        longest = float(step[k]) if rests else max(longest, float(step[k]))
        granted[k] = start + longest
    return granted


def approach(scene: Scene, trajectory: Trajectory, i: int, j: int) -> Array:
    """Upper bound of the speed with which two bodies' surfaces may close, (s,) [m/s]: centres and spin.

    For a half-space only motion along its normal counts, and rotation out to the reach of the other body. Round bodies
    rotate within their outline.
    """
    d = scene.dimension
    linear = trajectory.twist[:, j, :d] - trajectory.twist[:, i, :d]
    faces = [b.shape for b in (scene.bodies[i], scene.bodies[j]) if isinstance(b.shape, HalfSpace)]
    is_still = faces and not any(turns(scene.bodies[k]) for k in (i, j))
    speed = np.abs(linear @ np.array(faces[0].normal)) if is_still else np.linalg.norm(linear, axis=1)
    for k, other in ((i, j), (j, i)):
        shape = scene.bodies[k].shape
        if turns(scene.bodies[k]):
            away = np.linalg.norm(trajectory.pose[:, other, :d] - trajectory.pose[:, k, :d], axis=1)
            spin = np.linalg.norm(trajectory.twist[:, k, d:], axis=1)
            speed = speed + (away + reach(scene.bodies[other].shape)) * spin
        if not isinstance(shape, (*ROUND, HalfSpace)):
            speed = speed + reach(shape) * np.linalg.norm(trajectory.twist[:, k, d:], axis=1)
    return np.asarray(speed)


def overlap_bound(scene: Scene, dt: float) -> float:
    """Overlap by the loads of the two bodies with the largest accelerations in one step, and round-off [m]."""
    pulls = []
    for body in scene.bodies:
        if body.motion == "free":
            load, torque = math.hypot(*_load(scene, body)), math.hypot(*body.torque)
            turning = 0.0 if isinstance(body.shape, ROUND) else reach(body.shape) / _least_moment(body)
            pulls.append(load / body.mass + torque * turning)
    place = max(math.hypot(*body.pose[: scene.dimension]) + reach(body.shape) for body in scene.bodies)
    # Points of a rotating face accelerate towards its centre, so a step of constant velocity misses that.
    pulls += [math.hypot(*body.twist[scene.dimension :]) ** 2 * place for body in scene.bodies if turns(body)]
    return sum(sorted(pulls)[-2:]) * dt * dt + ROUND_OFF * place
