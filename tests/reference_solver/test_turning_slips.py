"""Directions of slips that friction turns faster than a step can follow (E38), against their own equation."""

import numpy as np
import pytest

from reference_solver.compilation import from_python
from reference_solver.stepping import turning_slips
from reference_solver.stepping.lasting import CONTACTS, SLIP, allocate_lasting

implicit_slip, speed_after = from_python(turning_slips.implicit_slip), from_python(turning_slips.speed_after)

#: Length of the moment [s], and least change of direction between two rounds that ends the search.
MOMENT, SETTLED = 1e-3, turning_slips.SETTLED
#: Contacts whose slips go on after the moment, and such that friction stops within it.
SEEDS = range(80)


def drawn(seed):
    """A contact of a heavy and a lighter free body that slips along a direction, with levers of their own size."""
    rng = np.random.default_rng(seed)
    lasting = allocate_lasting(3, 2, 4)
    lasting.size[CONTACTS] = 1
    lasting.body[0] = 0, 1
    lasting.mode[0], lasting.friction[0] = SLIP, rng.uniform(0.1, 0.6)
    axes = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    for side, (sign, mass) in enumerate(((-1.0, 5.0), (1.0, 1.0))):
        arm, moments = rng.uniform(-0.5, 0.5, 3), mass * rng.uniform(0.05, 0.3, 3)
        rows = sign * np.hstack([axes, np.cross(arm, axes)])
        lasting.jacobian[0, side] = rows
        lasting.response[0, side] = rows / np.array([mass] * 3 + list(moments))
    angle = rng.uniform(0.0, 2.0 * np.pi)
    lasting.direction[0] = np.cos(angle), np.sin(angle)
    pressed = rng.uniform(1.0, 10.0)
    lasting.force[0] = pressed * np.array([1.0, *(-lasting.friction[0] * lasting.direction[0])])
    size = rng.uniform(0.1, 3.0) * MOMENT * lasting.friction[0] * pressed
    lasting.speed[0] = 0.0, *(size * lasting.direction[0])
    lasting.acceleration[:] = rng.normal(size=(2, 6))
    # How it yields, alone or, for odd seeds, among others whose friction makes rows and columns differ.
    matrix = np.einsum("srv,scv->rc", lasting.jacobian[0], lasting.response[0])
    lasting.gives[:] = matrix + (0.03 * rng.normal(size=(3, 3)) if seed % 2 else 0.0)
    lasting.gamma[0, 0] = -np.einsum("sv,sv", lasting.jacobian[0, :, 0], lasting.acceleration)
    return lasting


def equation(lasting, direction):
    """``u + moment a`` but for friction, and what that takes in the moment, at the pressure of a direction."""
    mu, (pressed, *_) = lasting.friction[0], lasting.force[0]
    matrix = lasting.gives
    lines = np.array([[1.0, *(-mu * d)] for d in (lasting.direction[0], direction)])
    before, after = lines @ matrix.T  # accelerations by a unit of pressure, with its friction
    gain = np.einsum("srv,sv->r", lasting.jacobian[0], lasting.acceleration) + lasting.gamma[0]
    pressure = pressed * before[0] / after[0]
    assert gain[0] - pressed * before[0] + pressure * after[0] == pytest.approx(0.0, abs=1e-12)  # held
    free = gain[1:] - pressed * before[1:] + pressure * matrix[1:, 0]
    return lasting.speed[0, 1:] + MOMENT * free, MOMENT * mu * pressure * matrix[1:, 1:]


def test_a_slip_goes_where_its_friction_lets_it_a_moment_later():
    stopped = 0
    for seed in SEEDS:
        lasting = drawn(seed)
        direction = np.array(implicit_slip(lasting, 0, MOMENT))
        assert np.linalg.norm(direction) == pytest.approx(1.0, abs=1e-15), seed
        pushed, friction = equation(lasting, direction)
        left, scale = pushed - friction @ direction, np.linalg.norm(friction)
        if np.linalg.norm(np.linalg.solve(friction, pushed)) <= 1.0:  # along what it takes to stop it
            stopped += 1
            needed = np.linalg.solve(friction, pushed)
            assert needed @ direction == pytest.approx(np.linalg.norm(needed), rel=1e-9), seed
        else:
            assert left @ direction > 0.0, seed
            assert abs(left[0] * direction[1] - left[1] * direction[0]) < 1e-9 * scale, seed
    assert 5 < stopped < len(SEEDS) - 5


def test_a_contact_that_friction_would_press_open_has_no_direction():
    """It gives way along its normal by friction as much as it does by pressure: no pressure holds it."""
    lasting = drawn(0)
    lasting.friction[0] = 1e3
    lasting.direction[0] = 1.0, 0.0
    assert implicit_slip(lasting, 0, MOMENT) == (0.0, 0.0)


@pytest.mark.parametrize("seed", range(20))
def test_the_speed_of_a_slip_makes_its_direction_a_unit_vector(seed):
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(2, 2))
    matrix, pushed = root @ root.T + 1e-3 * np.eye(2), rng.normal(size=2) * 10.0 ** rng.uniform(-2, 2)
    matrix += 0.1 * rng.normal() * np.array([[0.0, 1.0], [-1.0, 0.0]])  # by friction of others
    scale, gives = 10.0 ** rng.uniform(-3, 3), np.full((3, 3), np.nan)
    gives[1:, 1:] = matrix / scale
    speed = speed_after(*pushed, scale, gives)
    size = np.linalg.norm(np.linalg.solve(matrix + speed * np.eye(2), pushed))
    assert size == pytest.approx(1.0, abs=10.0 * SETTLED) if speed > 0.0 else size <= 1.0 + 10.0 * SETTLED
