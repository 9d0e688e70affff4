"""Pages that are made from what the project knows: scenes, engines, fixes by symptom, and notebooks."""

from __future__ import annotations

import html
import inspect
import json
import re
import textwrap
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import jinja2
import pandas as pd
import worked

from adapters import registry
from reports import numbers, ports, readings
from reports.fixes import recorded_fixes, recorded_paste, recorded_text
from reports.listing import describe
from reports.symptoms.published import passed
from reports.tables import shown_by, unset_text, verdict_of
from reports.wording import first_of, markdown, number, setting_text, word_of
from validation import bounds
from validation.catalogue import CATALOGUE
from validation.releases.kept import kept


def write(folder: Path) -> None:
    """Write all of them below ``folder``; what has not changed is left alone."""
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(folder / "templates"),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {
        "md": lambda text: markdown(str(text)).replace("\n", " "),
        "number": number,
        "shown_by": shown_by,
        "unset": unset_text,
        "verdict_of": verdict_of,
        "law": law,
        "prose": prose,
    }
    environment.globals["word_of"] = word_of
    passes = passed()
    for name, values in made(passes):
        template = name.split("/")[0] if "index" not in name else name.replace("/", "-")
        _keep(folder / f"{name}.md", environment.get_template(f"{template}.md.j2").render(values))
    for name, picture in worked.pictures().items():
        _keep(folder / name, picture)
    for source in sorted((folder / "notebooks").glob("*.py")):
        text = source.read_text(encoding="utf-8")
        _keep(source.with_suffix(".ipynb"), notebook(text))
        _keep(source.with_suffix(".md"), page(text, source.stem))


def _keep(path: Path, text: str) -> None:
    path.parent.mkdir(exist_ok=True)
    if not path.exists() or path.read_text(encoding="utf-8") != text:
        path.write_text(text, encoding="utf-8")


def cells(text: str) -> list[tuple[str, str]]:
    """Cells of a notebook that is kept as a script with ``# %%`` lines: ``markdown`` or ``code``, and the text."""
    found = []
    for part in re.split(r"^# %%", text, flags=re.MULTILINE)[1:]:
        head, _, body = part.partition("\n")
        kind = "markdown" if "[markdown]" in head else "code"
        if kind == "markdown":
            body = re.sub(r"^# ?", "", body, flags=re.MULTILINE)
        found.append((kind, body.strip("\n")))
    return found


def notebook(text: str) -> str:
    """The notebook in the format of Jupyter, without outputs."""
    kinds: dict[str, dict[str, Any]] = {"markdown": {}, "code": {"execution_count": None, "outputs": []}}
    own = [
        {"cell_type": kind, "id": f"cell-{k}", "metadata": {}, "source": body, **kinds[kind]}
        for k, (kind, body) in enumerate(cells(text))
    ]
    kernel = {"kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"}}
    return json.dumps({"cells": own, "metadata": kernel, "nbformat": 4, "nbformat_minor": 5}, indent=1) + "\n"


def page(text: str, name: str) -> str:
    """The notebook as a page, with links to its script and to the notebook that Jupyter opens."""
    title, *rest = [body if kind == "markdown" else f"```python\n{body}\n```" for kind, body in cells(text)]
    links = f"Download: {{download}}`notebook <{name}.ipynb>`, {{download}}`script <{name}.py>`."
    return "\n\n".join([title, links, *rest]) + "\n"


def prose(text: str) -> str:
    """Text of a docstring: what stands between backticks is code."""
    parts = re.split(r"`+([^`]+)`+", " ".join(text.split()))
    return "".join(f"`{part}`" if k % 2 else markdown(part) for k, part in enumerate(parts))


def parts(figure: str) -> list[tuple[bool, str]]:
    """Parts of a figure's text between blank lines: whether each is drawn, and its text; drawings are joined."""
    found: list[tuple[bool, str]] = []
    for part in re.split(r"\n\s*\n", figure.strip("\n")):
        drawn = part.startswith(" ")
        if found and found[-1][0] and drawn:
            found[-1] = (True, f"{found[-1][1]}\n\n{part}")
        else:
            found.append((drawn, part if drawn else " ".join(part.split())))
    return [(drawn, textwrap.dedent(text) if drawn else text) for drawn, text in found]


def made(passes: pd.DataFrame) -> Iterator[tuple[str, dict[str, Any]]]:
    """Name of each page, and what its template is given."""
    groups: dict[str, list[Any]] = {}
    for scene in CATALOGUE.values():
        groups.setdefault(scene.family, []).append(scene)
        own = passes[passes.scene == scene.name]
        more = {"symptoms": scene.symptoms, "passes": own.to_dict("records"), "fixes": fixes(scene.name)}
        yield f"scenes/{scene.name}", describe(scene.name) | more | {"figure": parts(scene.figure)}
    yield "scenes/index", {"groups": groups}
    engines = [name for name in registry.names() if registry.adapter(name) is not None]
    for name in engines:
        told = describe(name, measure=True)
        yield f"engines/{name}", told | {"settings": settings(told["profiles"])}
    yield "engines/index", {"engines": {name: registry.facts(name) for name in engines}}
    yield "tolerances", {"introduction": inspect.getdoc(bounds), "sections": tolerances(), "reasons": reasons()}
    yield "references", references()
    yield "worked-example", worked.example()
    own = {name: numbers.of_engine(name) for name in engines}
    yield "numbers", {"engines": own, "groups": numbers.COLUMNS, "told": numbers_told}
    yield (
        "forces",
        {
            "engines": [readings.told(name) | {"anchor": f"forces-{name}"} for name in readings.engines()],
            "laws": readings.LAWS,
            "scale": readings.SCALE,
        },
    )
    for name in engines:
        if rows := kept(name):
            yield "ports", {"engine": name, "title": registry.facts(name).title} | ports.told(rows)
    yield "symptoms", {"scenes": [(scene, fixes(scene.name)) for scene in CATALOGUE.values() if scene.symptoms]}


