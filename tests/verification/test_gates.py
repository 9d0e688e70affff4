"""Gates that `make certify` prints hold; the functions are those that it calls. Dearer gates it alone measures."""

import pytest

from tests.verification import (
    columns,
    conservation,
    detection,
    falling,
    friction,
    impact,
    overlaps,
    piles,
    rotation,
    turning,
)
from tests.verification.gate import Gate
from tests.verification.space import SPACES
from tests.verification.turning_scenes import CASES, PLANE, SPATIAL

IN_BOTH = [
    (impact.single_rebound, "classical"),
    (impact.single_rebound, "reference"),
    (impact.apexes,),
    (impact.rest_time,),
    (impact.closing_wall,),
    (impact.thin_wall,),
    (friction.stopping,),
    (friction.time_to_roll,),
    (conservation.free_collisions,),
    (columns.heavy_on_light, 1e6, 1e-8),
    (columns.alternating, 1e6, 1e-8),
    (impact.flat_rebound,),
    (impact.deep_overlap,),
    (impact.turning_box,),
    (friction.creep,),
    (friction.sliding,),
    (friction.slide_to_roll,),
    (columns.convergence,),
    (columns.column, 50, 1000),
    (columns.heavy_on_light, 1e2, 1e-12),
    (columns.alternating, 1e2, 1e-12),
    (columns.heavy_on_light, 1e4, 1e-10),
    (columns.alternating, 1e4, 1e-10),
    (columns.pyramid,),
    (detection.seams, "box"),
    (detection.first_impacts,),
]
ALONE = [
    (overlaps.gates,),
    (rotation.order, "classical"),
    (rotation.error, "reference"),
    (rotation.angular_momentum, "classical"),
    (rotation.angular_momentum, "reference"),
    *[(turning.errors, PLANE, name) for name in CASES[2]],
    (turning.long_board,),
    (falling.dominoes,),
    (falling.rocking,),
    (piles.gates,),
    *[(turning.errors, SPATIAL, name) for name in CASES[3]],
    (detection.seams, SPACES[0], "polygon"),
    (detection.slender_rod,),
]


def named(call):
    return "-".join(str(getattr(part, "name", getattr(part, "__name__", part))) for part in call)


@pytest.mark.parametrize("space", SPACES, ids=lambda space: space.name)
@pytest.mark.parametrize("call", IN_BOTH, ids=named)
def test_gate_holds_in_both_dimensions(call, space):
    function, *arguments = call
    rows = list(function(space, *arguments))
    assert rows
    assert [row for row in rows if not row.holds] == []


@pytest.mark.parametrize("call", ALONE, ids=named)
def test_gate_holds(call):
    function, *arguments = call
    rows = list(function(*arguments))
    assert rows
    assert [row for row in rows if not row.holds] == []


def test_rows_of_each_part():
    names = {row.quantity for row in rotation.gates()}
    assert names == {
        "free rotation: observed order",
        "free rotation: |L|, relative",
        "free rotation: error [rad]",
        "free rotation: direction of L [rad]",
    }


def test_gate_from_below_by_a_small_value_and_no_number():
    assert Gate.at_least("", "", 2.0, 1.9, "").holds
    assert not Gate.at_least("", "", 1.8, 1.9, "").holds
    assert not Gate.at_least("", "", float("nan"), 1.9, "").holds
