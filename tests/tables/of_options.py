"""Table of what every command can be asked: its sentence, and of each option its names, kind, default and help.

Pages of help are made of these by click, whose layout is not ours.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

import click
from telling import Sections

from reports.command import main

#: Of the type of a number or a path: what limits it.
_TYPE_SAYS = ("name", "choices", "min", "max", "min_open", "max_open", "clamp", "exists", "file_okay", "dir_okay")


def table() -> Sections:
    """Every command, with those inside it."""
    return {name: dict(_lines(command, name)) for name, command in commands(main, "crosscheck")}


def commands(command: click.Command, name: str) -> Iterator[tuple[str, click.Command]]:
    """A command and those inside it, with their whole names."""
    yield name, command
    for word, inner in sorted(getattr(command, "commands", {}).items()):
        yield from commands(inner, f"{name} {word}")


def _lines(command: click.Command, name: str) -> Iterator[tuple[str, str]]:
    context = click.Context(command, info_name=name)
    yield "usage", " ".join(command.collect_usage_pieces(context))
    yield "says", " ".join((command.help or "").split())
    yield "in short", command.get_short_help_str(200)
    for each in command.params:
        record = each.get_help_record(context) or (each.make_metavar(context), "")
        yield each.name or "", f"{record[0]}: {record[1]}"
        yield f"{each.name}, as data", json.dumps(dict(_facts(each)), sort_keys=True, default=str)


def _facts(parameter: click.Parameter) -> Iterator[tuple[str, Any]]:
    told = parameter.to_info_dict()
    kind = told.pop("type")
    yield from ((f"type {key}", kind[key]) for key in _TYPE_SAYS if key in kind)
    for key, value in told.items():
        said_elsewhere = key in ("name", "help") or (key, value) == ("nargs", 1)
        if not said_elsewhere and value is not None and value is not False and value != []:
            yield key, value
