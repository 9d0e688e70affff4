"""MuJoCo's profiles: settings with their reasons.

default   as shipped
tuned     best stock settings for what a scene needs
matched   Newton's and Coulomb's laws by a loop around the solver that shifts references (`adapters.mujoco.matched`)
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from adapters.engine import EngineError, ProfileRule, Setting
from adapters.mujoco.matched import AGREED
from adapters.mujoco.options import POSITIVE, own_kinds, softness_of
from adapters.mujoco.shipped import DOC, IMPEDANCE_RANGE, ITERATIONS, SOLIMP, SOLREF, TOLERANCE
from adapters.needs import Needs
from adapters.settings import LARGEST_INT, checked, either, row, rows, whole

MANUAL = f"{DOC}, modeling: solver parameters"
FRICTION = f"{DOC}, modeling: friction, slow slippage"
REFLECT = f"{DOC}, computation/speculative: elastic restitution"

DE_SAXCE = "De Saxce and Feng, The bipotential method, 1998; adapters/mujoco/matched.py"
NEWTON = "Newton's law of restitution; adapters/mujoco/matched.py"
MEASURED = "measured with 4.0.1"
CARRIES = "a load rests on a spring of stiffness kappa/dt^2"

#: Largest impedance that MuJoCo allows, the same at every depth.
RIGID = (IMPEDANCE_RANGE[1], IMPEDANCE_RANGE[1], 0.001, 0.5, 1.0)
#: Stiffness of a resting contact in units of 1/dt^2: with damping 1/dt a depth shrinks by 1 - kappa a step. 0.1 settles
#: in ten steps and is far from the limit of 1. With 0.5 bodies rest less deep, but a column of ten at one Newton step
#: explodes (`crosscheck tune mujoco --group stand`).
KAPPA = 0.1
#: The same for blows whose softness a loop corrects: the yielding of a contact then falls by 1e-2 a round, and forces,
#: which are differences over (1 - d)/d, have 2e-14 of round-off instead of 2e-12.
FIRM = (0.99, 0.99, 0.001, 0.5, 1.0)
#: Tolerance of Newton's method in the loop: a step that gains less than this share of the mean inertia's kinetic energy
#: at 1 m/s^2 gains round-off. With 0 it runs to its count, a hundred times as long.
SOLVED = 1e-15
#: Least limit of rounds.
FEWEST_ROUNDS = 100


#: As shipped; both geoms of a pair get its friction.
SHIPPED = (
    Setting("integrator", "Euler", "as shipped", DOC),
    Setting("cone", "pyramidal", "as shipped", DOC),
    Setting("impratio", 1.0, "as shipped", DOC),
    Setting("iterations", ITERATIONS, "as shipped: largest number of Newton steps", DOC),
    Setting("tolerance", TOLERANCE, "as shipped", DOC),
    Setting("noslip_iterations", 0, "as shipped", DOC),
    Setting("smooth_condim", 3, "as shipped: a pair with mu = 0 keeps friction rows, of mu = 1e-5", DOC),
    Setting("solref", SOLREF, "as shipped: time constant [s] and damping ratio; no restitution", MANUAL),
    Setting("solimp", SOLIMP, "as shipped", MANUAL),
    Setting("solreffriction", None, "as shipped: friction is damped like the normal", FRICTION),
    Setting("margin", 0.0, "as shipped [m]: contact starts when bodies overlap", DOC),
)


def default(needs: Needs, dt: float) -> list[Setting]:
    """As shipped, for every scene."""
    return [*SHIPPED]


def tuned(needs: Needs, dt: float) -> list[Setting]:
    """Best stock settings for the scene's needs."""
    if needs.regime == "free":
        return _replaced(
            default(needs, dt),
            Setting("integrator", "RK4", "no contact is possible, so a fourth-order method is accurate", DOC),
        )
    settings = _replaced(
        default(needs, dt),
        Setting("cone", "elliptic", "the pyramid limits friction to mu/sqrt(2) at 45 degrees", f"{DOC}, computation"),
        Setting("smooth_condim", 1, "a pair with mu = 0 has no friction rows", f"{DOC}, computation: contact"),
        Setting("solref", "reflect", "target velocity -e v one step after contact: damping (1 + e)/dt", REFLECT),
        Setting("solimp", RIGID, "d = 0.9999: only 1e-4 of the load yields", MANUAL),
        Setting("tolerance", 0.0, "Newton's method converges to round-off; forces then balance, at no cost", MEASURED),
        Setting(
            "kappa_elastic",
            0.0,
            "a stiffness kappa/dt^2 would change e with the phase of the impact in its step",
            MEASURED,
        ),
        Setting("kappa_plastic", 0.0, "there is no load to carry", MANUAL),
    )
    if needs.regime == "rest":
        settings = _replaced(settings, *_resting(needs, dt))
    elif needs.gravity > 0.0 and needs.restitution > 0.0:
        settings = _replaced(settings, Setting("kappa_plastic", KAPPA, CARRIES, MANUAL))
    if needs.friction > 0.0 and needs.restitution > 0.0:
        reverses = "the damping of the normal, (1 + e)/dt, would reverse the slip; 1/dt stops it"
        settings = _replaced(settings, Setting("solreffriction", "stick", reverses, FRICTION))
    return settings


