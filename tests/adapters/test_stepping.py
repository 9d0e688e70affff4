"""The only loop that steps an engine: what it records, when it stops, and that it always closes."""

from __future__ import annotations

import itertools
import json
import math
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import pytest

from adapters import registry
from adapters.conformance.scenes import accepted, resting, values
from adapters.conformance.worlds import one_by_one
from adapters.engine import Contacts, Engine, EngineError, EngineFacts, Recorded, Scheme, Setting, Simulation
from adapters.scene import Body, Box, Capsule, Disc, HalfSpace, Scene, Sphere
from adapters.stepping import _alike, advances, posed_for, run, step_count
from adapters.trajectory import ContactRecord, Sampling, load_trajectory


class Flight(Simulation):
    """Exact free flight; ``spoil(simulation)`` runs after every advance."""

    def __init__(self, scene: Scene, dt: float, spoil: Callable[[Flight], None]) -> None:
        self.scene, self.dt, self.spoil = scene, dt, spoil
        self.steps, self.calls, self.closed = 0, [], 0
        self._pose = np.array([body.pose for body in scene.bodies])
        self._twist = np.array([body.twist for body in scene.bodies])
        self.initial_change = ("moved by nothing",)

    def advance(self, steps: int) -> None:
        self.calls.append(steps)
        self.steps += steps
        d = self.scene.dimension
        gained = self.steps * self.dt * np.array(self.scene.gravity)
        self._twist[:, :d] = [body.twist[:d] + gained for body in self.scene.bodies]
        self.spoil(self)

    def pose(self) -> np.ndarray:
        return self._pose.copy()

    def twist(self) -> np.ndarray:
        return self._twist.copy()

    def contacts(self) -> Contacts:
        d = self.scene.dimension
        row = (0, 1, (0.0,) * d, (1.0,) * d, (float(self.steps),) * d, 0.0)
        return Contacts.from_rows([row] * (self.steps % 3), d)

    def readback(self) -> dict[str, Any]:
        return {"dt": self.dt}

    def certificate(self) -> dict[str, Any]:
        return {"residual": 0.0}

    def close(self) -> None:
        self.closed += 1


class Toy(Engine):
    profiles = MappingProxyType({"only": lambda needs, dt: [Setting("iterations", 3, "a toy")]})

    def __init__(self, dimensions: set[int], spoil: Callable[[Flight], None] = lambda flight: None) -> None:
        self.facts = EngineFacts("toy", "Toy", "toy", frozenset(dimensions), Scheme("none", 0), 0.01)
        self.spoil = spoil
        self.built: list[Flight] = []

    def version(self) -> str:
        return "1"

    def refuses(self, scene: Scene, profile: str) -> str | None:
        return None

    def build(self, scene: Scene, dt: float, settings: Mapping[str, Any]) -> Simulation:
        self.settings = settings
        self.built.append(Flight(scene, dt, self.spoil))
        return self.built[-1]

    def declares(self, profile: str, needs: Any, dt: float) -> dict:
        return {}


def scene(**changes: Any) -> Scene:
    bodies = (
        Body("a", Disc(0.5), 1.0, 0.1, (0.0, 2.0, 0.3), (1.0, 0.0, 0.5)),
        Body("b", Box((0.5, 0.5)), 1.0, 0.1, (3.0, 2.0, 0.0)),
    )
    base = Scene("flight", 1, 2, bodies, (), (0.0, -10.0), 1.0)
    return replace(base, **changes)


@pytest.mark.parametrize(
    ("duration", "dt", "steps"),
    [(1.0, 0.1, 10), (5.0, 1 / 240, 1200), (1.0, 0.3, 4), (0.5025, 1 / 240, 121), (1e-9, 1.0, 1), (0.3, 0.1, 3)],
)
def test_steps_cover_the_duration_despite_rounding(duration: float, dt: float, steps: int) -> None:
    assert step_count(duration, dt) == steps


def test_samples_of_every_step() -> None:
    toy = Toy({2})
    trajectory = run(toy, scene(), 0.1, {})
    assert trajectory.t.tolist() == [k * 0.1 for k in range(11)]
    assert trajectory.pose.shape == (11, 2, 3) and trajectory.twist.shape == (11, 2, 3)
    assert trajectory.pose[0].tolist() == [list(b.pose) for b in scene().bodies]
    assert trajectory.twist[0].tolist() == [list(b.twist) for b in scene().bodies]
    assert trajectory.twist[-1, 0, 1] == pytest.approx(-10.0, rel=1e-15)
    assert trajectory.finish == "completed" and trajectory.reason == ""
    assert trajectory.initial_change == ("moved by nothing",)
    assert trajectory.readback == {"dt": 0.1} and trajectory.certificate == {"residual": 0.0}
    assert toy.built[0].calls == [1] * 10 and toy.built[0].closed == 1


