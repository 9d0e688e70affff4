"""``tune``: a repeatable search for stock settings that are better than an engine's tuned profile."""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import click

from adapters import registry
from adapters.engine import EngineError
from adapters.engine_folder import (
    DECISIVE,
    EFFECTS,
    TUNING,
    candidates_of,
    cured_of,
    effects_of,
    fault_of_tuning,
    folder_of,
)
from adapters.registry import load, profile_of
from reports.command.group import AS_JSON, main
from reports.command.selection import WORKERS
from reports.tables import effects_table
from reports.terminal import print_table, terminal
from reports.wording import profiles_called
from validation.settings import effects
from validation.settings.decisive import measure_all, measured_of, write
from validation.settings.tuning import Score, Search, groups, search


def known_groups(ctx: click.Context, param: click.Parameter, names: tuple[str, ...]) -> tuple[str, ...]:
    """Groups of scenes to search; raises for an unknown one."""
    unknown = sorted(set(names) - set(groups())) if names else []
    if unknown:
        raise click.BadParameter(f"{unknown[0]!r} is not one of {', '.join(groups())}")
    return names


@main.command(epilog="Example: crosscheck tune ENGINE")
@click.argument("engine")
@click.option("--profile", help="Profile to start from; the tuned one by default.")
@click.option("--group", multiple=True, callback=known_groups, help="Group of scenes; all by default.")
@click.option("--dim", multiple=True, type=click.IntRange(2, 3), help="Only 2-D or only 3-D.")
@click.option("--jobs", default=1, show_default=True, type=WORKERS, help="Worker processes.")
@click.option(
    "--decisive", "which", is_flag=True, help="Measure which settings of its fixes matter, and keep the result."
)
@click.option("--effects", "acts", is_flag=True, help="Measure which settings do anything, and keep the result.")
@AS_JSON
def tune(
    engine: str,
    profile: str | None,
    group: tuple[str, ...],
    dim: tuple[int, ...],
    jobs: int,
    which: bool,
    acts: bool,
    as_json: bool,
) -> None:
    """Search better stock settings for a profile.

    Looks for settings of ENGINE that do better than the profile on all scenes of a group. Changes no file: enter better
    settings into the adapter, with the reason. Exits with 1 if something better was found.

    With --decisive, each setting that a fix changes is tried alone and left out, to measure which ones matter. The
    result is written to decisive.csv in the engine's folder, which the report and `explain` read. Exits with 1 if it
    differs from what was listed.

    With --effects, every setting of ENGINE is set to another value where it should act. The table, by release of the
    engine, is written to effects.csv, which `describe`, `run --set` and models read. Exits with 1 if a verdict is not
    the listed one.
    """
    if acts and which:
        raise click.UsageError("--effects and --decisive are two measurements: give one")
    console = terminal(stderr=True)
    if acts:
        sys.exit(0 if _effects(engine, jobs, as_json) else 1)
    if which:
        sys.exit(0 if _decisive(engine, jobs, as_json) else 1)
    registry.find(engine)
    if not candidates_of(engine):
        raise EngineError(f"tune: {_missing(engine, 'stock settings', 'try')}")
    profile = profiles_called([profile], [engine])[0] if profile else profile_of(engine, "tuned")
    if profile is None:
        raise EngineError(f"profile: {engine} has no tuned one; name one with --profile")
    if profile not in load(engine).profiles:
        raise EngineError(f"profile: {engine} has no profile {profile!r}, only {', '.join(load(engine).profiles)}")
    known = load(engine).facts.dimensions
    dimensions = dim or ((2,) if known == {2} else (2, 3))
    found = []
    for name in group or groups():

        def print_trial(changes: Mapping[str, Any], score: Score) -> None:
            console.print(f"  {_text(changes)}: {_score(score)}", markup=False, highlight=False, style="dim")

        console.print(f"{engine}/{profile} on {name}", markup=False, highlight=False)
        result = search(engine, profile, name, jobs, dimensions, print_trial)
        found.append(result)
        for line in _lines(result):
            console.print(line, markup=False, highlight=False, soft_wrap=True)
    if as_json:
        click.echo(json.dumps([asdict(result) for result in found], indent=1))
    sys.exit(1 if any(result.changes for result in found) else 0)


def _missing(engine: str, what: str, purpose: str) -> str:
    """Why there is nothing to try or to measure."""
    if fault := fault_of_tuning(engine):
        return f"{engine}: {fault}"
    return f"no {what} of {engine} to {purpose} are listed ({TUNING} in its folder)"


def _decisive(engine: str, jobs: int, as_json: bool) -> bool:
    """Measure and store the decisive settings of an engine's fixes; whether they equal the listed ones."""
    if not cured_of(engine):
        raise EngineError(f"tune: {_missing(engine, 'fixes', 'measure')}")
    listed = {(e.scene, e.shipped, e.better): e.text for e in measured_of(engine)}
    try:
        found = measure_all(engine, jobs)
    except ValueError as error:
        raise EngineError(f"tune: {error}") from None
    folder = folder_of(engine)
    assert folder is not None  # its folder has the fixes to measure
    write(found, folder / DECISIVE)
    console = terminal()
    if as_json:
        click.echo(json.dumps([asdict(entry) for entry in found], indent=1))
    else:
        for entry in found:
            console.print(f"{engine}/{entry.shipped} {entry.scene}: fixed by {entry.text}", soft_wrap=True)
    return listed == {(e.scene, e.shipped, e.better): e.text for e in found}


def _effects(engine: str, jobs: int, as_json: bool) -> bool:
    """Measure and store what each setting of an engine does; whether the verdicts equal the listed ones."""
    registry.load(engine)
    folder = folder_of(engine)
    if not effects_of(engine) or folder is None:
        raise EngineError(f"tune: {_missing(engine, 'cases of settings', 'try')}")
    found = effects.measure(engine, jobs)
    listed = effects.of_release(engine, found[0].version)
    effects.write(found, folder / EFFECTS)
    if as_json:
        click.echo(json.dumps([asdict(entry) for entry in found], indent=1))
    else:
        console = terminal()
        console.print(f"{engine} {found[0].version}", highlight=False)
        print_table(effects_table([asdict(entry) for entry in found]), console, highlight=False)
    return {name: told.verdict for name, told in listed.items()} == {told.setting: told.verdict for told in found}


def _score(score: Score) -> str:
    return f"{score.failing} fail, {score.decades:.1f} decades"


def _text(changes: Mapping[str, Any]) -> str:
    return ", ".join(f"{name} = {value}" for name, value in changes.items())


def _lines(result: Search) -> list[str]:
    head = f"{result.engine}/{result.profile} {result.group}: {_score(result.before)}; {len(result.trials)} tried"
    if not result.changes:
        lines = [f"{head}; none is better"]
    else:
        held = f"held out {_score(result.held_out[0])} -> {_score(result.held_out[1])}"
        lines = [f"{head}; better: {_text(result.changes)} -> {_score(result.after)} ({held})"]
    if result.needless:
        lines.append(f"  as shipped does as well: {_text(result.needless)}")
    return lines
