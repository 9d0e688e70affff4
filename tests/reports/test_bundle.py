"""The bundle: everything about a run in one archive whose checksums hold."""

import hashlib
import json
import zipfile
from types import SimpleNamespace

import pandas as pd
import pytest
from click.testing import CliRunner

from reports.bundle import citation, write_bundle
from reports.command import main
from validation.cells import Slot
from validation.posed import pinned
from validation.records.store import Run, Store
from validation.running.execution import execute

SCENE = """name = "drop"
dimension = 2
gravity = [0.0, -9.81]
duration = 0.1
[[bodies]]
name = "ball"
shape = {{ type = "disc", radius = 0.5 }}
mass = 1.0
pose = [0.0, {height}, 0.0]
"""


def test_contents_and_checksums_of_a_bundle(page_folder, page_source, tmp_path):
    path = tmp_path / "b.zip"
    result = CliRunner().invoke(main, ["bundle", "-o", str(path), "--out", str(page_folder)])
    assert result.exit_code == 0, result.output
    assert result.stdout.strip() == str(path)
    with zipfile.ZipFile(path) as archive:
        texts = {name.partition("/")[2]: archive.read(name) for name in archive.namelist()}
    sums = dict(reversed(line.split("  ")) for line in texts.pop("SHA256SUMS").decode().splitlines())
    assert sums == {name: hashlib.sha256(text).hexdigest() for name, text in texts.items()}
    for name in sums.keys() - {"README.txt"}:
        assert name in texts["README.txt"].decode()
    assert len(texts["rows.jsonl"].splitlines()) == len(page_source.rows)
    assert len(texts["observations.jsonl"].splitlines()) == len(page_source.observations)
    environment = json.loads(texts["environment.json"])
    assert environment["run"]["id"] == page_source.run.id
    assert environment["packages_now"]["numpy"]
    assert texts["report.html"].startswith(b"<!doctype html>")
    assert f"run {page_source.run.id}" in texts["CITATION.cff"].decode()


def test_bundle_as_data(page_folder, tmp_path, monkeypatch):
    written = []
    monkeypatch.setattr("reports.bundle.write_bundle", lambda *given: written.append(given) or ["README.txt", "a"])
    result = CliRunner().invoke(main, ["bundle", "-o", str(tmp_path / "b.zip"), "--out", str(page_folder), "--json"])
    assert result.exit_code == 0, result.output
    assert json.loads(result.stdout) == {"path": str(tmp_path / "b.zip"), "files": ["README.txt", "a"]}
    assert written == [(page_folder, "latest", tmp_path / "b.zip")]


def test_scene_files_of_a_bundle(tmp_path):
    pytest.importorskip("pymunk")
    texts = {}
    for place, height in (("a", 2.0), ("b", 3.0)):
        (tmp_path / place).mkdir()
        file = tmp_path / place / "drop it.toml"
        file.write_text(SCENE.format(height=height))
        # A name that climbs: nothing in the archive may lie outside its folder.
        texts[pinned(str(tmp_path / "a" / ".." / place / "drop it.toml"))] = SCENE.format(height=height)
    slots = [Slot(name, (), 2, "chipmunk", "tuned", 1 / 240) for name in texts]
    store = Store(tmp_path / "out")
    run, _ = store.start("quick: files", slots)
    for slot in slots:
        store.add(run, execute(slot))
    store.finish(run)
    store.close()
    for file in tmp_path.glob("*/*.toml"):
        file.write_text("changed since")
    path = tmp_path / "b.zip"
    assert CliRunner().invoke(main, ["bundle", "-o", str(path), "--out", str(tmp_path / "out")]).exit_code == 0
    with zipfile.ZipFile(path) as archive:
        found = {n.partition("/")[2]: archive.read(n).decode() for n in archive.namelist() if "/scenes/" in n}
        readme = archive.read(next(n for n in archive.namelist() if n.endswith("README.txt"))).decode()
    assert found == {f"scenes/{name[-8:]}-drop-it.toml": text for name, text in texts.items()}
    assert all(name in readme for name in found)


def test_the_citation_names_run_and_commit():
    text = citation(Run("20260101-000000", "2026-01-01T00:00:00", "abc123", {}, "t", (), True))
    assert 'commit: "abc123"' in text and "run 20260101-000000" in text
    assert text.startswith("cff-version:")


