"""Checks as pytest items: ``pytest --crosscheck ENGINE --scenes bounce,slide`` gates an engine in its own repository.

    PASS                        passed; a finding of other releases that passes here is reported as fixed
    FAIL, known or explained    xfailed, with the reason
    FAIL, new or drifted        failed; so does a finding of this release that passes (strict)
    no answer                   failed; UNSUPPORTED is skipped

Loaded by `contact_crosscheck.pytest_configure`, only on demand.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from adapters import registry
from adapters.engine import EngineError
from adapters.scene import SceneError
from reports.wording import measured, plural, profiles_called, quantity, reproduce
from validation.catalogue import matching
from validation.cells import Slot, plane_of, slot_from_dict
from validation.judging.rows import Row, rows_of
from validation.judging.verdicts import Physics, Standing
from validation.posed import resolve
from validation.releases.history import finding_of, mended
from validation.running.plan import Request, slots
from validation.workers import run_cells


class Failed(Exception):
    """A check that fails; the message is its report."""


class Plugin:
    """Adds the items, and reports fixed findings at the end."""

    def __init__(self, config: pytest.Config) -> None:
        self.engine = str(config.getoption("--crosscheck"))
        try:
            found = registry.find(self.engine)
            if found.engine is None:
                raise EngineError(f"engine: {self.engine} is not installed: {found.reason}")
            self.slots = _slots(self.engine, config.getoption("--scenes"), config.getoption("--crosscheck-profile"))
        except (EngineError, SceneError) as error:
            raise pytest.UsageError(f"crosscheck: {error}") from None
        self.version = found.version
        self.rows: dict[tuple[Slot, str], Row] = {}
        self.ran: set[str] = set()
        self.mended: list[str] = []

    def pytest_report_header(self) -> str:
        """Line with the engines and scenes."""
        return f"crosscheck: {self.engine} {self.version}, {plural(len(self.slots), 'case')}"

    @pytest.hookimpl(tryfirst=True)
    def pytest_collection_modifyitems(self, session: pytest.Session, items: list[pytest.Item]) -> None:
        """Add an item per check after the collected tests, before deselection."""
        cells = _Cells.from_parent(session, name="crosscheck", nodeid="crosscheck", plugin=self)
        items.extend(cells.collect())

    def row_of(self, slot: Slot, metric: str) -> Row | None:
        """Row of a check; the cases of its scene run with the first of them."""
        if slot.scene not in self.ran:
            self.ran.add(slot.scene)
            own = [each for each in self.slots if each.scene == slot.scene]
            for row in rows_of("", list(run_cells(own, 0))):
                self.rows.setdefault((slot_from_dict(row.slot), row.metric), row)
        return self.rows.get((slot, metric))

    def pytest_terminal_summary(self, terminalreporter: Any) -> None:
        """List findings of other releases that pass here."""
        if self.mended:
            terminalreporter.section("crosscheck: fixed")
            for line in self.mended:
                terminalreporter.line(line)


def _slots(engine: str, scenes: str, profiles: str) -> list[Slot]:
    names = [scene.name for word in (scenes or "*").split(",") for scene in matching(word.strip())]
    chosen = [word.strip() for word in profiles.split(",") if word.strip()]
    return slots(Request(list(dict.fromkeys(names)), [engine], profiles_called(chosen, [engine])))


class _Cells(pytest.Collector):
    """All checks of all cases."""

    def __init__(self, plugin: Plugin, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.plugin = plugin

    def collect(self) -> Iterator[pytest.Item]:
        """Checks that have a tolerance, case by case."""
        facts = registry.facts(self.plugin.engine)
        lifted = facts is not None and 2 not in facts.dimensions
        for slot in self.plugin.slots:
            canonical = resolve(slot.scene)
            scene = canonical.scene(slot.dimension, dict(slot.params))
            asked = slot.params_text() + (f" iterations={slot.iterations}" if slot.iterations else "")
            cell = f"{slot.engine}/{slot.profile}/{slot.scene} {slot.dimension}-D {asked}".rstrip()
            for check in [*canonical.checks(scene, slot.dt), *(lifted * plane_of(canonical, scene, slot.dt))]:
                if check.bound is not None:
                    yield _Check.from_parent(self, name=f"{cell}::{check.metric}", plugin=self.plugin, slot=slot,
                                             metric=check.metric)  # fmt: skip


class _Check(pytest.Item):
    """One check of one case."""

    def __init__(self, plugin: Plugin, slot: Slot, metric: str, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.plugin, self.slot, self.metric = plugin, slot, metric
        self.extra_keyword_matches |= {"crosscheck", slot.scene, slot.profile, metric}

    def runtest(self) -> None:
        """Pass, fail, or fail as known; see the module's docstring."""
        row = self.plugin.row_of(self.slot, self.metric)
        if row is None:
            raise Failed(f"there is no result of {self.metric}: the case did not finish")
        self.user_properties += [("value", row.value), ("truth", row.truth), ("tolerance", row.tolerance)]
        if row.outcome == "unsupported" or (row.outcome == "refused" and row.standing is None):
            pytest.skip(row.reason)
        finding = finding_of(row)
        elsewhere = finding is not None and not finding.family.holds_for(row.engine_version)
        if row.physics == Physics.PASS.value and row.standing != Standing.DRIFTED.value:
            if mended(row):
                self.plugin.mended.append(f"{self.name}: {row.reason or 'listed for other releases'}")
            return
        if row.physics == Physics.FAIL.value or row.standing in (Standing.KNOWN.value, Standing.EXPLAINED.value):
            if row.standing in (Standing.KNOWN.value, Standing.EXPLAINED.value):
                pytest.xfail(row.reason)
            if elsewhere and finding is not None:
                pytest.xfail(f"as listed for {finding.family.releases}: {finding.family.reason}")
        raise Failed(_report(row))

    def repr_failure(self, excinfo: Any, style: Any = None) -> Any:
        """Only the report, without the place of the exception."""
        if isinstance(excinfo.value, Failed):
            return str(excinfo.value)
        return super().repr_failure(excinfo, style)

    def reportinfo(self) -> tuple[Any, int | None, str]:
        """Shown in place of a test's file and line."""
        return "crosscheck", None, self.name


def _report(row: Row) -> str:
    plain = row.as_dict()
    lines = [
        f"measured   {measured(plain, 8)}" if row.value is not None else f"no value   {row.reason or row.outcome}",
        f"truth      {quantity(row.truth, row.unit, 8)}",
        f"tolerance  {quantity(row.tolerance, row.unit, 4)}: {row.because}",
        f"standing   {row.standing or row.outcome}{': ' + row.reason if row.reason else ''}",
        f"again      {reproduce(row.slot)}",
    ]
    return "\n".join(lines)
