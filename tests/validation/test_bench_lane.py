"""The timing lane, on an engine whose cost and misbehaviour are known by construction."""

import hashlib
import sys
import textwrap
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from adapters import registry
from adapters.stepping import run
from validation.bench import sweep
from validation.bench.lane import Limits, run_lane
from validation.bench.stopwatch import lap
from validation.bench.sweep import SAMPLED_DT
from validation.bench.units import Unit, overhead_units, own_error, prepared, scene_of, size_units, work_unit
from validation.cells import Slot

CLOCKWORK = '''
"""An engine that spends a known CPU time per step and moves nothing, or misbehaves, by profile."""
import os, random, time
import numpy as np
from adapters.engine import Contacts, Engine, EngineFacts, Scheme, Setting, Simulation

COST = {"one": 1e-4, "two": 2e-4}


class Clockwork(Simulation):
    def __init__(self, scene, deed):
        self.poses = np.array([body.pose for body in scene.bodies], float)
        self.twists = np.zeros((len(scene.bodies), 3))
        self.deed = deed

    def advance(self, steps):
        end = time.process_time() + steps * COST.get(self.deed, 1e-5)
        while time.process_time() < end:
            pass
        if self.deed == "sleep":
            time.sleep(0.02)
        if self.deed == "abort":
            os.abort()
        if self.deed == "hang":
            time.sleep(3600)
        if self.deed == "raise":
            raise RuntimeError("it broke")
        if self.deed == "random":
            self.poses[:, 0] += random.random() * 1e-9
        if self.deed == "collapse":
            self.poses[1:, 1] -= 0.6
        if self.deed == "nan":
            self.poses[:] = np.nan

    def pose(self):
        return self.poses

    def twist(self):
        return self.twists

    def contacts(self):
        return Contacts.from_rows([], 2)

    def readback(self):
        return {}


class ClockworkEngine(Engine):
    facts = EngineFacts("clockwork", "Clockwork", "clockwork", frozenset({2}), Scheme("none", 1), 1 / 240)
    profiles = {
        name: (lambda needs, dt, name=name: [Setting("deed", name, "to test the lane")])
        for name in ("one", "two", "sleep", "abort", "hang", "raise", "random", "collapse", "nan")
    }

    def version(self):
        return "1"

    def refuses(self, scene, profile):
        return None

    def declares(self, profile, needs, dt):
        return {}

    def build(self, scene, dt, settings):
        return Clockwork(scene, settings["deed"])
'''
PATIENT = Limits(most=6, patience=60.0, renew=100)


