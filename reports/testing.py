"""Checks as pytest items: ``pytest --crosscheck ENGINE --scenes bounce,slide`` gates an engine in its own repository.

ENGINE is the name of an installed engine, or FILE.py:CLASS of an adapter in a test file, which runs in this process.

    PASS                        passed; a finding of other releases that passes here is reported as fixed
    FAIL, known or explained    xfailed, with the reason
    FAIL, new or drifted        failed; so does a finding of this release that passes (strict)
    no answer                   failed; UNSUPPORTED is skipped

``--scenes core`` adds a test per scene of the core suite instead, in which known failures fail, and a table of errors
over steps.

Loaded by `contact_crosscheck.pytest_configure`, only on demand.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from adapters import registry
from adapters.engine import EngineError
from adapters.isolation.foreign import said_by
from adapters.plain import NAME, one_line
from adapters.scene import SceneError
from reports.wording import measured, plural, profiles_called, quantity, reproduce
from validation.catalogue import matching
from validation.cells import Observation, Slot, format_dt, plane_of, slot_from_dict
from validation.judging.rows import Row, rows_of
from validation.judging.verdicts import Physics, Standing
from validation.posed import resolve
from validation.questions import core
from validation.questions.core import Line
from validation.releases.history import finding_of, mended
from validation.running.execution import execute
from validation.running.plan import Request, slots
from validation.workers import run_cells

#: Word of ``--scenes`` for the core suite.
CORE = "core"


class Failed(Exception):
    """A check that fails; the message is its report."""


class Plugin:
    """Adds the items, and reports fixed findings at the end."""

    def __init__(self, config: pytest.Config) -> None:
        try:
            self.engine = _introduced(str(config.getoption("--crosscheck")))
            found = registry.find(self.engine)
            if found.engine is None:
                raise EngineError(f"engine: {self.engine} is not installed: {found.reason}")
            words = [word.strip() for word in (config.getoption("--scenes") or "*").split(",")]
            profiles = config.getoption("--crosscheck-profile")
            checked = [word for word in words if word != CORE]
            self.slots = _slots(self.engine, checked, profiles)
            self.core = _core_slots(self.engine, profiles) if CORE in words else []
        except (EngineError, SceneError) as error:
            raise pytest.UsageError(f"crosscheck: {error}") from None
        self.version = found.version
        self.lines: list[Line] = []
        self.asked = self.judged = 0
        self.rows: dict[tuple[Slot, str], Row] = {}
        self.ran: set[str] = set()
        self.mended: list[str] = []

    def pytest_report_header(self) -> str:
        """Line with the engines and scenes."""
        cases = plural(len(self.slots) + sum(map(len, self.core)), "case")
        return f"crosscheck: {self.engine} {self.version}, {cases}"

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
            for row in rows_of("", _observed(own)):
                self.rows.setdefault((slot_from_dict(row.slot), row.metric), row)
        return self.rows.get((slot, metric))

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Count own tests, and those that gave a verdict."""
        if report.nodeid.startswith("crosscheck::") and report.when == "call":
            self.asked += 1
            self.judged += not report.skipped or hasattr(report, "wasxfail")

    def pytest_sessionfinish(self, session: pytest.Session, exitstatus: int) -> None:
        """A run in which the engine refuses everything is no success, as in ``crosscheck run``."""
        if self.asked and not self.judged and exitstatus == pytest.ExitCode.OK:
            session.exitstatus = pytest.ExitCode.NO_TESTS_COLLECTED

    def pytest_terminal_summary(self, terminalreporter: Any) -> None:
        """Show the table of the core suite, and list findings of other releases that pass here."""
        if self.lines:
            terminalreporter.section("crosscheck: error over step [s]")
            for text in _table(self.lines):
                terminalreporter.line(text)
        if self.asked and not self.judged:
            terminalreporter.section("crosscheck: nothing was judged, the engine runs none of it")
        if self.mended:
            terminalreporter.section("crosscheck: fixed")
            for line in self.mended:
                terminalreporter.line(line)