def test_last_step_of_a_stride_that_does_not_divide() -> None:
    toy = Toy({2})
    trajectory = run(toy, scene(), 0.1, {}, Sampling(stride=4))
    assert toy.built[0].calls == [4, 4, 2]
    assert np.allclose(trajectory.t, [0.0, 0.4, 0.8, 1.0], rtol=1e-15)


@pytest.mark.parametrize(("stride", "contacts_from"), [(0, None), (-1, None), (1.5, None), (True, None), (2, 0.0)])
def test_refusal_of_a_stride_that_hangs_or_loses_impulses(stride: Any, contacts_from: float | None) -> None:
    with pytest.raises(ValueError, match="stride"):
        Sampling(stride, contacts_from)


@pytest.mark.parametrize("dt", [0.0, -0.1, math.nan, math.inf])
def test_refusal_of_a_bad_step(dt: float) -> None:
    toy = Toy({2})
    with pytest.raises(EngineError, match=r"^dt: "):
        run(toy, scene(), dt, {})
    assert toy.built == []


def test_contacts_recorded_from_the_requested_time() -> None:
    trajectory = run(Toy({2}), scene(), 0.1, {}, Sampling(1, 0.55))
    record = trajectory.contacts
    assert record is not None
    assert record.step.tolist() == [6, 7, 8, 9, 10]
    assert record.offset.tolist() == [0, 0, 1, 3, 3, 4]  # step k has k mod 3 contacts
    assert record.impulse_between(1, 0)[:, 0].tolist() == [0.0, 7.0, 16.0, 0.0, 10.0]
    sample, impulse = record.between(0, 1)
    assert sample.tolist() == [1, 2, 2, 4] and impulse[:, 1].tolist() == [7.0, 8.0, 8.0, 10.0]


def test_contacts_of_time_zero() -> None:
    record = run(Toy({2}), scene(), 0.1, {}, Sampling(1, 0.0)).contacts
    assert record is not None and record.step.tolist() == list(range(1, 11))


def test_unrequested_contacts_not_recorded() -> None:
    assert run(Toy({2}), scene(), 0.1, {}).contacts is None


def spoiled(name: str, index: tuple[int, int], value: float) -> Callable[[Flight], None]:
    def spoil(flight: Flight) -> None:
        if flight.steps >= 4:
            getattr(flight, name)[index] = value

    return spoil


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize(("name", "index"), [("_pose", (1, 2)), ("_twist", (0, 2)), ("_twist", (1, 0))])
def test_divergence_by_a_state_that_is_not_finite(name: str, index: tuple[int, int], value: float) -> None:
    toy = Toy({2}, spoiled(name, index, value))
    trajectory = run(toy, scene(), 0.1, {})
    assert trajectory.finish == "diverged" and "not finite at t = 0.4 s" in trajectory.reason
    assert len(trajectory.t) == 5 and toy.built[0].closed == 1


# The scene explains 1 m/s + 0.5 rad/s x 0.5 m + 10 m/s^2 x 1 s = 11.25 m/s; a thousand times that is an explosion.
@pytest.mark.parametrize(("speed", "finish"), [(11.24e3, "completed"), (11.26e3, "diverged"), (-11.26e3, "diverged")])
def test_explosion_threshold_of_a_thousand_times_the_explained(speed: float, finish: str) -> None:
    trajectory = run(Toy({2}, spoiled("_twist", (0, 0), speed)), scene(), 0.1, {})
    assert trajectory.finish == finish
    assert finish == "completed" or "m/s, which nothing in the scene explains" in trajectory.reason


@pytest.mark.parametrize(
    "body",
    [
        Body("a", Box((0.5, 0.1)), 1.0, 0.1, (), (0.0, 0.0, 2.0)),
        Body("a", Box((0.5, 0.1)), 1.0, 0.1, torque=(2.0,)),
        Body("a", Box((0.5, 0.1)), 1.0, 0.1, force=(2.0, 0.0)),
    ],
    ids=["spin", "torque", "force"],
)
def test_spin_torque_and_force_explain_speed_without_gravity(body: Body) -> None:
    # Any of them may turn into 1 m/s (a spinning box whose corner hits something).
    alone = scene(bodies=(body,), gravity=(0.0, 0.0))
    assert run(Toy({2}, spoiled("_twist", (0, 0), 1.0)), alone, 0.1, {}).finish == "completed"


