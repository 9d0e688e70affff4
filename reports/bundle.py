"""A result as one archive: plan, machine, results, citation, and checksums of all files.

README.txt           contents
environment.json     machine, Python, packages, commit, plan
observations.jsonl   raw measurements, one case per line; verdicts are derived from them
rows.jsonl, rows.csv every judged value
timings.csv          raw timings of the benchmark, if there is one
scenes/              scene files of the run, as at its start
report.html          the report
CITATION.cff         how to cite, with run and commit
SHA256SUMS           checksums, as ``sha256sum -c`` reads them
"""

from __future__ import annotations

import hashlib
import json
import re
import zipfile
from collections.abc import Mapping
from importlib.metadata import distributions
from importlib.resources import files
from pathlib import Path
from typing import Any

from reports import exports, speed
from reports.page import load_source, render
from reports.page.source import Source
from reports.wording import csv_of
from validation.records.store import Run, Store

README = """contact-crosscheck, run {run}

{contents}

Verdicts are derived from observations.jsonl: `crosscheck report` and `crosscheck compare` read the checks.
Check the files with: sha256sum -c SHA256SUMS
"""
#: File -> description, in the order of the archive.
CONTENTS = {
    "environment.json": "machine, Python, packages, commit and plan of the run (and of the benchmark)",
    "observations.jsonl": "raw measurements, one case per line",
    "rows.jsonl": "every judged value, one per line",
    "rows.csv": "the same as a table",
    "timings.csv": "raw timings of the benchmark",
    "report.html": "the report, one self-contained page",
    "CITATION.cff": "how to cite this result",
}


def write_bundle(folder: Path, run: str, path: Path) -> list[str]:
    """Write the archive of ``run`` of the store in ``folder`` to ``path``; return the names inside.

    Raises
    ------
    StoreError
        If the folder has no results or no such run.
    """
    source = load_source(folder, run)
    texts = _texts(source, folder)
    listed = {name: what for name, what in CONTENTS.items() if name in texts}
    listed |= {name: "a scene file that ran" for name in texts if name.startswith("scenes/")}
    contents = "\n".join(f"{name:<20} {what}" for name, what in listed.items())
    texts = {"README.txt": README.format(run=source.run.id, contents=contents), **texts}
    sums = "".join(f"{hashlib.sha256(text.encode()).hexdigest()}  {name}\n" for name, text in texts.items())
    texts["SHA256SUMS"] = sums
    path.parent.mkdir(parents=True, exist_ok=True)
    with zipfile.ZipFile(path, "w") as archive:
        for name, text in texts.items():
            entry = zipfile.ZipInfo(f"contact-crosscheck-{source.run.id}/{name}")  # 1980: same run, same archive
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, text)
    return list(texts)


def _texts(source: Source, folder: Path) -> dict[str, str]:
    texts = {
        "environment.json": json.dumps(_environment(source), indent=1) + "\n",
        "observations.jsonl": "".join(json.dumps(o.as_dict(), default=str) + "\n" for o in source.observations),
        "rows.jsonl": exports.as_jsonl(source.rows),
        "rows.csv": exports.as_csv(source.rows),
    }
    if source.bench is not None:
        store = Store(folder, create=False)
        texts["timings.csv"] = csv_of(speed.raw_of(store, source.bench.run))
        store.close()
    return texts | {"report.html": render(source), "CITATION.cff": citation(source.run)} | _scene_files(source)


def _scene_files(source: Source) -> dict[str, str]:
    """Texts of scene files as ``scenes/<hash>-<name>``: equal names do not collide, and no path leads outside."""
    found = {}
    for pinned, text in source.scenes_kept.items():
        path, _, digest = pinned.rpartition("@")
        name = re.sub(r"[^A-Za-z0-9._-]+", "-", Path(path).name)
        found[f"scenes/{digest}-{name}"] = text
    return found


def _environment(source: Source) -> dict[str, Any]:
    packages = {d.metadata["Name"]: d.version for d in distributions() if d.metadata["Name"]}
    found: dict[str, Any] = {"run": _run(source.run), "packages_now": dict(sorted(packages.items()))}
    if source.bench is not None:
        found["bench"] = {**_run(source.bench.run), "protocol": dict(source.bench.protocol)}
    return found


def _run(run: Run) -> Mapping[str, Any]:
    return {
        "id": run.id, "date": run.date, "commit": run.commit, "title": run.title, "machine": run.machine,
        "finished": run.finished, "slots": list(run.plan),
    }  # fmt: skip


def citation(run: Run) -> str:
    """Citation file of the project with the run and its commit added."""
    here = files("reports")
    beside = Path(str(here)).parent / "CITATION.cff"  # in a checkout; a wheel has its copy inside the package
    inside = Path(str(here.joinpath("CITATION.cff")))
    text = (beside if beside.is_file() else inside).read_text(encoding="utf-8").rstrip("\n")
    commit = f'\ncommit: "{run.commit}"' if run.commit else ""
    return f'{text}{commit}\nidentifiers:\n  - type: other\n    value: "run {run.id} of {run.date}"\n'
