"""How gaps of a step at impulse level are closed: as often as that helps, and not into others (E28)."""

import os
import subprocess
import sys

import pytest

# Functions of the driver are replaced, which they can be where they are plain ones.
SCRIPT = """
import sys
from types import SimpleNamespace
import numpy as np
from reference_solver.stepping import driver

overlaps = iter([float(each) for each in sys.argv[1:]])
called = []
sub = SimpleNamespace(clock=np.zeros(64), journal=None)
island = SimpleNamespace(bodies=SimpleNamespace(pose=None, twist=None), sub=sub)
def say(name, answer=None):
    return lambda *_: (called.append(name), answer)[1]
driver.find_loaded, driver.keep_state, driver.keep_places = say("found", 1), say("kept"), say("kept")
driver.deepest_overlap = lambda _: next(overlaps)
driver.close_gaps, driver.put_back = say("closed", True), say("put back")
driver.misses_end, driver.solve_end = say("asked", True), say("solved")
driver.enter_settled, driver.end_settling = say("entered"), say("ended")
done = driver.settle(island), called.count("closed"), called.count("put back")
print(*done, called[-3:] == ["solved", "entered", "ended"])
"""

PUT_BACK = """
from types import SimpleNamespace
import numpy as np
from reference_solver import Body, Box, HalfSpace, Model, Settings, Simulation
from reference_solver.planar import located
from reference_solver.stepping.driver import keep_places

floor = Body(HalfSpace((0.0, 1.0)), motion="fixed")
box = Body(Box((0.1, 0.2)), 1.0, 0.02, (0.3, 1.0, 0.4), (0.5, 0.0, 3.0))
simulation = Simulation(Model(2, [floor, box], (0.0, -9.81), 0.0, 0.5), Settings.reference(1.0 / 60.0))
world = simulation._world
island = SimpleNamespace(bodies=world._bodies, sub=world._sub)
before = world._bodies.pose.copy()
keep_places(island)
world._bodies.pose[1] += 1e-3
located.put_back(island)
print(np.array_equal(world._bodies.pose, before))
"""

#: Of a box on a floor, whose smallest half width is .1 m, near the origin and a thousand kilometres off.
CLOSED = """
from reference_solver import Body, Box, HalfSpace, Model, Settings, Simulation
from reference_solver.planar import impact
from reference_solver.spatial import touching

for far in (0.0, 1e6):
    box = Body(Box((0.1, 0.2)), 1.0, 0.02, (far, 0.2, 0.0))
    floor = Body(HalfSpace((0.0, 1.0)), motion="fixed")
    simulation = Simulation(Model(2, [floor, box], (0.0, -9.81), 0.0, 0.5), Settings.reference(1.0 / 60.0))
    simulation.advance(1)
    print(impact.closed_gap(simulation._world._bodies, simulation._world._rows, 0))
    upright = (1.0, 0.0, 0.0, 0.0)
    box = Body(Box((0.1, 0.3, 0.2)), 1.0, (0.1,) * 3, (far, 0.0, 0.2, *upright))
    floor = Body(HalfSpace((0.0, 0.0, 1.0)), pose=(0.0, 0.0, 0.0, *upright), motion="fixed")
    simulation = Simulation(Model(3, [floor, box], (0.0, 0.0, -9.81), 0.0, 0.5), Settings.reference(1.0 / 60.0))
    simulation.advance(1)
    print(touching.closed_gap(simulation._world._bodies, simulation._world._manifolds, 0, 0))
"""


def said_by(script, *arguments):
    done = subprocess.run(
        [sys.executable, "-c", script, *map(str, arguments)],
        capture_output=True, text=True, env=os.environ | {"NUMBA_DISABLE_JIT": "1"},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout.split()


@pytest.mark.few(3)
@pytest.mark.parametrize(
    ("overlaps", "closed", "put_back"),
    [
        ((0.0, 5e-6), 1, 0),  # no deeper than may be
        ((0.0, 5e-4, 5e-6), 2, 0),  # undone by closing once more
        ((0.0, 1e-4, 2e-4), 2, 1),  # deeper each time
        ((3e-4, 1e-4, 1e-4), 2, 0),  # no deeper than before any gap was closed
        ((0.0, 1e-3, 5e-4, 2e-4, 1e-4), 4, 1),  # less each time, and not in time
        ((0.0, 1e-3, 5e-4, 2e-4, 5e-6), 4, 0),
    ],
)
def test_gaps_are_closed_while_that_helps_and_bodies_stay_where_it_does_not(overlaps, closed, put_back):
    """Overlaps as shares of a half width: at the start, and each time that gaps have been closed."""
    assert said_by(SCRIPT, *overlaps) == ["True", str(closed), str(put_back), "True"]


def test_bodies_that_are_put_back_are_where_they_were():
    assert said_by(PUT_BACK) == ["True"]


def test_a_gap_of_a_tenth_of_what_touches_is_none_or_one_of_a_place_s_last_places():
    """1e-10 of the smaller half width, or 2e-15 of where it is, be that more: a box has its corner at 1e6 - .1 m."""
    near, far = [float(each) for each in said_by(CLOSED)[:2]], [float(each) for each in said_by(CLOSED)[2:]]
    assert near == pytest.approx([1e-11, 1e-11], rel=1e-9)
    assert far == pytest.approx([2e-9, 2e-9], rel=1e-3)
