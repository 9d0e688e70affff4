"""One process of a solver: a line of JSON in, a line of JSON out, within a time limit.

The process may be anything: what it says besides its answers, and how it ends, becomes one line of an `EngineError`.
"""

from __future__ import annotations

import contextlib
import json
import os
import select
import signal
import subprocess
import sys
import time
import weakref
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from adapters.engine import EngineError
from adapters.isolation import LOG_BYTES, MOST_BYTES, cause
from adapters.plain import NAME, lines, one_line

#: Time limit of one answer [s]: twice that of a case, which comes first where cases have one.
ANSWER = 600.0
#: Time limit [s] for a process that has closed its output to end, so that its own reason is known.
ENDING = 2.0
#: Time [s] after which a process without output is looked at: it may have ended.
ALIVE = 1.0
#: Lines of its standard error that are repeated on ours when it fails.
SAID = 20


class Process:
    """A program of ``command``, started in ``folder``; it ends with this object.

    Raises
    ------
    ImportError
        If it cannot be started: the engine is not installed.
    """

    def __init__(self, command: Sequence[str], folder: Path) -> None:
        pipe = subprocess.PIPE
        try:
            popen = subprocess.Popen(
                command, cwd=folder, stdin=pipe, stdout=pipe, stderr=pipe, bufsize=0, start_new_session=True
            )
        except (OSError, ValueError) as error:  # ValueError: a zero byte
            raise ImportError(f"{one_line(command[0], NAME)}: {getattr(error, 'strerror', None) or error}") from None
        self._popen, self._asked, self._said = popen, 0, b""
        self.close = weakref.finalize(self, _end, popen)
        assert popen.stdin is not None and popen.stdout is not None and popen.stderr is not None
        self._in, self._out, self._errors = (stream.fileno() for stream in (popen.stdin, popen.stdout, popen.stderr))
        for number in (self._in, self._out, self._errors):
            os.set_blocking(number, False)

    def ended(self) -> bool:
        """Whether it has ended."""
        return self._popen.poll() is not None

    def ask(self, question: str, limit: float = ANSWER, **told: Any) -> dict[str, Any]:
        """Answer to a question; an ``error`` that it answers leaves the process as it is, everything else ends it.

        Raises
        ------
        EngineError
            One line that begins with the question.
        """
        if not self.close.alive:
            raise EngineError(f"{question}: its process has ended")
        self._asked, self._said = self._asked + 1, b""
        text = json.dumps({"ask": question, "id": self._asked, **told}).encode() + b"\n"
        try:
            line, rest = self._line(text, limit)
            answer = self._read(line)
            if rest:
                raise ValueError("more than was asked for was answered")
        except BaseException as error:
            self.close()
            if not isinstance(error, ValueError):
                raise
            if said := lines(self._said.decode(errors="replace"), SAID):
                print(said, file=sys.stderr)
            raise EngineError(f"{question}: {error}") from None
        if "error" in answer:
            raise EngineError(f"{question}: {one_line(answer['error'])}")
        return answer

    def _read(self, line: bytes) -> dict[str, Any]:
        """Table of a line, without its id."""
        try:
            answer = json.loads(line)
        except (ValueError, RecursionError):  # also a number of thousands of digits, or bytes that are no text
            answer = None
        if not isinstance(answer, dict):
            raise ValueError(f"not a table of JSON: {one_line(line[:NAME].decode(errors='replace'), NAME)!r}")
        if (found := answer.pop("id", None)) != self._asked or isinstance(found, bool):
            raise ValueError(f"id: {one_line(found, NAME)} was answered to question {self._asked}")
        return answer

    def _line(self, text: bytes, limit: float) -> tuple[bytes, bytes]:
        """Write a question; read one line, and what came with it.

        Output is read while the question is written, so that neither side waits for the other.
        """
        left, found, ends = memoryview(text), bytearray(), time.monotonic() + limit
        poller = select.poll()
        poller.register(self._in, select.POLLOUT)
        for number in (self._out, self._errors):
            poller.register(number, select.POLLIN)
        while True:
            wait = ends - time.monotonic()
            if wait <= 0.0:
                raise ValueError(f"no answer after {limit:g} s")
            ready = poller.poll(1e3 * min(wait, ALIVE))
            if not ready and self.ended():  # what it has started may keep its output open
                raise ValueError(self._end())
            for number, _ in ready:
                if number == self._in:
                    left = left[self._write(left) :]
                    if not left:
                        poller.unregister(number)
                    continue
                chunk = os.read(number, LOG_BYTES)
                if number == self._errors:
                    self._said = (self._said + chunk)[-LOG_BYTES:]
                elif chunk:
                    found += chunk
                    if b"\n" in chunk:
                        line, _, rest = found.partition(b"\n")
                        if left:
                            raise ValueError("it was answered before it was read")
                        return bytes(line), bytes(rest)
                    if len(found) > MOST_BYTES:
                        raise ValueError(f"a line of more than {MOST_BYTES // 2**20} MiB")
                if not chunk:
                    poller.unregister(number)
                    if number == self._out:
                        raise ValueError(self._end())

    def _write(self, left: memoryview) -> int:
        try:
            return os.write(self._in, left)
        except BlockingIOError:
            return 0
        except BrokenPipeError:  # its end is noticed by its output
            return len(left)

    def _end(self) -> str:
        """How the process ended that has closed its output, with the line of its errors that tells most."""
        try:
            how = cause(self._popen.wait(ENDING))
        except subprocess.TimeoutExpired:
            return "the process closed its output"
        while chunk := self._rest():
            self._said = (self._said + chunk)[-LOG_BYTES:]
        told = [line for line in self._said.decode(errors="replace").splitlines() if line.strip()]
        telling = [line for line in told if "error" in line.lower()] or told
        return f"{how}: {one_line(telling[-1])}" if telling else how

    def _rest(self) -> bytes:
        try:
            return os.read(self._errors, LOG_BYTES)
        except BlockingIOError:
            return b""


def _end(popen: subprocess.Popen[bytes]) -> None:
    """End a process that may hang, and what it has started."""
    with contextlib.suppress(OSError):
        os.killpg(popen.pid, signal.SIGKILL)
    popen.wait()
    for stream in (popen.stdin, popen.stdout, popen.stderr):
        if stream is not None:
            stream.close()
