"""Worlds a little other than a scene, and in which of them each law says something: in most it must be silent.

A law computes a motion from what it takes for granted: two bodies, a level face, no load, no spin. Here one thing after
the other is not so. No engine runs.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np

from adapters.engine_folder import laws_of
from adapters.law import Deviation
from adapters.scene import Body, Box, Disc, HalfSpace, Pair, Scene, SceneError, Sphere
from validation.canonical import CanonicalScene
from validation.catalogue import CATALOGUE

#: Step of the predictions [s].
DT = 1 / 240
#: Longest run that is asked [s]: what is kept is whether a law speaks, and of what it hangs on.
LONGEST = 0.1
#: Shorter where a law solves a problem of many contacts at each step.
SHORTER = {"stack": 0.02}
#: Longer steps, of which a scene is asked as it is [s]; no share of the run is one of them.
LONGER = 1 / 144
#: Rotation of all that is turned: three, four, five.
SIN, COS = 0.6, 0.8


def last(scene: Scene, **changed: Any) -> Scene:
    """The scene with its last body changed."""
    return replace(scene, bodies=(*scene.bodies[:-1], replace(scene.bodies[-1], **changed)))


def first(scene: Scene, **changed: Any) -> Scene:
    """The scene with its first body changed."""
    return replace(scene, bodies=(replace(scene.bodies[0], **changed), *scene.bodies[1:]))


def moved(values: tuple[float, ...], k: int, by: float) -> tuple[float, ...]:
    """Values of which the k-th is so much more."""
    return tuple(value + by * (i == k % len(values)) for i, value in enumerate(values))


def with_pairs(scene: Scene, **changed: Any) -> Scene:
    """The scene with all of its materials changed."""
    return replace(scene, pairs=tuple(replace(pair, **changed) for pair in scene.pairs) or (Pair(**changed),))


def worlds(scene: Scene) -> Iterator[tuple[str, Callable[[], Scene]]]:
    """Worlds in which one thing is otherwise."""
    d, body, base = scene.dimension, scene.bodies[-1], scene.bodies[0]
    up, flat = (0.0,) * (d - 1), 1 if d == 2 else 3
    yield "as it is", lambda: scene
    shape = Disc(0.1) if d == 2 else Sphere(0.1)
    far = (*(1e3,) * d, *((0.0,) if d == 2 else (1.0, 0.0, 0.0, 0.0)))
    more = Body("one more", shape, 1.0, 0.004 if d == 2 else (0.004,) * 3, far)
    yield "one more body", lambda: replace(scene, bodies=(*scene.bodies, more))
    yield "without the last", lambda: replace(scene, bodies=scene.bodies[:-1])
    yield "pushed", lambda: last(scene, force=(0.5, *(0.0,) * (d - 1)))
    yield "lifted", lambda: last(scene, force=(*up, 0.5))
    yield "wrung", lambda: last(scene, torque=(0.25,) * flat)
    yield "faster along", lambda: last(scene, twist=moved(body.twist, 0, 0.25))
    yield "faster up", lambda: last(scene, twist=moved(body.twist, d - 1, 0.25))
    yield "spinning", lambda: last(scene, twist=moved(body.twist, -1 if d == 2 else d + 1, 0.5))
    yield "aside", lambda: last(scene, pose=moved(body.pose, 0, 0.125))
    yield "higher", lambda: last(scene, pose=moved(body.pose, d - 1, 1 / 256))
    yield "deeper", lambda: last(scene, pose=moved(body.pose, d - 1, -1 / 256))
    if d == 2:
        yield "leaning", lambda: last(scene, pose=moved(body.pose, 2, 0.1))
    yield "heavier", lambda: last(scene, mass=2.0 * body.mass)
    yield "held", lambda: last(scene, motion="fixed", twist=(0.0,) * len(body.twist))
    yield "prescribed", lambda: last(scene, motion="prescribed")
    other = Box((0.5,) * d) if isinstance(body.shape, Disc | Sphere) else shape
    yield "of another shape", lambda: last(scene, shape=other)
    yield "base let go", lambda: first(scene, motion="free")
    yield "base runs", lambda: first(scene, surface_velocity=(0.5, *(0.0,) * (d - 1)))
    ground = base.shape
    if isinstance(ground, HalfSpace):
        yield "base tilted", lambda: first(scene, shape=HalfSpace((SIN, *(0.0,) * (d - 2), COS), 0.0))
        yield "base lower", lambda: first(scene, shape=HalfSpace(ground.normal, ground.offset - 1 / 256))
        yield "on a box", lambda: first(scene, shape=Box((8.0,) * d), pose=(*up, -8.0, *far[d:]))
    yield "without gravity", lambda: replace(scene, gravity=(0.0,) * d)
    yield "with gravity", lambda: replace(scene, gravity=(*up, -4.0))
    yield "gravity aside", lambda: replace(scene, gravity=moved(scene.gravity, 0, 0.5))
    yield "smooth", lambda: with_pairs(scene, friction=0.0)
    yield "rough", lambda: with_pairs(scene, friction=0.375)
    yield "plastic", lambda: with_pairs(scene, restitution=0.0)
    yield "elastic", lambda: with_pairs(scene, restitution=0.75)
    yield "shorter", lambda: replace(scene, duration=0.5 * scene.duration)
    between = scene.material(base.name, body.name)
    own = replace(between, a=base.name, b=body.name)
    yield "all others of another material", lambda: replace(scene, pairs=(own, Pair(restitution=0.875, friction=0.625)))


def speaks(engine: str, name: str) -> dict[str, str]:
    """In which worlds laws of one scene say something: by that, whose metrics."""
    canonical, metrics = CATALOGUE[name], dict[tuple[str, str], dict[str, None]]()
    for dimension in canonical.dimensions:
        whole = canonical.scene(dimension, canonical.representative)
        scene = replace(whole, duration=min(whole.duration, SHORTER.get(name, LONGEST)))
        asked = [(title, make, DT) for title, make in worlds(scene)]
        asked.append(("at longer steps", asked[0][1], LONGER))
        said = {title: who for title, make, dt in asked if (who := _speaking(engine, canonical, make, dt)) is not None}
        for law in (law for law in laws_of(engine) if law.scene == name):
            line = _line({title: law in who for title, who in said.items()})
            for profile in law.profiles:
                metrics.setdefault((line, f"{dimension}-D {profile}"), {})[law.metric] = None
    found = dict[tuple[str, str], list[str]]()
    for (line, who), own in metrics.items():
        found.setdefault((line, ", ".join(own)), []).append(who)
    return {f"{', '.join(who)}: {own}": line for (line, own), who in found.items()}


def _speaking(engine: str, canonical: CanonicalScene, make: Callable[[], Scene], dt: float) -> set[Deviation] | None:
    """Laws that say something of a world; None of a world that cannot be."""
    try:
        world = make()
    except SceneError:
        return None
    found = set()
    for law in (law for law in laws_of(engine) if law.scene == canonical.name):
        # Some worlds lack what the scene measures.
        with np.errstate(all="ignore"), suppress(Exception):
            if law.says(world, dt, canonical.measure) is not None:
                found.add(law)
    return found


def _line(speaks: dict[str, bool]) -> str:
    """The shorter of two lists: where a law speaks, or where it does not."""
    yes, no = ([title for title, own in speaks.items() if own is which] for which in (True, False))
    if len(no) < len(yes):
        return f"speaks, but not: {', '.join(no)}" if no else "speaks in all worlds"
    return f"silent, but: {', '.join(yes)}" if yes else "silent in all worlds"
