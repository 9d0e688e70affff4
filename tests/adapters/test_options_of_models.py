"""Options of a model become settings one by one; flags that change nothing are silent, others are said or refused."""

import pytest

pytest.importorskip("mujoco")

import mujoco

from adapters.mujoco import model as reading
from adapters.mujoco.options import CARRIED, MEASURING, SILENT
from adapters.scene import SceneError

BALL = '<body name="ball"><freejoint/><geom type="sphere" size=".1"/></body>'


def read(options="", flags=""):
    option = f"<option {options}>{f'<flag {flags}/>' if flags else ''}</option>"
    return reading.read(f"<mujoco>{option}<worldbody>{BALL}</worldbody></mujoco>", False)


def told(options="", flags=""):
    found = read(options, flags)
    assert all(each.because == "of the model" for each in found.settings if each.name not in ("smooth_condim", "apart"))
    return {each.name: each.value for each in found.settings if each.source.startswith("option/")}


def test_setting_and_place_of_every_option():
    options = ('timestep="0.004" integrator="RK4" cone="elliptic" impratio="3" iterations="17" tolerance="1e-5" '
               'noslip_iterations="2" solver="PGS"')  # fmt: skip
    values = {"integrator": "RK4", "cone": "elliptic", "impratio": 3.0, "iterations": 17, "tolerance": 1e-5,
              "noslip_iterations": 2, "solver": "PGS"}  # fmt: skip
    assert told(options) == values and read(options).dt == 0.004
    assert {s.name: s.source for s in read(options).settings if s.name in values} == {n: f"option/{n}" for n in values}
    kinds = {name: type(value) for name, value in told(options).items()}
    assert kinds == {name: type(value) for name, value in values.items()}


def test_options_missing_in_a_model_as_shipped():
    assert told() == {"integrator": "Euler", "cone": "pyramidal", "impratio": 1.0, "iterations": 100,
                      "tolerance": 1e-8, "noslip_iterations": 0, "solver": "Newton".upper()}  # fmt: skip
    assert read().dt == 0.002
    for said, name in (("implicit", "implicit"), ("implicitfast", "implicitfast"), ("Euler", "Euler")):
        assert told(f'integrator="{said}"')["integrator"] == name
    assert told('solver="CG"')["solver"] == "CG"


@pytest.mark.parametrize("option", ["density", "viscosity", "wind"])
def test_wind_and_water_options_refused(option):
    value = "0 0 1" if option == "wind" else "1"
    with pytest.raises(SceneError) as error:
        read(f'{option}="{value}"')
    assert str(error.value) == f"model: line 1: <option>: {option}: a scene has neither wind nor water"


def flags_of(kind, prefix):
    known = {bit.name.removeprefix(prefix).lower() for bit in kind.__members__.values()}
    return sorted(name for name in known if not name.startswith("mjn"))


DISABLED = flags_of(mujoco.mjtDisableBit, "mjDSBL_")
ENABLED = flags_of(mujoco.mjtEnableBit, "mjENBL_")


@pytest.mark.parametrize("flag", DISABLED)
def test_disabled_flag_silent_handed_on_or_refused(flag):
    try:
        found = told("", f'{flag}="disable"')
    except SceneError as error:
        if "does not compile" in str(error):
            pytest.skip("this release has another word for it")
        assert flag not in SILENT | CARRIED
        assert str(error) == f"model: line 1: <option>: {flag}: without it there are no contacts"
        return
    assert found.pop("disabled", ()) == ((flag,) if flag in CARRIED else ())
    assert flag in SILENT | CARRIED and found == told()
    gravity = read("", f'{flag}="disable"').scene.gravity
    assert gravity == ((0.0, 0.0, 0.0) if flag == "gravity" else (0.0, 0.0, -9.81))


@pytest.mark.parametrize("flag", ENABLED)
def test_enabled_flag_that_measures_or_is_refused(flag):
    try:
        found = told("", f'{flag}="enable"')
    except SceneError as error:
        if "does not compile" in str(error):
            pytest.skip("this release has another word for it")
        assert flag not in MEASURING
        assert str(error) == f"model: line 1: <option>: {flag}: a scene cannot express what it changes"
        return
    assert flag in MEASURING and found == told()


def test_several_flags_told_in_order_and_first_wrong_one_named():
    both = sorted(CARRIED & set(DISABLED))[:2]
    assert told("", " ".join(f'{flag}="disable"' for flag in both[::-1]))["disabled"] == tuple(both)
    with pytest.raises(SceneError, match=r"<option>: constraint: without it there are no contacts$"):
        read("", 'contact="disable" constraint="disable" warmstart="disable"')
