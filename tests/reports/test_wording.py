"""Words and numbers, one by one: units, escapes, commands that run again what they name, ids that stay."""

import hashlib
import json
import shlex

import pandas as pd
import pytest
from markdown_it import MarkdownIt
from markdown_it.common.utils import escapeHtml

from adapters import registry
from reports.wording import (
    ROLE_WORDS,
    called,
    cell,
    csv_of,
    first_of,
    mark_of,
    markdown,
    measured,
    number,
    params_text,
    plural,
    profiles_called,
    quantity,
    reproduce,
    roles_line,
    row_id,
)  # fmt: skip
from validation.catalogue import CATALOGUE

SLOT = {"scene": "impact", "params": {"e": 0.8, "v": 6.0}, "dimension": 2, "engine": "chipmunk", "profile": "tuned",
        "dt": 1 / 240, "iterations": None, "ulp": 0}  # fmt: skip


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (0.123456, "m/s", "0.1235 m/s"),
        (0.123456, "1", "0.1235"),
        (None, "m", "-"),
        (None, "1", "-"),
        (1.0, "m/s", "1 m/s"),
        (1.0, "N s", "1 N s"),
        (0.5, "weights", "0.5 weights"),
        (1.0, "weights", "1 weight"),
    ],
)
def test_unit_of_a_quantity(value, unit, text):
    assert quantity(value, unit) == text


def test_four_digits_by_default():
    assert number(0.123456789) == "0.1235"
    assert number(0.123456789, 6) == "0.123457"
    assert quantity(0.123456789, "m", 6) == "0.123457 m"
    row = {"value": 0.123456789, "unit": "m", "reason": ""}
    assert (measured(row), measured(row, 6)) == ("0.1235 m", "0.123457 m")


@pytest.mark.parametrize(
    ("value", "truth", "unit", "physics", "said"),
    [(1.751000003, 1.751, "rad/s", "fail", "1.751 + 3.0e-9 rad/s"), (0.999999, 1.0, "1", "fail", "1 - 1.0e-6"),
     (-1.751000003, -1.751, "rad/s", "fail", "-1.751 - 3.0e-9 rad/s"), (1.752, 1.751, "rad/s", "fail", "1.752 rad/s"),
     (1.751000003, 1.751, "rad/s", "pass", "1.751 rad/s"), (1.751, 1.751, "rad/s", "fail", "1.751 rad/s")],
)  # fmt: skip
def test_failing_value_printed_like_its_truth_with_its_error(value, truth, unit, physics, said):
    row = {"value": value, "truth": truth, "error": value - truth, "unit": unit, "physics": physics, "reason": ""}
    assert measured(row) == said


def test_first_of_many_names():
    assert (first_of([]), first_of(list("abcd"))) == ("", "a, b, c, d")
    assert first_of(list("abcdef")) == "a, b, c, d and 2 more"


def test_digits_of_a_plain_number():
    assert number(1.234567891, 9) == "1.23456789"


@pytest.mark.parametrize(
    ("raw", "shown"),
    [("a & b", "a &amp; b"), ("<b>", "&lt;b&gt;"), ("a|b", "a\\|b"), ("&lt;", "&amp;lt;"), ("plain", "plain")],
)
def test_markdown_shows_text_literally(raw, shown):
    assert markdown(raw) == shown


@pytest.mark.parametrize(
    "text",
    ["![pixel](http://evil.example/x.png)", "[here](http://evil.example)", "[a]: http://evil.example", "**bold**",
     "~~gone~~", "`code`", "_so_", "http://evil.example", "www.evil.example", "me@evil.example", "<b>", "\\[a](b)",
     "final[ball.y] of drop.toml@3f2a9c1d"],
)  # fmt: skip
def test_markdown_of_a_name(text):
    """It is shown as text: without an image, a link, or emphasis."""
    shown = MarkdownIt().enable("strikethrough").render(f"* {markdown(text)}")
    assert not any(begin in markdown(text) for begin in ("://", "www.", "me@evil"))
    assert shown.replace("\u200b", "") == f"<ul>\n<li>{escapeHtml(text)}</li>\n</ul>\n"


def test_markdown_of_a_person_s_name():
    """A mark without width parts it from the @, so that nobody is told."""
    assert markdown("@everyone and (@team/x)") == "@&#8203;everyone and (@&#8203;team/x)"


@pytest.mark.parametrize("begin", ["=", "+", "-", "@", "\t", "\r"])
def test_spreadsheet_formulas_quoted(begin):
    assert cell(f"{begin}cmd") == f"'{begin}cmd"


@pytest.mark.parametrize("value", ["-", "-1.5", "+2e-3", "plain", "", 1.5, None, True])
def test_numbers_dashes_and_other_text_are_no_formulas(value):
    assert cell(value) is value


