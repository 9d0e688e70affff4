"""Measured gates: what the solver and the oracle promise, as rows that ``make certify`` prints and tests assert.

One module per part that answers for its rows, each with ``gates() -> Iterator[Gate]``.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Gate:
    """One promise, measured.

    Parameters
    ----------
    quantity, case
        What is promised, and for which case.
    measured, gate
        In the quantity's own unit, which ``quantity`` names where it has one.
    made_by
        Profile or oracle that made the measured value.
    holds
        Whether the promise is kept; use `at_most`, `at_least` and `exactly`, which decide it.
    """

    quantity: str
    case: str
    measured: float
    gate: float
    made_by: str
    holds: bool

    @classmethod
    def at_most(cls, quantity: str, case: str, measured: float, gate: float, made_by: str) -> Gate:
        """Return a gate that holds where ``|measured| <= gate``; nan never does."""
        return cls(quantity, case, float(measured), float(gate), made_by, bool(abs(measured) <= gate))

    @classmethod
    def at_least(cls, quantity: str, case: str, measured: float, gate: float, made_by: str) -> Gate:
        """Return a gate that holds where ``measured >= gate``; nan never does."""
        return cls(quantity, case, float(measured), float(gate), made_by, bool(measured >= gate))

    @classmethod
    def exactly(cls, quantity: str, case: str, measured: float, gate: float, made_by: str) -> Gate:
        """Return a gate that holds where both are the same number: counts."""
        return cls(quantity, case, float(measured), float(gate), made_by, bool(measured == gate))
