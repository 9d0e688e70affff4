"""Chipmunk's deviation laws hold at points that were not used to derive them, and fail where they should."""

from __future__ import annotations

import math

import numpy as np
import pytest

pytest.importorskip("pymunk")

from adapters.chipmunk import ChipmunkEngine
from adapters.chipmunk.laws import DEVIATIONS, flight, predicted_bounce
from adapters.law import Deviation
from adapters.needs import needs
from adapters.scene import Scene
from adapters.stepping import run
from adapters.trajectory import Measured, Trajectory
from validation.catalogue import CATALOGUE

ENGINE = ChipmunkEngine()


def drive(scene: Scene, profile: str, dt: float) -> tuple[Trajectory, dict[str, Measured]]:
    canonical = CATALOGUE[scene.name]
    chosen = {s.name: s.value for s in ENGINE.settings(profile, needs(scene), dt)}
    trajectory = run(ENGINE, scene, dt, chosen, canonical.sampling(scene))
    return trajectory, canonical.measure(scene, trajectory)


def said_by(law: Deviation, scene: Scene, dt: float) -> tuple[float, float] | None:
    return law.law(scene, dt, CATALOGUE[scene.name].measure)


def law_for(profile: str, scene: str, metric: str) -> Deviation:
    (found,) = [d for d in DEVIATIONS if d.covers("chipmunk", ENGINE.version(), profile, scene, metric)]
    return found


@pytest.mark.few(10)
@pytest.mark.parametrize("profile", ["default", "tuned"])
@pytest.mark.parametrize("dt", [1 / 60, 1 / 217, 1 / 960])
@pytest.mark.parametrize(("e", "height"), [(0.0, 1.0), (0.47, 0.613), (0.8, 1.0371), (0.93, 2.19), (1.0, 1.07)])
def test_the_recurrence_is_the_engine_to_round_off(profile: str, dt: float, e: float, height: float) -> None:
    scene = CATALOGUE["bounce"].scene(2, {"e": e, "height": height})
    trajectory, measured = drive(scene, profile, dt)
    predicted = predicted_bounce(scene, profile, dt)
    assert predicted is not None
    # A few roundings a step of numbers below 10, for up to 1e4 steps of a random walk.
    assert np.abs(predicted.pose - trajectory.pose).max() < 1e-12
    assert np.abs(predicted.twist - trajectory.twist).max() < 1e-12
    for metric in measured:
        verdict = said_by(law_for(profile, "bounce", metric), scene, dt)
        assert verdict is not None
        assert abs(measured[metric][0] - verdict[0]) <= verdict[1], metric  # type: ignore[operator]


def test_the_push_out_of_a_deep_ball_is_in_the_recurrence() -> None:
    # At 1/20 s the ball is found up to 0.22 m deep, past the shipped slop of 0.1 m.
    scene = CATALOGUE["bounce"].scene(2, {"e": 0.9, "height": 1.013})
    trajectory, _ = drive(scene, "default", 1 / 20)
    predicted = predicted_bounce(scene, "default", 1 / 20)
    assert predicted is not None and (0.5 - predicted.pose[:, 1, 1]).max() > 0.1
    assert np.abs(predicted.pose - trajectory.pose).max() < 1e-12


def test_the_law_differs_from_the_textbook_by_more_than_its_band() -> None:
    scene = CATALOGUE["bounce"].scene(2, {"e": 0.8, "height": 1.0})
    verdict = said_by(law_for("default", "bounce", "apex[1]"), scene, 1 / 240)
    assert verdict is not None and abs(verdict[0] - 0.64) > 1e5 * verdict[1]


@pytest.mark.parametrize("changed", [{"e": 0.801}, {"height": 1.001}, {"g": 9.80}])
def test_the_law_notices_a_change_of_a_thousandth(changed: dict[str, float]) -> None:
    asked = {"e": 0.8, "height": 1.0, "g": 9.81}
    make = CATALOGUE["bounce"].scene
    _, measured = drive(make(2, asked | changed), "tuned", 1 / 240)
    verdict = said_by(law_for("tuned", "bounce", "apex[2]"), make(2, asked), 1 / 240)
    assert verdict is not None and abs(measured["apex[2]"][0] - verdict[0]) > 100.0 * verdict[1]  # type: ignore[operator]


