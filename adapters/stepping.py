"""The only loop that steps an engine.

    build -> sample -> [ advance(stride) -> sample -> finite? ] ... -> readback -> close

Every engine is driven, sampled and stopped by these lines, so that a difference between two trajectories is a
difference between two engines. One that can tell many samples at once (`Simulation.record`) is asked for them at once,
and in the way above where one of them ends the run.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields
from typing import Any

import numpy as np

from adapters.drives import as_moving, asked_abilities, top_speed
from adapters.engine import Array, Contacts, Engine, EngineError, Recorded, Simulation
from adapters.lift import lift, lower_contacts, lower_pose, lower_twist, out_of_plane
from adapters.near import near_pairs
from adapters.scene import Body, Cylinder, Hull, Scene, Sphere
from adapters.shapes import reach
from adapters.trajectory import ContactRecord, Sampling, Trajectory

#: A body faster than this many times the fastest speed the scene can explain counts as exploded. Ten times would
#: still be a wrong answer worth measuring; a thousand times is none.
EXPLOSION_FACTOR = 1e3
#: A quaternion shorter than this is no turn: what is read from it (an angle of atan2(0, 0)) would be an angle of 0.
SHORTEST_TURN = 0.5


#: States that are read as the scene's own at once: enough that a read costs little, and little memory beside a run.
AT_ONCE = 1024
#: Samples that an engine is asked for in one call: each enters it seldom, and a run that explodes ends soon.
IN_ONE_CALL = 256
CONTACT_FIELDS = tuple(field.name for field in fields(Contacts))


class _Seen:
    """States of a run as the engine gives them, read as the scene's own once it is over: many at once cost little.

    Parameters
    ----------
    flat
        A planar scene that ran lifted.
    standing
        Bodies that move so that their surfaces run: they stay where the scene has them.
    dt
        Step of the run [s].
    """

    def __init__(self, scene: Scene, flat: bool, standing: Sequence[int], dt: float) -> None:
        self.scene, self.dt = scene, dt
        self.dimension, self.flat, self.standing = scene.dimension, flat, list(standing)
        #: Speed that needs a reason [m/s]: that of an overlap at the start is looked for where it is exceeded.
        self.limit, self.parted = EXPLOSION_FACTOR * _fastest(scene), False
        self.places = np.array([scene.bodies[i].pose for i in standing])
        self.poses: list[Array] = []
        self.twists: list[Array] = []
        self.read: list[tuple[Array, Array]] = []
        self.reach = np.array([reach(body.shape) for body in scene.bodies])
        self.outside, self.unturned = 0.0, False

    def look(self, simulation: Simulation) -> None:
        """Keep the state of this instant: copies, for what a simulation gives may be its own."""
        if len(self.poses) == AT_ONCE:
            self._read_all()
        self.poses.append(np.array(simulation.pose()))
        self.twists.append(np.array(simulation.twist()))

    def take(self, found: Recorded) -> bool:
        """Keep states that were recorded at once; False, and none of them is kept, if one of them may be none.

        The sums are those of `divergence`, over all states.
        """
        pose, twist = found.pose, found.twist
        if not (np.vdot(twist, twist) < 0.5 * self.limit * self.limit and math.isfinite(np.vdot(pose, pose))):
            return False
        self._read_all()
        self._read(pose, twist)
        return True

    def divergence(self) -> str:
        """Why the last state is none; empty if it is one.

        Sums of squares tell most states that are in order, in a tenth of the time: where they are finite, so is all
        that they are made of, and none of it is larger than their root.
        """
        pose, twist = self.poses[-1], self.twists[-1]
        if np.vdot(twist, twist) < 0.5 * self.limit * self.limit and math.isfinite(np.vdot(pose, pose)):
            return ""
        if not (np.isfinite(pose).all() and np.isfinite(twist).all()):  # across the plane of a lifted scene as well
            return "the state is not finite"
        _, (twist,) = self._lowered(pose[None], twist[None])
        fastest = float(np.abs(twist[:, : self.dimension]).max())
        if fastest > self.limit and not self.parted:
            self.parted = True
            self.limit += EXPLOSION_FACTOR * max(start_overlap(self.scene).values(), default=0.0) / self.dt
        if fastest <= self.limit:
            return ""
        return f"a body moves at {fastest:.3g} m/s, nothing in the scene explains it"

    def states(self) -> tuple[Array, Array, float | None]:
        """Poses and twists of all instants, and how far a lifted scene has left its plane [m]."""
        self._read_all()
        pose, twist = (np.concatenate(parts) for parts in zip(*self.read, strict=True))
        return pose, twist, self.outside if self.flat else None

    def _read_all(self) -> None:
        if self.poses:
            self._read(np.array(self.poses), np.array(self.twists))
        self.poses, self.twists = [], []

    def _read(self, pose: Array, twist: Array) -> None:
        if pose.shape[2] == 7 and (np.linalg.norm(pose[..., 3:], axis=2) < SHORTEST_TURN).any():
            self.unturned = True
        if self.flat:
            self.outside = max(self.outside, out_of_plane(pose, self.reach))
        self.read.append(self._lowered(pose, twist))

    def _lowered(self, pose: Array, twist: Array) -> tuple[Array, Array]:
        if self.flat:
            samples = pose.shape[:2]
            pose = lower_pose(pose.reshape(-1, 7)).reshape(*samples, 3)
            twist = lower_twist(twist.reshape(-1, 6)).reshape(*samples, 3)
        if self.standing:
            pose[:, self.standing] = self.places
            twist[:, self.standing] = 0.0
        return pose, twist


def posed_for(engine: Engine, scene: Scene) -> Scene:
    """Return the scene as ``engine`` gets it: itself, or lifted, or with half-spaces that move where surfaces run.

    Raises
    ------
    EngineError
        If the engine has no dimension for it (a spatial scene on a planar engine), or no ability for what it asks.
    """
    known = engine.facts.abilities
    if scene.dimension in engine.facts.dimensions:
        posed = scene
    elif scene.dimension == 2 and 3 in engine.facts.dimensions:
        posed = lift(scene)
    else:
        raise EngineError(f"dimension: {engine.name} is planar and cannot run a spatial scene")
    if "surface velocity" not in known and "moving half-space" in known:
        posed = as_moving(posed)
    for field, ability in asked_abilities(posed):
        if ability not in known:
            raise EngineError(f"{field}: {_lacking(engine, ability)}")
    return posed


def _lacking(engine: Engine, ability: str) -> str:
    """Why an adapter cannot honour what a scene asks."""
    if ability == "surface velocity" and "moving half-space" in engine.facts.abilities:
        return f"in {engine.name} only the surface of a fixed half-space runs"
    return f"the adapter of {engine.name} has no {ability}"


def step_count(duration: float, dt: float) -> int:
    """Whole steps that cover ``duration``; 1e-9 forgives the rounding of duration / dt."""
    return max(1, math.ceil(duration / dt - 1e-9))


def run(
    engine: Engine, scene: Scene, dt: float, settings: Mapping[str, Any], sampling: Sampling | None = None
) -> Trajectory:
    """Run ``scene`` on ``engine`` and record it.

    Parameters
    ----------
    dt
        Step [s], > 0.
    settings
        Setting values by name, as `Engine.settings` gives them.
    sampling
        Defaults to every step and no contacts.

    Raises
    ------
    EngineError
        If the engine refuses the scene, for a step that is not positive and finite, or for a pose that is none.
    """
    if not (math.isfinite(dt) and dt > 0.0):
        raise EngineError(f"dt: {dt!r} must be a positive, finite number of seconds")
    sampling = sampling or Sampling()
    posed = posed_for(engine, scene)
    started = time.perf_counter()
    # What an engine says of a run that diverged is of the instant at which it did: that run is made sample by sample.
    for in_one_call in (IN_ONE_CALL, 0):
        simulation = engine.build(posed, dt, settings)
        try:
            found = _record(simulation, scene, posed, dt, sampling, started, in_one_call)
        finally:
            simulation.close()
        if found is not None:
            return found
    raise AssertionError("a run that is made sample by sample ends in a trajectory")


def advances(simulation: Simulation, steps: int, stride: int = 1) -> Iterator[int]:
    """Advance by ``steps`` steps, ``stride`` at a time; yields the number made so far after each."""
    done = 0
    while done < steps:
        advance = min(stride, steps - done)
        simulation.advance(advance)
        done += advance
        yield done


def _record(
    simulation: Simulation, scene: Scene, posed: Scene, dt: float, sampling: Sampling, started: float, in_one_call: int
) -> Trajectory | None:
    """Step and sample; None where one of the samples that were asked for at once may be the last of the run."""
    flat = posed.dimension != scene.dimension
    pairs = enumerate(zip(scene.bodies, posed.bodies, strict=True))
    standing = [i for i, (asked, body) in pairs if asked.motion != body.motion]
    seen = _Seen(scene, flat, standing, dt)
    seen.look(simulation)
    steps, stride = step_count(scene.duration, dt), sampling.stride
    steps_at = [0]
    collected: list[tuple[range, Sequence[int], Contacts]] = []
    finish, reason = "completed", ""
    while in_one_call:
        samples, contacts = _alike(sampling, dt, steps_at[-1], min(in_one_call, (steps - steps_at[-1]) // stride))
        found = simulation.record(samples, stride, contacts) if samples else None
        if found is None:
            break
        if not seen.take(found):
            return None
        if found.contacts is not None:
            collected.append((range(len(steps_at), len(steps_at) + samples), found.counts.tolist(), found.contacts))
        steps_at += [steps_at[-1] + stride * (k + 1) for k in range(samples)]
    begun = steps_at[-1]
    for more in advances(simulation, steps - begun, stride):
        done = begun + more
        seen.look(simulation)
        steps_at.append(done)
        if _has_contacts(sampling, dt, done):
            told = _kept(simulation.contacts())
            collected.append((range(len(steps_at) - 1, len(steps_at)), [len(told.a)], told))
        reason = seen.divergence()
        if reason:
            finish, reason = "diverged", f"{reason} at t = {done * dt:.6g} s"
            break
    pose, twist, outside = seen.states()
    if seen.unturned and finish == "completed":
        raise EngineError("pose: a quaternion has no length, it is no orientation")
    return Trajectory(
        t=np.array(steps_at) * dt,
        pose=pose,
        twist=twist,
        contacts=_join(collected, posed.dimension, flat) if sampling.contacts_from is not None else None,
        dt=dt,
        finish="diverged" if finish == "diverged" else "completed",
        reason=reason,
        initial_change=tuple(simulation.initial_change),
        readback=simulation.readback(),
        certificate=simulation.certificate(),
        out_of_plane=outside,
        wall_time=time.perf_counter() - started,
    )


def _has_contacts(sampling: Sampling, dt: float, done: int) -> bool:
    """Whether the sample after ``done`` steps is recorded with its contacts."""
    return sampling.contacts_from is not None and done * dt > sampling.contacts_from - 0.5 * dt


def _alike(sampling: Sampling, dt: float, done: int, most: int) -> tuple[int, bool]:
    """How many of the samples that follow, ``most`` at most, all have their contacts recorded or not, and whether."""
    ends = range(done + sampling.stride, done + sampling.stride * (most + 1), sampling.stride)
    if not ends or _has_contacts(sampling, dt, ends[0]) or not _has_contacts(sampling, dt, ends[-1]):
        return most, bool(ends) and _has_contacts(sampling, dt, ends[0])
    return next(k for k, end in enumerate(ends) if _has_contacts(sampling, dt, end)), False


def _fastest(scene: Scene) -> float:
    """Largest speed of any point that the scene can explain [m/s]: initial motion plus what its loads can add."""
    d = scene.dimension
    initial = max(top_speed(b) + reach(b.shape) * math.hypot(*b.twist[d:]) for b in scene.bodies)
    pull = max((_pull(body) for body in scene.bodies if body.motion == "free"), default=0.0)
    return initial + (math.hypot(*scene.gravity) + pull) * scene.duration + 1e-9


def start_overlap(scene: Scene) -> dict[tuple[int, int], float]:
    """Overlap of each pair that starts in one, by body indices [m]; a step that undoes it makes it, over dt, a speed.

    Shapes that the certificate's geometry does not measure are taken as balls that hold them.
    """
    # Only here: who imports adapters imports no solver.
    from reference_solver.certification.geometry import gap

    shapes = [Sphere(reach(b.shape)) if isinstance(b.shape, Cylinder | Hull) else b.shape for b in scene.bodies]
    poses = [body.pose for body in scene.bodies]
    gaps = {(i, j): gap(shapes[i], poses[i], shapes[j], poses[j]) for i, j in near_pairs(scene, np.array([poses]))}
    return {pair: -float(found) for pair, found in gaps.items() if found < 0.0}


def _pull(body: Body) -> float:
    """Acceleration that a body's external force and torque give to its outermost point [m/s^2]."""
    moment = min(body.inertia) if isinstance(body.inertia, tuple) else body.inertia
    return math.hypot(*body.force) / body.mass + reach(body.shape) * math.hypot(*body.torque) / moment


def _kept(contacts: Contacts) -> Contacts:
    """Copies, for what a simulation gives may be its own."""
    return Contacts(*(np.array(getattr(contacts, name)) for name in CONTACT_FIELDS))


def _join(collected: list[tuple[range, Sequence[int], Contacts]], dimension: int, flat: bool) -> ContactRecord:
    """Contacts of all samples: which samples they are, how many each has, and they themselves, part by part."""
    offset = np.cumsum([0] + [count for _, counts, _ in collected for count in counts])
    empty = Contacts.from_rows([], dimension)
    parts = [empty] + [contacts for _, _, contacts in collected]
    rows = Contacts(*(np.concatenate([getattr(part, name) for part in parts]) for name in CONTACT_FIELDS))
    rows = lower_contacts(rows) if flat else rows
    samples = [sample for numbers, _, _ in collected for sample in numbers]
    return ContactRecord(np.array(samples, np.int64), offset.astype(np.int64), rows)
