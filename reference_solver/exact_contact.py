"""One contact problem of few contacts, solved by trying every mode of every contact (O9 to O12).

Being exhaustive is the point: a contact problem with Coulomb friction may have no solution or several (Painleve), an
iterative solver returns one of them, or none, without saying which. Enumeration finds all of them and counts.

Unknowns are impulses p and velocities u = W p + q. At the level of accelerations the same functions serve, with
forces for p and accelerations for u.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from reference_solver.model import Array

#: Contacts that are enumerated with friction: four modes each, 4096 linear systems of at most twelve rows.
MOST_WITH_FRICTION = 6
#: Contacts that are enumerated without friction: two modes each, 4096 linear systems.
MOST_WITHOUT = 12

#: Wrong signs up to this share of the problem's own scale are round-off: 64 units in the last place; where nothing
#: is found so, 1e5 of them, what a linear system of condition 1e4 loses. Sharp first: it decides on which side of
#: the cone's edge a contact stands.
SIGNS = (1.4e-14, 2e-11)
#: Solutions whose velocities differ by less than this share of the scale are one: modes meet at their borders
#: (sticking with the impulse on the cone, slipping at speed zero).
SAME = 1e-9
#: Singular values below this share of the largest belong to redundant contacts (two points of one box both sticking).
REDUNDANT = 1e-11


@dataclass(frozen=True)
class ContactSolution:
    """One solution of a contact problem with c contacts.

    Parameters
    ----------
    modes
        (c,) of ``separate``, ``stick``, ``slip+``, ``slip-`` (by the sign of the tangential velocity) and ``slip``
        (no friction).
    impulse, velocity
        (c, 2) normal and tangential [N s], [m/s]; (c, 1) where the problem has normal rows only. The normal velocity
        is the one beyond its target.
    """

    modes: tuple[str, ...]
    impulse: Array
    velocity: Array


def coulomb_solutions(
    matrix: Array, free: Array, friction: Sequence[float], sliding: Sequence[float] | None = None
) -> list[ContactSolution]:
    """Return every solution of the planar Coulomb problem (O9), one per distinct velocity.

    Parameters
    ----------
    matrix
        W (2c, 2c) [1/kg], symmetric and positive semi-definite, rows n1, t1, n2, t2, ...
    free
        q (2c,) [m/s]: velocity without these impulses, the normal rows less their target.
    friction
        (c,) coefficients.
    sliding
        (c,) signs of a sliding that is already going on, 0 where the contact does not slide: the *continuous*
        problem of forces and accelerations, where a sliding contact cannot choose to stick. Missing: all zero.

    Raises
    ------
    ValueError
        For more than `MOST_WITH_FRICTION` contacts, or arrays that do not fit each other.

    Notes
    -----
    Lotstedt, SIAM J. Sci. Stat. Comput. 5 (1984) 370, has the complementarity form; Painleve 1895 the examples
    without and with several solutions.
    """
    friction = tuple(friction)
    count = len(friction)
    _require_fit(matrix, free, 2 * count)
    if count > MOST_WITH_FRICTION and any(friction):
        raise ValueError(f"friction: {count} contacts, enumeration with friction ends at {MOST_WITH_FRICTION}")
    choices = [_modes(mu, sign) for mu, sign in zip(friction, sliding or (0.0,) * count, strict=True)]
    scale = np.repeat(1.0 / np.sqrt(np.diag(matrix)[::2]), 2)
    w, q = scale[:, None] * matrix * scale, scale * free
    return _unscaled(_found(w, q, choices, friction, sliding is not None), scale, _size(q), 2)


def frictionless_solutions(matrix: Array, free: Array) -> list[ContactSolution]:
    """Return every solution of 0 <= W p + q, p >= 0, p . (W p + q) = 0 (O10), one per distinct velocity.

    Parameters
    ----------
    matrix, free
        W (c, c) [1/kg] and q (c,) [m/s], normal rows only, in any dimension.

    Raises
    ------
    ValueError
        For more than `MOST_WITHOUT` contacts, or arrays that do not fit each other.
    """
    count = len(free)
    _require_fit(matrix, free, count)
    if count > MOST_WITHOUT:
        raise ValueError(f"matrix: {count} contacts, enumeration without friction ends at {MOST_WITHOUT}")
    scale = 1.0 / np.sqrt(np.diag(matrix))
    # as a problem with tangential rows that nothing acts on
    wide, q = np.zeros((2 * count, 2 * count)), np.zeros(2 * count)
    wide[::2, ::2], q[::2] = scale[:, None] * matrix * scale, scale * free
    found = _found(wide, q, [("separate", "slip")] * count, (0.0,) * count, False)
    narrow = ((modes, p[::2], u[::2]) for modes, p, u in found)
    return _unscaled(narrow, scale, _size(q), 1)


def non_negative_least_squares(matrix: Array, right: Array) -> tuple[Array, float]:
    """Return x >= 0 that minimises |A x - b|, and the residual norm (Lawson and Hanson 1974, algorithm NNLS).

    The residual tells whether b lies in the cone of A's columns, which settles redundant contacts exactly.
    """
    columns = matrix.shape[1]
    x, active = np.zeros(columns), np.zeros(columns, bool)
    tolerance = 1e-14 * max(1.0, float(np.abs(matrix).max())) * max(float(np.abs(right).max()), 1e-300)
    for _ in range(30 * columns):  # bound of the usual implementations; the algorithm itself is finite
        slope = matrix.T @ (right - matrix @ x)
        slope[active] = -np.inf
        if slope.max() <= tolerance:
            break
        active[slope.argmax()] = True
        trial = _on(matrix, right, active)
        while trial[active].min() <= 0.0:
            shrinking = active & (trial <= 0.0)
            x += np.min(x[shrinking] / (x[shrinking] - trial[shrinking])) * (trial - x)
            active &= x > 1e-15 * np.abs(x).max()
            x[~active] = 0.0
            if not active.any():
                break
            trial = _on(matrix, right, active)
        else:
            x = trial
    return x, float(np.linalg.norm(right - matrix @ x))


def _on(matrix: Array, right: Array, active: Array) -> Array:
    trial = np.zeros(matrix.shape[1])
    trial[active] = np.linalg.lstsq(matrix[:, active], right, rcond=REDUNDANT)[0]
    return trial


def _modes(mu: float, sign: float) -> tuple[str, ...]:
    if mu == 0.0:
        return ("separate", "slip")
    if sign != 0.0:
        return ("separate", "slip+" if sign > 0.0 else "slip-")
    return ("separate", "stick", "slip+", "slip-")


def _found(
    w: Array, q: Array, choices: Sequence[tuple[str, ...]], friction: Sequence[float], continuous: bool
) -> list[tuple[tuple[str, ...], Array, Array]]:
    for sign in SIGNS:
        found = list(_enumerate(w, q, choices, friction, continuous, sign))
        if found:
            break
    return found


def _enumerate(
    w: Array, q: Array, choices: Sequence[tuple[str, ...]], friction: Sequence[float], continuous: bool, sign: float
) -> Iterator[tuple[tuple[str, ...], Array, Array]]:
    """Yield (modes, p, u) of every combination that contradicts none of the law's signs."""
    size = _size(q)
    for modes in product(*choices):
        rows, generators = _closed(modes, friction, len(q))
        p = np.zeros(len(q))
        if rows:
            weights = _weights(w[rows] @ generators, -q[rows], size, sign)
            if weights is None:
                continue
            p = generators @ weights
        u = w @ p + q
        if _signs_hold(modes, u, sign * max(size, float(np.abs(w @ p).max())), continuous, choices):
            yield modes, p, u


