"""``import contact_crosscheck as cc``: the same bits and verdicts as the command, errors of one line, two notebooks."""

import dataclasses
import os
import re
import subprocess
import sys
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner

import contact_crosscheck as cc
from adapters import registry
from adapters.conformance.toy import ToyEngine
from adapters.engine import EngineError, EngineFacts, Scheme
from adapters.extras import install
from adapters.scene import SceneError
from contact_crosscheck import cases
from reports.command import main
from validation import catalogue
from validation.catalogue import CATALOGUE
from validation.records.store import MissingError

ROOT = Path(__file__).parents[1]
MODELS = Path(__file__).parent / "models"
FREE_BALL = """
name = "drop"
dimension = 2
gravity = [0.0, -9.81]
duration = 0.2

[[bodies]]
name = "NAME"
shape = { type = "disc", radius = 0.1 }
mass = 1.0
pose = [0.0, 1.0, 0.0]
"""


@pytest.fixture
def own(monkeypatch):
    """Engines that a test introduces are gone after it."""
    monkeypatch.setattr(registry, "_introduced", {})
    monkeypatch.setattr(cases, "_told", set())
    monkeypatch.setattr(catalogue, "_introduced", {})
    yield
    registry.forget()


@pytest.fixture
def engine():
    """`engine(name)` is that name; the test is skipped where the engine is not installed."""

    def named(name):
        if registry.find(name).engine is None:
            pytest.skip(f"{name} is not installed")
        return name

    return named


def called(folder, code, *options, status=0):
    """Run a script without a guard of its main module, as a user would; returns what it printed."""
    (folder / "script.py").write_text(code)
    env = os.environ | {"PYTHONPATH": str(ROOT)}
    command = [sys.executable, *options, "script.py"]
    done = subprocess.run(command, cwd=folder, env=env, capture_output=True, text=True, timeout=540)
    assert done.returncode == status, done.stdout + done.stderr
    return done.stdout, done.stderr


def drawn(chart):
    """Records of the data of a chart, of its first layer where it has layers of their own."""
    whole = chart.to_dict()
    part = whole if "data" in whole else whole["layer"][0]
    return whole["datasets"][part["data"]["name"]]


# ---- one case --------------------------------------------------------------------------------------------------------


@pytest.mark.few(2)
@pytest.mark.parametrize(
    ("name", "profile", "scene", "dimension", "params"),
    [
        ("chipmunk", "tuned", "bounce", 2, {"e": 0.7}),
        ("mujoco", "default", "bounce", 3, {"e": 0.7, "height": 2.0}),
        ("bullet", "tuned", "stack", 3, {"n": 3}),
        ("reference", "exact", "impact", 2, {"e": 0.6}),
    ],
)
def test_bits_and_verdicts_of_a_case_in_python(tmp_path, engine, name, profile, scene, dimension, params):
    stored_profile = {"exact": registry.profile_of(name, "solution")}.get(profile, profile)
    words = [word for key, value in params.items() for word in ("--param", f"{key}={value}")]
    words += ["--engine", engine(name), "--profile", stored_profile, "--dim", str(dimension), "--dt", "1/240"]
    result = CliRunner().invoke(main, ["run", scene, *words, "--jobs", "1", "--out", str(tmp_path)])
    assert result.exit_code in (0, 1), result.output
    stored = cc.load(tmp_path)
    here = cc.run(scene, engine=name, profile=profile, dimension=dimension, **params).frame()
    assert len(here) > 1
    passing = ["run", "wall_time_s"]
    pd.testing.assert_frame_equal(here.drop(columns=passing), stored.drop(columns=passing), check_exact=True)
    assert set(here.state_hash) == set(stored.state_hash) != {""}
    assert here.attrs["versions"] == stored.attrs["versions"] == {name: registry.find(name).version}
    assert stored.attrs["run"] == stored.run[0] and here.attrs["commit"] == stored.attrs["commit"]


