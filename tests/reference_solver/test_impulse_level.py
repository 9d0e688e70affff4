"""The impulse-level scheme where contacts turn: second order, against integrations with the contact held (E28)."""

import pytest

from tests.verification.turning_scenes import PLANE, SPATIAL, case

#: Rates [1/s] at which errors are compared.
COARSE, FINE = 60, 120


@pytest.mark.parametrize(
    ("space", "name"),
    [
        (PLANE, "box pivoting on a corner"),
        (PLANE, "disc rolling off a disc"),
        (SPATIAL, "box pivoting on an edge"),
        (SPATIAL, "sphere rolling off a sphere"),
    ],
)
def test_half_the_step_leaves_a_quarter_of_the_error(space, name):
    """Levers and normals of the start, or wrong ones at mid-drift, make it of first order or of none.

    What is left beside h^2 is h^3: some h times the rate of the motion, which is about 4 rad/s, of it.
    """
    scene = case(space, name)
    share = scene.error(COARSE, "midpoint") / scene.error(FINE, "midpoint")
    assert share == pytest.approx(4.0, rel=4.0 / COARSE)
