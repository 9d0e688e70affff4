"""Settings of a user's own: how they are read, which an engine takes, and that the engine gets each of them."""

from types import MappingProxyType

import numpy as np
import pytest

from adapters import registry
from adapters.engine import EngineError, Setting
from adapters.settings import either, flag, like, number, one_of, row, rows, text_of, whole, word, words
from adapters.settings.own import given, near, own, read, suffix_of
from validation.cells import Slot, prepare, settings_of

HERE = [name for name in registry.names() if registry.find(name).engine is not None]
DT = 1.0 / 240.0


def stock(engine, profile, scene="bounce"):
    """Settings of a profile on a scene."""
    found = registry.load(engine)
    slot = Slot(scene, (), max(found.facts.dimensions), engine, profile, DT)
    return settings_of(found, slot, prepare(slot).scene)


@pytest.mark.parametrize(
    ("text", "value", "again"),
    [("10", 10, "10"), ("-3", -3, "-3"), ("10.0", 10.0, "10"), ("1e-7", 1e-7, "1e-07"), (" .5", 0.5, "0.5"),
     ("elliptic", "elliptic", "elliptic"), ("true", True, "true"), ("False", False, "false"), ("none", None, "none"),
     ("0.01,1", (0.01, 1.0), "0.01,1"), ("warmstart,island", ("warmstart", "island"), "warmstart,island"),
     ("0.01 1", (0.01, 1.0), "0.01,1"), ("a b", "a b", "a b")],
)  # fmt: skip
def test_setting_value_read_from_its_own_text(text, value, again):
    found = read(text)
    assert found == value and type(found) is type(value)
    assert text_of(found) == again and read(again) == value


@pytest.mark.parametrize("text", ["cone", "=elliptic", "cone=", " = "])
def test_setting_without_name_or_value_refused(text):
    with pytest.raises(EngineError, match=r"^set: .* is not of the form NAME=VALUE"):
        given([text])


def test_refusal_of_two_values_of_one_setting():
    with pytest.raises(EngineError, match="set: cone is given twice"):
        given(["cone=elliptic", "impratio=1", "cone=pyramidal"])
    found = given(["impratio=10", "cone=elliptic"])
    assert found == (("cone", "elliptic"), ("impratio", 10))
    assert suffix_of(found) == "+cone=elliptic+impratio=10" and suffix_of(()) == ""


@pytest.mark.parametrize(
    ("check", "takes", "refuses"),
    [
        (rows(whole(0, 9), flag), [(), [(3, True)]], [5, (3, True), [(3,)], [(3, 1)], "3"]),
        (row(2, number(0.0, 1.0)), [(0.0, 1.0), [0.5, 1]], [(0.5,), (0.5, 2.0), 0.5, "0.5,1", (0.1, 0.2, 0.3)]),
        (words("a", "b"), [("a",), ("b", "a")], ["a", (), ("c",), ("a", "c")]),
        (one_of(1, 3), [1, 3], [2, True, 1.0, "1"]),
        (either(number(0.0, 1.0), None), [0.5, None], [2.0, "none", False]),
        (like(True), [False], [0, "true"]),
        (like(3), [-7], [0.5, True, "3"]),
        (like(0.5), [3, -2.5], [float("inf"), "a", True]),
        (like("a"), ["b"], [1, None]),
        (like((0.1, 1.0)), [(3, 4)], [(3,), 3]),
    ],
)
def test_allowed_values_of_each_kind_of_setting(check, takes, refuses):
    assert not any(map(check, takes))
    assert all(map(check, refuses)) and len({check(value) for value in refuses}) == 1


def test_near_names_by_substring_or_similarity():
    known = ("collision_slop", "cone", "iterations", "contactSlop")
    assert near("slop", known) == "; near it: collision_slop, contactSlop"
    assert near("Cones", known) == "; near it: cone"
    assert near("iteration", known) == "; near it: iterations" and near("xyz", known) == ""


class Toy:
    """An engine that states kinds of some of its settings, and refuses two that do not go together."""

    name = "toy"
    former = MappingProxyType({"swing": "warm takes its place"})

    def settable(self):
        return {"sweeps": whole(1, 9), "warm": flag, "cone": word("round", "Square"), "off": words("a", "b")}

    def check_settings(self, settings):
        if settings.get("warm") and settings["sweeps"] > 5:
            raise EngineError("warm: needs fewer sweeps")


PROFILE = [Setting("sweeps", 2, ""), Setting("slop", 1.0, ""), Setting("word", "10", "")]


@pytest.mark.parametrize(
    ("text", "expected"),
    [("sweeps=3", 3), ("slop=10", 10.0), ("word=10", "10"), ("cone=square", "Square"), ("off=a", ("a",)),
     ("off=b,a", ("b", "a")), ("warm=true", True)],
)  # fmt: skip
def test_value_converted_to_the_engine_s_kind(text, expected):
    ((_, found),) = own(Toy(), given([text]), PROFILE)
    assert found == expected and type(found) is type(expected)


@pytest.mark.parametrize(
    ("texts", "said"),
    [(["sweep=3"], "set: toy has no setting 'sweep'; near it: sweeps; crosscheck describe toy lists all"),
     (["swing=3"], "set: toy has no setting 'swing'; warm takes its place; crosscheck describe toy lists all"),
     (["sweeps=10"], "set: sweeps=10: must be a whole number from 1 to 9"),
     (["sweeps=3.5"], "set: sweeps=3.5: must be a whole number from 1 to 9"),
     (["slop=tiny"], "set: slop=tiny: must be a finite number"),
     (["off=a,c"], "set: off=a,c: must be some of a, b, with commas between them"),
     (["warm=true", "sweeps=6"], "set: warm: needs fewer sweeps")],
)  # fmt: skip
def test_value_beyond_the_engine_refused_by_setting(texts, said):
    with pytest.raises(EngineError) as error:
        own(Toy(), given(texts), PROFILE)
    assert str(error.value) == said


