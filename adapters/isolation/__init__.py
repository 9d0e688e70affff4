"""A separate process for foreign code: whatever that code does, the parent continues.

    parent --(bytes)--> child: serve(connection) in a session of its own, with limits, its output in a pipe
       ^ an answer; or the reason of the child's end and its last output

The pipe needs no file and no semaphore, so neither a full temporary folder nor a missing /dev/shm matters. Stopping a
child also stops everything that it started. Each question has a mark, which its answer must bear: what foreign code
writes into the pipe, or a process that it forks, cannot answer in the child's place.
"""

from __future__ import annotations

import atexit
import contextlib
import ctypes
import multiprocessing
import os
import secrets
import signal
import socket
import struct
import sys
import time
import weakref
from collections.abc import Callable, Iterator
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection, wait
from typing import Any, cast

from adapters.plain import lines, one_line

_PR_SET_PDEATHSIG, _PR_SET_CHILD_SUBREAPER = 1, 36  # <linux/prctl.h>
#: Time limit [s] of a child's guardian to end the child's processes: what survives a minute hangs in the kernel.
GRACE = 60.0
#: Stored bytes of a child's output: enough for the last lines of a traceback.
LOG_BYTES = 2**16
#: Longest pause [s] within an answer or a question: half an answer may be all that comes.
PAUSE = 10
LOG_LINES = 5
#: Largest answer [bytes]: an observation takes some kilobytes, a recording about one megabyte.
MOST_BYTES = 2**26
#: Mark of what a child sends before the first question; others are random and as long.
UNASKED = bytes(16)
_children: weakref.WeakSet[Child] = weakref.WeakSet()


class IsolationError(RuntimeError):
    """A process cannot be started; one line."""


class Lost(RuntimeError):
    """A child ended, or did not answer; the reason in one line."""


class Mistaken(Lost):
    """An answer is not that of the question; one line."""


class Child:
    """One process that serves a connection.

    Parameters
    ----------
    serve
        Function of a module, called with the connection in the child; it returns when the other end closes.
    memory
        Address space [bytes], or None for no limit.

    Raises
    ------
    IsolationError
        If no process can be started.
    """

    def __init__(self, serve: Callable[[Connection], None], memory: int | None = None) -> None:
        context = multiprocessing.get_context("spawn")  # forks would inherit open files and modules of the parent
        try:
            self.connection, theirs = context.Pipe()
            self.log, writing = context.Pipe(duplex=False)
            self._process = context.Process(target=_main, args=(serve, theirs, writing, os.getpid(), memory))
            with _ctrl_c_held_back():
                self._process.start()
        except (OSError, MemoryError) as error:
            raise IsolationError(f"process: cannot start one: {one_line(error) or type(error).__name__}") from None
        theirs.close()
        writing.close()
        os.set_blocking(self.log.fileno(), False)
        _limit_pauses(self.connection)
        self.written = b""
        self._reason = ""
        self._mark = UNASKED
        _children.add(self)

    @property
    def sentinels(self) -> list[Any]:
        """Objects that become ready when the child answers, writes or ends."""
        written = [self.log] if self.drain() else []  # a closed output is always ready, without further data
        return [self.connection, *written, self._process.sentinel]

    def send(self, message: bytes) -> None:
        """Ask a question; a dead child is noticed when its answer is read."""
        self._mark = secrets.token_bytes(len(UNASKED))
        with contextlib.suppress(OSError):
            self.connection.send_bytes(self._mark + message)

    def has_answer(self) -> bool:
        """Whether `receive` returns or raises at once; also reads the child's output."""
        self.drain()
        try:
            return self.connection.poll()
        except OSError:
            return True

    def receive(self, timeout: float | None = None) -> bytes:
        """Answer to the last question.

        Raises
        ------
        Lost
            If it ended, closed its end, answered too much, or not within ``timeout`` [s].
        Mistaken
            If it answers anything else; it is stopped.
        """
        ends = None if timeout is None else time.monotonic() + timeout
        while not self.has_answer():
            left = None if ends is None else ends - time.monotonic()
            if left is not None and left <= 0.0:
                raise Lost(f"no answer after {timeout:g} s")
            if self._process.sentinel in wait(self.sentinels, left) and not self.has_answer():
                raise Lost(self.stop())
        try:
            answer = self.connection.recv_bytes(len(UNASKED) + MOST_BYTES)
        except BlockingIOError:
            self.stop()
            raise Lost("its process gave half an answer") from None
        except (EOFError, OSError):
            raise Lost(self.stop()) from None
        if not answer.startswith(self._mark):
            self.stop()
            raise Mistaken("its process answered what it was not asked")
        return answer[len(UNASKED) :]

    def drain(self) -> bool:
        """Read the child's output and keep its end; False if it closed its output."""
        if self._process is None:
            return False
        try:
            while chunk := os.read(self.log.fileno(), LOG_BYTES):
                self.written = (self.written + chunk)[-LOG_BYTES:]
            return False
        except OSError:  # no data at the moment
            return True

    def ended(self) -> bool:
        """Whether the process has ended."""
        return self._process is None or bool(wait([self._process.sentinel], 0.0))

    def tail(self) -> str:
        """Last lines of the child's output since `written` was cleared."""
        self.drain()
        return lines(self.written.decode(errors="replace"), LOG_LINES)

    def stop(self) -> str:
        """End the child and everything it started; returns how it had ended if it did so itself."""
        if self._process is None:
            return self._reason
        process = self._process
        self.drain()
        # A child that has just closed its connection is about to end: its own reason is more useful.
        wait([process.sentinel], 0.5 if self._closed() else 0.0)
        ended = _has_ended(process)
        if not ended:
            assert process.pid is not None
            process.terminate()  # its guardian ends all its processes, and then itself
            if hasattr(signal, "SIGCONT"):
                _kill(process.pid, signal.SIGCONT)  # the child may have stopped it
            process.join(GRACE)
            for other in _descendants(process.pid):  # for a guardian that was stopped by its child
                _kill(other)
            process.kill()
        process.join()
        self._reason = cause(process.exitcode) if ended else "the process closed its connection"
        self.drain()
        self.connection.close()
        self.log.close()
        self._process = None  # type: ignore[assignment]
        _children.discard(self)
        return self._reason

    def _closed(self) -> bool:
        try:
            return self.connection.poll()
        except OSError:
            return True


