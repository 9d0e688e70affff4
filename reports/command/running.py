"""``run`` and ``run-cell``: run cases, judge them, store and show the results."""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass, replace
from pathlib import Path

import click
from rich.console import Console

from adapters.engine import EngineError
from adapters.plain import one_line
from adapters.scene import SceneError
from adapters.whole import write
from reports import brief, exports
from reports.command import statuses
from reports.command.files import FILE, folder, writable
from reports.command.group import AS_JSON, OUT, main
from reports.command.posing import cells_of, compare_and_show
from reports.command.selection import JOBS, SECONDS, Cases, cluster, gathered, missing, option, selection
from reports.progress import run_plan
from reports.spread import spread_lines
from reports.stages import compiling
from reports.summary import show
from reports.terminal import terminal
from reports.verdicts import Verdicts
from reports.wording import plural
from validation import posed
from validation.cells import Slot, prepare, slot_from_dict
from validation.posed import is_file, pinned, resolve
from validation.questions.spread import spreads
from validation.records.store import Store
from validation.running.plan import slots
from validation.running.warming import missing as kernels_missing
from validation.settings.effects import idle_in
from validation.workers import TIMEOUT, run_cells


@dataclass(frozen=True)
class Running:
    """Options of ``run`` beside its cases."""

    jobs: int = option(0, "Worker processes; 0: one per core.", type=JOBS)
    timeout: float = option(TIMEOUT, "Time limit per case [s].", type=SECONDS, show_default=True)
    dry_run: bool = option(False, "Print the number of cases, and stop.")
    fresh: bool = option(False, "Start a new run even if one can be resumed.")
    keep: bool = option(
        False, "With --invariance: update the list of known violations, those with a reason in breaks.toml."
    )
    invariance: bool = option(
        False, "Run metamorphic tests instead: the order, heading and place of bodies must not matter."
    )
    cluster: str = cluster()
    for_bench: bool = option(False, "Also run the cases of bench --quick, which then only times them.")
    keep_trajectories: bool = option(False, "Keep every trajectory as .npz in OUT/trajectories.")
    drop: bool = option(False, "Leave out what a scene cannot have of a model, and print what was left out.")
    strict: bool = option(False, "Exit with 1 for every failure, known or not, and every INVALID.")
    junit: Path | None = option(None, "Also write JUnit XML to this file.", type=FILE)
    markdown: Path | None = option(None, "Also write a Markdown summary to this file.", type=FILE)


@main.command(epilog="Example: crosscheck run bounce --param e=0.7 --dt 1/240")
@selection
@gathered("how", Running)
@AS_JSON
@OUT
def run(cases: Cases, how: Running, out: Path, as_json: bool) -> None:
    """Run scenes on engines and judge every check.

    SCENES are names, globs, scene files or models (.xml, .urdf, .sdf); all by default. All installed engines run,
    unless --engine names some.

    Exits with 1 if a result is unexpected: a failure that is not on record, a value that differs from its record,
    INVALID, REFUSED, crashed, timed out or missing. Exits with 2 if the call is wrong, with 4 if not all of it ran. A
    failed check that a scene file states is unexpected. Failures of models, and of engines without a list of known
    failures, are shown and do not change the exit status, unless --strict is given.

    With --invariance one case of each scene, engine and profile is run again with bodies renumbered, the world turned,
    mirrored, moving or far away, with a body out of reach, and in a fresh process. Nothing is stored. Exits with 1 if
    an answer changes.
    """
    console = terminal(stderr=True)
    for name, path in (("junit", how.junit), ("markdown", how.markdown)):
        if path:
            writable(path, name)
    request = cases.request(how.drop)
    chosen = slots(request)
    if not chosen:
        raise SceneError("scenes: no case fits this selection")
    if how.dry_run:
        click.echo(json.dumps({"cells": len(chosen)}) if as_json else plural(len(chosen), "case"))
        return
    if how.invariance:
        cells = cells_of(chosen, bool(cases.param or cases.iterations or cases.dt))
        sys.exit(statuses.verdict(not compare_and_show(cells, as_json, how.keep), True))
    if how.keep:
        raise SceneError("keep: lists violations of metamorphic tests, and needs --invariance")
    if how.cluster and how.keep_trajectories:
        raise SceneError("keep_trajectories: a cluster sends back no trajectories; run those cases here")
    folder(out)
    for name in request.scenes:
        for note in resolve(name).notes:
            console.print(f"{name}: {note}", markup=False, highlight=False, soft_wrap=True)
    for line in idle_in(chosen):
        console.print(line, markup=False, highlight=False, soft_wrap=True)
    store = Store(out)
    keep = out / "trajectories" if how.keep_trajectories else None
    title = f"{request.suite}: {cases.words(request.scenes)}"
    limits = how.jobs, how.timeout
    verdicts = Verdicts(chosen, console)
    beside = _of_bench(cases) if how.for_bench else ("", [])
    done = run_plan(store, title, chosen, console, *limits, keep, how.fresh, cluster=how.cluster,
                    heard=verdicts.add, finish=False, beside=beside)  # fmt: skip
    found = brief.Judged.of(verdicts.rows(done))
    observations, complete = store.observations(done), not store.missing(done)
    if complete:
        brief.keep(store, done, observations, found)
    apart = spreads(observations, store.recordings(done)) if any(map(is_file, request.scenes)) else []
    # The answer goes to stdout, for a pipe or a file, unless --json prints there.
    answer = console if as_json else terminal()
    _show(found, out, as_json, answer, how)
    if complete:
        store.finish(done)  # after its files: the same command would write them again
    store.close()
    for line in spread_lines(apart):
        answer.print(line, markup=False, highlight=False, soft_wrap=True)
    absent = missing(cases.engine, request.engines)
    for line in absent:
        console.print(line, markup=False, highlight=False, soft_wrap=True)
    alarm = any(row.failing if how.strict else row.alarming for row in found.rows)
    sys.exit(statuses.verdict(alarm, complete and not absent))


