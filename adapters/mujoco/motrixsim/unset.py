"""MotrixSim without any settings, as documented; see `adapters.unset`."""

from __future__ import annotations

from adapters.mujoco.motrixsim.shipped import ITERATIONS, SOLREF
from adapters.unset import Unset

_MJCF = "MJCF reference"
UNSET = (
    Unset("friction of a pair", "1: geom friction", _MJCF, 1.0),
    Unset("friction of 0.2 and 0.9", "0.9, the larger, as in MuJoCo", _MJCF, 0.9),
    Unset("restitution of a pair", "none: MJCF has no word for it", _MJCF),
    Unset("time constant of a contact [s]", f"{SOLREF[0]:g}: solref", _MJCF, SOLREF[0]),
    Unset("iterations", f"{ITERATIONS}", _MJCF, ITERATIONS),
    Unset("tolerance of the solver", "1e-8; it holds 1e-4", f"{_MJCF}; msd.SimulateOption"),
    Unset("gravity, upwards [m/s^2]", "-9.81, along z", _MJCF, -9.81),
    Unset("step [s]", "0.002: timestep", _MJCF, 0.002),
)
