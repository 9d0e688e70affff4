"""How a model is solved: the numbers of a profile, each with its reason."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

Solver = Literal["scalar", "block"]
PositionCorrection = Literal["split", "baumgarte", "none"]

#: Error that a step of the event loop may make where contacts turn, as a share of the motion in it.
TOLERANCE = 1e-11
#: Least and largest that may be set.
TOLERANCES = (1e-12, 1e-4)


@dataclass(frozen=True)
class Settings:
    """Numbers of the time-stepping scheme; equation numbers refer to ``docs/solver``.

    Parameters
    ----------
    dt
        Step [s].
    solver
        ``scalar``: one row after the other (E10, E11). ``block``: the rows of one manifold together (E12).
    iterations
        Sweeps per step where `residual` is None.
    residual
        Sweep until the scaled natural map (E14) is at most this, or `max_sweeps`. None: exactly `iterations`.
    max_sweeps
        Bound on sweeps per step with a residual stop.
    relaxation
        Over-relaxation factor in (0, 2); None estimates it from the measured residuals (E13).
    position_correction
        ``split``: pseudo-velocities move bodies out of overlap and are forgotten (E16). ``baumgarte``: a bias in
        the velocity row, which injects ``beta * overlap / dt`` (E15). ``none``.
    beta
        Fraction of the overlap beyond `slop` that is removed in one step, in (0, 1].
    slop
        Gap or overlap that is left alone: within it a contact counts as touching [m].
    warm_starting
        Start from the impulses of the step before, matched by feature, in space also by place (E9).
    direct
        Hand a step over to the direct solver (E44) where block sweeps with a residual stop turn out to be slow.
    margin
        Pairs with e = 0 are in contact while their gap is below this fraction of the smaller half width; they may
        close it, not more (E8). Pairs with e > 0 are in contact only where they touch.
    tolerance
        The loop of events (`reference_solver.exact`), in which ``dt`` only says when to look: error that a step of the
        Runge-Kutta method may make where contacts turn, as a share of the motion in it. None: steps of length ``dt``.

    Raises
    ------
    ValueError
        Naming the field.
    """

    dt: float
    iterations: int = 10
    residual: float | None = None
    max_sweeps: int = 100_000
    relaxation: float | None = 1.0
    position_correction: PositionCorrection = "split"
    beta: float = 0.2
    slop: float = 1e-4
    warm_starting: bool = True
    solver: Solver = "scalar"
    margin: float = 0.01
    direct: bool = True
    tolerance: float | None = None

    def __post_init__(self) -> None:
        _require("dt", self.dt, math.isfinite(self.dt) and self.dt > 0.0, "a positive, finite time")
        _require("iterations", self.iterations, _is_count(self.iterations), "a whole number of at least 1")
        _require("max_sweeps", self.max_sweeps, _is_count(self.max_sweeps), "a whole number of at least 1")
        residual = self.residual
        _require("residual", residual, residual is None or 0.0 < residual < 1.0, "None or between 0 and 1")
        factor = self.relaxation
        _require("relaxation", factor, factor is None or 0.0 < factor < 2.0, "None or between 0 and 2")
        corrections = ("split", "baumgarte", "none")
        _require("position_correction", self.position_correction, self.position_correction in corrections, corrections)
        _require("beta", self.beta, 0.0 < self.beta <= 1.0, "in (0, 1]")
        _require("slop", self.slop, math.isfinite(self.slop) and self.slop >= 0.0, "a length of at least 0")
        _require("solver", self.solver, self.solver in ("scalar", "block"), "'scalar' or 'block'")
        _require("margin", self.margin, 0.0 <= self.margin < 0.1, "in [0, 0.1)")
        share = self.tolerance
        least, most = TOLERANCES
        _require("tolerance", share, share is None or least <= share <= most, f"None or in [{least:g}, {most:g}]")

    @property
    def is_textbook(self) -> bool:
        """Whether a step makes a fixed number of sweeps, row by row."""
        return self.tolerance is None and self.solver == "scalar" and self.residual is None

    @classmethod
    def classical(cls, dt: float, iterations: int = 10, pull: float = 9.81) -> Settings:
        """Return what the textbook does: sequential impulses, a fixed number of sweeps, split impulse.

        ``pull``: what presses bodies together [m/s^2].
        """
        return cls(
            dt=dt,
            solver="scalar",
            iterations=iterations,  # 10: the customary default of the engines that descend from this method
            residual=None,
            relaxation=1.0,  # plain Gauss-Seidel; over-relaxed scalar rows make stacks topple
            position_correction="split",
            beta=0.2,  # Catto's fraction: overlap decays with a time constant of 5 steps, without overshoot
            # m; an unfinished solve lifts a corner by up to g h^2, which must stay a contact that is left alone: else
            # it is pushed or closed in the next step, and boxes rock. Twice that lets pyramids of 91 come to rest.
            slop=2.0 * pull * dt * dt,
            warm_starting=True,
            margin=0.01,  # a corner lifted by an unfinished solve stays a contact; 5 mm on a metre-sized box
        )

    @classmethod
    def reference(cls, dt: float, tolerance: float = TOLERANCE) -> Settings:
        """Return the loop of events; ``dt`` only says when to look."""
        return cls(dt=dt, tolerance=tolerance)

    @classmethod
    def fixed_step(cls, dt: float) -> Settings:
        """Return one discrete contact problem per step, solved to round-off."""
        return cls(
            dt=dt,
            solver="block",  # scalar rows stall on two-point manifolds at 1e-4
            residual=1e-13,  # some hundred units in the last place; below that round-off decides
            max_sweeps=5000,  # with eight calls of the direct solver on the way (E44): a bound for broken problems
            relaxation=None,  # estimated: the best factor depends on the height of the pile
            position_correction="split",
            beta=1.0,  # no velocity is touched, so that the whole overlap can go at once
            slop=0.0,  # nothing is tolerated beyond round-off
            warm_starting=True,
            margin=0.01,  # as above; what falls onto a floor with e = 0 slower than 5 mm per step lands on it exactly
        )


def _is_count(value: object) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and value >= 1


def _require(name: str, value: object, holds: bool, what: object) -> None:
    if not holds:
        raise ValueError(f"{name}: {value!r} must be {what}")
