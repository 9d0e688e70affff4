"""A scene, an engine, findings and a stored run made by an earlier CONTRIBUTING: all of it loads and runs unchanged."""

import gzip
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
MADE = ROOT / "tests" / "data" / "made_before"
#: File of a folder of installed packages -> the file here.
SITE = {
    "crosscheck_lossy/__init__.py": "adapter.py.txt", "crosscheck_lossy/laws.py": "laws.py.txt",
    "crosscheck_lossy/findings/families.toml": "families.toml", "crosscheck_lossy/findings/members.csv": "members.csv",
    "mypackage/drop.py": "drop.py.txt",
}  # fmt: skip
ENTRIES = {
    ("crosscheck_lossy", "0.1"): "[contact_crosscheck.engines]\nlossy = crosscheck_lossy:Lossy\n",
    ("mypackage", "1"): "[contact_crosscheck.scenes]\ndrop = mypackage.drop:SCENE\n",
}


@pytest.fixture(scope="module")
def call(tmp_path_factory):
    """`call(words, ...)`: what a command says where these packages are installed, and the run stored in `before`."""
    folder = tmp_path_factory.mktemp("made")
    for name, kept in SITE.items():
        (folder / "site" / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / "site" / name).write_bytes((MADE / kept).read_bytes())
    for (name, version), entries in ENTRIES.items():
        info = folder / "site" / f"{name}-{version}.dist-info"
        info.mkdir()
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n")
        (info / "entry_points.txt").write_text(entries)
    (folder / "before").mkdir()
    (folder / "before" / "results.sqlite").write_bytes(gzip.decompress((MADE / "results.sqlite.gz").read_bytes()))
    (folder / "my-scene.toml").write_bytes((MADE / "my-scene.toml").read_bytes())
    path = os.pathsep.join([str(ROOT), str(folder / "site")])

    def call(*words):
        done = subprocess.run(
            [sys.executable, "-m", "reports.command", *words], cwd=folder, capture_output=True, text=True, timeout=300,
            env={**os.environ, "PYTHONPATH": path, "PYTHONDONTWRITEBYTECODE": "1"},
        )  # fmt: skip
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    return call


@pytest.mark.long
def test_stored_run_shown_with_law_and_finding(call):
    # Checks that scenes of ours have got since are no findings: the run has no value of them.
    found = json.loads(call("findings", "--all", "--json", "--out", "before"))
    standings = {(row["scene"], row["standing"]) for row in found}
    assert standings == {("bounce", "explained"), ("bounce", "known")}
    assert {row["reason"] for row in found if row["standing"] == "known"} == {
        "a tenth of every rebound is lost, so that the ball comes to rest too early"
    }
    shown = call("show", "--out", "before")
    assert "newer than this run" in shown
    assert all(name in shown for name in ("drop", "bounce", "my-scene.toml", "lossy 0.1"))


@pytest.mark.long
def test_old_scene_engine_and_findings_with_unchanged_values(call):
    call("run", "bounce", "drop", "my-scene.toml", "--engine", "lossy", "--dim", "2", "--jobs", "1", "--out", "now")
    changes = json.loads(call("compare", "before", "now", "--out", "now", "--json"))["changes"]
    assert {each["kind"] for each in changes} == {"only in B"}  # checks of ours that are newer
    assert "where it lands" in call("describe", "drop") and "lossy" in call("list", "engines")
