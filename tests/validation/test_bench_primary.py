"""The declared error of each scene: zero for the truth, and in the stated unit for a planted error."""

import math
from dataclasses import replace

import pytest

from adapters.scene import Body, Disc, Pair, Scene, SceneError
from validation.canonical import GRAVITY
from validation.catalogue import CATALOGUE
from validation.files import distance
from validation.files.distance import CERTIFIED, DISTANCE, primary_of
from validation.posed import resolve

DT = 1 / 240


def lowest(scene):
    """The plane, of scenes that exist in it."""
    return min(resolve(scene).dimensions)


def error(scene, params, metrics, dt=DT):
    made = resolve(scene).scene(lowest(scene), params)
    return primary_of(scene).error(made, dt, {name: (value, "") for name, value in metrics.items()})


def truth(scene, params):
    return dict(resolve(scene).exact(resolve(scene).scene(lowest(scene), params)))


def test_declared_error_of_every_scene():
    for scene in CATALOGUE:
        primary = primary_of(scene)
        assert primary.because and primary.law and primary.state


@pytest.mark.parametrize("scene", sorted(CATALOGUE))
def test_the_truth_itself_has_no_error(scene):
    for params in primary_of(scene).variations(DT):
        assert error(scene, params, truth(scene, params)) == (0.0, "")


@pytest.mark.parametrize("scene", sorted(CATALOGUE))
def test_accepted_variations_at_any_step(scene):
    for dt in (1 / 30, DT, 1 / 7680):
        for params in primary_of(scene).variations(dt):
            resolve(scene).complete(params)


def test_sixteen_phases_of_impacts():
    phases = sorted(p["delay"] / DT % 1.0 for p in primary_of("impact").variations(DT))
    gaps = [b - a for a, b in zip(phases, [*phases[1:], phases[0] + 1.0], strict=True)]
    assert len(phases) == 16
    assert max(gaps) == pytest.approx(1 / 16, abs=1e-9)
    assert len({params["height"] for params in primary_of("bounce").variations(DT)}) == 16


def test_error_e_of_a_dead_rebound():
    assert error("impact", {"e": 0.8}, {"rebound_ratio": 0.0})[0] == pytest.approx(0.8)


def test_apex_error_relative_to_the_drop_while_resolved():
    metrics = truth("bounce", {"e": 0.5, "height": 1.0})
    # 4.43 m/s halves with every bounce; 20 g dt is 0.82 m/s: 1.1 m/s (n = 2) is resolved, 0.55 (n = 3) is not.
    assert error("bounce", {"e": 0.5}, {**metrics, "apex[2]": metrics["apex[2]"] + 0.03})[0] == pytest.approx(0.03)
    assert error("bounce", {"e": 0.5}, {**metrics, "apex[3]": 5.0})[0] == 0.0
    speed = math.sqrt(2.0 * GRAVITY)
    assert 0.5**2 * speed > 20.0 * GRAVITY * DT > 0.5**3 * speed


def test_step_without_a_resolved_apex_has_no_error():
    value, reason = error("bounce", {"e": 0.5}, truth("bounce", {"e": 0.5}), dt=1 / 10)
    assert value is None and "no apex" in reason


def test_a_column_may_neither_drift_nor_sink():
    metrics = truth("stack", {"n": 10})
    assert error("stack", {"n": 10}, {**metrics, "drift": 0.3, "penetration": 0.1})[0] == 0.3
    assert error("stack", {"n": 10}, {**metrics, "drift": 0.1, "penetration": 0.2})[0] == 0.2


def test_equal_errors_of_creep_and_acceleration():
    duration = resolve("incline").complete({})["duration"]
    astray = 0.05  # [m] over the whole run
    creep = error("incline", {"ratio": 0.9}, {"creep": astray / duration})[0]
    exact = truth("incline", {"ratio": 1.1})["acceleration"]
    slide = error("incline", {"ratio": 1.1}, {"acceleration": exact + 2.0 * astray / duration**2})[0]
    assert creep == pytest.approx(slide, rel=1e-9)


def test_a_scene_without_a_declared_error_is_refused(monkeypatch):
    monkeypatch.setattr(distance, "resolve", lambda name: replace(CATALOGUE["bounce"], name=name, primary=None))
    with pytest.raises(SceneError, match="no primary error is declared for 'mine', only for "):
        primary_of("mine")


def test_the_error_of_a_file_is_a_distance():
    """Of the centre that is farthest off; one whose place is no number has no error."""
    bodies = tuple(Body(name, Disc(1.0), 1.0, 1.0, pose=(0.0, 0.0, 0.0)) for name in "ab")
    scene = Scene("mine", 1, 2, bodies, (Pair(),), (0.0, 0.0), 1.0, {})
    places = {"final[a.x]": 1.0, "final[a.y]": 2.0, "final[b.x]": 0.0, "final[b.y]": 0.0}
    exact = {CERTIFIED + name: (value, "") for name, value in places.items()}

    def distance(**changed):
        moved = places | {f"final[{name.replace('_', '.')}]": value for name, value in changed.items()}
        return DISTANCE.error(scene, 0.1, {**exact, **{name: (value, "it is lost") for name, value in moved.items()}})

    assert distance() == (0.0, "")
    assert distance(a_x=4.0, a_y=6.0, b_x=0.5) == (5.0, "")
    assert distance(b_y=None) == (None, "it is lost")
