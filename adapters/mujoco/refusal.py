"""The error for an element of a model that a scene does not support."""

from __future__ import annotations


class Refused(Exception):
    """A scene does not support an element.

    Parameters
    ----------
    kind, name
        Of the element, in the compiled model.
    why
        The reason in half a sentence.
    fatal
        Whether leaving it out would make another model.
    """

    def __init__(self, kind: str, name: str, why: str, fatal: bool = False) -> None:
        super().__init__(f"{kind} {name}: {why}")
        self.kind, self.name, self.why, self.fatal = kind, name, why, fatal
