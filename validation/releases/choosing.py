"""Selects releases: ``3.0.0..4.0.1``, ``3.0.0,3.1.6`` or ``latest``, from pip's registry."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache

from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet
from packaging.utils import canonicalize_name
from packaging.version import InvalidVersion, Version

from adapters import registry
from adapters.engine import EngineError
from adapters.extras import required
from adapters.plain import one_line
from adapters.releases import Distribution, Releases

#: Time limit of the registry [s]; it usually answers within two.
PATIENCE = 60.0
#: Syntax of a version.
_VERSION = re.compile(r"[0-9][0-9A-Za-z.+!-]{0,40}")


class RegistryError(EngineError):
    """The package registry does not answer, or does not have the version; one line."""


@dataclass(frozen=True)
class Release:
    """One release of an engine, and its requirements for pip.

    Parameters
    ----------
    distribution
        Name of the package with this release.
    needs
        Further requirements of pip; numpy is always one.
    unknown
        Why the adapter does not support this release; empty if it does.
    """

    engine: str
    version: str
    distribution: str
    needs: tuple[str, ...]
    unknown: str = ""

    @property
    def name(self) -> str:
        """``myengine==3.2.7``, with the engine's name, not the distribution's."""
        return f"{self.engine}=={self.version}"

    @property
    def requirements(self) -> tuple[str, ...]:
        """Requirements for pip."""
        return (f"{self.distribution}=={self.version}", *self.needs)


def known_releases(engine: str) -> Releases:
    """Return the table of releases of an engine.

    An engine without a table has one distribution, its package. For an adapter of this project the supported releases
    are those of its extra; otherwise all are.

    Raises
    ------
    EngineError
        If there is no such engine, or it is the solver of this package, which has no releases.
    """
    registry.find(engine)
    adapter, facts = registry.adapter(engine), registry.facts(engine)
    if adapter is not None and adapter.releases is not None:
        return adapter.releases
    if facts is None or engine == registry.solver():
        raise EngineError(f"engine: {engine} has no releases to choose from")
    return Releases((Distribution(facts.package),), known=_range(facts.package) if adapter is not None else "")


def _range(package: str) -> str:
    """Versions of a package in this project's extras, as a specifier; "" if none names it."""
    asked = [Requirement(text) for text in required()]
    name = canonicalize_name(package)
    return next((str(each.specifier) for each in asked if canonicalize_name(each.name) == name), "")


def chosen(engine: str, text: str) -> list[Release]:
    """Releases selected by ``text``, oldest first.

    Raises
    ------
    EngineError
        If the engine has none, a version is malformed, or the range is empty.
    RegistryError
        If a range or ``latest`` is given and the registry does not answer.
    """
    known = known_releases(engine)
    if text == "latest":
        return [offered(engine)[-1]]
    first, dots, last = text.partition("..")
    if not dots:
        versions = sorted({_version(word) for word in text.split(",") if word.strip()})
        if not versions:
            raise EngineError("releases: none is named; write A..B, a list such as 3.0.0,3.1.6, or latest")
        return [release(engine, known, str(version)) for version in versions]
    low, high = (_version(word) if word else None for word in (first, last))
    found = [r for r in offered(engine) if _within(Version(r.version), low, high)]
    if not found:
        raise EngineError(f"releases: {engine} has no release in {text}; it has {_ends(offered(engine))}")
    return found


def _ends(found: list[Release]) -> str:
    return f"{found[0].version} to {found[-1].version}" if found else "none"


def _version(word: str) -> Version:
    try:
        if not _VERSION.fullmatch(word.strip()):
            raise InvalidVersion(word)
        return Version(word.strip())
    except InvalidVersion:
        raise EngineError(f"releases: {one_line(word, 40)!r} is not a version such as 3.2.7") from None


def _within(version: Version, low: Version | None, high: Version | None) -> bool:
    return (low is None or version >= low) and (high is None or version <= high)