def numbers_told(row: Mapping[str, str], columns: Iterable[str]) -> bool:
    """Whether an engine has any number in a table; the order of a step has a list of its own."""
    return any(row[key] for key in columns if key != "step")


def tolerances() -> list[tuple[str, list[dict[str, str]]]]:
    """Sections of `validation.bounds`, and of each function in them its name, formula and derivation."""
    found: list[tuple[str, list[dict[str, str]]]] = []
    for line in inspect.getsource(bounds).splitlines():
        if line.startswith("# ----"):
            found.append((line.strip("# -"), []))
        elif found and (name := re.match(r"def ([a-z]\w*)", line)):
            function = getattr(bounds, name[1])
            because = re.search(r'because = (?:\(\n\s*)?f?"([^"]+)"', inspect.getsource(function))
            told = {"name": name[1], "text": inspect.getdoc(function) or "", "because": because[1] if because else ""}
            found[-1][1].append(told)
    return found


def reasons() -> list[dict[str, Any]]:
    """Reasons of all tolerances at the defaults, with the checks that have them."""
    found: dict[str, list[str]] = {}
    for name in CATALOGUE:
        for check in describe(name)["checks_at_defaults"]:
            found.setdefault(check["because"], []).append(f"{name}/{check['metric']}")
    return [{"because": because, "checks": checks} for because, checks in found.items()]


#: A work that a scene's text cites, in brackets and with its year.
CITED = re.compile(r"\[([^\[\]]*?\b(?:18|19|20)\d\d\b[^\[\]]*)\]")


def references() -> dict[str, Any]:
    """Where the truth of each scene comes from, and the works that are cited, each once."""
    works: dict[str, list[str]] = {}
    for name, scene in CATALOGUE.items():
        for work in CITED.findall(" ".join(scene.figure.split())):
            for each in re.split(r"; (?=[A-Z]\. )", work.rstrip(".")):
                works.setdefault(each.partition(": ")[0] if each.count(": ") > 1 else each, []).append(name)
    order = sorted(works, key=lambda work: re.sub(r"^(?:[A-Z]\. )+", "", work))
    number_of = {work: k for k, work in enumerate(order, 1)}
    sources = {
        name: {
            "sources": list(dict.fromkeys(check["source"] for check in describe(name)["checks_at_defaults"])),
            "works": [number_of[work] for work in order if name in works[work]],
        }
        for name in CATALOGUE
    }
    return {"works": [(number_of[work], work, works[work]) for work in order], "scenes": sources}


#: Names of letters, and signs, as they are typeset.
SIGNS = {
    "alpha": "α", "beta": "β", "gamma": "γ", "theta": "θ", "phi": "φ", "mu": "μ", "rho": "ρ", "eta": "η", "pi": "π",
    "<=": "≤", ">=": "≥", "sqrt": "√", "infinity": "∞",
}  # fmt: skip


def law(text: str) -> str:
    """A law as HTML: powers raised, indices lowered, Greek letters and signs in place of their names."""
    text = html.escape(text, quote=False).replace("&lt;=", "<=").replace("&gt;=", ">=")
    for name, sign in SIGNS.items():
        text = re.sub(rf"(?<![A-Za-z]){re.escape(name)}(?![A-Za-z])", sign, text)
    text = re.sub(r"\^(\([^()]*\)|-?\w+)", lambda power: f"<sup>{power[1].strip('()')}</sup>", text)
    text = re.sub(r"_(\(([^()]*)\)|\w+)", lambda index: f"<sub>{index[2] or index[1]}</sub>", text)
    text = re.sub(r"\b([A-Za-z]\w?)([+-])(?= |,|;|$|/|\))", r"\1<sup>\2</sup>", text)  # before and after a blow
    return text.replace("'", "′").replace("*", "·").replace("  ", " &ensp;")


def fixes(scene: str) -> list[dict[str, Any]]:
    """What is on record of engines as shipped on a scene: what mends it, in words and as lines to paste."""
    return [
        {"cure": cure, "text": recorded_text(cure), "paste": recorded_paste(cure)}
        for cure in recorded_fixes(scene, registry.names())
    ]


def settings(profiles: dict[str, Any]) -> dict[str, list[dict[str, Any]]]:
    """Settings of each profile with the scenes in which they hold; nothing where it is all of them."""
    found = {}
    for profile, scenes in profiles.items():
        where: dict[tuple[str, str, str], list[str]] = {}
        for scene, own in scenes.items():
            for each in own:
                where.setdefault((each["name"], setting_text(each["value"]), each["because"]), []).append(scene)
        found[profile] = [
            {"name": name, "value": value, "because": because, "scenes": _only_in(own, list(scenes))}
            for (name, value, because), own in where.items()
        ]
    return found


def _only_in(own: list[str], scenes: list[str]) -> str:
    """The scenes of a setting in a few words: the first of them, or all but the first of the others."""
    others = [scene for scene in scenes if scene not in own]
    if len(others) < len(own):
        return f"all but {first_of(others)}" if others else ""
    return first_of(own)
