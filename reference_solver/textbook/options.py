"""Numbers and flags of a run as kernels take them; for both dimensions."""

from __future__ import annotations

from typing import NamedTuple

from reference_solver.compilation import spliced_kernel
from reference_solver.needs import Needs
from reference_solver.settings import Settings
from reference_solver.textbook.noise import ROUND_OFF

SCALAR, BLOCK = 0, 1
NO_CORRECTION, SPLIT, BAUMGARTE = 0, 1, 2


class Options(NamedTuple):
    """Numbers and flags of `Settings` and `Needs`."""

    dt: float
    iterations: int
    residual: float  # < 0: exactly `iterations` sweeps
    max_sweeps: int
    relaxation: float  # <= 0: estimated
    correction: int
    beta: float
    slop: float
    margin: float
    warm_starting: int
    solver: int
    direct: int
    rotation: int
    friction: int
    restitution: int
    broadphase: int
    certified: int  # whether each contact solve is measured (E14, E60 to E63)


@spliced_kernel
def pushes_along(options: Options) -> bool:
    """Whether positions are corrected in the sweeps of velocities (E16)."""
    return options.solver == SCALAR and options.residual < 0.0 and options.correction == SPLIT


@spliced_kernel
def push_speed(gap: float, parting: float, extent: float, options: Options) -> float:
    """Pseudo-velocity that a contact needs (E16) [m/s], beyond the speed ``parting`` with which it parts by itself.

    A rebound is not pushed as well: that would add energy to a bounce. Within what is allowed a contact may close, but
    not farther (negative). ``extent``: smaller half width [m], whose round-off asks for nothing.
    """
    excess = -(gap + options.dt * max(parting, 0.0)) - options.slop
    if abs(excess) <= ROUND_OFF * extent:
        excess = 0.0
    return (options.beta if excess > 0.0 else 1.0) * excess / options.dt


def uses_direct(settings: Settings) -> bool:
    """Whether the direct solver may be called, and needs room."""
    return settings.direct and settings.solver == "block" and settings.residual is not None


def options(settings: Settings, needs: Needs, certified: bool) -> Options:
    """Return settings and needs as plain numbers."""
    return Options(
        dt=float(settings.dt),
        iterations=settings.iterations,
        residual=-1.0 if settings.residual is None else float(settings.residual),
        max_sweeps=settings.max_sweeps,
        relaxation=0.0 if settings.relaxation is None else float(settings.relaxation),
        correction={"none": NO_CORRECTION, "split": SPLIT, "baumgarte": BAUMGARTE}[settings.position_correction],
        beta=float(settings.beta),
        slop=float(settings.slop),
        margin=float(settings.margin),
        warm_starting=int(settings.warm_starting),
        solver={"scalar": SCALAR, "block": BLOCK}[settings.solver],
        direct=int(uses_direct(settings)),
        rotation=int(needs.rotation),
        friction=int(needs.friction),
        restitution=int(needs.restitution),
        broadphase=int(needs.broadphase),
        certified=int(certified),
    )
