"""Makes ``table.json``, all that ``ask`` knows: ``python -m reports.symptoms.making``, as ``make tables`` does.

It is made of the scenes, known reports, fixes and defaults of engines, the published results, the titles of the docs'
pages, and ``words.toml``. A test compares it with these.
"""

from __future__ import annotations

import json
import re
import tomllib
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from adapters import registry
from adapters.engine_folder import unset_of
from reports.fixes import nothing_to_paste, recorded_fixes, recorded_paste, recorded_text
from reports.symptoms import LITTLE, OUTSIDE, PHRASE, TABLE, opened, stems, terms
from reports.symptoms.published import of_matrix, passed
from validation.catalogue import CATALOGUE
from validation.cells import Slot
from validation.field import CURED, notes
from validation.findings.files import findings_of
from validation.metrics import WORDS
from validation.running.plan import QUICK_DT
from validation.scenes import OURS

FOLDER = Path(__file__).parent
DOCS = FOLDER.parents[1] / "docs"
#: Share of a scene's lines that have a word of the scene's own.
OWN = 0.2


def made() -> dict[str, Any]:
    """The table.

    ``same`` has the group of each stem or phrase, ``idle`` stems without meaning, ``names`` the engine of each name.
    ``rows`` are what is searched: scene or topic, column, the line as it is shown, and its terms.
    """
    told = tomllib.loads((FOLDER / "words.toml").read_text(encoding="utf-8"))
    database = opened()
    idle = sorted({stem for stem in stems([told["idle"]], database)[0]})
    same = _same(told["same"], lambda phrases: stems(phrases, database))

    def terms_of(texts: Sequence[str]) -> list[list[str]]:
        return [terms(stemmed, same, idle) for stemmed in stems(texts, database)]

    topics = {topic["name"]: topic for topic in told["topic"]}
    lines = [*_of_scenes(), *_of_topics(topics), *_of_pages()]
    lines += [(each["scene"], "symptoms", line) for each in told["right"] for line in each["symptoms"]]
    found = terms_of([text for _, _, text in lines])
    rows = [
        [name, column, text if " " in text and column != "physics" else "", " ".join(own)]
        for (name, column, text), own in zip(lines, found, strict=True)
    ]
    engines = [name for name in registry.names() if (entry := registry.entry(name)) and registry.is_ours(entry)]
    return {
        "same": same,
        "idle": idle,
        "names": {word: name for name, words in told["names"].items() for word in words}
        | {n: n for n in engines if n != registry.solver()},
        "scenes": {
            name: {"title": CATALOGUE[name].title, "law": CATALOGUE[name].law, "terms": _own_terms(name, rows)}
            for name in OURS
        },
        "topics": {
            name: {key: topic[key] for key in ("says", "command", "near")} | {"terms": terms_of([topic["says"]])[0]}
            for name, topic in topics.items()
        },
        "right": {line: each["says"] for each in told["right"] for line in each["symptoms"]},
        "reports": {
            note.source: {
                "scene": note.scene,
                "symptom": note.symptom,
                "engines": [note.engine, note.about],
                "cure": note.cure_text if note.said == CURED and "profile" not in note.cure else "",
                "metric": note.metric,
            }
            for note in notes()
        },
        "engines": {
            name: {
                "release": release,
                "suite": suite,
                "better": registry.profile_of(name, "tuned"),
                "scenes": scenes,
                "refused": {scene: why for scene in OURS if scene not in scenes and (why := _refused(name, scene))},
                "unset": _unset(name, terms_of),
            }
            for name, (release, suite, scenes) in _verdicts(engines).items()
        },
        "fixes": {name: fixes for name in OURS if (fixes := _fixes(name, engines))},
        "rows": rows,
    }


def _same(groups: Sequence[Sequence[str]], stems_of: Callable[[Sequence[str]], list[list[str]]]) -> dict[str, str]:
    """Group of each phrase, as one word: the first group that has it."""
    found: dict[str, str] = {}
    for group in groups:
        for phrase, stemmed in zip(group, stems_of(group), strict=True):
            words = [stem for stem in stemmed if stem not in LITTLE]
            if not 0 < len(words) <= PHRASE:
                raise ValueError(f"words.toml: {phrase!r} has no words, or more than {PHRASE}")
            found.setdefault(" ".join(words), "".join(group[0].split()))
    return found


def _of_scenes() -> Iterator[tuple[str, str, str]]:
    for name in OURS:
        scene = CATALOGUE[name]
        yield name, "title", name.replace("_", " ")
        yield name, "title", scene.title
        yield name, "title", " ".join(scene.figure.split("\n\n")[0].split())
        yield from ((name, "symptoms", line) for line in scene.symptoms)
        yield from ((name, "reports", note.symptom) for note in notes() if note.scene == name)
        made = [scene.scene(dimension) for dimension in scene.dimensions]
        metrics = sorted({check.metric.partition("[")[0] for each in made for check in scene.checks(each, QUICK_DT)})
        said = [WORDS.get(metric, "") for metric in metrics] + [*scene.words.values()]
        yield name, "physics", " ".join(re.findall(r"[a-z]{3,}", f"{scene.law} {' '.join(metrics + said)}".lower()))