def _resting(needs: Needs, dt: float) -> list[Setting]:
    """Changes for bodies that only rest, stick and slide (e = 0 everywhere)."""
    settings = [Setting("kappa_plastic", KAPPA, CARRIES, MANUAL)]
    depth = (1.0 - RIGID[0]) / KAPPA * needs.pull * dt**2
    touches = "the depth (1-d)/kappa g dt^2 at which a body rests; touching bodies then start and stay in contact"
    settings.append(Setting("margin", depth, touches, f"{MANUAL}; {DOC}, margin"))
    if needs.friction > 0.0:
        creeps = (
            "friction at rest creeps with (1-d)/(d b n impratio) g sin(theta); 100 makes that far less than g dt^2/s"
        )
        settings.append(Setting("impratio", 100.0, creeps, FRICTION))
    if needs.slide:
        # Stiff friction damping throws a sliding body up, soft damping stops it late. Over 25 inclines with
        # tan(theta)/mu in 1.001 ... 2 at dt = 1/240 s, median error of the acceleration: 0.01 s 17 %, 0.02 s 9 %,
        # 0.05 s 5 %, 0.1 s 3 %, 0.2 s 8 %; error of the stopping distance from 1 m/s: 0.05 s -0.8 %, 0.1 s +4 %.
        # Creep is below 1e-7 m/s for all of them. noslip changes creep only; pyramids creep at 4e-4 m/s near the
        # edge of the cone; softer normals (d = 0.9, 0.5) slide no better, and d = 0.1 rattles.
        best = "least error over tan(theta)/mu = 0.5 ... 2 and in stopping distance: 0.01 s hops, 0.1 s stops late"
        settings.append(Setting("solreffriction", (0.05, 1.0), best, MEASURED))
    return settings