def test_a_result_has_its_motion_its_table_and_its_explanation(engine):
    result = cc.run("bounce", engine=engine("mujoco"), e=0.7, dimension=3)
    motion = result.trajectory
    assert motion.state_hash() == result.observation.state_hash
    assert motion.pose.shape == (len(motion.t), len(result.bodies), 7) and motion.contacts.rows.gap.size
    samples, contacts = (
        f"{len(motion.t)} samples until {motion.t[-1]:.6g} s",
        f"{motion.contacts.rows.gap.size} contacts",
    )
    assert repr(motion) == f"<completed: 2 bodies in 3-D, {samples}, {contacts}>"
    assert repr(replace(motion, contacts=None)).endswith(", contacts not recorded>"), "a cell of a notebook shows it"
    rows = result.frame()
    html = result._repr_html_()
    assert html.count("<tr") == 1 + len(rows) and "<table" in html and "FAIL" in html
    text = result.explain()
    assert "profile tuned passes this check" in text and "solref" in text
    assert "crosscheck run bounce" in text and "force_in_flight" in result.explain("force_in_flight")
    assert repr(result) == "<bounce 3-D on mujoco/default, dt 1/240 s, e=0.7: 6 of 8 checks fail>"


def test_profiles_by_name_or_role_and_steps_as_fractions(engine):
    name = engine("chipmunk")
    shipped, tuned = registry.profile_of(name, "shipped"), registry.profile_of(name, "tuned")
    asked = {None: shipped, "as shipped": shipped, "tuned": tuned, shipped: shipped}
    for given, meant in asked.items():
        assert cc.run("impact", engine=name, profile=given).observation.slot.profile == meant
    slots = {cc.run("impact", engine=name, dt=dt).observation.slot for dt in (1 / 120, "1/120", np.float64(1 / 120))}
    assert len(slots) == 1
    assert cc.run("impact", engine=name, e=np.float64(0.5), v=3).observation.slot.params == (("e", 0.5), ("v", 3.0))


def test_exact_solver_by_default_and_planar_engine_in_the_plane(engine):
    result = cc.run("impact", engine="reference")
    assert result.observation.slot.profile == registry.profile_of("reference", "solution")
    assert cc.run("impact", engine=engine("chipmunk")).observation.slot.dimension == 2
    assert cc.run("impact", engine=engine("mujoco")).observation.slot.dimension == 3


def test_settings_of_a_user_s_own_name_the_profile(engine):
    result = cc.run("impact", engine=engine("mujoco"), settings={"cone": "elliptic"})
    assert result.observation.slot.profile == "default+cone=elliptic"


WRONG = [
    (SceneError, "scene: there is no scene called 'bonce', did you mean 'bounce'?", {"scene": "bonce"}),
    (SceneError, "scene: 'bounc*' means bounce; name one", {"scene": "bounc*"}),
    (SceneError, "scene: an int was given", {"scene": 3}),
    (SceneError, "scene: cannot read nowhere.toml", {"scene": "nowhere.toml"}),
    (EngineError, "engine: there is no engine called 'chipmonk', did you mean 'chipmunk'?", {"engine": "chipmonk"}),
    (EngineError, "engine: an int was given", {"engine": 3}),
    (EngineError, "engine: cannot be made: TypeError: int is not", {"engine": int}),
    (EngineError, "profile: chipmunk has no profile 'tund', only", {"profile": "tund"}),
    (EngineError, "profile: chipmunk has no profile '3', only", {"profile": 3}),
    (SceneError, "bounce.E: there is no such parameter", {"E": 0.5}),
    (SceneError, "bounce.e: 7 must lie in [0, 1]", {"e": 7}),
    (SceneError, "e: 'x' is not a number", {"e": "x"}),
    (SceneError, "e: True is not a number", {"e": True}),
    (SceneError, "e: [0.5] is not a number", {"e": [0.5]}),
    (SceneError, "bounce.e: nan is not a finite number", {"e": float("nan")}),
    (SceneError, "e: the number is too large", {"e": 10**400}),
    (SceneError, "dt: 0 must be a positive, finite number", {"dt": 0}),
    (SceneError, "dt: 'True' is not a number of seconds", {"dt": True}),
    (SceneError, "dt: 1/1 s is longer than 0.1 s", {"dt": 1}),
    (SceneError, "bounce.dimension: 4 is not one of", {"dimension": 4}),
    (SceneError, "dimension: '3' must be 2 or 3", {"dimension": "3"}),
    (SceneError, "iterations: 0 must be a whole number", {"iterations": 0}),
    (EngineError, "settings: an int was given", {"settings": 3}),
    (EngineError, "set: chipmunk has no setting 'nope'", {"settings": {"nope": 3}}),
]


