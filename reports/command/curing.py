"""``cure``: stock settings that fix the errors of an engine on a scene, and their cost."""

from __future__ import annotations

import json
from dataclasses import asdict, replace

import click
from rich.console import Console
from rich.table import Table
from rich.text import Text

from adapters.engine import EngineError
from adapters.engine_folder import CURES, PANELS, folder_of
from adapters.registry import is_ranked, load, profile_of
from adapters.scene import SceneError
from reports.command.completion import engine_names, scene_names
from reports.command.group import AS_JSON, main
from reports.command.selection import WORKERS, fixed, scene_names_of
from reports.fixes import changes_in_words, cure_paste, cure_text, nothing_to_paste, panel_text
from reports.speed import duration
from reports.terminal import print_table, terminal
from reports.wording import called, number, params_text
from validation.cells import parse_dt
from validation.fixes.kept import Cure, cures_of, write, write_panels
from validation.fixes.panel import of_profile
from validation.fixes.search import Unsearched, search
from validation.posed import is_file, resolve


@main.command(epilog="Example: crosscheck cure ENGINE pinch")
@click.argument("engine", shell_complete=engine_names)
@click.argument("scenes", nargs=-1, shell_complete=scene_names)
@click.option("--param", multiple=True, metavar="NAME=VALUE", help="Only this case: set a parameter of the scene.")
@click.option("--dt", metavar="S", help="Time step [s], such as 1/500; by default the model's, else 1/240.")
@click.option("--dim", multiple=True, type=click.IntRange(2, 3), help="Only 2-D or only 3-D.")
@click.option("--jobs", default=1, show_default=True, type=WORKERS, help="Worker processes.")
@click.option("--keep", is_flag=True, help="Write the fixes into cures.csv of the engine's folder.")
@AS_JSON
def cure(
    engine: str,
    scenes: tuple[str, ...],
    param: tuple[str, ...],
    dt: str | None,
    dim: tuple[int, ...],
    jobs: int,
    keep: bool,
    as_json: bool,
) -> None:
    """Search stock settings that fix a scene, and their cost.

    Tries settings for the checks that ENGINE fails as shipped on SCENES (all by default): each setting alone, pairs
    with the best one, and other profiles without the settings that make no difference. Prints the smallest change that
    fixes the most checks and breaks none, with error and cost before and after, and as lines to paste. This takes
    seconds to a minute per scene.

    By default the standard cases of a scene run, in two sizes at two time steps. With --param, --dt, or a file (a
    scene, or a model on its own engine) only that case runs. With --keep the fixes are stored for `run`, `show`,
    `explain` and the report.
    """
    if profile_of(engine, "shipped") is None:
        load(engine)  # raises if there is no such engine
        raise EngineError(f"cure: {engine} has no profile as shipped that could be fixed")
    version = load(engine).version()
    names = scene_names_of(scenes)
    if keep and (param or dt or any(map(is_file, names))):
        raise SceneError("keep: stores fixes of whole scenes of the catalogue, not of one case")
    params, step = fixed(param), parse_dt(dt) if dt else None
    for name in names:
        resolve(name).complete(params or {})  # raises before anything runs
    console, progress = terminal(), terminal(stderr=True)
    listed = {key: old for key, old in cures_of(engine).items() if old.version == version}
    found, shown = list[Cure](), called(names)
    for name in names:
        for dimension in resolve(name).dimensions:
            if dim and dimension not in dim:
                continue
            case = {} if params is None and is_file(name) else params
            progress.print(f"{engine} {shown[name]} {dimension}-D", style="dim", markup=False, highlight=False)
            result = search(engine, name, dimension, jobs, case, step)
            listed.pop((name, dimension), None)
            if isinstance(result, Cure):
                listed[name, dimension] = result
                found.append(result)
            if keep:
                _keep(engine, listed)
            if not as_json:
                _show(engine, shown[name], dimension, result, console)
    if keep and not scenes:
        _keep_panels(engine, version, jobs)
    if as_json:
        click.echo(json.dumps([{**asdict(each), "paste": cure_paste(each)} for each in found], indent=1, default=str))