def _size(q: Array) -> float:
    """Speed that signs and differences of a problem are measured against."""
    return max(float(np.abs(q).max(initial=0.0)), 1e-300)


def _closed(modes: Sequence[str], friction: Sequence[float], size: int) -> tuple[list[int], Array]:
    """Rows whose velocity is zero, and the edges (size, k) of the cone that the impulses are combined from (O11)."""
    rows: list[int] = []
    edges: list[tuple[int, float]] = []
    for contact, (mode, mu) in enumerate(zip(modes, friction, strict=True)):
        if mode == "separate":
            continue
        rows.append(2 * contact)
        if mode == "stick":
            rows.append(2 * contact + 1)
            edges += [(contact, mu), (contact, -mu)]
        else:
            edges.append((contact, {"slip": 0.0, "slip+": -mu, "slip-": mu}[mode]))
    generators = np.zeros((size, len(edges)))
    for column, (contact, tangential) in enumerate(edges):
        generators[2 * contact : 2 * contact + 2, column] = 1.0, tangential
    return rows, generators


def _weights(a: Array, b: Array, size: float, sign: float) -> Array | None:
    """Non-negative solution of the square system a x = b; None if there is none."""
    singular = np.linalg.svd(a, compute_uv=False)
    if singular[-1] > REDUNDANT * singular[0]:
        x = np.asarray(np.linalg.solve(a, b))
        return np.maximum(x, 0.0) if x.min() >= -sign * max(size, float(np.abs(x).max())) else None
    nearest, residual = non_negative_least_squares(a, b)
    return nearest if residual <= sign * size else None


def _signs_hold(
    modes: Sequence[str], u: Array, slack: float, continuous: bool, choices: Sequence[tuple[str, ...]]
) -> bool:
    for contact, mode in enumerate(modes):
        normal, tangential = u[2 * contact], u[2 * contact + 1]
        if mode == "separate" and normal < -slack:
            return False
        if continuous and "stick" not in choices[contact]:
            continue  # it slides already: its tangential acceleration is free
        if (mode == "slip+" and tangential < -slack) or (mode == "slip-" and tangential > slack):
            return False
    return True


def _unscaled(
    found: Iterable[tuple[tuple[str, ...], Array, Array]], scale: Array, size: float, width: int
) -> list[ContactSolution]:
    kept: list[ContactSolution] = []
    seen: list[Array] = []
    for modes, p, u in found:
        if all(np.abs(u - other).max() > SAME * max(size, float(np.abs(u).max())) for other in seen):
            seen.append(u)
            kept.append(ContactSolution(modes, (scale * p).reshape(-1, width), (u / scale).reshape(-1, width)))
    return kept


def _require_fit(matrix: Array, free: Array, size: int) -> None:
    if np.shape(matrix) != (size, size) or np.shape(free) != (size,):
        raise ValueError(f"matrix, free: shapes {np.shape(matrix)}, {np.shape(free)} where {size} rows are needed")
    if not (np.diag(matrix) > 0.0).all():
        raise ValueError("matrix: a contact between immovable bodies has no solution")
