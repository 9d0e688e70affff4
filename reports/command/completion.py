"""Completions of the shell: scenes, engines, ids of rows; docs/reference/status.md explains how to enable them.

A completion must never fail and never import an engine. It only reads names, and is empty if it cannot.
"""

from __future__ import annotations

from pathlib import Path

import click
from click.shell_completion import CompletionItem

from adapters import registry
from validation.catalogue import CATALOGUE


def scene_names(ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """Scenes of the catalogue with their titles, and scene files."""
    found = [CompletionItem(name, help=s.title) for name, s in CATALOGUE.items() if name.startswith(incomplete)]
    return found or [CompletionItem(incomplete, type="file")]


def engine_names(ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """Registered engines."""
    return [CompletionItem(name) for name in registry.names() if name.startswith(incomplete)]


def names_of_either(ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """Scenes and engines."""
    scenes = [CompletionItem(name, help=s.title) for name, s in CATALOGUE.items() if name.startswith(incomplete)]
    return scenes + engine_names(ctx, param, incomplete)


def row_ids(ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """Ids of the worst checks of the latest run, one for each line of ``findings``."""
    from reports.exports import load_rows
    from reports.findings import families
    from reports.wording import row_id

    try:
        rows = [row.as_dict() for row in load_rows(Path(ctx.params.get("out") or "crosscheck-out"))]
    except Exception:
        return []
    found = [(row_id(f.worst), f"{f.engine}/{f.profile} {f.scene} {f.metric}") for f in families(rows)]
    return [CompletionItem(name, help=text) for name, text in found if name.startswith(incomplete)]
