"""A process for one call at a time: what an engine starts there ends with it."""

import os
import sys
import time

import pytest

from validation.bench.lane import Lane
from validation.running.apart import Apart


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere nothing tells which processes one has started")
@pytest.mark.parametrize("kind", [Apart, Lane])
def test_process_left_behind_by_an_engine(kind):
    """In a session of its own, so that it is not in the engine's group."""
    with kind(60.0) as apart:
        left = apart.ask(os.spawnvp, os.P_NOWAIT, "setsid", ["setsid", "sleep", "1000"])
        os.kill(left, 0)
    with pytest.raises(ProcessLookupError):
        os.kill(left, 0)


def test_process_changed_by_a_call():
    """Its answer stands, and the next call has another process."""
    with Apart(60.0) as apart:
        first = apart.ask(os.getpid)
        assert apart.ask(os.getpid) == first
        assert apart.ask(os.umask, 0o7) is not None and apart.ask(os.getpid) != first


def test_lost_answer_of_a_process():
    with Apart(60.0) as apart:
        assert apart.ask(os._exit, 3) == "the process ended with exit code 3"
        assert apart.ask(os.abort) == "the process was killed by SIGABRT"
        assert apart.ask(float, "x") == "ValueError: could not convert string to float: 'x'"
        assert apart.ask(eval, "lambda: 0").startswith("PicklingError")
        apart.patience = 0.1
        assert apart.ask(time.sleep, 60) == "no answer after 0.1 s"