def made_up(monkeypatch, bench=None, scenes=()):
    """A run of nothing, as a bundle reads it."""
    from reports import bundle

    run = Run("20260101-000000", "2026-01-01T00:00:00", "abc123", {"cpu": "x"}, "quick: all", ("s1", "s2"), True)
    source = SimpleNamespace(run=run, observations=[], rows=[], bench=bench, scenes_kept=dict(scenes))
    asked = []
    monkeypatch.setattr(bundle, "load_source", lambda folder, run: asked.append((folder, run)) or source)
    monkeypatch.setattr(bundle, "render", lambda source: f"<p>{source.run.id}</p>")
    return run, asked


def test_reproducible_list_of_files_in_a_bundle(monkeypatch, tmp_path):
    """Names of scene files are plain, whatever folder they came from."""
    kept = {"/a/b/drop it!.toml@1a2b3c4d": "text", "fall.toml@00000000": "other"}
    run, asked = made_up(monkeypatch, scenes=kept.items())
    first, again = tmp_path / "new" / "a.zip", tmp_path / "b.zip"
    names = write_bundle(tmp_path, "latest", first)
    assert names == [
        "README.txt", "environment.json", "observations.jsonl", "rows.jsonl", "rows.csv", "report.html", "CITATION.cff",
        "scenes/1a2b3c4d-drop-it-.toml", "scenes/00000000-fall.toml", "SHA256SUMS",
    ]  # fmt: skip
    assert write_bundle(tmp_path, "latest", again) == names and first.read_bytes() == again.read_bytes()
    assert asked == [(tmp_path, "latest")] * 2
    with zipfile.ZipFile(first) as archive:
        assert archive.namelist() == [f"contact-crosscheck-20260101-000000/{name}" for name in names]
        assert {entry.compress_type for entry in archive.infolist()} == {zipfile.ZIP_DEFLATED}
        texts = {name.partition("/")[2]: archive.read(name).decode() for name in archive.namelist()}
    assert texts["README.txt"].splitlines() == [
        "contact-crosscheck, run 20260101-000000", "",
        "environment.json     machine, Python, packages, commit and plan of the run (and of the benchmark)",
        "observations.jsonl   raw measurements, one case per line",
        "rows.jsonl           every judged value, one per line",
        "rows.csv             the same as a table", "report.html          the report, one self-contained page",
        "CITATION.cff         how to cite this result", "scenes/1a2b3c4d-drop-it-.toml a scene file that ran",
        "scenes/00000000-fall.toml a scene file that ran", "",
        "Verdicts are derived from observations.jsonl: `crosscheck report` and `crosscheck compare` read the checks.",
        "Check the files with: sha256sum -c SHA256SUMS",
    ]  # fmt: skip
    assert texts["report.html"] == "<p>20260101-000000</p>" and texts["scenes/00000000-fall.toml"] == "other"
    environment = json.loads(texts["environment.json"])
    assert environment.pop("packages_now") and environment == {
        "run": {"id": run.id, "date": run.date, "commit": "abc123", "title": "quick: all", "machine": {"cpu": "x"},
                "finished": True, "slots": ["s1", "s2"]},
    }  # fmt: skip


def test_bench_times_and_protocol_of_a_bundle(monkeypatch, tmp_path):
    from reports import bundle

    other = Run("20260102-000000", "2026-01-02T00:00:00", "", {}, "bench quick: all", (), True)
    made_up(monkeypatch, SimpleNamespace(run=other, protocol={"seed": 7}))
    raw = pd.DataFrame([{"engine": "toy", "seconds": 0.5}, {"engine": "=toy", "seconds": 0.25}])
    closed = []
    store = SimpleNamespace(close=lambda: closed.append(1))
    monkeypatch.setattr(
        bundle, "Store", lambda folder, create: store if (folder, create) == (tmp_path, False) else None
    )
    monkeypatch.setattr(bundle.speed, "raw_of", lambda given, run: raw if (given, run) == (store, other) else None)
    names = write_bundle(tmp_path, "latest", tmp_path / "a.zip")
    assert names[4:7] == ["rows.csv", "timings.csv", "report.html"] and closed == [1]
    with zipfile.ZipFile(tmp_path / "a.zip") as archive:
        texts = {name.partition("/")[2]: archive.read(name).decode() for name in archive.namelist()}
    assert texts["timings.csv"].splitlines() == ["engine,seconds", "toy,0.5", "'=toy,0.25"]  # no formula in a cell
    told = json.loads(texts["environment.json"])["bench"]
    assert told["id"] == "20260102-000000" and told["protocol"] == {"seed": 7}
    assert "timings.csv          raw timings of the benchmark" in texts["README.txt"].splitlines()
    assert "commit" not in bundle.citation(other).partition("identifiers")[0].splitlines()[-1]
