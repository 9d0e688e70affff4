"""Materials: restitution and friction of pairs; entries name both bodies, one, or none."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations_with_replacement, product

from adapters.scene.shapes import SceneError


@dataclass(frozen=True)
class Pair:
    """Material of a pair of bodies; ``"*"`` is every body without another entry."""

    a: str = "*"
    b: str = "*"
    restitution: float = 0.0
    friction: float = 0.0


#: Restitution and friction of one or several entries.
_Said = frozenset[tuple[float, float]]


class Materials:
    """The pairs of a scene: entries with both bodies, one, or none."""

    def __init__(self, pairs: tuple[Pair, ...]) -> None:
        self.both: dict[frozenset[str], _Said] = {}
        self.one: dict[str, _Said] = {}
        self.none: _Said = frozenset()
        for pair in pairs:
            value = frozenset(((pair.restitution, pair.friction),))
            named = frozenset((pair.a, pair.b)) - {"*"}
            if "*" not in (pair.a, pair.b):
                self.both[named] = self.both.get(named, frozenset()) | value
            elif named:
                (name,) = named
                self.one[name] = self.one.get(name, frozenset()) | value
            else:
                self.none |= value

    def said(self, a: str, b: str) -> _Said:
        """The most specific entries for two bodies; empty: smooth and plastic."""
        return (
            self.both.get(frozenset((a, b))) or self.one.get(a, frozenset()) | self.one.get(b, frozenset()) or self.none
        )

    def materials(self, free: Mapping[str, bool]) -> set[tuple[float, float]]:
        """Values of all pairs with a free body; bodies with the same entries are grouped.

        ``free``: whether each body is free, by name.
        """
        kind = {name: (self.one.get(name, frozenset()), is_free) for name, is_free in free.items()}
        members: dict[tuple[_Said, bool], list[str]] = {}
        for name, its in kind.items():
            members.setdefault(its, []).append(name)
        named: Counter[frozenset[tuple[_Said, bool]]] = Counter()
        found: set[tuple[float, float]] = set()
        for key, said in self.both.items():
            kinds = frozenset(kind[name] for name in key if name in kind)
            if len(key) == 2 and any(is_free for _, is_free in kinds):
                named[kinds] += 1
                a, b = sorted(key)
                found.add(single(a, b, said))
        for first, second in combinations_with_replacement(members, 2):
            n, m = len(members[first]), len(members[second])
            count = n * m if first != second else n * (n - 1) // 2
            if (first[1] or second[1]) and count > named[frozenset((first, second))]:
                said = first[0] | second[0] or self.none
                if len(said) > 1:
                    pairs = product(members[first], members[second])
                    a, b = next((a, b) for a, b in pairs if a != b and frozenset((a, b)) not in self.both)
                    single(a, b, said)
                found.add(next(iter(said), (0.0, 0.0)))
        return found


def single(a: str, b: str, said: _Said) -> tuple[float, float]:
    """The value of a pair from its entries; smooth and plastic without any."""
    if len(said) > 1:
        raise SceneError(
            f"pair {a}-{b}: {len(said)} entries contradict each other; give an entry that names both bodies"
        )
    return next(iter(said), (0.0, 0.0))
