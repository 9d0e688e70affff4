"""What checks measure within their limits moves bodies all the same: how far it does at most."""

from __future__ import annotations

import numpy as np

from reference_solver.certificate.audit.run import Indices, Run
from reference_solver.model import Array


class Unexplained:
    """Changes of velocity and ways of bodies that no law explains, row by row.

    Parameters
    ----------
    run
        Whose rows these are.
    """

    def __init__(self, run: Run) -> None:
        self._run, count = run, len(run.pieces.body)
        self._speed, self._way = np.zeros(count), np.zeros(count)

    def gained(self, speed: Array) -> None:
        """Add what any point of the bodies of all rows is faster by (m,), at most [m/s]."""
        self._speed += speed

    def went(self, way: Array, rows: Indices | slice = slice(None)) -> None:
        """Add ways (s,) by which any point of the bodies of rows (s,) is off [m]; no row is given twice."""
        self._way[rows] += way

    def pushed(self, impulse: Array) -> None:
        """Add impulses (c,) at contacts [N s]."""
        run = self._run
        arm = np.where(run.free, run.reach, 0.0)
        self._add(self._speed, impulse, 1.0 / run.mass + arm**2 / run.moments.min(axis=1))

    def met(self, way: Array) -> None:
        """Add ways (c,) from where the bodies of contacts touch [m]."""
        self._add(self._way, way, np.ones(len(self._run.free)))

    def _add(self, total: Array, value: Array, gain: Array) -> None:
        """Add values (c,) of contacts to both their rows, times a number of the body (n,)."""
        run, pieces = self._run, self._run.pieces
        for row, body in zip(run.side, (pieces.body_a, pieces.body_b), strict=True):
            known = (row >= 0) & run.free[body] & np.isfinite(value)
            np.add.at(total, row[known], (gain[body] * value)[known])

    def distances(self, t: Array) -> Array:
        """Return how far (s,) that moves any point of a free body until times t (s,) [m]."""
        pieces, found = self._run.pieces, np.zeros(len(t))
        begin = pieces.begin[self._run.owner]
        for i in np.flatnonzero(self._run.free):
            rows = np.flatnonzero(pieces.body == i)
            rows = rows[np.argsort(begin[rows], kind="stable")]
            speed, since, way = (
                np.append(0.0, np.cumsum(each[rows])) for each in (self._speed, self._speed * begin, self._way)
            )
            k = np.searchsorted(begin[rows], t, side="left")
            found = np.maximum(found, way[k] + speed[k] * t - since[k])
        return found
