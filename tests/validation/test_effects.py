"""Settings that do nothing and settings that act, each with its verdict; kept tables follow cases and engines."""

from dataclasses import asdict, replace

import pytest

from adapters.engine import EngineError
from adapters.engine_folder import EFFECTS, effects_of, fault_of_tuning, inside
from adapters.experiment import Effect
from adapters.experiment.files import read_tuning
from adapters.registry import find, load, names
from reports.tables import shown_by
from validation.cells import Observation, Outcome, Slot
from validation.running.plan import QUICK_DT
from validation.settings import effects
from validation.settings.effects import (
    ACTS,
    CLAMPED,
    NOTHING,
    ONLY_WITH,
    REFUSED,
    ROUNDED,
    UNSEEN,
    UNTRIED,
    Told,
    beyond,
    idle,
    idle_in,
    judged,
    measure,
    of_release,
    read,
    settings_known,
    told_of,
    write,
)

ENGINES = [name for name in names() if effects_of(name)]
BASE = Slot("stack", (), 2, "toy", "default", QUICK_DT)


def seen(**bits):
    """Runs of a case, each with its bits, which its metric tells as well; None: refused."""
    return {
        part: Observation(BASE, part, 1, "1.0", Outcome.OK, "", {"drift": (float(ord(own)), "")}, own)
        if own
        else Observation(BASE, part, 1, "1.0", Outcome.UNSUPPORTED, "no such")
        for part, own in bits.items()
    }


NEEDS = Effect(1, "stack", "drift", needs={"other": 2}, because="it is scaled by it")
LIMITED = Effect(1.0, "stack", "drift", beyond=0.5, because="at least 1")


@pytest.mark.parametrize(
    ("effect", "runs", "verdict"),
    [
        (Effect(1, "stack", "drift"), {"base": "a", "set": "b"}, ACTS),
        (Effect(1, "stack", "drift"), {"base": "a", "set": "a"}, UNSEEN),
        (Effect(1, "stack", "drift", because="of joints"), {"base": "a", "set": "a"}, NOTHING),
        (Effect(1, "stack", "drift"), {"base": "a", "set": None}, REFUSED),
        (NEEDS, {"base": "a", "set": "a", "ready": "c", "both": "d"}, ONLY_WITH),
        (NEEDS, {"base": "a", "set": "a", "ready": "c", "both": "c"}, NOTHING),
        (NEEDS, {"base": "a", "set": None, "ready": None, "both": "d"}, ONLY_WITH),
        (NEEDS, {"base": "a", "set": "b", "ready": "c", "both": "c"}, ACTS),
        (LIMITED, {"base": "a", "set": "b", "beyond": "b"}, CLAMPED),
        (LIMITED, {"base": "a", "set": "b", "beyond": "c"}, ACTS),
        (LIMITED, {"base": "a", "set": "b", "beyond": None}, ACTS),
        (LIMITED, {"base": "a", "set": "a", "beyond": "a"}, NOTHING),
    ],
)
def test_verdict_on_a_setting_by_bits(effect, runs, verdict):
    assert judged("toy", "1.0", "knob", effect, seen(**runs), 1e-9).verdict == verdict


def test_setting_that_changes_a_metric_alone():
    """Contacts are no part of a state."""
    runs = seen(base="a", set="a")
    runs["set"] = replace(runs["set"], metrics={"load": (1.0, "")}, readback={"knob": 1})
    told = judged("toy", "1.0", "knob", Effect(1, "stack", "load"), runs, 1e-9)
    assert (told.verdict, told.after, told.read) == (ACTS, "1", "yes")


@pytest.mark.parametrize(
    ("before", "after", "told"),
    [(0.0034061, 0.0034062, ("0.0034061", "0.0034062")), (0.0034061, 0.0034061, ("0.003406", "0.003406")),
     (1.0, 1.0 + 2e-16, ("1", "1.0000000000000002")), (0.0034061, None, ("0.003406", ""))],
)  # fmt: skip
def test_digits_that_tell_two_numbers_apart(before, after, told):
    runs = {part: replace(each, metrics={"load": (value, "")})
            for (part, each), value in zip(seen(base="a", set="b").items(), (before, after), strict=True)}  # fmt: skip
    found = judged("toy", "1.0", "knob", Effect(1, "stack", "load"), runs, 1e-9)
    assert (found.before, found.after) == told
    same = "no change" if before == after else f"{told[0]} -> {told[1] or '-'}"
    assert shown_by(asdict(found)) == f"load of stack {same} at 1"


