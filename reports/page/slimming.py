"""Makes what the page holds small without taking anything from it: drawings, and the markup around them.

A chart as vl-convert writes it says the same of every line, and draws a hundred and fifty points where ten lie on the
curve; forty scenes of such charts are megabytes. What is left out here is what no eye and no reader is given: the
page's charts are pictures with one name (``role="img"``), of which assistive technology reads no part.

Tags that HTML closes by itself are not closed, and quotes around plain words are left out [HTML standard, 13.1.2].
A head says whether it is a column's or a row's only where its place does not [HTML standard, 4.9.12.2: automatic].
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from xml.etree import ElementTree

#: Half a pixel of a screen with two of them per unit: what is nearer to a line than this is on it.
FLAT = 0.25
#: Presentation attributes that a group hands on to its parts [SVG 1.1, property index: inherited].
INHERITED = (
    "fill", "fill-opacity", "font-family", "font-size", "font-weight", "stroke", "stroke-dasharray", "stroke-opacity",
    "stroke-width", "text-anchor",
)  # fmt: skip
#: What a reader of a part of a chart would be told, if there were one.
UNREAD = ("class", "role", "aria-hidden", "aria-roledescription")
#: What SVG takes for granted where nothing around a part says otherwise [SVG 1.1, property index: initial values].
GRANTED = {"font-weight": "normal", "stroke-dasharray": "1,0", "stroke-width": "1", "x2": "0", "y2": "0",
           "version": "1.1"}  # fmt: skip
#: The font is the page's; what is saved of it states it once.
FONT = "font-family"
#: A place or a length in hundredths of a unit, of which tenths are seen.
_HUNDREDTHS = re.compile(r"-?\d+\.\d\d+")
#: What vl-convert says of axes, which have titles of their own.
AXES = ("X-axis", "Y-axis")
_TRANSLATED = re.compile(r"translate\((-?[\d.]+),(-?[\d.]+)\)")
_NUMBER = re.compile(r"-?(?:\d+\.?\d*|\.\d+)(?:e-?\d+)?")
_COMMAND = re.compile(r"([MLHVlhvZ])([^MLHVlhvZ]*)")
#: A path that begins with a place and has straight lines only.
_STRAIGHT = re.compile(r"M[-\d.,eMLHVlhvZ ]+")
#: A circle about its own centre, as vl-convert draws one.
_CIRCLE = re.compile(r"M([\d.]+),0A\1,\1,0,1,1,-\1,0A\1,\1,0,1,1,\1,0")
#: The ground of a view, which has no colour of its own.
_GROUND = re.compile(r"M0,0h[\d.]+v[\d.]+h-[\d.]+Z")
_NAMESPACE = re.compile(r' xmlns(?::xlink)?="[^"]*"')


def small_svg(text: str) -> str:
    """An SVG drawing that looks the same: one value once, straight runs of points as one line, no empty group."""
    root = ElementTree.fromstring(_NAMESPACE.sub("", text))
    _see_through(root, "black", "none")
    _clean(root)
    _granted(root, frozenset())
    _place(root)
    return ElementTree.tostring(root, encoding="unicode", short_empty_elements=True).replace(" />", "/>")


def _see_through(node: ElementTree.Element, fill: str, stroke: str) -> None:
    """Say how far one sees through a part that is only filled, or only a line, in a way that groups hand on."""
    fill, stroke = node.get("fill", fill), node.get("stroke", stroke)
    for part in node:
        _see_through(part, fill, stroke)
    painted = [name for name, colour in (("fill", fill), ("stroke", stroke)) if colour not in ("none", "transparent")]
    alone = node.tag in ("path", "line") and len(painted) == 1 and f"{painted[0]}-opacity" not in node.attrib
    if alone and (seen := node.attrib.pop("opacity", None)) is not None:
        node.set(f"{painted[0]}-opacity", seen)


def _clean(node: ElementTree.Element) -> None:
    """Clean the parts, then the node: what is said of all parts is said once."""
    for part in list(node):
        _clean(part)
    for name in UNREAD:
        if not (name == "role" and node.get(name) == "img"):
            node.attrib.pop(name, None)
    if node.get("role") != "img" and (said := node.attrib.pop("aria-label", None)) and not said.startswith(AXES):
        node.set("data-is", said)
    if node.get("transform") == "translate(0,0)":
        del node.attrib["transform"]
    if node.tag == "path":
        _move_path(node)
        if node.get("stroke") is None:
            node.attrib.pop("stroke-width", None)
    node[:] = list(_kept(node))
    if node.tag in ("g", "svg") and len(node):
        _hand_up(node, list(node))
        node[:] = list(_kept(node))  # a group that has handed up all it said says nothing any more
        _join_rules(node)


def _move_path(node: ElementTree.Element) -> None:
    """A path where it lies, instead of about the origin with a way to go; a circle as one."""
    drawn, place = node.get("d", ""), _translated(node)
    if place is not None and (circle := _CIRCLE.fullmatch(drawn)):
        node.tag = "circle"
        for name, value in zip(("cx", "cy", "r"), (*place, float(circle[1])), strict=True):
            node.set(name, _tenths(round(10.0 * value)))
        del node.attrib["d"]
    elif place is not None and _outlines(drawn) is not None:
        node.set("d", small_path(drawn, place))
    else:
        node.set("d", small_path(drawn))
        return
    node.attrib.pop("transform", None)


def _place(node: ElementTree.Element) -> None:
    """Lines as paths, and words at their place."""
    place = _translated(node)
    if place is not None and node.tag == "line":
        ends = [float(node.attrib.pop(name, 0.0)) for name in ("x2", "y2")]
        node.tag = "path"
        node.set("d", small_path(f"M0,0L{ends[0]},{ends[1]}", place))
        node.attrib.pop("transform", None)
    elif place is not None and node.tag == "text" and not len(node):
        node.attrib.pop("transform", None)
        for name, value in zip("xy", place, strict=True):
            if value:
                node.set(name, _tenths(round(10.0 * value)))
    for part in node:
        _place(part)


def _translated(node: ElementTree.Element) -> tuple[float, float] | None:
    """Where a part is moved to; None if it is turned as well."""
    found = _TRANSLATED.fullmatch(node.get("transform", "translate(0,0)"))
    return None if found is None else (float(found[1]), float(found[2]))


def _granted(node: ElementTree.Element, around: frozenset[str]) -> None:
    """Take what needs no saying from the parts of a clean drawing; ``around``: what the groups about a part say."""
    node.attrib.pop(FONT, None)
    for name, value in GRANTED.items():
        if node.get(name) == value and name not in around:
            del node.attrib[name]
    for name in ("transform", "x2", "y2"):
        if name in node.attrib:
            node.set(
                name, _HUNDREDTHS.sub(lambda found: f"{float(found[0]):.1f}".removesuffix(".0"), node.attrib[name])
            )
    for part in node:
        _granted(part, around | node.attrib.keys())


def _kept(node: ElementTree.Element) -> Iterator[ElementTree.Element]:
    """Parts that show something; a group that says nothing is replaced by what is in it."""
    for part in node:
        if part.tag == "g" and not len(part):
            continue
        if (
            part.tag == "path" and set(part.attrib) <= {"d"} and _GROUND.fullmatch(part.get("d", ""))
        ):  # drawn by nothing
            continue
        if part.tag == "path" and not part.get("d"):  # a line of one point
            continue
        if part.tag == "text" and part.get("opacity") == "0":  # a label that would overlap the next one
            continue
        if part.tag == "g" and not part.attrib:
            yield from part
        else:
            yield part


def _hand_up(node: ElementTree.Element, parts: Sequence[ElementTree.Element]) -> None:
    for name in INHERITED if len(parts) > 1 else ():
        said = {part.get(name) for part in parts}
        if len(said) == 1 and (value := said.pop()) is not None:
            node.set(name, value)
            for part in parts:
                del part.attrib[name]


def _join_rules(node: ElementTree.Element) -> None:
    """Plain lines of one look (a grid, ticks) are one path."""
    parts = list(node)
    if len(parts) < 2 or any(part.tag != "line" or set(part.attrib) - {"transform", "x2", "y2"} for part in parts):
        return
    places = [_translated(part) for part in parts]
    if None in places:
        return
    drawn = "".join(
        f"M{place[0]},{place[1]}l{part.get('x2', '0')},{part.get('y2', '0')}"
        for place, part in zip(places, parts, strict=True) if place is not None
    )  # fmt: skip
    node[:] = [ElementTree.Element("path", {"d": small_path(drawn)})]


def small_path(drawn: str, moved: tuple[float, float] = (0.0, 0.0)) -> str:
    """A path's ``d`` after ``moved``, its steps relative and in tenths, a polyline without the points that lie on it.

    Empty where nothing is drawn but points. A path with curves stays as it is, and where it is.
    """
    found = _outlines(drawn)
    if found is None:
        return drawn
    words: list[str] = []
    at = (0, 0)
    for points, closed in found:
        shifted = [(x + moved[0], y + moved[1]) for x, y in points]
        if len(set(shifted)) == 1:
            continue
        kept = shifted if closed else simplified(shifted, FLAT)
        (x0, y0), *rest = [(round(10.0 * x), round(10.0 * y)) for x, y in kept]
        words += [_step("M", x0, y0)]
        at = x0, y0
        for x, y in rest:
            dx, dy = x - at[0], y - at[1]
            words += [_step("h", dx) if dy == 0 else _step("v", dy) if dx == 0 else _step("l", dx, dy)]
            at = x, y
        words += ["Z"] if closed else []
    return _without_repeats(words)


def _outlines(drawn: str) -> list[tuple[list[tuple[float, float]], bool]] | None:
    """Corners of each part of a path of straight lines, and whether it closes; None if there are others."""
    if not _STRAIGHT.fullmatch(drawn):
        return None
    parts: list[tuple[list[tuple[float, float]], bool]] = []
    x = y = 0.0
    for command, numbers in _COMMAND.findall(drawn):
        values = [float(value) for value in _NUMBER.findall(numbers)]
        if command == "Z":
            points, _ = parts[-1]
            parts[-1] = (points, True)
            x, y = points[0]
            continue
        steps = (
            zip(values[::2], values[1::2], strict=True) if command in "MLl" else ((value, value) for value in values)
        )
        for k, (first, second) in enumerate(steps):
            x = x if command in "Vv" else first + (x if command in "lh" else 0.0)
            y = y if command in "Hh" else second + (y if command in "lv" else 0.0)
            if command == "M" and k == 0:
                parts.append(([], False))
            elif parts[-1][1]:  # what follows an outline that is closed begins where it began
                parts.append(([parts[-1][0][0]], False))
            parts[-1][0].append((x, y))
    return parts


def _step(command: str, *tenths: int) -> str:
    return command + ",".join(_tenths(value) for value in tenths).replace(",-", "-")


def _without_repeats(words: Sequence[str]) -> str:
    """Steps one after the other; a letter is said once for all that follow it [SVG 1.1, 8.3.1]."""
    said, last = [], ""
    for word in words:
        command, numbers = word[0], word[1:]
        if command == last and command != "M":
            said.append(numbers if numbers.startswith("-") else "," + numbers)
        else:
            said.append(word)
        last = command
    return "".join(said)


def _tenths(value: int) -> str:
    whole = f"{value / 10.0:.1f}".removesuffix(".0")
    return whole.replace("0.", ".", 1) if whole.lstrip("-").startswith("0.") else whole


def simplified(points: Sequence[tuple[float, float]], flat: float) -> list[tuple[float, float]]:
    """Fewest of the points so that all others lie within ``flat`` of the line (Douglas and Peucker 1973)."""
    kept = {0, len(points) - 1}
    open_parts = [(0, len(points) - 1)]
    while open_parts:
        first, last = open_parts.pop()
        off = [_distance(points[k], points[first], points[last]) for k in range(first + 1, last)]
        if off and max(off) > flat:
            middle = first + 1 + off.index(max(off))
            kept.add(middle)
            open_parts += [(first, middle), (middle, last)]
    return [points[k] for k in sorted(kept)]


def _distance(point: tuple[float, float], a: tuple[float, float], b: tuple[float, float]) -> float:
    """Distance of a point from the piece of line between two others."""
    dx, dy = b[0] - a[0], b[1] - a[1]
    length = dx * dx + dy * dy
    share = 0.0 if length == 0.0 else ((point[0] - a[0]) * dx + (point[1] - a[1]) * dy) / length
    share = min(1.0, max(0.0, share))
    return math.hypot(point[0] - a[0] - share * dx, point[1] - a[1] - share * dy)


#: What is code or data, or shows its own line breaks, stays as it is.
_VERBATIM = re.compile(r"(<(?:script|style|pre)\b.*?</(?:script|style|pre)>)", re.DOTALL)
#: End tags that the next tag makes superfluous, inside our tables and lists.
_CLOSED_BY_THE_NEXT = re.compile(r"\s*</(?:td|th|tr|thead|tbody|li|dt|dd|option)>")
_TAG = re.compile(r"<[a-zA-Z][^<>]*>")
#: A value that ends where the next blank does [HTML standard, 13.1.2.3], and what follows it.
_QUOTED = re.compile(r"""="([^\s"'=<>`]+)"(/?)""")
_INDENTED = re.compile(r"\s*\n\s*")


