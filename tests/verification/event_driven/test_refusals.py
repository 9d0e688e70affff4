"""What has no closed form is refused by name, before it could give a wrong answer."""

import numpy as np
import pytest

from reference_solver import Body, Box, Capsule, Disc, HalfSpace, Model, Polygon, Sphere
from tests.verification.event_driven.oracle import EventDriven

STILL = (0.0, 0.0, 0.0)


def model(*bodies, dimension=2):
    return Model(dimension, bodies, (0.0,) * dimension, np.float64(0.5), np.float64(0.0))


def disc(x, y=0.0):
    return Body(Disc(0.5), mass=1.0, inertia=0.1, pose=(x, y, 0.0))


@pytest.mark.parametrize(
    ("bodies", "reason"),
    [
        ([Body(Box((1.0, 1.0)), mass=1.0, inertia=1.0), Body(Box((1.0, 1.0)), mass=1.0, inertia=1.0)], "one box"),
        ([Body(Box((1.0, 1.0)), motion="fixed"), disc(5.0)], r"bodies\[0\]: only a free planar box"),
        ([Body(Box((1.0, 1.0)), mass=1.0, inertia=1.0, torque=1.0)], "torque"),
        ([disc(0.0), Body(HalfSpace((0.0, 1.0)), motion="prescribed", twist=(0.0, 0.0, 1.0))], "turns"),
        ([disc(0.0), disc(0.9)], "bodies: 0 and 1 overlap by 0.1 m"),
        ([Body(Capsule(0.5, 0.2), mass=1.0, inertia=0.1)], r"bodies\[0\]: contacts of a Capsule"),
        ([disc(5.0), Body(Polygon(((1.0, 0.0), (0.0, 1.0), (-1.0, -1.0))), 1.0, 1.0)], r"bodies\[1\]: .* Polygon"),
        ([Body(HalfSpace((0.0, 1.0)), motion="fixed"), disc(0.0, 0.4)], "overlap"),
        ([Body(HalfSpace((0.0, 1.0)), motion="fixed"), Body(Box((1.0, 1.0)), mass=1.0, inertia=1.0)], "overlap"),
    ],
)
def test_refusal_of_a_model_without_closed_form(bodies, reason):
    with pytest.raises(ValueError, match=reason):
        EventDriven(model(*bodies))


def test_refusal_of_a_wobbling_sphere():
    body = Body(Sphere(0.5), mass=1.0, inertia=(0.1, 0.1, 0.2), pose=(*STILL, 1.0, 0.0, 0.0, 0.0))
    with pytest.raises(ValueError, match="principal moments"):
        EventDriven(model(body, dimension=3))


def test_an_unknown_law_is_refused():
    with pytest.raises(ValueError, match="law"):
        EventDriven(model(disc(0.0)), law="POISSON")


def test_time_does_not_run_backwards():
    run = EventDriven(model(disc(0.0)))
    run.advance(1.0)
    with pytest.raises(ValueError, match="until"):
        run.advance(0.5)


def test_starts_with_touch_and_crossed_half_spaces():
    corner = [Body(HalfSpace((0.0, 1.0)), motion="fixed"), Body(HalfSpace((1.0, 0.0)), motion="fixed")]
    EventDriven(model(*corner, disc(0.5, 0.5))).run()
