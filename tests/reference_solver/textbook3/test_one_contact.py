"""The one-contact law against an independent search, and over many badly conditioned problems."""

import numpy as np
import pytest

from reference_solver.coulomb import cone_defect
from reference_solver.textbook3.one_contact import coulomb_impulse


def problem(random, condition, most_friction=2.0):
    """K with eigenvalues between 1/condition and 1, both taken, axes at random; q approaches."""
    axes, _ = np.linalg.qr(random.normal(size=(3, 3)))
    values = np.array([1.0, 1.0 / condition, condition ** -random.uniform()])
    k = axes @ np.diag(values) @ axes.T
    q = random.normal(size=3)
    q[2] = -abs(q[2])
    return 0.5 * (k + k.T), q, random.uniform(0.0, most_friction)


def solved(k, q, mu):
    return np.array(coulomb_impulse((k[0, 0], k[0, 1], k[0, 2], k[1, 1], k[1, 2], k[2, 2]), tuple(q), mu))


def missed(k, q, mu, p):
    """Distance from complementarity on the friction cone (E60), over the impulse, or over all |K| allows."""
    step = 1.0 / np.linalg.norm(k, 2)
    return cone_defect(tuple(p), tuple(k @ p + q), 0.0, mu, step) / max(np.abs(p).max(), step * np.abs(q).max())


@pytest.mark.parametrize("condition", [10.0, 1e2, 1e4, 1e6])
def test_every_problem_is_solved(condition):
    """K is positive definite, so that a solution exists; 8 roundings, each amplified by the condition at most."""
    random = np.random.default_rng(int(condition))
    worst = max(missed(*args, solved(*args)) for args in (problem(random, condition) for _ in range(2500)))
    assert worst <= 1e-12 + 8 * 2.2e-16 * condition


def slips_by_search(k, q, mu, directions=200_001):
    """All slipping solutions: sign changes on a dense circle of what is left across d, each refined by bisection."""

    def across(angle):
        d = np.stack([np.cos(angle), np.sin(angle)])
        share = k[2, 2] - mu * (k[2, :2] @ d)
        p = np.stack([-mu * d[0], -mu * d[1], np.ones_like(angle)]) * (-q[2] / share)
        u = (k @ p).T + q
        return d, share, p, u[..., 1] * d[0] - u[..., 0] * d[1], u[..., 0] * d[0] + u[..., 1] * d[1]

    angles = np.linspace(0.0, 2.0 * np.pi, directions)
    _, share, _, value, _ = across(angles)
    places = np.flatnonzero((np.sign(value[:-1]) != np.sign(value[1:])) & (share[:-1] > 0.0) & (share[1:] > 0.0))
    found = []
    for low, high in zip(angles[places], angles[places + 1], strict=True):
        sign = np.sign(across(np.array(low))[3])
        for _ in range(60):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if np.sign(across(np.array(middle))[3]) == sign else (low, middle)
        _, share, p, _, along = across(np.array(low))
        if along >= 0.0 and share > 0.0:
            found.append(p)
    return found


def test_answer_against_a_search_of_the_circle():
    random, slipped = np.random.default_rng(5), 0
    for _ in range(60):
        k, q, mu = problem(random, 100.0)
        p = solved(k, q, mu)
        stick = -np.linalg.solve(k, q)
        if np.hypot(*stick[:2]) <= mu * stick[2]:
            assert p == pytest.approx(stick, rel=1e-11)
            continue
        candidates = slips_by_search(k, q, mu)
        # condition 100 and a root that may be nearly double: half the digits of an angle, fewer of the impulse
        assert min(np.abs(p - other).max() for other in candidates) <= 1e-7 * np.abs(p).max()
        slipped += 1
    assert slipped >= 20


def test_roots_close_together():
    """The only admissible root has a neighbour at 0.15 rad: a scan of the circle in 32 steps sees neither of them."""
    k = np.array([[0.1185, 0.1558, 0.2659], [0.1558, 0.2366, 0.3853], [0.2659, 0.3853, 0.6658]])
    q, mu = np.array([1.8565, 0.1499, -2.1741]), 1.61
    (only,) = slips_by_search(k, q, mu)
    p = solved(k, q, mu)
    assert missed(k, q, mu, p) <= 1e-12
    assert p == pytest.approx(only, rel=1e-8)


@pytest.mark.parametrize("mu", [0.3, 1.0, 2.0])
def test_stick_and_slip_on_the_edge_of_the_cone(mu):
    """q is chosen so that sticking needs exactly mu p_n, up to round-off on either side: nothing jumps."""
    random, asked = np.random.default_rng(3), 0
    for _ in range(200):
        k, _, _ = problem(random, 100.0)
        angle = random.uniform(0.0, 2.0 * np.pi)
        p = np.array([mu * np.cos(angle), mu * np.sin(angle), 1.0])
        q = -k @ p
        if q[2] >= 0.0:
            continue  # it would part by itself: such a K turns friction into lift
        asked += 1
        for scale in (1.0 - 1e-15, 1.0, 1.0 + 1e-15):
            assert missed(k, q, mu * scale, solved(k, q, mu * scale)) <= 1e-12
    assert asked > 100
