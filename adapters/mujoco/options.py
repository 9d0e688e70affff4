"""``<option>`` of a model as settings, for the model's profile and for settings of users."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cache
from typing import Any

import numpy as np

from adapters.engine import Setting
from adapters.mujoco.refusal import Refused
from adapters.settings import LARGEST_INT, Check, either, number, one_of, row, whole, word, words

#: Flags without meaning for a scene, or set in another way (gravity).
SILENT = frozenset(
    ("actuation", "autoreset", "clampctrl", "damper", "equality", "filterparent", "frictionloss", "gravity", "limit",
     "sensor", "spring")
)  # fmt: skip
#: Flags that are passed on.
CARRIED = frozenset(("eulerdamp", "island", "midphase", "multiccd", "nativeccd", "refsafe", "warmstart"))
#: Flags that only measure.
MEASURING = frozenset(("energy", "fwdinv"))


#: Options that are not settings: --dt sets the step, the scene gravity, and flags have names.
ASKED_OTHERWISE = frozenset(("timestep", "gravity", "disableflags", "enableflags", "disableactuator"))
#: Options that are one of an enumeration: its name, and what its members' names begin with.
ENUMERATED = {
    "integrator": ("mjtIntegrator", "mjINT_"),
    "cone": ("mjtCone", "mjCONE_"),
    "jacobian": ("mjtJacobian", "mjJAC_"),
    "solver": ("mjtSolver", "mjSOL_"),
}
#: Their words that a setting has in other than lower case.
SPELT = {"euler": "Euler", "rk4": "RK4", "pgs": "PGS", "cg": "CG", "newton": "NEWTON"}
_ANY, POSITIVE = number(-math.inf, math.inf), number(0.0, math.inf)


def softness_of(value: Any) -> str:
    """A time constant [s] and a damping ratio, or, both negative, a stiffness [1/s^2] and a damping [1/s]."""
    fits = not row(2, POSITIVE)(value) or not row(2, number(-math.inf, 0.0))(value)
    return "" if fits else "2 values with commas between them, finite and both at least 0 or both at most 0"


@cache
def own_kinds() -> dict[str, Check]:
    """Settings of the installed release: its options and flags, and the softness of contacts."""
    import mujoco

    option = mujoco.MjModel.from_xml_string("<mujoco/>").opt
    kinds: dict[str, Check] = {}
    for name in dir(option):
        value = getattr(option, name)
        if name.startswith("_") or name in ASKED_OTHERWISE:
            continue
        if name in ENUMERATED:
            members = members_of(mujoco, *ENUMERATED[name])
            kinds[name] = word(*(SPELT.get(each, each) for each in members))
        elif isinstance(value, np.ndarray):
            kinds[name] = row(value.size, _ANY)
        else:
            kinds[name] = whole(0, LARGEST_INT) if isinstance(value, int) else POSITIVE
    disabled = [each for each in members_of(mujoco, "mjtDisableBit", "mjDSBL_") if each in CARRIED]
    flags = {"disabled": words(*disabled), "enabled": words(*members_of(mujoco, "mjtEnableBit", "mjENBL_"))}
    softness = {"solref": softness_of, "solimp": row(5, POSITIVE), "solreffriction": either(softness_of, None)}
    # 0 iterations solve nothing, and MuJoCo divides by impratio.
    least = {"impratio": number(1e-6, math.inf), "iterations": whole(1, LARGEST_INT)}
    return kinds | flags | softness | least | {"margin": _ANY, "smooth_condim": one_of(1, 3)}


def members_of(mujoco: Any, kind: str, prefix: str) -> dict[str, int]:
    """Members of an enumeration by name in lower case; the one that counts them has another prefix."""
    members = getattr(mujoco, kind).__members__.items()
    return {name.removeprefix(prefix).lower(): int(value) for name, value in members if name.startswith(prefix)}


def set_own(mujoco: Any, option: Any, settings: Mapping[str, Any]) -> None:
    """Apply settings that no profile has: options by name, and flags that are switched on."""
    for name, value in settings.items():
        if name == "jacobian":
            option.jacobian = getattr(mujoco.mjtJacobian, f"mjJAC_{value.upper()}")
        elif name == "enabled":
            bits = members_of(mujoco, "mjtEnableBit", "mjENBL_")
            option.enableflags = sum(bits[flag] for flag in value)
        else:
            setattr(option, name, value)


def option_settings(mujoco: Any, model: Any) -> list[Setting]:
    """Settings of the solver, each from the model.

    Raises
    ------
    Refused
        For effects that no scene has: wind, a fluid, disabled contacts.
    """
    option = model.opt
    for name in ("density", "viscosity", "wind"):
        if np.any(getattr(option, name)):
            raise Refused("option", name, "a scene has neither wind nor water", fatal=True)
    disabled = {bit.name.removeprefix("mjDSBL_").lower() for bit in _bits(mujoco.mjtDisableBit, option.disableflags)}
    enabled = {bit.name.removeprefix("mjENBL_").lower() for bit in _bits(mujoco.mjtEnableBit, option.enableflags)}
    for name in sorted(disabled - SILENT - CARRIED):
        raise Refused("option/flag", name, "without it there are no contacts", fatal=True)
    for name in sorted(enabled - MEASURING):
        raise Refused("option/flag", name, "a scene cannot express what it changes", fatal=True)
    integrator = mujoco.mjtIntegrator(int(option.integrator)).name.removeprefix("mjINT_").lower()
    words = {
        "integrator": {"euler": "Euler", "rk4": "RK4"}.get(integrator, integrator),
        "cone": mujoco.mjtCone(int(option.cone)).name.removeprefix("mjCONE_").lower(),
        "impratio": float(option.impratio),
        "iterations": int(option.iterations),
        "tolerance": float(option.tolerance),
        "noslip_iterations": int(option.noslip_iterations),
        "solver": mujoco.mjtSolver(int(option.solver)).name.removeprefix("mjSOL_"),
    }
    found = [Setting(name, value, "of the model", f"option/{name}") for name, value in words.items()]
    carried = tuple(sorted(disabled & CARRIED))
    return [*found, Setting("disabled", carried, "of the model", "option/flag")] if carried else found


def _bits(kind: Any, flags: int) -> list[Any]:
    """Members of an enumeration of bits that are set."""
    return [bit for bit in kind.__members__.values() if int(bit).bit_count() == 1 and int(flags) & int(bit)]
