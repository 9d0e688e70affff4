"""What the loop cannot tell it refuses, in one sentence that names it."""

import numpy as np
import pytest

from reference_solver import Body, Box, Capsule, Disc, HalfSpace, Model, Settings, Simulation, Sphere
from reference_solver.exact import cones, events, forces, impacts, loop, motion, refusals
from reference_solver.exact.bodies import start_of, world_of
from reference_solver.exact.checks import check, deepest
from reference_solver.exact.kernels.meeting import NEVER
from reference_solver.exact.motion import Piece, free_acceleration, steady
from reference_solver.exact.problem import Answer, Problem
from reference_solver.exact.rows import touching_contacts
from reference_solver.exact.stiff import step
from reference_solver.settings import TOLERANCE

G = 9.81
FLOOR = Body(HalfSpace((0.0, 1.0)), motion="fixed")
GROUND = Body(HalfSpace((0.0, 0.0, 1.0)), pose=(0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0), motion="fixed")


def ball(height, speed=0.0, mass=1.0, aside=0.0):
    return Body(Disc(0.5), mass, 0.125 * mass, (aside, height, 0.0), (0.0, speed, 0.0))


def advance(bodies, e=0.5, mu=0.0, steps=240, gravity=G):
    Simulation(Model(2, bodies, (0.0, -gravity), e, mu), Settings.reference(1 / 240)).advance(steps)


def test_ball_between_closing_walls_is_crushed():
    lid = Body(HalfSpace((0.0, -1.0)), pose=(0.0, 2.0, 0.0), twist=(0.0, -1.0, 0.0), motion="prescribed")
    with pytest.raises(refusals.Refused) as said:
        advance([FLOOR, lid, ball(0.5)], e=0.0, steps=480)
    assert isinstance(said.value, refusals.NoImpulses)
    assert "crushed" in str(said.value) and "1" in str(said.value)


def test_ball_in_a_wedge_that_closes_and_rubs():
    """No impulses of any size part them: those of Newton's rounds grow until round-off hides what they do."""
    normal = np.array((np.sin(0.5), 0.0, -np.cos(0.5)))
    place = np.array((0.0, 0.0, 0.5)) - 0.5 * normal
    lid = Body(
        HalfSpace(tuple(normal)),
        pose=(*place, 1.0, 0.0, 0.0, 0.0),
        twist=(0.0, 0.0, -1.0, 0.0, 0.0, 0.0),
        motion="prescribed",
    )
    ball = Body(Sphere(0.5), 1.0, (0.1,) * 3, (0.0, 0.0, 0.5, 1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.3, 0.2, 0.1))
    with pytest.raises(refusals.NoImpulses, match="crushed"):
        Simulation(Model(3, [GROUND, lid, ball], (0.0, 0.0, -G), 0.0, 0.9), Settings.reference(1 / 240)).advance(1)


def test_overlap_at_the_start():
    with pytest.raises(refusals.Overlap, match="bodies 0 and 1 overlap"):
        advance([FLOOR, Body(Box((0.5, 0.5)), 1.0, 0.2, (0.0, 0.4, 0.0))])


@pytest.mark.parametrize("sunk", [2e-8, 1e-3, -1e-3])
@pytest.mark.parametrize("order", [1, -1])
def test_overlap_of_a_ball_with_a_half_space_or_a_ball(sunk, order):
    """A ball sunk into a turned half-space or into another ball is found; one that is clear is not looked at."""
    angle, at = 0.7, np.array((3.0, -2.0))
    normal = np.array((-np.sin(angle), np.cos(angle)))
    plane = Body(HalfSpace((0.0, 1.0), 0.25), pose=(*at, angle), motion="fixed")
    for other, gap in ((plane, 0.25), (Body(Disc(0.25), pose=(*at, 0.0), motion="fixed"), 0.25)):
        disc = Body(Disc(0.5), 1.0, 0.1, (*(at + (gap + 0.5 - 0.5 * sunk) * normal), 0.0))
        world = world_of(model := Model(2, [other, disc][::order], (0.0, 0.0), 0.0, 0.0))
        state = start_of(model)
        held = forces.decide(world, state, touching_contacts(world, state).chosen(np.zeros(0, int)), state.velocity)
        found = deepest(world, steady(state, held, state.velocity, 1.0))
        assert found[3] == (pytest.approx(0.5 * sunk, rel=1e-6) if sunk > 0.0 else -np.inf)


