"""The picture of starved stacks says what the rows say."""

import pytest

from reference_solver.hard_cases.starved import Starved
from reports.starved import RANGE, chart, table

ROWS = [
    Starved(10, 1, 9.0, 1.6, 1.0, False),
    Starved(10, 20, 0.0077, 0.002, 0.15, True),
    Starved(1, 100, 0.0, 0.0, 0.0, True),
]


def test_tiles_say_falls_stands_or_how_far():
    data = table(ROWS)
    assert data["word"].tolist() == ["falls", "0.8 %", "stands"]
    assert data["depth"].tolist() == [RANGE[1], 0.0077, RANGE[0]]


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_a_picture_is_drawn_in_both_schemes(scheme):
    vl_convert = pytest.importorskip("vl_convert")
    svg = vl_convert.vegalite_to_svg(chart(ROWS, scheme))
    for word in ("falls", "0.8 %", "stands", "sweeps per step"):
        assert word in svg
