"""Every hard case ends in its certified answer, and the verdicts themselves rest on what is derived here again."""

import itertools
import math

import numpy as np
import pytest
from scipy.optimize import linprog

from reference_solver import Settings
from reference_solver.exact_contact import coulomb_solutions
from reference_solver.shapes import area_centroid_moment
from reference_solver.simulation import Simulation
from reference_solver.verification.hard_cases import HARD_CASES
from reference_solver.verification.hard_cases.case import Run, Verdict, doubts, energy, within
from reference_solver.verification.hard_cases.collisions import PLACES, SPEEDS
from reference_solver.verification.hard_cases.gates import of_case
from reference_solver.verification.hard_cases.masonry import FRICTION, VOUSSOIRS, least_thickness, voussoir
from reference_solver.verification.hard_cases.rods import CARD, ROUND, TENT, tent_limit, threshold, tip_matrix
from reference_solver.verification.hard_cases.stacks import overhang_blocks

CERTIFIED = [name for name in HARD_CASES if not name.startswith(("rocking", "box dropped", "thin wall", "pile with"))]


@pytest.mark.parametrize("name", CERTIFIED)
def test_case_ends_in_its_certified_answer(name):
    rows = list(of_case(HARD_CASES[name]))
    assert rows
    assert [row for row in rows if not row.holds] == []


@pytest.mark.parametrize("name", HARD_CASES)
def test_the_textbook_never_ends_in_silent_garbage(name):
    """Whatever `classical` makes of a case: the certified answer again, or DIVERGED with a reason."""
    case = HARD_CASES[name]
    verdict = case.run(Settings.classical(case.settings.dt))
    if verdict.certified:
        assert all(verdict.measured[key] <= limit for key, limit in verdict.limits.items())
        assert all(verdict.answer[key] == count for key, count in case.expects.items())
    else:
        assert verdict.answer == {}
        assert verdict.reason
        assert str(verdict).startswith("DIVERGED: ")


def played(case):
    simulation = Simulation(case.model(), case.settings)
    record = simulation.record(max(1, round(case.duration / case.settings.dt)), contacts=True)
    return Run(simulation.model, simulation.settings, record, simulation.certificate)


def test_every_doubt_is_raised_by_what_it_is_about():
    run = played(HARD_CASES["card tent, mu +1 %"])
    assert doubts(run) == ""
    broken = played(HARD_CASES["card tent, mu +1 %"])
    broken.record.pose[-1, 1, 0] = math.nan
    assert "not finite" in doubts(broken)
    assert "unsolved" in doubts(Run(run.model, run.settings, run.record, run.certificate | {"natural": 1e-3}))
    faster = played(HARD_CASES["card tent, mu +1 %"])
    faster.record.twist[-1] *= 0.0
    faster.record.twist[-1, 1, 0] = 5.0
    faster.record.pose[-1, 1, 1] += 0.1
    assert "energy grew" in doubts(faster)
    assert doubts(faster, excused=("gain",)) == ""
    sunk = played(HARD_CASES["card tent, mu +1 %"])
    sunk.record.contacts.gap[sunk.record.offset[-2] :] = -1e-3
    assert "overlap" in doubts(sunk)


def test_a_limit_that_is_missed_or_not_a_number_voids_the_answer():
    assert within({"x": 1.0}, {"x": 0.5}, "fits").answer == {"x": 0.5}
    for value in (1.5, -1.5, math.nan):
        verdict = within({"x": 1.0}, {"x": value}, "fits")
        assert isinstance(verdict, Verdict)
        assert not verdict.certified
        assert verdict.answer == {}


def equilibrium(thickness):
    """Balance of all voussoirs, each joint touching at two corners, forces in the edges of their friction cones."""
    columns = []
    for joint, side in itertools.product(range(VOUSSOIRS + 1), (1, -1)):
        t = math.pi * joint / VOUSSOIRS
        radial, along = np.array([math.cos(t), math.sin(t)]), np.array([-math.sin(t), math.cos(t)])
        place = radial * (1.0 - side * 0.5 * thickness)
        for tangential in (FRICTION, -FRICTION):
            force = along + tangential * radial
            wrench = np.array([*force, place[0] * force[1] - place[1] * force[0]])
            column = np.zeros((VOUSSOIRS + 2, 3))
            column[joint], column[joint + 1] = -wrench, wrench
            columns.append(column[1:-1].ravel())
    weights = []
    for k in range(VOUSSOIRS):
        area, centre, _ = area_centroid_moment(voussoir(k, thickness))
        weights += [0.0, area, area * centre[0]]
    return np.array(columns).T, np.array(weights)


def test_the_archs_limit_is_that_of_the_linear_program_of_all_forces():
    """Two unknowns of the symmetric half against scipy's linprog on all forces at all corners of all joints."""
    limit = least_thickness()
    for thickness, feasible in ((limit + 1e-4, True), (limit - 1e-4, False)):
        matrix, weights = equilibrium(thickness)
        answer = linprog(np.zeros(matrix.shape[1]), A_eq=matrix, b_eq=weights, bounds=(0.0, None))
        assert (answer.status == 0) == feasible
    # A continuous semicircle needs 0.1075 (Milankovitch 1907); straight joints can only be somewhat better.
    assert 0.105 < limit < 0.1075