def test_missed_meeting_of_edges_in_space(monkeypatch):
    """A bar falls across another, edge on edge: no corner of either comes near the other."""
    side, half = np.sin(np.pi / 8), np.cos(np.pi / 8)
    shape = Box((0.5, 0.1, 0.1))
    lower = Body(shape, pose=(0.0, 0.0, 0.0, half, side, 0.0, 0.0), motion="fixed")
    across = np.sqrt(0.5) * np.array((half, side, side, half))  # turned by 45 degrees about x, then by 90 about z
    upper = Body(shape, 1.0, (0.1, 0.2, 0.2), (0.0, 0.0, 0.5, *across))
    model = Model(3, [lower, upper], (0.0, 0.0, -G), 0.0, 0.5)
    Simulation(model, Settings.reference(1 / 240)).advance(120)
    monkeypatch.setattr(events, "next_meeting", lambda *_: (NEVER, False))
    with pytest.raises(refusals.Overlap, match="bodies 0 and 1 overlap"):
        Simulation(model, Settings.reference(1 / 240)).advance(120)


def test_endless_impacts_of_an_instant(monkeypatch):
    monkeypatch.setattr(impacts, "MOST", 1)
    with pytest.raises(refusals.TooManyImpacts, match="more than 1 impacts"):
        advance([FLOOR, ball(1.0)], e=1.0)


def test_too_many_pieces(monkeypatch):
    monkeypatch.setattr(loop, "MOST_PIECES", 3)
    with pytest.raises(refusals.TooManyPieces, match="more than 3 pieces of motion"):
        advance([FLOOR, ball(1.0)], e=1.0, steps=2400)


def test_events_without_progress(monkeypatch):
    """A meeting that is found again and again."""
    monkeypatch.setattr(events, "next_meeting", lambda *_: (0.0, False))
    with pytest.raises(refusals.NoProgress, match=r"1000 events follow each other at 0 s .* most often bodies meet"):
        advance([FLOOR, ball(1.0)], e=1.0)


def test_events_that_take_hardly_any_time(monkeypatch):
    monkeypatch.setattr(loop, "MOST_IN_A_ROW", 4)
    advance([FLOOR, ball(1.0)], e=1.0, steps=2400)
    monkeypatch.setattr(loop, "ROW", 10.0)
    with pytest.raises(refusals.NoProgress, match="4 events follow each other"):
        advance([FLOOR, ball(1.0)], e=1.0, steps=2400)


def test_steps_that_take_hardly_any_time(monkeypatch):
    """A rod that tips in space: ends of steps alone are a reason, too, which is not that nothing happens."""
    monkeypatch.setattr(loop, "MOST_IN_A_ROW", 4)
    monkeypatch.setattr(loop, "ROW", 10.0)
    pose = (0.0, 0.0, 0.5 * np.sin(1.0) + 0.1, np.cos(0.5), 0.0, -np.sin(0.5), 0.0)
    rod = Body(Capsule(0.5, 0.1), 1.0, (0.08,) * 3, pose)
    with pytest.raises(refusals.NoProgress, match="most often a piece ends that is as long as it may be"):
        Simulation(Model(3, [GROUND, rod], (0.0, 0.0, -G), 0.0, 3.0), Settings.reference(1 / 240)).advance(240)


def test_motion_without_numbers(monkeypatch):
    """A step from where accelerations are no numbers."""
    monkeypatch.setattr(motion, "free_acceleration", lambda _world, _axes, velocity: np.full(velocity.shape, np.nan))
    world, state = world_of(model := Model(2, [ball(1.0)], (0.0, -G), 0.0, 0.0)), start_of(model)
    held = forces.decide(world, state, touching_contacts(world, state), np.zeros((1, 3)))
    with pytest.raises(refusals.NoStep, match="no step from 0 s on reaches its tolerance"):
        step(world, state, held, TOLERANCE, 0.1)


def test_contacts_that_create_energy():
    """A piece in which a body without load becomes faster."""
    model = Model(2, [ball(1.0)], (0.0, 0.0), 0.0, 0.0)
    world, state = world_of(model), start_of(model)
    held = forces.decide(world, state, touching_contacts(world, state), np.zeros((1, 3)))
    way, velocity = np.zeros((1, 3, 3)), np.zeros((1, 3, 2))
    way[0, 0, 2], velocity[0, 0, 1] = 0.5, 1.0
    with pytest.raises(refusals.EnergyGrows, match="energy grows by"):
        check(world, Piece(state, 1.0, way, velocity, held, turns=False), TOLERANCE)


def posed(model):
    """Contact problem of forces of a model at its start."""
    world, state = world_of(model), start_of(model)
    contacts = touching_contacts(world, state)
    free = free_acceleration(world, state.axes, state.velocity)
    return Problem(contacts, forces.accelerations(contacts, free), np.zeros((len(contacts), 1)))


