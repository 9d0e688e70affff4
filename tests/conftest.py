"""Fixtures shared by all tests."""

from __future__ import annotations

import gc
import json
import os
import shutil
import sys
import textwrap
from collections import defaultdict
from hashlib import sha1

import pytest
from click.testing import CliRunner
from hypothesis import settings

from adapters import registry
from adapters.engine import EngineError
from adapters.isolation import IsolationError, Lost
from adapters.scene.shapes import SceneError
from validation.findings import FindingsError
from validation.records.store import StoreError
from validation.workers.limits import LimitError

#: Runs tests of planted files, which must fail (`test_conftest.py`).
pytest_plugins = ("pytester",)
gc.disable()  # until all is collected
#: Whether all tests run (`make test-all`), or what `make test` has time for.
ALL = bool(os.environ.get("CROSSCHECK_ALL"))
# Hypothesis fails an example that takes 200 ms: on a busy machine that says nothing of the code.
settings.register_profile("few", deadline=None, max_examples=25)
settings.register_profile("all", deadline=None, max_examples=300)
settings.load_profile("all" if ALL else "few")


def pytest_addoption(parser):
    """`make test ARGS="--cpu 12"` prints the tables of docs/development/tests.md."""
    parser.addoption(
        "--cpu", type=int, metavar="N", help="tell the N tests that take most CPU, and what the rest takes"
    )


def pytest_configure(config):
    """Without its engines whole files are skipped: where they are required, that is a failure and not a skip."""
    config.addinivalue_line("markers", "long: takes seconds of CPU or more; `make test-all` runs it")
    config.addinivalue_line("markers", "optional(engine): needs an engine that `[all]` has not, or is skipped")
    config.addinivalue_line("markers", "few(n): `make test` runs n cases of a parametrized test, `make test-all` all")
    try:
        registry.check_required()
    except EngineError as error:
        raise pytest.UsageError(str(error)) from None


def pytest_collection_modifyitems(config, items):
    """Leave out what `make test` has no time for: long tests, and all but some cases of a test of many.

    The cases that stay are chosen by the hash of their names, so that they are spread over all parameters and are the
    same each time. A test that the command line names runs.
    """
    if ALL:
        return
    cases = defaultdict(list)
    for item in items:
        if item.get_closest_marker("few"):
            cases[item.nodeid.partition("[")[0]].append(item)
    out = {item for item in items if item.get_closest_marker("long")}
    for own in cases.values():
        number = own[0].get_closest_marker("few").args[0]
        out.update(sorted(own, key=lambda item: sha1(item.nodeid.encode()).digest())[number:])
    named = {str(argument) for argument in config.args}
    out = {item for item in out if not named & {item.nodeid, item.nodeid.partition("[")[0]}}
    config.hook.pytest_deselected(items=[item for item in items if item in out])
    items[:] = [item for item in items if item not in out]


#: CPU of this process and of those that it has waited for when a test began.
BEGAN = pytest.StashKey[float]()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item):
    """Each report has the CPU of its test so far; the last one, all of it."""
    report = yield
    report.cpu = sum(os.times()[:4]) - item.stash[BEGAN]
    return report