# Loads of size 2 on a body of 4 kg, 0.5 kg m^2 and 0.5 m for 0.5 s; in space the least of its moments counts.
@pytest.mark.parametrize(
    ("dimension", "load", "gained"),
    [(2, {"force": (2.0, 0.0)}, 0.25), (2, {"torque": (2.0,)}, 1.0), (3, {"torque": (0.0, 0.0, 2.0)}, 1.0)],
)
@pytest.mark.parametrize(("share", "finish"), [(999.0, "completed"), (1001.0, "diverged")])
def test_speed_explained_by_a_load(
    dimension: int, load: dict[str, Any], gained: float, share: float, finish: str
) -> None:
    shape, moment = (Disc(0.5), 0.5) if dimension == 2 else (Sphere(0.5), (2.0, 1.0, 0.5))
    loaded = scene(bodies=(Body("a", shape, 4.0, moment, **load),), gravity=(0.0,) * dimension, dimension=dimension)
    short = replace(loaded, duration=0.5)
    assert run(Toy({dimension}, spoiled("_twist", (0, 0), share * gained)), short, 0.1, {}).finish == finish


@pytest.mark.parametrize(("speed", "finish"), [(4.99e3, "completed"), (5.01e3, "diverged")])
def test_speed_explained_without_free_bodies(speed: float, finish: str) -> None:
    held = scene(bodies=(Body("a", Disc(0.5), motion="fixed"),), duration=0.5)  # 10 m/s^2 for half a second
    assert run(Toy({2}, spoiled("_twist", (0, 0), speed)), held, 0.1, {}).finish == finish


def test_motion_of_a_body_without_a_cause() -> None:
    still = scene(bodies=(Body("a", Disc(0.5)),), gravity=(0.0, 0.0))
    assert run(Toy({2}, spoiled("_twist", (0, 0), 1.0)), still, 0.1, {}).finish == "diverged"
    assert run(Toy({2}), still, 0.1, {}).finish == "completed"


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize(("speed", "finish"), [(0.9e-6, "completed"), (1.1e-6, "diverged"), (0.1, "diverged")])
def test_micrometre_a_second_allowed_without_a_cause(dimension: int, speed: float, finish: str) -> None:
    """A thousand times the 1e-9 m/s that are left to round-off where the scene explains no speed at all."""
    still = scene(bodies=(Body("a", Disc(0.5)),), gravity=(0.0, 0.0))
    assert run(Toy({dimension}, spoiled("_twist", (0, 0), speed)), still, 0.1, {}).finish == finish


def test_divergence_by_speed_and_not_by_spin() -> None:
    assert run(Toy({2}, spoiled("_twist", (0, 2), 1e9)), scene(), 0.1, {}).finish == "completed"


def test_steps_at_a_time_by_default() -> None:
    one, two = Flight(scene(), 0.1, lambda flight: None), Flight(scene(), 0.1, lambda flight: None)
    assert list(advances(one, 3)) == [1, 2, 3] and one.calls == [1, 1, 1]
    assert list(advances(two, 3, 2)) == [2, 3] and two.calls == [2, 1]


def test_engine_closed_after_an_exception() -> None:
    def fail(flight: Flight) -> None:
        raise RuntimeError("engine broke")

    toy = Toy({2}, fail)
    with pytest.raises(RuntimeError, match="engine broke"):
        run(toy, scene(), 0.1, {})
    assert toy.built[0].closed == 1


def test_planar_scene_lifted_and_read_back() -> None:
    toy = Toy({3})
    flat, lifted = run(Toy({2}), scene(), 0.1, {}), run(toy, scene(), 0.1, {}, Sampling(1, 0.0))
    assert toy.built[0].scene.dimension == 3
    assert np.allclose(lifted.pose, flat.pose, atol=1e-15) and np.allclose(lifted.twist, flat.twist, atol=1e-14)
    assert lifted.out_of_plane == 0.0
    assert lifted.contacts is not None and lifted.contacts.rows.impulse.shape[1] == 2


# A place is told as it is, a tilt by how far it takes the outermost point, 2 x 0.125 of the disc's radius of 0.5.
@pytest.mark.parametrize(("entry", "told"), [(1, 0.125), (4, 0.125), (6, 0.125)], ids=["place", "tilt", "roll"])
def test_departure_from_the_plane_kept_at_any_sample(entry: int, told: float) -> None:
    def sideways(flight: Flight) -> None:
        flight._pose[0, entry] = 0.125 if flight.steps == 3 else 0.0

    assert run(Toy({3}, sideways), scene(), 0.1, {}).out_of_plane == told


def test_departure_from_the_plane_only_of_lifted_scenes() -> None:
    assert run(Toy({2}), scene(), 0.1, {}).out_of_plane is None


