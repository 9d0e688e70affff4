"""Property checks of every profile as findings, one for each quantity."""

from __future__ import annotations

import math
from itertools import product

from adapters.conformance.finding import Finding, judged
from adapters.conformance.statements import all_needs
from adapters.engine import Engine
from adapters.plain import one_line
from adapters.receipts import QUANTITIES, receipts

#: Steps of property checks [s]: slowest and fastest of the usual range.
STEPS = (1.0 / 60.0, 1.0 / 240.0)
PROBES = "receipt probes"


def receipt_findings(engine: Engine) -> list[Finding]:
    """One finding per quantity: the first property check of any profile that fails, or that all hold.

    A quantity that was measured in no case is refused; one that some profiles refuse holds, with the cases without a
    measurement.
    """
    broken: dict[str, str] = {}
    silent: dict[str, str] = {}
    measured: set[str] = set()
    for profile, asked, dt in product(engine.profiles, all_needs(engine), STEPS):
        where = f"{profile}, {asked.dimension}-D, {asked.regime}, e {asked.restitution:g}, dt {dt:.5f}"
        try:
            slips = receipts(engine, profile, asked, dt)
        except Exception as error:  # a plugin may raise anything
            broken.setdefault(PROBES, one_line(f"{where}: {type(error).__name__}: {error}"))
            continue
        for slip in slips:
            if not slip.holds:
                told = f"measured {slip.measured:.6g}, declared {slip.declared:.6g} +- {slip.band:.2g}"
                broken.setdefault(slip.quantity, one_line(f"{where}: {told} ({slip.because})"))
            if math.isnan(slip.measured):
                silent.setdefault(slip.quantity, f"{where}: {slip.because}")
            else:
                measured.add(slip.quantity)
    expected = {each.check: each for each in engine.expected}
    findings = [Finding(PROBES, "FAIL", broken[PROBES])] if PROBES in broken else []
    for quantity in QUANTITIES:
        name = f"receipt {quantity}"
        if quantity not in broken and quantity not in measured:
            why = silent.get(quantity, "no probe was measured")
            findings.append(Finding(name, "refused", one_line(why)))
            continue
        good = "as declared in every profile"
        if quantity in silent:
            good = f"as declared wherever it was measured; not so at {silent[quantity]}"
        findings.append(judged(name, broken.get(quantity, ""), one_line(good), expected.get(name)))
    return findings
