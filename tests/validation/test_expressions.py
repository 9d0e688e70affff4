"""Formulas of scene files: arithmetic and nothing else."""

import math

import pytest

from adapters.scene import SceneError
from validation.files.expressions import LONGEST, FormulaError, value_of
from validation.files.scene_files import canonical_from_text, stated_from_text

NAMES = {"pi": math.pi, "g": 9.81, "t": 0.5, "mu": 0.3}


@pytest.mark.parametrize(("formula", "value"), [
    (2, 2.0), ("2", 2.0), ("-1.5e-3", -1.5e-3), ("1 + 2 * 3 ** 2", 19.0), ("(1 + 2) * 3", 9.0), ("7 / 2", 3.5),
    ("mu * g * t", 0.3 * 9.81 * 0.5), ("- - +t", 0.5), ("sqrt(2 * g * 0.1)", math.sqrt(2 * 9.81 * 0.1)),
    ("atan2(1, 1) * 4 - pi", 0.0), ("max(1, 2, t) - min(0.25, t)", 1.75), ("2 ** -1", 0.5), ("abs(-3)", 3.0),
    ("hypot(3, 4)", 5.0), ("exp(log(2)) + sin(0) + cos(0) + tan(0) + asin(0) + acos(1) + atan(0)", 3.0), (" 1 ", 1.0),
])  # fmt: skip
def test_arithmetic(formula, value):
    assert value_of(formula, NAMES) == pytest.approx(value, abs=1e-15)


@pytest.mark.parametrize(("formula", "said"), [
    ("", "is no formula"), ("1 +", "is no formula"), ("1; 2", "is no formula"), ("x = 1", "is no formula"),
    ("nu * g", "'nu' is not one of g, mu, pi, t"), ("__import__('os')", "there is no function '__import__'"),
    ("().__class__", "only numbers"), ("t.real", "only numbers"), ("[1][0]", "only numbers"), ("'a'", "only numbers"),
    ("1 if t else 2", "only numbers"), ("lambda: 1", "only numbers"), ("True", "only numbers"), ("1j", "only numbers"),
    ("t < 1", "only numbers"), ("7 // 2", "only numbers"), ("7 % 2", "only numbers"), ("~1", "only numbers"),
    ("(t := 3)", "only numbers"), ("sqrt(x=1)", "only numbers"), ("sqrt(*t)", "only numbers"),
    ("f'{t}'", "only numbers"),
    ("sqrt(1, 2)", "sqrt takes 1 numbers"), ("max(1)", "max takes 2 to 8"), ("sqrt(-1)", "'sqrt(-1)'"),
    ("(-1) ** 0.5", "root of a negative"), ("1 / 0", "division by zero"),
    ("10 ** 400", "'10 ** 400': its value is too large"), ("9 ** 9 ** 9 ** 9", "too large"), ("exp(1e9)", "too large"),
    ("1e999", "is inf"), ("1e308 * 10", "is inf"), ("1e999 - 1e999", "is nan"),
    ("(" * 140 + "1" + ")" * 140, ""), ("1" * (LONGEST + 1), "longer than"), ("-" * 299 + "1", ""),
    ("\x00", "no formula"), ("9" * 299, ""),
])  # fmt: skip
def test_other_syntax_in_expressions_refused(formula, said):
    try:
        found = value_of(formula, NAMES)
    except FormulaError as error:
        assert said in str(error) and len(str(error).splitlines()) == 1, error
    else:
        assert said == "" and math.isfinite(found)


FILE = """
name = "drop"
dimension = 2
gravity = [0.0, -9.81]
duration = 0.5
{constants}
[[bodies]]
name = "ball"
shape = {{ type = "disc", radius = 0.5 }}
pose = [0.0, 3.0, 0.0]
[[checks]]
{check}
"""


def read(tmp_path, check, constants=""):
    return stated_from_text(FILE.format(check=check, constants=constants), tmp_path / "drop.toml")


def test_formulas_of_value_and_tolerance_in_constants(tmp_path):
    check = 'quantity = "ball.y"\nvalue = "h - fall"\ntolerance = "g * t * dt"\nbecause = "free fall"'
    text = FILE.format(check=check, constants='[constants]\nh = 3.0\nfall = "0.5 * g * 0.5 ** 2"')
    found = stated_from_text(text, tmp_path / "drop.toml")
    assert found.checks[0].value == pytest.approx(3.0 - 0.5 * 9.81 * 0.25)
    canonical = canonical_from_text(text, tmp_path / "drop.toml")
    for dt in (0.1, 0.001):
        (judged,) = [c for c in canonical.checks(canonical.scene(2), dt) if c.metric == "final[ball.y]"]
        assert judged.truth == found.checks[0].value and judged.bound == pytest.approx(9.81 * 0.5 * dt)
    from validation.files.stated import stated_from_dict

    assert stated_from_dict(found.as_dict()) == found


@pytest.mark.parametrize(("check", "constants", "said"), [
    ('quantity = "ball.y"\nvalue = "h"\ntolerance = 1.0', "", "checks.0.value: 'h': 'h' is not one of g, pi, t"),
    ('quantity = "ball.y"\nvalue = "dt"\ntolerance = 1.0', "", "checks.0.value: 'dt': 'dt' is not one of"),
    ('quantity = "ball.y"\nvalue = 1\ntolerance = "-dt"', "", "checks.0.tolerance: '-dt' is not greater than 0"),
    ('quantity = "ball.y"\nvalue = 1\ntolerance = "dt - 0.5"', "", "checks.0.tolerance: 'dt - 0.5' is not greater"),
    ('quantity = "ball.y"\nvalue = 1\ntolerance = 0.0', "", "drop.toml: checks.0.tolerance: must be greater than 0"),
    ('quantity = "ball.y"\nvalue = [1]\ntolerance = nan', "",
     "checks.0.value: must be a number; checks.0.tolerance: must be a finite number"),
    ('quantity = "ball.y"\nvalue = 1\ntolerance = 1\nstr = 1', "", "checks.0.str: there is no such field"),
    ('quantity = "ball.y"\nvalue = 1\ntolerance = 1', "[constants]\nstr = true", "constants.str: must be a number"),
    ('quantity = "ball.y"\nvalue = 1\ntolerance = 1', "[constants]\ng = 1.0", "constants.g: cannot be the name"),
    ('quantity = "ball.y"\nvalue = 1\ntolerance = 1', '[constants]\na = "b"\nb = 1', "constants.a: 'b': 'b' is not"),
    ('quantity = "ball.y"\nvalue = 1\ntolerance = 1', "[constants]\nsqrt = 1.0", "constants.sqrt: cannot be the name"),
])  # fmt: skip
def test_invalid_check_refused_with_its_path(tmp_path, check, constants, said):
    with pytest.raises(SceneError) as refusal:
        read(tmp_path, check, constants)
    assert said in str(refusal.value) and len(str(refusal.value).splitlines()) == 1


def test_all_errors_of_a_check_told_at_once(tmp_path):
    text = FILE.format(check='quantity = "box.y"\nvalue = "q"\ntolerance = 1', constants="[constants]\npi = 3.0")
    text = (
        text.replace("radius = 0.5", "radius = -0.5")
        + '[[bodies]]\nname = "b"\nmass = -1.0\nshape = { type = "disc", radius = 1.0 }\n'
    )
    with pytest.raises(SceneError) as refusal:
        stated_from_text(text, tmp_path / "drop.toml")
    for said in ("ball.shape.radius", "b.mass", "constants.pi", "checks.0.quantity: 'box.y' names no body"):
        assert said in str(refusal.value)
