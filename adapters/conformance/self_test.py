"""Tests the checks: every fault, at every size, must be noticed by its check."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from adapters.conformance import CHECKS, check_adapter
from adapters.conformance.faults import FAULTS, FaultyToy
from adapters.conformance.finding import found
from adapters.conformance.scenes import DT
from adapters.conformance.toy import ToyEngine
from adapters.engine import Engine
from adapters.needs import Needs
from adapters.receipts import receipts

#: A spatial impact with friction: the kind of scene whose property checks measure every quantity.
EVERYTHING = Needs(3, True, 0.5, 0.5, "impact", True, 1.0, 6.0, 1.0, 9.81, 9.81)
RECEIPT = "receipt "


@dataclass(frozen=True)
class Caught:
    """One fault of one size, NaN where it has none: its check, whether that noticed it, and its message."""

    fault: str
    check: str
    size: float
    unit: str
    caught: bool
    message: str


def self_test() -> Iterator[Caught]:
    """First the correct toy, for which every check must hold; then every fault."""
    wrong = [str(finding) for finding in check_adapter(ToyEngine()) if finding.status != "ok"]
    yield Caught("none: the healthy toy", "all", math.nan, "", not wrong, wrong[0] if wrong else "every check holds")
    for name, fault in FAULTS.items():
        for size in fault.sizes or (math.nan,):
            said = broken(FaultyToy(name, size), fault.check)
            yield Caught(name, fault.check, size, fault.unit, bool(said), said or "nothing noticed")


def broken(engine: Engine, check: str) -> str:
    """Error found by the check of that name in an engine with one profile; nothing if it holds.

    Property checks are those of one kind of scene of `check_adapter`, which therefore notices the same faults.
    """
    if not check.startswith(RECEIPT):
        finding = found(check, CHECKS[check], engine)
        return "" if finding.status == "ok" else finding.message
    (profile,) = engine.profiles
    for slip in receipts(engine, profile, EVERYTHING, DT):
        if slip.quantity == check.removeprefix(RECEIPT) and not slip.holds:
            return f"measured {slip.measured:.6g}, declared {slip.declared:.6g} +- {slip.band:.2g}"
    return ""
