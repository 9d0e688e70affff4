"""The table of targets: its data, errors on closed forms, the search for equal error on made-up curves, its rows."""

import math
import re
from dataclasses import asdict, replace

import numpy as np
import pandas as pd
import pytest

from adapters import registry
from adapters.engine import EngineError
from adapters.scene.near import start_overlap
from validation.bench import targets
from validation.bench.errors import Found, column, drift, errors_of, heap, wall
from validation.bench.scenes import RADII
from validation.bench.targets import AT_END, AT_ERROR, AT_SWEEPS, Ours, Row, fewest_sweeps, lead, table
from validation.bench.units import scene_of
from validation.cells import Slot

ASKED = table()


def test_opponents_and_floors_from_the_folders_of_engines():
    folders = {name for name in registry.names() if targets.inside(name, "targets.toml")}
    assert set(ASKED.opponents) == folders >= {"chipmunk", "bullet", "mujoco"}
    assert {name for case in ASKED.cases for name in case.against} == folders


def test_scene_of_an_unlisted_engine(monkeypatch, tmp_path):
    file = tmp_path / "targets.toml"
    file.write_text('role = "shipped"\nsweeps = true\nfloor = "10 sweeps"\n[against]\n"a tower" = []\n')
    monkeypatch.setattr(targets, "inside", lambda name, _: file if name == "chipmunk" else None)
    with pytest.raises(EngineError, match=r"targets.toml: 'a tower' is no title of targets.toml"):
        table()


# ---- the search for equal error --------------------------------------------------------------------------------------


@pytest.mark.parametrize("needed", [1, 10, 11, 19, 20, 21, 34, 159, 160, 161, 640])
def test_fewest_sweeps_of_a_falling_error(needed):
    tried = []

    def reaches(sweeps):
        tried.append(sweeps)
        return sweeps >= needed

    assert fewest_sweeps(reaches, 10, 640) == max(10, needed)
    assert len(tried) == len(set(tried)) <= 7 + 9  # 10, 20 .. 640; halves of 320


def test_the_search_ends_at_the_most_sweeps():
    tried = []
    assert fewest_sweeps(lambda sweeps: tried.append(sweeps), 10, 100) is None  # None: no time
    assert tried == [10]
    assert fewest_sweeps(lambda sweeps: bool(tried.append(sweeps)), 10, 100) is None
    assert tried[1:] == [10, 20, 40, 80, 100]


def test_fewest_iterations_known_when_time_ends():
    assert fewest_sweeps(lambda sweeps: {10: False, 20: False, 40: True, 30: True}.get(sweeps), 10, 640) == 30


def test_fewest_iterations_of_an_error_that_rises_and_falls():
    def reaches(sweeps):
        return sweeps % 16 == 0 or sweeps > 300

    found = fewest_sweeps(reaches, 10, 640)
    assert reaches(found) and not reaches(found - 1)


def errors(seconds=0.0, reason="", **found):
    return Found(found, dict.fromkeys(found, 1e-12), 0, 0, seconds, reason)


def test_limit_of_every_error():
    theirs = errors(overlap=1e-3, energy=0.0)
    assert errors(overlap=1.01e-3, energy=1e-12).is_within(theirs)
    assert not errors(overlap=1.02e-3, energy=0.0).is_within(theirs)
    assert not errors(overlap=0.0, energy=1e-11).is_within(theirs)
    assert not errors(overlap=math.nan, energy=0.0).is_within(theirs)
    assert not errors(reason="it broke").is_within(theirs)


def test_sweeps_tried_within_the_time():
    tried = []

    def ask(sweeps):
        tried.append(sweeps)
        return errors(seconds=0.1 * sweeps, sag=1.0 / sweeps)

    ours = Ours(ask, seconds=100.0)
    assert ours.against(errors(sag=1.0 / 25.0), 10) == (25, "")
    count = len(tried)
    assert ours.against(errors(sag=1.0 / 25.0), 10) == (25, "") and len(tried) == count
    short = Ours(ask, seconds=4.0)
    found, reason = short.against(errors(sag=1.0 / 1000.0), 10)
    assert found is None and reason == "not at this error up to 20 sweeps, time is up"
    assert Ours(ask, 1e9).against(errors(sag=1e-9), 10) == (None, "not at this error up to 640 sweeps")
    assert short.against(errors(reason="it broke"), 10) == (None, "it broke")


