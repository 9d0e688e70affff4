"""What a command is asked for, and what a bench leaves behind."""

import io
import json
from importlib.metadata import EntryPoint
from types import SimpleNamespace

import pandas as pd
import pytest
from click.testing import CliRunner
from rich.console import Console

from adapters.scene import SceneError
from reports import speed, tables
from reports.command import main
from reports.command.selection import scene_names_of
from validation.catalogue import CATALOGUE
from validation.records.store import Store


def test_scenes_of_several_words_combined_without_repeats(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "drop.toml").write_text(
        'name = "drop"\ndimension = 2\ngravity = [0.0, -9.81]\nduration = 0.1\n'
        'bodies = [{ name = "b", shape = { type = "disc", radius = 0.5 }, pose = [0.0, 1.0, 0.0] }]\n'
    )
    assert scene_names_of(["bounce", "imp*", "bounce"]) == ["bounce", "impact"]
    first, last = scene_names_of(["bounce", "drop.toml"])
    assert first == "bounce" and last.startswith("drop.toml@")
    assert scene_names_of([]) == list(CATALOGUE)
    with pytest.raises(SceneError):
        scene_names_of(["no-such-scene"])


def shown(data):
    console = Console(width=200, record=True, file=io.StringIO())
    tables._engine(data, console)
    return console.export_text()


def test_engine_description_with_habits_and_bad_versions():
    data = {
        "name": "toy", "version": "1.2", "title": "Toy", "status": "installed", "package": "toy", "dimensions": [2],
        "customary_dt": 1.0 / 60.0, "scheme": {"order": "velocity first"}, "profiles": {},
        "quirks": [{"what": "sinks", "what_we_do": "nothing", "source": "its manual"}],
        "known_bad_versions": {"1.1": "it forgets contacts"}, "measured": [], "unset": [], "effects": [],
        "settable": [{"name": "sweeps", "must_be": "a whole number from 1 to 9"}],
    }  # fmt: skip
    text = shown(data)
    assert "--set NAME=VALUE" in text and "sweeps" in text and "a whole number from 1 to 9" in text
    assert "When nothing is set" not in text
    assert "toy 1.2: Toy, installed" in text and "velocity first" in text
    assert "version 1.1 is known to be bad: it forgets contacts" in text
    assert all(word in text for word in ("sinks", "nothing", "its manual"))
    missing = {"name": "toy", "version": "", "status": "not installed", "reason": "no wheel", "unset": []}
    assert shown(missing).count("no wheel") == 1


def test_files_of_a_bench(tmp_path):
    store = Store(tmp_path / "results")
    run, _ = store.start("bench", [])
    table = pd.DataFrame([{"scene": "impact", "cost": 2.5e-3, "slot": {"scene": "impact"}}])
    raw = pd.DataFrame([{"seconds": 1.5e-3}])
    paths = speed.write_all(tmp_path, run, {"rounds": 3}, {"work_points": table}, raw)
    store.close()
    assert [path.name for path in paths] == ["bench.json", "raw_timings.csv", "work_points.csv"]
    assert all(path.parent == tmp_path / "bench" for path in paths)
    assert isinstance(json.loads(paths[0].read_text()), dict)
    assert pd.read_csv(paths[2]).to_dict("records") == [{"scene": "impact", "cost": 2.5e-3}]
    assert pd.read_csv(paths[1]).to_dict("records") == [{"seconds": 1.5e-3}]


@pytest.mark.parametrize("as_json", [False, True])
def test_description_of_a_missing_engine(monkeypatch, as_json):
    from reports import listing

    found = SimpleNamespace(version="", engine=None, reason="no module named toy; pip install toy")
    monkeypatch.setattr(listing.registry, "entry", lambda name: EntryPoint("toy", "toy:Engine", listing.registry.GROUP))
    monkeypatch.setattr(listing.registry, "listed", lambda name: found)
    done = CliRunner().invoke(main, ["describe", "toy", *["--json"] * as_json])
    assert done.exit_code == 0, done.output
    if as_json:
        assert json.loads(done.stdout) == {
            "kind": "engine", "name": "toy", "version": "", "status": "not installed", "reason": found.reason,
            "unset": [],
        }  # fmt: skip
    else:
        assert [line.strip() for line in done.stdout.splitlines()] == ["toy , not installed", found.reason]
