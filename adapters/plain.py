"""Converts data from outside to plain data: short text without control characters, numbers, lists, tables.

Engines, plugins and scene files provide names, reasons, versions and readbacks, which end in a terminal, in XML, in a
table or on a page. They are cleaned where they enter, so output need not do it.
"""

from __future__ import annotations

import math
import unicodedata
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pydantic import ValidationError


class Notice(UserWarning):
    """What a user must know while a command goes on; one line, which commands print."""


#: Longest reason [characters]: three lines of a wide terminal.
REASON = 500
#: Longest name or version [characters] for a column.
NAME = 80
#: Most characters and levels of a table that an engine reads back; real ones have some thousand, three deep.
SIZE, LEVELS = 2**18, 8
#: Wrong fields that are named; the rest are counted.
MOST_ERRORS = 10
#: Characters counted for a number.
NUMBER = 20
#: Categories of Unicode that are invisible or control the display: control, format (which changes the writing
#: direction), lone surrogates, private use, unassigned (XML allows some of these, no terminal shows them), and line and
#: paragraph separators.
_STEERING = frozenset(("Cc", "Cf", "Cs", "Co", "Cn", "Zl", "Zp"))


#: Types that are already plain, if a number is finite and a text is one line.
SCALARS = frozenset((str, float, int, bool, type(None)))


def one_line(text: Any, most: int = REASON) -> str:
    """First nonempty line of ``text``, with control characters as escapes, at most ``most`` characters."""
    if type(text) is str and len(text) <= most and text.isascii() and text.isprintable():
        return text.strip()  # already a clean line, as most are
    whole = _as_text(text, 8 * most)
    return _cut(_visible(next((line for line in whole.splitlines() if line.strip()), "").strip()), most)


def lines(text: str, count: int, most: int = REASON) -> str:
    """Last ``count`` lines of ``text``, each cleaned as by `one_line`."""
    return "\n".join(_cut(_visible(line), most) for line in text.splitlines()[-count:])


def kind_of(value: Any) -> str:
    """``an int``, ``a list``, ``None``: what was given, for an error."""
    name = one_line(type(value).__name__, NAME)
    return "None" if value is None else f"{'an' if name[:1].lower() in tuple('aeiou') else 'a'} {name}"


def is_visible(text: str) -> bool:
    """Whether ``text`` has no characters that `one_line` would escape."""
    return not any(unicodedata.category(c) in _STEERING for c in text)


def plain(value: Any) -> Any:
    """``value`` as JSON-ready data: other types become text; NaN and inf become words.

    Of too large data the beginning is kept.
    """
    return _plain(value, 0, [SIZE])


def _plain(value: Any, level: int, left: list[int]) -> Any:
    """Plain data of at most ``left[0]`` characters, which is reduced by them."""
    kind = type(value)  # most values are of a few types; a test by abstract base classes takes ten times as long
    if kind is str:
        text = one_line(value)
        left[0] -= len(text) + 1
        return text
    if kind is float and math.isfinite(value):
        left[0] -= NUMBER
        return value
    if kind in SCALARS:
        return _counted(_scalar(value), left)
    if (kind is dict or isinstance(value, Mapping)) and level < LEVELS:
        table = {}
        for key, item in value.items():
            if left[0] <= 0:
                break
            name = _counted(one_line(key, NAME), left)
            table[name] = _plain(item, level + 1, left)
        return table
    if isinstance(value, list | tuple | set | frozenset) and level < LEVELS:
        items = []
        for item in value:
            if left[0] <= 0:
                break
            items.append(_plain(item, level + 1, left))
        return items
    if hasattr(value, "tolist") and getattr(value, "size", SIZE) < SIZE and level < LEVELS:
        return _plain(value.tolist(), level, left)  # arrays and numbers of numpy
    return _counted(_scalar(value), left)


def _counted(value: Any, left: list[int]) -> Any:
    left[0] -= len(value) + 1 if isinstance(value, str) else NUMBER
    return value


def _scalar(value: Any) -> Any:
    if value is None or isinstance(value, bool):
        return value
    if isinstance(value, int):
        return int(value) if abs(value) < 2**63 else one_line(hex(value))
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else str(float(value))
    return one_line(value)


def _as_text(value: Any, most: int) -> str:
    """Text of any object; the name of its type if it has none."""
    try:
        return (value if isinstance(value, str) else str(value))[:most]
    except BaseException:
        return f"{kind_of(value)} without a text"


def _visible(text: str) -> str:
    if text.isascii() and text.isprintable():
        return text
    return "".join(_escaped(c) if unicodedata.category(c) in _STEERING else c for c in text)


def _escaped(character: str) -> str:
    return " " if character == "\t" else f"\\u{{{ord(character):x}}}"


def _cut(text: str, most: int) -> str:
    return text if len(text) <= most else text[: most - 4] + " ..."


def wrong_fields(errors: ValidationError, whole: str) -> str:
    """All fields that pydantic found wrong in one line, or the first few; ``whole`` is the name of all of it."""
    found = errors.errors(include_url=False, include_input=False)
    # A number or a formula: pydantic has an error for each of both types, with the type as the last part of the place.
    formulas = [e for e in found if e["type"] == "string_type" and e["loc"][-1:] == ("str",)]
    either = {e["loc"][:-1] for e in formulas}
    places = [(e["loc"][:-1] if e["loc"][:-1] in either else e["loc"], e) for e in found if e not in formulas]
    return listed([one_line(f"{'.'.join(map(str, place)) or whole}: {_in_words(e)}") for place, e in places])


def _in_words(error: Mapping[str, Any]) -> str:
    """What is wrong with a field, for somebody who knows the text and not pydantic."""
    told = error.get("ctx", {})
    words = {
        "missing": "is missing",
        "extra_forbidden": "there is no such field",
        "float_type": "must be a number",
        "int_type": "must be a whole number",
        "string_type": "must be a text",
        "finite_number": "must be a finite number",
        "greater_than": f"must be greater than {told.get('gt', 0):g}",
        "greater_than_equal": f"must be at least {told.get('ge', 0):g}",
        "tuple_type": "must be a list",
        "dict_type": "must be a table",
        "model_type": "must be a table",
        "literal_error": f"must be {told.get('expected')}",
        "too_short": f"needs at least {told.get('min_length')}, not {told.get('actual_length')}",
        "too_long": f"has more than {told.get('max_length')}",
        "string_too_short": "must not be empty",
        "union_tag_invalid": f"there is no type {told.get('tag')!r}, only {told.get('expected_tags')}",
        "union_tag_not_found": 'needs a type, such as type = "box"',
    }
    return words.get(error["type"], str(error["msg"]).removeprefix("Value error, "))


def listed(wrong: list[str]) -> str:
    """Errors in one line; of many the first, and the number of others."""
    told = "; ".join(wrong[:MOST_ERRORS])
    return told if len(wrong) <= MOST_ERRORS else f"{told}; and {len(wrong) - MOST_ERRORS} more"
