"""What stops a model from being a scene: the element that has no place in one."""

from __future__ import annotations


class Refused(Exception):
    """An element has no place in a scene.

    Parameters
    ----------
    kind, name
        Of the element, as the compiled model has them.
    why
        In half a sentence.
    fatal
        Whether leaving it out would make another model.
    """

    def __init__(self, kind: str, name: str, why: str, fatal: bool = False) -> None:
        super().__init__(f"{kind} {name}: {why}")
        self.kind, self.name, self.why, self.fatal = kind, name, why, fatal
