"""Whether what an engine says of contact forces is true: six situations in which they are known.

    rest      two boxes on each other           the floor carries 2 m g, the lower box m g
    slope     a box at rest on a slope          m g cos a, m g sin a, (h/2) tan a downhill of the centre
    sliding   a box that slides to a stop       m g upwards, mu m g against its velocity
    blow      a ball thrown at the floor        over the steps of the blow m v (1 + e), and what friction takes
    airborne  a ball between two bounces        0, from the step after it has left the floor
    grip      a box between a wall and a pad    the grip N from both sides, which share its weight

Two questions are kept apart. Does the body move as it must? Its momentum is compared with the law of the situation.
Is the reading true? In every step the impulses that it names must be those that the body got, by Newton's second law:

    sum of impulses on a body  =  m (v after - v before)  -  (m g + load) dt,      and what A gets from B is
                                                                                  minus what B gets from A

So a wrong motion is not blamed on a reading. What the engine's damping takes of a body that touches nothing is part of
the velocity before (`kept`).
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from adapters.engine import Array, Engine
from adapters.needs import needs
from adapters.plain import one_line
from adapters.readings import Cause, Heard, Part, Read, Reading, heard
from adapters.scene import Box, Scene
from adapters.stepping import posed_for
from validation.canonical import Params
from validation.posed import resolve
from validation.running.plan import QUICK_DT

#: Round-off of single precision, the coarsest of an engine: two velocities, their difference, and a product and a sum
#: for each of up to four contacts and three axes are at most 32 roundings of the largest momentum or impulse.
ROUNDED = 32.0 * 2.0**-23
#: Share of the friction below which a reading has none.
FAINT = 0.01
#: Speeds at which damping is measured [m/s], up to the fastest of the situations.
SPEEDS = (0.01, 1.0, 2.0, 3.0, 4.0, 6.0)
#: Impulses of pairs of bodies, by their indices: (a, b) of a on b, (s, d) [N s]; NaN where not determined.
Pairs = Mapping[tuple[int, int], Array]
#: Of free bodies, by index: see `kept`.
Keeps = Mapping[int, Callable[[Array], Array]]
RIGHT, WRONG, MISSING, STOPPED = "right", "wrong", "not available", "not run"


@dataclass(frozen=True)
class Situation:
    """A scene in which contact forces are known; they are stated in ``readings.toml``.

    Parameters
    ----------
    what
        In a few words, with the law.
    cases
        Parameters of the scene; a later one where all before are refused.
    body
        The one on which the law is stated, by index.
    pairs
        Impulses between bodies, of those on each body (s, n, d).
    law
        Of a scene the mean force on the body [N] over the second half of the run, or where ``is_sum`` the impulse of
        the whole run [N s], with its tolerance, (d,) each; None where the motion is not judged.
    normal
        Axis of the normal forces on it: 0 along the floor, -1 upwards.
    flies
        Whether only steps count in which nothing touches the body.
    placed
        How far from below the body's centre the resultant acts [m].
    """

    name: str
    what: str
    scene: str
    body: int
    cases: Sequence[Params]
    pairs: Callable[[Array], Pairs]
    law: Callable[[Scene, float], tuple[Array, Array]] | None = None
    normal: int = -1
    is_sum: bool = False
    flies: bool = False
    placed: Callable[[Scene], float] | None = None


@dataclass(frozen=True)
class Judged:
    """What a reading is worth in a situation.

    Parameters
    ----------
    verdict
        `RIGHT`, `WRONG`, `MISSING` or `STOPPED`.
    off
        Largest error of a step over the largest true impulse of a step, both of the same pair, or of all pairs of the
        same body; None where nothing was compared.
    where
        What is wrong, or what is missing.
    motion
        How far the body's mean force, or impulse, is off the law, over the law's; None where it is within tolerance.
    wrong, steps
        In how many steps it is wrong, of how many; None if in all, or in none.
    most
        Largest error of a step, as a force [N], of all pairs and bodies; None where it is not wrong.
    """

    situation: str
    verdict: str
    off: float | None = None
    where: str = ""
    motion: float | None = None
    wrong: int | None = None
    steps: int | None = None
    most: float | None = None


# ---- situations ------------------------------------------------------------------------------------------------------


def _vector(scene: Scene, along: float, up: float) -> Array:
    return np.array([along, *(0.0,) * (scene.dimension - 2), up])


def _steady(scene: Scene, dt: float, force: Array) -> tuple[Array, Array]:
    """A mean force over half of the run: the body may gain or lose the speed of a step, g dt, at either end."""
    body = scene.bodies[-1]
    gain = 2.0 * body.mass * math.hypot(*scene.gravity) * dt / (0.5 * scene.duration)
    return force, np.full(scene.dimension, gain)


def _carried(scene: Scene, dt: float) -> tuple[Array, Array]:
    return _steady(scene, dt, -scene.bodies[-1].mass * np.array(scene.gravity))


def _slid(scene: Scene, dt: float) -> tuple[Array, Array]:
    p = scene.params
    return _steady(scene, dt, p["mass"] * p["g"] * _vector(scene, -p["mu"], 1.0))


def _struck(scene: Scene, dt: float) -> tuple[Array, Array]:
    """The contact is found up to a step late, on an arm that is shorter by as much as the ball falls in it."""
    p, told = scene.params, resolve(scene.name).exact(scene)
    blow = p["mass"] * _vector(scene, told["forward_speed"] - p["v"], (1.0 + p["e"]) * p["fall"])
    return blow, np.full(scene.dimension, p["mass"] * p["v"] * p["fall"] * dt / p["radius"])


def _gripped(scene: Scene, dt: float) -> tuple[Array, Array]:
    weight = scene.params["mass"] * scene.params["g"]
    return _steady(scene, dt, _vector(scene, 0.0, weight))


def _on_floor(on: Array) -> Pairs:
    return {(0, 1): on[:, 1]}


def _on_each_other(on: Array) -> Pairs:
    return {(0, 1): on[:, 1] + on[:, 2], (1, 2): on[:, 2]}


def _between(on: Array) -> Pairs:
    """The pad touches the box and a smooth floor: what acts on it along the floor comes from the box."""
    from_box, from_wall = np.full_like(on[:, 3], math.nan), np.full_like(on[:, 3], math.nan)
    from_box[:, 0], from_wall[:, 0] = on[:, 3, 0], on[:, 2, 0] + on[:, 3, 0]
    return {(1, 2): from_wall, (2, 3): from_box}


def _downhill(scene: Scene) -> float:
    """Way from below the centre to where the resultant acts [m], (h/2) tan a."""
    return 0.5 * abs(scene.gravity[0] / scene.gravity[-1])


#: Functions that ``readings.toml`` names.
_NAMED: Mapping[str, Callable[..., Any]] = {
    "carried": _carried, "slid": _slid, "struck": _struck, "gripped": _gripped, "downhill": _downhill,
    "on_floor": _on_floor, "on_each_other": _on_each_other, "between": _between,
}  # fmt: skip
SITUATIONS = tuple(
    Situation(**told | {part: _NAMED[told[part]] for part in ("pairs", "law", "placed") if part in told})
    for told in tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))["situation"]
)


def posed(situation: Situation, dimension: int) -> list[Scene]:
    """The scenes of a situation; one of a box that slides ends while it still slides."""
    scenes = [resolve(situation.scene).scene(dimension, params) for params in situation.cases]
    if situation.law is _slid:
        return [replace(s, duration=0.75 * s.params["v"] / (s.params["mu"] * s.params["g"])) for s in scenes]
    return scenes


# ---- judging ---------------------------------------------------------------------------------------------------------


def kept(engine: Engine, scene: Scene, dt: float, settings: Mapping[str, Any], body: int) -> Callable[[Array], Array]:
    """Share of its velocity that a body keeps over a step in which nothing touches it, by its speed; 1 without damping.

    It is measured on the body alone, at `SPEEDS`, since damping may grow with the speed.
    """
    alone, still = scene.bodies[body], (0.0,) * scene.dimension
    shares = []
    for speed in SPEEDS:
        flying = replace(alone, twist=(speed, *(0.0,) * (len(alone.twist) - 1)), force=still)
        world = posed_for(engine, replace(scene, bodies=(flying,), pairs=scene.pairs[:1], gravity=still))
        simulation = engine.build(world, dt, settings)
        try:
            simulation.advance(1)
            shares.append(float(simulation.twist()[0, 0]) / speed)
        finally:
            simulation.close()
    if np.abs(np.array(shares) - 1.0).max() <= 2.0**-23:
        return np.ones_like
    return lambda speeds: np.interp(speeds, SPEEDS, shares)


def got(scene: Scene, run: Heard, keeps: Keeps) -> Array:
    """Impulse of all contacts on each body in each step by its momentum, (s, n, d) [N s]; 0 where it is not free."""
    d = scene.dimension
    on = np.zeros((len(run.read), len(scene.bodies), d))
    for k, share in keeps.items():
        body, velocity = scene.bodies[k], run.twist[:, k, :d]
        loads = body.mass * np.array(scene.gravity) + np.array(body.force)
        before = share(np.linalg.norm(velocity[:-1], axis=1))[:, None] * velocity[:-1]
        on[:, k] = body.mass * (velocity[1:] - before) - loads * run.dt
    return on


def judge(situation: Situation, scene: Scene, run: Heard, part: Part, keeps: Keeps) -> Judged:
    """Compare what was read in a run with what the bodies got."""
    on = got(scene, run, keeps)
    momentum = max(scene.bodies[k].mass * float(np.abs(run.twist[:, k, : scene.dimension]).max()) for k in keeps)
    largest = float(np.abs(on).max())
    allowed = ROUNDED * (momentum + largest) + _turned(scene, run, part) * largest
    motion = _motion(situation, scene, run, on)
    if situation.flies:
        touched = (np.abs(on[:, situation.body]) > allowed).any(axis=1)
        steps = np.flatnonzero(~touched & np.logical_or.accumulate(touched))  # not the first fall
    else:
        steps = np.arange(len(on))
    if len(steps) == 0 or largest <= allowed:
        return Judged(situation.name, STOPPED, None, "nothing touches, or never lets go", motion)
    found = list(_errors(situation, scene, run, on, part, steps))
    if not found:
        return Judged(situation.name, MISSING, motion=motion)
    # What is smaller than its own round-off is no scale of an error; a number that is none is wrong.
    series, scale, where = max(
        found, key=lambda each: (not each[0].max() <= allowed, each[0].max() / max(each[1], allowed))
    )
    off, wrong = float(series.max()) / max(scale, allowed), int((~(series <= allowed)).sum())
    if not any(np.any(one.impulse) for step in run.read for each in step for one in each or ()):
        where = "reads 0"
    elif wrong and part == "vector":
        along = np.delete(np.arange(scene.dimension), situation.normal)
        beside = [one.impulse[along] for step in run.read for one in step[situation.body] or ()]
        rubs = float(np.abs(on[:, situation.body, along]).max())
        lacks = rubs > allowed and float(np.abs(beside).max(initial=0.0)) <= FAINT * rubs
        where = "friction is not in it" if lacks else where
    verdict = WRONG if wrong else RIGHT
    if verdict == RIGHT and situation.placed and (told := _place(situation, scene, run)):
        return Judged(situation.name, WRONG, off, told, motion)
    some, of = (wrong, len(steps)) if 0 < wrong < len(steps) else (None, None)
    most = max(float(each[0].max()) for each in found) / run.dt if verdict == WRONG else None
    return Judged(situation.name, verdict, off, where if verdict == WRONG else "", motion, some, of, most)


def _turned(scene: Scene, run: Heard, part: Part) -> float:
    """Largest angle by which a box turns in a step [rad]: a normal may be that of the start or of the end.

    Where normal parts alone are read, they are compared along an axis of the world: then from the start on.
    """
    boxes = [k for k, body in enumerate(scene.bodies) if isinstance(body.shape, Box)]
    pose = run.pose[:, boxes, scene.dimension :]
    turns = np.diff(pose, axis=0) if part == "vector" else pose - pose[:1]
    return (1.0 if scene.dimension == 2 else 2.0) * float(np.abs(turns).max(initial=0.0))


def _motion(situation: Situation, scene: Scene, run: Heard, on: Array) -> float | None:
    """How far the body's mean force or impulse is off the law, over the law's; None where it is within tolerance."""
    if situation.law is None:
        return None
    truth, tolerance = situation.law(scene, run.dt)
    own = on[:, situation.body]
    told = own.sum(axis=0) if situation.is_sum else own[len(own) // 2 :].mean(axis=0) / run.dt
    off = np.abs(told - truth)
    return None if (off <= tolerance).all() else float(off.max() / np.abs(truth).max())


def _errors(
    situation: Situation, scene: Scene, run: Heard, on: Array, part: Part, steps: NDArray[np.int64]
) -> Iterator[tuple[Array, float, str]]:
    """Errors of the steps [N s] for each body, and for each pair in both directions, with its true size and name.

    The size [N s] is the largest of a step in the run; that of a body is no less than the sum of those of its pairs,
    since forces on a body between two others cancel.
    """
    pairs = situation.pairs(on)
    axis = situation.normal % scene.dimension
    names = [body.name for body in scene.bodies]
    sizes = {pair: np.nanmax(np.abs(force), axis=1) for pair, force in pairs.items()}
    for body in (k for k, each in enumerate(scene.bodies) if each.motion == "free"):
        read = [run.read[step][body] for step in steps]
        if any(each is None for each in read):
            continue
        own = [size for pair, size in sizes.items() if body in pair]
        scale = max(float(sum(own).max()), float(np.abs(on[:, body]).max()))  # it may touch others than those of pairs
        if part == "size":
            acting = [np.abs(force[steps, axis]) for pair, force in pairs.items() if body in pair]
            told = np.array([sum(float(one.impulse[0]) for one in each) for each in read])
            if situation.normal != -1 and body != situation.body:
                continue  # the pad stands on the floor as well
            yield np.abs(told - sum(acting)), scale, f"on {names[body]}"
            continue
        told = np.array([sum((one.impulse for one in each), np.zeros(scene.dimension)) for each in read])
        off = told - on[steps, body]
        if part == "normal" and body != situation.body and situation.normal != -1:
            continue  # its normal forces have two directions
        yield np.abs(off[:, [axis]] if part == "normal" else off).max(axis=1), scale, f"on {names[body]}"
    if part == "size":
        return
    for (a, b), force in pairs.items():
        for body, other, sign in ((b, a, 1.0), (a, b, -1.0)):
            parts = [_from(run.read[step][body], other, scene.dimension) for step in steps]
            if any(each is None for each in parts):
                continue
            off = np.array(parts) - sign * force[steps]
            chosen = off[:, [axis]] if part == "normal" else off[:, ~np.isnan(force).any(axis=0)]
            yield np.abs(chosen).max(axis=1), float(sizes[a, b].max()), f"on {names[body]} from {names[other]}"


def _from(read: list[Read] | None, other: int, dimension: int) -> Array | None:
    """Sum of what comes from one body; None if the reading does not say from which."""
    if read is None or any(each.other is None for each in read):
        return None
    return sum((each.impulse for each in read if each.other == other), np.zeros(dimension))


def _place(situation: Situation, scene: Scene, run: Heard) -> str:
    """What is wrong with the place of the resultant in the second half of the run; empty if nothing, or unsaid."""
    assert situation.placed is not None
    body, gravity = situation.body, scene.gravity
    half = len(run.read) // 2
    rows = [(run.pose[k, body], each) for k in range(half, len(run.read)) for each in run.read[k][body] or ()]
    if not rows or any(each.point is None for _, each in rows):
        return ""
    weights = np.array([each.impulse[-1] for _, each in rows])
    ways = np.array([each.point[0] - pose[0] for pose, each in rows])  # type: ignore[index]
    heights = np.array([each.point[-1] for _, each in rows])  # type: ignore[index]
    sunk = max(abs(float(pose[scene.dimension - 1]) - scene.bodies[body].pose[scene.dimension - 1]) for pose, _ in rows)
    # A body may move by g dt^2 within a step, and where it has sunk in, points lie as deep.
    slack = sunk + math.hypot(*gravity) * run.dt**2 + ROUNDED
    if np.abs(heights).max() > slack:
        return "its points do not lie on the floor"
    truth = situation.placed(scene)
    off = abs(float((weights * ways).sum() / weights.sum()) - truth)
    return "" if off <= slack else f"the resultant is {off:.2g} m off its place"


# ---- an engine's readings --------------------------------------------------------------------------------------------


def measured(
    engine: Engine,
    profile: str,
    reading: Reading,
    situation: Situation,
    changes: Mapping[str, Any] | None = None,
    dt: float = QUICK_DT,
) -> Judged:
    """Judge a reading of an engine in a situation, in space if the engine has it; ``changes`` are other settings."""
    refusal: str | None = None
    for scene in posed(situation, max(engine.facts.dimensions)):
        refusal = engine.refusal(scene, profile, dt)
        if not refusal:
            break
    else:
        return Judged(situation.name, STOPPED, None, one_line(str(refusal)))
    settings = {each.name: each.value for each in engine.settings(profile, needs(scene), dt)} | {**(changes or {})}
    free = [k for k, body in enumerate(scene.bodies) if body.motion == "free"]
    keeps = {k: kept(engine, scene, dt, settings, k) for k in free}
    run = heard(engine, posed_for(engine, scene), dt, settings, reading)
    return judge(situation, scene, run, reading.part, keeps)


def causes_of(reading: Reading, profile: str, situation: str) -> list[Cause]:
    """Known causes why a reading is wrong in a situation."""
    return [each for each in reading.causes if situation in each.situations and each.profile in ("", profile)]
