"""Finds the release of a change with as few runs as possible, and reports what remains unknown.

    known    like the first                    like the last
             [A] . . . . . . ? . . . . . . . . [B]        run the middle: log2(n) releases for one change

A release that cannot run is replaced by its neighbour. Releases between the two that are found are then named: the
change is in one of them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

from validation.cells import Slot, slot_from_dict
from validation.judging.comparison import Change, Kind, by_seriousness, compare_rows
from validation.releases.floors import MOVES
from validation.releases.history import ANSWERS, Told

#: Rows of a release; None if it cannot run.
Ask = Callable[[int, Sequence[Slot]], Told]


@dataclass(frozen=True)
class Found:
    """Where a change lies.

    Parameters
    ----------
    before, after
        Indices of two releases between which it lies; none of those in between could run.
    asked
        Indices of the releases that were run, in order, including those without a result.
    silent
        Index -> reason of those without a result.
    change
        The row on both sides.
    others
        Further pairs of neighbours between which the row changes; None if not all were run.
    """

    before: int
    after: int
    asked: tuple[int, ...]
    silent: dict[int, str]
    change: Change
    others: tuple[tuple[int, int], ...] | None

    @property
    def unknown(self) -> list[int]:
        """Releases between the two sides without a result: the change may be in one of them."""
        return [index for index in sorted(self.silent) if self.before < index < self.after]


@dataclass(frozen=True)
class Unchanged:
    """Nothing changed between the ends, or an end has no result."""

    reason: str


class _Questions:
    """Runs each release once, and stores its rows."""

    def __init__(self, ask: Ask, metric: str) -> None:
        self._ask, self._metric = ask, metric
        self.rows: dict[int, dict[str, dict[str, Any]]] = {}
        self.silent: dict[int, str] = {}
        self.asked: list[int] = []

    def at(self, index: int, cells: Sequence[Slot]) -> dict[str, dict[str, Any]]:
        """Rows of the metric by slot; empty where a release has no result."""
        if index not in self.asked:
            self.asked.append(index)
            told = self._ask(index, cells)
            found = [row.as_dict() for row in told.rows if is_meant(row.metric, self._metric)]
            self.rows[index] = {_key(row): row for row in found if row["outcome"] in ANSWERS}
            if not self.rows[index]:
                self.silent[index] = told.reason or next((row["reason"] for row in found), "it has no such check")
        return self.rows[index]


def _key(row: dict[str, Any]) -> str:
    return f"{slot_from_dict(row['slot']).key()} {row['metric']}"


def is_meant(metric: str, asked: str) -> bool:
    """``apex`` means all of a series, ``apex[1]`` or ``bounce/apex[1]`` one of it.

    A check of a scene file is also meant by the file's word for its quantity: ``ball.y`` is ``final[ball.y]``.
    """
    kind, _, index = metric.removesuffix("]").partition("[")
    words = (metric, kind, index) if "." in index else (metric, kind)
    return asked in words or asked.rpartition("/")[2] in words


def bisect(count: int, cells: Sequence[Slot], metric: str, ask: Ask, every: bool = False) -> Found | Unchanged:
    """Find between which of ``count`` releases a row of ``metric`` changes.

    The ends run all ``cells``; the most serious row that differs is followed, with its noise floor. With ``every`` all
    releases run, and other changes of that row are named.
    """
    moved = [replace(slot, ulp=ulp) for slot in cells for ulp in MOVES]
    questions = _Questions(ask, metric)
    first, last = (questions.at(index, [*cells, *moved]) for index in (0, count - 1))
    for index, rows in ((0, first), (count - 1, last)):
        if not rows:
            return Unchanged(f"release {index} cannot run: {questions.silent[index]}")
    changes = sorted(_changes(first.values(), last.values()), key=by_seriousness)
    if not changes and all(row["value"] is None for row in (*first.values(), *last.values())):
        why = next(iter(last.values()))["reason"]
        return Unchanged(f"release 0 has no value of {metric}, nor has release {count - 1} : {why}")
    if not changes:
        return Unchanged("")
    key = next(k for k, row in last.items() if row["slot"] == changes[0].slot and row["metric"] == changes[0].metric)
    slot = slot_from_dict(last[key]["slot"])
    own = [slot, *(replace(slot, ulp=ulp) for ulp in MOVES)]

    def like_first(index: int) -> bool | None:
        row = questions.at(index, own).get(key)
        return None if row is None else not _differs(first[key], row, changes[0].kind)

    before, after = search(count, like_first)
    others = None
    if every:
        others = _others(count, lambda index: questions.at(index, own).get(key), (before, after))
    (change,) = _changes([questions.rows[before][key]], [questions.rows[after][key]]) or changes[:1]
    return Found(before, after, tuple(questions.asked), questions.silent, change, others)


def search(count: int, like_first: Callable[[int], bool | None]) -> tuple[int, int]:
    """Neighbours (among those with a result) of which the first is like release 0 and the second is not."""
    before, after = 0, count - 1
    silent: set[int] = set()
    while True:
        left = [index for index in range(before + 1, after) if index not in silent]
        if not left:
            return before, after
        middle = min(left, key=lambda index: (abs(2 * index - before - after), index))
        answer = like_first(middle)
        if answer is None:
            silent.add(middle)
        elif answer:
            before = middle
        else:
            after = middle


def _differs(a: dict[str, Any], b: dict[str, Any], kind: Kind) -> bool:
    """Whether two rows differ: in the verdict where it flips, else in the value beyond its floor."""
    if kind in (Kind.FLIP, Kind.OUTCOME):
        return (a["outcome"], a["physics"]) != (b["outcome"], b["physics"])
    return bool(_changes([a], [b]))


def _changes(before: Any, after: Any) -> list[Change]:
    return [c for c in compare_rows(before, after) if c.kind not in (Kind.ADDED, Kind.REMOVED)]


def _others(
    count: int, row_of: Callable[[int], dict[str, Any] | None], known: tuple[int, int]
) -> tuple[tuple[int, int], ...]:
    answered = [(index, row) for index in range(count) if (row := row_of(index)) is not None]
    pairs = pairwise(answered)
    return tuple((i, j) for (i, a), (j, b) in pairs if (i, j) != known and _changes([a], [b]))
