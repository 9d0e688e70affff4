"""Nulls: three motions that need no engine, and the skill that errors have against them."""

import math
from dataclasses import replace

import numpy as np
import pytest

from adapters.scene import Body, Disc, HalfSpace, Pair, Scene
from reference_solver.geometry import rotation
from validation.catalogue import CATALOGUE
from validation.cells import Slot
from validation.judging.rows import rows_of
from validation.questions import nulls
from validation.questions.nulls import (
    NO_ENGINE,
    NULLS,
    Null,
    did_nothing,
    free_flight,
    null_rows,
    nulls_of,
    perfectly_inelastic,
    skill,
    skill_of,
    with_skill,
)
from validation.running.execution import execute

DT = 1 / 240


@pytest.fixture(autouse=True)
def nothing_remembered():
    """What was measured of nulls before is measured anew."""
    nulls._measured.cache_clear()


def scene_of(*bodies, gravity=(0.0, 0.0), duration=1.0):
    return Scene("toy", 1, 2, bodies, (Pair(),), gravity, duration)


def disc(name, x, v=0.0, mass=1.0, y=0.0, spin=0.0, force=()):
    return Body(name, Disc(0.5), mass, 0.125 * mass, (x, y, 0.0), (v, 0.0, spin), force=force)


def test_free_flight_follows_its_loads_to_the_digit():
    ball = disc("ball", 1.0, 2.0, mass=4.0, spin=3.0, force=(8.0, 0.0))
    found = free_flight(scene_of(ball, gravity=(0.0, -10.0)), DT)
    assert found.t[-1] == pytest.approx(1.0)
    assert found.pose[-1, 0] == pytest.approx([1.0 + 2.0 + 1.0, -5.0, 3.0])
    assert found.twist[-1, 0] == pytest.approx([4.0, -10.0, 3.0])


@pytest.mark.parametrize("null", NULLS.values())
def test_a_null_is_a_run_like_any_other(null):
    found = null(scene_of(disc("ball", 1.0, 2.0), duration=10.0 * DT), DT)
    assert found.t.dtype == float and found.t == pytest.approx(np.arange(11) * DT)
    assert (found.dt, found.finish, found.contacts) == (DT, "completed", None)
    assert found.pose.shape == found.twist.shape == (11, 1, 3)


def test_turns_of_bodies_from_any_attitude():
    """Turned by a third about (1, 1, 1) at the start, then by half a radian about z: products of rotations."""
    tumble = CATALOGUE["tumble"].scene(3)
    attitude, spin = (0.5, 0.5, 0.5, 0.5), (0.0, 0.0, 0.5)
    one = replace(tumble.bodies[0], pose=(0.0, 0.0, 0.0, *attitude), twist=(0.0, 0.0, 0.0, *spin))
    still = replace(one, name="still", twist=(0.0,) * 6)
    slow = replace(one, name="slow", twist=(0.0, 0.0, 0.0, 0.25, 0.0, 0.0))
    found = free_flight(replace(tumble, bodies=(one, still, slow), duration=1.0), DT)
    third = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    c, s = math.cos(0.5), math.sin(0.5)
    about_z = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    c, s = math.cos(0.25), math.sin(0.25)
    about_x = np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])
    assert rotation(found.pose[:, 0])[-1] == pytest.approx(about_z @ third)
    assert rotation(found.pose[:, 1])[-1] == pytest.approx(third)
    assert rotation(found.pose[:, 2])[-1] == pytest.approx(about_x @ third)
    assert found.twist[-1, :, 3:] == pytest.approx(np.array([spin, (0.0,) * 3, (0.25, 0.0, 0.0)]))


def test_flight_goes_on_from_where_bodies_met():
    """Two that meet at 1/2 s under their loads: one of them is pushed on, the common speed grows with half of it."""
    pushed = disc("a", 0.0, 1.0, force=(4.0, 0.0))
    found = perfectly_inelastic(scene_of(pushed, disc("b", 1.0 + 0.5 + 0.5, 0.0), duration=1.5), DT)
    met = int(np.argmax(found.twist[:, 1, 0] > 0.0))
    assert found.t[met] == pytest.approx(0.5, abs=DT)
    speed, after = 0.5 * (1.0 + 4.0 * found.t[met]), found.t[-1] - found.t[met]
    assert found.twist[-1, :, 0] == pytest.approx([speed + 2.0 * after] * 2)
    assert found.pose[-1, 1, 0] == pytest.approx(2.0 + speed * after + after**2)