@pytest.mark.parametrize(("error", "said", "given"), WRONG)
def test_line_of_a_wrong_call(error, said, given):
    call = {"scene": "bounce", "engine": "chipmunk"} | given
    with pytest.raises(error) as caught:
        assert error in (cc.SceneError, cc.EngineError)
        cc.run(call.pop("scene"), **call)
    assert str(caught.value).startswith(said) and "\n" not in str(caught.value)


def test_missing_attribute_of_a_result_named(engine):
    result = cc.run("impact", engine=engine("chipmunk"))
    with pytest.raises(SceneError, match="metric: there is no 'nope', only"):
        result.explain("nope")
    with pytest.raises(SceneError, match="plot: there is no 'w', only checks, x, y, angle, vx, vy, speed"):
        result.plot("w")
    with pytest.raises(MissingError, match="out: there are no results"):
        cc.load("/nowhere")
    with pytest.raises(AttributeError, match="has no attribute 'nope'"):
        cc.nope  # noqa: B018
    hooks = ["pytest_addoption", "pytest_configure"]
    assert dir(cc) == sorted([*cc.__all__, *hooks, "__version__"]) and cc.__version__[0].isdigit()
    assert issubclass(MissingError, cc.StoreError)


# ---- charts ----------------------------------------------------------------------------------------------------------


def test_charts_show_the_checks_and_the_motion(tmp_path, engine):
    pytest.importorskip("altair")
    result = cc.run("bounce", engine=engine("chipmunk"), e=0.5)
    parts = {of: [row["value"] for row in drawn(result.plot("y")) if row["of"] == of] for of in ("engine", "truth")}
    assert parts["engine"] == list(result.trajectory.pose[:, 1, 1])
    exact = cc.run("bounce", engine="reference", e=0.5)
    assert parts["truth"] == list(exact.trajectory.pose[:, 1, 1])
    assert {row["of"] for row in drawn(exact.plot("y"))} == {"engine"}, "it is the truth itself"
    points = drawn(result.plot())
    rows = result.frame()
    judged = rows[rows.physics.notna()]
    assert [point["check"] for point in points] == list(judged.metric)
    assert [point["verdict"] for point in points] == list(judged.physics)
    result.plot("y").save(tmp_path / "figure.pdf")
    assert (tmp_path / "figure.pdf").read_bytes().startswith(b"%PDF")


def test_a_long_motion_is_thinned_for_the_chart(engine):
    pytest.importorskip("altair")
    result = cc.run("bounce", engine=engine("chipmunk"), dt=1 / 4000)
    assert len(result.trajectory.t) > 8000
    assert 2000 <= sum(row["of"] == "engine" for row in drawn(result.plot("y"))) <= 4000


def test_without_the_libraries_a_chart_says_what_to_install(monkeypatch, engine):
    result = cc.run("impact", engine=engine("chipmunk"))
    for name in [name for name in sys.modules if name.startswith(("contact_crosscheck.charts", "reports.page"))]:
        monkeypatch.delitem(sys.modules, name)  # as in a new process: the page draws with the same library
    monkeypatch.setitem(sys.modules, "altair", None)
    with pytest.raises(EngineError) as caught:
        result.plot()
    assert str(caught.value) == f"plot: altair is missing; {install('report')}"


