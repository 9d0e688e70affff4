"""The error of a certificate covers gaps of the start, steps that no tolerance shortens, and all tolerances."""

import math
from fractions import Fraction

import numpy as np
import pytest

from reference_solver import Body, Box, Disc, HalfSpace, Model, Settings, Simulation
from reference_solver.certificate.truth import certify, distance
from reference_solver.settings import TOLERANCES

G, MU_FLOOR, MU = 10.0, 0.1, 0.2


def carried(gap, at):
    """Return a disc of 4 kg that slides at 1 m/s on a box of 1 kg on a floor, open by a gap, at a place."""
    floor = Body(HalfSpace((0.0, 1.0)), motion="fixed", pose=(at, at, 0.0))
    box = Body(Box((0.5, 0.5)), 1.0, 1.0 / 6.0, (at, at + 0.5, 0.0))
    disc = Body(Disc(0.5), 4.0, 0.5, (at, at + 1.5 + gap, 0.0), (1.0, 0.0, 0.0))
    friction = np.array([[0.0, MU_FLOOR, 0.0], [MU_FLOOR, 0.0, MU], [0.0, MU, 0.0]])
    return Model(2, [floor, box, disc], (0.0, -G), 0.0, friction)


@pytest.mark.parametrize(
    ("gap", "at"), [(0.0, 0.0), (2.0**-52, 0.0), (2.0**-42, 0.0), (2.0**-42, 1024.0), (2.0**-35, 131072.0)]
)
def test_load_that_closes_a_gap_after_the_start(gap, at):
    """While the disc falls, for sqrt(2 gap / g), friction of the floor holds the box; then a blow moves it."""
    t, fall = 0.1, math.sqrt(2.0 * gap / G)
    blow = (MU - MU_FLOOR) * 4.0 * G * fall
    pull = (4.0 * MU - 5.0 * MU_FLOOR) * G
    truth = blow * (t - fall) + 0.5 * pull * (t - fall) ** 2
    found = certify(carried(gap, at), Settings.reference(1.0 / 240.0), 24)
    off = abs(found.pose[-1, 1, 0] - at - truth)
    assert not found.holds or off <= found.error[-1]


@pytest.mark.parametrize("tolerance", [1e-5, 1e-7, 1e-11])
def test_disc_on_a_floor_that_turns(tolerance):
    """Its first step is as long for all tolerances, so that runs to others tell nothing of the error of that step."""
    floor = Body(HalfSpace((0.0, 1.0)), motion="prescribed", twist=(0.0, 0.0, 0.37))
    disc = Body(Disc(0.25), 1.0, 1.0 / 32.0, (0.5, 0.25, 0.0), (0.0, 0.185, 0.0))
    model = Model(2, [floor, disc], (0.0, -G), 0.0, 0.6)
    truth = Simulation(model, Settings.reference(1.0 / 240.0, 1e-12)).record(40).pose
    found = certify(model, Settings.reference(1.0 / 240.0, tolerance), 40)
    assert not found.holds or (distance(model, found.pose, truth) <= found.error).all()


@pytest.mark.parametrize("tolerance", TOLERANCES)
def test_error_at_the_ends_of_the_range_of_tolerances(tolerance):
    """One of the runs beside has the same tolerance; the other still tells the error."""
    floor = Body(HalfSpace((0.0, 1.0)), motion="prescribed", twist=(0.0, 0.0, 0.37))
    disc = Body(Disc(0.25), 1.0, 1.0 / 32.0, (0.5, 0.25, 0.0), (0.0, 0.185, 0.0))
    found = certify(Model(2, [floor, disc], (0.0, -G), 0.0, 0.6), Settings.reference(1.0 / 240.0, tolerance), 10)
    assert found.holds
    assert found.error[-1] > 0.0


def test_gap_that_a_fall_through_changes_nothing():
    """One body on a fixed floor moves as if it had touched from the start: X has the gap alone."""
    gap = 2.0**-45
    box = Body(Box((0.5, 0.5)), 1.0, 1.0 / 6.0, (0.0, 0.5 + gap, 0.0), (1.0, 0.0, 0.0))
    model = Model(2, [Body(HalfSpace((0.0, 1.0)), motion="fixed"), box], (0.0, -G), 0.0, MU)
    found = certify(model, Settings.reference(1.0 / 240.0), 24)
    assert found.holds
    assert found.error[-1] < 20.0 * gap


@pytest.mark.parametrize(
    ("pull", "rises", "radius", "leaves", "step"),
    [
        (1.259755465928995, 1.2094470032036997, 0.2305946841104412, -0.0028765490977908925, 0.017777246252075912),
        (5.081481005325863, 1.2, 0.23, 0.015465376972731, 0.0175),
    ],
)
def test_many_low_rebounds_from_a_floor_that_rises(pull, rises, radius, leaves, step):
    """Each blow finds places rounded by a last place, alike in all, which loads make a speed: 3.6e-12 m in the first.

    The other one is right, and comes out otherwise far from the origin by as much as that makes there.
    """
    floor = Body(HalfSpace((0.0, 1.0)), motion="prescribed", twist=(0.0, rises, 0.0))
    ball = Body(Disc(radius), 1.0, 0.5 * radius**2, (0.0, radius, 0.0), (0.0, rises + leaves, 0.0))
    model = Model(2, [floor, ball], (0.0, -pull), 1.0, 0.0)
    found = certify(model, Settings.reference(step), 80)
    speed, g = abs(Fraction(rises + leaves) - Fraction(rises)), Fraction(pull)
    truth = found.pose.copy()
    for k, t in enumerate(map(Fraction, found.t)):
        since = t % (2 * speed / g)
        truth[k, 1, 1] = radius + float(Fraction(rises) * t + speed * since - g * since**2 / 2)
    assert found.holds
    assert (distance(model, found.pose, truth) <= found.error).all()


@pytest.mark.parametrize("sooner", [0.0, 3e-16, 1e-15, 1e-14])
def test_ball_that_meets_the_floor_as_it_is_looked_at(sooner):
    """It has moved by a last place when it is looked at after its blow, and has rebounded before the next look."""
    ball = Body(Disc(0.5), 1.0, 0.125, (0.0, 0.5 + 1.25 * (1.0 - sooner), 0.0))
    model = Model(2, [Body(HalfSpace((0.0, 1.0)), motion="fixed"), ball], (0.0, -10.0), 0.4, 0.0)
    found = certify(model, Settings.reference(0.5), 4)
    assert found.holds
    assert found.error[-1] < 1e-11
