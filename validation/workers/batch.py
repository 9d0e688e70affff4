"""The remote side of a cluster (`validation.workers.cluster`): a batch of cells in a ``run-cell --batch`` process."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from typing import Any

from adapters.plain import lines

#: Status of ``run-cell`` where cells were left out after time-outs (`reports.command.statuses.INCOMPLETE`).
LEFT = 4


def run_batch(text: str, timeout: float, topic: str, batch: str) -> dict[str, Any]:
    """Run the cells of ``text``, one a line; every result is sent as an event of ``topic`` at once, and returned.

    Returns
    -------
    ``lines`` of results; ``left``: why cells were left out, if any; ``said``: how the process ended; ``worker``.
    """
    from distributed import get_worker

    worker = get_worker()
    worker.log_event(topic, {"batch": batch, "begun": worker.address})
    command = [sys.executable, "-P", "-m", "contact_crosscheck", "run-cell", "--batch", "--timeout", repr(timeout)]
    answers: list[str] = []
    with tempfile.TemporaryFile("w+") as errors:
        process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=errors, text=True)
        assert process.stdin is not None and process.stdout is not None
        try:
            process.stdin.write(text + "\n")
            process.stdin.close()
            for line in process.stdout:
                answers.append(line)
                worker.log_event(topic, {"batch": batch, "line": line, "worker": worker.address})
            code = process.wait()
        finally:
            process.kill()
            process.wait()
        errors.seek(0)
        said = lines(errors.read()[-4096:], 2)
    left = _reason(answers) if code in (2, LEFT) else ""
    return {"lines": answers, "left": left, "said": f"run-cell ended with {code}: {said}", "worker": worker.address}


def _reason(answers: list[str]) -> str:
    """The first error among the results; empty if there is none."""
    found = (json.loads(line) for line in answers)
    return next((str(data["error"]) for data in found if "error" in data), "")
