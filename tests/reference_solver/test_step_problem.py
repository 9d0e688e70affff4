"""The exported contact problem: the same one the solver has, complete, and readable by others."""

import numpy as np
import pytest

from reference_solver import Body, Box, Disc, HalfSpace, Model, Settings, Simulation, StepProblem
from reference_solver.coulomb import cone_defect

DT, G = 1.0 / 240.0, 9.81
UP = (1.0, 0.0, 0.0, 0.0)


def pile(dimension, restitution=0.0, friction=0.4):
    """Three boxes, the upper ones off centre and turned a little, on a floor; the last one falls."""
    floor = HalfSpace((*(0.0,) * (dimension - 1), 1.0))
    if dimension == 2:
        bodies = [Body(floor, motion="fixed")]
        bodies += [Body(Box((0.5, 0.5)), 1.0 + i, (1.0 + i) / 6.0, (0.1 * i, 0.5 + i, 0.0)) for i in range(2)]
        bodies.append(Body(Box((0.5, 0.5)), 2.0, 1.0 / 3.0, (0.3, 2.5, 0.0), (0.3, -1.0, 0.5)))
    else:
        moments = (0.2, 0.3, 0.4)
        bodies = [Body(floor, motion="fixed", pose=(0.0, 0.0, 0.0, *UP))]
        bodies += [Body(Box((0.5,) * 3), 1.0 + i, moments, (0.1 * i, 0.0, 0.5 + i, *UP)) for i in range(2)]
        bodies.append(Body(Box((0.5,) * 3), 2.0, moments, (0.3, 0.1, 2.5, *UP), (0.3, 0.1, -1.0, 0.2, 0.5, 0.1)))
    gravity = (*(0.0,) * (dimension - 1), -G)
    return Simulation(Model(dimension, bodies, gravity, restitution, friction), Settings.classical(DT))


def in_frame(problem, contacts):
    return np.einsum("cij,cj->ci", problem.frame, contacts.impulse)


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("restitution", [0.0, 0.5])
def test_velocities_of_a_step_by_its_matrices(dimension, restitution):
    """u = W p + q with the step's own impulses is what the bodies then do, whether or not p solves the problem."""
    simulation = pile(dimension, restitution)
    problem = simulation.step_problem()
    before = simulation.twist
    simulation.advance(1)
    contacts = simulation.contacts()
    assert problem.contacts == len(contacts) and (problem.body_b == contacts.body_b).all()
    beyond = problem.velocity(in_frame(problem, contacts))
    d = dimension
    for c in range(problem.contacts):
        speeds = []
        for twists in (before, simulation.twist):
            v = np.zeros(d)
            for body, sign in ((contacts.body_a[c], -1.0), (contacts.body_b[c], 1.0)):
                arm = contacts.point[c] - simulation.model.bodies[body].pose[:d]
                spin = twists[body, d:]
                turn = spin[0] * np.array([-arm[1], arm[0]]) if d == 2 else np.cross(spin, arm)
                v += sign * (twists[body, :d] + turn)
            speeds.append(problem.frame[c] @ v)
        target = -restitution * min(speeds[0][0], 0.0)
        # free rotation turns a spinning box's angular velocity by (h w)^2 in the step, after the solve: 1e-5 rad/s
        slack = 1e-12 if d == 2 else 1e-4
        assert beyond[c] == pytest.approx(speeds[1] - target * np.eye(d)[0], abs=slack)


@pytest.mark.parametrize("dimension", [2, 3])
def test_posing_a_problem_changes_nothing(dimension):
    asked, plain = pile(dimension), pile(dimension)
    for simulation in (asked, plain):
        simulation.advance(5)
    contacts = asked.contacts().impulse.copy()
    asked.step_problem()
    assert (asked.contacts().impulse == contacts).all()
    for simulation in (asked, plain):
        simulation.advance(5)
    assert (asked.pose == plain.pose).all() and (asked.twist == plain.twist).all()


@pytest.mark.parametrize("dimension", [2, 3])
def test_a_file_gives_the_problem_back(dimension, tmp_path):
    problem = pile(dimension).step_problem()
    path = tmp_path / "problem.npz"
    problem.save(path)
    with np.load(path) as file:
        assert set(["W", "q", "mu", "spacedim", "numberOfContacts"]) <= set(file)
        assert int(file["spacedim"]) == dimension and int(file["numberOfContacts"]) == len(file["mu"])
        assert file["W"].shape == (len(file["q"]),) * 2
    again = StepProblem.load(path)
    for name in ("matrix", "free", "friction", "frame", "body_a", "body_b"):
        assert (getattr(again, name) == getattr(problem, name)).all()


def test_refusal_of_a_file_that_lacks_an_entry(tmp_path):
    np.savez(tmp_path / "part.npz", W=np.eye(2), q=np.zeros(2), spacedim=2, numberOfContacts=1)
    with pytest.raises(ValueError, match="mu"):
        StepProblem.load(tmp_path / "part.npz")


def test_refusal_of_a_problem_that_does_not_fit():
    frame, index = np.eye(2)[None], np.zeros(1, np.int64)
    with pytest.raises(ValueError, match="free"):
        StepProblem(np.eye(2), np.zeros(3), np.zeros(1), frame, index, index)
    with pytest.raises(ValueError, match="symmetric"):
        StepProblem(np.array([[1.0, 0.1], [0.0, 1.0]]), np.zeros(2), np.zeros(1), frame, index, index)


