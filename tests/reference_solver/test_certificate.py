"""The certificate: what it measures is right on known answers, and each planted fault is found."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from reference_solver import Body, Box, Disc, Model, Settings, Simulation, Sphere
from reference_solver import tally as entries
from reference_solver.coulomb import cone_defect, into_cone
from reference_solver.exact_contact import coulomb_solutions
from reference_solver.tally_summary import GATES, reasons
from reference_solver.textbook2.certificate import certify as certify_planar
from reference_solver.textbook2.certificate import open_solve as open_planar
from reference_solver.textbook2.columns import GAP, PN, PT
from reference_solver.textbook3.certificate import certify as certify_spatial
from reference_solver.textbook3.certificate import open_solve as open_spatial
from tests.verification.space import SPACES

DT, G = 1.0 / 240.0, 9.81
FRAME = (1.0, 0.0, 0.0, 0.0)


def floor(dimension, **fields):
    return SPACES[dimension - 2].floor(**fields)


def box(dimension, x, height, speed=0.0, angle=0.0, mass=1.0):
    """A unit cube, or square, that moves along x, turned about the horizontal axis across x."""
    space = SPACES[dimension - 2]
    return space.box(x, height, space.twist(speed), mass=mass, angle=angle)


def gravity(dimension):
    return (*(0.0,) * (dimension - 1), -G)


def simulate(dimension, bodies, profile, steps, restitution=0.0, friction=0.5):
    model = Model(dimension, bodies, gravity(dimension), restitution, friction)
    simulation = Simulation(model, getattr(Settings, profile)(DT))
    simulation.advance(steps)
    return simulation


def pile(dimension, profile, steps=130, restitution=0.0):
    """Four boxes, turned, that have fallen onto each other and go on tumbling."""
    boxes = [box(dimension, 0.2 * (i % 2), 0.9 + 1.5 * i, 0.3 * i, 0.2 * i) for i in range(4)]
    return simulate(dimension, [floor(dimension), *boxes], profile, steps, restitution)


def kinetic_energy(simulation):
    """From public state alone; inertia here is a multiple of the unit matrix."""
    total = 0.0
    for body, twist in zip(simulation.model.bodies, simulation.twist, strict=True):
        if body.motion == "free":
            d = simulation.model.dimension
            total += 0.5 * body.mass * twist[:d] @ twist[:d]
            total += 0.5 * np.ravel(body.inertia)[0] * twist[d:] @ twist[d:]
    return total


@given(st.floats(-3.0, 3.0), st.floats(0.0, 3.0), st.floats(0.0, 2.0))
@settings(derandomize=True)
def test_the_cone_projection_is_moreaus(normal, size, mu):
    """z = P(z) + rest with P(z) in the cone, the rest in its polar cone, and both orthogonal (Moreau 1962)."""
    n, t = into_cone(normal, size, mu)
    rest_n, rest_t = normal - n, size - t
    assert 0.0 <= t <= mu * n + 1e-15
    assert mu * rest_t <= -rest_n + 4e-15  # three roundings of numbers up to 9
    assert abs(n * rest_n + t * rest_t) <= 2e-14


@given(st.integers(0, 2**32 - 1))
@settings(derandomize=True)
def test_cone_complementarity_of_coulombs_law(seed):
    """What enumeration finds has no defect, whichever of open, stick and slip it is; a wrong answer has one."""
    random = np.random.default_rng(seed)
    root = random.normal(size=(2, 2))
    matrix, free = root @ root.T + 0.1 * np.eye(2), random.normal(size=2)
    mu = random.uniform(0.0, 0.25)  # small enough that the solution is unique: mu |k_nt| < k_n
    for found in coulomb_solutions(matrix, free, [mu]):
        (pn, pt), (un, ut) = found.impulse[0], found.velocity[0]
        step = 1.0 / matrix.max()
        size = max(abs(pn), step * np.abs(free).max())
        assert cone_defect((pt, 0.0, pn), (ut, 0.0, un), 0.0, mu, step) <= 1e-12 * size
        off = matrix @ (pn + 0.01 * size, pt) + free
        assert cone_defect((pt, 0.0, pn + 0.01 * size), (off[1], 0.0, off[0]), 0.0, mu, step) > 1e-5 * size


@pytest.mark.parametrize(("dimension", "restitution"), [(2, 0.0), (2, 0.5), (3, 0.0), (3, 0.5)])
def test_certificate_of_steps_solved_to_round_off(dimension, restitution):
    certificate = pile(dimension, "fixed_step", restitution=restitution).certificate
    assert certificate["holds"] and certificate["reasons"] == ()
    assert certificate["solves"] > 0


@pytest.mark.parametrize("dimension", [2, 3])
def test_reasons_of_an_unsolved_pile(dimension):
    certificate = pile(dimension, "classical").certificate
    assert not certificate["holds"]
    assert any("natural" in reason for reason in certificate["reasons"])
    assert certificate["momentum"] <= 1e-13 and certificate["energy"] <= 1e-12  # its impulses are applied rightly


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("profile", ["fixed_step", "classical"])
def test_works_of_a_run_and_its_kinetic_energy(dimension, profile):
    """State to state: what loads, contacts and surfaces did is what the bodies have, flights and impacts included."""
    start = sum(0.5 * (0.3 * i) ** 2 for i in range(4))
    simulation = pile(dimension, profile)
    works = [simulation.certificate[name] for name in ("load_work", "contact_work", "surface_work")]
    # 130 steps of round-off, each a few units in the last place of some 100 J.
    assert kinetic_energy(simulation) - start == pytest.approx(sum(works), abs=130 * 4e-14)


@pytest.mark.parametrize("dimension", [2, 3])
def test_work_of_a_belt_on_a_load(dimension):
    """A box set on a belt of speed V ends with m V^2 / 2; friction turned as much into heat; the belt gave m V^2.

    Loads work against the floor in each step.
    """
    speed, mass, steps = 1.5, 2.0, 300
    belt = floor(dimension, motion="prescribed", twist=(speed, *(0.0,) * (5 if dimension == 3 else 2)))
    certificate = simulate(dimension, [belt, box(dimension, 0.0, 0.5, mass=mass)], "fixed_step", steps).certificate
    lost = 0.5 * mass * (G * DT) ** 2 * steps
    assert certificate["holds"]
    assert certificate["surface_work"] == pytest.approx(mass * speed**2, rel=1e-12)
    assert certificate["load_work"] == pytest.approx(lost, rel=1e-9)
    assert certificate["contact_work"] == pytest.approx(-0.5 * mass * speed**2 - lost, rel=1e-11)


class Planted:
    """A resting box after one step, its answer open to faults."""

    def __init__(self, dimension):
        self.dimension = dimension
        simulation = simulate(dimension, [floor(dimension), box(dimension, 0.0, 0.5)], "fixed_step", 1)
        self.world, self.tally = simulation._world, entries.new_tally()
        self.bodies, options = self.world._bodies, self.world._options
        self.bodies.twist[:] = 0.0
        self.bodies.twist[1, dimension - 1] = -G * DT
        if dimension == 2:
            open_planar(self.bodies, 0.0, self.tally)
            self.run = lambda: certify_planar(self.bodies, self.world._rows, options, self.tally)
            self.normal, self.tangent = self.world._rows.real[:2, PN], self.world._rows.real[:2, PT]
            self.gap = self.world._rows.real[:2, GAP]
        else:
            manifolds = self.world._manifolds[:1]
            open_spatial(self.bodies, 0.0, self.tally)
            self.run = lambda: certify_spatial(self.bodies, manifolds, options, self.tally)
            self.normal, self.tangent = manifolds.impulse[0, :, 2], manifolds.impulse[0, :, 0]
            self.gap = manifolds.gap[0]
        self.tally[entries.OPENED] = 2.0  # not the solve at the start of a run
        self.bodies.twist[:] = 0.0

    def exceeded(self):
        self.run()
        return {gate.name for gate in GATES if self.tally[gate.entry] > gate.limit}


@pytest.mark.parametrize("dimension", [2, 3])
class TestPlantedFaults:
    def test_no_fault_no_reason(self, dimension):
        planted = Planted(dimension)
        assert planted.exceeded() == set() and reasons(planted.tally) == ()

    def test_velocity_without_impulses(self, dimension):
        planted = Planted(dimension)
        planted.bodies.twist[1, 0] += 1e-8 * G * DT
        assert "momentum" in planted.exceeded()

    def test_spin_without_impulses(self, dimension):
        planted = Planted(dimension)
        planted.bodies.twist[1, -1] += 1e-8
        assert "momentum" in planted.exceeded()

    def test_an_impulse_too_small(self, dimension):
        """Applied to the body as well: momentum balances, and the box sinks."""
        planted = Planted(dimension)
        planted.normal *= 1.0 - 1e-8
        planted.bodies.twist[1, dimension - 1] = -1e-8 * G * DT
        assert planted.exceeded() == {"natural", "cone"}

    def test_a_contact_that_pulls(self, dimension):
        planted = Planted(dimension)
        planted.normal[0] = -1e-12
        assert "pull" in planted.exceeded()

    def test_friction_outside_the_cone(self, dimension):
        planted = Planted(dimension)
        planted.tangent[0] = 0.5 * planted.normal[0] * (1.0 + 1e-9)
        assert {"excess", "momentum"} <= planted.exceeded()

    def test_a_body_thrown_up(self, dimension):
        """Twice the impulse throws it up as fast as it came: momentum balances, the law does not."""
        planted = Planted(dimension)
        planted.normal *= 3.0
        planted.bodies.twist[1, dimension - 1] = 2.0 * G * DT
        assert planted.exceeded() == {"natural", "cone", "pumped"}
        # (u+ + u*) / 2 times 3 m g h = 3/2 m (g h)^2 of work; what the points usually do is (g h)^2 times their masses,
        # 1 / (1 + 6/4) kg each in the plane and 1 / (1 + 2 6/4) in space
        usual = 2.0 / 2.5 if dimension == 2 else 4.0 / 4.0
        assert planted.tally[entries.PUMPED] == pytest.approx(1.5 / (1.5 + usual), rel=1e-12)

    def test_later_overlap_after_a_solve_of_other_bodies(self, dimension):
        """The first solve of each island tells what overlaps at the start: of that island alone."""
        planted = Planted(dimension)
        planted.tally[entries.PENETRATION], planted.tally[entries.OPENED] = 1e-3, 1.0
        planted.run()
        assert planted.tally[entries.START_OVERLAP] < 1e-12 and planted.tally[entries.PENETRATION] == 1e-3

    def test_an_overlap_past_the_middle(self, dimension):
        planted = Planted(dimension)
        planted.gap[0] = -0.51
        assert planted.exceeded() == {"penetration"}

    def test_what_is_no_number(self, dimension):
        """It is told, and nothing else is measured by it."""
        planted = Planted(dimension)
        planted.bodies.twist[1, 0] = math.nan
        assert planted.exceeded() == set()
        assert "no numbers" in reasons(planted.tally)[0]
        assert np.isfinite(planted.tally).all()


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("profile", ["classical", "fixed_step"])
@pytest.mark.parametrize("speed", [0.0, 1.0])
def test_start_inside_the_floor(dimension, profile, speed):
    """0.2 m deep: certified until it was looked at, as bodies are pushed out by position alone."""
    simulation = simulate(dimension, [floor(dimension), box(dimension, 0.0, 0.3, speed)], profile, 5)
    certificate = simulation.certificate
    assert certificate["start_overlap"] == pytest.approx(0.4, rel=1e-12)  # of the half width
    assert not certificate["holds"] and any("overlap at the start" in reason for reason in certificate["reasons"])


@pytest.mark.parametrize("dimension", [2, 3])
def test_overlap_at_the_start_and_bodies_that_land_later(dimension):
    """One rests, one lands in a fixed step, which finds it inside; samples certify anew, not the start."""
    bodies = [floor(dimension), box(dimension, 0.0, 0.5), box(dimension, 3.0, 0.6)]
    model = Model(dimension, bodies, gravity(dimension), 0.5, 0.5)
    simulation = Simulation(model, Settings.fixed_step(DT))
    record = simulation.record(60, stride=1, certificates=True)
    assert simulation.certificate["penetration"] > 1e-6
    assert simulation.certificate["start_overlap"] <= 1e-15 and (record.certificates["start_overlap"] <= 1e-15).all()


@pytest.mark.parametrize("dimension", [2, 3])
def test_body_at_unresolved_coordinates(dimension):
    """At 1e15 m the last place is an eighth of a metre; at 1e6 m it is 1e-10 m."""
    for x, holds in ((1e15, False), (1e6, True)):
        simulation = simulate(dimension, [floor(dimension), box(dimension, x, 0.5)], "fixed_step", 2)
        assert simulation.certificate["resolution"] == pytest.approx(2.0**-52 * x / 0.5, rel=1e-9)
        assert simulation.certificate["holds"] == holds
        assert holds or any("coordinates" in reason for reason in simulation.certificate["reasons"])


@pytest.mark.parametrize("profile", ["fixed_step", "reference"])
def test_kanes_paradox_in_a_certificate(profile):
    """A rod that strikes at its tip may gain energy under Newton's e with friction: the law does it, not the solver.

    W of the tip of a rod of half-length 1 and mass 1 is O21; the gain by enumeration of the same law.
    """
    angle, mu, e, slide = math.radians(56.4), 0.883, 0.9988, 0.727
    s, c = math.sin(angle), math.cos(angle)
    # the lower end stands to the right of the centre
    matrix = np.array([[1 + 3 * c * c, -3 * s * c], [-3 * s * c, 1 + 3 * s * s]])
    gains = {}
    for sign in (1.0, -1.0):
        before = np.array([-1.0, sign * slide])
        (found,) = coulomb_solutions(matrix, before - (e, 0.0), [mu])
        after = found.velocity[0] + (e, 0.0)
        gains[sign] = 0.5 * found.impulse[0] @ (before + after)
    sign = max(gains, key=gains.get)
    # A box thin as a rod; its inertia about the tip's arm is that of the rod
    thin = 1e-7  # the last place of its coordinates is then 2e-9 of it: resolved
    tip = np.array([c, -s])
    angle_of_box = -angle
    start = (0.0, s + thin * c, angle_of_box)  # the lower corner on the floor
    body = Body(Box((1.0, thin)), 1.0, 1.0 / 3.0, start, (-sign * slide, -1.0, 0.0))
    assert tip[0] > 0.0
    model = Model(2, [floor(2), body], (0.0, 0.0), e, mu)
    simulation = Simulation(model, getattr(Settings, profile)(DT))
    before = kinetic_energy(simulation)
    simulation.advance(1)
    assert gains[sign] > 0.0
    assert kinetic_energy(simulation) - before == pytest.approx(gains[sign], rel=1e-6)  # 1e-7 thick, scaled by levers
    if profile == "fixed_step":  # the loop of events keeps no sums
        certificate = simulation.certificate
        assert certificate["contact_work"] == pytest.approx(gains[sign], rel=1e-6)
        assert certificate["kane"] == 1 and certificate["created"] > 0.0
        assert certificate["holds"]


@pytest.mark.parametrize("dimension", [2, 3])
def test_shares_in_another_unit_of_mass(dimension):
    """All masses times a power of two: every share has the same bits, every energy is scaled by it."""
    certificates = []
    for mass in (1.0, 2.0**20):
        bodies = [floor(dimension), *(box(dimension, 0.1 * i, 0.5 + i, mass=mass) for i in range(3))]
        certificates.append(simulate(dimension, bodies, "fixed_step", 30).certificate)
    light, heavy = certificates
    for name in ("contact_work", "load_work", "surface_work"):
        assert heavy.pop(name) == 2.0**20 * light.pop(name)
    assert heavy == light


@pytest.mark.parametrize("shape", [Disc(0.5), Sphere(0.5)])
def test_fault_of_a_microgram_beside_a_megagram(shape):
    """A scale common to all contacts would not see what the lightest body's contact leaves unsolved."""
    dimension = 2 if isinstance(shape, Disc) else 3

    def ball(x, height, mass):
        if dimension == 2:
            return Body(shape, mass, 0.125 * mass, (x, height, 0.0))
        return Body(shape, mass, (0.1 * mass,) * 3, (x, 0.0, height, *FRAME))

    bodies = [floor(dimension), ball(0.0, 0.5, 1e6), *(ball(3.0, 0.5 + i, 1e-9) for i in range(5))]
    certificate = simulate(dimension, bodies, "classical", 1, friction=0.0).certificate
    # five bodies, ten cold sweeps: cos^20(pi / 10) = 0.37 of the error is left at the slowest mode
    assert certificate["natural"] > 1e-3


@pytest.mark.parametrize("dimension", [2, 3])
def test_certificates_of_the_steps_of_samples(dimension):
    bodies = [floor(dimension), *(box(dimension, 0.05 * i, 0.6 + 1.2 * i) for i in range(3))]
    model = Model(dimension, bodies, gravity(dimension), 0.0, 0.5)
    whole, parts = (Simulation(model, Settings.fixed_step(DT)) for _ in range(2))
    plain, record = whole.record(100, 10, contacts=True), parts.record(100, 10, contacts=True, certificates=True)
    assert plain.certificates == {}
    for name in ("t", "pose", "twist", "offset"):
        assert (getattr(plain, name) == getattr(record, name)).all()
    assert (plain.contacts.impulse == record.contacts.impulse).all()
    assert all(values.shape == (11,) for values in record.certificates.values())
    assert record.certificates["holds"].all() and record.certificates["solves"][0] == 0
    total = parts.certificate
    assert total["sweeps"] == record.certificates["sweeps"].sum() == whole.certificate["sweeps"]
    assert total["natural"] == record.certificates["natural"].max() == whole.certificate["natural"]
    assert total["contact_work"] == pytest.approx(whole.certificate["contact_work"], rel=1e-13)
