"""Whether a port of an engine moves bodies as the engine does: the same scenes, steps and settings in both.

    engine                 ----o----o----o----
    engine, start moved    ----o---o-----o---o    what round-off of the port's precision may do in this scene
    port                   ----o----o--------x    differs: by more than that

A step of the port rounds a state by `ROUNDED`. The engine runs again from starts moved by as much, in `MOVES`
directions; what they change is multiplied by `SHARE`, for roundings of later steps. Growth of another move cannot be
scaled: where bodies touch at a distance of exactly 0, one of 1e-12 already removes a contact for a step, and changes
the motion by g dt^2 as one of 1e-6 does.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from adapters import registry
from adapters.engine import Array, Engine, EngineError, Precision
from adapters.isolation.foreign import checked_refusal
from adapters.law.single_precision import ROUNDINGS, UNIT
from adapters.plain import one_line
from adapters.scene import Scene
from adapters.scene.drives import top_speed
from adapters.scene.shapes import reach
from adapters.settings import text_of
from adapters.stepping import posed_for, run
from adapters.trajectory import Trajectory
from validation.cells import Slot, prepare, settings_of, slot_from_dict
from validation.running.apart import Apart

#: Round-off of a step, as a share of places and speeds. In doubles it is that of a force at the largest impedance, d =
#: 0.9999, of which a difference of accelerations is divided by 1 - d: 2^-53/1e-4.
ROUNDED: Mapping[Precision, float] = {"single": ROUNDINGS * UNIT, "double": 1e-12}
#: Moved starts, and the share of what they change that round-off may change.
MOVES, SHARE = 3, 4.0
#: Two runs are no longer the same motion beyond this share of the room that bodies take, and of their largest distance
#: from the origin.
LOST = 0.05
#: Longest wait for one comparison [s]: a port may compile each scene.
PATIENCE = 600.0


@dataclass(frozen=True)
class Compared:
    """One scene on an engine and on its port.

    Parameters
    ----------
    port
        Name of the port.
    verdict
        ``same``, ``differs``, ``lost`` (in round-off, at the first step), ``unsupported`` (by one of
        both) or ``failed``.
    until
        Time until which the motion can be compared [s]: round-off may then have changed it by `LOST`.
    end
        Duration [s].
    apart
        Largest distance of the farthest point of a body in one run from the same point in the other, until then [m].
    body, since
        That body, and the time at which the distance first exceeds round-off [s].
    growth
        Factor by which a moved start has grown until then: the distance over the size of the move.
    because
        Why there is no comparison, or how the port ended.
    proof
        Settings of both with which the motions are the same: to the end, or beyond the time at which they differ, with
        a fourth (`SHARE`) of the distance at most.
    """

    slot: Slot
    port: str
    verdict: str
    until: float = math.nan
    end: float = math.nan
    apart: float = math.nan
    body: str = ""
    since: float = math.nan
    growth: float = math.nan
    because: str = ""
    proof: str = ""

    @property
    def whole(self) -> bool:
        """Whether the motions are the same to the end."""
        return self.verdict == "same" and self.until == self.end

    def as_dict(self) -> dict[str, Any]:
        """Plain data that `compared_from` reads back; what is not known is null."""
        told = {**asdict(self), "slot": self.slot.as_dict()}
        return {k: None if isinstance(v, float) and math.isnan(v) else v for k, v in told.items()}


def compared_from(data: Mapping[str, Any]) -> Compared:
    """Inverse of `Compared.as_dict`."""
    told: dict[str, Any] = {k: math.nan if v is None else v for k, v in data.items()}
    texts = {name: one_line(told[name]) for name in ("port", "verdict", "body", "because", "proof")}
    return Compared(**{**told, **texts, "slot": slot_from_dict(data["slot"])})


def compared(slots: Sequence[Slot], ports: Sequence[str]) -> Iterator[Compared]:
    """Compare each case of an engine with each of its ports, one after the other, in a process of its own."""
    for port in ports:
        with Apart(PATIENCE) as apart:
            for slot in slots:
                yield explained(slot, port, apart.ask)


def explained(slot: Slot, port: str, answer: Callable[..., Compared | str]) -> Compared:
    """Compare one case; where it differs, find settings with which it does not.

    ``answer(ask, ...)`` is the result of ``ask(...)``, or why there is none.
    """
    found, ported = answer(ask, slot, port, {}), registry.adapter(port)
    if not isinstance(found, Compared):
        return Compared(slot, port, "failed", because=found)
    if found.verdict in ("failed", "unsupported") or found.whole or ported is None:
        return found
    told = {each.name: each.value for each in settings_of(ported, slot, prepare(slot).scene)}
    for switched in ported.switches.values():
        if all(name in told and told[name] == value for name, value in switched.items()):
            continue
        again = answer(ask, slot, port, switched)
        if not isinstance(again, Compared):
            continue
        # A setting may also make round-off larger; so the distance must go as well, where the port did not end.
        gone = bool(found.because) or SHARE * again.apart < found.apart
        beyond = again.verdict == "same" and again.until > found.since and gone
        if beyond if found.verdict == "differs" else again.whole:
            return replace(found, proof=proof_of(switched))
    return found


def ask(slot: Slot, port: str, switched: Mapping[str, Any]) -> Compared:
    """Compare one case, with ``switched`` settings in both."""
    own, ported = registry.load(slot.engine), registry.load(port)
    scene = prepare(slot).scene
    for engine in (own, ported):
        try:
            refused = checked_refusal(engine.refusal(posed_for(engine, scene), slot.profile, slot.dt))
        except EngineError as error:
            refused = str(error)
        if refused:
            return Compared(slot, port, "unsupported", because=refused)
    return _asked(Compared(slot, port, "failed"), own, ported, posed_for(own, scene), switched)


def proof_of(switched: Mapping[str, Any]) -> str:
    """Settings as `Compared.proof` has them."""
    return ", ".join(f"{name}={text_of(value)}" for name, value in switched.items())


def _asked(blank: Compared, own: Engine, ported: Engine, posed: Scene, switched: Mapping[str, Any]) -> Compared:
    def ran(engine: Engine, start: Scene) -> Trajectory:
        settings = {each.name: each.value for each in settings_of(engine, slot, scene)}
        known = engine.settable()  # a port may have settings of its own
        return run(engine, start, slot.dt, settings | {k: v for k, v in switched.items() if k in known})

    slot, by = blank.slot, ROUNDED[ported.facts.precision]
    scene = prepare(slot).scene
    try:
        base, others = ran(own, posed), [ran(own, moved(posed, k, by)) for k in range(MOVES)]
        return judged(blank, posed, base, others, ran(ported, posed), by)
    except EngineError as error:
        return replace(blank, because=str(error))


def judged(
    blank: Compared, posed: Scene, base: Trajectory, others: Sequence[Trajectory], port: Trajectory, by: float
) -> Compared:
    """Verdict from the motions of the engine, of it from starts moved ``by`` a share (``others``), and of the port."""
    count = min(len(each.t) - (each.finish == "diverged") for each in (base, port, *others))
    places = base.pose[:count, _free(posed), :3]
    size = float(np.abs(places).max(initial=farthest(posed)))
    reaches = [reach(body.shape) for body in posed.bodies if body.motion == "free"]
    room = float(np.ptp(places, axis=(0, 1)).max() + 2.0 * np.max(reaches)) if reaches else size
    changed = np.max([_distances(posed, base, each)[:count].max(axis=1) for each in others], axis=0)
    rounded = by * size * np.sqrt(np.arange(count) + 1.0)
    allowed = rounded + SHARE * np.maximum.accumulate(changed)
    apart = _distances(posed, base, port)[:count]
    kept = allowed <= LOST * min(size, room)
    last = count if kept.all() else int(np.argmin(kept)) or 1
    beyond = apart[:last].max(axis=1) > allowed[:last]
    at, body = np.unravel_index(np.argmax(apart[:last]), apart[:last].shape)
    found = replace(
        blank,
        verdict="differs" if beyond.any() else "same",
        until=float(base.t[last - 1]),
        end=float(base.t[count - 1]),
        apart=float(apart[at, body]),
        body=posed.bodies[int(body)].name,
        growth=float(changed[:last].max() / (by * farthest(posed))),
    )
    if len(port.t) < len(base.t):
        return replace(found, verdict="differs", since=found.end, because=f"the port ends: {port.reason}")
    if beyond.any():
        return replace(found, since=float(base.t[int(np.argmax(beyond))]))
    return replace(found, verdict="lost") if last == 1 < count else found


def farthest(scene: Scene) -> float:
    """Largest distance of a point of a free body from the origin, at the start [m]."""
    free = [body for body in scene.bodies if body.motion == "free"]
    return max((math.hypot(*body.pose[:3]) + reach(body.shape) for body in free), default=1.0)


def moved(scene: Scene, number: int, by: float) -> Scene:
    """The scene with places, turns and velocities of its free bodies moved ``by`` a share; ``number`` draws where."""
    drawn = np.random.default_rng(number)
    size, bodies = farthest(scene), []
    for body in scene.bodies:
        if body.motion == "free":
            step = by * drawn.uniform(-1.0, 1.0, 13)
            pose = np.add(body.pose, step[:7] * [size, size, size, 1.0, 1.0, 1.0, 1.0])
            pose[3:] /= math.hypot(*pose[3:])
            speed = max(top_speed(body), math.sqrt(2.0 * math.hypot(*scene.gravity) * size))  # of a fall through it
            twist = np.add(body.twist, step[7:] * speed * np.array([1.0, 1.0, 1.0, *[1.0 / size] * 3]))
            body = replace(body, pose=tuple(pose.tolist()), twist=tuple(twist.tolist()))
        bodies.append(body)
    return replace(scene, bodies=tuple(bodies))


def _distances(posed: Scene, one: Trajectory, other: Trajectory) -> Array:
    """Largest distance of a point of a body in one run from the same point in the other, (samples, bodies) [m]."""
    count = min(len(one.t), len(other.t))
    a, b = one.pose[:count], other.pose[:count]
    turned = np.minimum(
        np.linalg.norm(a[..., 3:] - b[..., 3:], axis=2), np.linalg.norm(a[..., 3:] + b[..., 3:], axis=2)
    )
    reaches = np.array([reach(body.shape) for body in posed.bodies])
    # Quaternions at a distance d are a turn with d = 2 sin(angle/4) apart, which moves a point by at most 2 reach d.
    return np.where(_free(posed), np.linalg.norm(a[..., :3] - b[..., :3], axis=2) + 2.0 * reaches * turned, 0.0)


def _free(posed: Scene) -> Any:
    return np.array([body.motion == "free" for body in posed.bodies])
