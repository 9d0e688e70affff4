"""Tables of what is measured: motions that no engine makes, as wrong as one likes, and what each scene reads from them.

A right motion shows nothing of most metrics: they are nothing. So bodies go where nulls go (`validation.questions`), or
where a ball bounces, are shaken by known amounts, and report contacts that are made up.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from of_scenes import cells
from telling import Sections, word

from adapters.engine import Array, Contacts
from adapters.scene import Scene
from adapters.trajectory import ContactRecord, Measured, Sampling, Trajectory
from validation.canonical import CanonicalScene
from validation.catalogue import CATALOGUE
from validation.questions.nulls import NULLS

#: Samples of a motion: enough for every window that a scene looks at.
SAMPLES = 240
#: Amounts by which bodies are shaken [m, rad], and their speeds [m/s, rad/s].
PLACE, SPEED = 0.02, 0.3
#: Motions that tables tell: of those that nothing shakes, most metrics are nothing as well.
TOLD = ("did nothing, shaken", "free flight, shaken", "perfectly inelastic, shaken", "hops", "hops, shaken",
        "hops, then nothing")  # fmt: skip
#: More bodies are not moved: a motion of two balls shows what one of twenty does.
MOST = 12


def shaken(scene: Scene, found: Trajectory, free: Array) -> Trajectory:
    """The same motion with each free body swinging about it in its own rhythm, all of its state of one size."""
    d, n = scene.dimension, len(scene.bodies)
    t = found.t / scene.duration
    pose, twist = found.pose.copy(), found.twist.copy()
    for k in range(n):
        for axis in range(pose.shape[2]):
            swing = np.sin((3.0 + k + 0.7 * axis) * math.pi * t + 0.4 * axis + 0.2)
            pose[:, k, axis] += free[k] * PLACE * swing
        for axis in range(twist.shape[2]):
            twist[:, k, axis] += free[k] * SPEED * np.cos((2.0 + 0.5 * k + 0.3 * axis) * math.pi * t + 0.1 * axis)
    if d == 3:
        pose[..., 3:] /= np.linalg.norm(pose[..., 3:], axis=-1, keepdims=True)
    return Trajectory(found.t, pose, twist, None, found.dt, "completed")


def bouncing(scene: Scene, dt: float, free: Array) -> Trajectory:
    """Every free body hops to half of its height and back, ever lower, slides on and turns."""
    found = NULLS["did nothing"](scene, dt)
    up, t = scene.dimension - 1, found.t
    period = scene.duration / 3.7
    for k, body in enumerate(scene.bodies):
        phase, hop = np.modf(t / period)
        height = (0.3 + 0.1 * k) * 0.64**hop
        found.pose[:, k, up] += free[k] * 4.0 * height * phase * (1.0 - phase)
        found.twist[:, k, up] = free[k] * 4.0 * height * (1.0 - 2.0 * phase) / period
        along = math.hypot(*body.twist[: scene.dimension]) + 0.5
        found.pose[:, k, 0] += free[k] * along * t * (1.0 - 0.2 * t / scene.duration)
        found.twist[:, k, 0] = free[k] * along * (1.0 - 0.4 * t / scene.duration)
        found.twist[:, k, -1] += free[k] * 0.8 * t / scene.duration
        if scene.dimension == 2:
            found.pose[:, k, 2] += free[k] * 0.4 * t * t / scene.duration
    return found


def touching(scene: Scene, found: Trajectory, sampling: Sampling) -> Trajectory:
    """The same motion with a contact of each body and the one before it, and some between every other two."""
    d = scene.dimension
    if sampling.contacts_from is None:
        return found
    steps = np.flatnonzero(found.t > sampling.contacts_from)
    pairs = [(i, j) for j in range(len(scene.bodies)) for i in range(j) if j - i <= 2]
    rows: dict[str, list[object]] = {name: [] for name in ("a", "b", "point", "normal", "impulse", "gap")}
    offset = [0]
    for step in steps:
        for m, (i, j) in enumerate(pairs):
            if (step + m) % 7 == 0:
                continue  # not every contact lasts
            a, b = found.pose[step, i, :d], found.pose[step, j, :d]
            normal = np.zeros(d)
            normal[-1] = 1.0
            push = scene.bodies[j].mass * (0.04 + 0.01 * math.sin(0.3 * step + m))
            impulse = push * normal
            impulse[0] = 0.2 * push * math.cos(0.1 * step + m)
            told = (i, j, 0.5 * (a + b) + 0.1 * m, normal, impulse, -0.001 * (1 + m))
            for name, value in zip(rows, told, strict=True):
                rows[name].append(value)
        offset.append(len(rows["a"]))
    a, b = (np.array(rows[name], dtype=np.int64) for name in ("a", "b"))
    vectors = (np.array(rows[name], dtype=float).reshape(-1, d) for name in ("point", "normal", "impulse"))
    contacts = Contacts(a, b, *vectors, np.array(rows["gap"], dtype=float))
    record = ContactRecord(steps, np.array(offset), contacts)
    return Trajectory(found.t, found.pose, found.twist, record, found.dt, "completed")


def motions(scene: Scene, sampling: Sampling, dt: float) -> Iterator[tuple[str, Trajectory]]:
    """Wrong motions of a scene by name, told every ``dt`` [s]."""

    def told(found: Trajectory) -> Trajectory:
        return touching(scene, found, sampling)

    free = np.array([float(body.motion == "free") for body in scene.bodies])
    for name, null in NULLS.items():
        yield name, null(scene, dt)
        yield f"{name}, shaken", told(shaken(scene, null(scene, dt), free))
    hops = bouncing(scene, dt, free)
    yield "hops", told(hops)
    yield "hops, shaken", told(shaken(scene, hops, 0.1 * free))
    back = Trajectory(hops.t, hops.pose[::-1].copy(), -hops.twist[::-1], None, dt, "completed")
    yield "hops backwards", told(back)
    half = len(hops.t) // 2
    short = Trajectory(hops.t[:half], hops.pose[:half], hops.twist[:half], None, dt, "diverged", "too fast")
    yield "hops, then nothing", short


def measured(canonical: CanonicalScene, scene: Scene, found: Trajectory) -> dict[str, Measured]:
    """What the scene reads from a motion; a quotient by a motion that it does not have is told as such."""
    with np.errstate(all="ignore"):
        try:
            told = canonical.measure(scene, found)
        except (ArithmeticError, ValueError, IndexError) as error:
            return {"nothing": (None, type(error).__name__)}
        if canonical.primary:
            try:
                told = told | {"(primary)": canonical.primary.error(scene, found.dt, told)}
            except (KeyError, ValueError) as error:  # a cell of another kind than the primary's
                told = told | {"(primary)": (None, type(error).__name__)}
    for frontier in canonical.frontiers:
        told = told | {f"(fate, {frontier.name})": (None, frontier.fate(scene, told) or "survives")}
    return told


def table(name: str) -> Sections:
    """Table of one scene: the cell that stands for it, those with planted faults, and one more."""
    canonical, found, asked = CATALOGUE[name], Sections(), dict[int, int]()
    chosen = [canonical.complete(params) for params in (canonical.representative, *canonical.planted)]
    for title, dimension, params in cells(canonical):
        first = asked.setdefault(dimension, 0) < 2
        if not (first or canonical.complete(params) in chosen):
            continue
        scene = canonical.scene(dimension, params)
        if len(scene.bodies) > MOST:
            continue
        asked[dimension] += 1
        own = {}
        for motion, trajectory in motions(scene, canonical.sampling(scene), scene.duration / SAMPLES):
            if motion not in TOLD:
                continue
            for metric, (value, reason) in measured(canonical, scene, trajectory).items():
                text = word(None if value is None else float(f"{value:.9g}"))
                own[f"{motion}: {metric}"] = f"{text}  {reason}" if reason else text
        found[title] = own
    return found
