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
def test_line_made_visible_and_single(text, line):
    assert one_line(text) == line
    assert is_visible(one_line(text))


def test_length_limit_of_text():
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
def test_arbitrary_object_as_small_json(value):
    made = plain(value)
    text = json.dumps(made, allow_nan=False)
    assert len(text) < 3 * SIZE
    assert json.dumps(plain(json.loads(text))) == text


def test_plain_values_unchanged():
    data = {"mass": 1.5, "n": 3, "on": True, "off": None, "names": ["a", "b"], "deep": {"x": [1.0, {"y": "z"}]}}
    assert plain(data) == data
    assert len(one_line("n" * 200, NAME)) == NAME


@pytest.mark.parametrize(
    ("value", "made"),
    [
        (2**63 - 1, 2**63 - 1),
        (-(2**63) + 1, -(2**63) + 1),
        (2**63, "0x8000000000000000"),
        (10**18, 10**18),
        (-(2**63), "-0x8000000000000000"),
        (math.nan, "nan"),
        (-math.inf, "-inf"),
        (np.float64(math.inf), "inf"),
    ],
)
def test_number_too_large_for_json_as_text(value, made):
    assert plain(value) == made and type(plain(value)) is type(made)


class Listed:
    """Behaves like an array of numpy: it can be listed, and says how large it is."""

    def __init__(self, size):
        self.size = size

    def tolist(self):
        return [1.5, 2.5]

    def __str__(self):
        return "too large"


class Sizeless:
    def tolist(self):
        return [1.5]

    def __str__(self):
        return "of no known size"


def test_list_of_a_large_or_unsized_collection():
    assert plain(Listed(2)) == [1.5, 2.5]
    assert plain(Listed(SIZE - 1)) == [1.5, 2.5]
    assert plain(Listed(SIZE)) == "too large"
    assert plain(Sizeless()) == "of no known size"


@pytest.mark.parametrize("nest", [lambda inner: [inner], lambda inner: {"a": inner}])
def test_nesting_levels_counted_from_the_outermost(nest):
    value = 1.5
    for _ in range(LEVELS):
        value = nest(value)
    assert plain(value) == value  # as deep as may be
    deeper = plain(nest(value))
    for _ in range(LEVELS):
        deeper = deeper["a"] if isinstance(deeper, dict) else deeper[0]
    assert isinstance(deeper, str)  # what is deeper is its text
    numbers = np.array([1.5])
    for _ in range(LEVELS - 1):
        numbers = nest(numbers)
    assert isinstance(plain(nest(numbers)), dict | list)
    bottom = plain(numbers)
    for _ in range(LEVELS - 1):
        bottom = bottom["a"] if isinstance(bottom, dict) else bottom[0]
    assert bottom == [1.5]
    array = np.array([1.5, 2.5])
    text, nested = str(array), array
    for _ in range(LEVELS):
        nested = nest(nested)
    bottom = plain(nested)
    for _ in range(LEVELS):
        bottom = bottom["a"] if isinstance(bottom, dict) else bottom[0]
    assert bottom == text == "[1.5 2.5]"  # below the last level its text, as of anything else


def test_beginning_kept_of_a_collection_that_is_too_large():
    # A word of n characters counts for n + 1, a number for 20.
    half = "x" * 400
    many = [half] * (2 * SIZE // 401)
    assert len(plain(many)) == math.ceil(SIZE / 401)
    exactly = ["x" * 63] * (SIZE // 64)
    assert len(plain([*exactly, "one more"])) == len(exactly)
    assert len(plain([*exactly[1:], "x" * 62, "one more"])) == len(exactly) + 1
    table = plain({f"{k:063d}"[-63:]: "y" * 63 for k in range(SIZE)})
    assert len(table) == SIZE // 128
    words = {f"{k:063d}": "y" * 63 for k in range(SIZE // 128)}
    assert list(plain({**words, "one": "more"})) == list(words)
    short = {**words, f"{SIZE // 128 - 1:063d}": "y" * 62}
    assert list(plain({**short, "one": "more", "two": "more"})) == [*short, "one"]
    both = plain({"first": many, "second": [1.0]})
    assert list(both) == ["first"]


def test_first_line_of_a_long_text_without_reading_its_end():
    assert one_line("\n" * (8 * REASON) + "late") == ""
    assert one_line("\n" * (8 * REASON - 4) + "late") == "late"


def test_longest_text_uncut_and_keys_as_names():
    assert one_line("x" * REASON) == "x" * REASON
    assert one_line("x" * (REASON + 1)) == "x" * (REASON - 4) + " ..."
    assert list(plain({"k" * (NAME + 1): 1})) == ["k" * (NAME - 4) + " ..."]


class Liar(str):
    """A text that says another one when it is asked for its text."""

    def __str__(self):
        return "something else"


def test_text_treated_as_data_whatever_its_content():
    assert one_line(Liar("what it holds")) == "what it holds"


def test_text_of_exactly_the_shown_length_uncut():
    for letter in "aé":
        assert one_line(letter * NAME, NAME) == letter * NAME
        assert one_line(letter * (NAME + 1), NAME) == letter * (NAME - 4) + " ..."