@pytest.mark.parametrize("engine", HERE)
def test_every_setting_set_to_its_own_value(engine):
    found = registry.load(engine)
    for profile in found.profiles:
        settings = stock(engine, profile)
        assert settings
        for setting in settings:
            asked = ((setting.name, setting.value),)
            if setting.name not in found.settable() or not found.settable()[setting.name](setting.value):
                assert own(found, asked, settings) == asked
            else:  # a word of our own, as "reflect"
                with pytest.raises(EngineError, match=f"set: {setting.name}="):
                    own(found, asked, settings)


@pytest.mark.parametrize("engine", HERE)
def test_refusal_of_a_wrong_value_by_every_setting(engine):
    found = registry.load(engine)
    profile = next(iter(found.profiles))
    assert set(found.settable()) >= {s.name for s in stock(engine, profile)}
    for name in found.settable():
        with pytest.raises(EngineError, match=f"^set: {name}=no such value: must be "):
            own(found, ((name, "no such value"),), stock(engine, profile))


# ---- MuJoCo: all of its options --------------------------------------------------------------------------------------


def other(kind, value):
    """Another value that a setting may have; None where there is none."""
    tried = [3, 0.5, 7.0, 1, tuple(np.full(np.size(value), 0.25)), "dense", "elliptic", "implicit", "CG", (0.01, 2.0)]
    return next((each for each in tried if not kind(each) and np.any(np.asarray(each) != np.asarray(value))), None)


def test_mujoco_options_in_the_model_and_in_the_export():
    mujoco = pytest.importorskip("mujoco")
    from adapters.mujoco.options import ASKED_OTHERWISE, ENUMERATED, own_kinds
    from adapters.mujoco.releases import Mjcf
    from adapters.mujoco.spec import Spec

    plain = mujoco.MjModel.from_xml_string("<mujoco/>").opt
    options = {name for name in dir(plain) if not name.startswith("_")} - ASKED_OTHERWISE
    assert options <= set(own_kinds()) and len(options) > 20
    slot = Slot("bounce", (), 3, "mujoco", "default", DT)
    scene, engine, settings = prepare(slot).scene, registry.load("mujoco"), stock("mujoco", "default")
    for name in sorted(options):
        value = other(own_kinds()[name], getattr(plain, name) if name not in ENUMERATED else object())
        changed = dict(own(engine, ((name, value),), settings))
        values = {setting.name: setting.value for setting in settings} | changed
        written = Mjcf(mujoco)
        Spec(scene, DT, values, written)
        for model in (Spec(scene, DT, values).compile(), mujoco.MjModel.from_xml_string(written.text())):
            found = getattr(model.opt, name)
            if name in ENUMERATED:
                kind, prefix = ENUMERATED[name]
                found, value = getattr(mujoco, kind)(found).name, f"{prefix}{changed[name].upper()}"
            assert np.array_equal(found, value), name


def test_flags_of_mujoco_are_switched_by_their_names():
    mujoco = pytest.importorskip("mujoco")
    from adapters.mujoco.releases import Mjcf
    from adapters.mujoco.spec import Spec

    slot = Slot("bounce", (), 3, "mujoco", "default", DT)
    scene, engine, settings = prepare(slot).scene, registry.load("mujoco"), stock("mujoco", "default")
    changed = own(engine, given(["disabled=warmstart", "enabled=override,energy"]), settings)
    values = {setting.name: setting.value for setting in settings} | dict(changed)
    written = Mjcf(mujoco)
    Spec(scene, DT, values, written)
    for model in (Spec(scene, DT, values).compile(), mujoco.MjModel.from_xml_string(written.text())):
        assert model.opt.disableflags & int(mujoco.mjtDisableBit.mjDSBL_WARMSTART)
        on = int(mujoco.mjtEnableBit.mjENBL_OVERRIDE) | int(mujoco.mjtEnableBit.mjENBL_ENERGY)
        assert model.opt.enableflags == on


@pytest.mark.parametrize("engine", [name for name in HERE if name in ("bullet", "chipmunk")])
def test_settings_of_no_profile_reach_the_engine(engine, monkeypatch):
    """Each is set alone; a call with it must leave another world, or be among what the engine was called with."""
    found = registry.load(engine)
    profile = next(iter(found.profiles))
    settings = stock(engine, profile)
    slot = Slot("bounce", (), max(found.facts.dimensions), engine, profile, DT)
    stated = {setting.name for setting in settings}
    for name in sorted(set(found.settable()) - stated):
        value = other(found.settable()[name], object())
        partner = {"contactDamping": "contactStiffness", "contactStiffness": "contactDamping"}.get(name)
        if partner:
            with pytest.raises(EngineError, match="together with contactDamping only"):
                own(found, ((name, value),), settings)
        both = [(name, value)] + ([(partner, 1000)] if partner else [])
        values = {setting.name: setting.value for setting in settings} | dict(own(found, both, settings))
        world = found.build(prepare(slot).scene, DT, values)
        if engine == "chipmunk":
            assert getattr(world.space, name) == value
        else:
            assert value in {**world._world, **world._material}.values()
        world.advance(2)
        world.close()
