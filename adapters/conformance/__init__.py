"""Conformance checks of adapters, without a test framework.

    statements    facts, profiles, refusals, capabilities
    worlds        start, read-back, shared state, the same bits again, memory
    mechanics     free fall, momentum, contacts and their impulses, symmetry
    shapes        size along each axis and each moment of inertia, of each shape
    parameters    the property checks of every profile
    toy, faults   a correct engine, and faults for it
    self_test     each fault is noticed by its check

Each check is a function of an engine that returns the first error, or "" if there is none. From Python::

    from adapters.conformance import check_adapter
    assert all(finding.holds for finding in check_adapter(MyEngine()))

as pytest items, one for each check::

    from adapters.conformance import items

    @pytest.mark.parametrize("item", items(MyEngine()), ids=str)
    def test_conformance(item):
        item.hold()

and from the command as ``crosscheck check-adapter NAME``. Known failures are in `Engine.expected`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

from adapters.conformance import mechanics, shapes, statements, worlds
from adapters.conformance.finding import Check, Finding, NotAsked, found
from adapters.conformance.parameters import PROBES, receipt_findings
from adapters.engine import Engine
from adapters.receipts import QUANTITIES

__all__ = ["CHECKS", "Finding", "Item", "NotAsked", "check_adapter", "items"]

CHECKS: dict[str, Check] = {
    "packages": statements.packages,
    "facts": statements.facts,
    "profiles": statements.profiles,
    "refusals": statements.refusals,
    "bad_numbers": statements.bad_numbers,
    "capabilities": statements.capabilities,
    "states": worlds.states,
    "readback": worlds.readback,
    "free_fall": mechanics.free_fall,
    "momentum": mechanics.momentum,
    "spin": mechanics.spin,
    "contacts": mechanics.contacts,
    "impulse": mechanics.impulse,
    "sampling": mechanics.sampling,
    "sizes": shapes.sizes,
    "moments": shapes.moments,
    "order": mechanics.order,
    "mirror": mechanics.mirror,
    "quarter_turn": mechanics.quarter_turn,
    "fresh": worlds.fresh,
    "repeat": worlds.repeat,
    "history": worlds.history,
    "process": worlds.process,
    "stride": worlds.stride,
    "memory": worlds.memory,
}


def check_adapter(engine: Engine) -> list[Finding]:
    """Run every check on ``engine``; an exception of the engine is a finding, never raised."""
    findings = [found(name, check, engine) for name, check in CHECKS.items()] + _receipts(engine)
    told = {finding.check for finding in findings}
    for each in engine.expected:
        if each.check not in told:
            findings.append(Finding(each.check, "FAIL", "Engine.expected names it, and there is no such check"))
    return findings


@dataclass(frozen=True)
class Item:
    """One check of one engine, for a test framework."""

    name: str
    measure: Callable[[], Finding]

    def __str__(self) -> str:
        """The check's name."""
        return self.name

    def hold(self) -> Finding:
        """Run the check.

        Raises
        ------
        AssertionError
            If it does not hold; the message is the finding's line.
        """
        finding = self.measure()
        if not finding.holds:
            raise AssertionError(str(finding))
        return finding


def items(engine: Engine) -> list[Item]:
    """Every check of ``engine``, not run yet; property checks are measured once for all quantities."""

    def check(name: str) -> Callable[[], Finding]:
        return lambda: found(name, CHECKS[name], engine)

    def receipt(name: str) -> Callable[[], Finding]:
        holds = Finding(name, "ok", "as declared in every profile")
        return lambda: next((each for each in _receipts(engine) if each.check == name), holds)

    names = [PROBES, *(f"receipt {quantity}" for quantity in QUANTITIES)]
    return [Item(name, check(name)) for name in CHECKS] + [Item(name, receipt(name)) for name in names]


_receipts = lru_cache(maxsize=8)(receipt_findings)
