"""Profiles of MotrixSim: settings and their reasons.

default   as shipped: a model of MJCF, whose contacts are springs with MuJoCo's impedance
tuned     springs of two steps where bodies rest, hard contacts with restitution where they strike; solved further
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from adapters import settings
from adapters.engine import ProfileRule, Setting
from adapters.mujoco.motrixsim.shipped import ITERATIONS, SOLIMP, SOLREF, TOLERANCE
from adapters.needs import Needs

#: Change of `tuned` below which sweeps end: what single precision resolves.
SOLVED = 1e-7
#: Time constant of a contact's spring in `tuned`, in steps.
STIFFEST = 2.0
#: Share of an overlap that a step of `tuned` corrects in scenes of blows, whose speeds it adds to.
SLOWLY = 0.01

_POSITIVE = settings.number(0.0, 1e9)
KINDS: Mapping[str, settings.Check] = MappingProxyType(
    {
        "solver": settings.word("PGS", "PGSIMPR", "Newton"),
        "iterations": settings.whole(1, 10**6),
        "tolerance": settings.number(1e-30, 1.0),
        "solref": settings.row(2, _POSITIVE),
        "solimp": settings.row(5, _POSITIVE),
        "margin": _POSITIVE,
        "erp": settings.either(settings.number(0.0, 1.0), None),
    }
)
_OPTION, _MODEL = "msd.SimulateOption", "msd.ConstraintForceModel"


def default_profile(needs: Needs, dt: float) -> list[Setting]:
    """As shipped."""
    said = "as shipped"
    return [
        Setting("solver", "PGS", f"{said}: sweeps over contacts", f"{_OPTION}, solver_type"),
        Setting(
            "iterations", ITERATIONS, f"{said}: largest number of sweeps", f"{_OPTION}, constraint_solver_iterations"
        ),
        Setting(
            "tolerance",
            TOLERANCE,
            f"{said}: sweeps end where they change less; the MJCF reference says 1e-8, for a model that states none",
            f"{_OPTION}, constraint_solver_tolerance; measured",
        ),
        Setting("solref", SOLREF, f"{said}: time constant [s] and damping ratio; no restitution", "MJCF reference"),
        Setting("solimp", SOLIMP, f"{said}: impedance over the overlap", "MJCF reference"),
        Setting("margin", 0.0, f"{said} [m]: a contact begins when bodies overlap", "MJCF reference"),
        Setting(
            "erp",
            None,
            f"{said}: contacts are springs; with a number they are hard, and a step corrects that share of an overlap",
            f"{_MODEL}, impedance",
        ),
    ]


def tuned_profile(needs: Needs, dt: float) -> list[Setting]:
    """Springs as stiff as a step allows for what rests and slides, hard contacts for blows."""
    changed = {
        "tolerance": Setting(
            "tolerance",
            SOLVED,
            "sweeps end at what single precision resolves; more than 100 sweeps make tall columns tremble",
            "measured: columns of 1 to 20 boxes",
        ),
        "solref": Setting(
            "solref",
            (STIFFEST * dt, SOLREF[1]),
            "the least time constant of the MJCF reference; bodies sink in less",
            "MJCF reference; measured: columns",
        ),
    }
    if needs.regime == "impact":
        pressed = needs.gravity > 0.0
        why = "hard contacts with restitution; a corrected overlap adds its speed to a rebound" + (
            ", and without any correction a bouncing body sinks" if pressed else ""
        )
        changed["erp"] = Setting("erp", SLOWLY if pressed else 0.0, why, f"{_MODEL}, hard; measured")
    return [changed.get(each.name, each) for each in default_profile(needs, dt)]


PROFILES: Mapping[str, ProfileRule] = MappingProxyType({"default": default_profile, "tuned": tuned_profile})
