"""Options that select cases, common to all subcommands that run some."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import wraps
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

Command = Callable[..., None]


class _Between(click.ParamType):  # type: ignore[type-arg]  # click before 8.5 takes none
    """A number of units between two; click's own range takes NaN."""

    def __init__(self, name: str, least: float, most: float) -> None:
        self.name, self.least, self.most = name, least, most

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        try:
            number = float(value)
        except ValueError:
            self.fail(f"{value!r} is not a number of {self.name}", param, ctx)
        if not self.least <= number <= self.most:  # false for NaN as well
            self.fail(f"{value} is not between {self.least:g} and {self.most:g} {self.name}", param, ctx)
        return number


#: A user's own settings.
WHAT_SET_IS = "Change a setting of the engine; it is shown as part of the profile's name."
SET = click.option("--set", multiple=True, metavar="NAME=VALUE", help=WHAT_SET_IS)
#: Time limit of a case [s]: at most a week.
SECONDS = _Between("seconds", 1.0, 7 * 86400.0)
#: Age of a run [days]: at most a century.
DAYS = _Between("days", 0.0, 36500.0)
#: More worker processes than any machine has cores are a typing error; the machine decides how many start.
MOST_JOBS = 4096
JOBS = click.IntRange(0, MOST_JOBS)
#: Number of workers where the default is one, and zero has no meaning.
WORKERS = click.IntRange(1, MOST_JOBS)


def _cluster(ctx: click.Context, param: click.Parameter, value: str | None) -> str:
    """Address of a cluster, checked before anything runs."""
    if not value:
        return ""
    from validation.workers.cluster import checked

    return checked(value)


def option(default: Any, says: str, *flags: str, **how: Any) -> Any:
    """Field of a dataclass that is an option of the command line (`gathered`), called as it is or by ``flags``.

    A default of False makes a switch, one of () an option that may be given several times.
    """

    def declared(name: str) -> Callable[[Command], Command]:
        called = flags or (f"--{name.replace('_', '-')}",)
        switch, several = default is False, default == ()
        return click.option(*called, name, is_flag=switch, multiple=several, default=default, help=says, **how)

    return field(default=default, metadata={"option": declared})


def cluster() -> Any:
    """Field of a cluster that runs the cases instead of this machine."""
    says = "Run on a Dask cluster: tcp://HOST:PORT, or local:N processes."
    return option("", says, callback=_cluster, metavar="ADDRESS")


def taken(kind: Any, options: dict[str, Any]) -> Any:
    """Take those of the options that are fields of a dataclass, as one."""
    return kind(**{each.name: options.pop(each.name) for each in fields(kind) if each.name in options})


def gathered(name: str, kind: type, only: Sequence[str] = ()) -> Callable[[Command], Command]:
    """A command with its options as one argument ``name``, a dataclass ``kind``, in the order of its fields.

    Fields that are no `option` take what the command has of that name; with ``only`` some, others keep their defaults.
    """

    def gathering(command: Command) -> Command:
        @wraps(command)
        def called(**options: Any) -> None:
            command(**{name: taken(kind, options)}, **options)

        for each in reversed(fields(kind)):
            if "option" in each.metadata and (not only or each.name in only):
                called = each.metadata["option"](each.name)(called)
        return called

    return gathering


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


@dataclass(frozen=True)
class Cases:
    """Options that select cases, as they were given."""

    scenes: tuple[str, ...] = ()
    param: tuple[str, ...] = option((), "Set a parameter of the scene.", metavar="NAME=VALUE")
    engine: tuple[str, ...] = option(
        (), "Only this engine (repeat for more).", metavar="E", shell_complete=engine_names
    )
    profile: tuple[str, ...] = option((), "Only this profile, by its name or role (repeat for more).", metavar="P")
    set: tuple[str, ...] = option((), WHAT_SET_IS, metavar="NAME=VALUE")
    dim: tuple[int, ...] = option((), "Only 2-D or only 3-D.", type=click.IntRange(2, 3))
    dt: tuple[str, ...] = option((), "Time step [s], such as 1/240 (repeat for more).", metavar="S")
    iterations: tuple[int, ...] = option(
        (), "Solver iterations, instead of the profile's own.", type=click.IntRange(1, MOST_ITERATIONS)
    )
    ulp: tuple[int, ...] = option(
        (),
        "Also move the initial positions by this many units in the last place.",
        type=click.IntRange(-MOST_ULPS, MOST_ULPS),
    )
    quick: bool = option(False, "A few cases per scene: the default.")
    standard: bool = option(False, "More cases: those whose known failures are listed check by check.")
    full: bool = option(False, "All cases of each scene, and other time steps.")

    @property
    def suite(self) -> Suite:
        """The selected suite; two are refused."""
        named = [suite for suite in SUITES if getattr(self, suite)]
        if len(named) > 1:
            raise SceneError(f"{' and '.join(f'--{suite}' for suite in named)}: a run is of one suite")
        return named[0] if named else SUITES[0]

    def words(self, scenes: Sequence[str]) -> str:
        """These options without their suite, ready to paste: ``bounce --param e=0.8 --dt 1/120``."""
        names = ("param", "engine", "profile", "set", "dim", "dt", "iterations", "ulp")
        narrowing = [word for name in names for value in getattr(self, name) for word in (f"--{name}", str(value))]
        return shlex.join([*scenes, *narrowing])

    def request(self, drop: bool = False) -> Request:
        """What they ask for; raises for a wrong call before anything runs."""
        suite = self.suite
        scenes = scene_names_of(self.scenes, drop)  # before an engine is imported
        registry.check_required()
        for name in self.engine:
            registry.find(name)
        engines = list(self.engine) or registry.usual()
        request = Request(
            scenes=scenes,
            engines=engines,
            profiles=profiles_called(self.profile, engines),
            dimensions=list(self.dim),
            dts=[parse_dt(text) for text in self.dt],
            iterations=list(self.iterations),
            params=fixed(self.param),
            suite=suite,
            ulps=tuple(dict.fromkeys((0, *self.ulp))),  # a moved start says how far the unmoved one scatters
            floors=suite == "full" and not self.ulp,
            sets=given(self.set),
        )
        return replace(request, engines=knowing(request)) if request.sets and not self.engine else request


def selection(command: Command) -> Command:
    """Options that select cases, common to all commands that run some: the argument ``cases``."""
    return click.argument("scenes", nargs=-1, shell_complete=scene_names)(gathered("cases", Cases)(command))
