"""Round-off of gaps and speeds is taken off where contacts are held (E39)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from reference_solver.exact.bodies import State, World
from reference_solver.exact.forces import Held
from reference_solver.exact.problem import SINGULAR, STICK
from reference_solver.exact.record import NO_BLOW, Blow
from reference_solver.exact.rows import Contacts
from reference_solver.model import Array
from reference_solver.pieces import ROCKING

#: Share of the smallest half width below which gaps are left alone; speeds are below `NO_BLOW`.
GAP = 1e-14


def projected(world: World, state: State, held: Held) -> tuple[State, Blow | None]:
    """Return the state with gaps of held contacts closed, and speeds taken off along rows that are held.

    Ways and changes of velocity are those of the least kinetic energy: M^-1 G'. What is left of slips is more than
    round-off: what takes it off is a blow of the record, which is returned as well.

    Raises
    ------
    numpy.linalg.LinAlgError
        If a least-squares solution does not converge: rows without numbers.
    """
    contacts, d = held.contacts, world.dimension
    if not len(contacts):
        return state, None
    rows = contacts.at_state(state).rows
    normal = np.arange(len(contacts)) * d
    if np.abs(rows.gap).max() > GAP * world.size:
        for _ in range(2):
            least = _least(contacts, normal, -contacts.rows.gap)
            state = state.moved((contacts.matrices[1] @ least).reshape(state.velocity.shape))
            contacts.at_state(state)
    ended = _at_end(held)
    sticks = np.flatnonzero((held.answer.modes == STICK) | ended)
    keeps = np.concatenate([normal, (sticks[:, None] * d + np.arange(1, d)).ravel()])
    speed = contacts.rows.speed.ravel()[keeps]
    if np.abs(speed).max() <= NO_BLOW * world.speed:
        return state, None
    impulses = _least(contacts, keeps, -speed).reshape(-1, d)
    after = state.moving(state.velocity + contacts.changes(impulses))
    blow = Blow.of(after, contacts, impulses, ROCKING)
    contacts.at_state(after)
    return after, blow


def _at_end(held: Held) -> NDArray[np.bool_]:
    """Whether a contact in space slips by so little that its slip is over: what begins there begins at rest (E23)."""
    contacts = held.contacts
    if contacts.world.dimension == 2:
        return np.zeros(len(contacts), bool)
    slip = np.linalg.norm(contacts.rows.speed[:, 1:], axis=1)
    return np.asarray((slip <= 2.0 * contacts.world.slipping) & (contacts.friction > 0.0))


def _least(contacts: Contacts, rows: NDArray[Any], wanted: Array) -> Array:
    """Return the impulses (m d,) of the least energy that change rows by what is wanted (r,)."""
    row, yields = contacts.matrices
    out, contact = np.zeros(len(row)), rows // contacts.world.dimension
    for group in contacts.groups:
        own = np.isin(contact, group)
        matrix = row[rows[own]] @ yields[:, rows[own]]
        out[rows[own]] = np.linalg.lstsq(matrix, wanted[own], rcond=SINGULAR)[0]
    return out
