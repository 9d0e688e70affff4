"""Numbers given as formulas in a scene file: ``"v0 * t - 0.5 * mu * g * t ** 2"``.

The grammar is arithmetic: numbers, names, ``+ - * / **``, parentheses and a few functions, all of real numbers.
Python's parser reads it, and it is evaluated node by node; everything else is refused, so that a file cannot run code,
and a value that is not finite is an error.
"""

from __future__ import annotations

import ast
import math
import operator
from collections.abc import Callable, Mapping
from typing import Any

from adapters.plain import one_line

#: Longest formula [characters].
LONGEST = 300
#: Functions and their numbers of arguments.
FUNCTIONS: Mapping[str, tuple[Callable[..., float], tuple[int, int]]] = {
    "sqrt": (math.sqrt, (1, 1)),
    "exp": (math.exp, (1, 1)),
    "log": (math.log, (1, 1)),
    "sin": (math.sin, (1, 1)),
    "cos": (math.cos, (1, 1)),
    "tan": (math.tan, (1, 1)),
    "asin": (math.asin, (1, 1)),
    "acos": (math.acos, (1, 1)),
    "atan": (math.atan, (1, 1)),
    "atan2": (math.atan2, (2, 2)),
    "hypot": (math.hypot, (1, 3)),
    "abs": (abs, (1, 1)),
    "min": (min, (2, 8)),
    "max": (max, (2, 8)),
}
_TWO: Mapping[type, Callable[[float, float], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
}
_ONE: Mapping[type, Callable[[float], float]] = {ast.UAdd: operator.pos, ast.USub: operator.neg}


class FormulaError(ValueError):
    """A formula is malformed, or has no finite value; one line."""


def value_of(formula: float | str, names: Mapping[str, float]) -> float:
    """Value of a number, or of a formula in ``names``.

    Raises
    ------
    FormulaError
        Naming what is no arithmetic, an unknown name, or why it has no finite value.
    """
    if not isinstance(formula, str):
        return float(formula)
    shown = repr(one_line(formula, 60))
    if len(formula) > LONGEST:
        raise FormulaError(f"{shown} is longer than {LONGEST} characters")
    try:
        found = _value(ast.parse(formula.strip(), mode="eval").body, names)
    except FormulaError as error:
        raise FormulaError(f"{shown}: {error}") from None
    except (SyntaxError, ValueError, RecursionError, MemoryError, OverflowError, ZeroDivisionError) as error:
        why = "is no formula" if isinstance(error, SyntaxError | RecursionError | MemoryError) else one_line(error)
        why = "its value is too large" if isinstance(error, OverflowError) else why
        raise FormulaError(f"{shown}: {why}") from None
    if not math.isfinite(found):
        raise FormulaError(f"{shown}: is {found}, not a finite number")
    return found


def _value(node: ast.expr, names: Mapping[str, float]) -> float:
    if isinstance(node, ast.Constant) and isinstance(node.value, int | float) and not isinstance(node.value, bool):
        return float(node.value)
    if isinstance(node, ast.Name):
        if node.id not in names:
            raise FormulaError(f"{one_line(node.id, 40)!r} is not one of {', '.join(sorted(names))}")
        return names[node.id]
    if isinstance(node, ast.UnaryOp) and type(node.op) in _ONE:
        return _ONE[type(node.op)](_value(node.operand, names))
    if isinstance(node, ast.BinOp) and type(node.op) in _TWO:
        found = _TWO[type(node.op)](_value(node.left, names), _value(node.right, names))
        if isinstance(found, complex):
            raise FormulaError("a root of a negative number")
        return float(found)
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and not node.keywords:
        if node.func.id not in FUNCTIONS:
            raise FormulaError(f"there is no function {one_line(node.func.id, 40)!r}, only {', '.join(FUNCTIONS)}")
        function, (least, most) = FUNCTIONS[node.func.id]
        if not least <= len(node.args) <= most:
            raise FormulaError(f"{node.func.id} takes {least if least == most else f'{least} to {most}'} numbers")
        return float(function(*(_value(part, names) for part in node.args)))
    raise FormulaError("a formula has only numbers, names, + - * / **, parentheses and functions")
