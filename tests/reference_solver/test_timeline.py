"""The timed step is the real step with a clock in it."""

import ast
import inspect
import textwrap

import numpy as np
import pytest

from reference_solver.planar import step as planar
from reference_solver.settings import Settings
from reference_solver.spatial import step as spatial
from reference_solver.timeline import timeline
from tests.verification.space import GRAVITY, SPACES


def column(dimension):
    """Two boxes on a floor."""
    space = SPACES[dimension - 2]
    return space.simulation(space.column([1.0, 1.0]), Settings.classical(1 / 240), GRAVITY, 0.0, 0.5)


@pytest.mark.long
@pytest.mark.parametrize("dimension", [2, 3])
def test_the_timed_steps_reach_the_same_bits(dimension):
    timed, plain = column(dimension), column(dimension)
    stages = timeline(timed, 30, warm_up=10)
    plain.advance(40)
    assert np.array_equal(timed.pose, plain.pose) and np.array_equal(timed.twist, plain.twist)
    assert stages["detect"] > 0.0 and stages["solve_velocities"] > 0.0
    assert all(seconds < 1.0 for seconds in stages.values())


@pytest.mark.long
@pytest.mark.parametrize("module", [planar, spatial])
def test_every_call_of_the_step_is_a_stage_in_its_order(module):
    dimension = 2 if module is planar else 3
    step = getattr(module.step, "py_func", module.step)
    tree = ast.parse(textwrap.dedent(inspect.getsource(step)))
    calls = [n for n in ast.walk(tree) if isinstance(n, ast.Call) and isinstance(n.func, ast.Name)]
    called = {n.func.id for n in calls if n.func.id not in ("inner_kernel", "int", "len")}
    assert set(timeline(column(dimension), 2)) == called | {"rest"}
