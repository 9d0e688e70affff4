"""Steps of motion that turns; implicit ones where a slip in space is so slow that friction turns it at once (E23).

Friction turns a slip u_t at the rate ``kappa = mu p_n W_tt / |u_t|``, where W_tt says how its place yields. Where u_t
begins or ends kappa has no bound, while the motion stays smooth: the slip points where its acceleration leads. Explicit
steps must resolve 1/kappa. Collocation at Radau's points need not (E. Hairer, G. Wanner, *Solving Ordinary Differential
Equations II*, 1996, IV.5), if directions d of slips are unknown at each point, with the equation that u_t lies along d:
it holds where u_t is none. Newton's method finds the directions; all else is found by repeating it.
"""

from __future__ import annotations

import numpy as np
from numpy.polynomial import legendre
from scipy.special import roots_jacobi

from reference_solver.exact.bodies import State, World
from reference_solver.exact.forces import Held
from reference_solver.exact.motion import LEAST, LONGER, SAFE, SHORTER, Piece, Turning
from reference_solver.exact.problem import SLIP
from reference_solver.model import Array

#: Points of a step, and powers of the share at them.
NODES = np.append(0.5 * (1.0 + roots_jacobi(4, 1.0, 0.0)[0]), 1.0)
COUNT = len(NODES)
POWERS = np.arange(COUNT)
#: Coefficients of the polynomial through values at the points; integrals of it up to each point; its Legendre series.
THROUGH = np.linalg.inv(NODES[:, None] ** POWERS)
UP_TO = NODES[:, None] ** (POWERS + 1) / (POWERS + 1) @ THROUGH
SERIES = np.linalg.inv(legendre.legvander(2.0 * NODES - 1.0, COUNT - 1))
#: An explicit step is stable up to this many 1/kappa. Corrections below this share of the tolerance end the iteration
#: (the same, IV.8: .1 to .01). In so many rounds halves become a millionth; a shorter step is better than more.
STABLE, CLOSE, MOST = 5.0, 0.03, 20


def step(world: World, state: State, held: Held, tolerance: float, length: float) -> tuple[Piece, float]:
    """Return a piece of at most a length [s] to a tolerance, explicit or implicit, and the next length [s].

    Raises
    ------
    NoStep
        See `Turning.step`.
    """
    if world.dimension == 3 and len(held.contacts):
        stiff = Stiff(world, state, held, tolerance)
        # What order 8 could do with the smallest half width's time to fall through.
        smooth = tolerance**0.125 * world.time
        if stiff.rate * smooth > STABLE:
            while stiff.rate * length > SHORTER * STABLE:
                found, length = stiff.implicit_step(length)
                if found is not None:
                    return found, length
    return Turning(world, state, held, tolerance).step(length)