def test_solution_that_breaks_a_law(monkeypatch):
    """A planted fault: loads that are right, but for a tenth of each."""
    monkeypatch.setattr(Problem, "with_modes", lambda self, *_: None)
    monkeypatch.setattr(
        Problem, "_polished", lambda self, start, t: Answer(np.ones(1, np.int64), start[:, 1:], 0.9 * start)
    )
    with pytest.raises(refusals.Unlawful, match="break the laws of contact at 2 s by 1e-01"):
        posed(Model(2, [FLOOR, ball(0.5)], (0.0, -G), 0.0, 0.5)).solved(2.0)


def test_modes_without_forces(monkeypatch):
    monkeypatch.setattr(Problem, "with_modes", lambda self, *_: None)
    with pytest.raises(refusals.Undecided, match="not decided at 2 s"):
        posed(Model(2, [FLOOR, ball(0.5)], (0.0, -G), 0.0, 0.5)).solved(2.0)


def test_neither_forces_nor_impulses(monkeypatch):
    def none(*_):
        raise problem_without_solution

    problem_without_solution = loop.NoSolution()
    monkeypatch.setattr(loop, "decide", none)
    monkeypatch.setattr(loop, "jam", none)
    with pytest.raises(refusals.NoForces, match="no forces exist at 0 s"):
        advance([FLOOR, ball(0.5)], e=0.0)


@pytest.mark.parametrize("mu", [0.1, 0.5])
def test_friction_in_space_without_convergence(mu, monkeypatch):
    """A ball on the ground, of which friction takes 3.5 as much as of a point: sweeps find what sticks and slips."""
    monkeypatch.setattr(cones, "solve", lambda *_: 1.0)
    ball_on_floor = Body(Sphere(0.5), 1.0, (0.1,) * 3, (0.0, 0.0, 0.5, 1.0, 0.0, 0.0, 0.0))
    contacts = posed(Model(3, [GROUND, ball_on_floor], (0.0, 0.0, -G), 0.0, mu)).contacts
    found = cones.within_cones(contacts, np.array([-G, 3.0, 4.0]), np.zeros((1, 2)))
    rubs = min(mu * G, 5.0 / 3.5)
    assert found == pytest.approx([G, -0.6 * rubs, -0.8 * rubs], abs=1e-14)


def test_friction_in_space_without_a_solution(monkeypatch):
    """Rounds that end far from a solution, and sweeps that may take no time."""
    monkeypatch.setattr(cones, "solve", lambda *_: 1.0)
    monkeypatch.setattr(cones, "PRODUCTS", 0)
    ball_on_floor = Body(Sphere(0.5), 1.0, (0.1,) * 3, (0.0, 0.0, 0.5, 1.0, 0.0, 0.0, 0.0))
    contacts = posed(Model(3, [GROUND, ball_on_floor], (0.0, 0.0, -G), 0.0, 0.5)).contacts
    with pytest.raises(refusals.Unconverged, match="friction of 1 contacts is not found"):
        cones.within_cones(contacts, np.array([-G, 0.0, 0.0]), np.zeros((1, 2)))


@pytest.mark.parametrize("mu", [0.5, 3.0])
def test_friction_that_presses_a_sliding_rod_into_the_floor(mu):
    """Painleve's rod: a load and its friction move the place of contact by 1 + (x^2 - mu x z) / k^2."""
    half, radius, lean = 0.5, 0.1, 1.0
    pose = (0.0, 0.0, half * np.sin(lean) + radius, np.cos(0.5 * lean), 0.0, -np.sin(0.5 * lean), 0.0)
    rod = Body(Capsule(half, radius), 1.0, (half**2 / 3.0,) * 3, pose, (-1.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    asked = posed(Model(3, [GROUND, rod], (0.0, 0.0, -G), 0.0, mu))
    slip, push = asked.contacts.rows.speed[:, 1:], asked.rows @ asked.yields
    x, z = half * np.cos(lean), half * np.sin(lean) + radius
    left = push[0, 0] - mu * slip[0] @ push[0, 1:]
    assert abs(left - (1.0 + 3.0 * (x * x - mu * x * z) / half**2)) < 1e-12
    if left > 0.0:
        found = cones.within_cones(asked.contacts, asked.free, slip)
        assert np.abs(push @ found + asked.free)[0] < 1e-12 and abs(np.hypot(*found[1:]) - mu * found[0]) < 1e-12
    else:
        with pytest.raises(cones.NoSolution):
            cones.within_cones(asked.contacts, asked.free, slip)


def test_every_refusal_is_one_sentence():
    kinds = refusals.Refused.__subclasses__()
    assert len(kinds) == 12
    facts = {"t": 0.5, "share": 1e-3, "count": 50, "most": "bodies meet", "a": 1, "b": 2, "depth": 1e-3, "amount": 1e-3}
    for kind in kinds:
        said = str(kind(**facts))
        assert "{" not in said and "\n" not in said and len(said) < 160
