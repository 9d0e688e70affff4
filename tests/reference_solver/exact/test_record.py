"""What the loop says that contacts did, and that saying it changes nothing."""

import copy
import hashlib

import numpy as np
import pytest
from oracle import world_of

from reference_solver import Body, Box, Disc, HalfSpace, Model, Settings, Simulation
from reference_solver.certificate.audit import audit
from reference_solver.certificate.truth import away, certify

DT, G = 1 / 240, 9.81
KEYS = ["fuzz2 0", "fuzz2 3", "fuzz3 1", "chains2 2", "random 5"]


def hashed(*arrays):
    return hashlib.sha256(b"".join(np.ascontiguousarray(each).tobytes() for each in arrays)).hexdigest()


@pytest.mark.parametrize("key", KEYS)
@pytest.mark.parametrize("seed", range(3))
def test_bits_of_random_splits(key, seed):
    """Whatever parts a run is made in, recorded or not, on a copy or not."""
    world, random = world_of(key), np.random.default_rng(seed)
    steps = world.samples * world.stride
    whole = Simulation(world.model, Settings.reference(world.dt))
    whole.advance(steps)
    simulation, left = Simulation(world.model, Settings.reference(world.dt)), steps
    while left:
        part = int(random.integers(1, left + 1))
        if random.random() < 0.5:
            simulation.record(part, int(random.integers(1, part + 1)), pieces=random.random() < 0.5, contacts=True)
        else:
            simulation = copy.copy(simulation)
            simulation.advance(part)
        left -= part
    assert hashed(whole.pose, whole.twist) == hashed(simulation.pose, simulation.twist)


@pytest.mark.parametrize("key", KEYS)
def test_pieces_of_a_record_in_parts(key):
    world = world_of(key)
    steps = world.samples * world.stride
    whole = Simulation(world.model, Settings.reference(world.dt)).record(steps, pieces=True)
    simulation = Simulation(world.model, Settings.reference(world.dt))
    parts = [simulation.record(each, pieces=True) for each in (steps // 3, steps - steps // 3)]
    for name in ("impulse", "moment", "point", "pose_after", "twist_after", "body", "body_a", "feature"):
        joined = np.concatenate([getattr(part.pieces, name) for part in parts])
        assert np.array_equal(joined, getattr(whole.pieces, name)), name


def test_weight_of_a_step_on_contacts():
    """Two boxes that rest on each other: corners carry their weights, and friction nothing."""
    bodies = [Body(Box((0.5, 0.5)), 2.0, 1 / 3, (0.0, 0.5 + i, 0.0)) for i in range(2)]
    model = Model(2, [Body(HalfSpace((0.0, 1.0)), motion="fixed"), *bodies], (0.0, -G), 0.0, 0.5)
    simulation = Simulation(model, Settings.reference(DT))
    simulation.advance(10)
    found = simulation.contacts()
    for pair, weight in (((0, 1), 4.0 * G), ((1, 2), 2.0 * G)):
        own = (found.body_a == pair[0]) & (found.body_b == pair[1])
        assert own.sum() == 2
        assert found.impulse[own].sum(axis=0) == pytest.approx([0.0, weight * DT], abs=1e-14)


def test_contacts_of_a_step_with_a_blow():
    """A disc that lands and stays: the blow and what holds it afterwards are one contact."""
    disc = Body(Disc(0.5), 1.0, 0.125, (0.0, 0.5 + 0.5 * G * (2.5 * DT) ** 2, 0.0))
    model = Model(2, [Body(HalfSpace((0.0, 1.0)), motion="fixed"), disc], (0.0, -G), 0.0, 0.5)
    record = Simulation(model, Settings.reference(DT)).record(4, contacts=True)
    assert np.diff(record.offset).tolist() == [0, 0, 0, 1, 1]
    assert record.contacts.impulse[:, 1] == pytest.approx([3.0 * G * DT, G * DT], rel=1e-12)


def test_record_of_bodies_that_a_belt_moves():
    """Two boxes that share nothing but the belt have pieces of their own, and in each the belt is where it is."""
    belt = Body(HalfSpace((0.0, 1.0)), motion="prescribed", twist=(1.0, 0.0, 0.0))
    boxes = [Body(Box((0.5, 0.5)), 1.0, 1 / 6, (2.0 * i, 0.5, 0.0)) for i in range(2)]
    model = Model(2, [belt, *boxes], (0.0, -G), 0.0, 0.5)
    pieces = Simulation(model, Settings.reference(DT)).record(10, pieces=True).pieces
    begin = np.repeat(pieces.begin, np.diff(pieces.first_body))
    own = pieces.body == 0
    assert own.sum() == len(pieces) == 20
    assert pieces.pose_before[own, 0] == pytest.approx(begin[own], abs=1e-15)


@pytest.mark.parametrize("key", ["standard slide 2-D", "standard domino 2-D"])
def test_horizon_of_impacts_of_round_off_beside_a_fast_corner(key):
    """Last places of speeds are an impact beside a corner that slides, or parts, a million million times as fast."""
    world = world_of(key)
    found = certify(world.model, Settings.reference(world.dt), world.samples * world.stride, world.stride)
    assert found.holds and np.isinf(found.horizon)


@pytest.mark.parametrize("key", ["fuzz3 8", "standard domino 2-D", "standard seam 3-D", "fuzz2 31", "fuzz2 61017"])
def test_impulses_that_moved_the_bodies(key):
    """Forces looked at anew are off by a step's error where a slip turns at once, and steps between their ends.

    So are shares of a load between the ends of a step; where none is shared impulses are those of the step.
    A step that an event cuts short has the impulses of its part.
    """
    world = world_of(key)
    record = Simulation(world.model, Settings.reference(world.dt)).record(
        world.samples * world.stride, world.stride, pieces=True
    )
    found = {finding.name: finding for finding in audit(world.model, record, world.dt)}
    assert all(found[name].holds for name in ("momentum", "moment", "spin"))


def test_tolerance_that_slips_reach_but_for_round_off():
    """The iteration of an implicit step ends where round-off is all that still changes."""
    world = world_of("fuzz3 35")
    Simulation(world.model, Settings.reference(world.dt, 1e-12)).advance(round(0.24 / world.dt))


def test_rebounds_that_coordinates_do_not_resolve():
    """Far from the origin a capsule rebounds by a unit in the last place of where it is, and comes to rest."""
    world = world_of("fuzz3 45")
    model = away(world.model, 3000.0).model(world.model)
    Simulation(model, Settings.reference(world.dt)).advance(round(0.04 / world.dt))


def test_error_after_an_impact_within_round_off_of_a_sample():
    """The gap until that sample tells no acceleration."""
    ball = Body(Disc(0.5), 1.0, 0.125, (0.0, np.nextafter(0.75, 0.0), 0.0), (0.0, -1.0, 0.0))
    model = Model(2, [Body(HalfSpace((0.0, 1.0)), motion="fixed"), ball], (0.0, 0.0), 1.0, 0.0)
    found = certify(model, Settings.reference(1 / 64), 32)
    assert found.holds
    assert found.error.max() < 1e-12


def test_edge_beside_a_corner_that_lies_on_a_face():
    """It comes down on the end of the face, where no corner meets anything."""
    world = world_of("fuzz3 61074")
    record = Simulation(world.model, Settings.reference(world.dt)).record(
        world.samples * world.stride, world.stride, pieces=True
    )
    assert [finding for finding in audit(world.model, record, world.dt) if not finding.holds] == []