def test_departure_from_the_plane_kept_at_a_nan() -> None:
    def sideways(flight: Flight) -> None:
        flight._pose[0, 1] = 0.125 if flight.steps == 3 else 0.0
        if flight.steps == 5:
            flight._twist[0] = math.nan

    trajectory = run(Toy({3}, sideways), scene(), 0.1, {})
    assert trajectory.finish == "diverged" and trajectory.out_of_plane == 0.125


@pytest.mark.parametrize(("name", "entry"), [("_pose", 1), ("_pose", 4), ("_twist", 1), ("_twist", 5)])
def test_nan_across_the_plane_ends_the_run(name: str, entry: int) -> None:
    """A planar scene reads nothing from there: such a run passed all of its checks."""
    trajectory = run(Toy({3}, spoiled(name, (0, entry), math.nan)), scene(), 0.1, {})
    assert trajectory.finish == "diverged" and "not finite at t = 0.4 s" in trajectory.reason


@pytest.mark.parametrize("planar", [True, False])
def test_a_quaternion_without_length_is_no_orientation(planar: bool) -> None:
    """A planar scene would read the angle 0 from it, and a box that stands still passes with that."""

    def unturned(flight: Flight) -> None:
        if flight.steps == 4:
            flight._pose[0, 3:] = 0.0
        elif flight.steps == 5:
            flight._pose[0, 3:] = (0.6, 0.0, 0.0, 0.0)  # short, but a direction

    spatial = Body("a", Sphere(0.5), 1.0, (0.1, 0.1, 0.1), (0.0, 0.0, 2.0, 1.0, 0.0, 0.0, 0.0), (0.0,) * 6)
    asked = scene() if planar else Scene("flight", 1, 3, (spatial,), (), (0.0, 0.0, -10.0), 1.0)
    toy = Toy({3}, unturned)
    with pytest.raises(EngineError, match=r"^pose: a quaternion of length 0"):
        run(toy, asked, 0.1, {})
    assert toy.built[0].closed == 1


@pytest.mark.parametrize(("length", "is_turn"), [(0.5, True), (0.499, False)])
def test_orientation_of_an_unnormalised_quaternion(length: float, is_turn: bool) -> None:
    def short(flight: Flight) -> None:
        flight._pose[0, 3:] = (0.0, 0.0, -length, 0.0) if flight.steps == 4 else (0.0, 0.0, -1.0, 0.0)

    if is_turn:
        found = run(Toy({3}, short), scene(), 0.1, {})
        assert found.finish == "completed" and abs(found.pose[4, 0, 2]) == pytest.approx(math.pi)
    else:
        with pytest.raises(EngineError, match="of length 0"):
            run(Toy({3}, short), scene(), 0.1, {})


def test_samples_read_in_batches(monkeypatch: pytest.MonkeyPatch) -> None:
    def sideways(flight: Flight) -> None:
        flight._pose[0, 1] = 0.125 if flight.steps == 2 else 0.0

    whole = run(Toy({3}, sideways), scene(), 0.1, {})
    for at_once in (1, 3, 11):
        monkeypatch.setattr("adapters.stepping.AT_ONCE", at_once)
        parts = run(Toy({3}, sideways), scene(), 0.1, {})
        assert parts.state_hash() == whole.state_hash() and len(parts.pose) == 11 and parts.out_of_plane == 0.125


def recording(monkeypatch: pytest.MonkeyPatch) -> list[tuple[int, int, bool]]:
    """Have `Flight` record many samples at once; returns what it was asked for."""
    asked: list[tuple[int, int, bool]] = []

    def record(flight: Flight, samples: int, stride: int, contacts: bool) -> Recorded:
        asked.append((samples, stride, contacts))
        found = one_by_one(flight, samples, stride)
        return found if contacts else replace(found, contacts=None)

    monkeypatch.setattr(Flight, "record", record)
    return asked


@pytest.mark.parametrize("done", [0, 6])
def test_contacts_of_samples_read_at_once(done: int) -> None:
    """As many as possible: counted one by one, from every time that lies among them and beyond."""
    dt = 0.1
    for start, most in itertools.product(range(-1, done + 6), range(6)):
        sampling = Sampling(1, None if start < 0 else start * dt)
        with_contacts = [start >= 0 and done + k + 1 >= start for k in range(most)]
        alike = [own for k, own in enumerate(with_contacts) if len(set(with_contacts[: k + 1])) == 1]
        assert _alike(sampling, dt, done, most) == (len(alike), any(alike)), (start, most)


