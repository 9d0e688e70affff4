"""The dashboard: one self-contained page over all runs and releases of a store.

    store  ->  summaries (kept beside it)  ->  series  ->  steps (ruptures)  ->  panels  ->  one HTML text

Small multiples: per engine, profile and scene the declared error and, from a bench, the ratio of times to a unit of the
same machine. Complete without JavaScript and requests, as strict as the report (`reports.page`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from importlib.resources import files
from typing import Any

import jinja2
from markupsafe import Markup

from reports.dashboard import drawing
from reports.dashboard.series import Panel, by_engine
from reports.dashboard.steps import Step
from reports.overview import share
from reports.page import policy
from reports.page.styling import engine_style, heat_style
from reports.wording import number, plural
from validation.releases.notes import explanations

__all__ = ["render"]
#: Words for the axis of each series.
OVER = {"runs": "runs and commits", "releases": "releases"}
#: Numbers of newest releases or runs in a grid, and of steps described in a sentence.
COLUMNS, LARGEST = 24, 10


@dataclass(frozen=True)
class Event:
    """A marked point: its place and text."""

    panel: Panel
    at: int
    kind: str
    worse: bool
    text: str
    #: Factor of a step; 1 for a flip.
    factor: float = 1.0
    #: Text of the release notes about such a step.
    note: str = ""

    @property
    def label(self) -> str:
        """Release or day."""
        return self.panel.points[self.at].label

    @property
    def title(self) -> str:
        """Full name of the run or release."""
        return self.panel.points[self.at].title

    @property
    def sentence(self) -> str:
        """``With toy 1.2, the error of stack 3-D (tuned) falls from 4.4 to 2.8e-15 m``; the notes of the release."""
        engine, profile, *_ = self.panel.key
        what = f"the {self.kind} of {self.panel.name} ({profile}) {'rises' if self.worse else 'falls'} {self.text}"
        where = f"With {engine} {self.label}" if self.panel.over == "releases" else f"On {self.label}, {engine}"
        return f"{where}, {what}{f': {self.note}' if self.note else ''}."


@dataclass(frozen=True)
class Grid:
    """Share of failed checks of each scene, release by release; ``same`` scenes never change and have no line.

    A line is a scene, the anchor of its first panel, and the share per column, None without a run of the scene.
    """

    over: str
    engine: str
    labels: list[str]
    lines: list[tuple[str, str, list[float | None]]]
    same: int


def grid(over: str, engine: str, panels: Sequence[Panel]) -> Grid:
    """The grid of one engine over its newest `COLUMNS` releases or runs; largest changes first."""
    ordered = sorted(panels, key=lambda panel: -len(panel.points))
    labels = dict((point.title, point.label) for panel in ordered for point in panel.points)
    shown = list(labels)[-COLUMNS:]
    counts: dict[str, dict[str, list[int]]] = {}
    anchors: dict[str, str] = {}
    for panel in panels:
        own = counts.setdefault(panel.key[2], {})
        anchors.setdefault(panel.key[2], panel.anchor)
        for point in panel.points:
            cell = own.setdefault(point.title, [0, 0])
            cell[0] += point.fails
            cell[1] += point.judged
    shares = {
        scene: [own[title][0] / own[title][1] if own.get(title, [0, 0])[1] else None for title in shown]
        for scene, own in counts.items()
    }
    spans = {
        scene: max(known) - min(known)
        for scene, line in shares.items()
        if (known := [s for s in line if s is not None])
    }
    moved = sorted((scene for scene in spans if spans[scene]), key=lambda scene: -spans[scene])
    lines = [(scene, anchors[scene], shares[scene]) for scene in moved]
    return Grid(over, engine, [labels[title] for title in shown], lines, len(shares) - len(lines))


def render(panels: Sequence[Panel], title: str, reports: Mapping[str, str] | None = None) -> str:
    """Return the page as HTML text; ``reports`` are addresses of reports by run."""
    engines = sorted({panel.key[0] for panel in panels})
    own = _text("../page/templates/page.css") + _text("templates/dashboard.css")
    style = Markup(own + heat_style() + engine_style(engines))
    script = Markup(_text("templates/dashboard.js"))
    panels = [panel for panel in panels if len(panel.points) > 1]
    groups = by_engine(panels)
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
            groups=groups,
            grids=[each for key, own in groups.items() if (each := grid(*key, own)).lines],
            largest=sorted((e for e in every if e.factor != 1.0), key=lambda e: -abs(math.log(e.factor)))[:LARGEST],
            percent=lambda part: share(part, 1.0),
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
        said = [f"begins to fail: {plural(point.lost, 'case')}"] * bool(point.lost)
        said += [f"fixed: {plural(point.mended, 'case')}"] * bool(point.mended)
        out.append(Event(panel, at, "flip", bool(point.lost), ", ".join(said)))
    out += [_step(panel, at, step, "error", panel.unit) for at, step in panel.error_steps]
    out += [_step(panel, at, step, "time", f"x {panel.opponent}") for at, step in panel.time_steps]
    noted, before = [], -1
    for event in sorted(out, key=lambda event: event.at):
        noted.append(event if event.at == before else _noted(event))  # a text about a release is shown once
        before = event.at
    return noted


def _noted(event: Event) -> Event:
    """An event on a release, with the engine's release notes."""
    panel = event.panel
    if panel.over != "releases" or not event.at:
        return event
    engine, profile, scene, _ = panel.key
    before, after = (panel.points[at].version for at in (event.at - 1, event.at))
    return replace(event, note="; ".join(explanations(engine, scene, profile, before, after)))


def _step(panel: Panel, at: int, step: Step, kind: str, unit: str) -> Event:
    before, after = (number(value, 3) for value in (step.before, step.after))
    text = f"from {before} to {after} {unit}".removesuffix(" 1").rstrip()
    return Event(panel, at, kind, step.factor > 1.0, text, step.factor)


def _text(name: str) -> str:
    return files("reports.dashboard").joinpath(name).read_text(encoding="utf-8").replace("\r\n", "\n")


def _environment() -> jinja2.Environment:
    loader = jinja2.PackageLoader("reports.dashboard")
    options: dict[str, Any] = {"autoescape": True, "undefined": jinja2.StrictUndefined}
    return jinja2.Environment(loader=loader, trim_blocks=True, lstrip_blocks=True, **options)
