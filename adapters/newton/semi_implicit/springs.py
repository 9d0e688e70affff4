"""Rebound of a ball on a contact that is a spring with a damper, in explicit steps."""

from __future__ import annotations

from adapters.engine import Declared
from adapters.newton.shapes import SPRING_REBOUND
from adapters.receipts.probes import REBOUND_MASS, REBOUND_SPEED, REBOUND_TIME

#: Phases of a step at which a ball may reach the floor.
PHASES = 64


def rebound(stiffness: float, damping: float, dt: float, phase: float) -> float:
    """Speed of leaving over that of approach, of the probe's ball in steps of ``dt`` [s].

    Forces are those of the overlap and speed at a step's start; dampers act on what closes.
    """
    place, speed = phase * REBOUND_SPEED * dt, -REBOUND_SPEED
    for _ in range(round(REBOUND_TIME / dt) + 3):
        if place < 0.0:
            speed -= dt * (stiffness * place + damping * min(speed, 0.0)) / REBOUND_MASS
        place += dt * speed
    return speed / REBOUND_SPEED


def declared(stiffness: float, damping: float, dt: float, left: float) -> Declared:
    """Rebounds at all phases of a step; ``left`` is the round-off."""
    ratios = [rebound(stiffness, damping, dt, (k + 0.5) / PHASES) for k in range(PHASES)]
    return Declared.over(ratios, left, SPRING_REBOUND)
