"""Releases of an engine: which distributions carry them, what each needs, and what its interface does differently.

An adapter is written for the newest release. What older ones do differently stands in one table per engine
(`adapters/<engine>/releases.py`) as rows of `Difference`, with the code that handles them beside it: whoever reads an
adapter sees one interface, whoever asks "since when?" sees one table. Nothing here needs more than Python: it is read
where an old release is driven as well.
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
    """What releases ``versions`` need that their own metadata does not say, as pip reads it (``numpy<2``)."""

    versions: str
    needs: str
    because: str


@dataclass(frozen=True)
class Difference:
    """What differs in releases ``versions`` (in words) from what the adapter is written for, and how it is handled."""

    versions: str
    what: str
    handled: str
    source: str


@dataclass(frozen=True)
class Releases:
    """All that an adapter knows of its engine over time.

    Parameters
    ----------
    distributions
        One engine may have had several names; each version is looked for in those whose specifier holds it.
    known
        Releases that the adapter has driven; outside of it a release is UNSUPPORTED unless it is asked for with --try.
    withheld
        Releases that cannot be driven although they lie in the range: version -> why.
    """

    distributions: tuple[Distribution, ...]
    known: str = ""
    requirements: tuple[Requirement, ...] = ()
    differences: tuple[Difference, ...] = ()
    withheld: Mapping[str, str] = field(default_factory=dict)
