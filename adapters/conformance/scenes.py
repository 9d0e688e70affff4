"""Small planar scenes of the checks; 3-D engines get them embedded.

Bodies touch in one point each unless a box stands on a floor, so that the order of contacts in a solver does not
matter. An engine that refuses boxes, or rebounds, gets the same scene without.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from adapters.conformance.finding import NotAsked
from adapters.engine import Engine, Simulation
from adapters.needs import needs
from adapters.scene import Body, Box, Disc, HalfSpace, Pair, Scene
from adapters.scene.lift import lift
from adapters.stepping import posed_for, run
from adapters.trajectory import Sampling, Trajectory

#: Step of the checks [s]: the usual one.
DT = 1.0 / 240.0
GRAVITY = 9.81


def resting(order: int = 1, gravity: float = GRAVITY, box: bool = True) -> Scene:
    """A disc falls onto a floor beside a box that stands on it; ``order`` -1 puts the floor last."""
    bodies: tuple[Body, ...] = (
        Body("floor", HalfSpace((0.0, 1.0)), motion="fixed"),
        Body("ball", Disc(0.5), 2.0, 0.25, (0.0, 0.51, 0.0), (0.0, -1.0, 0.0)),
    )
    if box:
        bodies += (Body("box", Box((0.5, 0.25)), 3.0, 0.4, (4.0, 0.25, 0.0)),)
    pair = Pair(restitution=0.0, friction=0.5)
    return Scene("check_resting", 1, 2, bodies[::order], (pair,), (0.0, -gravity), 24 * DT)


def striking(order: int = 1, restitution: float = 0.5) -> Scene:
    """A ball hits another one of three times its mass in free space; ``order`` -1 swaps them in the scene."""
    bodies = (
        Body("light", Disc(0.5), 1.0, 0.125, (-0.52, 0.0, 0.0), (2.0, 0.0, 0.0)),
        Body("heavy", Disc(0.5), 3.0, 0.375, (0.52, 0.0, 0.0)),
    )
    return Scene("check_striking", 1, 2, bodies[::order], (Pair(restitution=restitution),), (0.0, 0.0), 48 * DT)


def flying() -> Scene:
    """A thrown and spinning ball under an oblique gravity, without contact."""
    ball = Body("ball", Disc(0.5), 2.0, 0.25, (1.0, -2.0, 0.3), (3.0, 2.0, 1.5))
    return Scene("check_flying", 1, 2, (ball,), (), (0.6 * GRAVITY, -0.8 * GRAVITY), 48 * DT)


def glancing(restitution: float = 0.5) -> Scene:
    """Two spinning balls collide off-centre and slowly in free space, with friction."""
    bodies = (
        Body("light", Disc(0.5), 1.0, 0.125, (-0.45, 0.3, 0.0), (0.25, 0.0, 0.8)),
        Body("heavy", Disc(0.5), 3.0, 0.375, (0.361, -0.3, 0.0), (0.0, 0.0, -0.3)),
    )
    return Scene("check_glancing", 1, 2, bodies, (Pair(restitution=restitution, friction=0.5),), (0.0, 0.0), 72 * DT)


def rolling() -> Scene:
    """A spinning ball lands on a floor and slips, another one hits a third in flight."""
    bodies = (
        Body("floor", HalfSpace((0.0, 1.0)), motion="fixed"),
        Body("ball", Disc(0.5), 2.0, 0.25, (0.0, 0.51, 0.2), (1.0, -1.0, 5.0)),
        Body("left", Disc(0.5), 1.0, 0.125, (4.0, 6.0, 0.0), (2.0, 0.0, 1.0)),
        Body("right", Disc(0.5), 3.0, 0.375, (5.05, 6.1, 0.0), (0.0, 0.0, 0.0)),
    )
    pair = Pair(restitution=0.0, friction=0.3)
    return Scene("check_rolling", 1, 2, bodies, (pair,), (0.0, -GRAVITY), 48 * DT)


def sliding() -> Scene:
    """The `rolling` scene with a box that slides."""
    scene = rolling()
    box = Body("box", Box((0.5, 0.25)), 3.0, 0.4, (-4.0, 0.25, 0.0), (-2.0, 0.0, 0.0))
    return replace(scene, name="check_sliding", bodies=(*scene.bodies, box))


def odd_pairs() -> Scene:
    """Pairs with coefficients that are not products of two values."""
    bodies = tuple(Body(name, Disc(0.5), pose=(2.0 * k, 0.0, 0.0)) for k, name in enumerate("abc"))
    pairs = (Pair("a", "b", 0.9), Pair("b", "c", 0.5), Pair("a", "c", 0.0))
    return Scene("check_pairs", 1, 2, bodies, pairs, (0.0, 0.0), 12 * DT)


def carried() -> Scene:
    """A ball hits a prescribed one."""
    bodies = (
        Body("piston", Disc(0.5), pose=(0.0, 0.0, 0.0), twist=(0.0, 0.5, 0.0), motion="prescribed"),
        Body("ball", Disc(0.5), 2.0, 0.25, (0.0, 1.01, 0.0), (0.0, -1.0, 0.0)),
    )
    return Scene("check_carried", 1, 2, bodies, (Pair(),), (0.0, 0.0), 12 * DT)


def leaning() -> Scene:
    """A box that lies on another one."""
    bodies = (
        Body("floor", HalfSpace((0.0, 1.0)), motion="fixed"),
        Body("lower", Box((0.5, 0.25)), 3.0, 0.4, (0.0, 0.25, 0.0)),
        Body("upper", Box((0.5, 0.25)), 3.0, 0.4, (0.0, 0.75, 0.0)),
    )
    return Scene("check_leaning", 1, 2, bodies, (Pair(friction=0.5),), (0.0, -GRAVITY), 12 * DT)


# ---- turned and mirrored -------------------------------------------------------------------------------------------


def mirrored(scene: Scene) -> Scene:
    """Planar scene with x and all rotations reversed."""
    return _mapped(scene, lambda v: (-v[0], v[1]), -1.0, 0.0)


def quarter_turned(scene: Scene) -> Scene:
    """Planar scene rotated by +90 degrees about the origin."""
    return _mapped(scene, lambda v: (-v[1], v[0]), 1.0, 0.5 * math.pi)


def _mapped(scene: Scene, vector: Any, sign: float, turn: float) -> Scene:
    bodies = []
    for body in scene.bodies:
        shape = body.shape
        if isinstance(shape, HalfSpace):
            bodies.append(replace(body, shape=HalfSpace(vector(shape.normal), shape.offset)))
            continue
        bodies.append(
            replace(
                body,
                pose=(*vector(body.pose), sign * body.pose[2] + turn),
                twist=(*vector(body.twist), sign * body.twist[2]),
                force=vector(body.force),
                torque=(sign * body.torque[0],),
            )
        )
    return replace(scene, bodies=tuple(bodies), gravity=vector(scene.gravity))


# ---- running them --------------------------------------------------------------------------------------------------


def in_all_dimensions(engine: Engine, scene: Scene) -> Iterator[Scene]:
    """The scene in every dimension of the engine."""
    yield scene
    if 3 in engine.facts.dimensions:
        yield lift(scene)


def accepted(engine: Engine, profile: str, *scenes: Scene) -> Scene:
    """First of ``scenes`` that the engine does not refuse.

    Raises
    ------
    NotAsked
        If it refuses all of them.
    """
    reasons = []
    for scene in scenes:
        reason = engine.refuses(posed_for(engine, scene), profile)
        if reason is None:
            return scene
        reasons.append(reason)
    raise NotAsked(f"{profile}: {reasons[-1]}")


def values(engine: Engine, profile: str, scene: Scene) -> dict[str, Any]:
    """Settings of ``profile`` for ``scene`` by name."""
    return {setting.name: setting.value for setting in engine.settings(profile, needs(scene), DT)}


def built(engine: Engine, scene: Scene, profile: str) -> Simulation:
    """World of the scene, embedded in 3-D where necessary."""
    return engine.build(posed_for(engine, scene), DT, values(engine, profile, scene))


def driven(engine: Engine, scene: Scene, profile: str, contacts: bool = False) -> Trajectory:
    """Trajectory of the scene at every step."""
    sampling = Sampling(1, 0.0 if contacts else None)
    return run(engine, scene, DT, values(engine, profile, scene), sampling)
