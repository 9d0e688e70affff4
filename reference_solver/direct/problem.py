"""One form of the contact problem for both dimensions: contacts with 1 + T rows, bodies with D velocities (E40).

Row 0 of a contact is its normal, the T = 1 or 2 others are its tangents; D = 3 or 6. Records have room for the
larger dimension; kernels loop up to the numbers in `Problem.size`.
"""

from __future__ import annotations

from typing import Any, NamedTuple, TypeAlias

import numpy as np

from reference_solver.model import Array
from reference_solver.pieces import Indices

#: Room for rows of a contact and velocities of a body.
ROWS, VELOCITIES = 3, 6

#: Entries of `Problem.size`: contacts, bodies in the matrix, rows per contact, velocities per body, factorisations;
#: 1 where the answer in use is this solver's.
CONTACTS, NODES, ROW_COUNT, VELOCITY_COUNT, FACTORISATIONS, HELD = 0, 1, 2, 3, 4, 5
SIZES = 6

#: Most numbers either triangle of the matrix may hold: 256 MB together, of which the operating system provides what is
#: written to. A planar pyramid of 5000 boxes needs a quarter; what needs more is left to the sweeps.
LARGEST_TRIANGLE = 16_000_000

#: Share of a contact's own impulse that its scale never falls below. With a residual of 1e-13 it allows 1e-14 of
#: the impulse, 45 units in the last place: what the sum over a tall column cannot be better than.
IMPULSE_SHARE = 0.1

#: Most contacts whose problem is solved by pivots (E45): a table of 4 c x (4 c + 2) numbers, 8 MB for these, and each
#: pivot passes over all of it.
PIVOTED_CONTACTS = 256

CONTACT = np.dtype(
    [
        ("body", "i8", 2),  # A, B
        ("friction", "f8"),  # mu
        ("target", "f8"),  # b_n [m/s]
        ("speed", "f8"),  # reference speed of the residual (E14) [m/s]
        ("admittance", "f8", 2),  # k_n, k_t [1/kg]
        ("jacobian", "f8", (2, ROWS, VELOCITIES)),  # of A and B: u = J_A v_A + J_B v_B
        ("response", "f8", (2, ROWS, VELOCITIES)),  # rows of J M^-1, of A and B
        ("impulse", "f8", ROWS),  # p
        ("best", "f8", ROWS),  # p of the smallest residual so far
        ("excess", "f8", ROWS),  # u - b with the impulses p
        ("change", "f8", ROWS),  # Pi(z) - p at the velocities tried
        ("terms", "f8", ROWS),  # size of the terms it is the sum of
        ("slope", "f8", (ROWS, ROWS)),  # Pi' rho there
    ],
    align=True,
)

BODY = np.dtype(
    [
        ("twist", "f8", VELOCITIES),  # with the impulses p
        ("weight", "f8", VELOCITIES),  # mass and moments for the size of F; 0 for what cannot change
        ("delta", "f8", VELOCITIES),  # change of the twist, the unknown of a round
        ("trial", "f8", VELOCITIES),  # value of it that F is evaluated at
        ("step", "f8", VELOCITIES),  # Newton's
        ("miss", "f8", VELOCITIES),  # F
        ("noise", "f8", VELOCITIES),  # size of the terms F is the sum of
        ("node", "i8"),  # place in the order of elimination; -1: not an unknown
        ("degree", "i8"),  # touching bodies that are unknowns
        ("begin", "i8"),  # where they start in `Problem.neighbour`
        ("mark", "i8"),  # last search that visited it
        ("queue", "i8"),  # entry i: the body visited as number i
    ],
    align=True,
)

# numpy's record arrays of the types above. Their fields are attributes that a type checker cannot know.
Records: TypeAlias = Any


class Problem(NamedTuple):
    """A contact problem and the room to solve it. Unknown i is velocity i % D of the body with node i // D."""

    size: Indices  # (SIZES,)
    contact: Records  # (c,) CONTACT
    body: Records  # (n,) BODY
    neighbour: Indices  # (2 c,): bodies that touch, grouped by body
    first: Indices  # (D n,): column of the first entry of each row of the lower triangle
    start: Indices  # (D n + 1,): where that row starts in `lower`, and the column with that number in `upper`
    lower: Array  # L, unit diagonal left out, row by row from its first entry
    upper: Array  # U above its diagonal, column by column from its first entry
    diagonal: Array  # (D n,): of U
    right: Array  # (D n,): right side, then solution
    table: Array  # (r, r + 2): of the pivots, r = 4 of each contact, in the plane up to `PIVOTED_CONTACTS`
    basic: Indices  # (r,): variable of each row of it
    free: Indices  # (r + 1,): variable of each column


def allocate_problem(dimension: int, bodies: int, contacts: int, used: bool) -> Problem:
    """Return room for a problem.

    Parameters
    ----------
    dimension
        2 or 3.
    bodies, contacts
        Numbers of bodies and of contact points there must be room for.
    used
        False: nothing will be solved, all arrays have one entry.
    """
    velocities, rows = (3, 2) if dimension == 2 else (6, 3)
    if not used:
        bodies = contacts = 1
    unknowns, pivoted = velocities * bodies, 4 * min(contacts, PIVOTED_CONTACTS) if used and dimension == 2 else 0
    triangle = min(unknowns * (unknowns - 1) // 2, LARGEST_TRIANGLE)
    size = np.zeros(SIZES, np.int64)
    size[ROW_COUNT], size[VELOCITY_COUNT] = rows, velocities
    return Problem(
        size=size,
        contact=np.zeros(contacts, CONTACT).view(np.recarray),
        body=np.zeros(bodies, BODY).view(np.recarray),
        neighbour=np.zeros(2 * contacts, np.int64),
        first=np.zeros(unknowns, np.int64),
        start=np.zeros(unknowns + 1, np.int64),
        lower=np.zeros(triangle),
        upper=np.zeros(triangle),
        diagonal=np.zeros(unknowns),
        right=np.zeros(unknowns),
        table=np.zeros((pivoted, pivoted + 2)),
        basic=np.zeros(pivoted, np.int64),
        free=np.zeros(pivoted + 1, np.int64),
    )
