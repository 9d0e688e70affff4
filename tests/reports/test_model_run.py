"""`crosscheck run model.xml`: a model people have, on every engine, as a user calls it."""

import json
import os
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from adapters.engine import Contacts
from adapters.scene import Body, Disc, HalfSpace, Scene
from adapters.trajectory import ContactRecord, Trajectory
from reports.command import main
from reports.spread import spread_lines
from reports.wording import row_id
from validation import posed
from validation.cells import Observation, Outcome, Slot
from validation.files.model_files import _momentum_check, canonical_from_text, momentum_drift
from validation.judging.rows import Row, predictions_of, rows_of
from validation.judging.verdicts import Physics, judge_physics
from validation.questions.spread import spreads
from validation.records.store import Store
from validation.running.tracks import Recording

pytest.importorskip("mujoco")
MODELS = Path(__file__).parents[1] / "models"


def call(*words, status=(0, 1)):
    done = CliRunner().invoke(main, list(map(str, words)))
    assert done.exit_code in status, done.output + repr(done.exception)
    return done


@pytest.fixture(scope="module")
def ran(tmp_path_factory):
    """One run of a model of a ball on the floor, on MuJoCo and Chipmunk."""
    pytest.importorskip("pymunk")
    out = tmp_path_factory.mktemp("out")
    path = tmp_path_factory.mktemp("models") / "ball.xml"
    path.write_text((MODELS / "ball_on_floor.xml").read_text())
    done = call("run", path, "--param", "duration=0.5", "--engine", "mujoco", "--engine", "chipmunk", "--jobs", 1,
                "--out", out, "--json")  # fmt: skip
    path.unlink()  # what was run is kept with the results
    return out, json.loads(done.stdout), done.stderr


def test_model_run_on_its_own_engine_and_rigid_elsewhere(ran):
    _, rows, said = ran
    kinds = {(row["engine"], row["profile"], row["dimension"], row["dt"]) for row in rows}
    assert {("mujoco", "model", 3, 0.002), ("mujoco", "model", 2, 0.002), ("mujoco", "default", 3, 1 / 240),
            ("chipmunk", "tuned", 2, 1 / 240)} <= kinds  # fmt: skip
    assert "mujoco/model runs it with the model's own contacts" in said and "restitution 0" in said
    assert {row["metric"] for row in rows} >= {"energy_growth", "penetration", "momentum_drift", "final[ball.vx]"}
    planar = [row for row in rows if (row["engine"], row["metric"]) == ("chipmunk", "energy_growth")]
    assert {row["physics"] for row in planar if row["dimension"] == 2} == {"pass"}


def test_failure_of_an_own_model_is_no_alarm(tmp_path):
    """A column that bears the name of a scene of ours: the law of MuJoCo that explains that is its cause, no excuse."""
    path = tmp_path / "own.xml"
    path.write_text((MODELS / "column_of_ten.xml").read_text().replace("column of ten", "stack"))
    assert 'model="stack"' in path.read_text()
    words = ("run", path, "--engine", "mujoco", "--profile", "default", "--dim", 3, "--param", "duration=0.5",
             "--jobs", 1)  # fmt: skip
    done = call(*words, "--out", tmp_path, status=(0,))
    assert re.search(r"default 3-D \(as shipped\) +1(/| of )2 fail", done.stdout) and "overlaps by" in done.stdout
    assert "Needs attention" not in done.stdout
    assert "failures of a model do not fail the command, as no known failures are listed for it" in done.stderr
    rows = json.loads(call(*words, "--out", tmp_path / "again", "--json", status=(0,)).stdout)
    (row,) = [row for row in rows if row["physics"] == "fail"]
    assert (row["metric"], row["standing"]) == ("penetration", None)
    assert row["reason"].startswith("contact is a soft spring (0.02 s)")
    assert predictions_of(Row(**row)) == []
    assert "contact is a soft spring" in call("explain", row_id(row), "--out", tmp_path, status=(0,)).stdout


@pytest.mark.parametrize(
    ("engine", "profile"), [("bullet", "tuned"), ("reference", "classical"), ("reference", "reference")]
)
def test_failure_of_a_model(engine, profile):
    name = posed.pinned(str(MODELS / "ball_on_floor.xml"))
    slot = Slot(name, (), 3, engine, profile, 1 / 240, None)
    found = {"energy_growth": (0.0, ""), "penetration": (1.0, "")}
    rows = {row.metric: row for row in rows_of("run", [Observation(slot, "c", 1, "1.0", Outcome.OK, "", found)])}
    row = rows["penetration"]
    assert (row.physics, row.standing, row.alarming) == ("fail", None, False)
    assert row.reason.endswith("not listed: your own model")