@contextlib.contextmanager
def _ctrl_c_held_back() -> Iterator[None]:
    """Ctrl-C waits until a process is started, and never reaches it: its imports would end with a traceback."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    resource_tracker.ensure_running()  # which lets Ctrl-C through when it starts
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _main(
    serve: Callable[[Connection], None], connection: Connection, log: Connection, parent: int, memory: int | None
) -> None:
    if hasattr(os, "setsid"):
        os.setsid()  # the parent handles Ctrl-C
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if sys.platform == "linux":
        _guard(parent, connection)
    null = os.open(os.devnull, os.O_RDWR)
    os.dup2(null, 0)
    if sys.platform != "win32":  # the parent's tracker of semaphores prints errors of what foreign code writes to it
        os.dup2(null, cast(int, resource_tracker.getfd()))
    os.close(null)
    for stream in (1, 2):
        os.dup2(log.fileno(), stream)
    log.close()
    limit(memory)
    serve(cast(Connection, _Marked(connection)))


def _limit_pauses(connection: Connection) -> None:
    """Let a read or a write fail that moves nothing for `PAUSE`, where a connection is a socket."""
    if sys.platform != "win32":
        with socket.socket(fileno=os.dup(connection.fileno())) as ours:
            for option in (socket.SO_RCVTIMEO, socket.SO_SNDTIMEO):
                ours.setsockopt(socket.SOL_SOCKET, option, struct.pack("ll", PAUSE, 0))


class _Marked:
    """The child's end: answers bear the mark of the last question, and copies of the child give none."""

    def __init__(self, connection: Connection) -> None:
        self._connection, self._mark, self._home = connection, UNASKED, os.getpid()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._connection, name)

    def recv_bytes(self) -> bytes:
        """Next question."""
        message = self._connection.recv_bytes()
        self._mark = message[: len(UNASKED)]
        return message[len(UNASKED) :]

    def send_bytes(self, answer: bytes) -> None:
        """Answer it."""
        if os.getpid() != self._home:  # a library has forked, and its copy has come back to our code
            os._exit(0)
        self._connection.send_bytes(self._mark + answer)


def end_with(parent: int) -> None:
    """Let this process be killed when the starting thread of ``parent`` ends; end at once if it has ended.

    For pools of a library, whose processes would notice the end of the parent only after their task.
    """
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:
        os._exit(1)


