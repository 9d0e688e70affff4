"""The picture of starved stacks says what the rows say."""

import pytest

from reports.starved import Starved, chart, starved_stack

ROWS = [
    Starved(10, 1, 9.0, 1.6, 1.0, False),
    Starved(10, 20, 0.0077, 0.002, 0.15, True),
    Starved(1, 100, 0.0, 0.0, 0.0, True),
]


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_a_picture_is_drawn_in_both_schemes(scheme):
    vl_convert = pytest.importorskip("vl_convert")
    svg = vl_convert.vegalite_to_svg(chart(ROWS, scheme))
    for word in ("falls", "0.8 %", "stands", "sweeps per step"):
        assert word in svg


def test_sweeps_that_are_too_few_bring_a_stack_down():
    """More sweeps let it sink less; a column of n asks for n^2, ten boxes fall with one and stand with twenty."""
    few, some, many = (starved_stack(10, sweeps) for sweeps in (1, 20, 100))
    assert not few.stands
    assert some.stands
    assert many.stands
    assert few.sunk > some.sunk > many.sunk
