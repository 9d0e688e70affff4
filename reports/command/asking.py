"""``ask``: from a symptom to the scene that shows it, to who passes it, and to a fix. Imports nothing that is slow."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator, Mapping
from textwrap import wrap
from typing import Any

import click

from reports.command.files import wrong
from reports.command.group import AS_JSON, main
from reports.symptoms import OUTSIDE
from reports.symptoms.answers import COMMAND, NOTHING, PAGE, SCENE, SEVERAL, answer, near

Plain = Mapping[str, Any]
#: How a situation of one's own is posed.
POSED = ": crosscheck run my-scene.toml, or a model (MJCF, URDF, SDF); docs: Run your own scene or model"


@main.command("ask", epilog="Example: crosscheck ask my ball does not bounce")
@click.argument("words", nargs=-1, required=True)
@AS_JSON
def ask_command(words: tuple[str, ...], as_json: bool) -> None:
    """Find a scene and a fix from a symptom in your words.

    WORDS are yours, such as: grip slips; my ball does not bounce; or the number of a known report, or a scene. Name an
    engine for its numbers and for lines to paste. Nothing is run: the numbers are those of the published results.
    """
    text = " ".join(words)
    told = answer(text)
    if not any(told[key] for key in ("missed", "scene", "candidates", "command", "page")):
        reason = f"{text!r} tells no symptom; see crosscheck list scenes, and crosscheck field for known reports"
        raise wrong(f"words: {reason}")
    if as_json:
        click.echo(json.dumps(told, indent=1))
        return
    for line in _LINES[told["answer"]](told, text):
        click.echo(line)
    if told["missed"]:
        meant = near(told["missed"])
        missed = [f"{word} (did you mean {meant[word]!r}?)" if word in meant else word for word in told["missed"]]
        click.echo(click.style(_wrapped(f"no match for: {', '.join(missed)}"), dim=True))
    if told["strangers"]:
        click.echo(_wrapped(f"no adapter for: {', '.join(told['strangers'])}; crosscheck list engines"))


def _wrapped(text: str, indent: str = "") -> str:
    """A paragraph that fits the terminal; later lines are indented, and no name is broken."""
    width = shutil.get_terminal_size().columns
    lines = wrap(text, width, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False)
    return "\n".join(lines)


def _title(text: str) -> str:
    return click.style(_wrapped(text), bold=True)


def _scene(told: Plain, text: str) -> Iterator[str]:
    yield _title(f"{told['scene']}: {told['title']}")
    if told["report"]:
        yield _wrapped(f"known report {told['report']['source']}: {told['report']['symptom']}")
    elif told["line"] and told["line"].lower() not in text.lower():
        yield _wrapped(f"such as: {told['line']}")
    if told["says"]:
        yield _wrapped(told["says"])
    yield _wrapped(f"truth: {told['law']}", "  ")
    for engine in told["engines"]:
        yield ""
        yield from _engine(engine, told["scene"])
    if not told["engines"]:
        yield from _all_engines(told)
    run = [each["engine"] for each in told["engines"] if each["judged"]]
    if run or not told["engines"]:
        yield ""
        yield _wrapped(f"run it: crosscheck run {told['scene']}" + "".join(f" --engine {e}" for e in run), "  ")


def _all_engines(told: Plain) -> Iterator[str]:
    yield ""
    if told["passes"]:
        yield _wrapped(f"pass as shipped: {', '.join(told['passes'])}", "  ")
    if told["fails"]:
        yield _wrapped(f"fail checks as shipped: {', '.join(told['fails'])}", "  ")
    if told["fixed"]:
        shown = f"crosscheck ask {told['scene']} {told['fixed'][0]}"
        yield _wrapped(f"a fix is on record for {', '.join(told['fixed'])}; to see it: {shown}", "  ")
    elif told["passes"] or told["fails"]:
        yield _wrapped("name one for its numbers and what it does when nothing is set", "  ")


def _engine(told: Plain, scene: str) -> Iterator[str]:
    """What is on record of an engine on a scene."""
    name = told["engine"]
    if not told["judged"] and not told["fix"]:
        run = f"crosscheck run {scene} --engine {name}"
        yield _title(
            f"{name} does not run the scene: {told['refused'] or f'{run} says why'}"
            if told["known"] or told["refused"]
            else f"{name}: no result is on record yet; to see it: {run}"
        )
        yield from _settings(told)
        return
    which = f"({told['suite']} suite, release {told['release']})"
    if not told["failed"] and not told["fix"]:
        yield _title(f"{name} as shipped passes all {told['judged']} checks {which}")
        yield _wrapped(f"so it may be your model{'; where nothing is set:' if told['unset'] else POSED}", "  ")
        yield from _settings(told)
        return
    fix = told["fix"]
    if fix:
        yield _title(f"{name} as shipped: {fix['failing']} of {fix['judged']} checks fail")
        yield _wrapped(fix["text"])
        if fix["paste"]:
            yield fix["paste"]
        for other in told["others"]:
            yield _wrapped(f"{other['metric']} passes with {other['cure']} too ({other['source']})", "  ")
    else:
        where = f" in {' and '.join(told['where'])}"
        yield _title(f"{name} as shipped: {told['failed']} of {told['judged']} checks fail{where} {which}")
        if told["better"]:
            yield _wrapped(
                f"profile {told['better']} passes all of them; its settings: crosscheck describe {name}", "  "
            )
        else:
            yield _wrapped(f"no setting is known that fixes it; to search: crosscheck cure {name} {scene}", "  ")
    if not fix or not fix["paste"]:
        if told["unset"]:
            yield "what it does when nothing is set:"
        yield from _settings(told)


def _unset(told: Plain) -> Iterator[str]:
    """What engines that are asked for do, as far as the question is about it."""
    for engine, rows in told["unset"].items():
        if rows:
            yield f"{engine}, where nothing is set:"
            yield from _settings({"unset": rows})


def _settings(told: Plain) -> Iterator[str]:
    for row in told["unset"]:
        both = "; set that of both bodies" if " and " in row["what"] else ""
        yield _wrapped(f"  {row['what']}: {row['how']}{both}", "    ")


def _several(told: Plain, text: str) -> Iterator[str]:
    yield _title("several scenes may show this; nearest:")
    width = max(len(each["scene"]) for each in told["candidates"])
    for each in told["candidates"]:
        verdicts = "".join(f" ({engine} {verdict})" for engine, verdict in each["verdicts"].items())
        yield _wrapped(f"  {each['scene']:{width}}  {each['title']}{verdicts}", " " * (width + 4))
        if each["command"]:
            yield _wrapped(f"  {'':{width}}  {each['command']}", " " * (width + 4))
    named = next((each["scene"] for each in told["candidates"] if each["scene"]), "")
    if named:
        yield _wrapped(f"say more, or name one: crosscheck ask {' '.join([named, *told['asked']])}", "  ")
    yield from _unset(told)


def _command(told: Plain, text: str) -> Iterator[str]:
    yield _title(told["says"])
    yield from _unset(told)
    yield _wrapped(told["command"], "  ")
    if told["scene"]:
        yield _wrapped(f"nearest scene: {told['scene']} ({told['title']})", "  ")


def _outside(told: Plain, text: str) -> Iterator[str]:
    yield _title("no scene shows this")
    yield _wrapped(told["says"])
    yield _wrapped(told["command"], "  ")


def _nothing(told: Plain, text: str) -> Iterator[str]:
    yield _title("no scene shows this")
    for each in told["candidates"][:1]:
        if each["scene"]:
            yield _wrapped(f"nearest: {each['scene']} ({each['title']})", "  ")
    yield _wrapped(f"pose it{POSED}", "  ")


def _page(told: Plain, text: str) -> Iterator[str]:
    yield _title(f"the docs have a page: {told['title']}".rstrip(": "))
    yield told["page"]


_LINES = {SCENE: _scene, SEVERAL: _several, COMMAND: _command, OUTSIDE: _outside, NOTHING: _nothing, PAGE: _page}