def _guard(parent: int, connection: Connection) -> None:
    """Fork: the child returns and serves, the parent process waits, and ends everything that the child leaves behind.

    The guardian adopts orphaned descendants, so it also finds those that left its group. It ends like the child, or
    when its own parent dies.
    """
    blocked = {signal.SIGTERM, signal.SIGHUP, signal.SIGCHLD}
    before = signal.pthread_sigmask(signal.SIG_BLOCK, blocked)
    libc = ctypes.CDLL(None)
    libc.prctl(_PR_SET_CHILD_SUBREAPER, 1)
    libc.prctl(_PR_SET_PDEATHSIG, signal.SIGHUP)  # also where only the thread ends that has started this process
    if os.getppid() != parent:  # it had already ended
        os._exit(1)
    guardian = os.getpid()
    child = os.fork()
    if child == 0:
        os.setpgid(0, 0)
        libc.prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
        libc.prctl(_PR_SET_CHILD_SUBREAPER, 0)
        if os.getppid() != guardian:
            os._exit(1)
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
        return
    connection.close()
    while True:
        said = signal.sigwait(blocked)
        if said == signal.SIGTERM or os.getppid() != parent:
            _kill(-child)
            _sweep()
            _end_like(signal.SIGTERM)
        while (ended := os.waitid(os.P_ALL, 0, os.WEXITED | os.WNOHANG | os.WNOWAIT)) is not None:
            if ended.si_pid == child:
                _kill(-child)  # its group, whose number is not given to others before the child is waited for
            status = os.waitpid(ended.si_pid, 0)[1]
            if ended.si_pid == child:
                _sweep()
                _end_like(status)


def _sweep() -> None:
    """End all descendants: killing one may orphan others, which this process adopts, so until none is left."""
    while True:
        for other in _descendants(os.getpid()):
            _kill(other)
        try:
            while os.waitpid(-1, os.WNOHANG)[0]:
                pass
        except ChildProcessError:
            return  # none is left
        time.sleep(0.01)


def _end_like(status: int) -> None:
    """End as a child with this status has ended."""
    if os.WIFSIGNALED(status):
        number = os.WTERMSIG(status)
        with contextlib.suppress(OSError, ValueError):  # signals that cannot be handled
            signal.signal(number, signal.SIG_DFL)
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {number})
        limit(None)
        os.kill(os.getpid(), number)
    os._exit(os.waitstatus_to_exitcode(status) & 0xFF)


def limit(memory: int | None) -> None:
    """Limit this process: no core files, and an address space of ``memory`` [bytes] or what the machine allows."""
    if sys.platform == "win32":
        return
    import resource

    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    if memory is not None:
        _, hard = resource.getrlimit(resource.RLIMIT_AS)
        most = memory if hard == resource.RLIM_INFINITY else min(memory, hard)
        resource.setrlimit(resource.RLIMIT_AS, (most, most))


def _has_ended(process: Any) -> bool:
    """Whether a process has ended by itself; a closed sentinel is no proof.

    It is not waited for here; `multiprocessing` does that for ended processes when it starts another one.
    """
    if not hasattr(os, "waitid"):
        return bool(wait([process.sentinel], 0.0))
    ends = time.monotonic() + 0.5
    while wait([process.sentinel], 0.0):  # the sentinel closes a moment before the process can be waited for
        try:
            if os.waitid(os.P_PID, process.pid, os.WEXITED | os.WNOHANG | os.WNOWAIT) is not None:
                return True
        except ChildProcessError:  # it has been waited for
            return True
        if time.monotonic() > ends:
            return False
        time.sleep(0.01)
    return False


def cause(code: int | None) -> str:
    """How a process with this exit code ended, in words."""
    if code is None or code >= 0:
        return f"the process ended with exit code {code}"
    try:
        name = signal.Signals(-code).name
    except ValueError:  # real-time signals have no names of their own
        name = f"signal {-code}"
    return f"the process was killed by {name}"


def _descendants(pid: int | None) -> list[int]:
    """Processes that ``pid`` started, and theirs, where the system reports them: some leave the group."""
    found: list[int] = []
    todo = [pid]
    while todo:
        folder = f"/proc/{todo.pop()}/task"
        try:
            for task in os.listdir(folder):
                with open(f"{folder}/{task}/children") as stream:
                    new = [int(word) for word in stream.read().split()]
                found += new
                todo += new
        except OSError:
            continue
    return found


def _kill(pid: int, number: int = getattr(signal, "SIGKILL", 9)) -> None:
    with contextlib.suppress(OSError):
        os.kill(pid, number)


@atexit.register
def _stop_all() -> None:
    for child in list(_children):
        child.stop()
