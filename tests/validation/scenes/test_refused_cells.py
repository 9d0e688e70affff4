"""What the law of a scene does not cover is refused in one line: the parameter by name, and what was asked of it."""

import pytest

from adapters.scene import SceneError
from validation.catalogue import CATALOGUE
from validation.scenes import kane

#: Parameters that their own limits let pass, and what is told of them: found by asking each scene at random.
REFUSED = [
    ({"beta": 10.0}, "arch.beta: at 10 degrees springers of 3 times the keystone's mass tip"),
    ({"ratio": 0.01, "lean": 20.0}, "card_tent.ratio: at 0.01 the cards do not slide down on each other"),
    ({"ratio": 1.0}, "domino.ratio: at 1 the domino balances on its foot; choose less or more"),
    ({"mu": 0.0}, "domino.mu: 0 does not hold the foot of the pushed domino"),
    ({"gap": 0.95}, "domino.mu: 0.6 does not hold both feet where the dominoes meet"),
    ({"mu": 0.707, "ratio": 1.09}, "domino.ratio: at 1.09 the second domino does not turn 3 degrees"),
    ({"e": 0.0}, "domino.e: at 0 the first domino catches up with the second"),
    ({"v": 390.0}, "edge_drop.tilt: at 20 degrees another edge lands within 0.1 s"),
    ({"v": 100.0}, "hilltop.v: with 100 m/s the disc leaves the top almost at once"),
    ({"v": 280.0, "lean": 30.0}, "kane.lean: at 30 degrees the other end lands within 0.1 s"),
    ({"lean": 85.0, "aspect": 0.3}, "ladder.lean: a ladder as thick as 0.3 stands by itself at 85 degrees"),
    ({"ratio": 0.01, "lean": 20.0}, "ladder.ratio: at 0.01 the ladder does not slide down along the wall"),
    ({"whirl": 10.0}, "off_centre.whirl: with 10 rad/s the bar recedes faster than the ball approaches"),
    ({"whirl": 6.6}, "off_centre.whirl: with 6.6 rad/s the bar meets the ball 0.00369 s too early"),
    ({"rise": 100.0}, "off_centre.e: with 0.8 the turning bar meets the ball again 0.0211 s after the blow"),
    ({"lean": 79.9, "aspect": 0.185},
     "painleve.lean: at 79.9 degrees a rod so thick stands over its end and cannot jam"),
    ({"ratio": 0.921, "v": 2.38, "lean": 27.0}, "painleve.ratio: at 0.921 the end lifts before the rod has turned"),
    ({"ratio": 0.96}, "painleve.v: 6 m/s is too slow for the end to slide all the way"),
    ({"length": 840.0}, "painleve.v: 6 m/s is too slow for the rod to rise on its end"),
    ({"v": 12.0}, "painleve.v: at 12 m/s the end that has jammed lets go again"),
    ({"fall": 100.0}, "pair_matrix.v: 6 is too slow, an impact would grip"),
    ({"to": 0.1}, "pivot.to: 0.1 must be greater than from, 10"),
    ({"aspect": 2.0}, "pivot.to: at 40 degrees the side of a box of this aspect is about to land"),
    ({"mu": 0.0}, "pivot.mu: 0 does not hold the edge at 10 degrees"),
    ({"mu": 10.0, "shear": 5000.0}, "pressed_box.shear: 5000 weights tip the box over instead of sliding it"),
    ({"thickness": 410.0}, "rocker.radius: 0.5 m does not hold a board of 410 m; half as thick it would"),
    ({"radius": 1000.0}, "rocker.tilt: at 15 degrees the board falls off"),
    ({"tilt": 60.0}, "rocker.mu: 0.8 lets the board slip on the log"),
    ({"aspect": 1.4}, "rocking_block.mu: 0.6 lets it slide where it lands; it needs 0.705"),
    ({"angle": 70.0}, "shove.angle: at 70 degrees the boxes do not meet, or not for all of the run"),
    ({"ratio": 0.01}, "stacked_balls.e: 0.9 with ratio 0.01 makes more than 20 impacts"),
    ({"ratio": 9.1}, "tilt_table.ratio: at 9.1 the block slides and topples at once"),
    ({"ratio": 10.0, "mu": 4.2}, "tilt_table.mu: 4.2 does not hold the edge while the block topples"),
    ({"slope": 60.0, "mu": 10.0}, "wedge.ratio: a wedge of 2 times the block's mass tips, or the block does"),
]  # fmt: skip


@pytest.mark.parametrize(("params", "said"), REFUSED, ids=[said.partition(":")[0] for _, said in REFUSED])
def test_cell_outside_the_law_refused_by_name(params, said):
    canonical = CATALOGUE[said.partition(".")[0]]
    with pytest.raises(SceneError) as refused:
        canonical.scene(canonical.dimensions[0], params)
    assert str(refused.value) == said


@pytest.mark.parametrize("count", [0, 2])
def test_friction_of_a_blow_without_one_answer(monkeypatch, count):
    """Within its limits the rod always has one, so that others are put in the place of what the law finds."""
    law = kane.answers
    monkeypatch.setattr(kane, "answers", lambda *given: law(*given) * count)
    with pytest.raises(SceneError) as refused:
        CATALOGUE["kane"].scene(2, {"mu": 0.25})
    assert str(refused.value) == f"kane.mu: at 0.25 the law has {count} solutions, the scene needs one"
