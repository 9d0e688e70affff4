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
_POLYLINE = re.compile(r"M[-\d.,e]+(?:L[-\d.,e]+)+")
#: The ground of a view, which has no colour of its own.
_GROUND = re.compile(r"M0,0h[\d.]+v[\d.]+h-[\d.]+Z")
_NAMESPACE = re.compile(r' xmlns(?::xlink)?="[^"]*"')


def small_svg(text: str) -> str:
    """An SVG drawing that looks the same: one value once, straight runs of points as one line, no empty group."""
    root = ElementTree.fromstring(_NAMESPACE.sub("", text))
    _clean(root)
    _granted(root, frozenset())
    return ElementTree.tostring(root, encoding="unicode", short_empty_elements=True).replace(" />", "/>")


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
        node.set("d", small_path(node.get("d", "")))
        if node.get("stroke") is None:
            node.attrib.pop("stroke-width", None)
    node[:] = list(_kept(node))
    if node.tag in ("g", "svg") and len(node):
        _hand_up(node, list(node))
        node[:] = list(_kept(node))  # a group that has handed up all it said says nothing any more
        _join_rules(node)


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
    places = [_TRANSLATED.fullmatch(part.get("transform", "translate(0,0)")) for part in parts]
    if None in places:
        return
    drawn = "".join(
        f"M{place[1]},{place[2]}l{part.get('x2')},{part.get('y2')}"
        for place, part in zip(places, parts, strict=True) if place is not None
    )  # fmt: skip
    node[:] = [ElementTree.Element("path", {"d": drawn})]


def small_path(drawn: str) -> str:
    """A path's ``d``; a polyline without the points that lie on it, its steps relative and in tenths."""
    if _POLYLINE.fullmatch(drawn) is None:
        return drawn
    points = [(float(x), float(y)) for x, y in (pair.split(",") for pair in re.split("[ML]", drawn)[1:])]
    kept = simplified(points, FLAT)
    (x0, y0), *rest = [(round(10.0 * x), round(10.0 * y)) for x, y in kept]
    words, at = [f"M{_tenths(x0)},{_tenths(y0)}"], (x0, y0)
    for x, y in rest:
        words.append(f"l{_tenths(x - at[0])},{_tenths(y - at[1])}")
        at = x, y
    return "".join(words)


def _tenths(value: int) -> str:
    return f"{value / 10.0:g}" if abs(value) < 1_000_000 else f"{value / 10.0:.1f}"


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
_QUOTED = re.compile(r' (class|scope|id|colspan|rowspan|role|type|value)="([\w-]+)"(?=[ >])')
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
    return _QUOTED.sub(r" \1=\2", text)
