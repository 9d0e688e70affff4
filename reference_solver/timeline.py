"""Where the time of a run goes: the stages of the step, each with the time it took.

    step:  detect | prepare | accelerate | warm_start | solve_velocities | move | correct_positions | remember
                  ^         ^            ^            a clock is read here, in compiled code

The timed step is made from the source of the real one, by reading the clock after every call it makes: it cannot
fall behind the real step, and the states it reaches are the same to the last bit.
"""

from __future__ import annotations

import ast
import ctypes
import inspect
import textwrap
from functools import cache
from importlib import import_module
from typing import Any

import numba
import numpy as np

from reference_solver.compilation import KERNEL, OPTIONS
from reference_solver.simulation import WORLDS, Simulation

_MONOTONIC = 1  # CLOCK_MONOTONIC, <time.h>
#: Where a world keeps what its step calls by another name.
_KEPT_AS = {"room": "_manifolds", "tally": "tally"}
_clock_gettime = ctypes.CDLL(None).clock_gettime
_clock_gettime.argtypes, _clock_gettime.restype = [ctypes.c_int, ctypes.c_void_p], ctypes.c_int


@numba.njit
def lap(clock: Any, spent: Any, stage: int) -> None:
    """Charge the time since the last lap to ``stage`` [ns]; ``clock``: seconds, nanoseconds, last lap."""
    _clock_gettime(_MONOTONIC, clock.ctypes)
    now = clock[0] * 1_000_000_000 + clock[1]
    spent[stage] += now - clock[2]
    clock[2] = now


class _Laps(ast.NodeTransformer):
    """Adds a lap after every statement of the step that calls a kernel, and inside a condition that does."""

    def __init__(self, kernels: set[str]) -> None:
        self.kernels, self.stages = kernels, ["rest"]

    def _lap(self, node: ast.AST) -> list[ast.stmt]:
        called = [n.func.id for n in ast.walk(node) if isinstance(n, ast.Call) and isinstance(n.func, ast.Name)]
        called = [name for name in called if name in self.kernels]
        if not called:
            return []
        if called[0] not in self.stages:
            self.stages.append(called[0])
        return ast.parse(f"lap(clock, spent, {self.stages.index(called[0])})").body

    def visit_Expr(self, node: ast.Expr) -> Any:
        return [node, *self._lap(node)]

    def visit_Assign(self, node: ast.Assign) -> Any:
        return [node, *self._lap(node)]

    def visit_If(self, node: ast.If) -> Any:
        after = self._lap(node.test)
        self.generic_visit(node)
        node.body = [*after, *node.body]
        return [node, *after]


@cache
def _timed_loop(dimension: int) -> tuple[Any, list[str], list[str]]:
    """Compiled loop over the step with laps, the names of its arguments, and of its stages."""
    module = import_module(WORLDS[dimension] + ".step")
    plain = getattr(module.step, "py_func", module.step)
    tree = ast.parse(textwrap.dedent(inspect.getsource(plain)))
    function = tree.body[0]
    assert isinstance(function, ast.FunctionDef)
    function.decorator_list, function.returns = [], None
    kernels = {name for name, value in vars(module).items() if callable(value) and name.islower()}
    laps = _Laps(kernels)
    function.body = [s for statement in function.body for s in _as_list(laps.visit(statement))]
    function.args.args += [ast.arg("clock"), ast.arg("spent")]
    scope = {**vars(module), "lap": lap}
    exec(compile(ast.fix_missing_locations(tree), f"<{module.__name__} with laps>", "exec"), scope)
    step = numba.njit(scope["step"], **OPTIONS, **KERNEL)

    @numba.njit
    def loop(arguments: Any, clock: Any, spent: Any) -> bool:
        lap(clock, spent[0], 0)
        spent[0, 0] = 0  # the first lap has no beginning
        for k in range(len(spent)):
            if not step(*arguments, clock, spent[k]):
                return False
            lap(clock, spent[k], 0)
        return True

    return loop, [argument.arg for argument in function.args.args[:-2]], laps.stages


def _as_list(found: Any) -> list[ast.stmt]:
    return found if isinstance(found, list) else [found]


def timeline(simulation: Simulation, steps: int, warm_up: int = 1) -> dict[str, float]:
    """Median time of each stage over ``steps`` steps of ``simulation`` [s], in the order of the step.

    ``warm_up`` steps, at least one, run before the clock does. Reading the clock costs about 25 ns a stage, which
    is in the figures; a median does not see the steps that something else on the machine interrupted.

    Raises
    ------
    RuntimeError
        If an array became too small during the timed steps: warm up longer.
    """
    simulation.advance(max(1, warm_up))
    world: Any = simulation._world
    loop, names, stages = _timed_loop(simulation.model.dimension)
    arguments = tuple(getattr(world, _KEPT_AS.get(name, "_" + name)) for name in names)
    clock, spent = np.zeros(3, np.int64), np.zeros((steps, len(stages)), np.int64)
    if not loop(arguments, clock, spent):
        raise RuntimeError("timeline: an array became too small, warm up longer")
    return dict(zip(stages, (np.median(spent, axis=0) * 1e-9).tolist(), strict=True))
