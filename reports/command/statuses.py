"""Exit statuses of the command: one table, which the documentation shows and a test compares.

If several apply, the first in this order counts: the call, the results, the verdicts, completeness.
"""

from __future__ import annotations

#: Everything ran, and no result is unexpected.
FINE = 0
#: A verdict: checks new, drifted, INVALID, REFUSED, CRASHED, TIMED OUT or missing; a regression; a failed bound.
ALARM = 1
#: The call is wrong: an unknown name, a value out of range, an invalid scene file. Nothing has run.
WRONG_CALL = 2
#: Results could not be kept, read or written: a full or read-only disk, a store of a later version, a damaged file.
RESULTS = 3
#: Not everything ran: a named engine is missing, cases did not finish, the machine has too little memory.
INCOMPLETE = 4
#: Ctrl-C; finished cases are kept, and the same command resumes.
INTERRUPTED = 130

#: Status -> meaning, as in docs/reference/status.md.
MEANING = {
    FINE: "everything ran, no result is unexpected",
    ALARM: "an unexpected result: a new failure, a changed value, INVALID, REFUSED, crashed, timed out or missing; "
    "a regression; a failed test; a cause refuted; a better setting found",
    WRONG_CALL: "the call is wrong: unknown name, value out of range, invalid scene file; nothing has run",
    RESULTS: "results could not be kept, read or written: disk full, store damaged or of a later version",
    INCOMPLETE: "not everything ran: a named engine is missing, cases did not finish in time, too little memory, no "
    "check in both runs",
    INTERRUPTED: "interrupted; finished cases are kept, the same command resumes",
}


def verdict(alarming: bool, complete: bool = True) -> int:
    """Status of a command that ran: an unexpected result counts before a missing one."""
    return ALARM if alarming else FINE if complete else INCOMPLETE
