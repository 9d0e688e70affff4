"""How a contact yields while all others hold on, against dense algebra (E38)."""

import numpy as np
import pytest

from reference_solver.compilation import from_python
from reference_solver.stepping import turning_slips
from reference_solver.stepping.lasting import CONTACTS, OPEN, SLIP, STICK, allocate_lasting

steady_slips, yield_alone, yield_with_others = (
    from_python(each)
    for each in (
        turning_slips.steady_slips,
        turning_slips.yield_alone,
        turning_slips.yield_with_others,
    )
)

#: Bodies, of which nothing moves the first, and pairs in contact: the first slips, and holds on to a chain of others,
#: most of which share no body with it; the last pair touches none of them.
BODIES = 8
PAIRS = ((1, 2), (2, 3), (3, 4), (0, 4), (4, 5), (1, 0), (6, 7))


def chain(seed, twice=False):
    """Contacts that stick and slip, by turns and one of them open; ``twice``: one says what another does."""
    rng = np.random.default_rng(seed)
    lasting = allocate_lasting(3, BODIES, len(PAIRS) + twice)
    lasting.size[CONTACTS] = len(PAIRS) + twice
    inverse_mass = np.repeat(rng.uniform(0.5, 2.0, (BODIES, 1)), 6, axis=1)
    inverse_mass[0] = 0.0
    for k, pair in enumerate(PAIRS + ((1, 0),) * twice):
        of = 5 if k == len(PAIRS) else k
        lasting.body[k] = pair
        lasting.jacobian[k] = lasting.jacobian[of] if of != k else rng.normal(size=(2, 3, 6))
        lasting.response[k] = lasting.jacobian[k] * inverse_mass[list(pair)][:, None]
        lasting.mode[k] = (SLIP, STICK, SLIP, STICK, OPEN, STICK, STICK, STICK)[k]
        lasting.friction[k] = 0.2
        angle = rng.uniform(0.0, 2.0 * np.pi)
        lasting.direction[k] = np.cos(angle), np.sin(angle)
        lasting.scale[k] = 1.0
        lasting.usual[k] = rng.uniform(1.0, 2.0, 3)
    return lasting


def spread(lasting, table, k, row):
    """A row of a contact over the velocities of all bodies."""
    whole = np.zeros(6 * BODIES)
    for side in range(2):
        at = 6 * lasting.body[k, side]
        whole[at : at + 6] += table[k, side, row]
    return whole


def yields(lasting, k):
    """Compliance of contact k less what those do that hold on."""
    own = np.array([spread(lasting, lasting.jacobian, k, row) for row in range(3)])
    push = np.array([spread(lasting, lasting.response, k, row) for row in range(3)])
    rows, forces = [], []
    for other in range(lasting.size[CONTACTS]):
        for row in range(3):
            if other == k or lasting.mode[other] == OPEN or (row > 0 and lasting.mode[other] == SLIP):
                continue
            rows.append(spread(lasting, lasting.jacobian, other, row))
            force = spread(lasting, lasting.response, other, row)
            if lasting.mode[other] == SLIP:
                for t in range(2):
                    rubs = lasting.friction[other] * lasting.direction[other, t]
                    force = force - rubs * spread(lasting, lasting.response, other, 1 + t)
            forces.append(force)
    rows, forces = np.array(rows), np.array(forces)
    return own @ push.T - own @ forces.T @ np.linalg.pinv(rows @ forces.T, rcond=1e-10) @ (rows @ push.T)


@pytest.mark.parametrize("twice", [False, True])
@pytest.mark.parametrize("seed", range(4))
def test_a_contact_yields_as_dense_algebra_says(seed, twice):
    """Through others that share no body with it, and where some of them say the same."""
    lasting = chain(seed, twice)
    yield_alone(lasting, 0)
    alone = lasting.gives.copy()
    yield_with_others(lasting, 0)
    expected = yields(lasting, 0)
    assert np.abs(expected - alone).max() > 0.1 * np.abs(expected).max()
    assert np.abs(lasting.gives - expected).max() <= 1e-8 * np.abs(expected).max()


def test_what_only_tangents_move_is_taken_along():
    """The rows that another holds are pushed by none of the first's normal force."""
    lasting = chain(5)
    lasting.mode[2:] = OPEN
    lasting.jacobian[0, 1, 0, 1:] = lasting.response[0, 1, 0, 1:] = 0.0
    lasting.jacobian[1, 0, :, 0] = lasting.response[1, 0, :, 0] = 0.0
    yield_alone(lasting, 0)
    yield_with_others(lasting, 0)
    assert np.abs(lasting.gives - yields(lasting, 0)).max() <= 1e-10 * np.abs(lasting.gives).max()


@pytest.mark.parametrize("slow", [(True, True), (True, False), (False, True), (False, False)])
def test_which_slips_were_turned_is_noted(slow):
    """Two that do not know of each other; where both go fast friction follows them by itself."""
    lasting = allocate_lasting(3, 4, 3)
    lasting.size[CONTACTS], lasting.length[0] = 3, 1e-3
    lasting.turned[:] = 7
    for k, (slowly, pair) in enumerate(zip((*slow, True), ((0, 1), (0, 2), (0, 3)), strict=True)):
        rows = np.zeros((3, 6))
        rows[0, 2] = rows[1, 0] = rows[2, 1] = 1.0
        lasting.body[k], lasting.jacobian[k, 1], lasting.response[k, 1] = pair, rows, rows
        lasting.mode[k], lasting.friction[k], lasting.speeds[k] = SLIP, 0.5, 1.0
        lasting.direction[k], lasting.force[k] = (1.0, 0.0), (2.0, -1.0, 0.0)
        lasting.speed[k] = 0.0, 1e-5 if slowly else 1.0, 0.0
        lasting.gamma[k] = 0.0, 1.0, 1.0
    lasting.mode[2] = STICK
    before = lasting.direction.copy()
    assert bool(steady_slips(lasting)) is any(slow)
    assert lasting.turned.tolist() == [*map(int, slow), 0]
    assert [bool((lasting.direction[k] != before[k]).any()) for k in range(2)] == list(slow)
