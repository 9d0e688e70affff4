"""Engines in numbers: every property comes from a kept table, and says what that table says."""

import pytest

from adapters import registry
from adapters.engine_folder import unset_of
from reports import numbers, readings
from validation.settings import kept_numbers
from validation.settings.kept_numbers import known_of

ENGINES = [name for name in registry.names() if registry.adapter(name) is not None]


@pytest.mark.parametrize("engine", ENGINES)
def test_documented_words_where_the_kept_number_agrees(engine):
    told, kept = numbers.of_engine(engine), known_of(engine)
    assert set(told) == {key for group in numbers.COLUMNS.values() for key in group}
    for key, what in numbers.UNSET.items():
        rows = [row for row in unset_of(engine) if row.what.startswith(what)]
        assert bool(told[key]) == bool(rows)
        if rows and (rows[0].what not in kept or rows[0].agrees(kept[rows[0].what])):
            assert told[key] == rows[0].documented


def test_kept_number_that_differs_from_the_documented_one(monkeypatch):
    def threshold(value):
        monkeypatch.setattr(numbers, "known_of", lambda engine: {"no rebound below [m/s]": value})
        return numbers.of_engine("bullet")["threshold"]

    documented = "0.2: restitutionVelocityThreshold"
    assert threshold(0.2) == documented and threshold(0.31) == f"0.31, differs from the documented {documented}"


def test_cones_by_heading(monkeypatch):
    assert numbers.of_engine("chipmunk")["cone"] == ""  # a plane has one heading

    def cone(*shares):
        kept = {kept_numbers.FRICTION.format(h): x for h, x in zip(kept_numbers.HEADINGS, shares, strict=True)}
        monkeypatch.setattr(numbers, "known_of", lambda engine: kept)
        return numbers.of_engine("bullet")["cone"].partition(":")[0]

    assert cone(1.0, 1.001, 0.999) == "round" and cone(1.11, 0.76, 0.7) == "pyramidal"
    assert cone(1.0, 1.2, 1.41) == "a box" and cone(1.0, 1.2, 1.1) == "not round"


@pytest.mark.parametrize(
    "engine",
    [
        pytest.param(each, marks=pytest.mark.optional(each))
        for each in ENGINES
        if registry.facts(each).profile("shipped")
    ],
)
def test_kept_numbers_of_the_installed_release(engine):
    """A few are measured again; all by `crosscheck describe ENGINE --keep`."""
    kept = known_of(engine)
    rows = [row for row in unset_of(engine) if row.measure is not None]
    assert {row.what for row in rows} <= set(kept) and kept_numbers.AGAIN in kept
    for row in rows[:2]:
        assert float(row.measure()) == pytest.approx(kept[row.what], rel=1e-5, abs=1e-12)


def test_strongest_and_weakest_group():
    told = numbers.of_engine("mujoco")
    for end in ("strongest", "weakest"):
        assert told[end]
    passed, judged = told["weakest"].rpartition("(")[2].rstrip(")").split(" of ")
    assert int(passed) < int(judged)


def test_force_call_among_the_readings():
    for engine in readings.engines():
        told, calls = numbers.of_engine(engine)["force_call"], readings.told(engine)["readings"]
        assert told in ("", "none is right") or any(told.startswith(each["call"]) for each in calls)
    assert numbers.of_engine("box2d3")["force_call"] == "none is right"  # its only call reads 0
    assert numbers.of_engine("bullet")["force_call"].startswith("getContactPoints(): ")