@pytest.mark.parametrize("dimension", [2, 3])
def test_export_of_more_contacts_than_room(dimension):
    """Arrays that are too small grow in the copy only. 8 n + 64 planar rows, 4 n + 16 manifolds at the start."""
    simulation = pile(dimension)
    full = simulation.step_problem()
    world = simulation._world
    if dimension == 2:
        counts = np.zeros_like(world._rows.counts)
        world._rows = type(world._rows)(
            *(array[:2].copy() if getattr(array, "ndim", 0) else array for array in world._rows)
        )
        world._rows = world._rows._replace(counts=counts, local=full_scratch(pile(2)))
    else:
        world._manifolds, world._memory = world._manifolds[:1].copy(), world._memory[:1].copy()
    assert (simulation.step_problem().matrix == full.matrix).all()


def full_scratch(simulation):
    return simulation._world._rows.local.copy()


def test_enumeration_of_one_solution():
    """A resting box has one velocity, whatever its redundant corners carry; the numbers of solutions are O9's."""
    floor = Body(HalfSpace((0.0, 1.0)), motion="fixed")
    box = Body(Box((0.5, 0.5)), 1.0, 1.0 / 6.0, (0.0, 0.5, 0.0))
    simulation = Simulation(Model(2, [floor, box], (0.0, -G), 0.0, 0.5), Settings.fixed_step(DT))
    problem = simulation.step_problem()
    (found,) = problem.solutions()
    assert problem.pair_sums(found.impulse) == pytest.approx(np.array([[0.0, G * DT]]), abs=1e-15)
    assert found.velocity == pytest.approx(np.zeros((2, 2)), abs=1e-15)


def three_discs(seed, friction):
    """One disc on two, on a floor, all touching; masses and motions at random, of a few times g dt."""
    random, bodies = np.random.default_rng(seed), [Body(HalfSpace((0.0, 1.0)), motion="fixed")]
    for x, height in ((0.0, 0.5), (1.0, 0.5), (0.5, 0.5 + 0.5 * np.sqrt(3.0))):
        mass = random.uniform(0.5, 2.0)
        motion = tuple(random.normal(size=3) * 3.0 * G * DT)
        bodies.append(Body(Disc(0.5), mass, 0.125 * mass, (x, height, 0.0), motion))
    settings = Settings(DT, solver="block", residual=1e-13, relaxation=None, beta=1.0, slop=0.0)
    return Simulation(Model(2, bodies, (0.0, -G), 0.0, friction), settings)


def missed(problem, impulse):
    """Largest distance from complementarity on the friction cone (E60), over the largest impulse."""
    step, both = 1.0 / problem.matrix.diagonal().max(), zip(impulse, problem.velocity(impulse), strict=True)
    defects = [cone_defect((p[1], 0.0, p[0]), (u[1], 0.0, u[0]), 0.0, problem.friction[0], step) for p, u in both]
    return max(defects) / np.abs(impulse).max()


@pytest.mark.parametrize(("seed", "count"), [(0, 1), (1, 3), (2, 1)])
def test_answer_of_the_solver_against_enumeration(seed, count):
    """Coulomb's law in coupled contacts may have several solutions: of 120 such triples 5 have, at mu = 0.5."""
    simulation = three_discs(seed, 0.5)
    problem = simulation.step_problem()
    solutions = problem.solutions()
    assert problem.contacts == 5 and len(solutions) == count
    simulation.advance(1)
    ours = problem.velocity(in_frame(problem, simulation.contacts()))
    scale = np.abs(problem.free).max()
    assert min(np.abs(ours - found.velocity).max() for found in solutions) <= 1e-11 * scale
    apart = [np.abs(a.velocity - b.velocity).max() for a in solutions for b in solutions if a is not b]
    assert min(apart, default=scale) > 1e-2 * scale  # they are different motions, not one at a border of modes


@pytest.mark.parametrize("seed", [15, 17])
def test_continuum_between_two_solutions(seed):
    """Discs that jam: everything between the two solutions found is one as well, and the solver's lies among them."""
    simulation = three_discs(seed, 0.5)
    problem = simulation.step_problem()
    first, last = problem.solutions()
    for share in (0.25, 0.5, 0.75):
        assert missed(problem, (1.0 - share) * first.impulse + share * last.impulse) <= 1e-14
    simulation.advance(1)
    impulse = in_frame(problem, simulation.contacts())
    assert missed(problem, impulse) <= 1e-13
    ours, whole = problem.velocity(impulse), last.velocity - first.velocity
    share = np.vdot(ours - first.velocity, whole) / np.vdot(whole, whole)
    assert 0.0 < share < 1.0
    assert ours == pytest.approx(first.velocity + share * whole, abs=1e-11 * np.abs(problem.free).max())


def test_enumeration_is_planar():
    with pytest.raises(ValueError, match="planar"):
        pile(3).step_problem().solutions()


def test_problem_of_a_world_without_contacts():
    disc = Body(Disc(0.5), 1.0, 0.125, (0.0, 5.0, 0.0))
    simulation = Simulation(Model(2, [disc], (0.0, -G), 0.0, 0.5), Settings.fixed_step(DT))
    assert simulation.step_problem().contacts == 0
