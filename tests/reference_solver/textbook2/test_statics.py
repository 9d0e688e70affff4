"""Things at rest: columns, wedges, loads, overlap."""

import math

import numpy as np
import pytest

from reference_solver import Settings

G = 9.81


def interface_impulses(record, n):
    """Sum of the vertical impulses over each interface, (steps, n)."""
    totals = np.zeros((len(record.t) - 1, n))
    for s in range(1, len(record.t)):
        rows = slice(record.offset[s], record.offset[s + 1])
        np.add.at(totals[s - 1], record.contacts.body_b[rows] - 1, record.contacts.impulse[rows, 1])
    return totals


def test_sweeps_of_a_column_of_twenty_that_stands(build, fixed_step):
    simulation = build.column(20, fixed_step)
    simulation.advance(1)
    first = simulation.certificate["sweeps"]
    simulation.advance(1199)
    certificate = simulation.certificate
    assert certificate["converged"] and certificate["residual"] <= 1e-13
    assert first < 5000
    assert certificate["sweeps"] - first < 2400  # two per step


@pytest.mark.parametrize("n", [1, 2])
def test_short_columns_stand_at_ten_sweeps(build, classical, n):
    record = build.column(n, classical).record(1200, contacts=True)
    settled = record.twist[240:]
    assert np.abs(settled).max() <= 1e-10
    # Natural length of a step g h^2: the error of a few unfinished steps stays below one of them.
    assert np.abs(record.pose[-1] - record.pose[0])[:, :2].max() <= G * build.dt**2


@pytest.mark.parametrize("dt", [1 / 60, 1 / 960])
def test_column_stands_at_other_steps(build, dt):
    record = build.column(10, Settings.reference(dt)).record(200, contacts=True)
    assert interface_impulses(record, 10)[-1] / (G * dt * np.arange(10, 0, -1)) == pytest.approx(1.0, abs=1e-10)


def test_load_of_a_disc_in_a_wedge(build, reference):
    """Walls at alpha from the horizontal, no friction: N = m g / (2 cos alpha) each (scene S-D7)."""
    from reference_solver import Body, HalfSpace

    alpha = math.radians(35.0)
    walls = [Body(HalfSpace((s * math.sin(alpha), math.cos(alpha))), motion="fixed") for s in (1.0, -1.0)]
    simulation = build.simulation([*walls, build.disc(0.0, 0.5 / math.cos(alpha))], reference, (0.0, -G))
    simulation.advance(240)
    contacts = simulation.contacts()
    normal = (contacts.impulse * contacts.normal).sum(axis=1)
    assert normal == pytest.approx(G * build.dt / (2.0 * math.cos(alpha)), rel=1e-11)


def test_corner_loads_of_a_box_on_an_incline(build, reference):
    """N = m g (cos +- (h/b) sin) / 2 on the two corners while it stands (scene S-C11)."""
    theta, half = math.atan(0.3), (0.5, 0.4)
    gravity = (G * math.sin(theta), -G * math.cos(theta))
    simulation = build.simulation([build.floor(), build.box(0.0, half[1], half=half)], reference, gravity, 0.0, 0.5)
    simulation.advance(240)
    contacts = simulation.contacts()
    order = np.argsort(contacts.point[:, 0])
    share = half[1] / half[0] * math.sin(theta)
    expected = 0.5 * G * build.dt * np.array([math.cos(theta) - share, math.cos(theta) + share])
    assert contacts.impulse[order, 1] == pytest.approx(expected, rel=1e-10)


def test_box_with_its_centre_within_and_beyond_its_base(build, reference):
    """With friction to hold it, a box b x h tips iff tan(theta) > b / h (scene S-C11)."""
    half = (0.3, 0.6)
    for ratio, tips in ((0.98, False), (1.02, True)):
        theta = math.atan(ratio * half[0] / half[1])
        gravity = (G * math.sin(theta), -G * math.cos(theta))
        simulation = build.simulation([build.floor(), build.box(0.0, half[1], half=half)], reference, gravity, 0.0, 2.0)
        simulation.advance(240)
        assert bool(abs(simulation.pose[1, 2]) > 0.01) is tips
        assert tips or np.abs(simulation.twist).max() <= 1e-12


@pytest.mark.parametrize("depth", [0.1, 0.5, 0.9])
def test_kinetic_energy_of_a_deep_overlap_pushed_out(build, fixed_step, depth):
    """Two discs overlapping by a share of their radius: projected apart, symmetric, velocity untouched."""
    gap = 1.0 - 0.5 * depth
    simulation = build.simulation([build.disc(0.0, 0.0), build.disc(gap, 0.0)], fixed_step)
    simulation.advance(3)
    assert np.abs(simulation.twist).max() == 0.0
    assert simulation.pose[1, 0] - simulation.pose[0, 0] == pytest.approx(1.0, abs=1e-12)
    assert simulation.pose[:, 0].sum() == pytest.approx(gap, abs=1e-15)
    assert simulation.certificate["projected"] == pytest.approx(0.5 * depth, rel=1e-9)


def test_column_that_overlaps_at_the_start(build, fixed_step):
    """Ten boxes each 1 mm into the one below: all gaps close to zero, and the column then stands."""
    boxes = [build.box(0.0, 0.499 + 0.999 * i) for i in range(10)]
    simulation = build.simulation([build.floor(), *boxes], fixed_step, (0.0, -G), 0.0, 0.5)
    simulation.advance(60)
    assert simulation.contacts().gap.min() >= -1e-9
    assert np.abs(simulation.twist).max() <= 1e-10


def test_pyramid_rows_carry_the_weight_above(build, reference):
    """Single impulses are not unique, their sum per row is (scene S-D8)."""
    rows, bodies = 5, [build.floor()]
    for level in range(rows):
        bodies += [build.box(1.1 * (i - 0.5 * (rows - 1 - level)), 0.5 + level) for i in range(rows - level)]
    simulation = build.simulation(bodies, reference, (0.0, -G), 0.0, 0.5)
    simulation.advance(240)
    contacts = simulation.contacts()
    for level in range(rows):
        above = sum(rows - k for k in range(level, rows))
        at = np.abs(contacts.point[:, 1] - level) < 1e-6
        assert contacts.impulse[at, 1].sum() == pytest.approx(above * G * build.dt, rel=1e-10)
