"""Which direction friction goes by where a slip is slow, turns round or comes to its end (E38)."""

import numpy as np
import pytest

from reference_solver.compilation import from_python
from reference_solver.stepping import turning_slips
from reference_solver.stepping.lasting import CONTACTS, LAST, ONWARD, OPEN, SLIP, START, STICK, allocate_lasting

steady_slip, follow_slip, stops_across, most_yield, forget_yields = (
    from_python(each)
    for each in (
        turning_slips.steady_slip,
        turning_slips.follow_slip,
        turning_slips.stops_across,
        turning_slips.most_yield,
        turning_slips.forget_yields,
    )
)

STEP, MU, PRESSED = 1e-3, 0.5, 2.0
#: What gives way along both tangents to a unit of force [1/kg]: three times as far along one of them.
GIVES = np.diag([1.0, 3.0])
LAST_KNOWN = np.array([0.8, 0.6])
#: Deceleration by friction along the direction last known.
FRICTION = MU * PRESSED * GIVES @ LAST_KNOWN


def slow_slip(speed, force):
    """A contact of body 1 with body 0, which nothing moves: slips at ``speed`` (2,), and all but friction is ``force``.

    Its normal gives way to neither tangent: the pressure stays what it is.
    """
    lasting = allocate_lasting(3, 3, 3)
    lasting.size[CONTACTS], lasting.length[0] = 1, STEP
    enter(lasting, 0, (0, 1))
    lasting.mode[0], lasting.friction[0], lasting.speeds[0] = SLIP, MU, 1.0
    lasting.direction[0] = LAST_KNOWN
    lasting.force[0] = PRESSED * np.array([1.0, *(-MU * LAST_KNOWN)])
    lasting.speed[0] = 0.0, *speed
    lasting.gamma[0] = 0.0, *(np.asarray(force) - FRICTION)
    return lasting


def enter(lasting, k, pair):
    """Contact k of two bodies, of which the second is moved."""
    lasting.body[k] = pair
    rows = np.zeros((3, 6))
    rows[0, 2] = rows[1, 0] = rows[2, 1] = 1.0
    rows[2, 3] = np.sqrt(2.0)  # its lever turns the body as well: 1 + 2
    lasting.jacobian[k, 0], lasting.jacobian[k, 1], lasting.response[k, 1] = -rows, rows, rows


#: A slip, and what accelerates it: across the direction last known, and stronger than friction.
SPEED, FORCE = 1e-4 * LAST_KNOWN, np.array([2.5, 0.5])


def moment(gives=GIVES):
    """What is left of the time that a step can bear when the slip would have been stopped at most [s]."""
    most = np.linalg.eigvalsh(0.5 * (gives + gives.T)).max()
    return turning_slips.BEARABLE * STEP - np.linalg.norm(SPEED) / (MU * PRESSED * most)


def misses(direction, gives=GIVES, pressed=lambda d: PRESSED):
    """Sine between a direction and the slip that is left under it after that moment, and whether it is along."""
    force = FORCE - MU * PRESSED * (GIVES - gives) @ LAST_KNOWN  # of all but the friction, and who holds on against it
    left = SPEED + moment(gives) * (force - MU * pressed(direction) * gives @ direction)
    assert np.linalg.norm(left) > 1e-6
    return abs(left[0] * direction[1] - left[1] * direction[0]) / np.linalg.norm(left), left @ direction > 0.0


@pytest.mark.parametrize("beside", ["nothing", "open", "on what is not moved", "elsewhere"])
def test_a_slip_whose_body_no_other_contact_holds_goes_as_its_own_matrix_lets_it(beside):
    lasting = slow_slip(SPEED, FORCE)
    if beside != "nothing":
        lasting.size[CONTACTS] = 2
        enter(lasting, 1, {"open": (0, 1), "on what is not moved": (0, 2), "elsewhere": (0, 2)}[beside])
        lasting.mode[1] = OPEN if beside == "open" else STICK
        if beside == "elsewhere":
            lasting.body[1] = 2, 2
    assert steady_slip(lasting, 0)
    off, along = misses(lasting.direction[0])
    assert off < 1e-9 and along
    assert misses((SPEED + moment() * FORCE) / np.linalg.norm(SPEED + moment() * FORCE))[0] > 0.1


