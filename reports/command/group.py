"""The group of all subcommands: order in the help, common options, and errors as one line with an exit status."""

from __future__ import annotations

import contextlib
import inspect
import os
import sys
import warnings
from functools import partial
from typing import Any, NoReturn

import click

from adapters.engine import EngineError
from adapters.isolation import IsolationError
from adapters.model import ReaderMissing
from adapters.plain import Notice, one_line
from adapters.scene import SceneError
from reports.command import statuses
from reports.command.files import FOLDER
from validation.findings import FindingsError
from validation.records.store import MissingError, StoreError
from validation.workers import LimitError

#: Errors of a wrong call; each is printed as one line, with exit status 2.
WRONG_CALL = (SceneError, EngineError, MissingError, FindingsError)
#: Errors of a machine that has too little memory or no further process.
TOO_LITTLE = (LimitError, IsolationError)

OUT = click.option(
    "--out", default="crosscheck-out", show_default=True, type=FOLDER, metavar="PATH", help="Folder for results."
)
AS_JSON = click.option("--json", "as_json", is_flag=True, help="Print JSON on stdout.")


#: Commands in the order of work.
SECTIONS = {
    "Start here": ("run", "ask", "show", "explain", "report"),
    "Look closer": (
        "findings", "describe", "list", "compare", "bench", "frontier", "residuals", "nulls", "field"
    ),
    "Your own scene, model or engine": ("sweep", "cure", "export", "new-adapter", "check-adapter"),
    "Since which release": ("releases", "bisect", "dashboard"),
    "Maintain results, lists and settings": ("accept", "tune", "bundle", "merge", "prune", "doctor"),
    "The reference solver": ("certify", "profile"),
    "Seldom needed": ("compile", "run-cell", "schema"),
}  # fmt: skip


class _Group(click.Group):
    """Prints errors as one line; the exit status says what kind of error it was (`reports.command.statuses`)."""

    def main(self, *args: Any, **kwargs: Any) -> Any:
        _open_streams()
        try:
            try:
                with warnings.catch_warnings():
                    warnings.simplefilter("always", Notice)
                    warnings.showwarning = partial(_print_warning, set())
                    return super().main(*args, **kwargs)
            finally:
                sys.stdout.flush()  # a full disk must raise here, not at the end of the interpreter
        except ReaderMissing as error:
            _leave(str(error), statuses.INCOMPLETE)
        except WRONG_CALL as error:
            _leave(str(error), statuses.WRONG_CALL)
        except TOO_LITTLE as error:
            _leave(str(error), statuses.INCOMPLETE)
        except StoreError as error:
            _leave(str(error), statuses.RESULTS)
        except ModuleNotFoundError as error:
            _leave(f"{error.name or error}: is not installed here; crosscheck doctor says what is", statuses.INCOMPLETE)
        except BrokenPipeError:
            _silence_stdout()
            sys.exit(statuses.RESULTS)
        except OSError as error:
            _silence_stdout()
            _leave(f"{error.filename or 'the output'}: {error.strerror or error}", statuses.RESULTS)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write all commands by `SECTIONS`, each with the whole first line of its help."""
        width = max(map(len, self.commands))
        for section, names in SECTIONS.items():
            with formatter.section(section):
                lines = [(name.ljust(width), inspect.getdoc(self.commands[name].callback)) for name in names]
                formatter.write_dl([(name, (told or "").partition("\n")[0]) for name, told in lines])
        formatter.write_paragraph()
        formatter.write_text("crosscheck COMMAND --help has options and an example.")

    def invoke(self, ctx: click.Context) -> Any:
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt:
            ctx.exit(statuses.INTERRUPTED)
        except BrokenPipeError:  # click would end with 1, which is a verdict
            _silence_stdout()  # the reader of our output has closed it early
            ctx.exit(statuses.RESULTS)


def _open_streams() -> None:
    """Open standard streams that the caller has closed (``>&-``) on the null device.

    Python has no file for a closed stream, and the next opened file would get its number: the output of an engine would
    be written into that file.
    """
    for descriptor, name in enumerate(("stdin", "stdout", "stderr")):
        if getattr(sys, name) is None:
            null = os.open(os.devnull, os.O_RDWR)  # the lowest free number: that of the closed stream
            if null == descriptor:
                os.set_inheritable(null, True)
            setattr(sys, name, os.fdopen(null, "w" if descriptor else "r", encoding="utf-8", closefd=False))


def _print_warning(told: set[str], message: Warning | str, category: type[Warning], *where: Any, **more: Any) -> None:
    """Print a notice once, in one line, and other warnings as Python does."""
    is_ours = issubclass(category, Notice)
    text = (
        f"crosscheck: {one_line(message, 2000)}" if is_ours else warnings.formatwarning(message, category, *where[:2])
    )
    if text not in told:
        told.add(text)
        with contextlib.suppress(OSError):
            click.echo(text, err=True)


def _leave(line: str, status: int) -> NoReturn:
    with contextlib.suppress(OSError):  # if stderr is closed too, the status is enough
        click.echo(f"crosscheck: {one_line(line, 2000)}", err=True)
    sys.exit(status)


def _silence_stdout() -> None:
    """Point stdout at the null device: the rest of its buffer would raise again at the end of the interpreter."""
    try:
        descriptor = sys.stdout.fileno()
    except (OSError, ValueError):  # no file, as under a test runner
        return
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, descriptor)
    os.close(null)


@click.group(cls=_Group, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="contact-crosscheck", prog_name="crosscheck")
def main() -> None:
    """Run the same contact scenes on physics engines, and say how wrong each one is, at what cost."""
