"""What comes from outside becomes plain: short, visible, JSON-ready, and the same when it is made plain again."""

import json
import math

import numpy as np
import pytest

from adapters.plain import LEVELS, NAME, REASON, SIZE, is_visible, lines, one_line, plain


class Mute:
    def __str__(self):
        raise KeyboardInterrupt


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("one\ntwo", "one"),
        ("\n \n  two  \n", "two"),
        ("a\tb", "a b"),
        ("\x1b[31mred\x07", "\\u{1b}[31mred\\u{7}"),
        ("\u202egnirts", "\\u{202e}gnirts"),
        ("lone \ud800", "lone \\u{d800}"),
        ("mu \u2264 \u00e9", "mu \u2264 \u00e9"),
        ("", ""),
        (7, "7"),
        (None, "None"),
        (Mute(), "a Mute without a text"),
    ],
)
def test_a_line_is_visible_and_one(text, line):
    assert one_line(text) == line
    assert is_visible(one_line(text))


def test_text_is_capped_and_stays_so():
    long = one_line("x" * 10**7)
    assert len(long) == REASON and long.endswith(" ...")
    assert one_line(long) == long
    assert lines("a\n" * 1000 + "\x1b\nlast", 2) == "\\u{1b}\nlast"


def nested(depth):
    return [] if depth == 0 else [nested(depth - 1)]


def cyclic():
    table = {}
    table["me"] = table
    return table


@pytest.mark.parametrize(
    "value",
    [
        {1: math.nan, "b": {2}, "c": Mute(), "d": np.float32(3), "e": 10**400, "f": "\x00", "g": -math.inf, "h": True},
        np.arange(6.0).reshape(2, 3),
        np.zeros(10**7),
        nested(3 * LEVELS),
        cyclic(),
        [["x" * 10**4] * 1000] * 1000,
        {str(k) * 50: "x" * 1000 for k in range(10**5)},
        b"\xff\x00",
        object(),
    ],
    ids=["odd", "array", "large array", "deep", "cyclic", "wide", "table", "bytes", "object"],
)
def test_whatever_it_is_it_becomes_small_json_and_stays_so(value):
    made = plain(value)
    text = json.dumps(made, allow_nan=False)
    assert len(text) < 3 * SIZE
    assert json.dumps(plain(json.loads(text))) == text


def test_what_is_plain_stays_as_it_is():
    data = {"mass": 1.5, "n": 3, "on": True, "off": None, "names": ["a", "b"], "deep": {"x": [1.0, {"y": "z"}]}}
    assert plain(data) == data
    assert len(one_line("n" * 200, NAME)) == NAME
