"""The toy engine of the conformance kit, healthy or with one planted fault."""

import math
from functools import cache

import pytest

from adapters.conformance.faults import FAULTS, FaultyToy
from adapters.conformance.toy import ToyEngine


@cache
def toy_engine(fault="", size=None):
    """One engine per fault, so that its receipts are measured once."""
    return FaultyToy(fault, size or max(FAULTS[fault].sizes, default=math.nan)) if fault else ToyEngine()


@pytest.fixture
def toy():
    """`toy(fault, size)` is a toy engine with a planted fault, `toy()` a healthy one."""
    return toy_engine


@pytest.fixture
def toy_class():
    """The healthy toy's class, for tests that change one method."""
    return ToyEngine
