"""The step that is read, `plain_step`, and `Settings.classical` move bodies alike."""

import re
from pathlib import Path

import numpy as np
import pytest

from reference_solver import Settings
from reference_solver.textbook2.columns import (
    ARM_A,
    ARM_B,
    FEATURE,
    FRICTION,
    GAP,
    INVERSE_INERTIA,
    INVERSE_MASS,
    LOAD,
    NX,
    NY,
    A,
    B,
)
from tests.reference_solver.textbook2 import plain_step

G = 9.81


class Both:
    """A world of the solver, and the plain step, which takes only its contacts."""

    def __init__(self, build, bodies, restitution, friction):
        self.settings = Settings.classical(build.dt)
        self.simulation = build.simulation(bodies, self.settings, (0.0, -G), restitution, friction)
        state = self.simulation._world._bodies
        inverse = state.real[:, [INVERSE_MASS, INVERSE_MASS, INVERSE_INERTIA]]
        self.plain = plain_step.World(state.pose.copy(), state.twist.copy(), state.real[:, LOAD : LOAD + 3], inverse)
        self.restitution = restitution

    def step(self):
        """Make a step of either; return contacts and the largest difference of poses and twists."""
        self.simulation.advance(1)
        state, rows = self.simulation._world._bodies, self.simulation._world._rows
        contacts = [
            plain_step.Contact(
                a=names[A],
                b=names[B],
                feature=names[FEATURE],
                normal=row[[NX, NY]],
                lever_a=row[ARM_A : ARM_A + 2],
                lever_b=row[ARM_B : ARM_B + 2],
                gap=row[GAP],
                restitution=self.restitution,
                friction=row[FRICTION],
            )
            for names, row in zip(rows.integer[: rows.counts[0]], rows.real[: rows.counts[0]].copy(), strict=True)
        ]
        plain_step.step(self.plain, contacts, self.settings.dt, self.settings.slop)
        return contacts, max(np.abs(self.plain.pose - state.pose).max(), np.abs(self.plain.twist - state.twist).max())


def pile(build):
    """Boxes in a column that overlaps the floor, a disc that rolls into it, and a box that falls on it."""
    return [
        build.floor(),
        build.box(0.0, 0.495, (0.3, 0.0, 0.0)),
        build.box(0.1, 1.495, mass=3.0),
        build.disc(1.1, 0.5, (-1.0, 0.0, 2.0)),
        build.box(0.8, 2.2, (0.0, 0.0, 1.0), angle=0.3),
    ]


def steps(build, restitution):
    """Contacts and difference of each step of a second."""
    both = Both(build, pile(build), restitution, 0.4)
    return (both.step() for _ in range(240))


#: Either moves by itself. The two differ in the order of sums: in a step by a hundred units in the last place of 1 m/s,
#: ten sweeps of a dozen operations that round.
ROUND_OFF = 240 * 2e-14


@pytest.mark.parametrize("restitution", [0.0, 0.5])
def test_plain_step_and_fast_step(build, restitution):
    found, differences = zip(*steps(build, restitution), strict=True)
    contacts = [c for each in found for c in each]
    assert max(differences) < ROUND_OFF
    assert sum(c.is_impact for c in contacts) > 20 and sum(c.push_target > 0.0 for c in contacts) > 100
    assert sum((c.target > 0.0) if restitution else (c.target < 0.0) for c in contacts) > 100


def after(change):
    """The preparation of a contact, and a change of what it found."""

    def planted(prepare):
        def changed(world, c, *numbers):
            prepare(world, c, *numbers)
            change(c)

        return changed

    return planted


def change_clamped(_):
    def solve(world, twist, c, direction, target, p, least=0.0, most=np.inf):
        missing = target - direction @ plain_step.relative_velocity(twist, c)
        change = missing / plain_step.inverse_effective_mass(world, c, direction)
        change = min(max(change, least), most)
        plain_step.apply(world, twist, c, change * direction)
        return p + change

    return solve


def sampled_late(prepare):
    def late(world, c, dt, slop, beta):
        before = world.twist.copy()
        world.twist += dt * world.acceleration
        prepare(world, c, dt, slop, beta)
        world.twist[:] = before

    return late


@pytest.mark.parametrize(
    ("name", "planted"),
    [
        pytest.param("sweep", lambda sweep: lambda *most, backwards: sweep(*most, backwards=False), id="one order"),
        pytest.param("solve", change_clamped, id="each change clamped, and not the sum"),
        pytest.param("prepare", sampled_late, id="approach sampled after loads"),
        pytest.param("prepare", after(lambda c: vars(c).update(p_n=0.0, p_t=0.0)), id="cold start"),
        pytest.param("prepare", after(lambda c: vars(c).update(is_impact=False)), id="impulses of impacts remembered"),
        pytest.param("prepare", after(lambda c: vars(c).update(friction=0.41)), id="more friction"),
        pytest.param("prepare", after(lambda c: vars(c).update(push_target=max(c.push_target, 0.0))), id="no closing"),
        pytest.param("prepare", after(lambda c: vars(c).update(target=max(c.target, 0.0))), id="gaps stay"),
        pytest.param("warm_start", lambda _: lambda world, c: None, id="remembered impulses not applied"),
        pytest.param("velocity", lambda _: lambda twist, r: twist[:2], id="no turning"),
    ],
)
def test_faults_of_a_step(build, monkeypatch, name, planted):
    monkeypatch.setattr(plain_step, name, planted(getattr(plain_step, name)))
    differences = (off for restitution in (0.0, 0.5) for _, off in steps(build, restitution))
    assert any(off > 1e6 * ROUND_OFF for off in differences)


def test_sweeps_by_hand():
    """The table of two sweeps below E10, and where they lead; with each change clamped the box would jump."""
    page = (Path(__file__).parents[3] / "docs" / "solver" / "step.md").read_text(encoding="utf-8").replace("−", "-")
    told = [list(map(float, row.split(" | "))) for row in re.findall(r"^\| \d, \w+ \| (.*) \|$", page, re.MULTILINE)]
    world = plain_step.World(np.zeros((2, 3)), np.zeros((2, 3)), np.zeros((2, 3)), np.zeros((2, 3)))
    world.twist[1, 1], world.inverse_mass[1] = -1.0, (1.0, 1.0, 1.0 / 0.75)
    up, levers = np.array([0.0, 1.0]), ((-0.5, -0.7), (0.5, -0.7))
    corners = [plain_step.Contact(0, 1, k, up, np.array(r), np.array(r), 0.0, 0.0, 0.0) for k, r in enumerate(levers)]
    for c in corners:
        plain_step.prepare(world, c, dt=1.0, slop=0.0, beta=0.2)
    found = []
    for c in 2 * corners:
        before, p = up @ plain_step.relative_velocity(world.twist, c), c.p_n
        plain_step.sweep(world, np.zeros((2, 3)), [c], backwards=False)
        found.append([before, c.p_n - p, c.p_n, *world.twist[1, 1:]])
    assert np.abs(np.subtract(told, found)).max() < 1e-14 and len(told) == 4
    clamped = sum(max(change, 0.0) for _, change, *_ in found[:2])
    assert clamped == 1.125 and found[2][1] < 0.0
    for _ in range(30):
        plain_step.sweep(world, np.zeros((2, 3)), corners, backwards=False)
    assert [c.p_n for c in corners] == pytest.approx([0.5, 0.5], abs=1e-14)