def _introduced(named: str) -> str:
    """Name of the engine; that of FILE.py:CLASS is made known in this process.

    Raises
    ------
    EngineError
        If the file or the class cannot be loaded.
    """
    path, colon, name = named.rpartition(":")
    if not colon:
        if named.endswith(".py"):
            raise EngineError(f"engine: {one_line(named, NAME)}: name its class as well, {one_line(named, NAME)}:CLASS")
        return named
    file = Path(path).resolve()
    module = ModuleType(f"crosscheck_{file.stem}")
    module.__file__ = str(file)
    sys.modules[module.__name__] = module  # a class finds its file by it
    sys.path.insert(0, str(file.parent))  # as pytest does for the tests beside it
    try:
        exec(compile(file.read_bytes(), file, "exec"), vars(module))
        made = vars(module)[name]
    except KeyError:
        raise EngineError(f"engine: {path} has no class {one_line(name, NAME)!r}") from None
    except Exception as error:  # it may raise anything
        raise EngineError(f"engine: {path} cannot be loaded: {said_by(error)}") from None
    return registry.introduce(made)


def _profiles(engine: str, profiles: str) -> list[str]:
    return profiles_called([word.strip() for word in profiles.split(",") if word.strip()], [engine])


def _slots(engine: str, scenes: list[str], profiles: str) -> list[Slot]:
    names = [scene.name for word in scenes for scene in matching(word)]
    return slots(Request(list(dict.fromkeys(names)), [engine], _profiles(engine, profiles)))


def _core_slots(engine: str, profiles: str) -> list[list[Slot]]:
    asked, made, facts = _profiles(engine, profiles), registry.find(engine).engine, registry.facts(engine)
    assert made is not None and facts is not None
    known = [name for name in made.profiles if not asked or name in asked]
    return [core.slots_of(scene, facts, engine, profile) for profile in known for scene in core.core()]


def _observed(slots: list[Slot]) -> list[Observation]:
    """Results of cases of one engine, in worker processes; an engine of this process runs here."""
    return list(map(execute, slots) if registry.is_introduced(slots[0].engine) else run_cells(slots, 0))


def _table(lines: list[Line]) -> Iterator[str]:
    """Errors of the core suite over steps, with the measured and the expected order; a line for each scene."""
    steps = "".join(f"{format_dt(dt):>9}" for dt in core.DTS)
    for profile in dict.fromkeys(line.profile for line in lines):
        yield f"{one_line(profile, 13):<13}{steps}  order          expected"
        for line in lines:
            if line.profile != profile:
                continue
            if line.refused:
                yield one_line(f"{line.scene:<13} not run: {line.refused}", 79)
                continue
            errors = "".join(f"{'-' if math.isnan(error) else f'{error:.1e}':>9}" for error in line.errors)
            order = f"{line.order:.2f}" if line.order is not None else "-" if line.wrong else "round-off"
            wanted = f"at least {line.wanted}" if line.wanted else "round-off"
            yield f"{line.scene:<13}{errors}  {order:<9} {'FAIL' if line.wrong else 'ok':<4} {wanted}"


class _Cells(pytest.Collector):
    """All checks of all cases."""

    def __init__(self, plugin: Plugin, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.plugin = plugin

    def collect(self) -> Iterator[pytest.Item]:
        """Scenes of the core suite; checks that have a tolerance, case by case."""
        for own in self.plugin.core:
            name = f"{own[0].engine}/{own[0].profile}/{own[0].scene} {own[0].dimension}-D::{CORE}"
            yield _Core.from_parent(self, name=name, plugin=self.plugin, slots=own)
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


class _Item(pytest.Item):
    """A test with a report of its own."""

    def repr_failure(self, excinfo: Any, style: Any = None) -> Any:
        """Only the report, without the place of the exception."""
        if isinstance(excinfo.value, Failed):
            return str(excinfo.value)
        return super().repr_failure(excinfo, style)

    def reportinfo(self) -> tuple[Any, int | None, str]:
        """Shown in place of a test's file and line."""
        return "crosscheck", None, self.name


class _Core(_Item):
    """One scene of the core suite on one profile."""

    def __init__(self, plugin: Plugin, slots: list[Slot], **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.plugin, self.slots = plugin, slots
        self.extra_keyword_matches |= {"crosscheck", CORE, slots[0].scene, slots[0].profile}

    def runtest(self) -> None:
        """Pass within all bounds and at the expected order; skip what the engine does not run."""
        facts = registry.facts(self.slots[0].engine)
        assert facts is not None
        line = core.judged(facts, _observed(self.slots))
        self.plugin.lines.append(line)
        self.user_properties += [("errors", line.errors), ("order", line.order), ("expected", line.wanted)]
        if line.refused:
            pytest.skip(line.refused)
        if line.wrong:
            raise Failed("\n".join(line.wrong))


class _Check(_Item):
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