def _of_topics(topics: Mapping[str, Mapping[str, Any]]) -> Iterator[tuple[str, str, str]]:
    """Lines of topics; those of what is out of scope have nothing to do with each other."""
    for name, topic in topics.items():
        apart = name == OUTSIDE
        yield from ((f"{name}/{k}" if apart else name, "symptoms", line) for k, line in enumerate(topic["symptoms"]))


def _of_pages() -> Iterator[tuple[str, str, str]]:
    """Title and headings of each page for users that is written by hand."""
    pages = sorted([*DOCS.glob("*.md"), *DOCS.glob("howto/*.md"), *DOCS.glob("reference/*.md")])
    for path in pages:
        if (DOCS / "templates" / f"{path.name}.j2").exists():
            continue
        text = re.sub(r"^```.*?^```", "", path.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
        titles = re.findall(r"^##? (.+)$", text, re.MULTILINE)
        for title in titles if path.stem != "index" else ():
            yield f"docs/{path.relative_to(DOCS).with_suffix('').as_posix()}", "title", title


def _own_terms(name: str, rows: Sequence[Sequence[str]]) -> list[str]:
    """Terms of at least `OWN` of the lines about a scene: what it is about."""
    lines = [set(text.split()) for scene, _, _, text in rows if scene == name]
    count = Counter(term for line in lines for term in line)
    return sorted(term for term, times in count.items() if times >= OWN * len(lines))


def _unset(engine: str, terms_of: Callable[[Sequence[str]], list[list[str]]]) -> list[list[Any]]:
    """What an engine does where nothing is set, as documented: what, how, and terms of the first without units."""
    rows = [row for row in unset_of(engine) if "not documented" not in row.documented]
    own = terms_of([re.sub(r"\[.*?\]|[\d.]+ m?m(/s)?", "", row.what) for row in rows])
    return [[row.what, row.documented, words] for row, words in zip(rows, own, strict=True)]


def _refused(engine: str, scene: str) -> str:
    """Why an engine cannot run a scene in any dimension, from its findings; empty where they do not say."""
    profile = registry.profile_of(engine, "shipped") or ""
    slots = [Slot(scene, (), dimension, engine, profile, QUICK_DT) for dimension in CATALOGUE[scene].dimensions]
    findings = findings_of(engine)
    found = [findings.unsupported_by(slot) if findings else None for slot in slots]
    return found[0].reason if found[0] and all(found) else ""


def _verdicts(engines: Sequence[str]) -> dict[str, tuple[str, str, dict[str, list[list[Any]]]]]:
    """Release, suite and verdicts of each engine.

    By scene: its dimensions, each with failed and judged checks as shipped, and the failed ones of the tuned profile.
    """
    columns = ["engine", "engine_version", "profile", "scene", "dimension", "failed", "judged"]
    entries = [(*row, "standard") for row in passed()[columns].itertuples(index=False, name=None)]
    entries += [(*row, "quick") for row in of_matrix()]
    found: dict[str, tuple[str, str, dict[str, list[list[Any]]]]] = {}
    failed = {
        (engine, profile, scene, dimension): int(failed) for engine, _, profile, scene, dimension, failed, *_ in entries
    }
    for engine, release, profile, scene, dimension, failing, judged, suite in entries:
        if engine in engines and profile == registry.profile_of(engine, "shipped"):
            tuned = failed.get((engine, registry.profile_of(engine, "tuned"), scene, dimension))
            scenes = found.setdefault(engine, (release, suite, {}))[2]
            scenes.setdefault(scene, []).append([int(dimension), int(failing), int(judged), tuned])
    return found


def _fixes(scene: str, engines: Sequence[str]) -> list[dict[str, Any]]:
    """Recorded fixes of a scene: the one place from which ``ask`` has what it prints of a fix."""
    return [
        {
            "engine": fix.engine, "failing": fix.failing, "judged": fix.judged, "helps": fix.recommended,
            "text": recorded_text(fix),
            "paste": (recorded_paste(fix) or nothing_to_paste(fix)) if fix.recommended else "",
        }
        for fix in recorded_fixes(scene, engines)
    ]  # fmt: skip


def text_of(found: Mapping[str, Any]) -> str:
    """The table as it is kept: one entry on a line, so that a change is one line of a diff."""
    parts = []
    for key, value in found.items():
        lines = [f"{json.dumps(k)}: {json.dumps(v)}" for k, v in value.items()] if isinstance(value, dict) else [
            json.dumps(each) for each in value
        ]  # fmt: skip
        inside = ",\n".join(lines)
        parts.append(f'"{key}": {{\n{inside}\n}}' if isinstance(value, dict) else f'"{key}": [\n{inside}\n]')
    return "{\n" + ",\n".join(parts) + "\n}\n"


if __name__ == "__main__":
    TABLE.write_text(text_of(made()), encoding="utf-8")
