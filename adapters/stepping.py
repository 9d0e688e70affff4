"""The only loop that steps an engine.

    build -> sample -> [ advance(stride) -> sample -> finite? ] ... -> readback -> close

Every engine is stepped, sampled and stopped by this code, so a difference between two trajectories is a difference
between two engines. Engines that can return many samples at once (`Simulation.record`) do so, except where a sample
ends the run.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields
from typing import Any

import numpy as np

from adapters.engine import Array, Contacts, Engine, EngineError, Recorded, Simulation
from adapters.plain import kind_of
from adapters.scene import Body, HalfSpace, Scene
from adapters.scene.drives import as_moving, asked_abilities, top_speed
from adapters.scene.lift import lift, lower_contacts, lower_pose, lower_twist, out_of_plane
from adapters.scene.near import start_overlap
from adapters.scene.shapes import reach
from adapters.stages import BUILDING, READING, STEPPING, stage
from adapters.trajectory import ContactRecord, Sampling, Trajectory

#: A body faster than this many times the largest speed that the scene explains counts as exploded. Ten times would
#: still be a wrong result worth measuring; a thousand times is not.
EXPLOSION_FACTOR = 1e3
#: A shorter quaternion is no orientation: atan2(0, 0) would give an angle of 0.
SHORTEST_TURN = 0.5


#: Number of states converted at once: the overhead a state is small, and so is the memory.
AT_ONCE = 1024
#: Samples of one call of the engine: few calls, but a run that explodes ends soon.
IN_ONE_CALL = 256
CONTACT_FIELDS = tuple(field.name for field in fields(Contacts))


class _Seen:
    """States of a run as the engine returns them, converted to the scene's dimension at the end, many at once.

    Parameters
    ----------
    flat
        A 2-D scene that ran embedded in 3-D.
    standing
        Bodies that move to give their surfaces a velocity; in the scene they do not move.
    dt
        Step of the run [s].
    """

    def __init__(self, scene: Scene, flat: bool, standing: Sequence[int], dt: float) -> None:
        self.scene, self.dt = scene, dt
        self.dimension, self.flat, self.standing = scene.dimension, flat, list(standing)
        #: Speed that needs an explanation [m/s]; where it is exceeded, an overlap at the start is searched for.
        self.limit, self.parted = EXPLOSION_FACTOR * _fastest(scene), False
        self.places = np.array([scene.bodies[i].pose for i in standing])
        self.poses: list[Array] = []
        self.twists: list[Array] = []
        self.read: list[tuple[Array, Array]] = []
        self.shapes = [(len(scene.bodies), size) for size in ((7, 6) if flat or self.dimension == 3 else (3, 3))]
        self.reach = np.array([reach(body.shape) for body in scene.bodies])
        self.outside, self.unturned = 0.0, False

    @stage(READING)
    def look(self, simulation: Simulation) -> None:
        """Store copies of the current state."""
        if len(self.poses) == AT_ONCE:
            self._read_all()
        self.poses.append(_copied("pose", simulation.pose(), self.shapes[0]))
        self.twists.append(_copied("twist", simulation.twist(), self.shapes[1]))

    @stage(READING)
    def take(self, found: Recorded) -> bool:
        """Store states that were recorded at once; False, and nothing is stored, if one of them may be invalid."""
        pose, twist = found.pose, found.twist
        # No sums as in `divergence`: of long arrays they run on threads of their own, which wait longer than they sum.
        if not (np.abs(twist).max() < self.limit and np.isfinite(pose).all()):
            return False
        self._read_all()
        self._read(pose, twist)
        return True

    def divergence(self) -> str:
        """Why the last state is invalid; empty if it is valid.

        Sums of squares show most valid states in a tenth of the time: if a sum is finite, so are its terms, and none is
        larger than its root.
        """
        pose, twist = self.poses[-1], self.twists[-1]
        if np.vdot(twist, twist) < 0.5 * self.limit * self.limit and math.isfinite(np.vdot(pose, pose)):
            return ""
        if not (np.isfinite(pose).all() and np.isfinite(twist).all()):  # across the plane of an embedded scene as well
            return "the state is not finite"
        _, (twist,) = self._lowered(pose[None], twist[None])
        fastest = float(np.abs(twist[:, : self.dimension]).max())
        if fastest > self.limit and not self.parted:
            self.parted = True
            self.limit += EXPLOSION_FACTOR * max(start_overlap(self.scene).values(), default=0.0) / self.dt
        if fastest <= self.limit:
            return ""
        return f"a body moves at {fastest:.3g} m/s, which nothing in the scene explains"

    @stage(READING)
    def states(self) -> tuple[Array, Array, float | None]:
        """Poses and twists of all instants, and the distance of an embedded 2-D scene from its plane [m]."""
        self._read_all()
        pose, twist = (np.concatenate(parts) for parts in zip(*self.read, strict=True))
        return pose, twist, self.outside if self.flat else None

    def _read_all(self) -> None:
        if self.poses:
            self._read(np.array(self.poses), np.array(self.twists))
        self.poses, self.twists = [], []

    def _read(self, pose: Array, twist: Array) -> None:
        if (pose.shape[1:], twist.shape[1:]) != (self.shapes[0], self.shapes[1]):
            given = f"poses and twists of shapes {pose.shape[1:]} and {twist.shape[1:]}"
            raise EngineError(f"record: the engine gave {given}, {self.shapes[0]} and {self.shapes[1]} are needed")
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


def _copied(name: str, given: Any, shape: tuple[int, int]) -> Array:
    """Copy of a state, as a simulation may return its own arrays.

    Raises
    ------
    EngineError
        If it has another shape, or no numbers.
    """
    try:
        found = np.array(given)
    except ValueError:  # rows of different lengths
        found = np.array(None)
    if found.shape != shape or found.dtype.kind not in "fiu":
        said = f"an array of shape {found.shape}" if found.dtype.kind in "fiu" and found.ndim else kind_of(given)
        raise EngineError(f"{name}: the engine gave {said}, numbers of shape {shape} are needed")
    return found


def posed_for(engine: Engine, scene: Scene) -> Scene:
    """The scene for ``engine``: unchanged, embedded in 3-D, or with half-spaces that move for surface velocities.

    Raises
    ------
    EngineError
        If the engine does not support its dimension (a 3-D scene on a 2-D engine) or another feature.
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
    """Why an adapter does not support a scene."""
    if ability == "surface velocity" and "moving half-space" in engine.facts.abilities:
        return f"{engine.name} supports surface velocities of fixed half-spaces only"
    return f"the adapter of {engine.name} has no {ability}"