class Stiff(Turning):
    """Motion with slow slips in space, in implicit steps: directions of slips are unknown at each point as well."""

    def __init__(self, world: World, state: State, held: Held, tolerance: float) -> None:
        super().__init__(world, state, held, tolerance)
        held.contacts.at_state(state)
        self._directions = held.onward(held.contacts)
        rubs = (held.answer.modes == SLIP) & (held.contacts.friction > 0.0)
        self._slips = np.flatnonzero(rubs & self._directions.any(axis=1))
        _, self._start, _, turn, slip, across = self._at(
            np.zeros(state.velocity.shape), state.velocity, self._directions
        )
        sizes = np.maximum(np.linalg.norm(slip, axis=1), world.slipping)
        self.rate = float(np.abs((across * turn).sum(axis=1) / sizes).max(initial=0.0))

    def _at(self, way: Array, velocity: Array, directions: Array) -> tuple[Array, ...]:
        """Rates of ways, accelerations (N,), pushes; of slips, how they turn accelerations, along and across, rows."""
        held = self._held
        rate, free, acceleration, pushes = self.after(way, velocity, directions)
        turn, across = np.zeros((2, len(self._slips), velocity.size))
        rows = held.contacts.matrices[0].reshape(len(held.contacts), 3, -1)
        slip = np.zeros((len(self._slips), 2))
        for out, k in enumerate(self._slips.tolist()):
            first, second = directions[k]
            turn[out] = held.turned(k, free, directions)
            across[out] = first * rows[k, 2] - second * rows[k, 1]
            speed = held.contacts.rows.speed[k, 1:]
            slip[out] = first * speed[0] + second * speed[1], first * speed[1] - second * speed[0]
        return rate.ravel().copy(), acceleration.ravel(), pushes, turn, slip, across

    def implicit_step(self, length: float) -> tuple[Piece | None, float]:
        """Return a piece of a length [s] and the next length; None and a shorter length where that is too long."""
        start = self._state.velocity
        shape, count, k = start.shape, start.size, len(self._slips)
        each = np.tile(self._world.per_length, len(start))
        scale = self._tolerance * (LEAST * self._world.speed * each + np.abs(start.ravel()))
        scale_of_ways = self._tolerance * self._world.size * each
        rates = np.tile(start.ravel(), (COUNT, 1))
        accelerations = np.tile(self._start, (COUNT, 1))
        directions = np.tile(self._directions, (COUNT, 1, 1))
        shift = np.inf
        for _ in range(MOST):
            velocity = start.ravel() + length * UP_TO @ accelerations
            way = length * UP_TO @ rates
            found = [self._at(way[i].reshape(shape), velocity[i].reshape(shape), directions[i]) for i in range(COUNT)]
            moved, now, pushes, turn, slip, across = (np.array(each) for each in zip(*found, strict=True))
            rest = now - accelerations
            # Slips are to lie along their directions: across (v + change of v) = |u_t| z, z how far they turn.
            # At point i, by slip l's turn z at point j, the velocity changes by length UP_TO[i, j] turn[j, l] z.
            wanted = (slip[:, :, 1] / length + np.einsum("ikn,in->ik", across, UP_TO @ rest)).ravel()
            matrix = np.diag(slip[:, :, 0].ravel() / length) - np.einsum(
                "ikn,ij,jln->ikjl", across, UP_TO, turn
            ).reshape(COUNT * k, COUNT * k)
            try:
                z = np.linalg.solve(matrix, wanted).reshape(COUNT, k)
            except np.linalg.LinAlgError:  # a slip that does not yield has no direction
                return None, SHORTER * length
            change = rest + np.einsum("ik,ikn->in", z, turn)
            before, changes = shift, np.array([UP_TO @ change / scale, UP_TO @ (moved - rates) / scale_of_ways])
            shift = length * float(np.abs(changes).max())
            at_noise = 0.5 * before < shift < 1.0  # it no longer halves: round-off is all that still changes
            if shift < CLOSE or at_noise:
                accelerations = now
                break
            accelerations = accelerations + change
            old = directions[:, self._slips]
            new = old + np.clip(z, -1.0, 1.0)[:, :, None] * np.stack([-old[:, :, 1], old[:, :, 0]], axis=2)
            directions[:, self._slips] = new / np.linalg.norm(new, axis=2, keepdims=True)
            rates = moved
        else:
            return None, SHORTER * length
        if slip[:, :, 0].min() < 0.0:  # it would have turned round before
            return None, SHORTER * length
        last, least = np.abs(SERIES[-1] @ accelerations), np.abs(SERIES[-2] @ accelerations)
        # The next term of the series, if terms go on to fall as they do.
        error = float((length * last * np.minimum(1.0, last / np.maximum(least, 1e-300)) / scale).max())
        factor = min(LONGER, SAFE * error ** (-1.0 / (COUNT + 1))) if error > 0.0 else LONGER
        if error > 1.0:
            return None, length * max(SHORTER, factor)
        every = np.concatenate([rates, accelerations, pushes.reshape(COUNT, -1)], axis=1)
        out = np.zeros((every.shape[1], COUNT + 1))
        out[:, 1:] = length * (THROUGH @ every).T / (POWERS + 1)
        out[count : 2 * count, 0] = start.ravel()
        way, twist = out[: 2 * count].reshape(2, *shape, COUNT + 1)
        push = out[2 * count :].reshape(*pushes.shape[1:], COUNT + 1)
        return Piece(self._state, length, way, twist, self._held, turns=True, push=push), factor * length
