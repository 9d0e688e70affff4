"""What a test is said to reach: blocks end where a statement leaves, a cache tells what it keeps to whoever asks."""

import importlib
import sys
from functools import cache
from pathlib import Path

import pytest

SOURCE = '''
from functools import cache, lru_cache

def sign(x):
    """Words."""
    if x < 0:
        return -1
    y = x + 1
    for k in range(3):
        if k == x:
            break
        y += k
    return y

@cache
def inner(x):
    return x

@lru_cache(maxsize=4)
def outer(x):
    return inner(x) + sign(x)
'''


@pytest.fixture
def reach(monkeypatch):
    """The recorder's instruments, and a module whose blocks it hears of."""
    monkeypatch.syspath_prepend(str(Path(__file__).parent))
    monkeypatch.delenv("CROSSCHECK_REACH", raising=False)
    kept = set(sys.modules)
    yield importlib.import_module("reach"), importlib.import_module("recording")
    for name in set(sys.modules) - kept:
        if name in ("reach", "recording", "subjects", "pytest_apart"):
            del sys.modules[name]


@pytest.fixture
def asked(reach, monkeypatch):
    """Blocks that a call reaches, asked as a test of its own."""
    tool, recorder = reach
    monkeypatch.setitem(sys.modules, tool.PLUGIN, recorder)
    module = {}
    exec(tool.instrumented(SOURCE, "toy.py"), module)

    def blocks(name, *given):
        recorder.seen.clear()
        module[name](*given)
        return {block.removeprefix("toy.x_") for block in recorder.seen}

    return blocks


def test_what_stands_after_a_statement_that_leaves_is_another_block(asked):
    assert asked("sign", -1) == {"sign:0", "sign:3"}
    assert asked("sign", 5) == {"sign:0", "sign:4", "sign:6", "sign:8", "sign:9"}
    assert asked("sign", 0) == {"sign:0", "sign:4", "sign:6", "sign:7", "sign:9"}


def test_a_line_belongs_to_its_innermost_block(reach):
    tool, _ = reach
    first = SOURCE.splitlines().index("def sign(x):") + 1
    told = [tool.block_of(SOURCE, "toy.py", "toy.x_sign", first + k).rpartition(":")[2] for k in range(10)]
    assert told == ["0", "0", "0", "3", "4", "4", "6", "7", "8", "9"]


def test_what_a_cache_keeps_is_reached_by_all_who_ask_for_it(asked):
    inner, sign = asked("inner", 1), asked("sign", 1)
    assert inner == {"inner:0"}
    first = asked("outer", 1)
    assert first == {"outer:0"} | inner | sign
    assert asked("outer", 1) == first and asked("outer", 1) == first
    assert asked("outer", -2) == {"outer:0", "inner:0", "sign:0", "sign:3"}


def test_beneath_a_cache_lies_the_function_itself(reach):
    """A test that asks it past its cache must not get what another test had computed."""
    _, recorder = reach
    asked = []
    told = recorder.remembered(cache(asked.append))
    told(1), told(1), told.__wrapped__(1)
    assert asked == [1, 1]


def test_what_a_module_computes_while_it_is_imported_is_reached_by_all_tests_of_the_file(reach, tmp_path):
    """The test that imports it first need not be the one that looks."""
    tool, _ = reach
    (tmp_path / f"{tool.PLUGIN}.py").write_text(Path(tool.__file__).with_name("recording.py").read_text())
    toy = "def made():\n    return 1\n\ndef asked():\n    return 2\n\nKEPT = made()\n"
    (tmp_path / "toy.py").write_text(tool.instrumented(toy, "toy.py"))
    (tmp_path / "test_toy.py").write_text(
        "def test_a():\n    import toy\n    assert toy.asked()\n\n"
        "def test_b():\n    from toy import KEPT\n    assert KEPT == 1\n"
    )
    found, failed = tool.reached(tmp_path, "test_toy.py", 10.0)
    told = {test.rpartition("_")[2]: set(blocks) for test, (_, blocks) in found.tests.items()}
    assert not failed and told == {"a": {"toy.x_made:0", "toy.x_asked:0"}, "b": {"toy.x_made:0"}}


def test_what_a_test_runs_in_a_pytest_of_its_own_is_reached_by_it(reach, tmp_path):
    tool, _ = reach
    (tmp_path / f"{tool.PLUGIN}.py").write_text(Path(tool.__file__).with_name("recording.py").read_text())
    (tmp_path / "toy.py").write_text(tool.instrumented("def asked():\n    return 2\n", "toy.py"))
    (tmp_path / "inner.py").write_text("def test_c():\n    import toy\n    toy.asked()\n")
    (tmp_path / "test_toy.py").write_text(
        "import subprocess, sys\n\ndef test_a():\n    pass\n\ndef test_b():\n"
        "    subprocess.run([sys.executable, '-m', 'pytest', '-p', 'no:cacheprovider', 'inner.py'], check=True)\n"
    )
    found, failed = tool.reached(tmp_path, "test_toy.py", 20.0)
    assert not failed and {test.rpartition("_")[2]: blocks for test, (_, blocks) in found.tests.items()} == {
        "a": [], "b": ["toy.x_asked:0"]
    }  # fmt: skip


def test_a_module_of_words_alone_can_be_recorded(reach):
    tool, _ = reach
    for source in ("", '"""Words."""\n', '"""Words."""\n\nfrom __future__ import annotations\n'):
        compile(tool.instrumented(source, "toy.py"), "toy.py", "exec")


def test_a_test_that_fails_ends_no_record(reach, tmp_path):
    """Those after it are met as well: it may fail only because the sources are instrumented."""
    tool, _ = reach
    (tmp_path / f"{tool.PLUGIN}.py").write_text(Path(tool.__file__).with_name("recording.py").read_text())
    (tmp_path / "test_toy.py").write_text(
        "def test_a():\n    assert 0\n\ndef test_b():\n    assert 0\n\ndef test_c(): 0\n"
    )
    found, failed = tool.reached(tmp_path, "test_toy.py", 10.0)
    assert list(found.tests) == [f"test_toy.py::test_{x}" for x in "abc"] and found.whole
    assert failed == {"test_toy.py::test_a", "test_toy.py::test_b"}
    assert tool.passing(tmp_path, set(found.tests), 20.0) == {"test_toy.py::test_c"}
