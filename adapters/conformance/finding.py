"""Result of a conformance check: it holds, fails, could not run, or fails as listed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from adapters.engine import Engine, Expected
from adapters.plain import one_line

Status = Literal["ok", "FAIL", "refused", "expected", "unexpected pass"]
#: A check of an engine returns the first error, or nothing.
Check = Callable[[Engine], str]


class NotAsked(Exception):
    """The engine refuses every scene of a check; the message is its reason, in one line."""


@dataclass(frozen=True)
class Finding:
    """Result of one check.

    Parameters
    ----------
    status
        ``ok``; ``FAIL``; ``refused``: nothing was measured, which is no pass; ``expected``: it fails as listed in
        `Engine.expected`; ``unexpected pass``: it holds although listed.
    """

    check: str
    status: Status
    message: str

    @property
    def holds(self) -> bool:
        """Whether there is no unlisted failure."""
        return self.status in ("ok", "refused", "expected")

    def __str__(self) -> str:
        """One line."""
        return f"{self.status:8s}  {self.check}: {self.message}"


def found(name: str, check: Check, engine: Engine) -> Finding:
    """Run one check; an exception of the engine is a finding."""
    expected = next((each for each in engine.expected if each.check == name), None)
    try:
        wrong = check(engine)
    except NotAsked as refusal:
        return Finding(name, "refused", one_line(refusal))
    except Exception as error:  # a plugin may raise anything
        wrong = one_line(f"{type(error).__name__}: {error}")
    meant = (check.__doc__ or name).partition("\n")[0].rstrip(".")
    return judged(name, wrong, meant, expected)


def judged(name: str, wrong: str, meant: str, expected: Expected | None) -> Finding:
    """Finding of a check with the error ``wrong``, or none; ``meant`` describes a pass."""
    if expected is None or (wrong and not wrong.startswith(expected.profile and f"{expected.profile}:")):
        return Finding(name, "FAIL" if wrong else "ok", wrong or meant)
    if wrong:
        return Finding(name, "expected", one_line(f"{expected.because} ({expected.source}): {wrong}"))
    return Finding(name, "unexpected pass", one_line(f"it passes, but is listed as failing: {expected.because}"))