def test_results_without_their_file_and_engine(ran, monkeypatch):
    out, rows, _ = ran
    monkeypatch.setattr(posed, "_texts", {})
    posed.resolve.cache_clear()
    monkeypatch.setattr("adapters.model.read", lambda *_: pytest.fail("a reader of results compiles nothing"))
    assert rows[0]["scene"] in call("show", "--out", out).output
    store = Store(out, create=False)
    assert "ball.xml@" in store.run().title
    store.close()


def test_model_command_with_cell_count_and_chosen_profile(tmp_path):
    words = ("run", MODELS / "ball_on_floor.xml", "--engine", "mujoco", "--dry-run", "--out", tmp_path)
    assert call(*words).stdout == "8 cases\n"  # three profiles and the model's own, in the plane and in space
    assert call(*words, "--profile", "model").stdout == "2 cases\n"
    assert call(*words, "--profile", "model", "--dt", "1/240", "--dt", "1/480").stdout == "4 cases\n"
    assert "no chosen engine has a profile 'mine'" in call(*words, "--profile", "mine", status=(2,)).output


def test_a_robot_in_urdf_runs_as_well(tmp_path):
    words = (
        "run",
        MODELS / "cube_on_table.urdf",
        "--engine",
        "mujoco",
        "--profile",
        "model",
        "--param",
        "duration=0.3",
    )
    done = call(*words, "--jobs", 1, "--out", tmp_path, "--json", status=(0, 1))
    rows = json.loads(done.stdout)
    assert {row["dimension"] for row in rows} == {2, 3} and {row["outcome"] for row in rows} == {"ok"}
    assert "friction 1 in all pairs" in done.stderr
    arm = call("run", MODELS / "refused_arm.urdf", "--engine", "mujoco", "--out", tmp_path / "no", status=(2,))
    assert "line 3: <joint> 'shoulder': a revolute joint" in arm.output and len(arm.output.splitlines()) == 1


#: Endings of the models, and what must be installed to read them.
LANGUAGES = {".xml": "mujoco", ".urdf": "mujoco", ".sdf": "pydrake", ".world": "pydrake"}


def _said_of_models():
    """Rows of the two tables of `tests/models/README.md`, by model."""
    text = (MODELS / "README.md").read_text()
    rows = [
        [cell.strip(" `") for cell in line.split("|")[1:-1]] for line in text.splitlines() if line.startswith("| `")
    ]
    return {name: cells for name, *cells in rows}


def test_table_of_models_and_twenty_on_three_engines():
    said = _said_of_models()
    assert set(said) == {path.name for path in MODELS.iterdir() if path.suffix in LANGUAGES} and len(said) >= 30
    everywhere = [name for name, cells in said.items() if len(cells) == 4
                  and all(cell in ("2-D", "3-D", "2-D and 3-D") for cell in cells)]  # fmt: skip
    assert len(everywhere) >= 20


@pytest.mark.skipif(not os.environ.get("CROSSCHECK_SOAK"), reason="half a minute a model; CROSSCHECK_SOAK=1")
@pytest.mark.parametrize("name", sorted(path.name for path in MODELS.iterdir() if path.suffix in LANGUAGES))
def test_a_model_runs_as_the_table_says(name, tmp_path):
    for package in ("pymunk", "pybullet", LANGUAGES[Path(name).suffix]):
        pytest.importorskip(package)
    engines = ("reference", "bullet", "mujoco", "chipmunk")
    words = [word for engine in engines for word in ("--engine", engine)]
    cells = _said_of_models()[name]
    refused = len(cells) == 1
    done = call("run", MODELS / name, *words, "--profile", "default", "--profile", "reference", "--jobs", 1, "--out",
                tmp_path, "--json", status=(2,) if refused else (0, 1))  # fmt: skip
    if refused:
        assert done.output.strip().endswith(cells[0]) and len(done.output.splitlines()) == 1
        return
    rows = json.loads(done.stdout)
    for engine, cell in zip(engines, cells, strict=True):
        ran = [row for row in rows if row["engine"] == engine and row["outcome"] != "unsupported"]
        bad = {row["dimension"] for row in ran if row["outcome"] != "ok"}
        assert {row["outcome"] for row in ran} <= {"ok", "refused"}
        assert " and ".join(f"{d}-D" for d in sorted({row["dimension"] for row in ran} - bad)) == (
            "" if cell == "not planar" or cell.startswith("-") else cell.partition(";")[0]
        )
        assert bool(bad) == ("certificate refuses it" in cell)