def _of_bench(cases: Cases) -> tuple[str, list[Slot]]:
    """Title and cases of the quick benchmark of the same selection."""
    from reports.command.benching import plan_of

    _, title, cells = plan_of(replace(cases, quick=True, standard=False, full=False, ulp=()))
    return title, cells


def _show(found: brief.Judged, out: Path, as_json: bool, console: Console, how: Running) -> None:
    plain = [row.as_dict() for row in found.rows]
    written = exports.write_all(out, plain, [row.as_dict() for row in found.nulls])
    if how.junit:
        write(how.junit, exports.as_junit(plain))
    if how.markdown:
        write(how.markdown, exports.as_markdown(plain))
    if as_json:
        click.echo(exports.as_json(plain))
    show(plain, console, files=written.values(), out=out)


@main.command("compile", epilog="Example: crosscheck compile")
@selection
@AS_JSON
def compile_kernels(cases: Cases, as_json: bool) -> None:
    """Compile the solver's kernels.

    Compiles what these scenes and engines need for their first steps. `run` and `bench` do this by themselves. Call it
    before processes that run side by side, which would each compile the same.
    """
    parts = kernels_missing(slots(cases.request()))
    said = compiling(parts, terminal(stderr=True))
    for _ in run_cells((), jobs=0, parts=parts, compiled=said):
        pass
    if as_json:
        click.echo(json.dumps({"compiled": [str(part) for part in parts]}))


@main.command("run-cell", epilog="Example: crosscheck run-cell < slots.json")
@click.option("--batch", is_flag=True, help="Read one JSON object per line, write one result per line.")
@click.option("--timeout", default=TIMEOUT, show_default=True, type=SECONDS, help="Time limit per case [s].")
@click.option("--jobs", default=1, show_default=True, type=JOBS, help="Worker processes.")
def run_cell(batch: bool, timeout: float, jobs: int) -> None:
    """Run cases given as JSON, for a scheduler.

    Cases are read from stdin, results are written to stdout. With --batch a first line {"scenes": {...}} may hold
    the texts of scene files, by their pinned names, so that the files need not be here. Every other line gets one line
    of output: a result, or {"line": N, "error": "..."} if it is not a case or the case did not finish. Exits with 2 if
    a line was wrong, with 4 if a case did not finish.
    """
    text = sys.stdin.buffer.read().decode(errors="replace")
    cells: dict[Slot, int] = {}
    wrong, left = 0, 0

    def refuse(line: int, error: str) -> None:
        click.echo(json.dumps({"line": line, "error": error}))

    for number, line in enumerate(text.splitlines() if batch else [text], start=1):
        if not line.strip():
            continue
        try:
            if batch and _has_scene_texts(line):
                continue
            cells.setdefault(_slot(line), number)
        except (SceneError, EngineError) as error:
            if not batch:
                raise
            wrong += 1
            refuse(number, str(error))
    if not cells and not wrong:
        raise SceneError("slot: nothing on stdin")

    def leave(slot: Slot, reason: str) -> None:
        nonlocal left
        left += 1
        refuse(cells[slot], f"left: {reason}")

    for observation in run_cells(list(cells), jobs, timeout, leave=leave):
        click.echo(json.dumps(observation.as_dict(), default=str))
    sys.exit(statuses.WRONG_CALL if wrong else statuses.INCOMPLETE if left else statuses.FINE)


def _has_scene_texts(line: str) -> bool:
    """Whether a line contains texts of scene files, which are then known."""
    if not line.lstrip().startswith('{"scenes"'):
        return False
    try:
        posed.remember({str(name): str(text) for name, text in json.loads(line)["scenes"].items()})
    except (ValueError, TypeError, AttributeError, RecursionError) as error:
        raise SceneError(f"scenes: are not a table of texts: {one_line(error)}") from None
    return True


def _slot(text: str) -> Slot:
    """Runnable slot of a line of JSON, with a pinned scene and the parameters of the scene."""
    try:
        data = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise SceneError(f"slot: is not JSON: {one_line(error)}") from None
    if not isinstance(data, dict):
        raise SceneError("slot: must be a JSON object")
    slot = slot_from_dict(data)
    slot = replace(slot, scene=pinned(slot.scene))
    prepare(slot)
    return slot
