"""Bodies that closing gaps moved in vain are put back with all that goes with a pose (E28)."""

import os
import subprocess
import sys

# Kernels are asked one by one where they are plain functions.
SCRIPT = """
from types import SimpleNamespace
import numpy as np
from reference_solver import Body, Box, HalfSpace, Model, Settings, Simulation
from reference_solver.spatial import located, midpoint
from reference_solver.spatial.motion import spin_of
from reference_solver.spatial.vector import row
from reference_solver.stepping.driver import keep_places

half = (0.1, 0.2, 0.4)
moments = tuple((sum(h * h for h in half) - h * h) / 3.0 for h in half)
turn = np.array([0.9, 0.3, 0.2, 0.1]) / np.sqrt(0.95)
floor = Body(HalfSpace((0.0, 0.0, 1.0)), motion="fixed", pose=(0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0))
box = Body(Box(half), 1.0, moments, (0.0, 0.0, 1.0, *turn), (0.5, 0.0, 0.0, 3.0, 4.0, 5.0))
simulation = Simulation(Model(3, [floor, box], (0.0, 0.0, -9.81), 0.0, 0.5), Settings.reference(1.0 / 60.0))
world = simulation._world
bodies, island = world._bodies, SimpleNamespace(bodies=world._bodies, sub=world._sub)
names = ("pose", "twist", "inverse_inertia")
before = {name: np.array(bodies[name][1]) for name in names}
keep_places(island)
way = np.zeros((2, 6))
way[1] = 1e-3, 0.0, -1e-3, 1e-2, -2e-2, 1e-2
midpoint.displace(bodies, way)
bodies.twist[1, 3:] = spin_of(bodies, 1, row(bodies.angular_momentum, 1, 0))  # as closing gaps leaves it
moved = {name: np.abs(bodies[name][1] - before[name]).max() for name in names}
located.put_back(island)
for name in names:
    off = np.abs(bodies[name][1] - before[name]).max()
    print(name, moved[name] > 1e-3, off <= 1e-14 * np.abs(before[name]).max())
"""


def test_a_body_of_unequal_moments_that_is_put_back_has_the_spin_and_the_inertia_that_it_had():
    """It kept the spin that its angular momentum had about the axes it was turned to, 2e-4 of it."""
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT], capture_output=True, text=True, env=os.environ | {"NUMBA_DISABLE_JIT": "1"}
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines() == ["pose True True", "twist True True", "inverse_inertia True True"]