@pytest.mark.parametrize(
    ("sampling", "in_one_call", "asked"),
    [
        (Sampling(), 256, [(10, 1, False)]),
        (Sampling(), 4, [(4, 1, False), (4, 1, False), (2, 1, False)]),
        (Sampling(4), 256, [(2, 4, False)]),  # the last two steps are less than a stride
        (Sampling(11), 256, []),
        (Sampling(1, 0.0), 4, [(4, 1, True), (4, 1, True), (2, 1, True)]),
        (Sampling(1, 0.55), 256, [(5, 1, False), (5, 1, True)]),
        (Sampling(1, 0.55), 4, [(4, 1, False), (1, 1, False), (4, 1, True), (1, 1, True)]),
    ],
)
@pytest.mark.parametrize("dimensions", [{2}, {3}])
def test_samples_read_at_once_equal_to_single_ones(
    monkeypatch: pytest.MonkeyPatch,
    dimensions: set[int],
    sampling: Sampling,
    in_one_call: int,
    asked: list[tuple[int, int, bool]],
) -> None:
    def sideways(flight: Flight) -> None:
        flight._twist[0, 1] += 0.125 if flight.steps == 2 else 0.0

    single = run(Toy(dimensions, sideways), scene(), 0.1, {}, sampling)
    monkeypatch.setattr("adapters.stepping.IN_ONE_CALL", in_one_call)
    calls, toy = recording(monkeypatch), Toy(dimensions, sideways)
    found = run(toy, scene(), 0.1, {}, sampling)
    assert calls == asked and len(toy.built) == 1 and toy.built[0].closed == 1
    assert found.state_hash() == single.state_hash() and found.t.tolist() == single.t.tolist()
    assert found.out_of_plane == single.out_of_plane
    assert (found.contacts is None) == (single.contacts is None)
    if found.contacts is not None and single.contacts is not None:
        assert found.contacts.step.tolist() == single.contacts.step.tolist()
        assert found.contacts.offset.tolist() == single.contacts.offset.tolist()
        assert found.contacts.impulse_between(0, 1).tolist() == single.contacts.impulse_between(0, 1).tolist()


@pytest.mark.parametrize(("name", "value"), [("_pose", math.nan), ("_twist", math.inf), ("_twist", 1e5)])
def test_run_ending_within_a_batch_of_samples(monkeypatch: pytest.MonkeyPatch, name: str, value: float) -> None:
    """Its engine is asked how it went at the instant at which it diverged, in a world of its own; both are closed."""
    monkeypatch.setattr(Flight, "certificate", lambda flight: {"steps": flight.steps})
    single = run(Toy({2}, spoiled(name, (0, 1), value)), scene(), 0.1, {}, Sampling(1, 0.0))
    recording(monkeypatch)
    toy = Toy({2}, spoiled(name, (0, 1), value))
    found = run(toy, scene(), 0.1, {}, Sampling(1, 0.0))
    assert found.finish == "diverged" and found.reason == single.reason and "t = 0.4 s" in found.reason
    assert found.certificate == single.certificate == {"steps": 4} and len(found.t) == 5
    assert [built.closed for built in toy.built] == [1, 1]


