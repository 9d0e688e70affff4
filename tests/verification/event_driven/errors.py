"""Clear ends of a run: the oracle stops with a reason rather than going on with an answer that it cannot defend."""

from __future__ import annotations


class OracleError(RuntimeError):
    """The run ended at ``time`` [s]; the message says why."""

    def __init__(self, time: float, reason: str) -> None:
        super().__init__(f"t = {time:.17g} s: {reason}")
        self.time = time


class LeavesClosedForm(OracleError):
    """What follows has no closed form here, such as a pivoting box or a ball that rolls over another."""


class ContactParadox(OracleError):
    """The declared law has no solution (Painleve)."""


class TooManyEvents(OracleError):
    """The bound on events was reached."""
