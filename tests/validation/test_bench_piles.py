"""Piles on the clock: both profiles go on from the same state, and rows, ratios and exponents are those of the laps."""

import numpy as np
import pytest
from click.testing import CliRunner

from reports.command import main
from reports.command import piles as shown
from validation.bench import piles
from validation.bench.piles import Lap, exponents, rows


class FakeClock:
    """CPU time that only a step spends: events cost thrice, and all as the number of bodies."""

    now = 0.0


@pytest.fixture
def clocked(monkeypatch):
    """Simulations that note from where they go on, and let a clock of their own run."""
    begun = []
    clock = FakeClock()

    class Simulation:
        def __init__(self, model, settings):
            self.model, self.cost = model, 3.0 if settings.scheme == "located" else 1.0
            self.pose = np.array([body.pose for body in model.bodies])
            self.twist = np.array([body.twist for body in model.bodies])
            begun.append((settings.scheme, self.pose.tobytes() + self.twist.tobytes()))

        def advance(self, steps):
            free = [k for k, body in enumerate(self.model.bodies) if body.motion == "free"]
            self.pose[free, 0] += 1e-3 * steps
            clock.now += 1e-6 * self.cost * steps * len(free) ** 1.5

    monkeypatch.setattr(piles, "Simulation", Simulation)
    monkeypatch.setattr(piles.time, "process_time", lambda: clock.now)
    monkeypatch.setattr(piles.gc, "collect", lambda: 0)  # whatever other tests have left: a second each time
    return begun


@pytest.mark.parametrize("kind", piles.KINDS)
def test_both_profiles_are_clocked_from_the_same_state(clocked, kind):
    found = list(piles.laps(kind, 20))
    assert len(found) == len(piles.SEEDS) * len(piles.INSTANTS)
    states = {}
    for scheme, state in clocked[2:]:
        states.setdefault(state, set()).add(scheme)
    assert sum(schemes == {"located", "fixed"} for schemes in states.values()) >= len(found)
    assert all(lap.ratio == pytest.approx(3.0) for lap in found)


def test_no_larger_piles_after_the_time_limit(clocked):
    assert {lap.bodies for lap in piles.laps("discs", 80)} == {20, 40, 80}
    assert {lap.bodies for lap in piles.laps("discs", 80, patience=1e-3)} == {20}


def test_the_order_of_both_is_drawn(clocked):
    list(piles.laps("discs", 40))
    order = "".join(scheme[0] for scheme, _ in clocked)
    assert "lf" in order[3:] and "fl" in order[3:]


def test_rows_and_exponents_are_those_of_the_laps():
    found = [Lap("discs", n, 4e-6 * n**1.2, 1e-6 * n**1.1) for n in (20, 40, 80) for _ in range(3)]
    told = rows(found)
    assert [row.bodies for row in told] == [20, 40, 80]
    assert told[0].ratio.median == pytest.approx(4.0 * 20**0.1)
    located, fixed = exponents(told)["discs"]
    assert located.exponent == pytest.approx(1.2) and fixed.exponent == pytest.approx(1.1)
    assert exponents(rows([lap for lap in found if lap.bodies < 80]))["discs"] == (None, None)


def test_the_command_shows_cost_ratio_and_exponent(monkeypatch):
    made = {"discs": [Lap("discs", n, 3e-4 * n, 1e-4 * n) for n in (20, 40, 80)]}
    monkeypatch.setattr(shown, "KINDS", made)
    monkeypatch.setattr(shown, "laps", lambda kind, most, seed: made[kind])
    result = CliRunner().invoke(main, ["bench", "--piles", "80"])
    assert result.exit_code == 0
    assert "3 [3, 3]" in result.stderr and "1.00 +- 0.00" in result.stderr and "20 to 80" in result.stderr
    assert max(len(line) for line in result.stderr.splitlines()) <= 80


def test_a_real_lap_costs_something():
    lap = next(iter(piles.laps("discs", 20)))
    assert lap.reference > 0.0 and lap.fixed_step > 0.0 and lap.bodies == 20


@pytest.mark.parametrize("kind", piles.KINDS)
def test_piles_by_kind_dimension_size_and_seed(clocked, monkeypatch, kind):
    """Warmed with one before the clock runs; then each seed at each size, from the instants of its fall."""
    asked = []
    made = {2: piles.planar_pile, 3: piles.spatial_pile}
    for dimension, name in ((2, "planar_pile"), (3, "spatial_pile")):
        monkeypatch.setattr(piles, name, lambda *given, d=dimension: asked.append((d, *given)) or made[d](*given))
    found = list(piles.laps(kind, 40))
    dimension, share = piles.KINDS[kind]
    assert asked == [(dimension, piles.SEEDS[0], piles.LEAST, share),
                     *[(dimension, seed, n, share) for n in (20, 40) for seed in piles.SEEDS]]  # fmt: skip
    assert [(lap.kind, lap.bodies) for lap in found] == [
        (kind, n) for n in (20, 40) for _ in piles.SEEDS for _ in piles.INSTANTS
    ]