def test_parameters_are_named_and_parted_by_a_space():
    assert params_text({"e": 0.8, "height": 1.03}) == "e=0.8 height=1.03"
    assert params_text({}) == ""


@pytest.mark.parametrize("outcome", ["crashed", "timed_out", "missing", "invalid", "not_installed"])
def test_mark_of_a_cell_without_an_answer(outcome):
    assert mark_of({"outcome": outcome, "physics": None, "standing": None}) == outcome


def options_of(command):
    words = shlex.split(command)
    assert words[:2] == ["crosscheck", "run"]
    return words[2], list(zip(words[3::2], words[4::2], strict=True))


def test_command_with_every_question_of_a_row():
    scene, options = options_of(reproduce({**SLOT, "iterations": 20}))
    assert scene == "impact"
    assert options == [
        ("--param", "e=0.8"), ("--param", "v=6"), ("--dim", "2"), ("--engine", "chipmunk"), ("--profile", "tuned"),
        ("--dt", "1/240"), ("--iterations", "20")]  # fmt: skip
    assert "--iterations" not in dict(options_of(reproduce(SLOT))[1])


@pytest.mark.parametrize("value", [0.1 + 0.2, 1 / 3, 0.8, 6.0, 1e-300])
def test_exact_parameter_in_a_command(value):
    _, options = options_of(reproduce({**SLOT, "params": {"e": value}}))
    assert float(dict(options)["--param"].partition("=")[2]) == value


def test_command_of_default_parameters():
    _, options = options_of(reproduce({**SLOT, "params": {}}))
    first = CATALOGUE["impact"].parameters[0]
    assert [value for name, value in options if name == "--param"] == [f"{first.name}={first.default:.12g}"]


def test_row_id_of_eight_digits_from_the_question_alone():
    row = {"slot": SLOT, "metric": "rebound_ratio", "value": 0.1, "run": "one"}
    text = json.dumps([SLOT, "rebound_ratio"], sort_keys=True)
    assert row_id(row) == hashlib.sha256(text.encode()).hexdigest()[:8]
    turned = dict(reversed(list(SLOT.items())))
    assert row_id({"slot": turned, "metric": "rebound_ratio", "value": 0.2, "run": "two"}) == row_id(row)
    assert row_id({**row, "metric": "impulse"}) != row_id(row) != row_id({**row, "slot": {**SLOT, "dimension": 3}})


@pytest.mark.parametrize(
    ("count", "noun", "text"),
    [(1, "row", "1 row"), (0, "row", "0 rows"), (2, "row", "2 rows"), (1, "family", "1 family"),
     (3, "family", "3 families"), (2, "day", "2 days")],
)  # fmt: skip
def test_plural_of_nouns(count, noun, text):
    assert plural(count, noun) == text


# ---- profiles by role ------------------------------------------------------------------------------------------------


def test_profile_by_name_or_role():
    ours, engines = registry.solver(), registry.names()
    for engine in engines:
        for name, role in registry.facts(engine).roles.items():
            for word in (name, role, ROLE_WORDS[role]):
                assert name in profiles_called([word], [engine])
    assert profiles_called(["exact", "textbook"], [ours]) == ["reference", "classical"]
    assert profiles_called(["as shipped", "default"], ["mujoco", "bullet"]) == ["default"]
    assert profiles_called(["compromise"], ["mujoco", "bullet"]) == ["one"]
    assert profiles_called(["of nobody"], engines) == ["of nobody"]
    assert profiles_called([], engines) == []


def test_line_that_explains_profile_names():
    columns = [("mujoco", "default"), ("mujoco", "tuned"), ("bullet", "default"), ("bullet", "one"), ("nobody", "x"),
               ("mujoco", "default+cone=elliptic")]  # fmt: skip
    assert roles_line(columns) == "Profiles: default: as shipped; one: compromise."
    assert roles_line([("mujoco", "tuned"), ("nobody", "x")]) == ""


def test_own_files_in_tables():
    """The path and the hash of its text told nothing, and pushed the counts into a further table."""
    one, other, named = "/my/ball.toml@0123abcd", "/your/ball.json@89abcdef", "/my/bounce.toml@11111111"
    assert called(["bounce", one]) == {"bounce": "bounce", one: "ball"}
    assert called([one, other]) == {one: one, other: other}
    assert called([named]) == {named: named}, "a scene of the catalogue has the name"


def test_a_formula_in_a_table():
    table = pd.DataFrame({"name": ["=cmd()", "-1", "plain"], "@x": [1.0, -2.5, 3.0]})
    assert csv_of(table) == "name,'@x\n'=cmd(),1.0\n-1,-2.5\nplain,3.0\n"