def test_unplaceable_elements_refused_by_name_or_dropped(tmp_path):
    words = ("run", MODELS / "refused_hinge.xml", "--engine", "mujoco", "--profile", "model", "--out", tmp_path)
    refused = call(*words, status=(2,))
    assert "line 4: <body> 'door': a hinge joint" in refused.output and len(refused.output.splitlines()) == 1
    assert not list(tmp_path.iterdir())
    left = call(*words, "--drop", "--jobs", 1, "--param", "duration=0.1")
    assert "line 4: <body> 'door': a hinge joint holds it; bodies of a scene are free or fixed: left out" in left.stderr


def test_model_name_with_the_hash_of_left_out_elements(monkeypatch):
    """Printed commands have such names: a command without --drop must find the same scene."""
    from adapters.scene import SceneError

    path = str(MODELS / "refused_hinge.xml")
    monkeypatch.setattr(posed, "_texts", {})
    name = posed.pinned(path, drop=True)
    posed._texts.clear()  # as in another process
    assert posed.pinned(name) == name
    with pytest.raises(SceneError, match="--drop leaves it out"):
        posed.pinned(path)
    with pytest.raises(SceneError, match="has changed since"):
        posed.pinned(f"{path}@00000000")


def test_exported_model_read_back_as_the_same_scene(tmp_path):
    pytest.importorskip("pymunk")
    path = tmp_path / "column.xml"
    call("export", "stack", "--param", "n=3", "--engine", "mujoco", "--to", "mjcf", "-o", path)
    name = posed.pinned(str(path))
    back, scene = posed.resolve(name).scene(3), posed.resolve("stack").scene(3, {"n": 3})
    moved = [body for body in scene.bodies if body.motion == "free"]
    found = [body for body in back.bodies if body.motion == "free"]
    assert np.array([b.pose for b in found]) == pytest.approx(np.array([b.pose for b in moved]))
    assert [(b.mass, b.inertia, b.shape) for b in found] == [(b.mass, b.inertia, b.shape) for b in moved]


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"engine": "mujoco"}', "[" * 5000, '{"engine": 1, "scene": 2}'])
def test_damaged_kept_model_in_one_line(text):
    from adapters.scene import SceneError

    with pytest.raises(SceneError) as refused:
        canonical_from_text(text, Path("a.xml"))
    assert "\n" not in str(refused.value)


def falling(kick=0.0, impulse=None, n=21, dt=0.05):
    """A disc of 2 kg that falls for a second; ``kick`` [m/s] comes from nowhere at the end."""
    floor = Body("floor", HalfSpace((0.0, 1.0)), motion="fixed")
    ball = Body("ball", Disc(0.1), 2.0, 0.01, (0.0, 9.0, 0.0))
    bodies = (ball,) if impulse is None else (floor, ball)
    scene = Scene("fall", 1, 2, bodies, (), (0.0, -10.0), 1.0)
    t = np.arange(n) * dt
    twist = np.zeros((n, len(bodies), 3))
    twist[:, -1, 1] = -10.0 * t
    twist[-1, -1, 1] += kick
    rows = Contacts.from_rows([(0, 1, (0, 0), (0, 1), impulse, 0.0)] if impulse else [], 2)
    record = ContactRecord(np.array([n - 1]), np.array([0, len(rows.a)]), rows) if impulse else None
    pose = np.zeros((n, len(bodies), 3))
    return scene, Trajectory(t, pose, twist, record, dt, "completed")


def test_momentum_without_a_source_detected():
    assert momentum_drift(*falling())[0] == pytest.approx(0.0, abs=1e-12)
    assert momentum_drift(*falling(kick=0.01))[0] == pytest.approx(0.02)


@pytest.mark.parametrize(("dt", "thousands"), [(0.05, 1.0), (1 / 1000, 1.0), (1 / 4000, 4.0)])
def test_momentum_of_free_bodies_judged_to_round_off(dt, thousands):
    """2 kg at 5 m/s and 3 kg at rest have 10 N s; 20 N, and 30 N less a force of 10 N, give them 40 N s in a second.

    Momenta are sums of a thousand steps' roundings each: 1e-12 of them (`validation.bounds.ROUND_OFF`).
    """
    scene, falls = falling()
    thrown = replace(scene.bodies[0], twist=(3.0, 4.0, 0.0))
    held = Body("held", Disc(0.1), 3.0, 0.01, (5.0, 9.0, 0.0), force=(0.0, 10.0))
    check = _momentum_check(replace(scene, bodies=(thrown, held)), dt)
    assert (check.metric, check.unit, check.truth) == ("momentum_drift", "N s", 0.0)
    assert check.bound == pytest.approx(1e-12 * thousands * (10.0 + 40.0)) and "round-off" in check.because
    drift = momentum_drift(scene, falls)[0]
    assert judge_physics(drift, _momentum_check(scene, falls.dt)) is Physics.PASS
    assert judge_physics(momentum_drift(*falling(kick=1e-9))[0], _momentum_check(scene, falls.dt)) is Physics.FAIL