def test_initial_touch_in_a_scene_of_any_size():
    near = [disc("a", 0.0, 2.0), disc("b", 1.0 + 5e-10, 0.0)]
    assert perfectly_inelastic(scene_of(*near), DT).twist[0, :, 0] == pytest.approx([1.0, 1.0])
    apart = [disc("a", 0.0, 0.0, spin=3.0), disc("b", 1.0 + 4e-9, 0.0)]
    assert perfectly_inelastic(scene_of(*apart), DT).twist[-1, 0, 2] == 3.0  # two radii and 4e-9 m do not touch
    nearly = [disc("a", 0.0, 0.0, spin=3.0), disc("b", 1.0 + 2.5e-9, 0.0)]
    assert perfectly_inelastic(scene_of(*nearly), DT).twist[-1, 0, 2] == 3.0  # 2e-9 m is a share of 1e-9 of it
    far = disc("c", 1e3, 5.0)
    assert perfectly_inelastic(scene_of(*apart, far), DT).twist[-1, 0, 2] == 0.0  # of a scene of 1 km they do


def test_a_body_that_meets_nothing_keeps_its_spin():
    row = [disc("a", 0.0, 3.0, spin=7.0), disc("b", 2.0), disc("alone", 50.0, spin=2.0)]
    assert perfectly_inelastic(scene_of(*row), DT).twist[-1, :, 2].tolist() == [0.0, 0.0, 2.0]


def test_value_and_reason_of_a_null():
    found = {null.name: null for null in nulls_of("impact", 2, {"e": 0.5}, DT, "rebound_ratio", 0.5)}
    assert found["free flight"] == Null("free flight", -1.0, 1.5, "")
    assert found["did nothing"] == Null("did nothing", 0.0, 0.5, "")
    none = nulls_of("stack", 2, {}, DT, "interface_impulse[1]", 1.0)
    assert {(null.value, null.error) for null in none} == {(None, None)} and all(null.reason for null in none)
    assert {null.reason for null in nulls_of("impact", 2, {}, DT, "nothing", 1.0)} == {
        "a trivial answer has no such metric"
    }


def test_turn_of_a_body_in_space():
    tumble = CATALOGUE["tumble"].scene(3)
    found = free_flight(tumble, DT)
    assert np.linalg.norm(found.pose[:, 0, 3:], axis=1) == pytest.approx(1.0)
    spin, half = np.array(tumble.bodies[0].twist[3:]), 0.5 * found.t[-1]
    rate = np.linalg.norm(spin)
    expected = [math.cos(rate * half), *(math.sin(rate * half) * spin / rate)]
    assert found.pose[-1, 0, 3:] == pytest.approx(expected)


def test_null_at_rest_has_no_speed():
    found = did_nothing(scene_of(disc("ball", 0.0, 5.0)), DT)
    assert not found.twist.any() and (found.pose == found.pose[0]).all()


def test_touching_null_bodies_with_common_momentum():
    found = perfectly_inelastic(scene_of(disc("a", 0.0, 3.0, mass=1.0, spin=7.0), disc("b", 2.0, 0.0, mass=2.0)), DT)
    assert found.twist[-1, :, 0] == pytest.approx([1.0, 1.0]) and not found.twist[-1, :, 2].any()
    assert found.pose[-1, 1, 0] - found.pose[-1, 0, 0] == pytest.approx(1.0, abs=3.0 * DT)


def test_row_of_inelastic_discs_stopped_by_a_wall():
    row = [disc("a", 0.0, 4.0), disc("b", 1.5), disc("c", 3.0)]
    free = perfectly_inelastic(scene_of(*row, duration=3.0), DT)
    assert free.twist[-1, :, 0] == pytest.approx([4.0 / 3.0] * 3)
    wall = Body("wall", HalfSpace((-1.0, 0.0), -4.0), motion="fixed")
    held = perfectly_inelastic(scene_of(*row, wall, duration=3.0), DT)
    assert not held.twist[-1].any() and held.pose[-1, 2, 0] == pytest.approx(3.5, abs=4.0 / 3.0 * DT)


