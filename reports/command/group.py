"""The group of all subcommands: order in the help, common options, and errors as one line with an exit status."""

from __future__ import annotations

import contextlib
import io
import os
import sys
import warnings
from collections.abc import Iterator
from functools import partial
from importlib import import_module
from typing import Any, NoReturn

import click

from reports.command import statuses
from reports.command.files import FOLDER, called

OUT = click.option(
    "--out", default="crosscheck-out", show_default=True, type=FOLDER, metavar="PATH", help="Folder for results."
)
AS_JSON = click.option("--json", "as_json", is_flag=True, help="Print JSON on stdout.")

#: Commands in the order of work, each with its module in `reports.command` and the first line of its help: what the
#: list of commands needs, so that it imports none of them. A test compares these lines with the commands.
SECTIONS = {
    "Start here": {
        "run": ("running", "Run scenes on engines and judge every check."),
        "ask": ("asking", "Find a scene and a fix from a symptom in your words."),
        "show": ("showing", "Show the verdicts of a run again."),
        "explain": ("showing", "Explain one check: values, truth, tolerance, cause and fix."),
        "report": ("reporting", "Write the report of a run as one HTML page."),
    },
    "Look closer": {
        "findings": ("showing", "List the checks of a run that fail, by cause."),
        "describe": ("inspecting", "Describe a scene or an engine."),
        "list": ("inspecting", "List scenes, suites, engines, checks or runs."),
        "compare": ("comparing", "Show what changed between two runs."),
        "bench": ("benching", "Measure error against time, over steps and iterations."),
        "frontier": ("driving", "Find breaking points: how far a scene goes until it fails."),
        "forces": ("forces", "Show what contact forces of engines mean, and if true."),
        "residuals": ("weighing", "Check reported contact forces against the laws of contact."),
        "nulls": ("guessing", "Score trivial answers that need no engine."),
        "field": ("fielding", "Run known reports (public questions and bugs) again."),
    },
    "Your own scene, model or engine": {
        "sweep": ("sweeping", "Run scenes over grids of parameters, into one table."),
        "cure": ("curing", "Search stock settings that fix a scene, and their cost."),
        "export": ("exporting", "Write a case as a script of its engine, or results as tables."),
        "new-adapter": ("inspecting", "Write a package for an engine of your own."),
        "check-adapter": ("inspecting", "Test an adapter for conformance."),
    },
    "Since which release": {
        "releases": ("releasing", "Run scenes on releases of an engine."),
        "bisect": ("releasing", "Find the release that changed a check."),
        "ports": ("porting", "Compare an engine with its ports, scene by scene."),
        "dashboard": ("reporting", "Write one HTML page about all runs and releases."),
    },
    "Maintain results, lists and settings": {
        "accept": ("accepting", "Add failing checks of a run to the list of known failures."),
        "tune": ("tuning", "Search better stock settings for a profile."),
        "bundle": ("reporting", "Write a run as one archive."),
        "merge": ("keeping", "Add the runs of other folders to this one."),
        "prune": ("keeping", "Delete old runs."),
        "doctor": ("inspecting", "Check the installation."),
    },
    "Seldom needed": {
        "compile": ("running", "Compile the solver's kernels."),
        "run-cell": ("running", "Run cases given as JSON, for a scheduler."),
        "schema": ("schema", "Print the JSON Schema of scene files."),
    },
}
_MODULES = {name: module for section in SECTIONS.values() for name, (module, _) in section.items()}