def matched(needs: Needs, dt: float) -> list[Setting]:
    """Newton's restitution and Coulomb's friction by shifted references, wherever contact is possible."""
    if needs.regime == "free":
        return tuned(needs, dt)
    fall, depth = needs.pull * dt, (1.0 - RIGID[0]) / KAPPA * needs.pull * dt**2
    firm = RIGID if needs.regime == "rest" else FIRM
    return _replaced(
        default(needs, dt),
        Setting("cone", "elliptic", "Coulomb's cone is round", f"{DOC}, computation"),
        Setting("smooth_condim", 1, "a pair with mu = 0 has no friction rows", f"{DOC}, computation: contact"),
        Setting("solref", (0.0, -firm[0] / dt), "target velocity 0 one step later; the loop adds the rebound", MANUAL),
        Setting("solimp", firm, "a small part of the load yields, and the loop corrects it", MANUAL),
        Setting("tolerance", SOLVED, "Newton's method stops when a step gains round-off only", MEASURED),
        Setting("margin", depth, "bodies that touch at a distance of exactly 0 are in contact", f"{DOC}, margin"),
        Setting(
            "rounds", _rounds(needs.friction), "enough for the shifts to converge without the secant method", DE_SAXCE
        ),
        Setting(
            "agreed", AGREED, "rounds end when shifts agree to this share of the largest contact acceleration", DE_SAXCE
        ),
        Setting("push_out", KAPPA, "share of an overlap that a step corrects", CARRIES),
        Setting("push_out_speed", fall, "no faster than the load returns it in a step, so nothing hops", NEWTON),
    )


def _rounds(friction: float) -> int:
    """Rounds after which `adapters.mujoco.matched` converges by contraction only, for a ball as for a box.

    The slower of two: ``mu^2 G/(1 + mu^2 G)`` a round with G = 7/2, the mobility of a ball's surface, and that of the
    softness, 1e-4 of an inverse mass, which falls to two thirds at mass ratios of 1e4.
    """
    slip = 3.5 * friction**2
    return max(FEWEST_ROUNDS, math.ceil(math.log(AGREED) / math.log(slip / (1.0 + slip)))) if slip else FEWEST_ROUNDS


def _replaced(settings: list[Setting], *changes: Setting) -> list[Setting]:
    """Settings with those of the same name replaced, others appended."""
    new = {setting.name: setting for setting in (*settings, *changes)}
    return list(new.values())


PROFILES: Mapping[str, ProfileRule] = MappingProxyType({"default": default, "tuned": tuned, "matched": matched})


#: Settings of our own: of a rebound by target velocity, and of the loop around the solver.
_REFLECT = {"kappa_elastic": POSITIVE, "kappa_plastic": POSITIVE}
_MATCHED = {"rounds": whole(1, LARGEST_INT), "agreed": POSITIVE, "push_out": POSITIVE, "push_out_speed": POSITIVE}
#: Values beside the engine's own.
_WORDS = {"solref": either(softness_of, "reflect"), "solreffriction": either(softness_of, None, "stick")}
#: Softness of a pair of bodies (indices): solref, solimp, solreffriction and margin.
_INDEX = whole(0, LARGEST_INT)
_PAIR = (_INDEX, _INDEX, softness_of, row(5, POSITIVE), either(softness_of, None), POSITIVE)
#: Settings that each profile has.
NEEDED = frozenset(setting.name for setting in SHIPPED)
#: Settings of models only (`adapters.mujoco.options`, `adapters.mujoco.model`): the solver, flags that are
#: switched off, and pairs with a softness of their own.
BROUGHT = frozenset({"solver", "disabled", "apart"})


def check_settings(settings: Mapping[str, Any]) -> None:
    """Refuse settings that are unknown, missing or out of range; MuJoCo itself accepts most of them in silence.

    Raises
    ------
    EngineError
        Naming the setting.
    """
    reflect = _REFLECT if settings.get("solref") == "reflect" else {}
    loop = _MATCHED if set(_MATCHED) & set(settings) else {}
    kinds = own_kinds() | _WORDS | {"apart": rows(*_PAIR)} | reflect | loop
    named = {*NEEDED, *reflect, *loop, *settings}
    checked("mujoco", {name: check for name, check in kinds.items() if name in named}, settings)
    if settings["solreffriction"] not in (None, "stick") and settings["cone"] != "elliptic":
        raise EngineError("solreffriction: acts on elliptic cones only")


def own_settings(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Settings outside profiles and models: options of the installed release."""
    return {name: settings[name] for name in sorted(set(settings) - NEEDED - BROUGHT) if name in own_kinds()}
