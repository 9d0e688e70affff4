"""MuJoCo's deviation laws, at points that were not used to write them, against the engine itself and closed forms."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

pytest.importorskip("mujoco")

from adapters.engine_folder import covering
from adapters.law import metric_of
from adapters.mujoco import MujocoEngine
from adapters.mujoco.contact_law import ContactLaw, Impedance, softness_of
from adapters.mujoco.laws import DEVIATIONS
from adapters.mujoco.predictions import box_on_face
from adapters.needs import needs
from adapters.scene import Scene
from adapters.stepping import run
from validation.canonical import Check
from validation.catalogue import CATALOGUE

ENGINE = MujocoEngine()
VERSION = "4.0.1"
DT = 1.0 / 240.0
STOCK = (0.9, 0.95, 0.001, 0.5, 2.0)
Row = tuple[float | None, tuple[float, float] | None, Check]


def make(name: str, dimension: int = 2, **params: float) -> Scene:
    return CATALOGUE[name].scene(dimension, params)


def compare(profile: str, dt: float, name: str, dimension: int = 2, **params: float) -> dict[str, Row]:
    """Measured value, prediction (or None) and check of every judged metric."""
    canonical, scene = CATALOGUE[name], make(name, dimension, **params)
    settings = {s.name: s.value for s in ENGINE.settings(profile, needs(scene), dt)}
    measured = canonical.measure(scene, run(ENGINE, scene, dt, settings, canonical.sampling(scene)))
    rows: dict[str, Row] = {}
    for check in canonical.checks(scene, dt):
        laws = covering("mujoco", VERSION, profile, name, check.metric)
        said = [found for found in (law.law(scene, dt, canonical.measure) for law in laws) if found is not None]
        assert len(said) <= 1
        rows[check.metric] = (measured[check.metric][0], said[0] if said else None, check)
    return rows


def assert_predicted(rows: dict[str, Row], *metrics: str) -> None:
    """Every prediction holds, and ``metrics`` are predicted."""
    for metric, (value, prediction, _) in rows.items():
        if prediction is not None:
            assert value is not None and abs(value - prediction[0]) <= prediction[1], (metric, value, prediction)
    assert {metric for metric in metrics if rows[metric][1] is None} == set()


# ---- a ball ---------------------------------------------------------------------------------------------------

IMPACT = ("rebound_ratio", "rebound_speed", "velocity_change", "impulse", "momentum_defect")


@pytest.mark.parametrize("profile", ["default", "tuned"])
@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize(
    ("e", "v", "dt"),
    [(0.63, 0.37, 1 / 240), (0.91, 4.7, 1 / 240), (0.07, 23.0, 1 / 130), (0.5, 2.9, 1 / 777), (0.77, 88.0, 1 / 55)],
)
def test_all_five_numbers_of_an_impact_are_predicted(profile, dimension, e, v, dt) -> None:
    rows = compare(profile, dt, "impact", dimension, e=e, v=v, delay=0.061)
    assert_predicted(rows, *IMPACT)


@pytest.mark.parametrize("mu", [0.03, 0.4, 1.3])
def test_pyramid_of_a_central_impact_with_friction(mu: float) -> None:
    rows = compare("default", DT, "impact", e=0.5, v=3.3, mu=mu)
    assert_predicted(rows, *IMPACT)
    value, smooth = rows["rebound_ratio"][0], compare("default", DT, "impact", e=0.5, v=3.3)["rebound_ratio"][0]
    assert value != smooth


def test_mass_and_radius_enter_only_where_they_should() -> None:
    rows = compare("default", DT, "impact", e=0.4, v=3.1, mass=7.0, radius=0.21)
    assert_predicted(rows, *IMPACT)
    same = compare("default", DT, "impact", e=0.4, v=3.1)
    assert rows["rebound_ratio"][0] == pytest.approx(same["rebound_ratio"][0], rel=1e-9)


def test_mujoco_impact_law_excludes_a_millionth() -> None:
    _, prediction, check = compare("default", DT, "impact", e=0.63, v=4.7)["rebound_ratio"]
    assert prediction is not None
    centre, band = prediction
    assert abs(check.truth - centre) > 1e6 * band and band < 1e-6 * centre


@pytest.mark.parametrize("profile", ["default", "tuned"])
@pytest.mark.parametrize(("e", "height", "dt"), [(0.77, 0.83, 1 / 240), (0.5, 1.31, 1 / 150), (1.0, 0.61, 1 / 500)])
def test_apexes_and_rest_of_a_bounce_are_predicted(profile, e, height, dt) -> None:
    rows = compare(profile, dt, "bounce", 3, e=e, height=height)
    assert_predicted(rows, *rows)


def test_plastic_ball_rebound_by_the_rest_spring() -> None:
    rows = compare("tuned", DT, "bounce", e=0.0, height=0.97)
    assert_predicted(rows, "rest_time")


# ---- a column -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize(("n", "dt"), [(1, 1 / 700), (3, 1 / 240), (7, 1 / 100), (13, 1 / 300)])
def test_sinking_of_a_stack_is_predicted(dimension: int, n: int, dt: float) -> None:
    assert_predicted(compare("default", dt, "stack", dimension, n=n, duration=2.0), "penetration", "settle_time")


def test_friction_mass_and_gravity_in_the_column_law() -> None:
    rows = compare("default", DT, "stack", n=4, mu=0.9, mass=3.0, g=3.7, duration=2.0)
    assert_predicted(rows, "penetration", "settle_time")


def test_column_law_excludes_the_textbook() -> None:
    _, prediction, check = compare("default", 1 / 960, "stack", n=12, duration=2.0)["penetration"]
    assert (
        prediction is not None and prediction[0] - prediction[1] > check.bound and prediction[1] < 0.5 * prediction[0]
    )


# ---- a box on an incline --------------------------------------------------------------------------------------


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize(("ratio", "dt"), [(0.31, 1 / 240), (0.73, 1 / 170), (0.95, 1 / 240), (0.997, 1 / 400)])
def test_creep_of_the_default_is_predicted(dimension: int, ratio: float, dt: float) -> None:
    assert_predicted(compare("default", dt, "incline", dimension, ratio=ratio), "creep")


@pytest.mark.parametrize("profile", ["default", "tuned"])
@pytest.mark.parametrize(
    ("ratio", "dt"), [(1.0017, 1 / 240), (1.07, 1 / 130), (1.4, 1 / 240), (2.3, 1 / 400), (2.1, 1 / 500)]
)
def test_acceleration_of_a_slide_is_predicted(profile: str, ratio: float, dt: float) -> None:
    assert_predicted(compare(profile, dt, "incline", ratio=ratio), "acceleration")


def test_mu_and_mass_in_the_law_of_slides() -> None:
    for profile in ("default", "tuned"):
        assert_predicted(compare(profile, DT, "incline", ratio=1.3, mu=0.23, mass=4.0), "acceleration")


def test_sharpness_of_the_slide_law() -> None:
    for profile in ("default", "tuned"):
        _, prediction, check = compare(profile, DT, "incline", ratio=2.0)["acceleration"]
        assert prediction is not None
        assert abs(prediction[0] - check.truth) > check.bound and prediction[1] < 0.1 * abs(prediction[0] - check.truth)


def test_box_law_at_sticking_corners_as_documented_creep() -> None:
    """``(1 - d)/(d b n impratio) g sin(theta)``, up to the rear corner's limit tan(theta) = mu/(1 + mu)."""
    for ratio in (0.2, 0.4, 0.6):
        scene = make("incline", ratio=ratio)
        box = box_on_face("tuned", scene, DT)
        assert box is not None
        path = np.array(box.slide(480))
        creep = (path[-1, 0] - path[240, 0]) / (240 * DT)
        d, b = 0.9999, 2.0 / (0.9999 * 0.05)
        assert creep == pytest.approx((1 - d) / (d * b * 4 * 100) * scene.gravity[0], rel=1e-5)


