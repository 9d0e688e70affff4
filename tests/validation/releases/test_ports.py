"""Comparison of an engine with its ports; a port here is MuJoCo C with a planted change."""

import math
from dataclasses import replace

import pytest

from adapters import registry
from adapters.engine import EngineError
from adapters.mujoco import MujocoEngine, port
from adapters.stepping import posed_for, run
from reports.ports import counts, sentence, told
from validation.catalogue import CATALOGUE
from validation.cells import Slot, prepare
from validation.releases import choosing, driving, kept
from validation.releases.choosing import Release, ported
from validation.releases.ports import LOST, ROUNDED, Compared, _asked, compared_from, explained, farthest, moved

ENGINE, DT = MujocoEngine(), 1.0 / 240.0


class Port(port.PortEngine):
    """MuJoCo C that reads one setting otherwise."""

    facts = port.port_facts("port", "Port", "port", "single")
    switches = {"friction is less stiff": {"impratio": 2.0}}  # noqa: RUF012 (a fake for one test)

    def __init__(self, **changes):
        self.changes = changes

    def build(self, scene, dt, settings):
        return ENGINE.build(scene, dt, {**settings, **self.changes})


class Double(Port):
    """The same in double precision."""

    facts = replace(Port.facts, precision="double")


def slot(scene, profile="default", **params):
    return Slot(scene, tuple(sorted(params.items())), 3, "mujoco", profile, DT)


def compared(case, port=Port, **changes):
    posed = posed_for(ENGINE, prepare(case).scene)
    return _asked(Compared(case, "port", "unsupported"), ENGINE, port(**changes), posed, {})


def here(question, *args):
    return question(*args)


def ported_as(monkeypatch, port):
    monkeypatch.setattr(registry, "load", lambda name: port if name == "port" else ENGINE)
    monkeypatch.setattr(registry, "adapter", lambda name: port)


@pytest.mark.parametrize("profile", ["default", "tuned"])
def test_engine_against_itself(profile):
    found = compared(slot("slide_to_roll", profile))
    assert found.verdict == "same" and found.apart == 0.0 and found.until == found.end


@pytest.mark.parametrize("tolerance", [1e-12, 1e-6])
def test_rounding_of_the_solver_alone(tolerance):
    assert compared(slot("slide_to_roll"), tolerance=tolerance).verdict == "same"


@pytest.mark.parametrize("changes", [{"tolerance": 1e-3}, {"solref": (0.02 + 2e-9, 1.0)}])
def test_change_below_round_off_of_single_precision(changes):
    single, double = (compared(slot("oblique"), port, **changes) for port in (Port, Double))
    assert (single.verdict, double.verdict) == ("same", "differs") and 0.0 < double.apart < 1e-4


@pytest.mark.parametrize("port", [Port, Double])
def test_growth_of_a_moved_start(port):
    """In free fall a move of a place stays, one of a speed grows with time, whatever their size."""
    case = slot("flight", "tuned")
    scene, found = posed_for(ENGINE, prepare(case).scene), compared(case, port)
    size, free = farthest(scene), [body for body in scene.bodies if body.motion == "free"]
    speed = max(math.hypot(*body.twist[:3]) + size * math.hypot(*body.twist[3:]) for body in free)
    most = max(speed, math.sqrt(2.0 * 9.81 * size))
    assert 1.0 < found.growth < 3.0 + 3.0 * most * scene.duration / size


@pytest.mark.parametrize("changes", [{"impratio": 1.5}, {"solref": (0.0201, 1.0)}, {"cone": "elliptic"}])
def test_port_with_another_contact_model(changes):
    found = compared(slot("oblique"), **changes)
    assert found.verdict == "differs" and 0.0 < found.since < found.until and found.body == "ball"


def test_port_that_ends_early(monkeypatch):
    def ending(engine, scene, dt, settings):
        found = run(engine, scene, dt, settings)
        if isinstance(engine, Port):
            parts = {name: getattr(found, name)[:9] for name in ("t", "pose", "twist")}
            parts["pose"] = parts["pose"].copy()
            parts["pose"][-1] = math.nan
            return replace(found, **parts, finish="diverged", reason="the state is not finite at t = 1 s")
        return found

    monkeypatch.setattr("validation.releases.ports.run", ending)
    found = compared(slot("oblique"))
    assert found.verdict == "differs" and found.because == "the port ends: the state is not finite at t = 1 s"
    assert found.end == pytest.approx(7 * DT) and found.apart == 0.0


