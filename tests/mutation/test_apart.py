"""Tests that run in a process apart: their clocks are as fine as ever, and nothing of them goes on beyond its time."""

import os
import time

import pytest


@pytest.fixture
def run(imported, monkeypatch, tmp_path):
    """`run(text, seconds)`: status of pytest over a file of that text, and how long that took."""
    apart = imported("pytest_apart")

    def asked(text, seconds, **more):
        (tmp_path / "test_toy.py").write_text(text)
        begun = time.monotonic()
        code = apart.run(tmp_path, ["-p", "no:cacheprovider", "test_toy.py"], dict(os.environ), seconds, **more)
        return code, time.monotonic() - begun

    return apart, asked


def test_a_clock_of_a_process_is_as_fine_as_without_a_limit_of_time(run):
    text = "import time\n\ndef test_clock():\n    assert len({time.process_time() for _ in range(1000)}) > 500\n"
    assert run[1](text, 60.0)[0] == 0
    assert run[1]("def test_wrong():\n    assert 0\n", 60.0)[0] == 1


@pytest.mark.parametrize("where", ["in the test", "in what it starts"])
def test_what_takes_more_than_its_time_is_ended_with_all_that_it_started(run, where, tmp_path):
    apart, asked = run
    loop = f"import os; open({str(tmp_path / 'pid')!r}, 'w').write(str(os.getpid()))\nwhile True: pass"
    text = f"exec({loop!r})" if where == "in the test" else (
        f"import subprocess, sys; subprocess.run([sys.executable, '-c', {loop!r}], start_new_session=True)"
    )  # fmt: skip
    code, took = asked(f"def test_toy():\n    {text}\n", 2.0)
    assert code == apart.OUT_OF_TIME and took < 60.0
    with pytest.raises(ProcessLookupError):
        for _ in range(100):  # one that is killed is there until its parent, or the system, has looked
            os.kill(int((tmp_path / "pid").read_text()), 0)
            time.sleep(0.05)


def test_what_sleeps_beyond_all_patience_is_ended(run):
    code, took = run[1]("import time\n\ndef test_toy():\n    time.sleep(600.0)\n", 60.0, patience=1.0)
    assert code == run[0].OUT_OF_TIME and took < 30.0
