"""Models of an engine (MJCF) as scenes, and their checks.

    model.xml --(adapters.model: its own engine's compiler, in a process of its own)--> JSON --> CanonicalScene

The JSON replaces the file's text in slots and stores, so that reading results needs neither file nor engine. A model in
the plane y = 0 is a 2-D scene as well. On its own engine it runs with its own settings, as profile ``model``; on others
as rigid bodies.
"""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

from adapters import model
from adapters.model import PROFILE, Model, model_from_dict
from adapters.plain import one_line
from adapters.scene import Scene, SceneError
from adapters.scene.lift import lowered
from adapters.trajectory import Sampling, Trajectory
from validation import metrics
from validation.bounds import ROUND_OFF
from validation.canonical import Brought, CanonicalScene, Check, Measured, Parameter
from validation.files import stated
from validation.files.magnitudes import check_magnitudes, impossible_inertia
from validation.files.stated import Stated

#: Longest run of a model [s]: contacts of every step are stored.
LONGEST = 60.0
#: Most characters of a model as JSON: a thousand bodies and their pairs.
MOST = 2**24


def is_model(path: Path) -> bool:
    """Whether one of our engines reads model files with this ending."""
    return path.suffix.lower() not in (".toml", ".json") and model.reader_of(path.suffix) is not None


@cache
def text_of(text: str, suffix: str, drop: bool) -> str:
    """The model in ``text`` as JSON; see `adapters.model.read`."""
    engine = model.reader_of(suffix)
    if engine is None:
        raise SceneError(f"model: no engine reads files ending in {suffix}")
    found = model.read(engine, suffix, text, drop)
    return json.dumps({"engine": engine, **found.as_dict()})


def canonical_from_text(text: str, path: Path) -> CanonicalScene:
    """The scene in the JSON of a model.

    Raises
    ------
    SceneError
        If it is not from `text_of`.
    """
    if len(text) > MOST:
        raise SceneError(f"{one_line(path)}: is larger than {MOST} characters, the most that is read")
    try:
        data = json.loads(text)
        return _canonical(str(data["engine"]), model_from_dict(data), f"Model {path.name}")
    except SceneError:
        raise
    except (KeyError, TypeError, ValueError, AttributeError, RecursionError) as error:
        raise SceneError(f"{one_line(path)}: is not a stored model: {one_line(error)}") from None


def _canonical(engine: str, read: Model, title: str) -> CanonicalScene:
    check_magnitudes(read.scene)
    flat = lowered(read.scene)
    posed = {3: read.scene} | ({2: flat} if flat is not None else {})
    dimensions = tuple(sorted(posed))
    notes = [f"{one_line(line)}: left out" for line in read.dropped] + list(read.notes)
    notes += impossible_inertia(read.scene)
    if flat is not None:
        notes.append("it lies in the plane y = 0 and also runs in 2-D")
    notes.append(
        f"{engine}/{PROFILE} runs it with the model's own contacts, solver and step; all others run it as rigid bodies"
    )
    notes.append("failures of a model do not fail the command, as no known failures are listed for it")
    whole = stated.canonical_of(Stated(read.scene, (), ()), title)
    return replace(
        whole,
        law="no closed form; energy never grows, bodies do not overlap, momentum is conserved",
        dimensions=dimensions,
        parameters=(Parameter("duration", read.scene.duration, "s", "simulated time; the model has none", 0.0, LONGEST,
                              positive=True),),
        make=lambda dimension, params: replace(posed[dimension], duration=params["duration"], params=dict(params)),
        exact=lambda scene: {"energy_growth": 0.0, "penetration": 0.0, "momentum_drift": 0.0},
        measure=lambda scene, trajectory: {
            **_stated(scene).measure(scene, trajectory), "momentum_drift": momentum_drift(scene, trajectory)
        },
        rule=lambda scene, dt, truth: [*_stated(scene).checks(scene, dt), _momentum_check(scene, dt)],
        sampling=lambda scene: Sampling(1, 0.0),
        notes=tuple(notes),
        brings={engine: Brought(PROFILE, read.dt, read.settings)},
    )  # fmt: skip


def _stated(scene: Scene) -> CanonicalScene:
    return stated.canonical_of(Stated(scene, (), ()), "")


# ---- momentum --------------------------------------------------------------------------------------------------------


def momentum_drift(scene: Scene, trajectory: Trajectory) -> Measured:
    """Largest departure of the free bodies' momentum from its start, the loads' and the fixed bodies' impulses [N s].

    ``P(t) - P(0) - (sum m g + F) t - sum J``, J being the impulses that an engine reports of contacts with bodies that
    are not free; those between free bodies cancel.
    """
    d, free = scene.dimension, metrics.free_bodies(scene)
    mass = np.array([scene.bodies[i].mass for i in free])
    momentum = np.einsum("sid,i->sd", trajectory.twist[:, free, :d], mass)
    load = sum(scene.bodies[i].mass * np.array(scene.gravity) + np.array(scene.bodies[i].force) for i in free)
    given = trajectory.t[:, None] * np.asarray(load)
    contacts = trajectory.contacts
    if len(free) < len(scene.bodies):
        if contacts is None:
            return None, "contacts were not recorded"
        rows, owner = contacts.rows, np.repeat(contacts.step, np.diff(contacts.offset))
        is_free = np.isin(np.arange(len(scene.bodies)), free)
        sign = np.where(is_free[rows.b] & ~is_free[rows.a], 1.0, 0.0) - np.where(
            is_free[rows.a] & ~is_free[rows.b], 1.0, 0.0
        )
        impulses = np.zeros_like(momentum)
        np.add.at(impulses, owner, sign[:, None] * rows.impulse)
        if np.isnan(impulses).any():
            return None, metrics.UNAVAILABLE
        given = given + np.cumsum(impulses, axis=0)
    return float(np.linalg.norm(momentum - momentum[0] - given, axis=1).max()), ""


def _momentum_check(scene: Scene, dt: float) -> Check:
    """Judged if only free bodies can touch; otherwise it depends on the reported impulses."""
    bodies = [body for body in scene.bodies if body.motion == "free"]
    if len(bodies) < len(scene.bodies):
        because = "shown: as accurate as the contact impulses that the engine reports"
        return Check("momentum_drift", "N s", None, None, because, "")
    pull = sum(float(np.linalg.norm(b.mass * np.array(scene.gravity) + np.array(b.force))) for b in bodies)
    scale = sum(b.mass * float(np.linalg.norm(b.twist[: scene.dimension])) for b in bodies) + pull * scene.duration
    steps = max(1.0, scene.duration / dt / 1000.0)
    because = "impulses between free bodies cancel; the round-off of the momenta remains, a thousand steps of 1e-12"
    return Check("momentum_drift", "N s", 0.0, ROUND_OFF * steps * scale, because, "Newton's third law")
