"""What a model does not need is left out, and the answer stays the same."""

import numpy as np
import pytest

from reference_solver import Body, Box, Disc, HalfSpace, Model, Settings, Simulation, Sphere
from reference_solver.geometry import rotation

DT = 1.0 / 240.0
FLOOR = Body(HalfSpace((0.0, 1.0)), motion="fixed")


def discs(**fields):
    return [FLOOR] + [Body(Disc(0.5), 1.0, 0.125, (0.3 * i, 0.7 + 1.1 * i, 0.0), **fields) for i in range(3)]


def boxes():
    return [FLOOR] + [Body(Box((0.5, 0.5)), 1.0, 1 / 6, (0.1 * i, 0.6 + 1.1 * i, 0.1 * i)) for i in range(3)]


def many(count):
    return [FLOOR] + [
        Body(Disc(0.5), 1.0, 0.125, (1.01 * (i % 10) + 0.2 * (i // 10), 0.5 + 1.02 * (i // 10), 0.0))
        for i in range(count)
    ]


@pytest.mark.parametrize(
    ("bodies", "restitution", "friction", "left_out"),
    [
        (discs(), 0.5, 0.0, ("rotation", "friction", "broadphase")),
        (discs(), 0.0, 0.0, ("rotation", "friction", "restitution", "broadphase")),
        (discs(torque=1.0), 0.0, 0.0, ("friction", "restitution", "broadphase")),
        (discs(), 0.0, 0.3, ("restitution", "broadphase")),
        (boxes(), 0.5, 0.0, ("friction", "broadphase")),
        (many(70), 0.5, 0.3, ()),
    ],
)
def test_names_of_parts_left_out(bodies, restitution, friction, left_out):
    model = Model(2, bodies, (0.0, -9.81), restitution, friction)
    assert Simulation(model, Settings.classical(DT)).left_out == left_out


@pytest.mark.parametrize("profile", [Settings.classical, Settings.fixed_step])
@pytest.mark.parametrize(
    ("bodies", "restitution", "friction"),
    [
        (discs(), 0.5, 0.0),
        (discs(twist=(1.0, 0.0, 2.0)), 0.0, 0.0),
        (boxes(), 0.0, 0.0),
        (boxes(), 0.5, 0.4),
        (many(30), 0.0, 0.2),
    ],
    ids=["bouncing discs", "spinning discs", "smooth boxes", "boxes", "crowd"],
)
def test_answer_of_the_full_model(profile, bodies, restitution, friction):
    model = Model(2, bodies, (0.0, -9.81), restitution, friction)
    lean, full = (Simulation(model, profile(DT), model_everything=flag) for flag in (False, True))
    for simulation in (lean, full):
        simulation.advance(120)
    assert full.left_out == ()
    # Half a second with few impacts: round-off times a growth of less than a hundred.
    assert lean.pose == pytest.approx(full.pose, abs=1e-12)
    assert lean.twist == pytest.approx(full.twist, abs=1e-12)


def test_angular_momentum_of_a_smooth_lopsided_ball():
    """Nothing turns it: with unequal moments it is the angular momentum that stays, and the spin that does not."""
    upright, moments, spin = (1.0, 0.0, 0.0, 0.0), np.array([0.04, 0.08, 0.1]), np.array([3.0, 1.0, 2.0])
    floor = Body(HalfSpace((0.0, 0.0, 1.0)), pose=(0.0, 0.0, 0.0, *upright), motion="fixed")
    ball = Body(Sphere(0.5), 1.0, tuple(moments), (0.0, 0.0, 0.5, *upright), (0.3, 0.0, 0.0, *spin))
    simulation = Simulation(Model(3, [floor, ball], (0.0, 0.0, -9.81), 0.0, 0.0), Settings.reference(DT))
    simulation.advance(120)
    turn = rotation(simulation.pose[1:2])[0]
    # Each of some ten steps to the tolerance may be off by 1e-11 of the turn in it, half a radian or less.
    assert turn @ np.diag(moments) @ turn.T @ simulation.twist[1, 3:] == pytest.approx(moments * spin, abs=1e-10)
    assert simulation.pose[1, :3] == pytest.approx([0.15, 0.0, 0.5], abs=1e-14)


def test_pairs_of_sort_and_sweep_against_all_pairs():
    """The same 60 bodies with and without broadphase: the same contacts, bit for bit."""
    model = Model(2, many(60), (0.0, -9.81), 0.3, 0.4)
    plain = Simulation(model, Settings.classical(DT))
    sorted_ = Simulation(model, Settings.classical(DT), model_everything=True)
    for _ in range(10):
        plain.advance(20)
        sorted_.advance(20)
        assert plain.contacts().body_a.tolist() == sorted_.contacts().body_a.tolist()
        assert plain.contacts().feature.tolist() == sorted_.contacts().feature.tolist()
    assert (plain.pose == sorted_.pose).all()
    assert len(plain.contacts()) > 40
