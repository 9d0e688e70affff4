"""Tables themselves: what is written is read back, what differs is told, what machines may differ by is not."""

import pytest
from made import tables
from screens import SCREENS
from telling import ABSENT, KEPT, agree, as_text, check, differences, from_text, screen_differences, section

CELLS = {
    "2-D": {"mass": "1", "place": "(0, 0.5)", "says": "rests at r"},
    "2-D e=1": {"mass": "1", "place": "(0, 1)", "bounces": "3"},
    "3-D e=1": {"mass": "1", "place": "(0, 0, 1)", "bounces": "3"},
    "beside": {"cells": "2"},
}


def test_table_read_back_with_differences_of_later_cells():
    text = as_text(CELLS)
    assert from_text(text) == CELLS
    assert text.count("mass = 1") == 1 and f"says = {ABSENT}" in text
    assert text.split("[3-D e=1]\n")[1].split("\n[")[0] == "place = (0, 0, 1)"


@pytest.mark.parametrize(
    ("told", "kept", "same"),
    [
        ("1.00000000001", "1", True), ("1.0001", "1", False), ("1e-16", "0", True), ("1e-8", "0", False),
        ("3 balls", "3 bolls", False), ("at 0.1 +- 0.01", "at 0.1 +- 0.02", False), ("None", "0", False),
        ("(0, 1)", "(0, 1, 2)", False), ("x2", "x3", False),
    ],
)  # fmt: skip
def test_numbers_agree_to_nine_digits_and_words_to_the_letter(told, kept, same):
    assert agree(told, kept) is same


def test_difference_told_with_both_values():
    made = {**CELLS, "2-D": {**CELLS["2-D"], "mass": "2"}}
    del made["beside"]
    assert differences(made, CELLS) == ["[2-D] mass: 1 -> 2", "[beside] is gone"]
    assert differences(CELLS, CELLS) == []


def test_changed_table_fails_with_its_command():
    name = "scenes/hilltop"
    kept = from_text((KEPT / f"{name}.txt").read_text(encoding="utf-8"))
    check(name, lambda: kept)
    wrong = {title: dict(own) for title, own in kept.items()}
    wrong["2-D"]["scene.duration"] = "1"
    with pytest.raises(AssertionError, match=r"1 lines of scenes/hilltop are others. If that is meant: make tables"):
        check(name, lambda: wrong)


def test_duplicate_line_names_are_an_error():
    with pytest.raises(ValueError, match=r"two lines are called a\.b"):
        section(**{"a": {"b": 1}, "a.b": 2})


def test_every_kept_table_has_a_generator():
    kept = {str(path.relative_to(KEPT).with_suffix("")) for path in KEPT.rglob("*.txt")}
    made = set(tables()) | set(SCREENS)
    assert made <= kept
    # Settings of engines that are not installed here are kept as well.
    assert {name.partition("/")[0] for name in kept - made} <= {"settings"}


def test_changes_of_the_first_spatial_cell_expected_of_later_ones():
    cells = {
        "2-D": {"gravity": "(0, -1)", "place": "(0, 0.5)", "turn": "0"},
        "3-D": {"gravity": "(0, 0, -1)", "place": "(0, 0, 0.5)", "axes": "4"},
        "2-D e=1": {"gravity": "(0, -1)", "place": "(0, 1)", "turn": "0"},
        "3-D e=1": {"gravity": "(0, 0, -1)", "place": "(0, 0, 1)", "axes": "4"},
        "2-D e=2": {"gravity": "(0, -2)", "place": "(0, 0.5)"},
        "3-D e=2": {"gravity": "(0, 0, -2)", "place": "(0, 0, 0.5)", "turn": "0"},
    }
    text = as_text(cells)
    assert from_text(text) == cells
    assert text.split("[3-D e=1]\n")[1].split("\n[")[0] == "place = (0, 0, 1)"


def test_screen_agreement_to_last_digits_and_other_lines():
    kept = "row a\nerror 1.00000001e-3 m\nend\n"
    assert screen_differences("row a\nerror 1.00000002e-3 m\nend\n", kept) == []
    assert screen_differences("row a\nerror 2e-3 m\nend\n", kept) == ["-error 1.00000001e-3 m", "+error 2e-3 m"]
    assert screen_differences("row a\nend\n", kept) == ["-error 1.00000001e-3 m"]


def test_width_of_a_narrow_band_kept():
    def same(told, kept="0.5 +- 1e-13"):
        return agree(told, kept, share=1e-7, nothing=1e-10)

    assert same("0.5 +- 1.1e-13") and same("0.50000000001 +- 1e-13")
    assert same("0.5 +- 1e-12") and not same("0.5 +- 4e-12") and not same("0.5 +- 3e-15") and not same("0.5 +- 0")
    assert same("0.5 +- 1.00000001e-3", "0.5 +- 1e-3") and not same("0.5 +- 1.1e-3", "0.5 +- 1e-3")
    assert same("1e-14 +- 1e-12", "4e-14 +- 1e-12") and not same("1e-12 +- 1e-12", "2e-12 +- 1e-12")
    assert same("says nothing", "says nothing") and not same("says nothing")
    assert not agree("1 +- 2e-17", "1 +- 1e-15") and agree("None +- 1", "None +- 1.0")
