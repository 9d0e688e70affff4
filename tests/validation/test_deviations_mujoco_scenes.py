"""MuJoCo's laws of blows, stops and unequal pairs: they predict the engine, and their bands explain nothing else."""

import pytest

from adapters.engine_folder import covering
from validation.catalogue import CATALOGUE
from validation.cells import Slot
from validation.running.execution import execute

pytest.importorskip("mujoco")
DT = 1 / 240
#: Scene, parameters, profile, dimension, and the metrics that a law speaks about and that are off.
CELLS = [
    ("head_on", {}, "default", 2, {"rebound_ratio", "first_speed", "second_speed", "impulse"}),
    ("head_on", {"ratio": 1e6, "e": 0.5}, "default", 3, {"rebound_ratio", "first_speed", "impulse"}),
    ("flat_box", {"aspect": 4.0, "e": 0.8}, "default", 3, {"rebound_ratio", "impulse"}),
    ("flat_box", {}, "tuned", 2, {"rebound_ratio", "impulse"}),
    ("flat_box", {"e": 1.0}, "tuned", 3, {"rebound_ratio", "impulse"}),
    ("off_centre", {}, "tuned", 2, {"ball_speed", "bar_speed", "spin", "impulse", "energy_lost"}),
    (
        "off_centre",
        {"offset": 0.3, "e": 1.0},
        "tuned",
        3,
        {"ball_speed", "bar_speed", "spin", "impulse", "energy_lost"},
    ),
    ("heavy_on_light", {}, "default", 2, {"penetration"}),
    ("heavy_on_light", {"ratio": 1e4}, "tuned", 3, {"penetration"}),
    ("slide", {}, "default", 2, {"braking", "hop", "turned"}),
    ("slide", {}, "tuned", 3, {"braking", "hop"}),
    ("slide", {"heading": 22.5}, "tuned", 3, {"braking", "hop"}),
    ("conveyor", {}, "default", 2, {"pull", "hop", "turned"}),
    ("conveyor", {}, "tuned", 3, {"pull", "hop"}),
    ("conveyor", {"heading": 22.5}, "tuned", 3, {"pull", "hop"}),
    ("oblique", {"mu": 0.1}, "default", 2, {"rebound_ratio", "forward_speed", "spin_speed"}),
    ("oblique", {"mu": 0.1, "heading": 30.0}, "tuned", 3, {"rebound_ratio", "forward_speed", "spin_speed"}),
    ("oblique", {"v": 1.0, "spin": -10.0, "mu": 1.0}, "default", 3, {"rebound_ratio", "forward_speed", "spin_speed"}),
    ("slide_to_roll", {}, "default", 2, {"rolling_time", "rolling_place", "hop"}),
    ("slide_to_roll", {"heading": 30.0}, "tuned", 3, {"hop"}),
    ("roll_incline", {"ratio": 1.5}, "default", 3, {"acceleration", "turning", "hop"}),
    ("roll_incline", {"ratio": 1.5}, "tuned", 2, {"acceleration", "turning", "hop"}),
]


@pytest.mark.few(12)
@pytest.mark.parametrize(("name", "params", "profile", "dimension", "off"), CELLS)
def test_law_prediction_for_its_scene_only(name, params, profile, dimension, off):
    canonical = CATALOGUE[name]
    scene = canonical.scene(dimension, params)
    slot = Slot(name, canonical.minimal(params), dimension, "mujoco", profile, DT)
    measured = execute(slot)
    checks = {check.metric: check for check in canonical.checks(scene, DT)}
    assert {m for m in off if abs(measured.metrics[m][0] - checks[m].truth) > checks[m].bound} == off
    for metric in off:
        (law,) = covering("mujoco", measured.engine_version, profile, name, metric)
        value, band = law.law(scene, DT, canonical.measure)
        found, truth = measured.metrics[metric][0], checks[metric].truth
        assert abs(found - value) <= band, metric
        assert band < 0.2 * abs(found - truth), "a band as wide as what it explains"


@pytest.mark.parametrize(
    ("name", "params", "profile", "metric"),
    [
        ("slide", {"heading": 22.5}, "default", "braking"),
        ("slide", {"heading": 45.0}, "default", "hop"),
        ("slide_to_roll", {"heading": 30.0}, "default", "hop"),
        ("oblique", {"heading": 30.0}, "default", "spin_speed"),
    ],
)
def test_a_pyramid_off_its_axis_is_not_predicted(name, params, profile, metric):
    (law,) = covering("mujoco", "4.0.1", profile, name, metric)
    assert law.law(CATALOGUE[name].scene(3, params), DT, CATALOGUE[name].measure) is None


def test_law_of_a_belt_in_the_room():
    """From rest to the belt's velocity, on the floor's level."""
    canonical, seen = CATALOGUE["conveyor"], []
    (law,) = covering("mujoco", "4.0.1", "tuned", "conveyor", "pull")
    scene = canonical.scene(3, {"heading": 22.5})
    law.law(scene, DT, lambda scene, trajectory: seen.append(trajectory) or canonical.measure(scene, trajectory))
    run = scene.bodies[0].surface_velocity
    assert seen[0].twist[0, 1, :3] == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)
    assert seen[0].twist[-1, 1, :3] == pytest.approx(run, abs=1e-3)


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("whirl", [-4.0, -2.0, 2.0])
@pytest.mark.parametrize("delay", [0.0511, 0.0518, 0.0525])
def test_energy_loss_of_a_spinning_bar(delay, whirl, dimension):
    canonical, dt = CATALOGUE["off_centre"], 1 / 960
    params = {"whirl": whirl, "delay": delay}
    scene = canonical.scene(dimension, params)
    (law,) = covering("mujoco", "4.0.1", "tuned", "off_centre", "energy_lost")
    found = execute(Slot("off_centre", params, dimension, "mujoco", "tuned", dt)).metrics["energy_lost"][0]
    value, band = law.law(scene, dt, canonical.measure)
    assert abs(found - value) <= band < 0.1 * abs(found - canonical.exact(scene)["energy_lost"])
    (spin,) = covering("mujoco", "4.0.1", "tuned", "off_centre", "spin")
    assert spin.law(scene, dt, canonical.measure) is None


def test_no_prediction_of_a_bar_on_soft_contact():
    assert not list(covering("mujoco", "4.0.1", "default", "off_centre", "spin"))
