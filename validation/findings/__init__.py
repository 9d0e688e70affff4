"""Known failures: families of failing rows, each member with its value and band, each family with its cause.

    family    one engine, one scene, its profiles and metrics, reason, source, releases for which it holds
    proof     of a family: a row that passes when settings switch the mechanism off (`validation.findings.proofs`)
    member    one row of the standard suite: the value found, and the band within which it is the same finding

A row is *known* while its value lies within the band of its member; outside it is *drifted*, on either side and whether
it passes or fails. A band is a half width, or two ends where it is not symmetric (`validation.judging.acceptance`
measures both, and tests whether a band is too wide to show drift). A member without a value means that the check has
none on this row, for the reason of its family. Rows outside the standard suite have no members: a family describes
them, but they have no standing.

Findings are in the engine's folder (`validation.findings.files` reads them). An engine without findings is *unlisted*:
its FAILs have no standing and do not fail the command.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache

from adapters import registry
from adapters.experiment import Experiment
from validation.cells import Slot, format_dt
from validation.running.plan import is_standard, left_out

#: Identity of a row within its engine: profile, scene, dimension, params, dt, iterations, metric.
Key = tuple[str, ...]


class FindingsError(ValueError):
    """A file of findings is wrong; one line that names file and entry."""


@dataclass(frozen=True)
class Family:
    """Rows that fail for the same reason.

    Parameters
    ----------
    profiles, metrics
        Names; ``("*",)`` is all of them, but never for both. A metric with an index is named without it.
    reason, source
        The mechanism in one to three sentences, and where it is documented, read or measured.
    releases
        Versions of the engine for which it holds, as a version specifier (``>=3.2.7,<3.3``).
    proofs
        Experiments that show the mechanism (`validation.findings.proofs`).
    """

    id: str
    profiles: tuple[str, ...]
    scene: str
    metrics: tuple[str, ...]
    reason: str
    source: str
    releases: str
    proofs: tuple[Experiment, ...] = field(default=(), compare=False, repr=False)

    def covers(self, key: Key) -> bool:
        """Whether this family covers a row of its engine."""
        profile, scene, metric = key[0], key[1], key[6].partition("[")[0]
        return scene == self.scene and _among(profile, self.profiles) and _among(metric, self.metrics)

    def holds_for(self, version: str) -> bool:
        """Whether it was found in this release of the engine."""
        from packaging.specifiers import SpecifierSet
        from packaging.version import InvalidVersion

        try:
            return SpecifierSet(self.releases).contains(version, prereleases=True)
        except InvalidVersion:
            return False


@dataclass(frozen=True)
class Unsupported:
    """Cells that an engine cannot run, and why; ``"*"`` and 0 mean any scene and any dimension.

    ``params`` are required values, of those that differ from the scene's defaults.
    """

    id: str
    profiles: tuple[str, ...]
    scene: str
    dimension: int
    reason: str
    source: str
    params: tuple[tuple[str, float], ...] = ()

    def covers(self, slot: Slot) -> bool:
        """Whether the engine cannot run this slot."""
        return (
            _among(slot.profile, self.profiles)
            and self.scene in ("*", slot.scene)
            and self.dimension in (0, slot.dimension)
            and set(self.params) <= set(slot.params)
        )


@cache
def solutions_of(engine: str) -> frozenset[str]:
    """Exact profiles: a failure there is a defect and never listed as known."""
    facts = registry.facts(engine)
    return frozenset(name for name, role in facts.roles.items() if role == "solution") if facts else frozenset()


def _among(name: str, names: tuple[str, ...]) -> bool:
    return name in names or "*" in names


@dataclass(frozen=True)
class Finding:
    """A member of a family: what was found on one row.

    Parameters
    ----------
    value
        In the metric's unit; None where the row has no value.
    band
        Half width within which it is the same finding.
    diverged
        The cell ended with numbers that are not finite.
    ends
        Least and largest value of the same finding, where that is not ``band`` on both sides.
    text
        Value and band as written in the file, which writing again must not change.
    """

    family: Family
    value: float | None
    band: float = 0.0
    diverged: bool = False
    ends: tuple[float, float] | None = None
    text: tuple[str, str] | None = field(default=None, compare=False)

    def holds(self, value: float) -> bool:
        """Whether a value is the same finding; False for a member without a value."""
        if self.value is None:
            return False
        return abs(value - self.value) <= self.band if self.ends is None else self.ends[0] <= value <= self.ends[1]

    @property
    def band_text(self) -> str:
        """Value and band as people read them; for a member that has a value."""
        if self.ends is not None:
            return f"{self.value:.6g}, from {self.ends[0]:.3g} to {self.ends[1]:.3g}"
        return f"{self.value:.6g} +- {self.band:.1g}"


@dataclass(frozen=True)
class Findings:
    """All known failures of one engine."""

    engine: str
    families: Mapping[str, Family]
    unsupported: tuple[Unsupported, ...]
    members: Mapping[Key, Finding]

    def family_of(self, key: Key) -> Family | None:
        """First family that covers a row."""
        return next((family for family in self.families.values() if family.covers(key)), None)

    def unsupported_by(self, slot: Slot) -> Unsupported | None:
        """Why the engine cannot run this slot, if that is listed."""
        return next((entry for entry in self.unsupported if entry.covers(slot)), None)


def row_key(slot: Slot, metric: str) -> Key:
    """Identity of a row within its engine's findings."""
    iterations = "" if slot.iterations is None else str(slot.iterations)
    dt = format_dt(slot.dt)
    return (slot.profile, slot.scene, str(slot.dimension), slot.params_text(), dt, iterations, metric)


@dataclass(frozen=True)
class Known:
    """What is known about one row before it is judged.

    Parameters
    ----------
    finding
        Its entry, if there is one that holds for the release that ran.
    expected
        Whether a failing row must have an entry: its engine has findings, and no family covers it outside the standard
        suite.
    remark
        A remark: the family of a row outside the suite, or an entry of other releases.
    """

    finding: Finding | None
    expected: bool
    remark: str = ""


def known_of(slot: Slot, metric: str, version: str, findings: Findings | None) -> Known:
    """Look a row up, for the release ``version`` that ran."""
    if findings is None:
        return Known(None, False, "the engine has no list of findings")
    key = row_key(slot, metric)
    finding = findings.members.get(key)
    if finding is not None:
        family = finding.family
        if family.holds_for(version):
            return Known(finding, True)
        return Known(None, True, f"listed for releases {family.releases} only: {family.reason}")
    if why := left_out(slot.engine).get(slot.scene):
        return Known(None, False, f"no suite runs this scene on {slot.engine}: {why}")
    like = None if is_standard(slot) else findings.family_of(key)
    if like is not None and like.holds_for(version):
        return Known(None, False, f"outside the standard suite, not listed; rows like it: {like.reason}")
    return Known(None, True)