_TABLE = re.compile(r"<table\b.*?</table>", re.DOTALL)
_ROW = re.compile(r"<tr\b.*?(?=<tr\b|</table>)", re.DOTALL)
_FIRST = re.compile(r"<(t[hd])\b")


def _heads_by_place(table: re.Match[str]) -> str:
    """A table without what its heads' places say: of a row without data they are columns', of a column rows'."""
    text = table[0]
    rows = [_FIRST.findall(row) for row in _ROW.findall(text)]
    of_heads = [row for row in rows if "td" not in row]
    if len(of_heads) != 1 or "td" in rows[0] or "group" in text or "span=" in text:
        return text
    if all(row[0] == "th" and "th" not in row[1:] for row in rows[1:]):
        text = text.replace(' scope="row"', "")
    return text.replace(' scope="col"', "")


def small_html(text: str) -> str:
    """The page without what a browser adds by itself."""
    parts = _VERBATIM.split(text)
    return "".join(part if k % 2 else _small_markup(part) for k, part in enumerate(parts))


def _small_markup(text: str) -> str:
    text = _TABLE.sub(_heads_by_place, text)
    text = _INDENTED.sub("\n", _CLOSED_BY_THE_NEXT.sub("", text))
    return _TAG.sub(lambda tag: _QUOTED.sub(_unquoted, tag[0]), text)


def _unquoted(found: re.Match[str]) -> str:
    """A slash that closes a part stands apart from a value without quotes."""
    return f"={found[1]}" + (" /" if found[2] else "")
