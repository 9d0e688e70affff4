"""``list``, ``describe``, ``doctor``, ``check-adapter``: what there is, and whether it is sound."""

from __future__ import annotations

import json
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any

import click

from adapters import registry
from reports import listing
from reports.command.group import AS_JSON, OUT, main
from validation.store import Store


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
        click.echo(json.dumps([asdict(finding) for finding in findings], indent=1, default=str))
    else:
        for finding in findings:
            click.echo(str(finding))
    sys.exit(0 if all(finding.holds for finding in findings) else 1)
