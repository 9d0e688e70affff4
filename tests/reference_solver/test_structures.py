"""Structures are named tuples to Python and one pointer to kernels, and mean the same to both."""

import pickle
from typing import Any, NamedTuple

import numpy as np
import pytest

from reference_solver.compilation import config, inner_kernel, kernel
from reference_solver.structures import KNOWN, structure


@structure
class Inner(NamedTuple):
    places: Any
    flag: bool
    size: float


@structure
class Outer(NamedTuple):
    count: int
    inner: Inner
    rows: Any
    pair: tuple[float, float]


@structure
class Alike(NamedTuple):
    """All members of one type, which numba lays out as an array."""

    first: float
    second: float


@inner_kernel
def made(places: Any, count: int) -> Outer:
    """Made of arguments, and returned out of the function that holds its memory."""
    return Outer(count, Inner(places[:count], count > 2, 0.5 * count), places[1:], (1.0, 2.0))


@inner_kernel
def total(inner: Inner) -> float:
    found = inner.size if inner.flag else -inner.size
    for k in range(len(inner.places)):
        found += inner.places[k]
    return found


@kernel
def weighed(outer: Outer, places: Any) -> float:
    other = made(places, 3)
    return 1000.0 * total(outer.inner) + total(other.inner) + other.rows[0] + outer.pair[1] + other.count


@kernel
def wrote(outer: Outer) -> None:
    outer.inner.places[0] = 7.0
    outer.rows[-1] = 8.0


@kernel
def remade(places: Any) -> float:
    """A structure remade in each turn of a loop, and two of one expression one after the other."""
    found = 0.0
    for k in range(1, 4):
        outer = made(places, k)
        found = 10.0 * found + total(outer.inner) + outer.count
    first = Alike(found, 1.0)
    second = Alike(first.second, first.first)
    return second.second + 0.5 * second.first + 0.25 * first.second


def an_outer(flag: bool = True) -> tuple[Outer, Any]:
    places = np.array([1.0, 2.0, 4.0, 8.0])
    return Outer(2, Inner(places.copy(), flag, 16.0), np.arange(3.0), (1.0, 32.0)), places


@pytest.mark.parametrize("flag", [True, False])
def test_fields_are_those_of_the_tuple(flag):
    outer, places = an_outer(flag)
    mine = 15.0 + (16.0 if flag else -16.0)
    assert weighed(outer, places) == 1000.0 * mine + (7.0 + 1.5) + 2.0 + 32.0 + 3


def test_arrays_written_in_place():
    outer, _ = an_outer()
    wrote(outer)
    assert outer.inner.places.tolist() == [7.0, 2.0, 4.0, 8.0] and outer.rows.tolist() == [0.0, 1.0, 8.0]


def test_structure_made_anew():
    _, places = an_outer()
    turns = [(-0.5 + 1.0 + 1), (-1.0 + 3.0 + 2), (1.5 + 7.0 + 3)]
    found = 100.0 * turns[0] + 10.0 * turns[1] + turns[2]
    assert remade(places) == found + 0.5 + 0.25


def test_structure_as_a_named_tuple():
    outer, _ = an_outer()
    count, inner, rows, pair = outer
    assert (
        isinstance(outer, tuple) and (count, pair) == (2, (1.0, 32.0)) and inner is outer.inner and rows is outer.rows
    )
    assert type(outer._replace(count=5)) is Outer and outer._replace(count=5).count == 5
    assert type(pickle.loads(pickle.dumps(inner))) is Inner
    with pytest.raises(AttributeError):
        outer.count = 3


@pytest.mark.skipif(bool(config.DISABLE_JIT) or not KNOWN, reason="structures are named tuples to numba as well")
def test_pointers_handed_to_kernels():
    from numba.core import types
    from numba.core.registry import cpu_target

    from reference_solver.structure_types import Structure

    outer, places = an_outer()
    weighed(outer, places)
    (given, _), *_ = weighed.signatures
    assert isinstance(given, Structure) and isinstance(given.members[1], Structure)
    packer = cpu_target.target_context.get_arg_packer((given, types.intp))
    assert [str(kind) for kind in packer.argument_types] == ["i8*", "i64"]


@pytest.mark.skipif(bool(config.DISABLE_JIT), reason="NUMBA_DISABLE_JIT: nothing is compiled")
def test_type_of_a_structure_with_other_members():
    outer, places = an_outer()
    weighed(outer, places)
    before = len(weighed.signatures)
    weighed(outer._replace(rows=np.arange(3)), places)
    assert len(weighed.signatures) == before + 1


@pytest.mark.skipif(bool(config.DISABLE_JIT), reason="NUMBA_DISABLE_JIT: nothing is compiled")
def test_refusal_of_a_member_of_another_type():
    outer, places = an_outer()
    weighed(outer, places)
    with pytest.raises(Exception, match=r"(?i)type|determine"):
        weighed(outer._replace(rows=object()), places)