@pytest.mark.parametrize(
    ("values", "outcome", "round_off", "verdict", "shown"),
    [({"load": (1.0, 1.0 + 9e-10)}, Outcome.OK, 1e-9, ROUNDED, "load"),
     ({"load": (1.0, 1.0 + 2e-9)}, Outcome.OK, 1e-9, ACTS, "load"),
     ({"load": (1.0, 1.0 + 2e-9)}, Outcome.OK, 1e-4, ROUNDED, "load"),
     ({"load": (None, None), "drift": (1.0, 2.0)}, Outcome.OK, 1e-9, ACTS, "drift"),
     ({"load": (None, None)}, Outcome.OK, 1e-9, ROUNDED, "load"),
     ({"load": (1.0, 1.0), "drift": (None, 1.0), "turn": (1.0, 2.0)}, Outcome.OK, 1e-9, ACTS, "turn"),
     ({"load": (1.0, None)}, Outcome.OK, 1e-9, ACTS, "load"),
     ({"load": (1.0, 1.0)}, Outcome.DIVERGED, 1e-9, ACTS, "load")],
)  # fmt: skip
def test_change_of_the_size_of_round_off(values, outcome, round_off, verdict, shown):
    runs = {part: replace(each, metrics={name: (pair[k], "") for name, pair in values.items()})
            for k, (part, each) in enumerate(seen(base="a", set="b").items())}  # fmt: skip
    runs["set"] = replace(runs["set"], outcome=outcome)
    told = judged("toy", "1.0", "knob", Effect(1, "stack", "load"), runs, round_off)
    assert (told.verdict, told.metric) == (verdict, shown)


def test_planted_setting_without_effect_and_one_that_acts(monkeypatch):
    """Bodies that nothing touches have no contacts to keep, and are slowed by damping."""
    pytest.importorskip("pymunk")
    cases = {name: Effect(value, "flight", "fall_speed") for name, value in
             (("collision_persistence", 1), ("damping", 0.5), ("collision_bias", 2.0))}  # fmt: skip
    monkeypatch.setattr(effects, "effects_of", lambda engine: cases)
    monkeypatch.setattr(effects, "settings_known", lambda engine: [*cases, "iterations"])
    told = {each.setting: each for each in measure("chipmunk")}
    verdicts = {name: each.verdict for name, each in told.items()}
    assert verdicts == {
        "collision_persistence": UNSEEN, "damping": ACTS, "collision_bias": REFUSED, "iterations": UNTRIED,
    }  # fmt: skip
    assert told["collision_persistence"].read == "yes" and told["damping"].before == "98.1"
    assert told["collision_persistence"].because == "no bit of flight changes"


@pytest.fixture
def kept(monkeypatch):
    """``kept(cases)``: a toy's settings with their cases, all measured with the verdict that is given."""

    def keep(**told):
        cases = {name: effect for name, (effect, _) in told.items()}
        rows = {
            name: Told("toy", "1.0", name, v, scene=each.scene, because=each.because)
            for name, (each, v) in told.items()
        }
        monkeypatch.setattr(effects, "effects_of", lambda engine: cases)
        monkeypatch.setattr(effects, "of_release", lambda engine, version: rows if version == "1.0" else {})

    return keep


def told(asked, own=None, version="1.0", dt=QUICK_DT):
    return list(idle("toy", version, list(asked.items()), (own or {}) | asked, dt))


def test_line_on_a_value_that_does_nothing(kept):
    kept(erp=(Effect(because="of joints"), NOTHING), knob=(Effect(), ACTS), new=(Effect(), UNTRIED))
    assert told({"erp": 0.5, "knob": 1, "new": 2, "other": 3}) == ["erp=0.5 does nothing in toy 1.0: of joints"]
    assert told({"erp": 0.5}, version="2.0") == []


def test_line_on_an_idle_value(kept):
    kept(knob=(Effect(scene="stack"), UNSEEN), loose=(Effect(scene="stack"), ROUNDED))
    (line,) = told({"knob": 0.5, "loose": 1})
    assert line == "knob=0.5 may do nothing in toy 1.0: it changes no bit of scene stack, where it was tried"


def test_line_on_a_value_that_needs_another(kept):
    kept(wind=(Effect(needs={"density": 1.2}), ONLY_WITH), tilt=(Effect(needs={"cone": "round"}), ONLY_WITH),
         doze=(Effect(needs={"flags": ("sleep",)}), ONLY_WITH))  # fmt: skip
    assert told({"wind": 3.0}) == ["wind=3 acts in toy 1.0 only with another setting, such as density=1.2"]
    assert told({"wind": 3.0}, {"density": 0.0}) != [] == told({"wind": 3.0}, {"density": 9.0})
    assert told({"tilt": 1}, {"cone": "flat"}) != [] == told({"tilt": 1}, {"cone": "round"})
    assert told({"doze": 1}, {"flags": ("wake",)}) != [] == told({"doze": 1}, {"flags": ("wake", "sleep")})


