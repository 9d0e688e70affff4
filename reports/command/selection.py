"""Options that choose cells, shared by every subcommand that runs some."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import click

from adapters import registry
from adapters.scene import SceneError
from validation.cells import parse_dt
from validation.plan import Request
from validation.posed import is_file
from validation.scenes import matching


def parameter(text: str) -> tuple[str, float]:
    """Read ``NAME=VALUE``."""
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


def request_from(options: dict[str, Any]) -> Request:
    """Turn the options of `selection` into a request; raises what a wrong call raises, before anything runs."""
    registry.check_required()
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
        params=dict(map(parameter, options["param"])) or None,
        suite="full" if options["full"] else "quick",
        ulps=tuple(options["ulp"]) or (0,),
        floors=options["full"] and not options["ulp"],
    )


def selection(command: Callable[..., None]) -> Callable[..., None]:
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
