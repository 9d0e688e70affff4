"""Balls that slide, roll and bounce on a floor: their spin along the motion, and bounds.

        -->  v            forward: the speed v of the centre and the spin w that rolls that way, w = v/r
       ( )   w r          slip:    u = v - w r, of the point that touches; friction acts against it
    =========             k = I/(m r^2): 1/2 of a disc, 2/5 of a ball

A contact that is found late is found with an overlap, and friction then acts on a lever arm ``a`` shorter than the
radius by that depth. The change of a result follows from its formula.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from adapters.engine import Array
from adapters.scene import Body, Scene
from adapters.trajectory import Trajectory
from validation import bounds
from validation.scenes.parts import heading

#: Number of lever arms between the shortest and the radius for a formula, which is smooth except at a change of regime.
ARMS = 9


def gyration(dimension: int) -> float:
    """K = I/(m r^2) of the disc or ball of `validation.scenes.parts.ball`."""
    return 0.5 if dimension == 2 else 0.4


def rolling_axis(dimension: int, angle: float) -> Array:
    """Axis of the spin that rolls along ``angle`` [rad] from the first axis, among the components of a twist."""
    return np.array([-1.0]) if dimension == 2 else np.array([-math.sin(angle), math.cos(angle), 0.0])


def launched(body: Body, dimension: int, angle: float, speed: float, spin: float, rise: float = 0.0) -> Body:
    """The body with ``speed`` [m/s] along ``angle`` [rad], ``spin`` [rad/s] that rolls there, and ``rise`` [m/s]."""
    level = (speed,) if dimension == 2 else (speed * math.cos(angle), speed * math.sin(angle))
    turning = (float(w) for w in spin * rolling_axis(dimension, angle))
    return replace(body, twist=(*level, rise, *turning))


def forward(scene: Scene, trajectory: Trajectory, body: int = 1) -> tuple[Array, Array]:
    """Speed along the heading [m/s] and rolling spin [rad/s] of a body at every sample, each (s,)."""
    d = scene.dimension
    axis = rolling_axis(d, math.radians(scene.params.get("heading", 0.0)))
    return trajectory.twist[:, body, : d - 1] @ heading(scene), trajectory.twist[:, body, d:] @ axis


def struck(v: float, w: float, blow: float, mu: float, k: float, radius: float, arm: float) -> tuple[float, float]:
    """Speed [m/s] and rolling spin [rad/s] after an impact on a floor: Coulomb's law, sticking if it can.

    Parameters
    ----------
    blow
        Normal impulse over the mass, (1 + e) v_n [m/s].
    k, arm
        I/(m r^2), and the distance [m] of friction from the centre: the radius, or a little less.
    """
    own = k * radius**2
    grips = (v - w * arm) / (1.0 + arm**2 / own)
    impulse = max(-mu * blow, min(mu * blow, grips))
    return v - impulse, w + impulse * arm / own


def of_the_arm(answer: Callable[[float], float], radius: float, depth: float) -> float:
    """Largest change of ``answer(arm)`` if friction's arm is shorter than ``radius`` by up to ``depth`` [m]."""
    right = answer(radius)
    arms = np.linspace(max(radius - depth, 0.5 * radius), radius, ARMS)
    return max(abs(answer(float(arm)) - right) for arm in arms)


def on_a_late_arm(answer: Callable[[float], float], radius: float, depth: float, scale: float) -> bounds.Bound:
    """Bound of a result that is exact at every step except for the ``depth`` [m] at which its contact is found."""
    because = "exact at every dt except for the lever arm of friction, which is shorter by the depth of a late contact"
    return bounds.Bound(of_the_arm(answer, radius, depth) + bounds.ROUND_OFF * scale, because)