def test_null_ball_landing_and_touching_from_the_start():
    floor = Body("floor", HalfSpace((0.0, 1.0), 0.0), motion="fixed")
    found = perfectly_inelastic(
        scene_of(floor, disc("high", 0.0, y=1.5), disc("low", 5.0, y=0.5), gravity=(0.0, -10.0)), DT
    )
    assert found.pose[-1, 1, 1] == pytest.approx(0.5, abs=10.0 * 0.45 * DT) and not found.twist[-1].any()
    assert (found.pose[:, 2, 1] == 0.5).all()


@pytest.mark.parametrize("name", NULLS)
def test_every_scene_can_be_asked_of_every_null(name):
    for scene, canonical in CATALOGUE.items():
        for dimension in canonical.dimensions:
            made = canonical.scene(dimension, dict(canonical.representative))
            for check in canonical.checks(made, DT):
                if check.truth is not None:
                    asked = (scene, dimension, canonical.representative, DT, check.metric, check.truth)
                    (found,) = [each for each in nulls_of(*asked) if each.name == name]
                    assert found.error is None or math.isfinite(found.error)


def test_null_answers_fail_scenes_with_a_rebound():
    for scene, metric, truth in (("impact", "rebound_ratio", 0.8), ("thin_wall", "rebound_ratio", 0.5)):
        errors = {each.name: each.error for each in nulls_of(scene, 2, {}, DT, metric, truth)}
        assert errors == {"did nothing": truth, "free flight": 1.0 + truth, "perfectly inelastic": truth}


@pytest.mark.parametrize(("error", "worth"), [(0.0, 1.0), (0.4, 0.5), (-0.4, 0.5), (0.8, 0.0), (1.6, -1.0)])
def test_skill_is_measured_against_the_best_null(error, worth):
    found = skill(error, [Null("worse", 0.0, 3.0), Null("best", 0.0, 0.8), Null("none", None, None)])
    assert found == (pytest.approx(worth), "best")


def test_reason_for_missing_skill():
    assert skill(None, [Null("a", 0.0, 1.0)])[0] is None
    assert skill(0.1, [Null("a", 0.0, 0.0), Null("b", 1.0, 1.0)]) == (None, "a is exact here")
    assert "no trivial answer has this value" in skill(0.1, [Null("a", None, None)])[1]


def test_skill_of_a_row():
    row = {"scene": "impact", "dimension": 2, "slot": {"params": {"e": 0.5}}, "dt": DT, "metric": "rebound_ratio",
           "truth": 0.5, "value": 0.105}  # fmt: skip
    assert skill_of(row) == (pytest.approx(1.0 - 0.395 / 0.5), "did nothing")
    assert skill_of(row | {"value": None})[0] is None
    across = {"metric": "out_of_plane", "truth": 0.0, "value": 0.1}
    assert skill_of(row | across) == (None, "a trivial answer is computed in 2-D and cannot leave its plane")


def judged(*slots):
    return rows_of("r", [execute(slot) for slot in slots])


def test_null_rows_and_skill_of_engines():
    pytest.importorskip("pymunk")
    slots = [Slot("impact", (), 2, "chipmunk", profile, DT) for profile in ("default", "tuned")]
    rows = judged(*slots)
    guesses = null_rows(rows)
    asked = {row.metric for row in rows if row.truth is not None}
    assert sorted((g.profile, g.metric) for g in guesses) == sorted((null, m) for null in NULLS for m in asked)
    fallen = next(g for g in guesses if (g.profile, g.metric) == ("free flight", "rebound_ratio"))
    assert (fallen.value, fallen.error, fallen.physics, fallen.engine) == (-1.0, -1.8, "fail", NO_ENGINE)
    # The better null errs by .8, so that this one is worth 1 - 1.8/.8; it alarms nobody.
    assert fallen.skill == pytest.approx(1.0 - 1.8 / 0.8) and not fallen.alarming
    assert fallen.slot["engine"] == NO_ENGINE and fallen.because == rows[0].because
    for row in with_skill(rows):
        wanted, against = skill_of(row.as_dict())
        assert row.skill == wanted and row.null == (against if wanted is not None else "")
    assert any(row.skill is not None for row in with_skill(rows))


