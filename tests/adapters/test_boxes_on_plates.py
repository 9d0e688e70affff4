"""A law of a box on a half-space, asked of one on a plate: the plate is the ground, wherever it lies."""

import math
from dataclasses import replace

import pytest

from adapters.mujoco.plates import on_a_plate
from adapters.scene import Body, Box, Disc, HalfSpace, Pair, Scene, Sphere


def on_plate(dimension, place=(7.0, 3.0, -2.0), gap=0.01, **changes):
    """A box `gap` above a plate whose centre lies at ``place``."""
    half = (0.5, 0.3, 0.25)[3 - dimension :]
    turn = (0.0,) if dimension == 2 else (1.0, 0.0, 0.0, 0.0)
    centre = place[3 - dimension :]
    thick = 0.2
    plate = Body("plate", Box((4.0,) * (dimension - 1) + (thick,)), motion="fixed", pose=(*centre, *turn))
    at = (centre[0] + 0.75, *centre[1:-1], centre[-1] + thick + gap + half[-1])
    inertia = 0.1 if dimension == 2 else (0.1, 0.2, 0.3)
    box = Body("box", Box(half), 2.0, inertia, (*at, *turn))
    pairs = (Pair("plate", "box", 0.0, 0.375), Pair(restitution=0.5, friction=0.125))
    return replace(
        Scene("slide", 1, dimension, (plate, box), pairs, (0.0,) * (dimension - 1) + (-9.81,), 1.5), **changes
    )


def asked(scene, metric="way", answer=(2.0, 0.25)):
    """What the law is asked, and what is made of its answer."""
    given = []

    def law(flat, dt, measure):
        given.append((flat, dt, measure))
        return answer

    found = on_a_plate(law, metric)(scene, 0.01, "measure")
    return found, given


@pytest.mark.parametrize("dimension", [2, 3])
def test_box_relative_to_the_top_of_its_plate(dimension):
    scene = on_plate(dimension)
    found, ((flat, dt, measure),) = asked(scene)
    ground, box = flat.bodies
    assert (dt, measure) == (0.01, "measure")
    assert ground.motion == "fixed" and ground.shape == HalfSpace((*(0.0,) * (dimension - 1), 1.0), 0.0)
    assert box.pose[:dimension] == pytest.approx((0.75, *(0.0,) * (dimension - 2), 0.01 + box.shape.half_extents[-1]))
    assert box == replace(scene.bodies[1], pose=box.pose)
    assert box.pose[dimension:] == scene.bodies[1].pose[dimension:]
    assert flat.material("ground", "box").friction == 0.375 and flat.material("ground", "box").restitution == 0.0
    assert (flat.gravity, flat.duration, flat.dimension) == (scene.gravity, 1.5, dimension)
    far = max(abs(x) for body in scene.bodies for x in body.pose[:dimension])
    assert found == (2.0, 0.25 + math.ulp(far) / 0.01 * 1.5)
    assert asked(scene, "braking")[0] == (2.0, 0.25 + math.ulp(far) / 0.01 * 6.0 / 1.5)
    assert asked(on_plate(dimension, (0.0, 1e6, -1e6)))[0][1] == pytest.approx(0.25 + math.ulp(1e6) / 0.01 * 1.5)


def test_bodies_other_than_a_box_on_a_level_plate():
    scene = on_plate(3)
    plate, box = scene.bodies
    tilted = replace(plate, pose=(*plate.pose[:3], math.cos(0.1), math.sin(0.1), 0.0, 0.0))
    for bodies in (
        (plate,), (plate, box, replace(box, name="other")), (tilted, box), (replace(plate, shape=Sphere(1.0)), box),
        (Body("plate", Box((1.0,) * 3), 1.0, (1.0,) * 3, plate.pose), box),
    ):  # fmt: skip
        assert asked(replace(scene, bodies=bodies, pairs=(Pair(),))) == (None, [])
    flat = on_plate(2)
    assert asked(replace(flat, bodies=(replace(flat.bodies[0], shape=Disc(1.0)), flat.bodies[1]))) == (None, [])
    found, given = asked(scene, answer=None)
    assert found is None and len(given) == 1
