"""Six screens that a user sees most, as they are printed; the run that most of them tell of is kept (`kept_run`)."""

from __future__ import annotations

import re
from collections.abc import Callable
from contextlib import chdir
from functools import cache, partial
from pathlib import Path
from tempfile import TemporaryDirectory, mkdtemp
from unittest.mock import patch

import kept_run
from click.testing import CliRunner

from adapters.registry import load
from reports.command import main
from reports.page import load_source
from reports.wording import row_id

WIDTH = "100"


@cache
def place() -> Path:
    """Where a results folder ``OUT`` has the run that is kept, made once for all."""
    found = Path(mkdtemp(prefix="crosscheck-kept-"))
    kept_run.fill(found / "OUT")
    return found


def printed(where: Path, *arguments: str) -> str:
    """What a command prints there on a terminal without colours, and its status.

    Its results folder has a short name: lines are broken in one place on every machine.
    """
    call = [*arguments, *(("--out", "OUT") if arguments[0] not in ("describe", "list") else ())]
    with patch.dict("os.environ", {"COLUMNS": WIDTH, "NO_COLOR": "1", "TERM": "dumb"}), chdir(where):
        result = CliRunner().invoke(main, call)
    lines = [f"$ crosscheck {' '.join(call)}", *result.output.splitlines(), f"exit status {result.exit_code}"]
    return "\n".join(line.rstrip() for line in lines) + "\n"


def of_the_kept_run(*arguments: str) -> str:
    """A command about the run that is kept."""
    return printed(place(), *arguments)


def explained() -> str:
    """The first row that an engine's law explains."""
    rows = load_source(place() / "OUT").rows
    return of_the_kept_run("explain", row_id(next(row for row in rows if row["standing"] == "explained")))


def ran() -> str:
    """A small run of one engine, without its version and lines of progress, which tell times.

    Scenes are told in the order in which their last cases end, which differs from run to run: they are sorted.
    """
    with TemporaryDirectory(prefix="crosscheck-run-") as where:
        text = printed(Path(where), "run", "bounce", "slide", "--engine", "chipmunk", "--jobs", "1")
    text = re.sub(r"(?m)(^chipmunk  \w+ .*\n)+", lambda told: "".join(sorted(told[0].splitlines(keepends=True))), text)
    return re.sub(r"(?m)^\d+ cases: .*\n", "", text).replace(load("chipmunk").version(), "VERSION")


SCREENS: dict[str, Callable[[], str]] = {
    "screens/run": ran,
    "screens/show": partial(of_the_kept_run, "show"),
    "screens/explain": explained,
    "screens/compare": partial(of_the_kept_run, "compare", "20260101-000000", "20260103-000000", "--only-changed"),
    "screens/describe": partial(of_the_kept_run, "describe", "bounce"),
    "screens/list": partial(of_the_kept_run, "list", "scenes"),
}
