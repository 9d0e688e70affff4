"""A fault that the second profile alone has is found as that profile's, at the smallest size that must be seen."""

import math

import pytest
from listening import Listening

from adapters.conformance import CHECKS
from adapters.conformance.faults import FAULTS

#: Faults of the engine and not of a profile, or told by the count that tells profiles apart here.
OF_ALL = {"role that does not exist", "unknown settings ignored", "count below 1 is accepted"}
OF_ONE = [name for name, fault in FAULTS.items()
          if name not in OF_ALL and fault.check in CHECKS and fault.check not in ("memory", "process")]  # fmt: skip


@pytest.mark.parametrize("name", OF_ONE)
def test_fault_of_the_second_profile_found(name):
    fault = FAULTS[name]
    engine = Listening(name, min(fault.sizes, default=math.nan))
    said = CHECKS[fault.check](engine)
    assert said.startswith("second: ") and len(said.splitlines()) == 1
    assert all(world.closed == 1 for world in engine.built)


def test_unknown_setting_tried_on_the_first_profile():
    assert CHECKS["refusals"](Listening("unknown settings ignored", at="first")) == "an unknown setting is accepted"
    assert (
        CHECKS["bad_numbers"](Listening("count below 1 is accepted", at="first")) == "first: iterations = 0 is accepted"
    )