def test_names_from_files_and_engines_are_text_in_html(tmp_path, monkeypatch, own, engine):
    evil = "<img src=x onerror=alert(1)>"
    monkeypatch.chdir(tmp_path)
    Path(f"{evil}.toml").write_text(FREE_BALL.replace("NAME", evil))
    html = cc.run(f"{evil}.toml", engine=engine("chipmunk"))._repr_html_()
    assert "<img" not in html and "&lt;img" in html and f"final[{evil.split()[0]}" not in html

    class Hostile(ToyEngine):
        facts = EngineFacts("<b>x</b>", evil, "numpy", frozenset({3}), Scheme("none", 1), 1 / 60)

        def refuses(self, scene, profile):
            return evil

    with pytest.warns(UserWarning, match="runs in this process"):
        html = cc.run("impact", engine=Hostile)._repr_html_()
    assert "<img" not in html and "<b>" not in html and "&lt;b&gt;" in html


# ---- engines of a user's own -----------------------------------------------------------------------------------------


def test_own_engine_with_one_warning(own):
    with pytest.warns(UserWarning) as warned:
        results = [cc.run("bounce", engine=given, e=0.5) for given in (ToyEngine, ToyEngine(), ToyEngine)]
    assert len(warned) == 1 and "without a time limit" in str(warned[0].message)
    assert warned[0].filename == __file__
    for result in results[1:]:
        assert result.observation.slot.engine == "toy" and (result.frame().physics != "fail").all()
        assert "in this process only" in result.explain()


def test_rewritten_own_engine_replaces_the_old_one(own):
    class Later(ToyEngine):
        def version(self):
            return "2.0"

    with pytest.warns(UserWarning):
        assert set(cc.run("bounce", engine=ToyEngine).frame().engine_version) == {"1.0"}
    with pytest.warns(UserWarning):
        assert set(cc.run("bounce", engine=Later).frame().engine_version) == {"2.0"}


def test_own_engine_with_the_name_of_an_installed_one(own):
    class Taken(ToyEngine):
        facts = EngineFacts("mujoco", "Mine", "numpy", frozenset({3}), Scheme("none", 1), 1 / 60)

    with pytest.raises(EngineError, match="'mujoco' is the name of an installed engine; choose another"):
        cc.run("bounce", engine=Taken)


def test_error_of_an_own_engine(own):
    class Broken(ToyEngine):
        def build(self, scene, dt, settings):
            raise KeyError("no such thing")

    with pytest.warns(UserWarning):
        result = cc.run("bounce", engine=Broken)
    assert set(result.frame().outcome) == {"crashed"} and "KeyError" in repr(result)
    assert result.trajectory is None and "crashed" in result._repr_html_().lower()
    with pytest.raises(SceneError, match="plot: the engine gave no motion"):
        result.plot("z")


def test_interrupt_of_one_case_stops_all(own):
    class Interrupted(ToyEngine):
        def build(self, scene, dt, settings):
            raise KeyboardInterrupt

    with pytest.warns(UserWarning), pytest.raises(KeyboardInterrupt):
        cc.run("bounce", engine=Interrupted)
    with pytest.raises(KeyboardInterrupt):
        cc.sweep("bounce", engine=Interrupted, e=[0.3, 0.5])


def test_impossible_chart_refused_in_one_line(own):
    class Unmade(ToyEngine):
        def __init__(self):
            raise ValueError("first line\nsecond line")

    with pytest.raises(EngineError) as caught:
        cc.run("bounce", engine=Unmade)
    assert str(caught.value) == "engine: cannot be made: ValueError: first line"


def test_engine_of_another_package_in_a_process_of_its_own(plugins):
    result = cc.run("impact", engine="evil", profile="abort")
    assert result.observation.outcome.value == "crashed" and "SIGABRT" in result.observation.reason