def release(engine: str, known: Releases, version: str) -> Release:
    """Return the release ``version`` with its distribution and requirements."""
    carriers = [d for d in known.distributions if SpecifierSet(d.versions).contains(version, prereleases=True)]
    if not carriers:
        raise EngineError(f"releases: no distribution of {engine} has {version}")
    needs = [r.needs for r in known.requirements if SpecifierSet(r.versions).contains(version, prereleases=True)]
    if not any(re.match(r"numpy\b", each) for each in needs):
        needs.append("numpy")  # needed by the adapter; not every engine installs it
    unknown = known.withheld.get(version, "")
    if not unknown and not SpecifierSet(known.known).contains(version, prereleases=True):
        unknown = f"its adapter supports {known.known}; --try runs it all the same"
    return Release(engine, version, carriers[0].name, tuple(needs), unknown)


def ported(engine: str, ports: Sequence[str], version: str = "") -> Release:
    """Return a release of ``engine`` with the same release of each port, in one environment.

    The newest one that all of them have, unless ``version`` is given; none that is known to be bad.

    Raises
    ------
    EngineError
        If one is no port of ``engine``, or there is no such release.
    RegistryError
        If the registry does not answer.
    """
    known = ports_of(engine)
    if not known:
        said = f"no port of {engine} is known" if engine in registry.names() else f"no engine is called {engine!r}"
        told = {name: ", ".join(ports_of(name)) for name in registry.names()}
        with_ports = "; ".join(f"{name} with {ports}" for name, ports in told.items() if ports)
        raise EngineError(f"ports: {said}; these can be compared: {with_ports}")
    for name in ports:
        if name not in known:
            raise EngineError(f"ports: {name} is no port of {engine}; ports: {', '.join(known)}")
    facts = registry.facts(engine)
    bad = facts.known_bad_versions if facts else {}
    own = known_releases(engine)
    every = {name: {_beside(own, each): each for each in offered(name)} for name in (engine, *ports)}
    common = set.intersection(*map(set, every.values())) - set(bad)
    found = sorted((each for each in common if version in ("", each)), key=Version)
    if not found:
        raise EngineError(f"ports: {', '.join((engine, *ports))} have no release {version or 'in common'}")
    chosen = release(engine, own, found[-1])
    needs = [need for name in ports for need in every[name][found[-1]].requirements]
    return replace(chosen, needs=tuple(dict.fromkeys((*chosen.needs, *needs))))


def _beside(own: Releases, port: Release) -> str:
    """Release of an engine beside which a port runs: the one that the port requires, or the one of the same number."""
    names = {distribution.name for distribution in own.distributions}
    asked = [Requirement(need) for need in port.needs]
    return next((pinned for each in asked if each.name in names for pinned in each.specifier), port).version


def ports_of(engine: str) -> dict[str, str]:
    """Ports of an engine, each with its package."""
    told = {name: registry.facts(name) for name in registry.names()}
    return {name: facts.package for name, facts in told.items() if facts and facts.port_of == engine}


@cache
def offered(engine: str) -> list[Release]:
    """All releases in the registry for this interpreter, oldest first; raises as `chosen`."""
    known = known_releases(engine)
    found: dict[Version, Release] = {}
    for distribution in known.distributions:
        for version in _listed(distribution.name):
            if SpecifierSet(distribution.versions).contains(version):
                found[version] = release(engine, known, str(version))
    return [found[version] for version in sorted(found)]


def _listed(distribution: str) -> list[Version]:
    """Versions of a package in pip's registry."""
    command = [sys.executable, "-m", "pip", "index", "versions", distribution, "--disable-pip-version-check"]
    try:
        asked = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE)
    except (OSError, subprocess.TimeoutExpired):
        raise RegistryError(f"releases: the package registry does not answer for {distribution}") from None
    listed = re.search(r"^Available versions: (.*)$", asked.stdout, re.MULTILINE)
    if asked.returncode or listed is None:
        said = [line for line in asked.stderr.splitlines() if line.startswith("ERROR")]
        why = one_line(said[-1].removeprefix("ERROR: ")) if said else "pip gave no list"
        raise RegistryError(f"releases: the package registry has no list of {distribution}: {why}")
    versions = []
    for word in listed[1].split(","):
        try:
            versions.append(Version(word.strip()))
        except InvalidVersion:
            continue  # from before versions had rules
    return [version for version in versions if not version.is_prerelease]
