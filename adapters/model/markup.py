"""XML models as trees of elements, checked before an engine's own parser reads them.

Parsers of engines open included files and reserve any amount of memory. So the text is parsed here first: no document
types or entities, no more elements, levels and attributes than a model of a thousand bodies has. Each element has its
line for messages about unsupported elements (`adapters.model`).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator
from dataclasses import dataclass, field
from xml.parsers import expat

from adapters.plain import NAME, one_line
from adapters.scene import SceneError

#: Most elements, and most levels of them: a model of a thousand bodies has some ten thousand, ten deep.
MOST_ELEMENTS, MOST_LEVELS = 50_000, 64
#: Most attributes of an element: twice those that a geom of MJCF may have.
MOST_ATTRIBUTES = 100
#: Most bodies and shapes of a model: as many bodies as a scene file may have.
MOST_MADE = 1000


@dataclass
class Element:
    """One element, with its line; ``text`` is its text without children."""

    tag: str
    attributes: dict[str, str]
    line: int
    children: list[Element] = field(default_factory=list)
    text: str = ""

    def __str__(self) -> str:
        name = self.attributes.get("name", "")
        shown = f" {one_line(name, NAME)!r}" if name and "@" not in name else ""
        return f"line {self.line}: <{one_line(self.tag, NAME)}>{shown}"

    def walk(self) -> Iterator[Element]:
        """The element and all below it, in the order of the text."""
        yield self
        for child in self.children:
            yield from child.walk()

    def without(self, gone: Element) -> bool:
        """Remove ``gone`` below this element; returns whether it was there."""
        kept = [child for child in self.children if child is not gone]
        if len(kept) < len(self.children):
            self.children = kept
            return True
        return any(child.without(gone) for child in self.children)


def parsed(text: str, tag: str, otherwise: str) -> Element:
    """Root of the model, which must be a ``tag``; ``otherwise`` is the error for another one.

    Raises
    ------
    SceneError
        If it is not XML, has entities, or is nested too deep or too long; with the line.
    """
    parser, count = expat.ParserCreate("utf-8"), 0  # whatever the text says of its bytes, which are ours
    stack: list[Element] = []
    roots: list[Element] = []

    def refuse(*_: object) -> None:
        raise SceneError(f"model: line {parser.CurrentLineNumber}: document types and entities are not read")

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal count
        count += 1
        element = Element(tag, dict(attributes), parser.CurrentLineNumber)
        if count > MOST_ELEMENTS or len(stack) >= MOST_LEVELS:
            raise SceneError(
                f"model: {element}: more than {MOST_ELEMENTS} elements, or nested deeper than {MOST_LEVELS}"
            )
        if len(attributes) > MOST_ATTRIBUTES:
            raise SceneError(f"model: {element}: more than {MOST_ATTRIBUTES} attributes")
        (stack[-1].children if stack else roots).append(element)
        stack.append(element)

    def say(text: str) -> None:
        stack[-1].text += text

    parser.StartDoctypeDeclHandler = parser.EntityDeclHandler = refuse
    parser.StartElementHandler, parser.EndElementHandler = start, lambda tag: stack.pop()
    parser.CharacterDataHandler, parser.buffer_text = say, True
    try:
        parser.Parse(text.encode(), True)
    except (expat.ExpatError, ValueError) as error:
        if isinstance(error, SceneError):
            raise
        raise SceneError(f"model: is not XML: {one_line(error)}") from None
    root = roots[0]
    if root.tag != tag:
        raise SceneError(f"model: {root}: {otherwise}")
    return root


def named(root: Element, tags: Collection[str]) -> None:
    """Name unnamed elements by their line."""
    taken: Counter[str] = Counter()
    for element in root.walk():
        if element.tag in tags and "name" not in element.attributes:
            name = f"{element.tag}@{element.line}"
            taken[name] += 1
            element.attributes["name"] = name if taken[name] == 1 else f"{name}-{taken[name]}"


def text_of(root: Element) -> str:
    """The model as text; each element begins on its original line, so that a parser's errors name the right one."""
    from xml.sax.saxutils import escape, quoteattr  # its import loads http and ssl

    line, pieces = 1, []

    def write(element: Element) -> None:
        nonlocal line
        gap = max(0, element.line - line)
        line += gap
        attributes = "".join(f" {name}={quoteattr(value)}" for name, value in element.attributes.items())
        pieces.append("\n" * gap + f"<{element.tag}{attributes}>" + escape(" ".join(element.text.split())))
        for child in element.children:
            write(child)
        pieces.append(f"</{element.tag}>")

    write(root)
    return "".join(pieces)