def test_momentum_beside_a_fixed_body_shown_and_not_judged():
    check = _momentum_check(falling(impulse=(0.0, 1.0))[0], 0.05)
    assert (check.metric, check.unit, check.truth, check.bound) == ("momentum_drift", "N s", None, None)
    assert check.because.startswith("shown")


def test_momentum_of_a_fixed_body():
    assert momentum_drift(*falling(kick=0.5, impulse=(0.0, 1.0)))[0] == pytest.approx(0.0, abs=1e-12)
    assert momentum_drift(*falling(kick=0.5, impulse=(0.0, 0.9)))[0] == pytest.approx(0.1)
    assert momentum_drift(*falling(kick=0.5, impulse=(0.0, float("nan"))))[0] is None
    scene, lost = falling(impulse=(0.0, 1.0))
    assert momentum_drift(scene, Trajectory(lost.t, lost.pose, lost.twist, None, lost.dt, "completed"))[0] is None


def track(x):
    t = np.linspace(0.0, 1.0, 61)
    pose = np.zeros((61, 2, 3))
    pose[:, 1, 0] = x * t
    empty = np.zeros(0, np.int64)
    return Recording(t, pose, empty, np.zeros((0, 2), np.int64), np.zeros((0, 2)), np.zeros((0, 2)), None, "completed")


def test_spread_at_the_horizon_of_the_certified_run():
    def cell(engine, profile, certificate):
        slot = Slot("impact", (), 2, engine, profile, 1 / 240)
        return Observation(slot, "", 1, "1", Outcome.OK, certificate=certificate)

    ours = cell("reference", "reference", {"certified": True, "full": {"horizon": 0.5}})
    other = cell("toy", "default", {})
    kept = [(ours.slot, track(1.0)), (other.slot, track(1.2))]
    (found,) = spreads([ours, other], kept)
    assert found.time == 0.5 and found.distance == pytest.approx(0.1) and found.certified and found.engine == "toy"
    lines = list(spread_lines([found]))
    assert lines[1] == "How far from our own solution: impact 2-D, after 0.5 s" and "toy/default" in lines[2]
    endless = cell("reference", "reference", {"certified": False, "full": {"horizon": None}})
    (whole,) = spreads([endless, other], kept)
    assert whole.time == 1.0 and whole.distance == pytest.approx(0.2)
    assert "not certified" in list(spread_lines([whole]))[1]
    assert spreads([other], kept[1:]) == []


def test_momentum_with_either_body_fixed():
    scene, found = falling(kick=0.5, impulse=(0.0, 1.0))
    rows = found.contacts.rows
    # The floor is listed last: the impulse on it is what the ball loses.
    turned = Contacts.from_rows([(0, 1, (0, 0), (0, -1), (0.0, -1.0), 0.0)], 2)
    record = ContactRecord(found.contacts.step, found.contacts.offset, turned)
    last = replace(found, pose=found.pose[:, ::-1], twist=found.twist[:, ::-1], contacts=record)
    assert momentum_drift(replace(scene, bodies=scene.bodies[::-1]), last)[0] == pytest.approx(0.0, abs=1e-12)
    # Two balls that push each other apart keep what both have, whatever is reported of it.
    other = replace(scene.bodies[1], name="other", pose=(5.0, 9.0, 0.0))
    both = replace(scene, bodies=(*scene.bodies, other))
    twist = np.concatenate([found.twist, found.twist[:, 1:]], axis=1)
    twist[:, 1:] -= [[[0.0, 0.5, 0.0]]] * (np.arange(len(twist)) == len(twist) - 1)[:, None, None]
    pair = Contacts.from_rows([(1, 2, (0, 0), (1, 0), (3.0, 0.0), 0.0)], 2)
    pushed = replace(found, pose=np.zeros_like(twist), twist=twist, contacts=replace(found.contacts, rows=pair))
    assert rows.a[0] == 0 and momentum_drift(both, pushed)[0] == pytest.approx(0.0, abs=1e-12)
