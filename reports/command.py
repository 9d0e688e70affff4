"""The command: ``crosscheck``. Tables and progress go to stderr, machine output to stdout."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import click
from rich.console import Console

from adapters import registry
from adapters.engine import EngineError
from adapters.scene import SceneError
from reports import exports, listing
from reports.findings import finding_line, lines
from reports.matrix import legend, matrix_of, table_of, versions_of
from reports.progress import run_plan
from validation.acceptance import accept as write_findings
from validation.cells import Slot, parse_dt, slot_from_dict
from validation.plan import Request, slots
from validation.posed import is_file
from validation.rows import Row, rows_of
from validation.scenes import matching
from validation.store import Store, StoreError
from validation.workers import TIMEOUT, run_cells

#: Everything a wrong call can raise; the command turns each into one line and exit code 2.
WRONG_CALL = (SceneError, EngineError, StoreError)
OUT = click.option("--out", default="crosscheck-out", show_default=True, type=Path, help="Folder for results.")
AS_JSON = click.option("--json", "as_json", is_flag=True, help="Print JSON on stdout.")


class _Group(click.Group):
    """Prints what a wrong call raises as one line and exits with 2."""

    def invoke(self, ctx: click.Context) -> Any:
        try:
            return super().invoke(ctx)
        except WRONG_CALL as error:
            click.echo(f"crosscheck: {error}", err=True)
            ctx.exit(2)
        except KeyboardInterrupt:
            ctx.exit(130)


@click.group(cls=_Group, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="contact-crosscheck", prog_name="crosscheck")
def main() -> None:
    """Run the same contact scenes on physics engines, and say how wrong each one is, at what cost."""


def _parameter(text: str) -> tuple[str, float]:
    name, equals, value = text.partition("=")
    if not equals or not name:
        raise SceneError(f"param: {text!r} is not of the form NAME=VALUE")
    try:
        return name.strip(), float(value)
    except ValueError:
        raise SceneError(f"param: {name}={value!r} is not a number") from None


def _scene_names(arguments: Sequence[str]) -> list[str]:
    names: list[str] = []
    for argument in arguments or ["*"]:
        names += [argument] if is_file(argument) else [scene.name for scene in matching(argument)]
    return list(dict.fromkeys(names))


def _request(options: dict[str, Any]) -> Request:
    for name in options["engine"]:
        registry.find(name)
    dimensions = list(options["dim"])
    return Request(
        scenes=_scene_names(options["scenes"]),
        engines=list(options["engine"]) or registry.names(),
        profiles=list(options["profile"]),
        dimensions=dimensions,
        dts=[parse_dt(text) for text in options["dt"]],
        iterations=list(options["iterations"]),
        params=dict(map(_parameter, options["param"])) or None,
        suite="full" if options["full"] else "quick",
        ulps=tuple(options["ulp"]) or ((0, 1, 2) if options["full"] else (0,)),
    )


def _selection(command: Callable[..., None]) -> Callable[..., None]:
    """Options that choose cells; shared by every command that runs some."""
    options = (
        click.argument("scenes", nargs=-1),
        click.option("--param", multiple=True, metavar="NAME=VALUE", help="Fix a parameter of the scene."),
        click.option("--engine", multiple=True, metavar="E", help="Only this engine (repeat for more)."),
        click.option("--profile", multiple=True, metavar="P", help="Only this profile (repeat for more)."),
        click.option("--dim", multiple=True, type=click.IntRange(2, 3), help="Only planar (2) or spatial (3)."),
        click.option("--dt", multiple=True, metavar="S", help="Step, such as 1/240 (repeat for more)."),
        click.option("--iterations", multiple=True, type=click.IntRange(1), help="Replace the profile's count."),
        click.option("--ulp", multiple=True, type=int, help="Move the start by this many units in the last place."),
        click.option("--quick/--full", "quick", default=True, help="Suite; quick is the default."),
    )
    for option in reversed(options):
        command = option(command)
    return command


@main.command()
@_selection
@click.option("--jobs", default=0, type=click.IntRange(0), help="Worker processes; 0: one per core.")
@click.option("--timeout", default=TIMEOUT, show_default=True, type=click.FloatRange(1.0), help="Per cell [s].")
@click.option("--dry-run", is_flag=True, help="Say how many cells there are, and stop.")
@click.option("--fresh", is_flag=True, help="Start a new run even if one can be resumed.")
@click.option("--keep-trajectories", is_flag=True, help="Keep every trajectory as .npz in OUT/trajectories.")
@click.option("--all-findings", is_flag=True, help="Print every finding, not the worst of each family.")
@click.option("--junit", type=Path, help="Also write JUnit XML to this file.")
@click.option("--markdown", type=Path, help="Also write a Markdown summary to this file.")
@AS_JSON
@OUT
def run(out: Path, as_json: bool, **options: Any) -> None:
    """Run SCENES (names, globs or files; all by default) and judge them.

    Exits with 1 if a row is new, drifted, INVALID, CRASHED or TIMED OUT, with 2 if the call is wrong.
    """
    console = Console(stderr=True)
    options["full"] = not options["quick"]
    request = _request(options)
    chosen = slots(request)
    if not chosen:
        raise SceneError("scenes: no cell fits this selection")
    if options["dry_run"]:
        click.echo(f"{len(chosen)} cells")
        return
    store = Store(out)
    keep = out / "trajectories" if options["keep_trajectories"] else None
    title = f"{request.suite}: {' '.join(request.scenes)}"
    done = run_plan(store, title, chosen, console, options["jobs"], options["timeout"], keep, options["fresh"])
    rows = rows_of(done.id, store.observations(done))
    store.close()
    _show(rows, out, as_json, console, options)
    sys.exit(1 if any(row.alarming for row in rows) else 0)


def _show(rows: list[Row], out: Path, as_json: bool, console: Console, options: dict[str, Any]) -> None:
    plain = [row.as_dict() for row in rows]
    written = exports.write_all(out, plain)
    if options["junit"]:
        options["junit"].write_text(exports.as_junit(plain), encoding="utf-8")
    if options["markdown"]:
        options["markdown"].write_text(exports.as_markdown(plain), encoding="utf-8")
    if as_json:
        click.echo(exports.as_json(plain))
    for line in lines(plain, None if options["all_findings"] else 1):
        console.print(line, markup=False, highlight=False, soft_wrap=True)
    console.print(table_of(matrix_of(plain), versions_of(plain)))
    console.print(legend(), style="dim", markup=False)
    console.print(f"{len(rows)} rows; written: {', '.join(str(path) for path in written.values())}", markup=False)


@main.command("run-cell")
@click.option("--batch", is_flag=True, help="Read one JSON object per line, write one observation per line.")
@click.option("--timeout", default=TIMEOUT, show_default=True, type=click.FloatRange(1.0), help="Per cell [s].")
@click.option("--jobs", default=1, show_default=True, type=click.IntRange(1), help="Worker processes.")
def run_cell(batch: bool, timeout: float, jobs: int) -> None:
    """Run slots given as JSON on stdin, print observations as JSON on stdout; for any scheduler to drive."""
    text = click.get_text_stream("stdin").read()
    cells = [_slot(line) for line in (text.splitlines() if batch else [text]) if line.strip()]
    if not cells:
        raise SceneError("slot: nothing on stdin")
    for observation in run_cells(cells, jobs, timeout):
        click.echo(json.dumps(observation.as_dict(), default=str))


def _slot(text: str) -> Slot:
    try:
        data = json.loads(text)
    except json.JSONDecodeError as error:
        raise SceneError(f"slot: is not JSON: {error}") from None
    if not isinstance(data, dict):
        raise SceneError("slot: must be a JSON object")
    slot = slot_from_dict(data)
    registry.find(slot.engine)
    return slot


@main.command("list")
@click.argument("what", type=click.Choice(["scenes", "engines", "checks", "runs"]))
@AS_JSON
@OUT
def list_(what: str, as_json: bool, out: Path) -> None:
    """List scenes, engines, checks, or the runs in OUT."""
    if what == "runs":
        store = Store(out, create=False)
        data = [{"id": r.id, "date": r.date, "title": r.title, "finished": r.finished} for r in store.runs()]
    else:
        data = {"scenes": listing.scenes, "engines": listing.engines, "checks": listing.checks}[what]()
    if as_json:
        click.echo(json.dumps(data, indent=1))
        return
    for entry in data:
        click.echo(_entry_line(entry))


def _entry_line(entry: dict[str, Any]) -> str:
    head = str(entry.get("name") or entry.get("id"))
    rest = [_flat(value) for key, value in entry.items() if key not in ("name", "id") and value not in ("", [], None)]
    return f"{head:<24} " + " | ".join(rest)


def _flat(value: Any) -> str:
    return (
        ", ".join(map(str, value))
        if isinstance(value, list)
        else f"{value:g}"
        if isinstance(value, float)
        else str(value)
    )


@main.command()
@click.argument("name")
@AS_JSON
def describe(name: str, as_json: bool) -> None:
    """Describe a scene or an engine: law, parameters, checks with reasons; profiles, settings, quirks."""
    data = listing.describe(name)
    click.echo(json.dumps(data, indent=1, default=str) if as_json else _outline(data))


def _outline(data: Any, indent: int = 0) -> str:
    pad = "  " * indent
    if isinstance(data, dict):
        return "\n".join(
            f"{pad}{key}: {_inline(value)}" if _is_plain(value) else f"{pad}{key}:\n{_outline(value, indent + 1)}"
            for key, value in data.items()
        )
    if isinstance(data, list):
        return "\n".join(f"{pad}- {_inline(item)}" if _is_plain(item) else _item(item, indent) for item in data)
    return "\n".join(pad + line for line in str(data).splitlines())


def _item(item: Any, indent: int) -> str:
    if isinstance(item, dict) and all(_is_plain(v) for v in item.values()):
        return "  " * indent + "- " + "; ".join(f"{k} {_inline(v)}" for k, v in item.items() if v != "")
    return "  " * indent + "-\n" + _outline(item, indent + 1)


def _is_plain(value: Any) -> bool:
    return not isinstance(value, dict | list) and "\n" not in str(value)


def _inline(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


@main.command()
@AS_JSON
def doctor(as_json: bool) -> None:
    """Check the installation: engines, versions, CPU, caches, and whose packages are on this path."""
    data = listing.doctor()
    click.echo(json.dumps(data, indent=1) if as_json else _outline(data))
    sys.exit(1 if any("is not ours" in problem for problem in data["problems"]) else 0)


@main.command("check-adapter")
@click.argument("name")
@AS_JSON
def check_adapter_(name: str, as_json: bool) -> None:
    """Run the conformance checks on the adapter of an engine; exits with 1 if it breaks one."""
    from adapters.conformance import check_adapter

    findings = check_adapter(registry.load(name))
    if as_json:
        from dataclasses import asdict

        click.echo(json.dumps([asdict(finding) for finding in findings], indent=1, default=str))
    else:
        for finding in findings:
            click.echo(str(finding))
    sys.exit(0 if all(finding.holds for finding in findings) else 1)


@main.command()
@click.argument("run", default="latest")
@click.option("--engine", multiple=True, required=True, metavar="E", help="Whose list to write (repeat for more).")
@OUT
def accept(run: str, engine: tuple[str, ...], out: Path) -> None:
    """List the FAIL rows of RUN as known findings; only rows for which reasons.toml has a reason.

    Writes validation/findings/<engine>.csv of this checkout. Read the diff before you commit it: a finding is
    listed to be shown, not to be hidden.
    """
    for name in engine:
        registry.find(name)
    counts, unexplained = write_findings(exports.load_rows(out, run), engine)
    for name, count in counts.items():
        click.echo(f"{name}: {count} rows listed")
    for row in unexplained:
        click.echo("no reason is written for: " + finding_line(row.as_dict()), err=True)
    sys.exit(1 if unexplained else 0)


if __name__ == "__main__":
    main()
