"""What a test reaches, recorded in every process that it starts; copied to where the tests run, as a pytest plugin.

The blocks of an instrumented copy (`reach.instrumented`) call ``seen.add`` with their own name. Which test runs stands
in the environment, which processes inherit, and under a name of our own, since some of them are pytest again: a line
``test<tab>block`` goes to a file of each process. What runs
while a module is imported, by whichever test comes first, or in a fixture that tests share, is reached by all of its
tests, under the name of no test.
What a cache keeps is reached by whoever asks for it (`remembered`), not only by the test that came first.
"""

from __future__ import annotations

import json
import os
from collections import Counter
from functools import _make_key, update_wrapper

import pytest

FOLDER = os.environ.get("CROSSCHECK_REACH", "")
#: Seconds of CPU, children included and shared fixtures not, after which no further test of the file is begun.
LIMIT = float(os.environ.get("CROSSCHECK_REACH_SECONDS", "inf"))
#: A file that names tests which shall not run: they have been asked already.
ASKED = os.environ.get("CROSSCHECK_REACH_ASKED", "")
#: Where the test that runs is named.
CURRENT = "CROSSCHECK_REACH_TEST"


class Seen(set):
    """Names of blocks; a new one is written down at once, since processes may end without a word."""

    pid, file, turn, importing = 0, -1, 0, 0

    def clear(self):
        self.turn += 1
        set.clear(self)

    def add(self, name):
        if name in self:
            return
        set.add(self, name)
        if FOLDER:
            if self.pid != os.getpid():
                self.pid = os.getpid()
                path = os.path.join(FOLDER, f"{self.pid}.reached")
                self.file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND)
            test = "" if self.importing else os.environ.get(CURRENT, "")
            os.write(self.file, f"{test}\t{name}\n".encode())


seen = Seen()
_outcome: dict[str, str] = {}
_before = [0.0, 0.0]
#: Seconds of CPU of fixtures that tests share, so far, and how many of them are being made.
_shared = [0.0, 0]


def remembered(cached):
    """A cached function that tells the blocks of an answer again when it gives it out of its cache."""
    known, told = {}, {}

    def call(*args, **kwargs):
        try:
            key = _make_key(args, kwargs, typed=False)
            blocks = known.get(key)
        except TypeError:  # the cache says so itself
            return cached(*args, **kwargs)
        if blocks is not None:
            if told.get(key) != seen.turn:
                told[key] = seen.turn
                for name in blocks:
                    seen.add(name)
            return cached(*args, **kwargs)
        before = set(seen)
        seen.clear()
        try:
            answer = cached(*args, **kwargs)
            known[key] = frozenset(seen)
            return answer
        finally:
            seen.turn += 1
            seen.update(before)

    update_wrapper(call, cached)
    call.__wrapped__ = cached.__wrapped__  # what asks for the function beneath a cache means the function
    for name in ("cache_clear", "cache_info", "cache_parameters"):
        setattr(call, name, getattr(cached, name))
    return call


def _cpu():
    return sum(os.times()[:4])


_begun = _cpu()


def _write(name, text):
    if FOLDER:
        with open(os.path.join(FOLDER, name), "a", encoding="utf-8") as stream:
            stream.write(text)


def pytest_runtest_logstart(nodeid):
    os.environ[CURRENT] = nodeid
    seen.clear()
    _before[:] = _cpu(), _shared[0]


def pytest_runtest_logreport(report):
    """Write down at once how each test ended: a file may be stopped by the limit of its process."""
    if report.failed:
        _outcome[report.nodeid] = "failed"
        _write("failed", f"{report.nodeid}\n")
    elif report.skipped:
        _outcome.setdefault(report.nodeid, "skipped")
    if report.when == "teardown":
        ended = _outcome.get(report.nodeid, "passed")
        own = _cpu() - _before[0] - (_shared[0] - _before[1])
        _write("ended", json.dumps([report.nodeid, ended, own]) + "\n")


def pytest_collection_modifyitems(items):
    """One case of every test first: what is spent is spent on different ones; and none that was asked before."""
    if ASKED:
        with open(ASKED, encoding="utf-8") as stream:
            asked = set(stream.read().splitlines())
        items[:] = [item for item in items if item.nodeid not in asked]
    if ASKED or (FOLDER and float("inf") > LIMIT):
        met = Counter()
        place = {}
        for item in items:
            name = item.nodeid.partition("[")[0]
            place[item], met[name] = met[name], met[name] + 1
        items.sort(key=place.__getitem__)


@pytest.hookimpl(wrapper=True)
def pytest_fixture_setup(fixturedef, request):
    test = os.environ.get(CURRENT)
    shared = fixturedef.scope != "function" and test is not None
    begun = _cpu()
    if shared:
        os.environ[CURRENT] = ""
        seen.clear()
        _shared[1] += 1
    try:
        return (yield)
    finally:
        if shared:
            os.environ[CURRENT] = test
            _shared[1] -= 1
            if not _shared[1]:  # one that asks for another has its seconds
                _shared[0] += _cpu() - begun


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item, nextitem):
    result = yield
    if _cpu() - _begun - _shared[0] > LIMIT:
        item.session.shouldstop = "what the record may cost is spent"
    return result


def pytest_sessionfinish(session):
    _write("shared", f"{_shared[0]}")
    if not session.shouldstop:
        _write("whole", "")
