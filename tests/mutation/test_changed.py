"""Which mutants run again: those of functions that have changed, where tests have only been added, and else all."""

import hashlib
import subprocess

import pytest

MODULE = "import math\n\nSIZE = 2.0\n\n\ndef twice(x):\n    return 2 * x\n\n\ndef half(x):\n    return x / 2\n"
TESTS = "def test_twice():\n    assert twice(2) == 4\n"


@pytest.fixture
def changed(imported, monkeypatch, tmp_path):
    """`changed(module, tests)`: what `run.changed_since` says of these texts, of others that were committed and ran."""
    run = imported("run")
    monkeypatch.setattr(run, "ROOT", tmp_path)
    monkeypatch.setattr(run, "tests_of", lambda module: ["test_toy.py"])

    def git(*words):
        subprocess.run(["git", "-c", "user.name=a", "-c", "user.email=a@b", *words], cwd=tmp_path, check=True)

    def write(module, tests):
        (tmp_path / "toy.py").write_text(module)
        (tmp_path / "test_toy.py").write_text(tests)

    write(MODULE, TESTS)
    git("init", "-q")
    git("add", ".")
    git("commit", "-q", "-m", "ran")
    ran = hashlib.sha256((MODULE + TESTS).encode()).hexdigest()[:12]

    def ask(module, tests, of=ran):
        write(module, tests)
        return run.changed_since("toy.py", of)

    return ask


def test_functions_that_changed_are_named_and_tests_that_came_change_none(changed):
    assert changed(MODULE, TESTS) == set()
    more = TESTS + "    assert twice(3) == 6\n\n\ndef test_half():\n    assert half(2) == 1\n"
    assert changed("import os\n" + MODULE, "import math\n" + more) == set()
    assert changed(MODULE.replace("2 * x", "x + x") + "\n\ndef new(x):\n    return x\n", TESTS) == {
        "toy.x_twice", "toy.x_new"}  # fmt: skip


@pytest.mark.parametrize(
    ("module", "tests"),
    [
        (MODULE, TESTS.replace("== 4", "> 0")),
        (MODULE, TESTS.replace("def test_twice", "@skip\ndef twice")),
        (MODULE.replace("2.0", "3.0"), TESTS),
    ],
    ids=["a line of a test", "a test", "a constant"],
)
def test_all_run_where_something_that_may_have_noticed_is_gone(changed, module, tests):
    assert changed(module, tests) is None


def test_all_run_where_nobody_knows_what_ran(changed):
    assert changed(MODULE, TESTS, of="0123456789ab") is None