@pytest.fixture
def clockwork(tmp_path, monkeypatch):
    (tmp_path / "clockwork_engine.py").write_text(textwrap.dedent(CLOCKWORK))
    info = tmp_path / "clockwork-1.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: clockwork\nVersion: 1\n")
    (info / "entry_points.txt").write_text(f"[{registry.GROUP}]\nclockwork = clockwork_engine:ClockworkEngine\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    registry.forget()
    yield
    registry.forget()
    sys.modules.pop("clockwork_engine", None)


def unit(profile, steps=10, scene="empty", purpose="overhead"):
    return Unit(purpose, Slot(scene, (), 2, "clockwork", profile, 1 / 240), "", 0, 1, steps)


def timed(units, limits=PATIENT, seed=1):
    return list(run_lane(units, limits, seed))


def by_profile(timings):
    found = {}
    for timing in timings:
        found.setdefault(timing.slot.profile, []).append(timing)
    return found


def test_twice_the_work_takes_twice_the_time(clockwork):
    found = by_profile(timed([unit("one", 50), unit("two", 50)]))
    one, two = (np.median([t.seconds for t in found[name]]) for name in ("one", "two"))
    # 5 ms and 10 ms of spinning; a spin overshoots by one look at the clock (1 us). 2 % is left for interrupts.
    assert one == pytest.approx(5e-3, rel=0.02) and two / one == pytest.approx(2.0, rel=0.02)


def test_waiting_in_cpu_and_wall_time(clockwork):
    for timing in timed([unit("sleep")]):
        assert timing.seconds < 0.01 < 0.02 <= timing.wall_seconds


@pytest.mark.long
def test_unit_voided_by_an_abort_or_a_hang(clockwork):
    units = [unit("one"), unit("abort"), unit("two"), unit("raise"), unit("hang")]
    # Three seconds without an answer are a hang: the healthy units answer in milliseconds, a start takes a second.
    found = by_profile(timed(units, replace(PATIENT, patience=10.0)))
    assert "SIGABRT" in found["abort"][0].void or "-6" in found["abort"][0].void
    assert found["raise"][0].void == "RuntimeError: it broke"
    assert "no answer after 10 s" in found["hang"][0].void
    assert [len(found[name]) for name in ("abort", "raise", "hang")] == [1, 1, 1]
    for name in ("one", "two"):
        assert len(found[name]) >= 5 and not any(t.void for t in found[name])


def test_invalid_physics_voids_the_timing(clockwork):
    pile = dict(scene="pyramid", purpose="bodies")
    units = [
        replace(unit(name, **pile), slot=replace(unit(name, **pile).slot, params=(("rows", 2.0),)), bodies=3)
        for name in ("one", "collapse", "nan")
    ]
    found = by_profile(timed(units))
    assert not found["one"][0].void and found["one"][0].error == 0.0
    assert "did not stand" in found["collapse"][0].void
    assert "not finite" in found["nan"][0].void


def test_states_of_an_engine_that_is_not_deterministic(clockwork):
    found = by_profile(timed([unit("one"), unit("random")]))
    assert len({t.state_hash for t in found["one"]}) == 1
    assert len({t.state_hash for t in found["random"]}) == len(found["random"])


def test_order_by_seed(clockwork):
    units = [unit("one", steps) for steps in (1, 2, 3, 4)] + [unit("two", steps) for steps in (1, 2, 3, 4)]
    for k, u in enumerate(units):  # eight units in four groups that differ in a parameter only
        units[k] = replace(u, slot=replace(u.slot, params=(("k", float(u.steps)),)))
    limits = replace(PATIENT, most=2)
    first, second, third = ([(t.slot, t.round) for t in timed(units, limits, seed)] for seed in (7, 7, 8))
    assert first == second and first != third and sorted(map(str, first)) == sorted(map(str, third))


def test_every_round_of_a_group_has_its_opponent(clockwork):
    # "one" closes after five rounds, "random sleep" would not: a width of zero keeps all open to the end.
    timings = timed([unit("one"), unit("two"), unit("sleep")], replace(PATIENT, most=12))
    rounds = by_profile(timings)
    opponent = {t.round for t in rounds["one"]}
    assert all(t.opponent == "clockwork/one" for t in timings)
    for name in ("two", "sleep"):
        assert {t.round for t in rounds[name]} <= opponent


def test_a_unit_closes_when_its_interval_is_narrow(clockwork):
    limits = replace(PATIENT, most=40, width=1e9)
    assert all(t.round < limits.fewest for t in timed([unit("one"), unit("two")], limits))
    assert max(t.round for t in timed([unit("one")], replace(PATIENT, width=0.0))) == PATIENT.most - 1


@pytest.mark.long
def test_end_of_a_series_of_piles(clockwork):
    sizes = size_units([("clockwork", "one")], [2], [], [], [1, 2, 3])
    steps = {1: 10, 3: 12000, 6: 10}  # 1 ms, 1.2 s: the limit of 1 s leaves room for a busy machine
    slow = [replace(u, steps=steps[u.bodies]) for u in sizes]
    timings = timed(slow, replace(PATIENT, size_seconds=1.0, most=3))
    by_size = {bodies: [t for t in timings if t.bodies == bodies] for bodies in (1, 3, 6)}
    assert not by_size[1][0].void and not by_size[3][0].void
    assert [t.void[:8] for t in by_size[6]] == ["left out"]


@pytest.mark.parametrize("engine", ["chipmunk", "reference"])
def test_timed_run_ends_with_the_judged_run(engine):
    pytest.importorskip({"chipmunk": "pymunk", "reference": "numba"}[engine])
    profile = next(iter(registry.load(engine).profiles))
    slot = Slot("bounce", (("height", 1.03),), 2, engine, profile, 1 / 240)
    plain, sampled = lap(work_unit(slot, "", 0.0)), lap(work_unit(slot, "", 0.0, sampled=True))
    loaded, posed, settings, _ = prepared(slot)
    judged = run(loaded, posed, slot.dt, settings)
    state = (judged.pose[-1] + 0.0).tobytes() + (judged.twist[-1] + 0.0).tobytes()
    assert plain.state_hash == sampled.state_hash == hashlib.sha256(state).hexdigest()[:16]


def test_boxes_of_pyramids():
    for u in size_units([("reference", "classical")], [2], [("stack", "n")], [3], [1, 4, 13]):
        scene = scene_of(u.slot)
        free = [b for b in scene.bodies if b.motion == "free"]
        assert len(free) == u.bodies
        for i, a in enumerate(free):
            for b in free[:i]:
                gap = max(abs(a.pose[0] - b.pose[0]), abs(a.pose[1] - b.pose[1])) - 1.0
                assert gap > -1e-12


def test_error_of_a_fall_from_the_parabola():
    scene = scene_of(Slot("free", (), 2, "reference", "classical", 1 / 240))
    start = np.array([body.pose for body in scene.bodies], float)
    fallen = start.copy()
    fallen[0, 1] += 0.5 * scene.gravity[1] * 0.25
    assert own_error(scene, 0.5, start, fallen) == pytest.approx(0.0, abs=1e-15)
    fallen[0, 1] += 0.01
    assert own_error(scene, 0.5, start, fallen) == pytest.approx(0.01)


def test_error_of_a_pile_by_its_motion():
    scene = scene_of(Slot("stack", (("n", 3.0),), 2, "reference", "classical", 1 / 240))
    start = np.array([body.pose for body in scene.bodies], float)
    start[1:, 1] -= [5e-4, 1e-3, 1.5e-3]  # overlaps that an adapter made
    moved = start.copy()
    moved[2, 0] += 0.02
    assert own_error(scene, 0.2, start, start) == 0.0
    assert own_error(scene, 0.2, start, moved) == pytest.approx(0.02)


def test_overhead_of_engines_by_dimension(clockwork):
    units = list(overhead_units([("clockwork", "one"), ("clockwork", "two")], [2, 3]))
    assert {(u.slot.scene, u.slot.dimension, u.sampled) for u in units} == {
        (scene, 2, sampled) for scene in ("empty", "free") for sampled in (False, True)
    }


@pytest.mark.parametrize("iterations", [None, 4])
@pytest.mark.parametrize("dt", [SAMPLED_DT, 0.5 * SAMPLED_DT])
def test_work_point_timed_with_states_at_one_step(monkeypatch, dt, iterations):
    slot = Slot("impact", (), 2, "chipmunk", "tuned", dt, iterations)
    members = [SimpleNamespace(slot=slot, cell="its cell")]
    point = {"reason": "", "slot": slot.as_dict(), "error": 0.25}
    monkeypatch.setattr(sweep, "accuracy", lambda asked, certified: point)
    found = list(sweep._work_units(members, {}, "full"))
    assert [unit.sampled for unit in found] == [False, True][: 1 + (dt == SAMPLED_DT and iterations is None)]
    assert list(sweep._work_units(members, {}, "quick")) == found[:1]  # a quick one has no time for it
    assert {(unit.slot, unit.cell, unit.error, unit.purpose) for unit in found} == {(slot, "its cell", 0.25, "work")}
    monkeypatch.setattr(sweep, "accuracy", lambda asked, certified: point | {"reason": "it has no error"})
    assert list(sweep._work_units(members, {}, "full")) == []