@pytest.mark.parametrize("rubs", [0.0, 0.4])
def test_a_slip_whose_body_others_hold_yields_as_they_let_it(rubs):
    """Another contact holds the body in a row across, and rubs by that load beside it, if it does.

    By hand: a unit along a row moves the held one by h G; it pushes back by h G/(h h), and where it slips by its
    friction as well: each column of the compliance loses the share of it that this takes away.
    """
    lasting = slow_slip(SPEED, FORCE)
    lasting.size[CONTACTS] = 2
    held = np.array([0.0, 1.0, 2.0, 0.0, 0.0, 0.0])  # between both tangents of the slip
    rubbed = np.array([1.0, 0.5, 0.0, 0.0, 0.0, 0.0])  # and presses the held row a little
    lasting.body[1], lasting.mode[1], lasting.friction[1] = (1, 2), SLIP, rubs
    lasting.direction[1] = 1.0, 0.0
    lasting.jacobian[1, 0, 0], lasting.response[1, 0, 0], lasting.response[1, 0, 1] = held, held, rubbed
    rows = lasting.jacobian[0, 1]
    push = held - rubs * rubbed
    gives = rows @ rows.T - np.outer(rows @ push, rows @ held) / (held @ push)
    assert steady_slip(lasting, 0)
    assert lasting.gives == pytest.approx(gives, rel=1e-12, abs=1e-12)

    # The pressure that keeps the contact held hangs on where friction goes.
    def pressed(d):
        friction = np.array([1.0, *(-MU * d)])
        return PRESSED * (gives[0] @ [1.0, *(-MU * LAST_KNOWN)]) / (gives[0] @ friction)

    def left(d, p):
        gained = np.asarray(FORCE) - FRICTION
        before = gives[1:] @ (PRESSED * np.array([1.0, *(-MU * LAST_KNOWN)]))
        after = gives[1:] @ (p * np.array([1.0, *(-MU * d)]))
        return SPEED + moment(gives[1:, 1:]) * (gained - before + after)

    d = lasting.direction[0]
    slip = left(d, pressed(d))
    assert slip @ d > 1e-6 and abs(slip[0] * d[1] - slip[1] * d[0]) < 1e-9 * np.linalg.norm(slip)
    # With others let go of, or with a pressure that is what it was, it would go elsewhere.
    alone = slow_slip(SPEED, FORCE)
    assert steady_slip(alone, 0)
    assert np.linalg.norm(alone.direction[0] - d) > 1e-3
    fixed = left(d, PRESSED)
    assert abs(fixed[0] * d[1] - fixed[1] * d[0]) > 1e-4 * np.linalg.norm(fixed)


def test_how_a_slip_yields_among_others_is_told_once_a_step():
    """What holds it turns within the step: its direction is told by the first that was asked, until a step begins."""
    lasting = slow_slip(SPEED, FORCE)
    lasting.size[CONTACTS] = 2
    lasting.body[1], lasting.mode[1] = (1, 2), SLIP
    first = lasting.jacobian[1, 0, 0] = lasting.response[1, 0, 0] = np.array([0.0, 1.0, 2.0, 0.0, 0.0, 0.0])
    assert first.any() and steady_slip(lasting, 0)
    told, gives = lasting.direction[0].copy(), lasting.gives.copy()
    lasting.jacobian[1, 0, 0] = lasting.response[1, 0, 0] = np.array([0.0, 2.0, -1.0, 0.0, 0.0, 0.0])
    lasting.direction[0] = LAST_KNOWN
    assert steady_slip(lasting, 0)
    assert lasting.direction[0].tolist() == told.tolist() and lasting.gives.tolist() == gives.tolist()
    forget_yields(lasting)
    lasting.direction[0] = LAST_KNOWN
    assert steady_slip(lasting, 0)
    assert np.abs(lasting.gives - gives).max() > 0.1 and np.abs(lasting.direction[0] - told).max() > 1e-3


def test_where_others_hold_the_normal_too_the_pressure_is_what_it_is():
    """A face on several points: its pressure is told elsewhere, and a slip of one point changes none."""
    lasting = slow_slip(SPEED, FORCE)
    lasting.size[CONTACTS] = 2
    enter(lasting, 1, (2, 1))
    lasting.jacobian[1, :, 1:] = lasting.response[1, :, 1:] = 0.0
    lasting.mode[1], lasting.body[1] = SLIP, (2, 1)
    assert steady_slip(lasting, 0)
    assert lasting.gives[0].tolist() == [0.0, 0.0, 0.0]
    off, along = misses(lasting.direction[0])
    assert off < 1e-9 and along


