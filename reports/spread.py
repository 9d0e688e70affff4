"""Differences between engines on a scene from a file, in lines for the terminal (`validation.questions.spread`)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import groupby

from reports.wording import quantity
from validation.questions.spread import Spread


def spread_lines(found: Sequence[Spread]) -> Iterator[str]:
    """A heading per scene and dimension, then a line per engine and profile, the largest difference first."""

    def posed(each: Spread) -> tuple[str, int]:
        return each.scene, each.dimension

    for (scene, dimension), group in groupby(sorted(found, key=posed), posed):
        members = sorted(group, key=lambda each: -each.distance)
        first = members[0]
        sure = "" if first.certified or first.several else "; that run is not certified"
        sure += f"; {first.unique}" if first.unique else ""
        yield ""
        yield f"How far from our own solution: {scene} {dimension}-D, after {first.time:.3g} s{sure}"
        names = [f"{each.engine}/{each.profile}" for each in members]
        for name, each in zip(names, members, strict=True):
            yield f"  {name:<{max(map(len, names))}}  {quantity(each.distance, 'm', 2):>9}  ({each.body})"
