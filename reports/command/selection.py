"""Options that select cases, common to all subcommands that run some."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import click

from adapters import registry
from adapters.scene import SceneError
from adapters.settings.own import given
from reports.command.completion import engine_names, scene_names
from reports.wording import profiles_called
from validation.canonical import SUITES, Suite
from validation.catalogue import matching
from validation.cells import MOST_ITERATIONS, MOST_ULPS, parse_dt
from validation.posed import is_file, pinned
from validation.running.plan import Request, knowing


class _Seconds(click.ParamType):  # type: ignore[type-arg]  # click before 8.5 takes none
    """Time limit: a number of seconds between 1 and `LONGEST`."""

    name = "seconds"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        try:
            seconds = float(value)
        except ValueError:
            self.fail(f"{value!r} is not a number of seconds", param, ctx)
        if not 1.0 <= seconds <= LONGEST:  # false for NaN as well
            self.fail(f"{value} is not between 1 and {LONGEST:g} seconds", param, ctx)
        return seconds


#: Help of the options that name a suite.
WHAT_SUITES_ARE: dict[Suite, str] = {
    "quick": "A few cases per scene: the default.",
    "standard": "More cases: those whose known failures are listed check by check.",
    "full": "All cases of each scene, and other time steps.",
}
#: Longest time limit of a case [s]: a week.
LONGEST = 7 * 86400.0
SECONDS = _Seconds()
#: More worker processes than any machine has cores are a typing error; the machine decides how many start.
MOST_JOBS = 4096
JOBS = click.IntRange(0, MOST_JOBS)
#: Number of workers where the default is one, and zero has no meaning.
WORKERS = click.IntRange(1, MOST_JOBS)


#: A user's own settings.
SET = click.option(
    "--set",
    multiple=True,
    metavar="NAME=VALUE",
    help="Change a setting of the engine; it is shown as part of the profile's name.",
)


def _cluster(ctx: click.Context, param: click.Parameter, value: str | None) -> str:
    """Address of a cluster, checked before anything runs."""
    if not value:
        return ""
    from validation.workers.cluster import checked

    return checked(value)


#: Cluster that runs the cases instead of this machine.
CLUSTER = click.option(
    "--cluster",
    callback=_cluster,
    metavar="ADDRESS",
    help="Run on a Dask cluster: tcp://HOST:PORT, or local:N processes.",
)


def missing(named: Sequence[str], chosen: Sequence[str]) -> list[str]:
    """One line for each named engine that is missing; or one line if none of the chosen engines is installed."""
    absent = [found for found in map(registry.find, chosen) if found.engine is None]
    lines = [f"engine: {f.name} did not run: {f.reason}" for f in absent if f.name in named]
    none = f"engine: none of {', '.join(chosen)} is installed here; crosscheck doctor says why"
    return lines or ([none] if len(absent) == len(chosen) else [])


def parameter(text: str) -> tuple[str, float]:
    """Read ``NAME=VALUE``."""
    name, equals, value = text.partition("=")
    if not equals or not name:
        raise SceneError(f"param: {text!r} is not of the form NAME=VALUE")
    try:
        return name.strip(), float(value)
    except ValueError:
        raise SceneError(f"param: {name}={value!r} is not a number") from None


def fixed(texts: Sequence[str]) -> dict[str, float] | None:
    """Fixed parameters, None if there are none; two values for one parameter are refused."""
    found: dict[str, float] = {}
    for name, value in map(parameter, texts):
        if name in found:
            raise SceneError(f"param: {name} is given twice; crosscheck sweep --grid runs several values")
        found[name] = value
    return found or None


def scene_names_of(arguments: Sequence[str], drop: bool = False) -> list[str]:
    """Names of the selected scenes: of the catalogue by name or pattern (all by default), and pinned files."""
    names: list[str] = []
    for argument in arguments or ["*"]:
        names += [pinned(argument, drop)] if is_file(argument) else [scene.name for scene in matching(argument)]
    return list(dict.fromkeys(names))


def request_from(options: dict[str, Any]) -> Request:
    """Turn the options of `selection` into a request; raises for a wrong call before anything runs."""
    suite = _suite(options)
    scenes = scene_names_of(options["scenes"], options.get("drop", False))  # before an engine is imported
    registry.check_required()
    for name in options["engine"]:
        registry.find(name)
    dimensions = list(options["dim"])
    engines = list(options["engine"]) or registry.usual()
    request = Request(
        scenes=scenes,
        engines=engines,
        profiles=profiles_called(options["profile"], engines),
        dimensions=dimensions,
        dts=[parse_dt(text) for text in options["dt"]],
        iterations=list(options["iterations"]),
        params=fixed(options["param"]),
        suite=suite,
        ulps=tuple(dict.fromkeys((0, *options["ulp"]))),  # a moved start says how far the unmoved one scatters
        floors=suite == "full" and not options["ulp"],
        sets=given(options["set"]),
    )
    return replace(request, engines=knowing(request)) if request.sets and not options["engine"] else request


def _suite(options: dict[str, Any]) -> Suite:
    """The selected suite; two are refused."""
    named = [suite for suite in SUITES if options[suite]]
    if len(named) > 1:
        raise SceneError(f"{' and '.join(f'--{suite}' for suite in named)}: a run is of one suite")
    return named[0] if named else SUITES[0]


def asked(request: Request, options: dict[str, Any]) -> str:
    """Options that select these cases without their suite, ready to paste: ``bounce --param e=0.8 --dt 1/120``."""
    names = ("param", "engine", "profile", "set", "dim", "dt", "iterations", "ulp")
    narrowing = [word for name in names for value in options[name] for word in (f"--{name}", str(value))]
    return shlex.join([*request.scenes, *narrowing])


#: Settings, dimension, step and iterations of cases.
HOW = (
    SET,
    click.option("--dim", multiple=True, type=click.IntRange(2, 3), help="Only 2-D or only 3-D."),
    click.option("--dt", multiple=True, metavar="S", help="Time step [s], such as 1/240 (repeat for more)."),
    click.option(
        "--iterations",
        multiple=True,
        type=click.IntRange(1, MOST_ITERATIONS),
        help="Solver iterations, instead of the profile's own.",
    ),
)


def selection(command: Callable[..., None]) -> Callable[..., None]:
    """Options that select cases, common to all commands that run some."""
    options = (
        click.argument("scenes", nargs=-1, shell_complete=scene_names),
        click.option("--param", multiple=True, metavar="NAME=VALUE", help="Set a parameter of the scene."),
        click.option(
            "--engine",
            multiple=True,
            metavar="E",
            shell_complete=engine_names,
            help="Only this engine (repeat for more).",
        ),
        click.option(
            "--profile", multiple=True, metavar="P", help="Only this profile, by its name or role (repeat for more)."
        ),
        *HOW,
        click.option(
            "--ulp",
            multiple=True,
            type=click.IntRange(-MOST_ULPS, MOST_ULPS),
            help="Also move the initial positions by this many units in the last place.",
        ),
        *(click.option(f"--{suite}", is_flag=True, help=WHAT_SUITES_ARE[suite]) for suite in SUITES),
    )
    for option in reversed(options):
        command = option(command)
    return command
