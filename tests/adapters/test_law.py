"""A law speaks of its own rows, at its profile's iterations or at those that are asked for."""

from dataclasses import replace

import pytest

from adapters.law import Deviation, exactly

SCENE, MEASURE = object(), object()


def law(scene, dt, measure):
    assert (scene, dt, measure) == (SCENE, 0.01, MEASURE)
    return 1.0, 0.1


def asked(scene, dt, measure, iterations):
    assert (scene, dt, measure) == (SCENE, 0.01, MEASURE)
    return float(iterations), 0.2


ONE = Deviation("toy", ("default", "tuned"), "stack", exactly("load[2]"), law, "because", "source", ("1.2", "2."))


def test_law_at_own_and_at_requested_iterations():
    both = replace(ONE, asked=asked)
    assert both.says(SCENE, 0.01, MEASURE) == (1.0, 0.1)
    assert both.says(SCENE, 0.01, MEASURE, 7) == (7.0, 0.2)
    assert ONE.says(SCENE, 0.01, MEASURE) == (1.0, 0.1)


def test_law_without_sweeps_silent_at_requested_iterations():
    assert ONE.says(SCENE, 0.01, MEASURE, 7) is None


ROW = {"engine": "toy", "version": "1.2.3", "profile": "tuned", "scene": "stack", "metric": "load[2]"}


def test_rows_covered_by_a_law():
    assert ONE.covers(**ROW)
    assert ONE.covers(**ROW | {"version": "2.0", "profile": "default"})
    assert replace(ONE, versions=()).covers(**ROW | {"version": "9"})


@pytest.mark.parametrize(
    "other",
    [{"engine": "toys"}, {"version": "1.3"}, {"profile": "one"}, {"scene": "stacks"}, {"metric": "load[3]"},
     {"metric": "load2"}],
    ids=str,
)  # fmt: skip
def test_rows_not_covered_by_a_law(other):
    assert not ONE.covers(**ROW | other)