class _Command(click.Command):
    """Refuses empty words, as of a variable that is not set: they would mean a default, or the present folder."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        given, _, _ = self.make_parser(ctx).parse_args(args=list(args))
        for param in self.params:
            value = given.get(str(param.name))
            if "" in (value if isinstance(value, list | tuple) else (value,)):
                raise click.BadParameter("is empty", ctx, param)
        return super().parse_args(ctx, args)


class _Group(click.Group):
    """Imports the module of a command when the command is called, and prints errors as one line.

    The exit status says what kind of error it was (`reports.command.statuses`).
    """

    command_class = _Command

    def make_context(self, *args: Any, **kwargs: Any) -> click.Context:
        with _in_one_line():
            return super().make_context(*args, **kwargs)

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Names of all commands in the order of work."""
        return [*_MODULES]

    def get_command(self, ctx: click.Context, name: str) -> click.Command | None:
        """The command called ``name``; importing its module registers it."""
        if name in _MODULES:
            # Only --timings loads `adapters.stages`: a command that needs nothing of adapters shall not import them.
            stages = sys.modules.get("adapters.stages")
            with stages.stage(stages.START) if stages else contextlib.nullcontext():
                import_module(f"reports.command.{_MODULES[name]}")
        return super().get_command(ctx, name)

    def main(self, *args: Any, **kwargs: Any) -> Any:
        _open_streams()
        try:
            try:
                with warnings.catch_warnings():
                    warnings.simplefilter("always", UserWarning)  # `adapters.plain.Notice` is one
                    warnings.showwarning = partial(_print_warning, set())
                    return super().main(*args, **kwargs)
            finally:
                sys.stdout.flush()  # a full disk must raise here, not at the end of the interpreter
        except ModuleNotFoundError as error:
            _leave(f"{error.name or error}: is not installed here; crosscheck doctor says what is", statuses.INCOMPLETE)
        except OSError as error:
            _silence_stdout()
            _leave(f"{error.filename or 'the output'}: {error.strerror or error}", statuses.RESULTS)
        except Exception as error:
            status = _status_of(error)
            if status is None:
                raise
            _leave(str(error), status)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write all commands by `SECTIONS`, each with the whole first line of its help."""
        width = max(map(len, _MODULES))
        for title, section in SECTIONS.items():
            with formatter.section(title):
                formatter.write_dl([(name.ljust(width), line) for name, (_, line) in section.items()])
        formatter.write_paragraph()
        formatter.write_text("crosscheck COMMAND --help has options and an example.")

    def invoke(self, ctx: click.Context) -> Any:
        try:
            with _in_one_line():
                return super().invoke(ctx)
        except KeyboardInterrupt:
            ctx.exit(statuses.INTERRUPTED)


class _WrongCall(click.ClickException):
    """Prints itself in one line, with no module that only runs need."""

    exit_code = statuses.WRONG_CALL

    def show(self, file: Any = None) -> None:
        """Print the line."""
        with contextlib.suppress(OSError):  # if stderr is closed too, the status is enough
            click.echo(f"crosscheck: {' '.join(self.message.split())}", file, err=True)


@contextlib.contextmanager
def _in_one_line() -> Iterator[None]:
    """Make errors of click those of a wrong call, which begin with the name of the option or argument."""
    try:
        yield
    except click.UsageError as error:
        if error.ctx is not None and error.message == error.ctx.get_help():  # a call without a command
            raise
        name = called(error.param) if isinstance(error, click.BadParameter) else ""
        said = "is missing" if isinstance(error, click.MissingParameter) else error.message.rstrip(".")
        raise _WrongCall(f"{name}: {said}" if name else error.format_message()) from None


def _status_of(error: Exception) -> int | None:
    """Exit status of an error that is printed as one line; None of another. Imports what raised it, not more."""
    from adapters.engine import EngineError
    from adapters.isolation import IsolationError
    from adapters.model import ReaderMissing
    from adapters.scene import SceneError
    from validation.findings import FindingsError
    from validation.records.store import MissingError, StoreError
    from validation.workers import LimitError

    if isinstance(error, ReaderMissing | LimitError | IsolationError):
        return statuses.INCOMPLETE
    if isinstance(error, SceneError | EngineError | MissingError | FindingsError):
        return statuses.WRONG_CALL
    return statuses.RESULTS if isinstance(error, StoreError) else None


class _Output(io.FileIO):
    """Standard output; what its reader does not want any more (``| head``) goes to the null device.

    The command goes on and ends with its own status, which a pipe with ``pipefail`` shows.
    """

    def write(self, data: Any, /) -> int:
        """Write, and count what is left out as written."""
        try:
            return super().write(data)
        except BrokenPipeError:
            _silence(self.fileno())
            return len(data)


def _open_streams() -> None:
    """Open standard streams that the caller has closed (``>&-``) on the null device, and let output be cut short.

    Python has no file for a closed stream, and the next opened file would get its number: the output of an engine would
    be written into that file.
    """
    for descriptor, name in enumerate(("stdin", "stdout", "stderr")):
        if getattr(sys, name) is None:
            null = os.open(os.devnull, os.O_RDWR)  # the lowest free number: that of the closed stream
            if null == descriptor:
                os.set_inheritable(null, True)
            setattr(sys, name, os.fdopen(null, "w" if descriptor else "r", encoding="utf-8", closefd=False))
    out: Any = sys.stdout
    if sys.__stdout__ is not None and out is sys.__stdout__:  # not that of a test runner
        raw: Any = _Output(out.fileno(), "w", closefd=False)
        cut = raw if out.write_through else io.BufferedWriter(raw)  # without a buffer under ``python -u``
        sys.stdout = io.TextIOWrapper(
            cut, out.encoding, out.errors, line_buffering=out.isatty(), write_through=out.write_through
        )


def _print_warning(told: set[str], message: Warning | str, category: type[Warning], *where: Any, **more: Any) -> None:
    """Print a notice once, in one line, and other warnings as Python does."""
    from adapters.plain import Notice, one_line

    is_ours = issubclass(category, Notice)
    text = (
        f"crosscheck: {one_line(message, 2000)}" if is_ours else warnings.formatwarning(message, category, *where[:2])
    )
    if text not in told:
        told.add(text)
        with contextlib.suppress(OSError):
            click.echo(text, err=True)


def _leave(line: str, status: int) -> NoReturn:
    from adapters.plain import one_line

    with contextlib.suppress(OSError):  # if stderr is closed too, the status is enough
        click.echo(f"crosscheck: {one_line(line, 2000)}", err=True)
    sys.exit(status)


def _silence_stdout() -> None:
    """Point stdout at the null device: the rest of its buffer would raise again at the end of the interpreter."""
    try:
        _silence(sys.stdout.fileno())
    except (OSError, ValueError):  # no file, as under a test runner
        return


def _silence(descriptor: int) -> None:
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, descriptor)
    os.close(null)


def _timed(ctx: click.Context, param: click.Parameter, value: bool) -> None:
    """Measure the stages of the command that follows, and print their times when it ends, however it does."""
    if value and not ctx.resilient_parsing:
        from adapters import stages

        stages.begin()
        ctx.call_on_close(_print_timings)


def _print_timings() -> None:
    from adapters import stages
    from reports.stages import timings
    from reports.terminal import terminal

    with contextlib.suppress(OSError):
        timings(terminal(stderr=True))
    stages.end()


@click.group(cls=_Group, context_settings={"help_option_names": ["-h", "--help"]})
@click.option("--timings", is_flag=True, is_eager=True, expose_value=False, callback=_timed,
              help="Print on stderr where the time of the command went.")  # fmt: skip
@click.version_option(package_name="contact-crosscheck", prog_name="crosscheck")
def main() -> None:
    """Run the same contact scenes on physics engines, and say how wrong each one is, at what cost."""
