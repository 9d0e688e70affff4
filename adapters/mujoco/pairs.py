"""MuJoCo's settings for one pair of materials: its ``solref``, ``solreffriction`` and law."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from adapters.mujoco.contact_law import ContactLaw, softness_of


def pair_solref(settings: Mapping[str, Any], restitution: float, dt: float) -> tuple[float, float]:
    """``solref`` of a pair; "reflect" has the target velocity -e v one step after contact, v' = v - dt (1+e)/dt v."""
    if settings["solref"] != "reflect":
        return (settings["solref"][0], settings["solref"][1])
    kappa = settings["kappa_elastic" if restitution > 0.0 else "kappa_plastic"]
    return (-kappa / dt**2, -(1.0 + restitution) / dt)


def pair_solreffriction(settings: Mapping[str, Any], dt: float) -> tuple[float, float]:
    """``solreffriction`` of a pair; with "stick" friction stops the slip within the step, v' = v - dt/dt v."""
    value = settings["solreffriction"]
    if value is None:
        return (0.0, 0.0)  # MuJoCo's notation for: as solref
    return (0.0, -1.0 / dt) if value == "stick" else (value[0], value[1])


def contact_law(settings: Mapping[str, Any], restitution: float, friction: float, dt: float) -> ContactLaw:
    """Scalar law that a contact of this pair follows under ``settings``."""
    condim = 3 if friction > 0.0 else settings["smooth_condim"]
    softness = softness_of(settings["cone"], condim, friction)
    solref = pair_solref(settings, restitution, dt)
    return ContactLaw.of(dt, solref, tuple(settings["solimp"]), softness, settings["margin"])
