"""The dashboard: one self-contained page over all runs and releases of a store.

    store  ->  summaries (kept beside it)  ->  series  ->  steps (ruptures)  ->  panels  ->  one HTML text

Small multiples: per engine, profile and scene the declared error and, where a bench has it, the ratio of times to a
unit of the same machine. Complete without JavaScript, without a request, as strict as the report (`reports.page`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from importlib.resources import files
from typing import Any

import jinja2
from markupsafe import Markup

from reports.dashboard import drawing
from reports.dashboard.series import Panel, by_engine
from reports.dashboard.steps import Step
from reports.page import policy
from reports.page.styling import engine_style
from reports.wording import number, plural
from validation.releases.notes import explanations

__all__ = ["render"]
#: What each series runs over, in words.
OVER = {"runs": "runs and commits", "releases": "releases"}


@dataclass(frozen=True)
class Event:
    """Something that is marked: where, and in words."""

    panel: Panel
    at: int
    kind: str
    worse: bool
    text: str
    #: What the notes of a release say of such a step.
    note: str = ""

    @property
    def label(self) -> str:
        """Release or day."""
        return self.panel.points[self.at].label

    @property
    def title(self) -> str:
        """Which run or release that is, in full."""
        return self.panel.points[self.at].title


def render(panels: Sequence[Panel], title: str, reports: Mapping[str, str] | None = None) -> str:
    """Return the page as HTML text; ``reports`` are addresses of reports by run."""
    engines = sorted({panel.key[0] for panel in panels})
    style = Markup(_text("../page/templates/page.css") + _text("templates/dashboard.css") + engine_style(engines))
    script = Markup(_text("templates/dashboard.js"))
    found = {panel.anchor: events(panel) for panel in panels}
    every = [event for own in found.values() for event in own]
    return (
        _environment()
        .get_template("dashboard.html.j2")
        .render(
            title=title,
            policy=policy(style, script),
            style=style,
            script=script,
            groups=by_engine(panels),
            over=OVER,
            events=found,
            every=sorted(every, key=lambda e: (e.panel.over, e.panel.key[0], e.kind != "flip", e.panel.key, e.at)),
            engines=engines,
            scenes=sorted({panel.key[2] for panel in panels}),
            releases=sorted({event.label for event in every if event.panel.over == "releases"}),
            picture=drawing.panel,
            reports=dict(reports or {}),
        )
    )


def events(panel: Panel) -> list[Event]:
    """Flips and steps of a panel, in the order of its points."""
    out = []
    for at in panel.flips:
        point = panel.points[at]
        said = [f"begin to fail: {plural(point.lost, 'cell')}"] * bool(point.lost)
        said += [f"cease to fail: {plural(point.mended, 'cell')}"] * bool(point.mended)
        out.append(Event(panel, at, "flip", bool(point.lost), ", ".join(said)))
    out += [_step(panel, at, step, "error", panel.unit) for at, step in panel.error_steps]
    out += [_step(panel, at, step, "time", f"x {panel.opponent}") for at, step in panel.time_steps]
    noted, before = [], -1
    for event in sorted(out, key=lambda event: event.at):
        noted.append(event if event.at == before else _noted(event))  # what is said of a release is said once
        before = event.at
    return noted


def _noted(event: Event) -> Event:
    """An event on a release, with what the engine's notes say of it."""
    panel = event.panel
    if panel.over != "releases" or not event.at:
        return event
    engine, profile, scene, _ = panel.key
    before, after = (panel.points[at].version for at in (event.at - 1, event.at))
    return replace(event, note="; ".join(explanations(engine, scene, profile, before, after)))


def _step(panel: Panel, at: int, step: Step, kind: str, unit: str) -> Event:
    before, after = (number(value, 3) for value in (step.before, step.after))
    text = f"{kind} {before} -> {after} {unit}".rstrip() + f", x{number(step.factor, 3)}"
    return Event(panel, at, kind, step.factor > 1.0, text)


def _text(name: str) -> str:
    return files("reports.dashboard").joinpath(name).read_text(encoding="utf-8").replace("\r\n", "\n")


def _environment() -> jinja2.Environment:
    loader = jinja2.PackageLoader("reports.dashboard")
    options: dict[str, Any] = {"autoescape": True, "undefined": jinja2.StrictUndefined}
    return jinja2.Environment(loader=loader, trim_blocks=True, lstrip_blocks=True, **options)
