"""The bundle: everything about a run in one archive whose checksums hold."""

import hashlib
import json
import zipfile

import pytest
from click.testing import CliRunner

from reports.bundle import citation
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


def test_the_bundle_holds_what_it_lists_and_its_checksums_hold(page_folder, page_source, tmp_path):
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


def test_scene_files_that_ran_are_in_the_bundle_as_they_were(tmp_path):
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