def test_the_tents_limit_balances_forces_and_moments():
    """One card, forces at foot and top, written down with numbers: the foot's friction is what is left over."""
    half, lean, radius = CARD, TENT, ROUND
    centre = np.array([half * math.sin(lean), half * math.cos(lean) + radius])
    top = centre + half * np.array([math.sin(lean), math.cos(lean)])
    # unknowns: horizontal force at the top, normal and friction at the foot (origin)
    matrix = np.array([[-1.0, 0.0, 1.0], [0.0, 1.0, 0.0], [top[1], 0.0, 0.0]])
    _, normal, friction = np.linalg.solve(matrix, [0.0, 1.0, centre[0]])
    assert tent_limit() == pytest.approx(friction / normal, rel=1e-14)
    assert tent_limit() == pytest.approx(0.5 * math.tan(lean), rel=0.51e-3 / math.cos(lean))


@pytest.mark.parametrize("shift", [-1e-6, 1e-6])
def test_the_overhang_stands_on_the_side_of_the_edge_on_which_its_centre_of_mass_is(shift):
    blocks = overhang_blocks(shift)[1:]
    centres = np.array([block.pose[0] for block in blocks])
    half = blocks[0].shape.half_extents[0]
    edges = [0.0, *(centres[:-1] + half)]
    margins = [centres[k:].mean() - edge for k, edge in enumerate(edges)]
    assert (margins[0] > 0.0) == (shift > 0.0)
    assert abs(margins[0]) == pytest.approx(1e-6, rel=0.2)
    assert all(-2.1e-7 < margin < 0.0 for margin in margins[1:])


def test_forces_have_no_or_two_solutions_beyond_the_threshold_and_one_before():
    for share, lift, expected in ((0.98, -1.0, 1), (0.98, 1.0, 1), (1.02, -1.0, 0), (1.02, 1.0, 2)):
        found = coulomb_solutions(tip_matrix(), np.array([lift, 0.0]), [share * threshold()], sliding=[-1.0])
        assert len(found) == expected


def test_a_steps_contact_problem_always_has_a_solution():
    """2000 random problems of one and two contacts on free bodies: impulses exist, several or one (E54).

    W is symmetric and positive semi-definite, and q is a velocity that free bodies can have; then a solution exists
    (D. Stewart and J. Trinkle 1996, M. Anitescu and F. Potra 1997).
    """
    rng = np.random.default_rng(3)
    several = 0
    for trial in range(2000):
        count = 1 + trial % 2
        levers = rng.standard_normal((2 * count, 3))
        for c in range(count):  # normal and tangent of a contact are perpendicular unit vectors
            angle = rng.uniform(0.0, 2.0 * math.pi)
            levers[2 * c, :2] = math.cos(angle), math.sin(angle)
            levers[2 * c + 1, :2] = -math.sin(angle), math.cos(angle)
        matrix = levers @ np.diag([1.0, 1.0, rng.uniform(0.1, 10.0)]) @ levers.T
        free = levers @ rng.standard_normal(3)  # velocities that the bodies can have
        solutions = coulomb_solutions(matrix, free, rng.uniform(0.0, 3.0, count))
        assert solutions
        several += len(solutions) > 1
    assert several > 0  # existence, not uniqueness


@pytest.mark.parametrize("key", SPEEDS, ids=lambda key: " ".join(key))
def test_the_laws_speeds_follow_from_impulses_written_down(key):
    places, law = key
    positions = np.array(PLACES[places])
    velocity = np.array([[1.0, 0.0], [0.0, 0.0], [0.0, 0.0]])
    pairs = [(a, b) for a, b in ((0, 1), (0, 2), (1, 2)) if math.dist(positions[a], positions[b]) < 1.001]
    normals = [positions[b] - positions[a] for a, b in pairs]
    rows = np.zeros((len(pairs), 3, 2))
    for row, (a, b), n in zip(rows, pairs, normals, strict=True):
        row[a], row[b] = -n, n
    jacobian = rows.reshape(len(pairs), 6)
    if law == "N-SIM":
        approach = jacobian @ velocity.ravel()
        closing = [i for i in range(len(pairs)) if not (places == "wedge" and pairs[i] == (1, 2))]
        j = jacobian[closing]
        p = np.linalg.solve(j @ j.T, -2.0 * np.minimum(approach[closing], 0.0) - np.maximum(approach[closing], 0.0))
        velocity = velocity + (j.T @ p).reshape(3, 2)
        assert (p > 0.0).all()
    else:
        while (approach := jacobian @ velocity.ravel()).min() < -1e-12:
            first = int(np.flatnonzero(approach < -1e-12)[0])
            velocity = velocity - (approach[first] * jacobian[first]).reshape(3, 2)
    assert np.hypot(*velocity.T) == pytest.approx(SPEEDS[key], abs=1e-15)
    assert (velocity**2).sum() == pytest.approx(1.0, abs=1e-15)


def test_energy_counts_height_speed_and_spin_of_free_bodies():
    run = played(HARD_CASES["three discs, row, N-SIM"])
    total = energy(run.model, run.record.pose, run.record.twist)
    assert total == pytest.approx([0.5, 0.5], abs=1e-15)


@pytest.mark.parametrize(
    "name", [name for name in HARD_CASES if name.startswith(("overhang", "arch", "thin wall", "box"))]
)
def test_case_holds_with_located_events(name):
    case = HARD_CASES[name]
    verdict = case.run(Settings.reference(case.settings.dt))
    assert verdict.certified, verdict.reason
    assert all(verdict.answer[key] == count for key, count in case.expects.items())
