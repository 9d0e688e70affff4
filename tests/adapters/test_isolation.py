"""Children that foreign code runs in: however one ends, its parent is told how, and nothing is left over."""

import multiprocessing
import os
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from multiprocessing.connection import wait
from pathlib import Path

import pytest

from adapters import isolation
from adapters.isolation import LOG_BYTES, LOG_LINES, Child, IsolationError, Lost, Mistaken

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="guardians and /proc are Linux's")
#: What a child serves: it runs what it is sent, and answers what that says.
SERVED = '''
import os, resource, signal, subprocess, sys, time

def serve(connection):
    def answer(*words):
        connection.send_bytes(" ".join(map(str, words)).encode())

    def start(seconds, *kept):
        """A process in a session of its own, that holds open which files it is given; its id."""
        return subprocess.Popen(["sleep", str(seconds)], start_new_session=True, pass_fds=kept).pid

    while True:
        try:
            exec(connection.recv_bytes(), globals() | {"connection": connection, "answer": answer, "start": start})
        except EOFError:
            return
'''
#: Longer than any child that is in order takes to answer [s]: only a fault waits for it.
PATIENCE = 60.0


@pytest.fixture
def serve(tmp_path, monkeypatch):
    """A function that children find as well: what a test file defines cannot be imported there."""
    (tmp_path / "served_to_children.py").write_text(SERVED)
    monkeypatch.syspath_prepend(str(tmp_path))
    import served_to_children

    yield served_to_children.serve
    del sys.modules["served_to_children"]


@pytest.fixture
def child(serve):
    """A child that runs what it is sent."""
    made = Child(serve)
    yield made
    made.stop()


def asked(child, order):
    child.send(order.encode())
    return child.receive(PATIENCE).decode()


def is_running(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] not in "ZX"
    except OSError:
        return False


def within(seconds, is_so):
    ends = time.monotonic() + seconds
    while not is_so() and time.monotonic() < ends:
        time.sleep(0.01)
    return is_so()


def test_child_answers_until_stopped(child):
    assert [asked(child, f"answer({k} + 1)") for k in range(3)] == ["1", "2", "3"]
    assert not child.ended()
    assert child.stop() == child.stop() == "the process closed its connection"
    assert child.ended() and child.tail() == ""
    child.send(b"answer(1)")  # nobody is there, which is noticed where an answer is read
    with pytest.raises(Lost, match=r"^the process closed its connection$"):
        child.receive(PATIENCE)


@pytest.mark.few(8)
@pytest.mark.parametrize(
    ("order", "said"),
    [
        ("os._exit(7)", "the process ended with exit code 7"),
        ("os._exit(0)", "the process ended with exit code 0"),
        ("sys.exit(3)", "the process ended with exit code 3"),
        ("raise KeyError(3)", "the process ended with exit code 1"),
        ("os.kill(os.getpid(), signal.SIGKILL)", "the process was killed by SIGKILL"),
        ("os.kill(os.getpid(), signal.SIGTERM)", "the process was killed by SIGTERM"),
        ("os.kill(os.getpid(), signal.SIGSEGV)", "the process was killed by SIGSEGV"),
        ("os.kill(os.getpid(), 40)", "the process was killed by signal 40"),
        ("connection.close(); time.sleep(600)", "the process closed its connection"),
        ("start(600); os._exit(7)", "the process ended with exit code 7"),
        ("os.kill(os.getppid(), signal.SIGTERM); time.sleep(600)", "the process was killed by SIGTERM"),
    ],
)
@pytest.mark.parametrize("timeout", [None, PATIENCE])
def test_reason_for_the_end_of_a_child(child, order, said, timeout):
    child.send(order.encode())
    with pytest.raises(Lost) as lost:
        child.receive(timeout)
    assert str(lost.value) == said == child.stop()


def test_exit_status_of_a_child(child):
    """`multiprocessing` waits for all that have ended when it starts another process."""
    child.send(b"os.abort()")
    assert within(PATIENCE, child.ended)
    assert within(PATIENCE, lambda: not multiprocessing.active_children())
    assert child.stop() == "the process was killed by SIGABRT"


def test_slow_child_not_taken_for_dead(child):
    child.send(b"time.sleep(0.5); answer('late')")
    started = time.monotonic()
    with pytest.raises(Lost, match=r"^no answer after 0\.1 s$"):
        child.receive(0.1)
    assert time.monotonic() - started >= 0.1 and not child.ended()
    assert child.receive(PATIENCE) == b"late"


def test_child_of_a_lost_guardian(child):
    """By what the child has started; nobody but its guardian could have ended that."""
    pid = int(asked(child, "answer(start(600, connection.fileno()))"))
    try:
        os.kill(child._process.pid, signal.SIGKILL)
        with pytest.raises(Lost, match=r"^the process was killed by SIGKILL$"):
            child.receive(PATIENCE)
    finally:
        os.kill(pid, signal.SIGKILL)