def test_what_yields_more_across_is_as_stiff_as_it_yields_there():
    """A slip along what yields least, at a speed between the bearable ones of both: its direction is steadied.

    By what slows it alone a step could bear it, but a slip that leaves its direction comes back at the other rate.
    """
    assert most_yield(np.array([[9.0, 0, 0], [0, 1.0, 0.3], [0, -0.1, 2.0]])) == pytest.approx(
        np.linalg.eigvalsh([[1.0, 0.1], [0.1, 2.0]]).max(), rel=1e-14
    )
    bearable = turning_slips.BEARABLE * STEP * MU * PRESSED
    for share, steady in ((1.5, True), (2.9, True), (3.1, False)):
        lasting = slow_slip(share * bearable * np.array([1.0, 0.0]), np.array([2.5, 0.5]))
        lasting.direction[0] = 1.0, 0.0
        lasting.force[0] = PRESSED, -MU * PRESSED, 0.0
        lasting.gamma[0] = 0.0, 2.5 - MU * PRESSED, 0.5
        assert steady_slip(lasting, 0) is steady


@pytest.mark.parametrize(("across", "steady"), [(1e-3, True), (1e-5, True), (1e-7, False)])
def test_what_is_pushed_along_its_direction_keeps_it(across, steady):
    """But for a millionth: acceleration, friction taken off, is along the direction but for ``across`` of it."""
    along, aside = LAST_KNOWN, np.array([-0.6, 0.8])
    lasting = slow_slip(1e-6 * LAST_KNOWN, FRICTION + 3.0 * (along + across * aside))
    assert steady_slip(lasting, 0) is steady
    if not steady:
        assert lasting.direction[0].tolist() == LAST_KNOWN.tolist()


@pytest.mark.parametrize(("push", "steady"), [(0.45, False), (0.55, True)])
def test_what_pushes_half_as_much_as_friction_brakes_steadies_a_slip(push, steady):
    """Less ends it, along the direction last known."""
    along = np.array([1.0, 0.9]) / np.hypot(1.0, 0.9)
    lasting = slow_slip(SPEED, push * np.linalg.norm(FRICTION) * along)
    assert steady_slip(lasting, 0) is steady
    assert (lasting.direction[0].tolist() == LAST_KNOWN.tolist()) is not steady


@pytest.mark.parametrize(("turn", "ended"), [(50.0, False), (100.0, True)])
def test_a_slip_that_would_turn_far_at_once_has_ended(turn, ended):
    """By more than sixty degrees: its direction stays the last known."""
    c, s = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    force = 30.0 * np.array([[c, -s], [s, c]]) @ LAST_KNOWN
    lasting = slow_slip(1e-12 * LAST_KNOWN, force)
    assert steady_slip(lasting, 0) is not ended
    assert (lasting.direction[0].tolist() == LAST_KNOWN.tolist()) is ended


@pytest.mark.parametrize(
    ("turn", "speed", "follows"), [(50.0, 1e-3, True), (70.0, 1e-3, False), (180.0, 1e-3, False), (50.0, 1e-12, False)]
)
def test_friction_follows_a_slip_that_neither_turns_round_nor_ends(turn, speed, follows):
    c, s = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    now = np.array([[c, -s], [s, c]]) @ LAST_KNOWN
    lasting = slow_slip(speed * now, FORCE)
    follow_slip(lasting, 0)
    assert lasting.direction[0] == pytest.approx(now if follows else LAST_KNOWN, abs=1e-14)


@pytest.mark.parametrize(
    ("first", "last", "speed", "goes_on"),
    [
        (1.0, 0.0, (-0.6e-3, 0.8e-3), True),
        (1.0, 0.0, (0.8e-3, 0.6e-3), False),  # along its last direction
        (1.0, 0.0, (-0.6e-12, 0.8e-12), False),  # round-off
        (1.0, 0.5, (-0.6e-3, 0.8e-3), False),  # it is not at its end
        (0.0, 0.0, (-0.6e-3, 0.8e-3), False),  # it has not begun
    ],
)
def test_a_slip_that_goes_on_across_its_last_direction_has_not_ended(first, last, speed, goes_on):
    lasting = slow_slip(speed, FORCE)
    lasting.monitor[START, 0, ONWARD], lasting.monitor[LAST, 0, ONWARD] = first, last
    assert stops_across(lasting) is goes_on