def _keep(engine: str, listed: dict[tuple[str, int], Cure]) -> None:
    """Write the table after every scene: a search of all takes long and may be interrupted."""
    folder = folder_of(engine)
    if folder is None:
        raise EngineError(f"cure: {engine} has no folder of its own to keep {CURES} in")
    write([listed[key] for key in sorted(listed)], folder / CURES)


def _keep_panels(engine: str, version: str, jobs: int) -> None:
    shipped, folder = profile_of(engine, "shipped"), folder_of(engine)
    assert shipped is not None and folder is not None  # they were needed before
    others = [name for name in load(engine).profiles if is_ranked(engine, name) and name != shipped]
    panels = {name: of_profile(engine, shipped, name, jobs) for name in others}
    write_panels(version, panels, folder / PANELS)


def _show(engine: str, scene: str, dimension: int, found: Cure | Unsearched, console: Console) -> None:
    head = Text(f"{engine} {scene} {dimension}-D: ", style="bold")
    if isinstance(found, Unsearched):
        text = "as shipped nothing is to be fixed" if found.asked else "cannot run"
        console.print(head + Text(f"{text}: {found.reason}", style=""), soft_wrap=True)
        return
    console.print(head + Text(f"{found.failing} of {found.judged} checks fail as shipped"), soft_wrap=True)
    if not found.helps:
        console.print(f"  {cure_text(found)}", markup=False, highlight=False, soft_wrap=True)
        return
    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 2))
    for heading in ("", "as shipped", "fixed", "truth"):
        table.add_column(heading)
    where = params_text(found.params)
    what = f"{found.metric}{f' at {where}' if where else ''}" + ("" if found.unit == "1" else f" [{found.unit}]")
    truth = f"{number(found.truth, 4)} ± {number(found.tolerance, 2)}"
    table.add_row(what, number(found.before, 4), number(found.after, 4), truth)
    table.add_row("checks that fail", str(found.failing), str(found.left), "")
    costs = [duration(cost) if cost else "-" for cost in (found.cost_before, found.cost_after)]
    table.add_row("CPU time per step", *costs, f"{found.times:.2g} times" if found.times else "")
    print_table(table, console, highlight=False)
    if found.alone:
        text = ", ".join(f"{name} = {value}" for name, value in changes_in_words(found, found.alone))
        left = f"{found.metric} {number(found.before, 4)} -> {number(found.alone_after, 4)}"
        console.print(f"one setting alone: {text}: {left}", markup=False, highlight=False, soft_wrap=True)
        alone = replace(found, changes=found.alone)
        console.print(Text(cure_paste(alone) or nothing_to_paste(alone)), soft_wrap=True)
        console.print(
            f"what fixes {found.failing - found.left} of {found.failing} checks:", markup=False, highlight=False
        )
    if told := panel_text(found.panel):
        console.print(told, markup=False, highlight=False, soft_wrap=True)
    if found.withdrawn:
        console.print("not recommended: it breaks more than it fixes", style="bold")
    for name, value in changes_in_words(found, found.changes):
        console.print(f"  {name} = {value}", markup=False, highlight=False, soft_wrap=True)
    if found.profile:
        console.print(f"  profile {found.profile} has all of it", markup=False, highlight=False)
    if found.others:
        console.print(f"  or alone: {_alternatives(found)}", markup=False, highlight=False, soft_wrap=True)
    if found.withdrawn:
        return
    if paste := cure_paste(found):
        console.print("to paste:", style="bold")
        console.print(Text(paste), soft_wrap=True)
    else:
        console.print(nothing_to_paste(found), markup=False, highlight=False, soft_wrap=True)


def _alternatives(found: Cure) -> str:
    texts = (changes_in_words(found, each) for each in found.others)
    return "; ".join(", ".join(f"{name} = {value}" for name, value in each) for each in texts)