def test_box_that_stands_where_it_slides_in_single_precision(monkeypatch):
    """A million metres from the origin, round-off is longer than its way in a step, and less than its place."""

    def standing(engine, scene, dt, settings):
        found = run(engine, scene, dt, settings)
        return replace(found, pose=found.pose[:1].repeat(len(found.t), axis=0)) if isinstance(engine, Port) else found

    monkeypatch.setattr("validation.releases.ports.run", standing)
    found = compared(slot("far_origin"))
    assert found.verdict == "lost" and found.until == 0.0 and not found.whole


def test_proof_of_a_difference(monkeypatch):
    """With the changed setting in both, both are the same."""
    ported_as(monkeypatch, Port(impratio=2.0))
    found = explained(slot("oblique"), "port", here)
    assert found.verdict == "differs" and found.proof == "impratio=2"
    ported_as(monkeypatch, Port(impratio=3.0))
    assert explained(slot("oblique"), "port", here).proof == ""


def test_setting_that_a_case_has_already(monkeypatch):
    """It is not run again."""
    ported_as(monkeypatch, port := Port(impratio=2.0))
    monkeypatch.setattr(port, "switches", {"margin": {"margin": 0.0}, "friction": {"impratio": 2.0}})
    asked = []
    explained(slot("oblique"), "port", lambda ask, *case: asked.append(case[-1]) or ask(*case))
    assert asked == [{}, {"impratio": 2.0}]


def test_cause_that_is_not_found_in_time(monkeypatch):
    """The difference is kept even if the search for its cause has no answer."""
    ported_as(monkeypatch, Port(impratio=2.0))
    found = explained(slot("oblique"), "port", lambda ask, *case: "no answer" if case[-1] else ask(*case))
    assert found.verdict == "differs" and found.proof == ""
    assert explained(slot("oblique"), "port", lambda *asked: "no answer").because == "no answer"


def test_scene_that_a_port_lacks(monkeypatch):
    ported_as(monkeypatch, Port())
    found = explained(slot("conveyor"), "port", here)
    assert found.verdict == "unsupported" and found.because.endswith("the adapter of port has no surface velocity")


def test_scene_that_neither_runs(monkeypatch):
    ported_as(monkeypatch, Port())
    found = explained(replace(slot("restitution_above_one"), dimension=2), "port", here)
    assert found.verdict == "unsupported" and found.because == "pairs: the adapter of mujoco has no restitution above 1"


def test_difference_that_a_setting_hides_in_round_off(monkeypatch):
    """With the setting more is explained by round-off, and the distance is as large as before."""
    ported_as(monkeypatch, Port())
    before = Compared(slot("oblique"), "port", "differs", 0.4, 0.4, 4e-3, "ball", 0.1)
    for apart, proof in ((3.9e-3, ""), (0.9e-3, "impratio=2")):
        answers = iter([before, replace(before, verdict="same", apart=apart, since=math.nan)])
        monkeypatch.setattr("validation.releases.ports._asked", lambda *asked, told=answers: next(told))
        assert explained(slot("oblique"), "port", here).proof == proof


@pytest.mark.parametrize("number", range(3))
def test_moved_start(number):
    scene = posed_for(ENGINE, CATALOGUE["stack"].scene(3, {"n": 3}))
    by = ROUNDED["single"]
    other = moved(scene, number, by)
    shifts = [math.dist(a.pose[:3], b.pose[:3]) for a, b in zip(scene.bodies, other.bodies, strict=True)]
    assert shifts[0] == 0.0 and all(0.0 < each < 1e-5 * farthest(scene) for each in shifts[1:])
    assert LOST * farthest(scene) > 1e3 * max(shifts)
    assert all(math.isclose(math.hypot(*body.pose[3:]), 1.0) for body in other.bodies)
    assert moved(scene, number, by) == other and moved(scene, number + 1, by) != other


def test_result_as_plain_data():
    found = compared(slot("oblique"), impratio=1.5)
    assert compared_from(found.as_dict()) == found


# ---- releases --------------------------------------------------------------------------------------------------------


@pytest.fixture
def offers(monkeypatch):
    """Releases of each engine."""
    of = {"mujoco": ["3.16.0", "3.17.0", "4.0.0"], "mujoco_warp": ["3.16.0", "3.17.0", "4.0.0"],
          "mujoco_mjx": ["3.16.0", "3.18.0"], "mujoco_newton": ["1.7.0", "1.8.0"]}  # fmt: skip
    needs = {"1.7.0": ("mujoco==3.16.0",), "1.8.0": ("scipy", "mujoco==3.17.0")}
    monkeypatch.setattr(
        choosing, "offered", lambda name: [Release(name, each, name, needs.get(each, ())) for each in of[name]]
    )
    return of


