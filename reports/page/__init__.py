"""The report: one self-contained page, complete without JavaScript and without any request.

    Source (rows, replays, bench)  ->  sections as plain data  ->  templates  ->  one HTML text

The other modules of this folder compute the sections; templates only arrange them. The templates escape everything that
comes from a name, a reason or a parameter. They do not escape our own style and script, and charts, whose text
vl-convert has escaped.
"""

from __future__ import annotations

import base64
import hashlib
import json
import re
from collections.abc import Sequence
from importlib.metadata import PackageNotFoundError, version
from importlib.resources import files
from typing import Any

import jinja2
import minify_html
from markupsafe import Markup

from adapters.engine_folder import readings_of
from reports import readings
from reports.answers import Answer
from reports.findings import refusals
from reports.matrix import leaving, unjudged, unranked
from reports.overview import families_of, worst_answers
from reports.page import choosing, conclusions, cost, explorer, fairness, fixing, opening, replay, takeaway, verdicts
from reports.page.families import families
from reports.page.scenes import scene_sections
from reports.page.source import Bench, Source, load_source
from reports.page.styling import engine_style, heat_style, symbols
from reports.wording import missing_text, number, unstated, word_of
from validation.canonical import SUITES
from validation.catalogue import CATALOGUE
from validation.cells import format_dt

__all__ = ["Bench", "Source", "load_source", "render"]

#: Order matters: the first defines what the others use.
SCRIPTS = ("page.js", "replay.js", "explorer.js")
#: Largest number of lines about errors that are shown in full; of more, only the worst are shown and the others are
#: folded.
SEEN = 30


def render(source: Source) -> str:
    """Return the page of ``source`` as HTML text."""
    style = Markup(
        _text("page.css") + heat_style() + engine_style(list(dict(source.named))) + symbols(source.named)
    )  # ours: nothing in it comes from a run
    script = Markup("\n".join(_text(name) for name in SCRIPTS).strip())
    sheet = fairness.fairness(source)
    # Our own solver has its own section.
    others = [answer for answer in source.answers if answer.engine != sheet.solver]
    first = first_answers(source, others)
    choices = choosing.choices(source)
    shown = replay.replays(source)
    page = (
        _environment()
        .get_template("page.html.j2")
        .render(
            source=source,
            places={column: k for k, column in enumerate(source.named)},
            policy=policy(style, script),
            style=style,
            script=script,
            facts=facts(source),
            headline=opening.headline(source),
            halves=opening.halves(source),
            called=opening.called,
            cite=cite(source),
            sentences=conclusions.sentences(source),
            families=families(source),
            answers=source.answers,
            first_wrongs=fixing.wrongs(source, first),
            more_wrongs=fixing.wrongs(source, [answer for answer in others if answer not in first]),
            findings=conclusions.findings(source),
            by_reason=conclusions.by_reason,
            timed=[choice for choice in choices if choice.timed],
            untimed=[choice for choice in choices if not choice.timed],
            scenes=scene_sections(source),
            replays=shown,
            replay_heads=replay.heads(shown),
            people=replay.people(source),
            explorer=explorer.explorer(source),
            speed=cost.speed(source),
            forces=[readings.told(engine) for engine in source.engines if readings_of(engine)],
            laws=readings.LAWS,
            scale=readings.SCALE,
            sheet=sheet,
            take=takeaway.takeaway(source),
            said=verdicts.SAID,
            grounds=verdicts.GROUNDS,
            meanings=verdicts.MEANINGS,
            marks_used=_marks_used(source),
            beside=[*unranked(source.columns), *leaving(source.rows), *unjudged(source.rows), *refusals(source.rows)],
        )
    )
    return minify_html.minify(page)  # style and scripts must stay the same: the policy has their hashes


def first_answers(source: Source, wrong: Sequence[Answer]) -> list[Answer]:
    """Answers that are not folded: all if they are few, else those about the worst scene of each engine and group."""
    if len(wrong) <= SEEN:
        return list(wrong)
    worst = worst_answers(source.rows, source.answers, families_of(source.rows))
    chosen = {(answer.engine, answer.profile, answer.scene) for answer in worst}
    return [answer for answer in wrong if (answer.engine, answer.profile, answer.scene) in chosen]