def test_line_on_a_clamped_value(kept):
    soft = Effect((2 * QUICK_DT, 1.0), beyond=(1e-4, 1.0), in_steps=True, unless={"off": ("safe",)}, because="safe")
    kept(soft=(soft, CLAMPED))
    assert told({"soft": (0.001, 1.0)}) == ["soft=0.001,1 acts as 0.008333 in toy 1.0: safe"]
    assert told({"soft": (0.001, 1.0)}, dt=1e-4) == [] == told({"soft": (0.02, 1.0)})
    assert told({"soft": (-100.0, -1.0)}) == [] == told({"soft": (0.001, 1.0)}, {"off": ("safe",)})
    assert beyond(3.0, Effect(1.0, beyond=2.0), QUICK_DT) == 1.0
    assert beyond("reflect", soft, QUICK_DT) is None


def test_settings_of_a_user_that_mujoco_does_not_heed():
    pytest.importorskip("mujoco")
    slot = Slot("impact", (), 3, "mujoco", "default", QUICK_DT)
    (line,) = idle_in([slot, slot.with_own((("solref", (0.001, 1.0)),))])
    assert line == "solref=0.001,1 acts as 0.008333 in mujoco 4.0.1: time constants are at least two steps (refsafe)"
    assert idle_in([slot.with_own((("solref", (0.05, 1.0)),))]) == []


@pytest.mark.parametrize("engine", ENGINES)
def test_kept_table_has_a_row_for_every_setting(engine):
    if find(engine).engine is None:
        pytest.skip(f"{engine} is not installed")
    assert fault_of_tuning(engine) == ""
    own, rows = settings_known(engine), of_release(engine, load(engine).version())
    assert sorted(effects_of(engine)) == own == sorted(rows)
    assert len(told_of(engine)) == len({(each.version, each.setting) for each in told_of(engine)})
    untried = [each for each in rows.values() if each.verdict == UNTRIED]
    assert len(untried) <= 0.1 * len(own) and all(each.because for each in untried)
    for name, effect in effects_of(engine).items():
        assert rows[name].verdict == UNTRIED if effect.untried else (rows[name].scene, rows[name].metric) == (
            effect.scene, effect.metric
        )  # fmt: skip


def test_kept_table_of_chipmunk_as_measured():
    pytest.importorskip("pymunk")
    assert measure("chipmunk") == list(of_release("chipmunk", load("chipmunk").version()).values())


def test_setting_that_acts_on_cylinders_in_a_scene_file(monkeypatch):
    """MuJoCo has closed forms for the contacts of boxes, and searches those of cylinders."""
    pytest.importorskip("mujoco")
    monkeypatch.setattr(effects, "settings_known", lambda engine: ["ccd_tolerance"])
    (told,) = measure("mujoco")
    assert (told.verdict, told.scene) == (ACTS, "can.toml") and told.after != told.before


@pytest.mark.long
@pytest.mark.parametrize("engine", [name for name in ENGINES if name != "chipmunk"])
def test_kept_table_as_measured(engine):
    if find(engine).engine is None:
        pytest.skip(f"{engine} is not installed")
    rows = of_release(engine, load(engine).version())
    assert {each.setting: each.verdict for each in measure(engine)} == {n: each.verdict for n, each in rows.items()}


def test_table_of_another_release_stays(tmp_path):
    path, old, new = tmp_path / EFFECTS, Told("toy", "1.0", "a", ACTS), Told("toy", "2.0", "a", NOTHING)
    write([old], path)
    write([new], path)
    assert list(read(path)) == [old, new]
    write([replace(old, verdict=NOTHING)], path)
    assert list(read(path)) == [new, replace(old, verdict=NOTHING)]


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ("a = 1", "effects.a must be a table"),
        ('a = { set = 1, scene = "stack" }', "effects.a: metric is missing"),
        ('a = { set = 1, scene = "stack", metric = "drift", sets = 2 }', "effects.a: sets is not a field"),
        ('a = { untried = "" }', "effects.a: untried must be a name"),
    ],
)
def test_wrong_case_of_a_setting_in_one_line(tmp_path, table, said):
    path = tmp_path / "tuning.toml"
    path.write_text(f"[effects]\n{table}\n")
    with pytest.raises(EngineError, match=said):
        read_tuning(path)


def test_engine_without_a_table():
    assert told_of("newton") and inside("newton", EFFECTS) is not None
    assert told_of("toy") == () and inside("toy", EFFECTS) is None