def test_an_elastic_ball_keeps_its_energy_in_the_recurrence() -> None:
    # Without push-out the recurrence with e = 1 is time-reversible: m v^2/2 + m g (y + v dt/2) is conserved.
    dt, g = 1 / 240, 9.81
    y, v = flight(1.03, 0.0, 1.0, g, 5000, dt, 0.1, 1.0)
    energy = 0.5 * v**2 + g * (y + 0.5 * v * dt)
    assert np.abs(energy / energy[0] - 1.0).max() < 1e-12


def test_per_bounce_the_apex_is_as_its_closed_form_says() -> None:
    # h+ = e^2 h + (1 - e^2) x_p + dt |v| e (1 - e)/2, with position and velocity sampled at the impact step;
    # sampling of the apex leaves g dt^2/8.
    e, g, dt = 0.5, 9.81, 1 / 1000
    for height in np.linspace(1.0, 1.1, 7):
        y, v = flight(float(height), 0.0, e, g, 1000, dt, 0.1, 1.0)
        hit = int(np.flatnonzero(y <= 0.0)[0])
        apex = y[hit : hit + 400].max()
        expected = e * e * height + (1 - e * e) * y[hit] + dt * abs(v[hit - 1]) * e * (1 - e) / 2
        assert abs(apex - expected) <= g * dt * dt / 8 * (1.0 + 1e-9)


@pytest.mark.parametrize("dt", [1 / 240, 1 / 480, 1 / 960])
@pytest.mark.parametrize("n", [1, 2, 4, 7])
def test_the_tuned_column_stays_where_it_starts_and_sinks_less_than_a_step_of_fall(n: int, dt: float) -> None:
    scene = CATALOGUE["stack"].scene(2, {"n": n, "duration": 2.0})
    _, measured = drive(scene, "tuned", dt)
    start = 0.3 * 9.81 * dt * dt
    assert start <= measured["penetration"][0] <= 9.81 * dt * dt  # type: ignore[operator]


@pytest.mark.parametrize(("mu", "g", "dt"), [(0.5, 9.81, 1 / 240), (0.3, 1.62, 1 / 100), (0.1, 24.8, 1 / 700)])
def test_a_single_touching_box_is_caught_one_step_of_fall_deep(mu: float, g: float, dt: float) -> None:
    scene = CATALOGUE["stack"].scene(2, {"n": 1, "mu": mu, "g": g, "mass": 3.0, "duration": 2.0})
    _, measured = drive(scene, "default", dt)
    verdict = said_by(law_for("default", "stack", "penetration"), scene, dt)
    assert verdict is not None and math.isclose(verdict[0], g * dt * dt)
    assert abs(measured["penetration"][0] - verdict[0]) <= verdict[1]  # type: ignore[operator]


def test_laws_are_silent_where_they_know_nothing() -> None:
    stack = CATALOGUE["stack"].scene
    single = law_for("default", "stack", "penetration")
    assert said_by(single, stack(2, {"n": 2}), 1 / 240) is None
    assert said_by(single, stack(2, {"n": 1, "mu": 0.0}), 1 / 240) is None
    assert said_by(single, stack(2, {"n": 1, "mu": 0.8}), 1 / 240) is None
    assert said_by(single, stack(3, {"n": 1}), 1 / 240) is None
    assert said_by(law_for("tuned", "bounce", "apex[1]"), CATALOGUE["bounce"].scene(3), 1 / 240) is None


def test_laws_speak_only_of_the_versions_they_were_checked_on() -> None:
    assert all(not d.covers("chipmunk", "8.0.0", "default", d.scene, "apex[1]") for d in DEVIATIONS)
    assert all(d.because and d.source and d.versions for d in DEVIATIONS)