# ---- the table of scenes ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("case", ASKED.cases, ids=lambda case: case.title)
def test_target_scenes_with_their_number_of_bodies(case):
    scene = scene_of(case.ours(10))
    assert scene.dimension == case.dimension and ("space" in case.title) == (case.dimension == 3)
    free = [body for body in scene.bodies if body.motion == "free"]
    said = [int(number) for number in re.findall(r"\d+", case.title)]
    assert len(free) == (said[0] if said else 1)
    overlap = start_overlap(scene) if len(free) <= 1000 else {}  # of 5050 it takes seconds, and says nothing new
    assert max(overlap.values(), default=0.0) < 1e-9  # a place of a hundred sides is rounded
    for name, owed in case.against.items():
        assert ASKED.opponents[name].profile and len(owed) in (0, 2) and list(owed) == sorted(owed)
    assert (case.clock is None) == (case.drift is not None) and set(case.timed_only) <= set(case.against)


def test_side_contacts_of_a_row_of_boxes():
    slot = Slot("wall", (("gap", 0.0), ("rows", 4.0)), 2, registry.solver(), "classical", 1 / 240)
    places = np.array([body.pose[:2] for body in scene_of(slot).bodies[1:]])
    apart = np.diff(places[:4], axis=0)
    assert np.allclose(apart, [[1.0, 0.0]] * 3) and np.allclose(places[-1], [0.0, 3.5])


@pytest.mark.parametrize("dimension", [2, 3])
def test_heap_by_its_seed_and_between_its_walls(dimension):
    def made(seed):
        params = (("layers", 4.0), ("n", 100.0), ("seed", seed))
        return scene_of(Slot("heap", params, dimension, registry.solver(), "classical", 1 / 240))

    assert made(1.0) == made(1.0) != made(2.0)
    balls = [body for body in made(1.0).bodies if body.motion == "free"]
    assert {RADII[0] <= body.shape.radius <= RADII[1] for body in balls} == {True}
    assert len({body.pose[dimension - 1] for body in balls}) == 4


# ---- errors on closed forms ------------------------------------------------------------------------------------------


def moved(scene, *shifts):
    """Poses (s, n, f) of a scene whose last body is moved by each of ``shifts``."""
    poses = np.array([[body.pose for body in scene.bodies]] * (len(shifts) + 1), float)
    for k, shift in enumerate(shifts, 1):
        poses[k, -1, : scene.dimension] += shift
    return poses


@pytest.mark.parametrize("dimension", [2, 3])
def test_column_error_by_largest_offset_of_its_top(dimension):
    scene = scene_of(Slot("stack", (("n", 3.0),), dimension, registry.solver(), "classical", 1 / 240))
    aside, back = np.zeros(dimension), np.zeros(dimension)
    aside[:-1], aside[-1], back[-1] = 0.03, -0.01, 0.02
    poses, twist = moved(scene, aside, back), np.zeros((4, 3 * (dimension - 1)))
    assert column(scene, poses, twist) == pytest.approx({"drift [m]": 0.03 * math.sqrt(dimension - 1), "sag [m]": 0.02})
    assert drift(scene, poses, twist) == pytest.approx({"drift [m]": 0.03 * math.sqrt(dimension - 1)})
    assert wall(scene, poses, twist) == pytest.approx({"sag [m]": 0.02})


@pytest.mark.parametrize("dimension", [2, 3])
def test_heap_error_by_deepest_overlap_and_final_energy(dimension):
    params = (("layers", 1.0), ("n", 2.0), ("seed", 3.0))
    scene = scene_of(Slot("heap", params, dimension, registry.solver(), "classical", 1 / 240))
    first, second = scene.bodies[-2:]
    twist = np.zeros((len(scene.bodies), 3 * (dimension - 1)))
    twist[-1, 0], twist[-2, -1] = 2.0, 3.0  # of 1 kg; of a disc m r^2/2, of a sphere 2/5 m r^2
    share = 0.5 if dimension == 2 else 0.4
    energy = 0.5 * 2.0**2 + 0.5 * share * first.shape.radius**2 * 3.0**2
    onto = np.array(first.pose[:dimension]) - second.pose[:dimension]
    shift = onto * (1.0 - (first.shape.radius + second.shape.radius - 0.05) / np.linalg.norm(onto))
    found = heap(scene, moved(scene, shift), twist)
    assert found == pytest.approx({"overlap [m]": 0.05, "kinetic energy [J]": energy})


