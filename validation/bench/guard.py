"""Whether the textbook step has become slower: its time over that of naive sweeps whose code never changes.

    python -m validation.bench.guard      under a minute; exits with 1 if a ratio is over 1.6 times the stored one

A time alone says little, because machines and their load differ. Both sides are timed alternately in one process, and
the median of the ratios is compared with that of guard.toml, which says how to renew it.
"""

from __future__ import annotations

import sys
import time
import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from adapters import registry
from adapters.stepping import step_count
from validation.bench.statistics import Spread, spread
from validation.bench.units import PILE_DT, prepared
from validation.cells import Slot

TABLE = Path(__file__).with_name("guard.toml")
#: Pairs of laps, one of each side: with so many, a few disturbed ones do not change the median.
ROUNDS = 15
#: Time after which a heap has fallen and lies still [s].
REST = 0.75
#: Friction coefficient of the naive sweeps, equal to that of the stack.
MU = 0.5

Array = NDArray[np.float64]


@numba.njit
def naive(sweeps: int, bodies: NDArray[np.uint64], arms: Array, impulse: Array, velocity: Array) -> None:
    """Gauss-Seidel sweeps as a textbook writes them; do not tune.

    Parameters
    ----------
    bodies
        Two of each point (p, 2), unsigned.
    arms
        Rows of the constraints (p, r, 2, f), of bodies with unit mass and moments. The first row of a point is normal.
    impulse, velocity
        (p, r) and (n, f), changed in place.
    """
    points, rows, _, freedoms = arms.shape
    for _ in range(sweeps):
        for p in range(points):
            for r in range(rows):
                speed, mass = 0.0, 0.0
                for side in range(2):
                    for f in range(freedoms):
                        speed += arms[p, r, side, f] * velocity[bodies[p, side], f]
                        mass += arms[p, r, side, f] ** 2
                old = impulse[p, r]
                new = old - speed / mass
                bound = MU * impulse[p, 0]
                new = max(new, 0.0) if r == 0 else min(max(new, -bound), bound)
                impulse[p, r] = new
                for side in range(2):
                    for f in range(freedoms):
                        velocity[bodies[p, side], f] += arms[p, r, side, f] * (new - old)


def sweeping(points: int, dimension: int, sweeps: int) -> Callable[[int], None]:
    """Return a function that sweeps ``points`` random contacts of a chain of bodies for a given number of steps."""
    rng, freedoms = np.random.default_rng(points), 3 * (dimension - 1)
    count = max(2, points // 2)
    first = np.arange(points) % (count - 1)
    bodies = np.stack([first, first + 1], 1).astype(np.uint64)
    arms = rng.normal(size=(points, dimension, 2, freedoms))
    start = rng.normal(size=(count, freedoms))

    def steps(number: int) -> None:
        for _ in range(number):
            naive(sweeps, bodies, arms, np.zeros((points, dimension)), start.copy())

    return steps


def ratio(step: Mapping[str, Any], sweeps: int) -> Spread:
    """CPU time of our step over that of the naive sweeps: median and interval over `ROUNDS`."""
    solver = registry.solver()
    params = tuple(sorted((name, float(value)) for name, value in step["params"].items()))
    profile = registry.profile_of(solver, "textbook") or ""
    engine, scene, settings, _ = prepared(
        Slot(step["scene"], params, step["dimension"], solver, profile, PILE_DT, sweeps)
    )
    simulation = engine.build(scene, PILE_DT, settings)
    simulation.advance(step_count(REST, PILE_DT))
    plain = sweeping(step["points"], step["dimension"], sweeps)
    plain(1)  # compiles
    found = []
    for _ in range(ROUNDS):
        laps = []
        for side in (simulation.advance, plain):
            start = time.process_time()
            side(step["steps"])
            laps.append(time.process_time() - start)
        found.append(laps[0] / laps[1])
    simulation.close()
    return spread(found)


def main(path: Path = TABLE) -> int:
    """Print one line per step in the table; return 1 if any is too slow, else 0."""
    data, slow = tomllib.loads(path.read_text(encoding="utf-8")), False
    for step in data["steps"]:
        found = ratio(step, data["sweeps"])
        is_slow = found.median > data["margin"] * step["ratio"]
        slow |= is_slow
        print(
            f"{step['title']:<30} {found.median:5.2f} [{found.low:.2f} {found.high:.2f}] times the naive sweeps, "
            f"kept {step['ratio']:g}: {'TOO SLOW' if is_slow else 'ok'}"
        )
    return int(slow)


if __name__ == "__main__":
    sys.exit(main())
