"""Types shared by engines and judging, and one folder per engine.

Importing this package imports no engine and no numba; `adapters.registry` loads engines when needed.
"""

from adapters.engine import (
    Contacts,
    Declared,
    Engine,
    EngineError,
    EngineFacts,
    Quirk,
    Scheme,
    Setting,
    Simulation,
)
from adapters.needs import Needs, needs
from adapters.scene import Body, Box, Disc, HalfSpace, Pair, Scene, SceneError, Sphere
from adapters.stepping import run
from adapters.trajectory import ContactRecord, Sampling, Trajectory

__all__ = [
    "Body",
    "Box",
    "ContactRecord",
    "Contacts",
    "Declared",
    "Disc",
    "Engine",
    "EngineError",
    "EngineFacts",
    "HalfSpace",
    "Needs",
    "Pair",
    "Quirk",
    "Sampling",
    "Scene",
    "SceneError",
    "Scheme",
    "Setting",
    "Simulation",
    "Sphere",
    "Trajectory",
    "needs",
    "run",
]