def test_free_fall_measured_as_a_sag():
    pytest.importorskip("numba")
    slot = Slot("free", (), 2, registry.solver(), "classical", 1 / 240)
    found = errors_of("column", slot, 0.25)
    steps = found.steps
    assert steps == 60 and found.contacts == 0 and not found.reason
    # Semi-implicit Euler falls g dt^2 n (n + 1)/2.
    assert found.errors["sag [m]"] == pytest.approx(9.81 / 240**2 * steps * (steps + 1) / 2, rel=1e-12)
    assert found.errors["drift [m]"] == 0.0


def test_refusing_engine_with_its_reason():
    slot = Slot("free", (), 3, "chipmunk", "default", 1 / 240)
    assert "planar" in errors_of("column", slot, 0.1).reason


def test_target_error_as_the_scene_declares_it():
    pytest.importorskip("numba")
    case = next(case for case in ASKED.cases if case.errors == "primary")
    found = errors_of("primary", case.ours(10), case.seconds)
    assert list(found.errors) == ["apex error [h0]"] and 0.0 < found.errors["apex error [h0]"] < 0.1


# ---- rows ------------------------------------------------------------------------------------------------------------


def row(measured, floor=None, target=None, at=AT_SWEEPS):
    return Row("scene", "a/b", at, measured, measured, measured, floor, target, {}, {}, 10, {})


def test_marks_below_the_floor_and_at_the_target():
    assert [row(x, 2.0, 3.0).mark for x in (None, 1.99, 2.0, 2.9, 3.0)] == [
        *["below floor"] * 2,
        *["floor"] * 2,
        "target",
    ]
    assert row(0.1).mark == ""
    assert [row(x, 0.1, None, AT_END).mark for x in (0.1, 0.11, math.nan)] == ["floor", *["below floor"] * 2]


def test_share_of_levels_that_another_engine_reaches():
    ours, theirs = registry.solver(), "chipmunk"

    def point(engine, profile, scene, cost, error):
        names = dict(scene=scene, dimension=2, engine=engine, profile=profile, dt=1 / 240, iterations=None)
        return names | dict(
            cost=cost, cost_low=cost, cost_high=cost, cost_corrected=cost, error=error, reason="", slot={}
        )

    points = pd.DataFrame(
        [
            point(ours, "classical", "a", 1.0, 5e-3),  # 1e-1, 1e-2: twice as fast
            point(ours, "reference", "a", 1.5, 5e-5),  # 1e-3: not; 1e-4: nobody else
            point(theirs, "default", "a", 2.0, 5e-4),
            point(ours, "classical", "b", 1.0, 5e-2),  # 1e-1: twice; 1e-2: only theirs
            point(theirs, "default", "b", 2.0, 5e-3),
        ]
    )
    found = lead(points, (0.5, 0.8))
    assert found.counts == {"ahead": 3, "levels": 5, "only_ours": 1}
    assert found.measured == pytest.approx(0.6) and found.mark == "floor" and found.at == AT_ERROR


@pytest.mark.long
def test_ratio_of_a_measured_scene():
    pytest.importorskip("pymunk")
    small = [replace(case, seconds=0.25) for case in ASKED.cases if case.scene == "stack" and case.dimension == 2]
    small = [replace(case, clock=case.clock and (0.1, 0.1), against={"chipmunk": [0.001, 1e6]}) for case in small]
    limits = replace(targets.LIMITS, fewest=3, most=3, lane_seconds=1.0)
    told = []
    found = list(targets.measure(replace(ASKED, cases=tuple(small)), 1, told.append, limits))
    assert [each.at for each in found] == [AT_SWEEPS, AT_ERROR, AT_END]
    sweeps, equal, end = found
    assert sweeps.floor is None and (equal.floor, equal.target, equal.mark) == (0.001, 1e6, "floor")
    for each in (sweeps, equal):
        assert 0.0 < each.low <= each.measured <= each.high and set(each.our_error) == {"drift [m]", "sag [m]"}
        assert each.counts["rounds"] == 3 and each.counts["bodies"] == 10 and each.counts["steps"] == 24
        assert each.counts["our_contacts"] == 20 and each.counts["our_state"] != each.counts["their_state"]
    assert end.measured == end.our_error["drift [m]"] and end.floor == 0.1
    assert any("errors" in text for text in told) and any("clocking" in text for text in told)
    assert {"scene", "against", "at", "measured", "low", "high", "floor", "target"} <= set(asdict(sweeps))
