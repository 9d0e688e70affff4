"""Contacts of MotrixSim as springs: a ball that strikes a fixed face without gravity, step by step."""

from __future__ import annotations

from collections.abc import Sequence

from adapters.mujoco.contact_law import Impedance

#: How far the speeds of `rebound` are off, as a share of the speed before: impedance in the first millimetre of an
#: overlap is up to 1.5e-4 less than its documented curve.
OFF = 5e-4


def rebound(solref: Sequence[float], solimp: Sequence[float], dt: float, phase: float) -> float:
    """Speed after a blow over the speed before it, for 1 m/s.

    With k = 1/(T z)^2 and b = 2/T of ``solref`` (T, z) and the impedance d of ``solimp``, up to D, a contact gives at
    overlap x while it pushes

        v' = v - d/D (k x + b v') dt,    x' = x + v' dt

    [d: `adapters.mujoco.contact_law.Impedance`; the step: measured]

    Parameters
    ----------
    phase
        Overlap at the first step of the contact, in ways of a step.
    """
    (time, ratio), impedance = solref, Impedance.of(tuple(solimp))
    speed, place = -1.0, -phase * dt
    while place < 0.0:
        share = impedance(place) / impedance.deep
        stiffness, damping = share / (time * ratio) ** 2, share * 2.0 / time
        push = -stiffness * place - damping * speed
        if push <= 0.0:
            break
        speed += push * dt / (1.0 + damping * dt)
        place += speed * dt
    return speed
