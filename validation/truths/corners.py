r"""Tilted boxes that land on a corner, without gravity.

          /\
         /  \           arm: from the centre to the corner that lands (along the floor, up)
        / .  \  | v     W = | 1/m + x^2/I   -x y/I     |   velocity of the corner over impulse there,
        \    /  v           | -x y/I     1/m + y^2/I   |   rows and columns (normal, tangent)
    =====\/===========

Only the blow acts, and the box does not turn before it: the lever arm does not depend on when it is found.
"""

from __future__ import annotations

import math

import numpy as np

#: Runs for this long after the ideal contact [s]: less than until another corner lands, checked by scenes.
AFTERMATH = 0.1


def landing_corner(width: float, height: float, tilt: float) -> tuple[float, float]:
    """Arm of the corner that lands of a box turned clockwise by ``tilt`` [rad]: towards +x, and below (> 0) [m]."""
    half, tall = 0.5 * width, 0.5 * height
    c, s = math.cos(tilt), math.sin(tilt)
    return half * c - tall * s, half * s + tall * c


def lands_again(width: float, height: float, tilt: float, rise: float, spin: float) -> bool:
    """Whether a corner is below the floor within half as long again as `AFTERMATH`, by the motion after the blow.

    ``rise`` [m/s] upwards, ``spin`` [rad/s] counter-clockwise.
    """
    _, below = landing_corner(width, height, tilt)
    t = np.linspace(0.0, 1.5 * AFTERMATH, 151)[1:]
    angle = -tilt + spin * t
    lowest = below + rise * t - np.abs(np.sin(angle)) * 0.5 * width - np.abs(np.cos(angle)) * 0.5 * height
    return bool((lowest < -1e-9).any())