# ---- many cases ------------------------------------------------------------------------------------------------------


def test_a_sweep_has_the_rows_of_its_cases(own, engine):
    with pytest.warns(UserWarning) as warned:
        found = cc.sweep("bounce", engine=[engine("chipmunk"), ToyEngine], e=[0.3, 0.6], height=2.0, jobs=1)
    assert len(warned) == 1
    assert set(found["param.e"]) == {0.3, 0.6} and set(found["param.height"]) == {2.0}
    assert set(found.engine) == {"chipmunk", "toy"} and found.attrs["run"] == ""
    single = cc.run("bounce", engine="chipmunk", e=0.6, height=2.0).frame()
    same = found[(found.engine == "chipmunk") & (found["param.e"] == 0.6)]
    assert list(same.value) == list(single.value) and list(same.physics) == list(single.physics)


def test_a_sweep_that_is_kept_is_loaded_again(tmp_path, engine):
    found = cc.sweep("impact", engine=engine("chipmunk"), e=np.linspace(0.0, 1.0, 3), jobs=1, out=tmp_path)
    again = cc.load(tmp_path)
    assert again.attrs == found.attrs and again.attrs["run"] == found.run[0]
    pd.testing.assert_frame_equal(again, found)


@pytest.mark.parametrize(
    ("said", "given"),
    [
        ("sweep: nothing has several values", {"e": 0.5}),
        ("dt: the list is empty", {"dt": []}),
        ("profile: chipmunk has no profile 'tund', only", {"profile": ["tuned", "tund"]}),
        ("e: the list is empty", {"e": []}),
        ("e: 'x' is not a number", {"e": [0.5, "x"]}),
        ("bounce.e: 2 must lie in", {"e": [0.5, 2]}),
        ("bounce.nope: there is no such parameter", {"nope": [1, 2]}),
        ("engine: the list is empty", {"e": [0.5], "engine": []}),
        ("bounce.dimension: 4 is not one of", {"e": [0.5], "dimension": 4}),
    ],
)
def test_wrong_sweep_in_one_line(said, given):
    with pytest.raises((SceneError, EngineError)) as caught:
        cc.sweep("bounce", **({"engine": "chipmunk"} | given))
    assert str(caught.value).startswith(said)


def test_results_of_engines_of_one_s_own_are_not_kept(tmp_path, own):
    with pytest.warns(UserWarning), pytest.raises(EngineError, match="out: toy exists in this process alone"):
        cc.sweep("bounce", engine=ToyEngine, e=[0.5], out=tmp_path)
    with pytest.raises(EngineError, match="out: toy exists in this process alone"):
        cc.bench("bounce", engines=[ToyEngine], dts=["1/60"], out=tmp_path)


def test_a_sweep_over_steps_and_profiles(engine):
    """Error against step is the first figure of a paper; only parameters could have several values."""
    found = cc.sweep("impact", engine=engine("chipmunk"), profile=["as shipped", "tuned"], dt=[1 / 60, "1/240"], jobs=1)
    assert set(found.profile) == {"default", "tuned"} and set(found.dt) == {1 / 60, 1 / 240}
    assert len(found.groupby(["profile", "dt"]).state_hash.unique()) == 4, "one case of the scene, at its defaults"
    one = cc.run("impact", engine="chipmunk", profile="tuned", dt=1 / 60).frame()
    same = found[(found.profile == "tuned") & (found.dt == 1 / 60)]
    assert list(same.value) == list(one.value)


@pytest.mark.long
def test_a_bench_of_an_engine_of_one_s_own(own):
    with pytest.warns(UserWarning, match="toy runs in this process"):
        found = cc.bench("impact", engines=[ToyEngine, "reference"], dimension=3, dts=["1/240"])
    points = found.frame()
    assert set(points.engine) == {"toy", "reference"} and (points.cost > 0.0).all() and points.error.notna().all()


