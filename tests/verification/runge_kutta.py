"""The classical fourth-order Runge-Kutta method, by which truths without a closed form are integrated."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

S = TypeVar("S")
#: A number, or an array of them.
Value = Any


def advance(rate: Callable[[Value], Value], state: Value, h: float) -> Value:
    """Return the state of ``state' = rate(state)`` after ``h``."""
    k1 = rate(state)
    k2 = rate(state + 0.5 * h * k1)
    k3 = rate(state + 0.5 * h * k2)
    k4 = rate(state + h * k3)
    return state + h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4)


def move(rate: Callable[[Value, Value], Value], state: tuple[Value, Value], h: float) -> tuple[Value, Value]:
    """Return the state (q, q') of ``q'' = rate(q, q')`` after ``h``."""
    q, v = state
    k1, l1 = v, rate(q, v)
    k2, l2 = v + 0.5 * h * l1, rate(q + 0.5 * h * k1, v + 0.5 * h * l1)
    k3, l3 = v + 0.5 * h * l2, rate(q + 0.5 * h * k2, v + 0.5 * h * l2)
    k4, l4 = v + h * l3, rate(q + h * k3, v + h * l3)
    return q + h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4), v + h / 6.0 * (l1 + 2.0 * (l2 + l3) + l4)


def event(after: Callable[[float], bool], length: float) -> float:
    """Return the first length up to ``length`` that is ``after`` an event, by halving to the last place."""
    low, high = 0.0, length
    while low < 0.5 * (low + high) < high:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if after(middle) else (middle, high)
    return high


def never(state: Any) -> float:
    """Above zero whatever the state: nothing happens."""
    return 1.0


def integrated(
    step: Callable[[S, float], S], state: S, time: float, h: float, until: Callable[[S], float] = never
) -> tuple[S, float]:
    """Return the state after ``time`` in steps of ``h``, or where ``until`` falls below zero before, and the time left.

    ``step`` advances a state by a length.
    """
    left = time
    while left > 0.0:
        length = min(h, left)
        ahead = step(state, length)
        if until(ahead) < 0.0:
            break
        state, left = ahead, left - length
    else:
        return state, 0.0
    length = event(lambda part: until(step(state, part)) < 0.0, length)
    return step(state, length), left - length
