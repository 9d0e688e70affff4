"""What Drake does when nothing is set, as documented; see `adapters.unset`."""

from __future__ import annotations

from adapters.drake.shipped import DISSIPATION, POINT_STIFFNESS, STICTION
from adapters.unset import Unset

_PROPERTIES, _PLANT = "SceneGraphConfig.default_proximity_properties", "MultibodyPlantConfig"
UNSET = (
    Unset("friction of a pair", "0.5, static and dynamic", _PROPERTIES, 0.5),
    Unset(
        "friction of 0.2 and 0.9", "0.327, the harmonic mean", "CalcContactFrictionFromSurfaceProperties", 0.36 / 1.1
    ),
    Unset("restitution of a pair", f"no such number: dissipation of {DISSIPATION:g} s/m", _PROPERTIES),
    Unset("stiffness of a point of contact [N/m]", f"{POINT_STIFFNESS:g}", _PROPERTIES, POINT_STIFFNESS),
    Unset("friction is viscous below [m/s]", f"{STICTION:g}: stiction_tolerance", _PLANT, STICTION),
    Unset("step [s]", "0.001: time_step", _PLANT, 0.001),
)
