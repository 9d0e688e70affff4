"""What a test reaches, recorded in every process that it starts; copied to where the tests run, as a pytest plugin.

The blocks of an instrumented copy (`reach.instrumented`) call ``seen.add`` with their own name. Pytest tells which test
runs in the environment, which processes inherit: a line ``test<tab>block`` goes to a file of each process. What runs
while a file is imported, or in a fixture that tests share, is reached by all of its tests, under the name of no test.
"""

from __future__ import annotations

import json
import os
from collections import Counter

import pytest

FOLDER = os.environ.get("CROSSCHECK_REACH", "")
#: Seconds of CPU, children included, after which no further test of the file is begun.
LIMIT = float(os.environ.get("CROSSCHECK_REACH_SECONDS", "inf"))


class Seen(set):
    """Names of blocks; a new one is written down at once, since processes may end without a word."""

    pid, file = 0, -1

    def add(self, name):
        if name in self:
            return
        set.add(self, name)
        if FOLDER:
            if self.pid != os.getpid():
                self.pid = os.getpid()
                path = os.path.join(FOLDER, f"{self.pid}.reached")
                self.file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND)
            test = os.environ.get("PYTEST_CURRENT_TEST", "").rpartition(" ")[0]
            os.write(self.file, f"{test}\t{name}\n".encode())


seen = Seen()
_passed: dict[str, float] = {}
_failed: set[str] = set()
_before = [0.0]


def _cpu():
    return sum(os.times()[:4])


_begun = _cpu()


def pytest_runtest_logstart(nodeid):
    seen.clear()
    _before[0] = _cpu()


def pytest_runtest_logreport(report):
    if report.failed or report.skipped:
        _failed.add(report.nodeid)
        if report.failed and FOLDER:
            with open(os.path.join(FOLDER, "failed"), "a", encoding="utf-8") as stream:
                stream.write(f"{report.nodeid}\n")
    elif report.when == "teardown":
        _passed[report.nodeid] = _cpu() - _before[0]


def pytest_collection_modifyitems(items):
    """One case of every test first: what the record may cost is spent on different ones."""
    if FOLDER and float("inf") > LIMIT:
        met = Counter()
        place = {}
        for item in items:
            name = item.nodeid.partition("[")[0]
            place[item], met[name] = met[name], met[name] + 1
        items.sort(key=place.__getitem__)


@pytest.hookimpl(wrapper=True)
def pytest_fixture_setup(fixturedef, request):
    test = os.environ.get("PYTEST_CURRENT_TEST")
    shared = fixturedef.scope != "function" and test is not None
    if shared:
        os.environ["PYTEST_CURRENT_TEST"] = ""
        seen.clear()
    try:
        return (yield)
    finally:
        if shared:
            os.environ["PYTEST_CURRENT_TEST"] = test


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item, nextitem):
    result = yield
    if _cpu() - _begun > LIMIT:
        item.session.shouldstop = "what the record may cost is spent"
    return result


def pytest_sessionfinish():
    if FOLDER:
        passed = {test: seconds for test, seconds in _passed.items() if test not in _failed}
        with open(os.path.join(FOLDER, "passed.json"), "w", encoding="utf-8") as stream:
            json.dump(passed, stream)
