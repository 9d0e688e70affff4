"""``export``: results as Parquet for other tools, and a case as a script that needs only its engine."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import click

from adapters import registry
from adapters.scene import SceneError
from adapters.settings.own import given, own
from adapters.whole import write
from reports.command.completion import engine_names, scene_names
from reports.command.files import FILE, FOLDER, writable
from reports.command.files import folder as writable_folder
from reports.command.group import AS_JSON, OUT, main
from reports.command.reporting import extra
from reports.command.selection import WHAT_SET_IS, gathered, option, parameter
from reports.wording import profiles_called
from validation.cells import MOST_ITERATIONS, Slot, parse_dt, settings_of
from validation.posed import is_file, pinned, resolve
from validation.records.store import Store
from validation.running.plan import QUICK_DT


@dataclass(frozen=True)
class Case:
    """Options of ``export`` that select a case and its file."""

    output: Path | None = option(None, "File to write; stdout by default.", "-o", "--output", type=FILE)
    engine: str = option("", "Engine of the case.", metavar="E", shell_complete=engine_names)
    profile: str = option("", "Profile of the case; as shipped by default.", metavar="P")
    param: tuple[str, ...] = option((), "Set a parameter of the scene.", metavar="NAME=VALUE")
    set: tuple[str, ...] = option((), WHAT_SET_IS, metavar="NAME=VALUE")
    dim: int | None = option(None, "2-D or 3-D.", type=click.IntRange(2, 3))
    dt: str = option("", "Time step [s], such as 1/240.", metavar="S")
    iterations: int | None = option(
        None, "Solver iterations, instead of the profile's own.", type=click.IntRange(1, MOST_ITERATIONS)
    )


@main.command(epilog="Example: crosscheck export bounce --engine ENGINE --to python -o bug.py")
@click.argument("named", metavar="[RUN]...|SCENE", nargs=-1, shell_complete=scene_names)
@click.option("--parquet", "target", type=FOLDER, metavar="FOLDER", help="Write the RUNs as Parquet files there.")
@click.option("--all", "every", is_flag=True, help="With --parquet: all runs, not the latest.")
@click.option(
    "--to", "form", metavar="FORMAT", help="Write a case of SCENE as python, or in a format of its engine (mjcf)."
)
@gathered("case", Case)
@AS_JSON
@OUT
def export(
    named: tuple[str, ...], target: Path | None, every: bool, form: str | None, case: Case, as_json: bool, out: Path
) -> None:
    """Write a case as a script of its engine, or results as tables.

    With --to, writes the case of SCENE on --engine as a script for a bug report. It runs without this project and gives
    the same result to the last bit. With --parquet, writes RUNs (ids that `list runs` prints; the latest by default) as
    tables of checks, raw quantities and stored trajectories.
    """
    if (target is None) == (form is None):
        raise SceneError("export: needs --parquet FOLDER for results, or --to FORMAT for a case")
    if target is not None:
        stray = [name for name, value in vars(case).items() if value]
        if stray:
            raise SceneError(f"{stray[0]}: chooses a case to write, which needs --to")
        _results(named, target, every, as_json, out)
        return
    if every:
        raise SceneError("all: chooses runs, which needs --parquet")
    if len(named) != 1 or not case.engine:
        raise SceneError("export: --to writes one case: name its scene and its --engine")
    _cell(named[0], form or "", case, as_json)


def _results(runs: Sequence[str], target: Path, every: bool, as_json: bool, out: Path) -> None:
    with extra("export", "parquet"):
        from reports import parquet
    writable_folder(target, "parquet")
    store = Store(out, create=False)
    try:
        chosen = store.runs() if every else [store.run(name) for name in dict.fromkeys(runs or ("latest",))]
        counts = parquet.write(store, chosen, out / "trajectories", target)
    finally:
        store.close()
    said = ", ".join(f"{name}.parquet {count} lines" for name, count in counts.items())
    click.echo(json.dumps({"folder": str(target), **counts}) if as_json else f"{target}: {said}")


def _cell(scene: str, form: str, case: Case, as_json: bool) -> None:
    from reports.scripts import imported, written

    path = writable(case.output, "output") if case.output else None
    slot = _slot(scene, case)
    text = written(slot, form)
    if path is not None:
        if path.stem in imported(text):
            raise SceneError(
                f"output: {path.name} would be imported in the place of {path.stem} itself, name it otherwise"
            )
        path.parent.mkdir(parents=True, exist_ok=True)
        write(path, text)
    if as_json:
        click.echo(json.dumps({"slot": slot.as_dict(), "path": str(path) if path else None, "text": text}))
    else:
        click.echo(str(path) if path else text, nl=path is not None)


def _slot(scene: str, case: Case) -> Slot:
    """The selected case; by default as shipped, at 1/240 s, in a dimension that the engine has."""
    engine = registry.load(case.engine)
    name = pinned(scene) if is_file(scene) else scene
    canonical = resolve(name)
    possible = [d for d in canonical.dimensions if d in engine.facts.dimensions]
    dimension = case.dim or (possible or list(canonical.dimensions))[0]
    brings = canonical.brings.get(case.engine) if case.set else None
    shipped = brings.profile if brings else engine.facts.profile("shipped")
    named = profiles_called(filter(None, [case.profile]), [case.engine])
    profile = next(iter(named), "") or shipped or next(iter(engine.profiles))
    params = canonical.minimal(dict(map(parameter, case.param)))
    brought = canonical.brought(case.engine, profile)
    dt = parse_dt(case.dt) if case.dt else brought.dt if brought else QUICK_DT
    slot = Slot(name, params, dimension, case.engine, profile, dt, case.iterations)
    stock = settings_of(engine, slot, canonical.scene(dimension, dict(params)))
    return slot.with_own(own(engine, given(case.set), stock))