def pytest_terminal_summary(terminalreporter):
    """Tell what tests cost: a table of the dearest, and what nine in ten of them take."""
    number = terminalreporter.config.option.cpu
    if number is None:
        return
    reports = [report for reports in terminalreporter.stats.values() for report in reports]
    ends = [report for report in reports if getattr(report, "when", "") == "teardown"]
    costs = sorted(((report.cpu, report.nodeid.removeprefix("tests/")) for report in ends), reverse=True)
    all_of_it, rest = (sum(cost for cost, _ in part) for part in (costs, costs[len(costs) // 10 :]))
    lines = [f"| `{name}` | {cost:.1f} |" for cost, name in costs[:number]]
    least = costs[len(costs) // 10][0]
    lines += ["", f"Nine in ten of {len(costs)} tests take at most {least:.2f} s each, and together {rest:.0f} of "
              f"{all_of_it:.0f} s; what is collected is not in it."]  # fmt: skip
    terminalreporter.write("\n".join(["", "| test | CPU [s] |", "|---|---|", *lines, ""]))


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item):
    """Skip a test of an optional engine that is not installed."""
    item.stash[BEGAN] = sum(os.times()[:4])
    for mark in item.iter_markers("optional"):
        found = registry.find(*mark.args)
        if found.engine is None:
            pytest.skip(found.reason)


@pytest.fixture(scope="session")
def browser():
    """Headless Chromium of the system; a test that needs it is skipped, visibly, where there is none."""
    sync_api = pytest.importorskip("playwright.sync_api")
    executable = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if executable is None:
        pytest.skip("there is no Chromium on this machine: apt-get install chromium")
    with sync_api.sync_playwright() as playwright:
        # Playwright starts it without its sandbox, which it must be as root.
        running = playwright.chromium.launch(executable_path=executable)
        yield running
        running.close()


@pytest.fixture
def bullet():
    """A test that needs Bullet is skipped where it is not installed."""
    pytest.importorskip("pybullet", reason="pybullet has no wheel for this Python")


def pytest_collection_finish():
    """Collecting makes millions of objects that stay: searching them for garbage took half of its time."""
    gc.freeze()
    gc.enable()


@pytest.fixture(scope="module", autouse=True)
def _what_is_there_stays():
    """Searches for garbage go through what a file makes, not through a gigabyte of kernels and tests, a second each."""
    gc.collect()
    gc.freeze()


#: Errors that a user reads: what is wrong stands in one line.
SAID = (SceneError, EngineError, FindingsError, StoreError, LimitError, IsolationError, Lost)


@pytest.fixture(scope="session")
def offences():
    """What no test may bring about, in words; told at the end of the test in which it came about.

    An assertion where it comes about would not do: code under test that expects any exception swallows it.
    """
    found = []
    yield found
    assert not found, found  # of what ends after the last test


@pytest.fixture(autouse=True)
def nothing_offends(offences):
    """Each test is told what offended in it, and in what was set up for it."""
    yield
    found = offences.copy()
    offences.clear()
    assert not found, "\n".join(found)


@pytest.fixture(scope="session", autouse=True)
def errors_say_one_line(offences):
    """Whatever test provokes an error that a user reads, it says something, as text, in one line.

    Engines are spoilt on purpose, so that theirs have more lines: the conformance kit is asked about that.
    """

    def checked(error, *said):
        ValueError.__init__(error, *said) if isinstance(error, ValueError) else RuntimeError.__init__(error, *said)
        told = len(said) == 1 and isinstance(said[0], str) and said[0].strip()
        if not told or ("\n" in told and not isinstance(error, EngineError)):
            place = sys._getframe(1)
            where = f"{place.f_code.co_filename}:{place.f_lineno}"
            offences.append(f"{type(error).__name__} does not say one line: {said}, raised at {where}")

    with pytest.MonkeyPatch.context() as patch:
        for error in SAID:
            patch.setattr(error, "__init__", checked, raising=False)
        yield


@pytest.fixture(scope="session", autouse=True)
def data_is_laid_out_alike(offences):
    """Whatever test asks a command for JSON, it is indented by one column, or, if no list of records, on one line."""
    invoke = CliRunner.invoke

    def watched(runner, command, args=None, *rest, **named):
        result = invoke(runner, command, args, *rest, **named)
        if not isinstance(args, str) and "--json" in (args or ()):
            offences.extend(f"{' '.join(map(str, args))}: {said}" for said in layout_of(result.stdout))
        return result

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(CliRunner, "invoke", watched)
        yield


def layout_of(text):
    """What is wrong with the layout of JSON; of JSON Lines, or of what was not said after all, nothing."""
    try:
        data = json.loads(text)
    except ValueError:
        return []
    text = text.rstrip("\n")
    records = isinstance(data, list) and any(isinstance(each, dict) for each in data)
    fine = text == json.dumps(data, indent=1) or (text == json.dumps(data) and not records)
    return [] if fine else [f"is laid out otherwise: {text[:80]!r}"]


EVIL = '''
"""An engine that misbehaves in a different way in each profile."""
import os, time
from adapters.engine import Engine, EngineFacts, Scheme, Setting


class EvilEngine(Engine):
    facts = EngineFacts("evil", "Evil", "evil", frozenset({2, 3}), Scheme("none", 1), 1 / 240)
    profiles = {
        name: (lambda needs, dt, name=name: [Setting("deed", name, "to test isolation")])
        for name in ("abort", "segfault", "exit", "hang", "leak", "raise", "refuse")
    }

    def version(self):
        return "6.6.6"

    def refuses(self, scene, profile):
        return "it does not want to" if profile == "refuse" else None

    def declares(self, profile, needs, dt):
        return {}

    def build(self, scene, dt, settings):
        deed = settings["deed"]
        print("about to", deed, flush=True)
        if deed == "abort":
            os.abort()
        if deed == "segfault":
            import ctypes
            ctypes.string_at(0)
        if deed == "exit":
            os._exit(7)
        if deed == "hang":
            time.sleep(3600)
        if deed == "leak":
            hoard = []
            while True:
                hoard.append(bytearray(2**28))
        raise RuntimeError("building failed\\nsecond line")
'''
BROKEN = "raise RuntimeError('this plugin is broken')\n"


@pytest.fixture
def plugins(tmp_path_factory, monkeypatch):
    """Install two third-party engines for this test and its worker processes: `evil` and `broken`."""
    folder = tmp_path_factory.mktemp("plugins")
    (folder / "evil_engine.py").write_text(textwrap.dedent(EVIL))
    (folder / "broken_engine.py").write_text(BROKEN)
    info = folder / "evil-6.6.6.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: evil\nVersion: 6.6.6\n")
    entries = "evil = evil_engine:EvilEngine\nbroken = broken_engine:Nothing\n"
    (info / "entry_points.txt").write_text(f"[{registry.GROUP}]\n{entries}")
    monkeypatch.syspath_prepend(str(folder))
    registry.forget()
    yield folder
    registry.forget()
    for name in ("evil_engine", "broken_engine"):
        sys.modules.pop(name, None)
