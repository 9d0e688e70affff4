"""Steps of complementary pivoting by themselves: what leaves the basis, what covers, and what is kept in the end."""

import numpy as np
import pytest

from reference_solver.compilation import from_python
from reference_solver.direct import pivoting

first_to_leave, write_table = from_python(pivoting.first_to_leave), from_python(pivoting.write_table)
SOLVED = 1e-13


def one_contact(direct, column, right):
    """A table of four rows, whose last column is the right side and whose third is about to enter; z0 is in row 2."""
    problem = direct.random(0, 1)
    problem.table[:, 2], problem.table[:, 5] = column, right
    problem.basic[:] = 0, 1, 8, 3
    return problem


@pytest.mark.parametrize(
    ("column", "right", "leaves"),
    [
        ((1.0, 2.0, 1.0, -1.0), (3.0, 4.0, 5.0, 0.0), 1),  # the least ratio of a positive entry
        ((1.0, 2.0, 1.0, 4.0), (2.0, 4.0, 2.0, 8.0), 2),  # of those that tie the covering variable
        ((2.0, 1e-10, 1.0, 1.0), (1.0, 1e-12, 1.0, 1.0), 1),  # small, and far from round-off
        ((2.0, 1e-13, 1.0, 1.0), (1.0, 0.0, 1.0, 1.0), 0),  # round-off of the largest is no pivot
        ((1.0, 1.0, 1.0, 1.0), (1.0, -1e-17, 2.0, 3.0), 1),  # round-off below zero is zero
        ((-1.0, 0.0, -2.0, -1.0), (1.0, 1.0, 1.0, 1.0), -1),  # nothing stops it: a ray
    ],
)
def test_what_falls_to_zero_first_leaves(direct, column, right, leaves):
    assert first_to_leave(one_contact(direct, column, right), 4, 2) == leaves


def test_each_search_is_covered_otherwise(direct):
    """Entries of the covering vectors lie between one and two; but for the first search no two are the same."""
    vectors = []
    for attempt in range(pivoting.COVERINGS):
        problem = direct.random(3, 4)
        write_table(problem, attempt)
        vectors.append(-problem.table[:, 16])
    assert (vectors[0] == 1.0).all()
    later = np.array(vectors[1:])
    assert (later >= 1.0).all() and (later < 2.0).all()
    assert len(np.unique(later.round(6))) == later.size


def hard(direct, seed):
    """24 contacts of bodies of .0001 to 10 000 kg that approach: beyond what pivots in double precision can tell."""
    rng = np.random.default_rng(seed)
    problem = direct.random(seed, 24, mu=0.9)
    contact, body = problem.contact, problem.body
    lighter = 10.0 ** rng.uniform(-4.0, 4.0, len(body))
    contact.response[:] *= lighter[contact.body][:, :, None, None]
    body.weight[:] /= lighter[:, None]
    own = (contact.jacobian * contact.response).sum(axis=(1, 3))
    contact.admittance[:, 0], contact.admittance[:, 1] = own[:, 0], own[:, 1]
    contact.target[:] = rng.uniform(0.0, 1.0, 24)
    return problem


def test_answer_without_a_pivot_that_ends(direct):
    """With the impulses that have its residual: a larger one is not taken, in whichever search."""
    kept = 0
    for seed in range(8):
        alone, problem = hard(direct, seed)._replace(table=np.zeros((0, 2))), hard(direct, seed)
        by_rounds, found = (direct.solve(each, SOLVED, 6) for each in (alone, problem))
        assert found <= by_rounds, seed
        if found == by_rounds > 1e-3:
            kept += 1
            assert np.array_equal(problem.contact.best, alone.contact.best), seed
    assert kept >= 4
