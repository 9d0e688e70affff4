"""Pages that are made from what the project knows: scenes, engines, fixes by symptom, and notebooks."""

from __future__ import annotations

import json
import re
import textwrap
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import jinja2
import pandas as pd

from adapters import registry
from reports.cures import recorded_fixes, recorded_paste, recorded_text
from reports.listing import describe
from reports.symptoms.published import passed
from reports.tables import unset_text
from reports.wording import first_of, markdown, number, setting_text, word_of
from validation.catalogue import CATALOGUE


def write(folder: Path) -> None:
    """Write all of them below ``folder``; what has not changed is left alone."""
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(folder / "templates"),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {
        "md": lambda text: markdown(str(text)).replace("\n", " ").replace("*", "\\*"),
        "number": number,
        "unset": unset_text,
    }
    environment.globals["word_of"] = word_of
    passes = passed()
    for name, values in made(passes):
        template = name.split("/")[0] if "index" not in name else name.replace("/", "-")
        _keep(folder / f"{name}.md", environment.get_template(f"{template}.md.j2").render(values))
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


def plain(text: object) -> str:
    """Text that Markdown shows as it is, on one line."""
    return markdown(str(text)).replace("\n", " ").replace("*", "\\*").replace("_", "\\_")


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
    engines = [name for name in registry.names() if registry.find(name).engine is not None]
    for name in engines:
        told = describe(name, measure=True)
        yield f"engines/{name}", told | {"settings": settings(told["profiles"])}
    yield (
        "engines/index",
        {
            "engines": {name: registry.facts(name) for name in engines},
            "others": {name: registry.facts(name) for name in registry.names() if name not in engines},
        },
    )
    yield "symptoms", {"scenes": [(scene, fixes(scene.name)) for scene in CATALOGUE.values() if scene.symptoms]}


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
