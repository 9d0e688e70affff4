"""What a check of the kit found: it holds, it fails, it could not be asked, or it fails as is known."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from adapters.engine import Engine, Expected
from adapters.plain import one_line

Status = Literal["ok", "FAIL", "refused", "expected", "unexpected pass"]
#: A check looks at an engine and returns the first thing wrong, or nothing.
Check = Callable[[Engine], str]


class NotAsked(Exception):
    """The engine refuses every scene that a check has for it; the message is its reason, in one line."""


@dataclass(frozen=True)
class Finding:
    """What one check found.

    Parameters
    ----------
    status
        ``ok``; ``FAIL``; ``refused``: nothing was measured, which is no pass; ``expected``: it fails as the engine's
        `Engine.expected` says; ``unexpected pass``: it holds although that says it would not.
    """

    check: str
    status: Status
    message: str

    @property
    def holds(self) -> bool:
        """Whether nothing is wrong that is not known."""
        return self.status in ("ok", "refused", "expected")

    def __str__(self) -> str:
        """One line."""
        return f"{self.status:8s}  {self.check}: {self.message}"


def found(name: str, check: Check, engine: Engine) -> Finding:
    """Run one check; whatever the engine raises is a finding."""
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
    """Finding of a check that found ``wrong``, or nothing; ``meant`` says what holds then."""
    if expected is None:
        return Finding(name, "FAIL" if wrong else "ok", wrong or meant)
    if wrong:
        return Finding(name, "expected", one_line(f"{expected.because} ({expected.source}): {wrong}"))
    return Finding(name, "unexpected pass", one_line(f"it passes, but is listed as failing: {expected.because}"))