def step_count(duration: float, dt: float) -> int:
    """Number of steps that cover ``duration``; 1e-9 allows for the rounding of duration / dt."""
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
        If the engine refuses the scene, for a step that is not positive and finite, or for an invalid pose.
    """
    if not (math.isfinite(dt) and dt > 0.0):
        raise EngineError(f"dt: {dt!r} must be a positive, finite number of seconds")
    sampling = sampling or Sampling()
    posed = posed_for(engine, scene)
    started = time.perf_counter()
    # A run that diverges or fails is reported at that instant, so it is repeated sample by sample.
    for in_one_call in (IN_ONE_CALL, 0):
        with stage(BUILDING):
            simulation = engine.build(posed, dt, settings)
        if not hasattr(simulation, "advance"):
            raise EngineError(f"build: the engine gave {kind_of(simulation)}, a Simulation is needed")
        try:
            found = _record(simulation, scene, posed, dt, sampling, started, in_one_call)
        finally:
            simulation.close()
        if found is not None:
            return found
    raise AssertionError("a run that is made sample by sample ends in a trajectory")


def advances(simulation: Simulation, steps: int, stride: int = 1) -> Iterator[int]:
    """Advance by ``steps`` steps, ``stride`` at a time; yields the number of steps after each."""
    done = 0
    while done < steps:
        advance = min(stride, steps - done)
        simulation.advance(advance)
        done += advance
        yield done


@stage(STEPPING)
def _record(
    simulation: Simulation, scene: Scene, posed: Scene, dt: float, sampling: Sampling, started: float, in_one_call: int
) -> Trajectory | None:
    """Step and sample; None where one of the samples made at once may end the run."""
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
        try:
            found = simulation.record(samples, stride, contacts) if samples else None
        except Exception:  # perhaps after a state that ends the run
            return None
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
            with stage(READING):
                told = _kept(simulation.contacts(), posed)
            collected.append((range(len(steps_at) - 1, len(steps_at)), [len(told.a)], told))
        reason = seen.divergence()
        if reason:
            finish, reason = "diverged", f"{reason} at t = {done * dt:.6g} s"
            break
    pose, twist, outside = seen.states()
    if seen.unturned and finish == "completed":
        raise EngineError("pose: a quaternion of length 0 is not an orientation")
    return Trajectory(
        t=np.array(steps_at) * dt,
        pose=pose,
        twist=twist,
        contacts=_join(collected, posed.dimension, flat) if sampling.contacts_from is not None else None,
        dt=dt,
        finish="diverged" if finish == "diverged" else "completed",
        reason=reason,
        initial_change=_sentences(simulation.initial_change),
        readback=simulation.readback(),
        certificate=simulation.certificate(),
        out_of_plane=outside,
        wall_time=time.perf_counter() - started,
    )


def _has_contacts(sampling: Sampling, dt: float, done: int) -> bool:
    """Whether the sample after ``done`` steps is recorded with its contacts."""
    return sampling.contacts_from is not None and done * dt > sampling.contacts_from - 0.5 * dt


def _alike(sampling: Sampling, dt: float, done: int, most: int) -> tuple[int, bool]:
    """Number of next samples, at most ``most``, with the same contact recording, and whether contacts are recorded."""
    ends = range(done + sampling.stride, done + sampling.stride * (most + 1), sampling.stride)
    if not ends or _has_contacts(sampling, dt, ends[0]) or not _has_contacts(sampling, dt, ends[-1]):
        return most, bool(ends) and _has_contacts(sampling, dt, ends[0])
    return next(k for k, end in enumerate(ends) if _has_contacts(sampling, dt, end)), False


def _fastest(scene: Scene) -> float:
    """Largest speed of a point that the scene explains [m/s]: initial motion plus the effect of loads."""
    d = scene.dimension
    farthest = max(math.hypot(*b.pose[:d]) + reach(b.shape) for b in scene.bodies)  # where a rotating face is touched
    sizes = [farthest if isinstance(b.shape, HalfSpace) else reach(b.shape) for b in scene.bodies]
    initial = max(top_speed(b) + size * math.hypot(*b.twist[d:]) for b, size in zip(scene.bodies, sizes, strict=True))
    pull = max((_pull(body) for body in scene.bodies if body.motion == "free"), default=0.0)
    return initial + (math.hypot(*scene.gravity) + pull) * scene.duration + 1e-9


def _pull(body: Body) -> float:
    """Acceleration that a body's external force and torque give to its outermost point [m/s^2]."""
    moment = min(body.inertia) if isinstance(body.inertia, tuple) else body.inertia
    return math.hypot(*body.force) / body.mass + reach(body.shape) * math.hypot(*body.torque) / moment