def test_largest_answer_of_a_child(child, monkeypatch):
    monkeypatch.setattr(isolation, "MOST_BYTES", 1000)
    assert asked(child, "answer('x' * 1000)") == "x" * 1000
    child.send(b"answer('x' * 1001); time.sleep(600)")
    with pytest.raises(Lost, match=r"^the process closed its connection$"):
        child.receive(PATIENCE)


@pytest.mark.parametrize("leaves", [False, True])
def test_processes_started_by_a_child_ended_with_it(child, leaves):
    """Whether it is stopped, or leaves by itself, and whatever session that is in."""
    pids = [int(asked(child, "answer(start(600))")) for _ in range(2)]
    assert all(map(is_running, pids))
    if leaves:
        child.send(b"os._exit(0)")
        with pytest.raises(Lost):
            child.receive(PATIENCE)
    child.stop()
    assert within(isolation.GRACE, lambda: not any(map(is_running, pids)))


@pytest.mark.parametrize(
    "order",
    [
        "connection._connection.send_bytes(b'an answer that was not asked for')",
        "answer('first'), answer('second')",
    ],
)
def test_unrequested_answer_of_a_child(child, order):
    """It ends the child at the next question."""
    child.send(order.encode())
    with pytest.raises(Mistaken, match="not asked"):
        child.receive(PATIENCE), asked(child, "answer('third')")
    assert child.ended()


def test_half_an_answer(serve, monkeypatch):
    """Its length is sent and less than that: the parent does not wait for the rest for ever."""
    monkeypatch.setattr(isolation, "PAUSE", 1)
    child = Child(serve)
    child.send(b"os.write(connection.fileno(), (10**6).to_bytes(4, 'big')); answer('short'); time.sleep(600)")
    with pytest.raises(Lost, match=r"^its process gave half an answer$"):
        child.receive(PATIENCE)
    assert child.ended()


def test_long_question_that_a_child_does_not_read(serve, monkeypatch):
    monkeypatch.setattr(isolation, "PAUSE", 1)
    child = Child(serve)
    assert asked(child, "answer('begun'); os.kill(os.getpid(), signal.SIGSTOP)") == "begun"
    child.send(b"answer(1) #" + b"x" * 2**22)
    with pytest.raises(Lost, match=r"^no answer after 0\.1 s$"):
        child.receive(0.1)
    child.stop()


def test_the_tracker_of_semaphores_of_the_parent(child):
    """A child that writes to all that is open does not reach it; it would print errors."""
    assert asked(child, "from multiprocessing.resource_tracker import getfd\n"
                        "answer(os.fstat(getfd()).st_rdev == os.stat(os.devnull).st_rdev)") == "True"  # fmt: skip


def test_forked_copy_of_a_child(child):
    """Both come back to the child's code; one answers."""
    assert asked(child, "os.fork(); answer('once')") == "once"
    assert [asked(child, f"answer({k})") for k in range(3)] == ["0", "1", "2"]


def test_many_forks_of_a_child(child):
    """None is left once it is stopped, also where the child has stopped its guardian."""
    order = "pids = [os.fork() or time.sleep(600) for _ in range(200)]; answer(*pids)"
    pids = [int(word) for word in asked(child, order).split()]
    child.send(b"os.kill(os.getppid(), signal.SIGSTOP); time.sleep(600)")
    assert within(PATIENCE, lambda: Path(f"/proc/{child._process.pid}/stat").read_text().rpartition(")")[2][1] == "T")
    child.stop()
    assert len(pids) == 200 and not any(map(is_running, pids))


SWEEP = """
import ctypes, os, subprocess
from adapters import isolation
isolation.GRACE = 0.0
ctypes.CDLL(None).prctl(36, 1)  # adopts orphans, as a guardian does
subprocess.run(["sh", "-c", "for k in 1 2 3 4 5; do setsid sleep 600 >&- 2>&- & done"])
isolation._sweep()
print(isolation._descendants(os.getpid()))
"""


def test_a_sweep_on_a_busy_machine():
    """However long it takes, it ends with the last process."""
    done = subprocess.run([sys.executable, "-c", SWEEP], capture_output=True, text=True)
    assert done.stdout.strip() == "[]", done.stderr


#: A parent that says which processes hang on it, and hangs itself.
PARENT = """
import sys, time
sys.path.insert(0, sys.argv[1])
from adapters.isolation import Child
from served_to_children import serve

if __name__ == "__main__":
    child = Child(serve)
    child.send(b"answer(os.getppid(), os.getpid(), start(600)); time.sleep(600)")
    print(child.receive().decode(), flush=True)
    time.sleep(600)
"""


