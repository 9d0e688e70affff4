"""``<option>`` of a model as settings of the profile that runs it as MuJoCo would."""

from __future__ import annotations

from typing import Any

import numpy as np

from adapters.engine import Setting
from adapters.mujoco.refusal import Refused

#: Flags that nothing in a scene asks about, or that are said otherwise (gravity).
SILENT = frozenset(
    ("actuation", "autoreset", "clampctrl", "damper", "equality", "filterparent", "frictionloss", "gravity", "limit",
     "sensor", "spring")
)  # fmt: skip
#: Flags that are handed on.
CARRIED = frozenset(("eulerdamp", "island", "midphase", "multiccd", "nativeccd", "refsafe", "warmstart"))
#: Flags that only measure.
MEASURING = frozenset(("energy", "fwdinv"))


def option_settings(mujoco: Any, model: Any) -> list[Setting]:
    """Settings of the solver, each from the model.

    Raises
    ------
    Refused
        For what acts on bodies and no scene has: wind, a fluid, contacts that are switched off.
    """
    option = model.opt
    for name in ("density", "viscosity", "wind"):
        if np.any(getattr(option, name)):
            raise Refused("option", name, "a scene has neither wind nor water", fatal=True)
    disabled = {bit.name.removeprefix("mjDSBL_").lower() for bit in _bits(mujoco.mjtDisableBit, option.disableflags)}
    enabled = {bit.name.removeprefix("mjENBL_").lower() for bit in _bits(mujoco.mjtEnableBit, option.enableflags)}
    for name in sorted(disabled - SILENT - CARRIED):
        raise Refused("option/flag", name, "without it nothing touches", fatal=True)
    for name in sorted(enabled - MEASURING):
        raise Refused("option/flag", name, "a scene has no word for what it changes", fatal=True)
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