def _sentences(given: Any) -> tuple[Any, ...]:
    if not isinstance(given, tuple | list):
        raise EngineError(f"initial_change: the engine gave {kind_of(given)}, a tuple of sentences is needed")
    return tuple(given)


def _kept(contacts: Contacts, scene: Scene) -> Contacts:
    """Copies, as a simulation may return its own arrays.

    Raises
    ------
    EngineError
        If they are no contacts of bodies of the scene.
    """
    if not isinstance(contacts, Contacts):
        raise EngineError(f"contacts: the engine gave {kind_of(contacts)}, Contacts are needed")
    found = Contacts(*(np.array(getattr(contacts, name)) for name in CONTACT_FIELDS))
    count, bodies = found.a.size, len(scene.bodies)
    for name in CONTACT_FIELDS:
        shape = (count, scene.dimension) if name in ("point", "normal", "impulse") else (count,)
        if getattr(found, name).shape != shape:
            given = getattr(found, name).shape
            raise EngineError(f"contacts.{name}: the engine gave an array of shape {given}, {shape} is needed")
    if count and not (min(found.a.min(), found.b.min()) >= 0 and max(found.a.max(), found.b.max()) < bodies):
        raise EngineError(f"contacts: the engine names bodies beyond the {bodies} of the scene")
    return found


@stage(READING)
def _join(collected: list[tuple[range, Sequence[int], Contacts]], dimension: int, flat: bool) -> ContactRecord:
    """Contacts of all samples: sample indices, counts and contacts, part by part."""
    offset = np.cumsum([0] + [count for _, counts, _ in collected for count in counts])
    empty = Contacts.from_rows([], dimension)
    parts = [empty] + [contacts for _, _, contacts in collected]
    rows = Contacts(*(np.concatenate([getattr(part, name) for part in parts]) for name in CONTACT_FIELDS))
    rows = lower_contacts(rows) if flat else rows
    samples = [sample for numbers, _, _ in collected for sample in numbers]
    return ContactRecord(np.array(samples, np.int64), offset.astype(np.int64), rows)
