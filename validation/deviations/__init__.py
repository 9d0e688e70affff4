"""Deviation laws of the engines, as data; one module per engine.

This package, `validation.experiments` and `validation.findings` are the only places in `validation` where engines have
names.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from importlib import import_module
from importlib.util import find_spec

from validation.deviation import Deviation


@cache
def deviations_of(engine: str) -> tuple[Deviation, ...]:
    """All laws of ``engine``; none for an engine without a module here."""
    if find_spec(f"{__name__}.{engine}") is None:
        return ()
    return tuple(import_module(f"{__name__}.{engine}").DEVIATIONS)


def covering(engine: str, version: str, profile: str, scene: str, metric: str) -> Iterator[Deviation]:
    """Laws that speak about a row."""
    return (law for law in deviations_of(engine) if law.covers(engine, version, profile, scene, metric))
