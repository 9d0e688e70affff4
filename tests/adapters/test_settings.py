"""What a setting may be: each kind takes what it says in words, and nothing beside it."""

import math

import pytest

from adapters import registry
from adapters.engine import EngineError
from adapters.needs import needs
from adapters.settings import checked, checked_step, flag, number, whole, word
from adapters.stepping import posed_for
from validation.catalogue import CATALOGUE

KINDS = {"iterations": whole(1, 20), "skin": number(0.0, 0.5), "warm": flag, "solver": word("PGS", "Newton")}
GOOD = {"iterations": 4, "skin": 0.01, "warm": True, "solver": "Newton"}


def test_valid_value_handed_on_as_a_copy():
    found = checked("toy", KINDS, GOOD)
    assert found == GOOD and found is not GOOD


@pytest.mark.parametrize(
    ("name", "value"),
    [("iterations", 1), ("iterations", 20), ("skin", 0), ("skin", 0.0), ("skin", 0.5), ("warm", False),
     ("solver", "PGS")],
)  # fmt: skip
def test_inclusive_range_ends_and_words(name, value):
    assert checked("toy", KINDS, GOOD | {name: value})[name] == value


@pytest.mark.parametrize(
    ("name", "value", "wanted"),
    [
        *(("iterations", v, "a whole number from 1 to 20") for v in (0, 21, True, 4.0, "4", None)),
        *(("skin", v, "a number from 0 to 0.5") for v in (-1e-9, 0.51, True, "0.1", None, math.nan, math.inf, 10**400)),
        *(("warm", v, "true or false") for v in (0, 1, "true", None)),
        *(("solver", v, "one of PGS, Newton") for v in ("pgs", "", 1, None, ["PGS"])),
    ],
)
def test_refusal_of_a_wrong_value_by_setting_and_allowed_values(name, value, wanted):
    with pytest.raises(EngineError) as refused:
        checked("toy", KINDS, GOOD | {name: value})
    assert str(refused.value) == f"{name}: {value!r} must be {wanted}"


def test_refusal_of_an_unknown_or_missing_setting():
    with pytest.raises(EngineError, match=r"^sweeps: toy has no such setting, it has iterations, skin, warm, solver$"):
        checked("toy", KINDS, GOOD | {"sweeps": 3})
    with pytest.raises(EngineError, match=r"^skin: this setting is missing$"):
        checked("toy", KINDS, {name: value for name, value in GOOD.items() if name != "skin"})


def test_range_of_a_step():
    assert checked_step(1 / 240) == 1 / 240 and checked_step(5e-324) == 5e-324
    for dt in (0.0, -1 / 240, math.nan, math.inf):
        with pytest.raises(EngineError, match=r"^dt: .* must be a positive, finite number of seconds$"):
            checked_step(dt)


#: Settings that engines take as an int of C.
INTS = {
    "chipmunk": {"iterations", "collision_persistence"},
    "bullet": {"iterations", "useMaximalCoordinates", "deterministicOverlappingPairs", "numSubSteps"},
    "mujoco": {"iterations", "noslip_iterations", "rounds"},
    "reference": set(),
}


@pytest.mark.parametrize("name", INTS)
def test_refusal_of_a_number_beyond_the_engine_s_range(name):
    """What is asked from code: a number beyond an int or a double ended in the binding's own error, or in none."""
    engine = registry.find(name).engine
    if engine is None:
        pytest.skip(registry.find(name).reason)
    scene, asked, found = posed_for(engine, CATALOGUE["impact"].scene(2, {})), 0, set()
    for profile in engine.profiles:
        given = {setting.name: setting.value for setting in engine.settings(profile, needs(scene), 1 / 240)}
        numbers = {setting for setting, value in given.items() if type(value) in (int, float)}
        assert numbers
        for setting in numbers:
            for value in (10**400, *(2**31, 2.0**31, 0.5, 1e300) * (setting in INTS[name])):
                with pytest.raises(EngineError) as refused:
                    engine.build(scene, 1 / 240, given | {setting: value})
                assert setting in str(refused.value).partition(":")[0], refused.value
                asked += 1
        found |= numbers & INTS[name]
    assert asked > 4 and found == INTS[name]