# ---- the scalar law against closed forms ----------------------------------------------------------------------


def test_small_step_rebound_of_a_spring_that_never_pulls() -> None:
    """zeta = 1: the force ends where 2 v = -omega r, at e = exp(-2) [Schwager and Poeschel 2007]."""
    rigid = (0.9999, 0.9999, 0.001, 0.5, 1.0)
    law = ContactLaw.of(1e-6, (0.02, 1.0), rigid, 1.0)
    assert law.rebound_ratio(1.0, 0.5) == pytest.approx(math.exp(-2.0), rel=1e-3)  # first order in dt/tc = 5e-5


def test_reflection_gives_e_at_every_phase() -> None:
    rigid = (0.9999, 0.9999, 0.001, 0.5, 1.0)
    for e in (0.0, 0.3, 1.0):
        law = ContactLaw.of(DT, (0.0, -(1.0 + e) / DT), rigid, 1.0)
        for phase in (0.01, 0.5, 1.0):
            assert law.rebound_ratio(3.0, phase) == pytest.approx(e, abs=1e-14)


def test_rest_depth_is_the_documented_one() -> None:
    """``r = a (1 - d) timeconst^2 dampratio^2`` for a constant impedance."""
    law = ContactLaw.of(DT, (0.03, 0.7), (0.8, 0.8, 0.001, 0.5, 2.0), 1.0)
    gap, velocity = 0.0, 0.0
    for _ in range(2000):
        gap, velocity, _ = law.advance(gap, velocity, -9.81)
    assert gap == pytest.approx(-9.81 * 0.2 * 0.03**2 * 0.7**2, rel=1e-9)


def test_impedance_over_the_width() -> None:
    d = Impedance.of(STOCK)
    assert (d(0.0), d(-0.001), d(-1.0)) == (0.9, 0.95, 0.95)
    assert d(-0.0005) == pytest.approx(0.925) and d(-0.00025) == pytest.approx(0.9 + 0.05 * 2 * 0.25**2)
    assert Impedance.of((0.0, 1.0, 0.001, 0.5, 2.0))(-1.0) == 0.9999


def test_softness_of_a_pyramid_of_mu_one() -> None:
    assert (
        softness_of("pyramidal", 3, 1.0) == 1.0 == softness_of("elliptic", 3, 0.2) == softness_of("pyramidal", 1, 0.2)
    )


# ---- as data --------------------------------------------------------------------------------------------------


def test_laws_with_reason_source_version_and_scene() -> None:
    others: dict[str, Any] = {"impact": make("stack", n=2), "bounce": make("incline"), "stack": make("incline")}
    for law in DEVIATIONS:
        assert (
            law.because
            and law.source
            and law.covers("mujoco", VERSION, law.profiles[0], law.scene, metric_of(law.metric))
        )
        other = others.get(law.scene, make("impact"))
        assert law.law(other, DT, CATALOGUE[other.name].measure) is None
