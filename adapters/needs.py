"""Facts of a scene for the choice of settings; derived from the scene, never stored.

Profiles choose an engine's settings from these facts only, without the scene's name or truth.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from adapters.scene import Box, HalfSpace, Hull, Polygon, Scene
from adapters.scene.drives import top_speed, turns
from adapters.scene.shapes import ROUND

Regime = Literal["free", "impact", "rest"]


@dataclass(frozen=True)
class Needs:
    """Facts that a profile may use.

    Parameters
    ----------
    dimension
        2 or 3, of the original scene (before embedding in 3-D).
    rotation
        True if anything can turn a body: a box, friction, spin or torque.
    friction
        Largest friction coefficient of a pair that can touch.
    restitution
        Largest restitution of a pair that can touch.
    regime
        ``impact``: a pair that can touch has e > 0, or only motion brings bodies together;
        ``rest``: gravity or a force acts and no e > 0; ``free``: no pair can touch.
    slide
        Friction acts and a body starts with tangential motion or spin, or a surface has a velocity, or a load acts
        along a half-space; over a fixed box motion across gravity counts.
    smallest_size
        Smallest full extent of a free body [m].
    top_speed
        Largest initial, prescribed or surface speed plus the speed by gravity over the duration [m/s].
    mass_ratio
        Largest over smallest mass of the free bodies.
    gravity
        Magnitude [m/s^2].
    pull
        Acceleration that presses bodies together [m/s^2]: gravity, or without it the largest force over its mass.
    hulls
        A body is a convex polygon or hull: engines have separate contact routines for balls, capsules and boxes, and a
        general one for convex bodies.
    """

    dimension: int
    rotation: bool
    friction: float
    restitution: float
    regime: Regime
    slide: bool
    smallest_size: float
    top_speed: float
    mass_ratio: float
    gravity: float
    pull: float
    hulls: bool = False


def needs(scene: Scene) -> Needs:
    """Derive the needs of ``scene``."""
    d = scene.dimension
    free = [body for body in scene.bodies if body.motion == "free"]
    materials = scene.materials()
    friction = max((friction for _, friction in materials), default=0.0)
    restitution = max((restitution for restitution, _ in materials), default=0.0)
    gravity = math.hypot(*scene.gravity)
    loaded = gravity > 0.0 or any(any(body.force) for body in free)
    spin = any(any(body.twist[d:]) or any(body.torque) for body in scene.bodies)
    masses = [body.mass for body in free] or [1.0]
    return Needs(
        dimension=d,
        rotation=friction > 0.0 or spin or any(not isinstance(body.shape, ROUND) for body in free),
        friction=friction,
        restitution=restitution,
        regime=_regime(bool(materials), restitution, loaded),
        slide=friction > 0.0 and (spin or _tangential(scene)),
        smallest_size=min((body.shape.smallest_size for body in free), default=1.0),
        top_speed=max(map(top_speed, scene.bodies)) + gravity * scene.duration,
        mass_ratio=max(masses) / min(masses),
        gravity=gravity,
        pull=gravity or max((math.hypot(*body.force) / body.mass for body in free), default=0.0),
        hulls=any(isinstance(body.shape, Polygon | Hull) for body in scene.bodies),
    )


def _regime(can_meet: bool, restitution: float, loaded: bool) -> Regime:
    if not can_meet:
        return "free"
    return "rest" if loaded and restitution == 0.0 else "impact"


def _tangential(scene: Scene) -> bool:
    """True if a body moves or a load acts along the face of a half-space, or a body moves level over a fixed box.

    Also if a surface has a velocity, or a course moves a support.
    """
    d = scene.dimension
    if any(any(body.surface_velocity) or body.course or turns(body) for body in scene.bodies):
        return True
    motions = [body.twist[:d] for body in scene.bodies]
    loads = [scene.gravity] + [body.force for body in scene.bodies]
    for face in (body.shape for body in scene.bodies if isinstance(body.shape, HalfSpace)):
        if any(_is_across(vector, face.normal) for vector in (*motions, *loads)):
            return True
    pull = math.hypot(*scene.gravity)
    if pull == 0.0 or not any(isinstance(body.shape, Box) and body.motion == "fixed" for body in scene.bodies):
        return False
    down = tuple(g / pull for g in scene.gravity)
    return any(_is_across(motion, down) for motion in motions)


def _is_across(vector: tuple[float, ...], normal: tuple[float, ...]) -> bool:
    """Whether ``vector`` has a part across the unit ``normal`` (1e-12: round-off)."""
    along = sum(v * n for v, n in zip(vector, normal, strict=True))
    # By components: a difference of squares would lose half the digits, and the tilt.
    across = math.hypot(*(v - along * n for v, n in zip(vector, normal, strict=True)))
    return across > 1e-12 * max(1.0, math.hypot(*vector))