def test_no_null_for_a_large_sweep(monkeypatch):
    pytest.importorskip("pymunk")
    rows = judged(*(Slot("impact", (("e", e),), 2, "chipmunk", "tuned", DT) for e in (0.1, 0.2)))
    monkeypatch.setattr(nulls, "MOST_CELLS", 1)
    assert null_rows(rows) == [] and with_skill(rows) == rows


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_nan_taken_for_a_missing_value(monkeypatch, value):
    monkeypatch.setattr(nulls, "_measured", lambda *asked: {"did nothing": {"rebound_ratio": (value, "divided by 0")}})
    assert nulls_of("impact", 2, {}, DT, "rebound_ratio", 0.8) == [Null("did nothing", None, None, "divided by 0")]


def test_null_row_with_its_own_answer_alone():
    """Everything of the check and the cell stays; what belongs to the engine's run is empty."""
    pytest.importorskip("pymunk")
    row = next(r for r in judged(Slot("impact", (), 2, "chipmunk", "tuned", DT, 7)) if r.metric == "rebound_ratio")
    asked = replace(row, engine_version="9", state_hash="0a", steps=3, wall_time_s=2.0, log="said", floor=0.5,
                    initial_change=["moved"], certificate="holds", standing="new", reason="off")  # fmt: skip
    found = {guess.profile: guess for guess in null_rows([asked])}
    own = {"engine": NO_ENGINE, "engine_version": "", "state_hash": "", "steps": 0, "wall_time_s": 0.0, "log": "",
           "floor": None, "initial_change": [], "certificate": "", "standing": None, "outcome": "ok", "cells": [],
           "iterations": None, "physics": "fail", "reason": ""}  # fmt: skip
    for name, value in (("did nothing", 0.0), ("free flight", -1.0)):
        slot = {**asked.slot, "engine": NO_ENGINE, "profile": name, "iterations": None}
        worth = 1.0 - abs(value - 0.8) / 0.8
        wanted = replace(asked, profile=name, value=value, error=value - 0.8, slot=slot, skill=pytest.approx(worth),
                         null="did nothing", **own)  # fmt: skip
        assert found[name].as_dict() == wanted.as_dict()


def test_rows_without_a_null():
    pytest.importorskip("pymunk")
    row = next(r for r in judged(Slot("impact", (), 2, "chipmunk", "tuned", DT)) if r.metric == "rebound_ratio")
    assert null_rows([replace(row, cells=["one", "two"])]) == [] and null_rows([replace(row, truth=None)]) == []
    assert {guess.outcome for guess in null_rows([replace(row, outcome="invalid", cells=["one"])])} == {"ok"}


def test_null_without_an_answer_against_none(monkeypatch):
    pytest.importorskip("pymunk")
    row = next(r for r in judged(Slot("impact", (), 2, "chipmunk", "tuned", DT)) if r.metric == "rebound_ratio")
    monkeypatch.setattr(nulls, "nulls_of", lambda *asked: [Null("did nothing", None, None, "it has none")])
    (guess,) = null_rows([row])
    assert (guess.value, guess.skill, guess.null, guess.physics, guess.reason) == (None, None, "", None, "it has none")


def test_limit_on_the_number_of_asked_cells(monkeypatch):
    pytest.importorskip("pymunk")
    rows = judged(*(Slot("impact", (("e", e),), 2, "chipmunk", "tuned", DT) for e in (0.25, 0.5)))
    monkeypatch.setattr(nulls, "MOST_CELLS", 2)
    assert null_rows(rows) and any(row.skill is not None for row in with_skill(rows))
    monkeypatch.setattr(nulls, "MOST_CELLS", 1)
    assert null_rows(rows) == [] and with_skill(rows) == rows
