"""Reads the text of a scene file within limits, and parses it into plain data.

Errors are one line with the file's name, whatever the file is: a pipe, a device, gigabytes, endless nesting, an integer
of thousands of digits.
"""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path
from typing import Any

from adapters.plain import one_line
from adapters.scene import SceneError

#: Largest file [bytes]: some 10 000 bodies, parsed in about a second.
MOST_BYTES = 2**21
#: Most bodies: our part of a cell of columns takes 2 to 3 ms a body, half a minute for these.
MOST_BODIES = 10_000
#: Most parts of a TOML key: the format has three, and a parser takes time by the square of their number.
MOST_PARTS = 8
_PART = r"""(?:[\w-]++|"(?:[^"\\\n]|\\.)*+"|'[^'\n]*+')"""
_LONG_KEY = re.compile(rf"(?<![\w-]){_PART}(?:[ \t]*+\.[ \t]*+{_PART}){{{MOST_PARTS}}}")


def read_text(path: Path) -> str:
    """Text of a scene file.

    Raises
    ------
    SceneError
        One line, if it is not a regular file, too large, unreadable or not UTF-8.
    """
    shown = one_line(path)
    data = None
    try:
        there = path.exists()
        if path.is_file():  # opening a pipe would wait for a writer
            with path.open("rb") as stream:
                data = stream.read(MOST_BYTES + 1)
    except (OSError, ValueError) as error:  # ValueError: a path with a zero byte
        raise SceneError(f"scene: cannot read {shown}: {getattr(error, 'strerror', None) or error}") from None
    if data is None:
        reason = "it is not a regular file" if there else "there is no such file"
        raise SceneError(f"scene: cannot read {shown}: {reason}")
    if len(data) > MOST_BYTES:
        raise SceneError(f"scene: {shown} is larger than {MOST_BYTES // 2**20} MiB, the most that is read")
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError as error:
        raise SceneError(f"scene: {shown} is not valid {path.suffix[1:].upper()}: {one_line(error)}") from None


def parsed(text: str, path: Path) -> Any:
    """Plain data in the text of the scene file from ``path``.

    Raises
    ------
    SceneError
        One line, if it is not valid TOML or JSON, or has more bodies than can be run.
    """
    kind, shown = path.suffix[1:].upper(), one_line(path)
    if kind == "TOML" and _LONG_KEY.search(text):
        raise SceneError(f"scene: {shown} is not valid TOML: a key has more than {MOST_PARTS} parts")
    try:
        data = tomllib.loads(text) if kind == "TOML" else json.loads(text)
    except RecursionError:
        raise SceneError(f"scene: {shown} is not valid {kind}: it is nested too deep") from None
    except ValueError as error:  # syntax, or an integer of thousands of digits
        raise SceneError(f"scene: {shown} is not valid {kind}: {one_line(error)}") from None
    bodies = data.get("bodies") if isinstance(data, dict) else None
    if isinstance(bodies, list) and len(bodies) > MOST_BODIES:
        raise SceneError(f"{shown}: bodies: {len(bodies)} are more than the {MOST_BODIES} that a scene file may have")
    return data