def test_hanging_child_ends_with_its_killed_parent(serve, tmp_path):
    """A child that serves would notice that nobody asks any more: this one never looks."""
    (tmp_path / "parent.py").write_text(PARENT)
    parent = subprocess.Popen([sys.executable, str(tmp_path / "parent.py"), str(tmp_path)], stdout=subprocess.PIPE)
    pids = [int(word) for word in parent.stdout.readline().split()]
    parent.kill()
    parent.wait(), parent.stdout.close()  # others may hold its end open: nothing is read there any more
    try:
        assert len(pids) == 3
        assert within(isolation.GRACE, lambda: not any(map(is_running, pids)))
    finally:
        for pid in filter(is_running, pids):
            os.kill(pid, signal.SIGKILL)


def test_last_lines_of_a_child_s_long_output_kept(child):
    count = 4 * LOG_BYTES // 8  # more than a pipe holds, and than is kept
    assert asked(child, f"[print(f'{{k:07d}}') for k in range({count})]; sys.stdout.flush(); answer('done')") == "done"
    assert child.tail().split() == [f"{k:07d}" for k in range(count - LOG_LINES, count)]
    assert len(child.written) == LOG_BYTES
    child.written = b""
    assert asked(child, "os.write(2, b'to the other stream'); answer('done')") == "done"
    assert child.tail() == "to the other stream"
    child.send(b"os.write(1, b', and the last words'); os._exit(1)")
    with pytest.raises(Lost):
        child.receive(PATIENCE)
    assert child.tail() == "to the other stream, and the last words"


def test_end_of_the_wait_for_a_child(child):
    assert asked(child, "answer(1)") == "1"  # it has begun
    assert not wait(child.sentinels, 0.0) and not child.has_answer()
    child.send(b"answer(2)")
    assert wait(child.sentinels, PATIENCE) == [child.connection] and child.has_answer()
    assert child.receive(PATIENCE) == b"2"
    waiting = child.sentinels  # asked for later it may have been read by then, and nobody wakes for it
    child.send(b"os.write(1, b'word')")
    assert wait(waiting, PATIENCE) == [child.log]
    assert not wait(child.sentinels, 0.0), "what is written has been read"
    assert child.written == b"word" and not child.has_answer()
    child.send(b"os._exit(3)")
    assert wait(child.sentinels, PATIENCE) and within(PATIENCE, child.ended)


def test_session_of_a_child(child):
    session, waiting = asked(child, "answer(os.getsid(0), repr(sys.stdin.read() if sys.stdin else ''))").split()
    assert int(session) != os.getsid(0) and waiting == "''"
    assert asked(child, "os.kill(os.getpid(), signal.SIGINT); answer('goes on')") == "goes on"


@pytest.mark.skipif(not hasattr(signal, "pthread_sigmask"), reason="this system cannot hold signals back")
def test_ctrl_c_while_a_child_starts(child):
    """A child that loads its modules has not ignored it yet: it wrote a traceback on the terminal."""
    assert asked(child, "answer(signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, []))") == "True"
    assert signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, [])


ROOM = "answer(*resource.getrlimit(resource.RLIMIT_AS), *resource.getrlimit(resource.RLIMIT_CORE))"


def test_child_without_core_dump_and_with_its_memory_limit(serve):
    import resource

    free, given = Child(serve), Child(serve, 2**32)
    try:
        mine = resource.getrlimit(resource.RLIMIT_AS)
        assert [int(word) for word in asked(free, ROOM).split()] == [*mine, 0, 0]
        most = 2**32 if mine[1] == resource.RLIM_INFINITY else min(2**32, mine[1])
        assert [int(word) for word in asked(given, ROOM).split()] == [most, most, 0, 0]
        # What is taken away cannot be had again, and a limit never gives more than there was.
        again = "from adapters.isolation import limit; limit(2**33); " + ROOM
        assert [int(word) for word in asked(given, again).split()] == [most, most, 0, 0]
        assert asked(given, "\ntry:\n    bytearray(2**33)\nexcept MemoryError:\n    answer('refused')") == "refused"
    finally:
        free.stop(), given.stop()


@pytest.mark.parametrize(
    ("error", "said"), [(OSError(11, "no more"), r"\[Errno 11\] no more"), (MemoryError(), "MemoryError")]
)
def test_reason_when_no_process_can_be_started(serve, monkeypatch, error, said):
    def refuses(process):
        raise error

    monkeypatch.setattr(isolation.multiprocessing.get_context("spawn").Process, "start", refuses)
    with pytest.raises(IsolationError, match=f"^process: cannot start one: {said}$"):
        Child(serve)


def test_child_started_in_a_thread_that_ends(serve):
    """The system reports the end of the thread like that of the process."""

    def begun():
        child = Child(serve)
        assert asked(child, "answer(0)") == "0"
        return child

    with ThreadPoolExecutor(1) as threads:
        child = threads.submit(begun).result()
    assert not within(0.5, child.ended) and asked(child, "answer(1)") == "1"
    child.stop()
