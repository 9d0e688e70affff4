"""Contacts that share no free body are solved apart: the same forces, and no answer of one depends on another."""

import numpy as np
import pytest

from reference_solver import Body, Box, Capsule, HalfSpace, Model
from reference_solver.exact import rows
from reference_solver.exact.bodies import start_of, world_of
from reference_solver.exact.forces import accelerations, decide
from reference_solver.exact.motion import free_acceleration
from reference_solver.exact.problem import Problem
from reference_solver.exact.rows import touching_contacts

G = 9.81


def rods_and_a_stack(spin=0.0):
    """Two rods that lean on their round ends, the second faster, and two boxes on each other, on one floor."""
    rods = [
        Body(Capsule(0.4, 0.1), 1.0, 0.06, (3.0 * k, 0.1 + 0.4 * np.sin(1.2), 1.2), (-spin * 0.1, 0.0, spin * k))
        for k in range(2)
    ]
    boxes = [Body(Box((0.5, 0.5)), 1.0, 0.2, (8.0, 0.5 + k, 0.0)) for k in range(2)]
    model = Model(2, [Body(HalfSpace((0.0, 1.0)), motion="fixed"), *rods, *boxes], (0.0, -G), 0.0, 0.7)
    world, state = world_of(model), start_of(model)
    return world, state, touching_contacts(world, state)


def test_groups_of_contacts_on_one_floor():
    contacts = rods_and_a_stack()[2]
    bodies = [sorted(set(contacts.features[group, :2].ravel().tolist())) for group in contacts.groups]
    assert sorted(bodies) == [[0, 1], [0, 2], [0, 3, 4]]
    assert sorted(np.concatenate(contacts.groups)) == list(range(len(contacts)))


@pytest.mark.parametrize("spin", [0.0, 0.5])
def test_forces_of_groups_against_all_at_once(monkeypatch, spin):
    world, state, contacts = rods_and_a_stack(spin)
    free = free_acceleration(world, state.axes, state.velocity)
    apart = decide(world, state, contacts, free)
    monkeypatch.setattr(rows.Contacts, "groups", property(lambda self: [np.arange(len(self))]))
    whole = decide(world, state, contacts, free)
    assert np.array_equal(apart.answer.modes, whole.answer.modes)
    assert np.abs(apart.answer.forces - whole.answer.forces).max() < 1e-12 * G


def test_forces_of_held_modes():
    """One kernel for all groups, against one system of all rows."""
    world, state, contacts = rods_and_a_stack()
    free = free_acceleration(world, state.axes, state.velocity)
    held = decide(world, state, contacts, free)
    forces, acceleration = held.follow(state.place, state.axes, state.velocity, free)
    assert np.abs(acceleration - held.acceleration).max() < 1e-12 * G
    answer = Problem(held.contacts, accelerations(held.contacts, free), np.zeros((len(held.contacts), 2))).with_modes(
        held.answer.modes, held.answer.directions, held.answer.forces
    )
    assert np.abs(forces - answer.forces).max() < 1e-12 * G
