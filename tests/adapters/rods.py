"""A rod that lands on its end (scene kane): what an engine makes of it, and the textbook for a shorter arm."""

import math

import numpy as np

from validation.catalogue import CATALOGUE
from validation.cells import Slot
from validation.running.execution import execute
from validation.scenes.kane import answers
from validation.truths.corners import landing_corner

KANE = CATALOGUE["kane"]
DT = 1 / 240


def struck(engine, profile, params, dt=DT):
    """Speed upwards, along the floor and spin of a rod after its blow, and how deep a step found its end [m]."""
    p = KANE.scene(2, params).params
    found = execute(Slot("kane", KANE.minimal(params), 2, engine, profile, dt)).metrics
    late = -p["delay"] / dt % 1.0
    return np.array([found[name][0] for name in ("rise", "ahead", "spin")]), late * p["v"] * dt


def end_of(params):
    """A rod's end against its centre: along the floor and below it [m]; its radius of gyration squared; its numbers."""
    p = KANE.scene(2, params).params
    return *landing_corner(p["aspect"], 1.0, math.radians(90.0 - p["lean"])), (1.0 + p["aspect"] ** 2) / 12.0, p


def textbook(params, shorter=0.0):
    """The three by Newton's and Coulomb's laws, of an arm that is ``shorter`` [m]."""
    x, below, square, p = end_of(params)
    y = below - shorter
    mobility = np.array([[1.0 + x * x / square, x * y / square], [x * y / square, 1.0 + y * y / square]])
    ((normal, tangent),) = answers(mobility, np.array([-p["v"], p["along"] * p["v"]]), p["e"], p["mu"])
    return np.array([normal - p["v"], p["along"] * p["v"] + tangent, (x * normal + y * tangent) / square])
