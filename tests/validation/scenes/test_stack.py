"""The column of boxes: what is built, where its top is expected, and which heights and counts are run."""

import pytest

from validation.catalogue import CATALOGUE
from validation.scenes import stack


@pytest.mark.parametrize("dimension", [2, 3])
def test_boxes_stand_on_each_other_touching(dimension):
    made = CATALOGUE["stack"].scene(dimension, {"n": 3, "mass": 2.0, "mu": 0.25, "g": 8.0, "duration": 4.0})
    level = (0.0,) * (dimension - 1)
    assert [body.name for body in made.bodies] == ["floor", "box1", "box2", "box3"]
    assert [body.pose[:dimension] for body in made.bodies[1:]] == [(*level, h) for h in (0.5, 1.5, 2.5)]
    assert {body.shape.half_extents for body in made.bodies[1:]} == {(0.5,) * dimension}
    assert {body.mass for body in made.bodies[1:]} == {2.0} and made.bodies[0].motion == "fixed"
    material = made.material("box1", "box2")
    assert (material.restitution, material.friction) == (0.0, 0.25)
    assert (made.name, made.version, made.gravity, made.duration) == ("stack", 1, (*level, -8.0), 4.0)
    assert made.params == {"n": 3, "mass": 2.0, "mu": 0.25, "g": 8.0, "duration": 4.0}
    track = stack.track(made)
    assert track.body == "box3" and track.position(1.0) == track.position(9.0) == (*level, 2.5)


def test_cells_of_the_stack():
    standard = {v.params["n"]: v.iterations for v in CATALOGUE["stack"].standard}
    assert standard == {n: (None, 1, 4, 10, 30, 100) if n == 10 else (None,) for n in (1, 2, 5, 10, 20)}
    full = {v.params["n"]: v.iterations for v in CATALOGUE["stack"].full}
    assert full == dict.fromkeys((1, 2, 5, 10, 20), (None, 1, 4, 10, 30, 100))
