"""Engines in numbers: every property comes from a kept table, and says what that table says."""

import pytest

from adapters import registry
from adapters.engine_folder import unset_of
from reports import numbers, readings

ENGINES = [name for name in registry.names() if registry.adapter(name) is not None]


@pytest.mark.parametrize("engine", ENGINES)
def test_documented_properties_without_a_measurement(engine):
    told = numbers.of_engine(engine)
    assert set(told) == {key for group in numbers.COLUMNS.values() for key in group}
    for key, what in numbers.UNSET.items():
        rows = [row.documented for row in unset_of(engine) if row.what.startswith(what)]
        assert told[key] == (rows[0] if rows else "")


def test_measured_number_that_differs_from_the_documented_one():
    row = {"what": "no rebound below [m/s]", "documented": "0.2: a setting", "measured": 0.31, "value": 0.2}
    assert numbers.of_engine("bullet", [row | {"agrees": False}])["threshold"] == "0.31, differs"
    row |= {"measured": 0.2}
    assert numbers.of_engine("bullet", [row | {"agrees": True}])["threshold"] == "0.2: a setting"


def test_cones_by_headings_of_the_published_report():
    assert numbers.of_engine("mujoco")["cone"].startswith("pyramidal: ")
    assert numbers.of_engine("bullet")["cone"].startswith("round: ")
    assert numbers.of_engine("chipmunk")["cone"] == ""  # a plane has one heading


def test_strongest_and_weakest_group():
    told = numbers.of_engine("mujoco")
    for end in ("strongest", "weakest"):
        assert told[end]
    passed, judged = told["weakest"].rpartition("(")[2].rstrip(")").split(" of ")
    assert int(passed) < int(judged)


def test_force_call_among_the_readings():
    for engine in readings.engines():
        told = numbers.of_engine(engine)["force_call"]
        assert not told or any(told.startswith(each["call"]) for each in readings.told(engine)["readings"])
    assert numbers.of_engine("box2d3")["force_call"] == ""  # its only call reads 0
    assert numbers.of_engine("bullet")["force_call"].startswith("getContactPoints(): ")
