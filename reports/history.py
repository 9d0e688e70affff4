"""Changes over an engine's releases, in sentences with its own release notes; ``make releases`` publishes them."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from reports.releases import PACE, as_table
from reports.wording import plural
from validation.judging.comparison import Kind
from validation.records.store import RELEASE_TITLE, Store
from validation.releases import history
from validation.releases.history import Step
from validation.releases.notes import explanations

HEAD = """# Physics over engine releases

Made by `make releases`{commit}. The same cases of every scene of the standard suite ran on each release, with one
adapter and in an environment of its own, after property checks. A check is one measured quantity of one case.
*failed* counts checks outside their tolerance; *no result* those whose case crashed, hung or failed a property check;
*fixed* those that pass although they are known failures of other releases; *changed* those that began or ceased to
fail, or whose value changed by more than its noise, which is the effect of moving the start by the last place.
`crosscheck bisect` finds each of these steps again. Release notes are quoted beside a step that they may explain; no
build with that one change was made to prove it.
"""


def sentences(engine: str, steps: Sequence[Step]) -> list[str]:
    """Changes by release: a paragraph per release and explanation, with a line per profile and scene."""
    groups: dict[tuple[str, str], dict[str, dict[tuple[str, str], list[Step]]]] = {}
    for step in steps:
        change = step.family.first
        why = "; ".join(explanations(engine, change.scene, change.profile, step.before, step.after))
        told = groups.setdefault((step.before, step.after), {}).setdefault(why, {})
        told.setdefault((change.profile, change.scene), []).append(step)
    out = []
    for (before, after), paragraphs in groups.items():
        for why, places in paragraphs.items():
            lines = [f"  * {profile} {scene}: {_moved(own)}" for (profile, scene), own in places.items()]
            out.append("\n".join([f"**{after}** (after {before}). {why[0].upper()}{why[1:]}.", *lines]))
    return out


def _moved(own: Sequence[Step]) -> str:
    """``2 checks begin to fail, 14 change their value; first `drift` (3-D) 1e-9 m (pass) -> 0.1 m (fail)``."""
    changes = [change for step in own for change in step.family.changes]
    flips = [change.regressed for change in changes if change.kind is Kind.FLIP]
    ends = [change.regressed for change in changes if change.kind is Kind.OUTCOME]
    counts = (
        (sum(flips), "begins to fail", "begin to fail"),
        (len(flips) - sum(flips), "ceases to fail", "cease to fail"),
        (sum(ends), "ends without a result", "end without a result"),
        (len(ends) - sum(ends), "has a result again", "have a result again"),
        (sum(change.kind is Kind.ERROR for change in changes), "changes its value", "change their value"),
    )
    said = [f"{plural(count, 'check')} {one if count == 1 else more}" for count, one, more in counts if count]
    first = own[0].family.first
    return f"{', '.join(said)}; first `{first.metric}` ({history.cell_of(first)}) {first.before} -> {first.after}"


def page(store: Store) -> str:
    """Markdown: of each engine in the store a table of its releases and the sentences."""
    made = {run.commit for run in store.runs() if run.title.startswith(RELEASE_TITLE) and run.plan}
    out = [HEAD.format(commit=f"; its results were made at {' and '.join(sorted(made))}" if all(made) and made else "")]
    for engine in history.engines(store):
        results = history.told(store, engine)
        steps = history.steps(results)
        out += [f"## {engine}", "", as_table(results, steps)]
        out += [f"{PACE}.", ""] if any(each.times for each in results) else []
        said = sentences(engine, steps)
        out += [f"* {line}" for line in said] or ["Nothing changed."]
        out.append("")
    return "\n".join(out)


if __name__ == "__main__":
    results, target = sys.argv[1:]
    opened = Store(Path(results), create=False)
    Path(target).write_text(page(opened), encoding="utf-8")
    opened.close()