def test_divergence_in_the_last_sample_of_a_batch(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def burst(flight: Flight) -> None:
        if flight.steps == 10:
            flight._twist[0, 1] = 11.26e3

    recording(monkeypatch)
    found = run(Toy({2}, burst), scene(), 0.1, {})
    assert found.finish == "diverged" and "t = 1 s" in found.reason


def test_fast_spin_in_a_batch_of_samples(monkeypatch: pytest.MonkeyPatch) -> None:
    recording(monkeypatch)
    assert run(Toy({2}, spoiled("_twist", (0, 2), 1e9)), scene(), 0.1, {}).finish == "completed"


def test_exception_after_the_end_of_a_run_ignored(monkeypatch: pytest.MonkeyPatch) -> None:
    """Samples are made at once, so an engine may fail in a step that it would not have made."""

    def fails(flight: Flight) -> None:
        if flight.steps == 4:
            flight._twist[0, 1] = math.inf
        if flight.steps == 6:
            raise EngineError("state: none")

    recording(monkeypatch)
    found = run(Toy({2}, fails), scene(), 0.1, {})
    assert found.finish == "diverged" and "not finite at t = 0.4 s" in found.reason


def test_step_that_raises_its_error(monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(flight: Flight) -> None:
        if flight.steps == 6:
            raise EngineError("state: none")

    recording(monkeypatch)
    toy = Toy({2}, fails)
    with pytest.raises(EngineError, match="state: none"):
        run(toy, scene(), 0.1, {})
    assert [built.steps for built in toy.built] == [6, 6] and [built.closed for built in toy.built] == [1, 1]


@pytest.mark.parametrize("dimensions", [{2}, {3}])
def test_simulation_reusing_its_own_arrays(monkeypatch: pytest.MonkeyPatch, dimensions: set[int]) -> None:
    """Poses, twists and contacts in arrays that the next step writes into."""
    monkeypatch.setattr(Flight, "pose", lambda flight: flight._pose)
    monkeypatch.setattr(Flight, "twist", lambda flight: flight._twist)
    live: list[Contacts] = []

    def contacts(flight: Flight) -> Contacts:
        d = flight.scene.dimension
        live.append(live[0] if live else Contacts.from_rows([(0, 1, (0.0,) * d, (1.0,) * d, (0.0,) * d, 0.0)], d))
        live[0].impulse[:] = flight.steps
        return live[0]

    monkeypatch.setattr(Flight, "contacts", contacts)

    def moved(flight: Flight) -> None:
        flight._pose[0, 0] = flight.steps

    trajectory = run(Toy(dimensions, moved), scene(), 0.1, {}, Sampling(1, 0.0))
    assert trajectory.pose[:, 0, 0].tolist() == list(range(11))
    assert np.allclose(trajectory.twist[:, 0, 1], -10.0 * trajectory.t, atol=1e-14)
    assert trajectory.contacts is not None
    assert trajectory.contacts.rows.impulse[:, 0].tolist() == list(range(1, 11))


def test_planar_scene_of_an_engine_of_both_dimensions() -> None:
    assert posed_for(Toy({2, 3}), scene()).dimension == 2
    assert run(Toy({2, 3}), scene(), 0.1, {}).out_of_plane is None
    alone = Scene("s", 1, 3, (Body("a", Sphere(0.5), 1.0, (0.1,) * 3),), (), (0.0, 0.0, -9.81), 1.0)
    assert posed_for(Toy({2, 3}), alone) == alone


def with_abilities(toy: Toy, *abilities: str) -> Toy:
    toy.facts = replace(toy.facts, abilities=frozenset(abilities))
    return toy


@pytest.mark.parametrize("dimension", [2, 3])
def test_readback_of_a_belt_made_of_a_moving_half_space(dimension: int) -> None:
    """The half-space is carried along by its motion; the scene's own stands, and its surface runs."""

    def carried(flight: Flight) -> None:
        flight._pose[0, 0] = flight.steps * flight.dt * 2.0

    belt = Body("belt", HalfSpace((0.0, 1.0), 0.25), motion="fixed", surface_velocity=(2.0, 0.0))
    toy = with_abilities(Toy({dimension}, carried), "moving half-space")
    trajectory = run(toy, scene(bodies=(belt, scene().bodies[0])), 0.1, {}, Sampling(1, 0.0))
    moved = toy.built[0].scene.bodies[0]
    assert moved.motion == "prescribed" and moved.twist[0] == 2.0 and not any(moved.surface_velocity)
    assert not trajectory.pose[:, 0].any() and not trajectory.twist[:, 0].any()
    assert np.allclose(trajectory.pose[:, 1, :2], (0.0, 2.0)) and np.allclose(trajectory.twist[:, 1, 0], 1.0)
    assert trajectory.contacts is not None and len(trajectory.contacts.rows.a) > 0


def test_belts_on_engines_with_and_without_them() -> None:
    belt = Body("belt", HalfSpace((0.0, 1.0)), motion="fixed", surface_velocity=(2.0, 0.0))
    box = Body("top", Box((0.5, 0.5)), motion="fixed", surface_velocity=(2.0, 0.0))
    running, topped = scene(bodies=(belt, scene().bodies[0])), scene(bodies=(box, scene().bodies[0]))
    knows = with_abilities(Toy({2}), "surface velocity", "moving half-space")
    assert posed_for(knows, running) == running and posed_for(knows, topped) == topped
    with pytest.raises(EngineError, match=r"^belt.surface_velocity: the adapter of toy has no surface velocity$"):
        posed_for(Toy({2}), running)
    with pytest.raises(
        EngineError, match=r"^top.surface_velocity: toy supports surface velocities of fixed half-spaces only"
    ):
        posed_for(with_abilities(Toy({2}), "moving half-space"), topped)
    capsule = scene(bodies=(Body("c", Capsule(0.5, 0.1)),))
    with pytest.raises(EngineError, match=r"^c.shape: the adapter of toy has no capsule$"):
        posed_for(with_abilities(Toy({2}), "moving half-space"), capsule)


def test_step_duration_and_settings_of_a_run() -> None:
    toy, before = Toy({2}), time.perf_counter()
    trajectory = run(toy, scene(), 0.1, {"iterations": 7})
    assert 0.0 < trajectory.wall_time <= time.perf_counter() - before and trajectory.dt == 0.1
    assert toy.settings == {"iterations": 7}
    recorded = run(toy, scene(), 0.1, {}, Sampling(1, 99.0)).contacts  # from a time that never comes
    assert recorded is not None and recorded.step.dtype == recorded.offset.dtype == np.int64


def test_spatial_scene_on_a_planar_engine() -> None:
    floor = Body("floor", HalfSpace((0.0, 0.0, 1.0)), motion="fixed")
    spatial = Scene("s", 1, 3, (floor,), (), (0.0, 0.0, -9.81), 1.0)
    with pytest.raises(EngineError, match=r"^dimension: toy is planar"):
        run(Toy({2}), spatial, 0.1, {})


def test_order_of_bodies_in_rows() -> None:
    contacts = Contacts.from_rows([(2, 1, (5.0, 6.0), (0.0, 1.0), (3.0, 4.0), -0.1)], 2)
    assert (contacts.a[0], contacts.b[0], contacts.gap[0]) == (1, 2, -0.1)
    assert contacts.point.tolist() == [[5.0, 6.0]]
    assert contacts.normal.tolist() == [[0.0, -1.0]] and contacts.impulse.tolist() == [[-3.0, -4.0]]


@pytest.mark.parametrize("count", [1, 2, 3])
def test_vector_given_as_one_number_and_with_a_wrong_length(count: int) -> None:
    row = (0, 1, (5.0, 6.0), (0.0, 1.0), math.nan, 0.0)
    contacts = Contacts.from_rows([row] * count, 2)
    assert contacts.impulse.shape == (count, 2) and np.isnan(contacts.impulse).all()
    mixed = Contacts.from_rows([row, (1, 0, (5.0, 6.0), (0.0, 1.0), (3.0, 4.0), 0.0)], 2)
    assert np.isnan(mixed.impulse[0]).all() and mixed.impulse[1].tolist() == [-3.0, -4.0]
    with pytest.raises(ValueError):
        Contacts.from_rows([(0, 1, (5.0, 6.0, 7.0), (0.0, 1.0, 0.0), (0.0, 0.0, 0.0), 0.0)] * count, 2)


def test_a_missing_impulse_stays_missing_in_the_sum() -> None:
    rows = Contacts.from_rows([(0, 1, (0.0, 0.0), (0.0, 1.0), (math.nan, math.nan), 0.0)], 2)
    record = ContactRecord(np.array([1]), np.array([0, 1]), rows)
    assert np.isnan(record.impulse_between(0, 1)).all()


def test_state_hash_by_bits_and_signs_of_zero() -> None:
    trajectory = run(Toy({2}), scene(), 0.1, {})
    pose = trajectory.pose.copy()
    assert replace(trajectory, pose=np.where(pose == 0.0, -0.0, pose)).state_hash() == trajectory.state_hash()
    pose[5, 1, 1] = np.nextafter(pose[5, 1, 1], np.inf)
    assert replace(trajectory, pose=pose).state_hash() != trajectory.state_hash()
    assert run(Toy({2}), scene(), 0.1, {}).state_hash() == trajectory.state_hash()
    # The least number that there is, in place of a zero.
    least = trajectory.pose.copy()
    least[5, 1, 2] = math.ulp(0.0)
    assert trajectory.pose[5, 1, 2] == 0.0
    assert replace(trajectory, pose=least).state_hash() != trajectory.state_hash()
    assert len(trajectory.state_hash()) == 16


def test_a_trajectory_survives_its_file(tmp_path: Path) -> None:
    made = run(Toy({2}, spoiled("_pose", (1, 2), math.nan)), scene(), 0.1, {}, Sampling(1, 0.0))
    made.save(tmp_path / "t.npz")
    again = load_trajectory(tmp_path / "t.npz")
    assert again.state_hash() == made.state_hash()
    assert (again.finish, again.reason, again.initial_change) == (made.finish, made.reason, made.initial_change)
    assert again.contacts is not None and made.contacts is not None
    assert again.contacts.impulse_between(0, 1).tolist() == made.contacts.impulse_between(0, 1).tolist()
    assert json.dumps(again.readback) == json.dumps(made.readback)


def test_file_without_contacts_and_arbitrary_readback(tmp_path: Path) -> None:
    made = replace(run(Toy({2}), scene(), 0.1, {}), readback={"file": tmp_path, "steps": 3})
    made.save(tmp_path / "t.npz")
    again = load_trajectory(tmp_path / "t.npz")
    assert again.contacts is None
    assert again.readback == {"file": str(tmp_path), "steps": 3}


def test_a_file_that_holds_objects_is_not_read(tmp_path: Path) -> None:
    """Objects are pickles, and reading one runs what it says."""
    run(Toy({2}), scene(), 0.1, {}).save(tmp_path / "t.npz")
    with np.load(tmp_path / "t.npz") as data:
        arrays = dict(data)
    np.savez(tmp_path / "o.npz", allow_pickle=True, **(arrays | {"t": np.array([0.0, 1.0], dtype=object)}))
    with pytest.raises(ValueError, match="allow_pickle"):
        load_trajectory(tmp_path / "o.npz")


def test_contacts_of_two_bodies_without_a_third() -> None:
    flat = ((0.0, 0.0), (0.0, 1.0))
    rows = Contacts.from_rows([(a, b, *flat, (0.0, force), 0.0) for a, b, force in
                               ((0, 1, 1.0), (0, 2, 2.0), (1, 2, 4.0), (0, 1, 8.0))], 2)  # fmt: skip
    record = ContactRecord(np.array([1, 2]), np.array([0, 3, 4]), rows)
    assert record.impulse_between(1, 0).tolist() == [[0.0, 1.0], [0.0, 8.0]]
    assert record.impulse_between(2, 1).tolist() == [[0.0, 4.0], [0.0, 0.0]]
    sample, impulse = record.between(0, 2)
    assert (sample.tolist(), impulse.tolist()) == ([0], [[0.0, 2.0]])


def test_iteration_count_of_settings() -> None:
    toy = Toy({2})
    assert [s.value for s in toy.settings("only", None, 0.1, 7)] == [7]  # type: ignore[arg-type]
    with pytest.raises(EngineError, match=r"^profile: toy has no profile 'best'"):
        toy.settings("best", None, 0.1)  # type: ignore[arg-type]
    toy.profiles = {"free": lambda needs, dt: [Setting("slop", 0.1, "a toy")]}
    with pytest.raises(EngineError, match=r"^iterations: "):
        toy.settings("free", None, 0.1, 7)  # type: ignore[arg-type]


# ---- what a scene at rest without loads can explain ----


def two_cubes(depth, dimension=3, gap_of_place=0.071, duration=0.1):
    """Two boxes of 71 mm at rest without loads, one ``depth`` deep in the other."""
    turn = (0.0,) if dimension == 2 else (1.0, 0.0, 0.0, 0.0)
    inertia = 1.0 if dimension == 2 else (1.0, 1.0, 1.0)
    places = (
        [(0.0, 0.0), (0.0, gap_of_place - depth)] if dimension == 2 else [(0.0,) * 3, (0.0, gap_of_place - depth, 0.0)]
    )
    boxes = (Body(f"b{k}", Box((0.0355,) * dimension), 1.0, inertia, (*x, *turn)) for k, x in enumerate(places))
    return Scene("cubes", 1, dimension, tuple(boxes), (), (0.0,) * dimension, duration)


def parting_at(speed):
    def spoil(flight):
        flight._twist[1, 1] = speed

    return spoil


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("depth", [4.9e-5, 1e-3, 0.02])
@pytest.mark.parametrize("speed", [1e-3, 0.2, 5.0])
def test_fast_separation_of_overlapping_bodies_at_rest(dimension, depth, speed):
    found = run(Toy({dimension}, parting_at(speed)), two_cubes(depth, dimension), 1 / 240, {})
    assert found.finish == "completed" and found.twist[-1, 1, 1] == speed


def test_separation_speed_limit_of_an_overlap_in_a_long_run():
    """A step that undoes 20 mm makes 4.8 m/s; a thousand times that is no answer, nor anything where none overlap."""
    fast = 1e3 * 0.02 * 240.0
    scene = two_cubes(0.02, duration=100.0)
    assert run(Toy({3}, parting_at(0.9 * fast)), scene, 1 / 240, {}, Sampling(24000)).finish == "completed"
    diverged = run(Toy({3}, parting_at(1.1 * fast)), scene, 1 / 240, {}, Sampling(24000))
    assert diverged.finish == "diverged" and "which nothing in the scene explains" in diverged.reason
    apart = run(Toy({3}, parting_at(0.9 * fast)), two_cubes(-0.02, duration=100.0), 1 / 240, {}, Sampling(24000))
    assert apart.finish == "diverged"


@pytest.mark.parametrize("name", registry.names())
def test_world_closed_at_the_end_of_a_run(monkeypatch, name):
    """What `record` raises leads to a second world, which goes step by step: only its time would tell."""
    engine = registry.find(name).engine
    if engine is None:
        pytest.skip(f"{name} is not installed")
    profile = next(iter(engine.profiles))
    scene = accepted(engine, profile, resting(), resting(box=False))
    made, build = [], type(engine).build
    monkeypatch.setattr(type(engine), "build", lambda *given: made.append(build(*given)) or made[-1])
    assert run(engine, scene, 1 / 60, values(engine, profile, scene)).finish == "completed"
    assert len(made) == 1
