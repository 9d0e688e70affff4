"""``bench`` on a user's own file: error is the distance from the certified run, and a line says where there is none."""

import json
from dataclasses import replace
from pathlib import Path

import pytest
from click.testing import CliRunner

import contact_crosscheck as cc
from adapters.scene import SceneError
from contact_crosscheck import studies
from reports.command import benching, main
from validation.bench.lane import QUICK

MODELS = Path(__file__).parents[1] / "models"
FLIGHT = """
name = "thrown ball"
dimension = {dimension}
gravity = {gravity}
duration = 0.5
[[bodies]]
name = "ball"
shape = {{ type = "{shape}", radius = 0.1 }}
mass = 1.0
pose = {pose}
twist = {twist}
"""
PLANE = {"dimension": 2, "gravity": [0.0, -9.81], "shape": "disc", "pose": [0, 5, 0], "twist": [1, 0, 0]}
SPACE = {
    "dimension": 3,
    "gravity": [0, 0, -9.81],
    "shape": "sphere",
    "pose": [0, 0, 5, 1, 0, 0, 0],
    "twist": [1] + [0] * 5,
}
#: Deeper in the floor than our solver begins with.
SUNK = FLIGHT.format(**{**PLANE, "pose": [0, 0.05, 0]}) + """
[[bodies]]
name = "floor"
shape = { type = "half_space", normal = [0, 1] }
motion = "fixed"
"""  # fmt: skip


@pytest.fixture(autouse=True)
def short(monkeypatch):
    """Three rounds of timings: what is asked here is whether there are any."""
    for module in (benching, studies):
        monkeypatch.setattr(module, "QUICK", replace(QUICK, fewest=3, most=3, unit_seconds=0.01, lane_seconds=1.0))


def bench(path, out, *words, status=0):
    done = CliRunner().invoke(main, ["bench", str(path), *words, "--jobs", "1", "--json", "--out", str(out)])
    assert done.exit_code == status, done.output + repr(done.exception)
    return done


@pytest.mark.long
@pytest.mark.parametrize(("scene", "engine"), [(PLANE, "chipmunk"), (SPACE, "mujoco")])
def test_error_left_by_the_scheme_of_an_engine(tmp_path, scene, engine):
    """Semi-implicit Euler falls short of g t^2 / 2 by g dt t / 2; our own solver flies exactly."""
    pytest.importorskip({"chipmunk": "pymunk"}.get(engine, engine))
    path = tmp_path / "ball.toml"
    path.write_text(FLIGHT.format(**scene))
    steps = ["--dt", "1/60", "--dt", "1/240"]
    done = bench(path, tmp_path / "out", "--engine", engine, "--engine", "reference", *steps)
    points = json.loads(done.stdout)["work_points"]
    shipped = {p["dt"]: p["error"] for p in points if (p["engine"], p["profile"]) == (engine, "default")}
    assert shipped == pytest.approx({dt: 9.81 * dt * 0.5 / 2 for dt in (1 / 60, 1 / 240)}, rel=1e-9)
    # The run that others are measured from, at 1/480 s, is no point; ours at other steps are.
    ours = [p for p in points if p["profile"] == "reference"]
    assert [p["dt"] for p in ours] == [1 / 60, 1 / 240]
    assert max(p["error"] for p in ours) < 1e-13  # 5 m in doubles, to a few units in the last place
    assert {(p["error_name"], p["unit"]) for p in points} == {("distance from the certified run", "m")}
    assert all(p["cost"] > 0.0 and not p["reason"] for p in points)


@pytest.mark.long
def test_times_of_a_model_on_its_own_engine(tmp_path):
    pytest.importorskip("mujoco")
    words = ["--engine", "mujoco", "--dim", "3", "--dt", "1/240", "--param", "duration=0.1"]
    done = bench(MODELS / "ball_dropped.xml", tmp_path, *words)
    points = json.loads(done.stdout)["work_points"]
    assert {p["profile"] for p in points} == {"default", "tuned", "model"}
    assert all(p["error"] >= 0.0 and p["cost"] > 0.0 for p in points)  # the lane reads no model of its own


@pytest.mark.long
def test_reason_without_a_certified_run(tmp_path):
    pytest.importorskip("pymunk")
    path = tmp_path / "sunk.toml"
    path.write_text(SUNK)
    done = bench(path, tmp_path / "out", "--engine", "chipmunk", "--dt", "1/240", status=4)
    said = [line for line in done.stderr.splitlines() if "no certified run" in line]
    assert len(said) == 1 and "sunk.toml@" in said[0] and "2-D: no certified run to measure from: " in said[0]
    assert "overlap" in said[0] and done.stdout == ""


def test_the_certified_run_is_counted_among_the_cases(tmp_path):
    pytest.importorskip("pymunk")
    path = tmp_path / "ball.toml"
    path.write_text(FLIGHT.format(**PLANE))
    words = ["bench", str(path), "--engine", "chipmunk", "--profile", "tuned", "--dt", "1/60", "--dry-run"]
    assert CliRunner().invoke(main, words).stdout == "2 cases\n"


@pytest.mark.long
def test_python_benches_a_scene_of_ones_own(tmp_path):
    pytest.importorskip("pymunk")
    path = tmp_path / "ball.toml"
    path.write_text(FLIGHT.format(**PLANE))
    found = cc.bench(cc.Scene.from_file(path), engines="chipmunk", dts=["1/60"], jobs=1)
    frame = found.frame()
    assert list(frame["error"]) == pytest.approx(2 * [9.81 / 60 * 0.5 / 2], rel=1e-9) and (frame["cost"] > 0.0).all()
    assert found.plot() is not None
    path.write_text(SUNK)
    with pytest.raises(SceneError, match=r"bench: no certified run to measure from: .*overlap"):
        cc.bench(path, engines="chipmunk", dts=["1/60"], jobs=1)