def test_newest_common_good_release(offers):
    assert "4.0.0" in ENGINE.facts.known_bad_versions
    assert ported("mujoco", ["mujoco_warp"]).requirements == ("mujoco==3.17.0", "numpy", "mujoco_warp==3.17.0")
    both = ported("mujoco", ["mujoco_warp", "mujoco_mjx"])
    assert both.version == "3.16.0" and "mujoco_mjx==3.16.0" in both.needs


def test_port_with_release_numbers_of_its_own(offers):
    """It runs beside the release that it requires."""
    found = ported("mujoco", ["mujoco_warp", "mujoco_newton"])
    assert found.version == "3.17.0" and {"mujoco_newton==1.8.0", "mujoco_warp==3.17.0"} < set(found.needs)
    assert "mujoco_newton==1.7.0" in ported("mujoco", ["mujoco_newton"], "3.16.0").needs


@pytest.mark.parametrize(
    ("ports", "version", "line"),
    [
        (["mujoco_mjx"], "3.17.0", "ports: mujoco, mujoco_mjx have no release 3.17.0"),
        (
            ["bullet"],
            "",
            "ports: bullet is no port of mujoco; ports: mujoco_mjx, mujoco_mjx_single, mujoco_newton, mujoco_warp",
        ),
    ],
)
def test_releases_that_are_not_compared(offers, ports, version, line):
    with pytest.raises(EngineError) as caught:
        ported("mujoco", ports, version)
    assert str(caught.value) == line


@pytest.mark.parametrize(
    ("name", "said"), [("nosuch", "no engine is called 'nosuch'"), ("bullet", "no port of bullet is known")]
)
def test_engine_without_ports(name, said):
    with pytest.raises(EngineError) as caught:
        ported(name, [])
    known = "mujoco with mujoco_mjx, mujoco_mjx_single, mujoco_newton, mujoco_warp"
    assert str(caught.value) == f"ports: {said}; these can be compared: {known}"


def test_port_beside_another_release(monkeypatch):
    monkeypatch.setattr(port, "version", lambda package: "3.17.0")
    here = ENGINE.version()
    with pytest.raises(ImportError, match=f"port 3.17.0 is no port of MuJoCo {here}, which is installed"):
        Port().version()


# ---- the kept table --------------------------------------------------------------------------------------------------


def test_kept_table(monkeypatch, tmp_path):
    monkeypatch.setattr(kept, "folder_of", lambda engine: tmp_path)
    monkeypatch.setattr(registry, "adapter", lambda name: Port())
    monkeypatch.setattr("adapters.engine_folder.folder_of", lambda engine: tmp_path)
    monkeypatch.setattr(kept, "cache_folder", lambda: tmp_path)
    assert kept.kept("mujoco") == ()
    first = compared(slot("oblique"), impratio=1.5)
    for each in (
        first,
        replace(first, proof="impratio=2"),
        Compared(slot("conveyor"), "port", "unsupported", because="no"),
    ):
        kept.keep("mujoco", each, "3.17.0")
    rows = kept.kept("mujoco")
    assert [(row["scene"], row["proof"]) for row in rows] == [("conveyor", ""), ("oblique", "impratio=2")]
    page = told(rows)
    assert page["cases"][0] == ("conveyor 3-D default", ["unsupported: no"])
    assert page["counts"] == [("differ by more", ["1"]), ("unsupported", ["1"])]
    assert page["causes"] == [("friction is less stiff", "impratio=2", "0.00143 m", ["1"])]
    assert counts([row | {"proof": ""} for row in rows], "port") == "port: 1 differ with no cause found, 1 unsupported"
    assert sentence(rows[1] | {"proof": ""}).startswith("differs, no cause found: by ")
    assert sentence(rows[1]).endswith("; the same with impratio=2") and counts(rows, "other") == "other: "


def test_silence_of_a_case_that_each_setting_runs_again(monkeypatch):
    """All of its runs take their longest, and the case is not given up."""
    waits = []
    monkeypatch.setattr(driving, "_answers", lambda release, effort, *rest, **more: waits.append(effort) or iter([{}]))
    assert list(driving.compare(Release("mujoco", "3.17.0", "mujoco", ()), ["mujoco_mjx"], [])) == []
    assert waits[0].timeout >= driving.PATIENCE * (1 + len(registry.adapter("mujoco_mjx").switches))