@pytest.mark.long
def test_errors_times_and_plot_of_a_bench(engine):
    found = cc.bench("impact", engines=engine("chipmunk"), profiles=["tuned"], dimension=2, dts=["1/120", 1 / 240])
    points = found.frame()
    assert set(points.dt) == {1 / 120, 1 / 240} and (points.cost > 0.0).all() and points.error.notna().all()
    assert len(drawn(found.plot())) == len(points)
    assert "work points" in repr(found)


# ---- scenes and listings --------------------------------------------------------------------------------------------


def test_a_scene_as_a_table(tmp_path, engine):
    table = tomllib.loads(FREE_BALL.replace("NAME", "ball"))
    (tmp_path / "drop.toml").write_text(FREE_BALL.replace("NAME", "ball"))
    here, there = (cc.run(each, engine=engine("chipmunk")) for each in (table, tmp_path / "drop.toml"))
    assert here.observation.state_hash == there.observation.state_hash
    assert set(cc.sweep(table, engine="chipmunk", dt=[1 / 60, 1 / 120], jobs=1).dt) == {1 / 60, 1 / 120}
    for wrong, said in (({"name": "x"}, "dimension: is missing"), ({1: {2, 3}}, "scene: is not what a scene file")):
        with pytest.raises(SceneError, match=said):
            cc.run(wrong, engine="chipmunk")


def test_a_scene_that_the_caller_has_written(own, engine):
    """As `drop.SCENE` of CONTRIBUTING: it had to be in an installed package."""
    written = dataclasses.replace(CATALOGUE["impact"], name="mine")
    found = cc.run(written, engine=engine("chipmunk"), e=0.5)
    assert list(found.frame().value) == list(cc.run("impact", engine="chipmunk", e=0.5).frame().value)
    assert set(cc.sweep(written, engine="chipmunk", e=[0.2, 0.5]).scene) == {"mine"}
    anew = dataclasses.replace(written, title="Another", rule=lambda scene, dt, truth: [])
    assert set(cc.run(anew, engine="chipmunk").frame().metric) == set()
    assert str(cc.run(CATALOGUE["impact"], engine="chipmunk")).startswith("impact 2-D")
    names = {"bounce": "is the name of an installed scene", "My scene": "is not a name of small letters"}
    for name, said in names.items():
        wrong = dataclasses.replace(written, name=name)
        with pytest.raises(SceneError, match=said):
            cc.run(wrong, engine="chipmunk")
    with pytest.raises(SceneError, match="mine exists in this process alone"):
        cc.bench(written, engines="chipmunk")


def test_model_given_as_a_scene(engine):
    path = MODELS / "ball_dropped.xml"
    scene = cc.Scene.from_mjcf(path) if registry.find(engine("mujoco")).engine else None
    assert scene.dimensions == (2, 3) and list(scene.parameters.name) == ["duration"] and scene.notes
    own = cc.run(scene, engine="mujoco", duration=0.3)
    assert own.observation.slot.profile == "model" and own.observation.slot.dt == 0.001
    by_path = cc.run(path, engine="mujoco", duration=0.3)
    assert by_path.observation.state_hash == own.observation.state_hash
    with pytest.raises(SceneError, match=r"does not end in \.urdf"):
        cc.Scene.from_urdf(path)
    with pytest.raises(SceneError, match="does not end in"):
        cc.Scene.from_file("model.txt")


