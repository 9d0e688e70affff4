"""dartpy over its releases: changes of the calls of the adapter."""

from __future__ import annotations

from typing import Any

from adapters.dart.profiles import SWEEPS
from adapters.releases import Difference, Distribution, Releases

RELEASES = Releases(
    distributions=(Distribution("dartpy"),),
    known=">=6.16.2,<6.21",
    differences=(
        Difference("<6.20", "a world has no setter for its detector",
                   "the detector of its solver is set, in every release",
                   "measured: 6.19.5 has none, 6.20.0 has it"),
        Difference("<6.19", "bodies at rest are never deactivated, and there is no option for it", "nothing is set",
                   "measured: 6.18.0 has no DeactivationOptions, 6.19.0 has them"),
        Difference("<6.20", "positions are not corrected by split impulses, and there is no option for it",
                   "it reads as off", "measured: 6.19.5 has no isSplitImpulseEnabled"),
        Difference("<6.20", "the fallback solver of Dantzig's has no interface, and there are no solvers with "
                            "the exact cone",
                   "`default` leaves it as shipped; the other profiles are refused",
                   "measured: 6.19.5 has no getSecondaryBoxedLcpSolver, NsgsFrictionSolver or FbfFrictionSolver"),
    ),
)  # fmt: skip


def keep_awake(world: Any) -> None:
    """Disable sleeping of a world's bodies."""
    if hasattr(world, "getDeactivationOptions"):
        rest = world.getDeactivationOptions()
        rest.mEnabled = False
        world.setDeactivationOptions(rest)


def may_sleep(world: Any) -> bool:
    """Whether bodies of a world may sleep."""
    return hasattr(world, "getDeactivationOptions") and bool(world.getDeactivationOptions().mEnabled)


def splits_impulses(solver: Any) -> bool:
    """Whether a solver corrects positions by split impulses."""
    return hasattr(solver, "isSplitImpulseEnabled") and bool(solver.isSplitImpulseEnabled())


def refusal(profile: str) -> str | None:
    """Why the installed release lacks a profile; None if it has it."""
    import dartpy

    if profile in SWEEPS and not hasattr(dartpy.constraint, "NsgsFrictionSolver"):
        return f"profile: {profile} needs solvers that dartpy has from 6.20.0 on"
    return None


def second_choice(solver: Any) -> Any:
    """Return the fallback of the solver; None if a release does not expose it."""
    return solver.getSecondaryBoxedLcpSolver() if hasattr(solver, "getSecondaryBoxedLcpSolver") else None
