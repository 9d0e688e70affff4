"""Releases of an engine: their distributions, requirements, and differences of their interfaces.

An adapter is written for the newest release. Differences of older ones are in one table per engine
(`adapters/<engine>/releases.py`) as rows of `Difference`, beside the code that handles them, so the adapter itself has
one interface. Nothing here needs more than Python: it is read where an old release is driven as well.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Distribution:
    """A package that carries an engine's releases ``versions`` (a version specifier such as ``>=3,<4``; "" is all)."""

    name: str
    versions: str = ""


@dataclass(frozen=True)
class Requirement:
    """What releases ``versions`` need beyond their metadata, in pip's syntax (``numpy<2``)."""

    versions: str
    needs: str
    because: str


@dataclass(frozen=True)
class Difference:
    """A difference of releases ``versions`` (in words) from the adapter's release, and how it is handled."""

    versions: str
    what: str
    handled: str
    source: str


@dataclass(frozen=True)
class Releases:
    """Everything about an engine's releases.

    Parameters
    ----------
    distributions
        An engine may have had several package names; a version is searched in those whose specifier contains it.
    known
        Releases that the adapter has run; others are UNSUPPORTED unless --try is given.
    withheld
        Releases in the range that cannot run: version -> why.
    """

    distributions: tuple[Distribution, ...]
    known: str = ""
    requirements: tuple[Requirement, ...] = ()
    differences: tuple[Difference, ...] = ()
    withheld: Mapping[str, str] = field(default_factory=dict)
