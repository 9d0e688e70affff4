"""What moved over an engine's releases, in sentences with what its own notes say; ``make releases`` publishes them."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from reports.releases import as_table
from validation.comparison import Kind
from validation.identity import commit
from validation.releases import history
from validation.releases.history import Step
from validation.releases.notes import explanations
from validation.store import Store

HEAD = """# Physics over engine releases

Made by `make releases`{commit}. The same cells of every scene of the quick suite on each release,
driven by one adapter in an environment of its own; receipts ran before each cell. A row is one check of one cell.
*fails* counts rows outside their tolerance; *mended* those that pass although they are listed as findings of other
releases; *moved* those whose verdict flips or whose value moves beyond its noise floor. `crosscheck bisect` finds each
of these steps again. What the notes say of a release is set beside a step that it may explain; it was not proven by
building that one change.
"""


def sentences(engine: str, steps: Sequence[Step]) -> list[str]:
    """One sentence per release, profile and scene that moved: what, by how much, and what the notes say of it."""
    groups: dict[tuple[str, str, str, str], list[Step]] = {}
    for step in steps:
        change = step.family.first
        groups.setdefault((step.before, step.after, change.profile, change.scene), []).append(step)
    return [_sentence(engine, *key, own) for key, own in groups.items()]


def _sentence(engine: str, before: str, after: str, profile: str, scene: str, own: Sequence[Step]) -> str:
    changes = [change for step in own for change in step.family.changes]
    flips = [change.regressed for change in changes if change.kind is Kind.FLIP]
    ends = [change.regressed for change in changes if change.kind is Kind.OUTCOME]
    counts = (
        (sum(flips), "begin to fail"),
        (len(flips) - sum(flips), "cease to fail"),
        (sum(ends), "end without an answer"),
        (len(ends) - sum(ends), "have an answer again"),
        (sum(change.kind is Kind.ERROR for change in changes), "change their value"),
    )
    said = ", ".join(f"{what} {count}" for count, what in counts if count)
    first = own[0].family.first
    why = "; ".join(explanations(engine, scene, profile, before, after))
    moved = f"`{first.metric}` ({history.cell_of(first)}) {first.before} -> {first.after}"
    return (
        f"**{after}** (after {before}), {profile} {scene}: rows that {said}; first {moved}. {why[0].upper()}{why[1:]}."
    )


def page(store: Store) -> str:
    """Markdown: of each engine in the store a table of its releases and the sentences."""
    here = commit()
    out = [HEAD.format(commit=f" at commit {here}" if here else "")]
    for engine in history.engines(store):
        told = history.told(store, engine)
        steps = history.steps(told)
        out += [f"## {engine}", "", as_table(told, steps)]
        said = sentences(engine, steps)
        out += [f"* {line}" for line in said] or ["No row moved."]
        out.append("")
    return "\n".join(out)


if __name__ == "__main__":
    results, target = sys.argv[1:]
    opened = Store(Path(results), create=False)
    Path(target).write_text(page(opened), encoding="utf-8")
    opened.close()