def policy(style: str, script: str) -> str:
    """Content-security policy that allows this style and this script by their hashes, pictures as data, no request."""

    def digest(text: str) -> str:
        return base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()

    return (
        f"default-src 'none'; style-src 'sha256-{digest(style)}'; script-src 'sha256-{digest(script)}'; "
        "img-src data:; base-uri 'none'; form-action 'none'"
    )


def _text(name: str) -> str:
    # Normalised line ends, because a browser hashes the parsed text, and parsing makes them \n.
    return files(__name__).joinpath("templates", name).read_text(encoding="utf-8").replace("\r\n", "\n")


def _environment() -> jinja2.Environment:
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("reports.page"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"number": number, "dt": format_dt, "data": as_data, "unbroken": unbroken}
    environment.globals |= {"slug": verdicts.slug, "missing_text": missing_text, "word_of": word_of}
    return environment


def unbroken(text: str) -> str:
    """Text in which ``1.7e-4`` and ``2-D`` do not end a line at their hyphen."""
    return re.sub(r"(?<=\d)(e?-)(?=[\dD])", "\\1\N{WORD JOINER}", text)


def as_data(value: Any) -> Markup:
    """JSON for a data block, in which no character can end the block."""
    text = json.dumps(value, separators=(",", ":"), allow_nan=False)
    return Markup(text.replace("&", "\\u0026").replace("<", "\\u003c").replace(">", "\\u003e"))


def facts(source: Source) -> dict[str, Any]:
    """What was compared, when, where, with which code."""
    versions: dict[str, str] = {}
    for row in source.rows:
        versions.setdefault(row["engine"], row["engine_version"])
    profiles: dict[str, list[str]] = {}
    for engine, profile in source.columns:
        profiles.setdefault(engine, []).append(profile)
    steps = sorted({row["dt"] for row in source.rows}, reverse=True)
    return {
        "engines": [(engine, versions[engine], profiles[engine]) for engine in source.engines],
        "steps": [format_dt(dt) for dt in steps],
        "cells": len(source.observations),
        "checks": sum(row["physics"] is not None for row in source.rows),
        "judged": {row["engine"] for row in source.rows if row["physics"] is not None},
        "unstated": unstated(source.rows),
        "machine": source.run.machine,
    }


def cite(source: Source) -> dict[str, str]:
    """How to cite this page, and the commands that reproduce it."""
    run, installed = source.run, package_version()
    commit = f", commit {run.commit}" if run.commit else ""
    text = (
        f"contact-crosscheck {installed}{commit}, run {run.id} of {run.date[:10]} ({len(source.observations)} cases, "
        f"{len(source.rows)} values). CITATION.cff has the authors and, with crosscheck bundle, this run."
    )
    clean = run.commit.rstrip("+")
    lines = [
        f"git checkout {clean}" + ("   # plus changes that were not committed" if run.commit.endswith("+") else "")
    ]
    lines += ['pip install -e ".[all]" -c constraints.txt']
    lines.append(again("run", run.title))
    if source.bench is not None:
        lines.append(again("bench", source.bench.run.title.removeprefix("bench ")))
    lines += ["crosscheck report --out again", "crosscheck compare FOLDER again   # FOLDER: that of this run"]
    return {"text": text, "commands": "\n".join(lines if clean else lines[1:])}


def again(command: str, title: str) -> str:
    """The command that runs the cases of a run again, from its title; scenes are left out if they are all of ours."""
    suite, _, words = title.partition(": ")
    scenes, options, narrowing = words.partition(" --")
    if scenes.split() == list(CATALOGUE):
        scenes = ""
    parts = (
        f"crosscheck {command}",
        scenes,
        f"{options}{narrowing}".strip(),
        f"--{suite if suite in SUITES else 'quick'}",
    )
    return " ".join([*filter(None, parts), "--out again"])


def package_version() -> str:
    """Version of this distribution; unknown in a checkout that was never installed."""
    try:
        return version("contact-crosscheck")
    except PackageNotFoundError:
        return "(not installed)"


def _marks_used(source: Source) -> list[str]:
    used = {verdicts.mark_of(row) for row in source.rows}
    return [mark for mark in verdicts.SAID if mark in used]