@pytest.mark.parametrize(
    ("read", "name", "reader"),
    [(cc.Scene.from_urdf, "ball_alone.urdf", "mujoco"),
     *(pytest.param(cc.Scene.from_sdf, name, "drake", marks=pytest.mark.optional("drake"))
       for name in ("ball_dropped.sdf", "moon_slope.world"))],
)  # fmt: skip
def test_urdf_and_sdf_models_given_as_scenes(engine, read, name, reader):
    """Its own engine runs it as its author made it, from where and as our solver does."""
    if registry.find(engine(reader)).engine is None:
        pytest.skip(f"{reader} is not installed")
    scene = read(MODELS / name)
    assert scene.title == f"Model {name}" and 3 in scene.dimensions and scene.notes
    assert list(scene.parameters.name) == ["duration"]
    own, solved = (cc.run(scene, engine=each, duration=0.05, dimension=3) for each in (reader, engine("reference")))
    assert own.observation.slot.profile == "model" and own.observation.slot.dt != solved.observation.slot.dt
    there, here = (each.trajectory.pose[-1, :, :3] for each in (own, solved))
    assert np.abs(there - here).max() < 9.81 * 0.05 / 240.0  # g t dt: what a step can make of a start from rest [m]


def test_tables_of_engines_and_scenes(engine):
    engines, scenes = cc.engines(), cc.scenes().set_index("name")
    chipmunk = engines.set_index("name").loc[engine("chipmunk")]
    assert chipmunk.status == "installed" and chipmunk.combined_friction == "0.18, the product"
    assert "bounce" in scenes.index and scenes.loc["bounce"].dimensions == [2, 3]


# ---- scripts and notebooks -------------------------------------------------------------------------------------------


def test_foreign_package_before_our_imports(tmp_path):
    (tmp_path / "adapters").mkdir()
    (tmp_path / "adapters" / "__init__.py").write_text("print('foreign')")
    code = "import sys\nsys.path.insert(0, '.')\nimport contact_crosscheck as cc\ncc.run"
    out, said = called(tmp_path, code, status=1)
    assert "'adapters' at" in said.splitlines()[-1] and out == ""


@pytest.mark.parametrize("name", ["chipmunk"])
def test_a_script_without_a_guard_runs_once(tmp_path, engine, name):
    code = f"""
import contact_crosscheck as cc
print("begun")
result = cc.run("impact", engine="{engine(name)}", e=0.5)
found = cc.sweep("impact", engine="{name}", e=[0.2, 0.5], jobs=1)
print(set(found[found["param.e"] == 0.5].state_hash) == set(result.frame().state_hash))
"""
    assert called(tmp_path, code)[0].split() == ["begun", "True"]


def test_script_without_a_guard_and_an_outside_engine(tmp_path, plugins):
    code = f"""
import sys
sys.path.insert(0, {str(plugins)!r})
import contact_crosscheck as cc
print("begun")
print(repr(cc.run("impact", engine="evil", profile="raise")))
"""
    out, _ = called(tmp_path, code)
    assert out.count("begun") == 1 and "building failed" in out


@pytest.mark.long
@pytest.mark.parametrize("name", ["mujoco"])
def test_a_script_without_a_guard_reads_a_model(tmp_path, engine, name):
    code = f"""
import contact_crosscheck as cc
print("begun")
scene = cc.Scene.from_mjcf({str(MODELS / "ball_dropped.xml")!r})
print(cc.run(scene, engine="{engine(name)}", duration=0.2).observation.outcome.value)
"""
    assert called(tmp_path, code)[0].split() == ["begun", "ok"]


@pytest.mark.long
@pytest.mark.parametrize("name", ["first_look", "paper_figure"])
def test_a_notebook_runs(tmp_path, engine, name):
    for needed in ("mujoco", "chipmunk"):
        engine(needed)
    pytest.importorskip("altair")
    code = (ROOT / "docs" / "notebooks" / f"{name}.py").read_text(encoding="utf-8")
    if name == "paper_figure":  # a field that a chart does not find is drawn as nothing
        code += 'figure.save("figure.svg")\n'
    called(tmp_path, code)
    if name == "paper_figure":
        assert (tmp_path / "figure.pdf").read_bytes().startswith(b"%PDF")
        lines = re.findall(r'aria-roledescription="line mark"[^>]* d="([^"]*)"', (tmp_path / "figure.svg").read_text())
        assert len(lines) == 3 and min(line.count("L") for line in lines) > 200
        assert len((tmp_path / "table.csv").read_text().splitlines()) == 4
