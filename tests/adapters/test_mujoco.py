"""The MuJoCo adapter, driven through the one step loop on small scenes with known answers."""

from __future__ import annotations

import math
import os
import subprocess
import sys
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("mujoco")

from driven import FLOOR, driven

from adapters.engine import EngineError
from adapters.mujoco import MujocoEngine
from adapters.mujoco.moving import enter_motions
from adapters.mujoco.pairs import contact_law, pair_solreffriction
from adapters.mujoco.simulation import MujocoSimulation
from adapters.mujoco.spec import Spec
from adapters.needs import needs
from adapters.receipts import _probe, receipts
from adapters.scene import Body, Box, Disc, HalfSpace, Pair, Scene, Sphere
from adapters.stepping import run
from adapters.trajectory import Sampling

ENGINE = MujocoEngine()
settings, drive = driven(ENGINE, "default")
FLAT = Body("floor", HalfSpace((0.0, 1.0)), motion="fixed")
CUBE = (1.0 / 6.0,) * 3
BALL = (0.1,) * 3
PROFILES = ("default", "tuned", "matched")
DT = 1.0 / 240.0
G = 9.81
#: A thousand roundings of 2.2e-16, and a factor of five for their order.
ROUND_OFF = 1e-12


def at(x: float, y: float, z: float) -> tuple[float, ...]:
    return (x, y, z, 1.0, 0.0, 0.0, 0.0)


def ball(name: str, z: float, vz: float = 0.0, mass: float = 1.0, x: float = 0.0, **changes: Any) -> Body:
    body = Body(name, Sphere(0.5), mass, tuple(mass * i for i in BALL), at(x, 0.0, z), (0.0, 0.0, vz, 0.0, 0.0, 0.0))
    return replace(body, **changes)


def cube(name: str, z: float, x: float = 0.0, **changes: Any) -> Body:
    return replace(Body(name, Box((0.5, 0.5, 0.5)), 1.0, CUBE, at(x, 0.0, z)), **changes)


def make(
    *bodies: Body,
    e: float = 0.0,
    mu: float = 0.0,
    g: tuple[float, ...] | None = None,
    T: float = 0.5,
    pairs: tuple[Pair, ...] = (),
) -> Scene:
    dimension = 2 if len(bodies[-1].pose) == 3 else 3
    pairs = (Pair(restitution=e, friction=mu), *pairs)
    return Scene("test", 1, dimension, bodies, pairs, g or (0.0,) * dimension, T)


def impact(e: float, v: float, phase: float, dt: float = DT, mu: float = 0.0, mass: float = 0.5) -> Scene:
    """Ball that overlaps the floor ``phase`` steps after crossing its surface; ends 0.2 s after."""
    return make(FLOOR, ball("ball", 0.5 + (3.0 - phase) * v * dt, -v, mass), e=e, mu=mu, T=3 * dt + 0.2)


# ---- identity and profiles ------------------------------------------------------------------------------------


def test_importing_the_adapter_imports_no_engine() -> None:
    code = "import sys, adapters, adapters.mujoco; assert 'mujoco' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_version_of_the_engine() -> None:
    import mujoco

    assert ENGINE.version() == mujoco.__version__
    assert ENGINE.version() not in ENGINE.facts.known_bad_versions
    assert "4.0.0" in ENGINE.facts.known_bad_versions


def test_default_is_what_a_fresh_spec_holds() -> None:
    import mujoco

    spec = mujoco.MjSpec()
    geom, option = spec.worldbody.add_geom(), spec.option
    chosen = settings(make(FLOOR, ball("ball", 1.0), mu=0.5), "default")
    for name in ("impratio", "iterations", "tolerance", "noslip_iterations"):
        assert chosen[name] == getattr(option, name)
    assert chosen["solref"] == tuple(geom.solref) and chosen["solimp"] == tuple(geom.solimp)
    assert (chosen["margin"], chosen["smooth_condim"]) == (geom.margin, geom.condim)
    assert option.integrator == mujoco.mjtIntegrator.mjINT_EULER and chosen["integrator"] == "Euler"
    assert option.cone == mujoco.mjtCone.mjCONE_PYRAMIDAL and chosen["cone"] == "pyramidal"


def test_needs_and_reasons_of_tuned_settings() -> None:
    down = (0.0, 0.0, -G)
    free = settings(make(ball("ball", 1.0)), "tuned")
    smooth = settings(make(FLOOR, ball("ball", 1.0), e=0.5, g=down), "tuned")
    rough = settings(make(FLOOR, ball("ball", 1.0), e=0.5, mu=0.5), "tuned")
    plastic = settings(make(FLOOR, ball("ball", 1.0)), "tuned")
    resting = settings(make(FLOOR, cube("box", 0.5), mu=0.5, g=down), "tuned")
    sliding = settings(make(FLOOR, cube("box", 0.5), mu=0.5, g=(1.0, 0.0, -G)), "tuned")
    assert free["integrator"] == "RK4"
    assert (smooth["kappa_elastic"], smooth["smooth_condim"], smooth["solreffriction"]) == (0.0, 1, None)
    assert rough["solreffriction"] == "stick" and rough["cone"] == "elliptic"
    assert plastic["kappa_plastic"] == 0.0 and plastic["margin"] == 0.0
    assert resting["kappa_plastic"] == 0.1 and resting["solreffriction"] is None
    assert sliding["solreffriction"] == (0.05, 1.0)
    for scene in (make(ball("ball", 1.0)), make(FLOOR, cube("box", 0.5), mu=0.5, g=(1.0, 0.0, -G))):
        for profile in PROFILES:
            assert all(s.because and s.source for s in ENGINE.settings(profile, needs(scene), DT))


def test_iterations_can_be_replaced_and_reach_the_model() -> None:
    scene = make(FLOOR, cube("box", 0.5), g=(0.0, 0.0, -G), T=DT)
    chosen = {s.name: s.value for s in ENGINE.settings("tuned", needs(scene), DT, 7)}
    assert run(ENGINE, scene, DT, chosen).readback["iterations"] == 7


SCENES = {
    "impact": make(FLOOR, ball("ball", 1.0), e=0.8),
    "rough impact": make(FLOOR, ball("ball", 1.0), e=0.5, mu=0.5),
    "plastic": make(FLOOR, ball("ball", 1.0)),
    "rest": make(FLOOR, cube("box", 0.5), mu=0.5, g=(0.0, 0.0, -G)),
    "slide": make(FLOOR, cube("box", 0.5), mu=0.3, g=(1.0, 0.0, -G)),
    "free": make(ball("ball", 1.0)),
    "planar": make(FLAT, Body("ball", Disc(0.5), 1.0, 0.125, (0.0, 1.0, 0.0)), e=0.5),
}


@pytest.mark.few(20)
@pytest.mark.parametrize("dt", [1 / 60, 1 / 240, 1 / 960])
@pytest.mark.parametrize("profile", PROFILES)
@pytest.mark.parametrize("scene", SCENES.values(), ids=SCENES.keys())
def test_receipts_measure_what_is_declared(scene: Scene, profile: str, dt: float) -> None:
    slips = receipts(ENGINE, profile, needs(scene), dt)
    assert slips and not [slip for slip in slips if not slip.holds]


def test_default_rebound_declared_independent_of_e() -> None:
    declared = [ENGINE.declares("default", needs(make(FLOOR, ball("b", 1.0), e=e)), DT) for e in (0.0, 0.5, 1.0)]
    assert declared[0] == declared[1] == declared[2] and "restitution" in declared[0]
    assert "restitution" not in ENGINE.declares("tuned", needs(make(FLOOR, ball("b", 1.0), e=0.5)), DT)


@pytest.mark.parametrize(
    ("profile", "mu", "dt", "asks"),
    [("default", 2.0, 1 / 240, True), ("tuned", 2.0, 1 / 960, True), ("default", 0.8, 1 / 240, False)],
)
def test_friction_of_a_thrown_up_box_by_the_documented_law(profile, mu, dt, asks) -> None:
    """Above mu = 1 the probe's box lands on an edge, with less friction than mu of the load: predicted to round-off."""
    asked = needs(make(FLOOR, cube("box", 0.5), mu=mu, g=(1.0, 0.0, -G)))
    assert ("friction" in ENGINE.declares(profile, asked, dt)) == asks
    (slip,) = (slip for slip in receipts(ENGINE, profile, asked, dt) if slip.quantity == "friction")
    assert abs(slip.measured - slip.declared) < 1e-9
    assert (slip.declared < mu * (1.0 - 1e-3)) == asks


@pytest.mark.parametrize("share", [0.99, 1.01])
def test_receipt_of_a_thrown_up_box_with_wrong_friction(share, monkeypatch) -> None:
    """Planted: a model with a hundredth less or more friction, which what is declared does not follow."""
    asked = needs(make(FLOOR, cube("box", 0.5), mu=2.0, g=(1.0, 0.0, -G)))
    pair = Spec._geom_material

    def other(spec: Spec) -> dict[str, Any]:
        found = pair(spec)
        return found | {"friction": [share * found["friction"][0], 0.0, 0.0]}

    _probe.cache_clear()
    monkeypatch.setattr(Spec, "_geom_material", other)
    slips = receipts(ENGINE, "default", asked, DT)
    _probe.cache_clear()
    assert [slip.quantity for slip in slips if not slip.holds] == ["friction", "friction_impulse"]


# ---- rebounds -------------------------------------------------------------------------------------------------


@pytest.mark.few(6)
@pytest.mark.parametrize("dt", [1 / 60, 1 / 240, 1 / 960])
@pytest.mark.parametrize("e", [0.0, 0.2, 0.5, 0.8, 0.95, 1.0])
def test_tuned_rebound_is_e_to_round_off(e: float, dt: float) -> None:
    for v in (0.1, 6.0, 50.0):
        for phase in (0.05, 0.5, 0.93):
            trajectory = drive(impact(e, v, phase, dt), "tuned", dt)
            assert abs(trajectory.twist[-1, 1, 2] / v - e) <= ROUND_OFF


def test_tuned_rebound_at_any_mass_ratio() -> None:
    for ratio in (0.1, 1.0, 1000.0):
        scene = make(ball("a", 0.0, 2.0, 1.0), ball("b", 1.02, -1.0, ratio), e=0.5)
        v = drive(scene, "tuned").twist[-1, :, 2]
        # R adds 1e-4 of an inertia that is estimated from the two bodies; without a load it has nothing to yield to.
        assert abs((v[1] - v[0]) / 3.0 - 0.5) <= ROUND_OFF * ratio
        assert abs(v[0] + ratio * v[1] - (2.0 - ratio)) <= ROUND_OFF * (2.0 + ratio)


@pytest.mark.parametrize("mu", [0.0, 0.1, 0.5, 1.0, 2.0])
def test_default_rebound_is_the_documented_scalar_law(mu: float) -> None:
    for dt, v, phase in ((1 / 240, 2.0, 0.31), (1 / 500, 0.7, 0.77), (1 / 60, 0.1, 0.52), (1 / 2000, 6.0, 0.11)):
        scene = impact(0.8, v, phase, dt, mu)
        law = contact_law(settings(scene, "default", dt), 0.8, mu, dt)
        measured = drive(scene, "default", dt).twist[-1, 1, 2] / v
        # (3 - phase) v dt is rounded at a radius of 0.5: eps/(v dt) of a phase, and the law's slope is of order 1.
        assert abs(measured - law.rebound_ratio(v, phase)) <= 1e-15 / (v * dt) + ROUND_OFF


def test_default_rebounds_as_measured() -> None:
    def ratios(dt: float) -> list[float]:
        scenes = [impact(0.8, 1.0, (k + 0.5) / 16, dt) for k in range(16)]
        return [float(drive(scene, "default", dt).twist[-1, 1, 2]) for scene in scenes]

    assert np.mean(ratios(1 / 500)) == pytest.approx(0.125, abs=0.01)
    assert np.mean(ratios(1 / 2000)) == pytest.approx(0.13, abs=0.005)
    at_240 = ratios(DT)
    assert min(at_240) == pytest.approx(0.09, abs=0.01) and max(at_240) == pytest.approx(0.145, abs=0.01)


def test_tuned_oblique_impact_that_sticks() -> None:
    spin = {"twist": (0.3, 0.0, -2.0, 0.0, 0.0, 0.0)}
    scene = make(FLOOR, ball("ball", 0.5 + 0.0104, **spin), e=0.5, mu=0.5, T=0.05)
    v = drive(scene, "tuned").twist[-1, 1]
    assert v[2] == pytest.approx(1.0, abs=1e-3)  # d = 0.9999: couplings yield by 1e-4 of what drives them
    assert v[0] - 0.5 * v[4] == pytest.approx(0.0, abs=1e-2)  # lever arm r - depth/2, depth up to v dt = 8 mm


# ---- impulses -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("floor_first", [True, False])
@pytest.mark.parametrize("profile", PROFILES)
def test_impulses_against_the_momentum_of_the_higher_body(profile: str, floor_first: bool) -> None:
    scene = impact(0.8, 6.0, 0.4, mu=0.5)
    scene = scene if floor_first else replace(scene, bodies=scene.bodies[::-1])
    trajectory = drive(scene, profile)
    moving = 1 if floor_first else 0
    change = 0.5 * (trajectory.twist[-1, moving] - trajectory.twist[0, moving])[:3]
    assert trajectory.contacts is not None
    impulse = trajectory.contacts.impulse_between(0, 1).sum(axis=0)
    sign = 1.0 if floor_first else -1.0  # impulses act on the body with the higher index
    assert impulse == pytest.approx(sign * change, abs=1e-9 * 6.0)
    assert trajectory.contacts.rows.normal[:, 2] == pytest.approx(sign, abs=1e-12)
    assert (trajectory.contacts.rows.a < trajectory.contacts.rows.b).all()


@pytest.mark.parametrize("profile", PROFILES)
def test_impulse_on_a_resting_box(profile: str) -> None:
    trajectory = drive(make(FLOOR, cube("box", 0.5), mu=0.5, g=(0.0, 0.0, -G), T=1.0), profile)
    assert trajectory.contacts is not None
    last = trajectory.contacts.impulse_between(0, 1)[-1]
    assert last == pytest.approx([0.0, 0.0, G * DT], abs=1e-9 * G * DT)


def test_gap_at_the_start_of_a_step() -> None:
    trajectory = drive(impact(0.5, 2.0, 0.4), "default")
    assert trajectory.contacts is not None
    rows, samples = trajectory.contacts.rows, trajectory.contacts
    for k, sample in enumerate(samples.step):
        for row in range(samples.offset[k], samples.offset[k + 1]):
            assert rows.gap[row] == pytest.approx(trajectory.pose[sample - 1, 1, 2] - 0.5, abs=1e-14)


def test_contacts_from_an_overlap_on_with_a_margin_below_0() -> None:
    """No force up to it, then that of the overlap beyond it."""

    def speed(overlap: float, margin: float) -> float:
        return float(drive(make(FLOOR, ball("ball", 0.5 - overlap), T=DT), "default", margin=margin).twist[1, 1, 2])

    assert speed(5e-4, -1e-3) == 0.0 < 1e-3 < speed(5e-4, 0.0)
    assert speed(1.5e-3, -1e-3) == pytest.approx(speed(5e-4, 0.0), rel=1e-9)


def test_no_impulse_of_a_step_with_rk4() -> None:
    trajectory = drive(impact(0.5, 2.0, 0.4), "default", integrator="RK4")
    assert trajectory.contacts is not None and len(trajectory.contacts.rows.a)
    assert np.isnan(trajectory.contacts.rows.impulse).all()


# ---- motion, signs, loads -------------------------------------------------------------------------------------


def test_planar_torque_above_zero_turns_counter_clockwise() -> None:
    body = Body("box", Box((0.5, 0.3)), 2.0, 0.7, (0.0, 0.0, 0.1), torque=(1.4,))
    trajectory = drive(make(body, T=0.25))
    assert trajectory.twist[-1, 0, 2] == pytest.approx(1.4 / 0.7 * 0.25, rel=1e-12)
    assert trajectory.pose[-1, 0, 2] > 0.1 and trajectory.out_of_plane <= 1e-15


@pytest.mark.parametrize("profile", PROFILES)
def test_turn_of_a_box_landing_on_a_corner(profile: str) -> None:
    for tilt in (0.3, -0.3):
        height = 0.5 * (math.cos(tilt) + abs(math.sin(tilt))) + 0.002
        box = Body("box", Box((0.5, 0.5)), 1.0, 1.0 / 6.0, (0.0, height, tilt), (0.0, -1.0, 0.0))
        trajectory = drive(make(FLAT, box, T=0.1), profile)
        assert trajectory.twist[-1, 1, 2] * tilt < 0.0


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_inertia_about_each_axis_of_a_turned_body(axis: int) -> None:
    moments, turn = (1.0, 1.2, 1.5), (0.5, 0.1, 0.7, 0.5)
    w, x, y, z = turn
    axes = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    torque = tuple(float(2.0 * c) for c in axes[:, axis])
    body = Body(
        "box", Box((0.3, 0.4, 0.5)), 3.0, moments, (5.0, 1.0, 2.0, *turn), force=(3.0, 6.0, -9.0), torque=torque
    )
    trajectory = drive(make(body, T=0.05))
    assert trajectory.twist[-1, 0, 3:] == pytest.approx(np.array(torque) / moments[axis] * 0.05, abs=ROUND_OFF)
    assert trajectory.twist[-1, 0, :3] == pytest.approx(np.array([1.0, 2.0, -3.0]) * 0.05, rel=ROUND_OFF)


def test_spin_is_read_and_set_in_world_axes() -> None:
    turned = (0.0, 0.0, 0.0, math.sqrt(0.5), math.sqrt(0.5), 0.0, 0.0)
    body = Body("box", Box((0.5, 0.5, 0.5)), 1.0, CUBE, turned, (0.0, 0.0, 0.0, 0.0, 0.0, 2.0))
    trajectory = drive(make(body, T=0.1))
    assert trajectory.twist[:, 0, 3:] == pytest.approx(np.tile([0.0, 0.0, 2.0], (25, 1)), abs=1e-12)


def test_velocity_at_the_centre_of_mass() -> None:
    twist = (0.3, -0.2, 0.1, 0.0, 3.0, 0.0)
    bodies = [ball(f"b{k}", 1.0, x=10.0 * k, twist=twist) for k in range(3)]
    trajectory = drive(make(*bodies, e=0.5, T=0.5))
    assert trajectory.twist == pytest.approx(np.broadcast_to(twist, trajectory.twist.shape), abs=ROUND_OFF)
    moved = trajectory.pose[-1, :, :3] - trajectory.pose[0, :, :3]
    assert moved == pytest.approx(np.tile(0.5 * np.array(twist[:3]), (3, 1)), abs=ROUND_OFF)


def test_gravity_acts_along_its_vector() -> None:
    gravity = (1.0, -2.0, 3.0)
    trajectory = drive(make(ball("ball", 0.0), g=gravity, T=0.5))
    assert trajectory.twist[-1, 0, :3] == pytest.approx(0.5 * np.array(gravity), rel=ROUND_OFF)


def test_free_fall_lag_velocity_first_and_rk4() -> None:
    scene = make(ball("ball", 0.0), g=(0.0, 0.0, -G), T=0.5)
    fall = 0.5 * G * 0.25
    assert -drive(scene, "default").pose[-1, 0, 2] == pytest.approx(fall + 0.5 * G * 0.5 * DT, rel=ROUND_OFF)
    assert -drive(scene, "tuned").pose[-1, 0, 2] == pytest.approx(fall, rel=ROUND_OFF)


def test_tuned_conserves_the_energy_of_a_tumbling_body() -> None:
    body = Body("t", Box((0.3, 0.4, 0.5)), 1.0, (1.0, 2.0, 2.5), at(0, 0, 0), (0.0, 0.0, 0.0, 1e-3, 5.0, 0.0))
    trajectory = drive(make(body, T=5.0), "tuned", 1 / 500)
    turn = trajectory.pose[:, 0, 3:]
    w, v = turn[:, :1], -turn[:, 1:]
    omega = trajectory.twist[:, 0, 3:]
    spin = omega + 2.0 * np.cross(v, np.cross(v, omega) + w * omega)  # into body axes
    energy = 0.5 * spin**2 @ np.array([1.0, 2.0, 2.5])
    assert np.abs(spin[:, 0]).max() > 1.0  # it did flip
    assert np.ptp(energy) / energy[0] <= 1e-9  # 7e-12 at this step over 20 s


# ---- shapes, pairs, motions -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "normal", [(0.6, 0.0, 0.8), (0.0, -0.6, 0.8), (0.48, 0.36, -0.8), (0.0, 0.0, -1.0), (1.0, 0.0, 0.0)]
)
def test_place_of_a_half_space(normal: tuple[float, ...]) -> None:
    n = np.array(normal)
    start, velocity = (0.3 + 0.5 + 0.01) * n + np.cross(n, [0.2, 0.5, 0.1]), -2.0 * n
    wall = Body("wall", HalfSpace(normal, 0.3), motion="fixed")
    body = ball(
        "ball", 0.0, pose=(*map(float, start), 1.0, 0.0, 0.0, 0.0), twist=(*map(float, velocity), 0.0, 0.0, 0.0)
    )
    trajectory = drive(make(wall, body, e=0.5, T=0.1), "tuned")
    assert trajectory.twist[-1, 1, :3] == pytest.approx(1.0 * n, abs=ROUND_OFF)
    assert trajectory.contacts is not None
    assert trajectory.contacts.rows.normal[0] == pytest.approx(n, abs=1e-12)


def test_fixed_boxes_as_obstacles() -> None:
    post = cube("post", 0.5, motion="fixed")
    trajectory = drive(make(post, ball("ball", 1.51, -1.0), e=1.0, T=0.1), "tuned")
    assert trajectory.twist[-1, 1, 2] == pytest.approx(1.0, abs=ROUND_OFF)
    assert (trajectory.pose[:, 0] == trajectory.pose[0, 0]).all() and not trajectory.twist[:, 0].any()


def test_overlapping_fixed_and_prescribed_bodies_do_not_meet() -> None:
    belt = cube("belt", 0.4, motion="prescribed", twist=(1.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    trajectory = drive(make(FLOOR, belt, ball("far", 5.0, x=20.0), mu=0.5, g=(0.0, 0.0, -G), T=0.5), "tuned")
    assert trajectory.contacts is not None and len(trajectory.contacts.rows.a) == 0


def test_prescribed_body_keeps_its_twist_whatever_hits_it() -> None:
    twist = (0.0, 0.0, 1.0, 0.0, 0.0, 0.5)
    bat = cube("bat", 0.0, motion="prescribed", twist=twist)
    trajectory = drive(make(bat, ball("ball", 1.01, -2.0, 0.5), e=0.8, g=(0.0, 0.0, -1e-3), T=0.1), "tuned")
    assert trajectory.twist[:, 0] == pytest.approx(np.tile(twist, (25, 1)), abs=1e-11)
    assert trajectory.pose[-1, 0, 2] == pytest.approx(0.1, abs=1e-11)
    # v+ = V + e (V - v-), up to the gravity of 0.1 s
    assert trajectory.twist[-1, 1, 2] == pytest.approx(1.0 + 0.8 * 3.0, abs=2e-4)


def test_box_on_a_belt_up_to_its_speed() -> None:
    belt = Body(
        "belt", Box((9.0, 1.0, 0.5)), motion="prescribed", inertia=CUBE, pose=at(0, 0, -0.5), twist=(0.5,) + (0.0,) * 5
    )
    trajectory = drive(make(belt, cube("box", 0.5), mu=0.5, g=(0.0, 0.0, -G), T=1.0), "tuned")
    assert trajectory.twist[-1, 1, 0] == pytest.approx(0.5, abs=1e-4)
    assert trajectory.twist[:, 0, 0] == pytest.approx(np.full(241, 0.5), abs=1e-10)


@pytest.mark.parametrize("profile", PROFILES)
def test_every_pair_has_its_own_friction(profile: str) -> None:
    slide = {"twist": (3.0, 0.0, 0.0, 0.0, 0.0, 0.0)}
    boxes = [cube(name, 0.5, x=0.0, pose=at(0.0, 5.0 * k, 0.5), **slide) for k, name in enumerate("abc")]
    pairs = (Pair("floor", "b", 0.0, 0.2), Pair("floor", "c", 0.0, 0.0))
    trajectory = drive(make(FLOOR, *boxes, mu=0.5, g=(0.0, 0.0, -G), T=0.3, pairs=pairs), profile)
    change = trajectory.twist[-1, 1:] - trajectory.twist[0, 1:]
    mu = -change[:, 0] / (change[:, 2] + G * 0.3)
    # stock friction is at least 1e-5; solved to 1e-8 of the mean inertia as shipped
    assert mu == pytest.approx([0.5, 0.2, 0.0], abs=2e-5)


def test_every_pair_has_its_own_restitution_when_tuned() -> None:
    balls = [ball(f"b{k}", 0.51, -1.0, x=3.0 * k) for k in range(3)]
    pairs = (Pair("floor", "b1", 0.3), Pair("floor", "b2", 0.0))
    trajectory = drive(make(FLOOR, *balls, e=0.9, T=0.1, pairs=pairs), "tuned")
    assert trajectory.twist[-1, 1:, 2] == pytest.approx([0.9, 0.3, 0.0], abs=ROUND_OFF)


@pytest.mark.parametrize("profile", PROFILES)
def test_pairs_and_geoms_give_the_same_model(profile: str) -> None:
    boxes = [cube("a", 0.5), cube("b", 1.5, x=0.1), ball("far", 9.0, x=30.0)]
    scene = make(FLOOR, *boxes, mu=0.4, g=(0.0, 0.0, -G), T=0.5)
    chosen = settings(scene, profile, solreffriction=None)
    other = replace(scene, pairs=(*scene.pairs, Pair("far", "floor", 0.0, 0.3)))
    by_geoms, by_pairs = run(ENGINE, scene, DT, chosen), run(ENGINE, other, DT, chosen)
    assert "all geoms" in by_geoms.readback["materials"] and "pair0-1" in by_pairs.readback["materials"]
    assert by_geoms.state_hash() == by_pairs.state_hash()


def test_readback_equals_what_was_asked() -> None:
    body = Body("box", Box((0.3, 0.4, 0.5)), 3.0, (1.0, 1.2, 1.5), at(0, 0, 1))
    scene = make(FLOOR, body, e=0.5, mu=0.25, g=(0.1, 0.2, -G), T=DT)
    held = drive(scene, "tuned").readback
    assert held["dt"] == DT and held["gravity"] == [0.1, 0.2, -G]
    assert (held["box.mass"], held["box.inertia"], held["box.size"]) == (3.0, [1.0, 1.2, 1.5], [0.3, 0.4, 0.5])
    pair = held["materials"]["pair0-1"]
    assert (pair["friction"], pair["condim"]) == (0.25, 3)
    assert pair["solref"] == pytest.approx([0.0, -1.5 / DT]) and pair["solreffriction"] == pytest.approx([0.0, -1 / DT])
    assert (held["integrator"], held["cone"], held["solver"]) == ("mjINT_EULER", "mjCONE_ELLIPTIC", "mjSOL_NEWTON")


# ---- rest and slide -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("ratio", [0.5, 0.9, 0.99, 0.999])
def test_tuned_friction_at_the_edge_of_the_cone(ratio: float) -> None:
    theta = math.atan(0.5 * ratio)
    scene = make(FLOOR, cube("box", 0.5), mu=0.5, g=(G * math.sin(theta), 0.0, -G * math.cos(theta)), T=1.0)
    trajectory = drive(scene, "tuned")
    creep = (trajectory.pose[-1, 1, 0] - trajectory.pose[120, 1, 0]) / 0.5
    assert 0.0 <= creep <= 2e-7


def test_weight_and_sinking_of_a_tuned_stack() -> None:
    boxes = [cube(f"box{k}", k + 0.5) for k in range(10)]
    trajectory = drive(make(FLOOR, *boxes, mu=0.5, g=(0.0, 0.0, -G), T=1.0), "tuned")
    assert trajectory.contacts is not None
    for k in range(10):
        load = trajectory.contacts.impulse_between(k, k + 1)[-1, 2]
        assert load == pytest.approx((10 - k) * G * DT, rel=1e-9)
    # (1-d)/kappa g dt^2 = 1e-3 x1 of depth for each weight above an interface, over all of them
    assert abs(trajectory.pose[-1, 10, 2] - 9.5) <= 55 * 1e-3 * G * DT**2
    assert trajectory.certificate["residual"] <= 1e-9


# ---- robustness -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("profile", PROFILES)
def test_two_builds_give_the_same_bits(profile: str) -> None:
    scene = make(FLOOR, *[cube(f"box{k}", k + 0.51, x=0.07 * k) for k in range(4)], mu=0.5, g=(0.0, 0.0, -G), T=1.0)
    assert drive(scene, profile).state_hash() == drive(scene, profile).state_hash()


def test_silent_divergence_of_an_infinite_state(tmp_path, monkeypatch, capfd) -> None:
    monkeypatch.chdir(tmp_path)
    scene = make(ball("ball", 1.0, 1.0, 1e-9, force=(1e300, 0.0, 0.0)), T=0.1)
    trajectory = drive(scene, "default")
    assert trajectory.finish == "diverged" and len(trajectory.t) < 25
    assert capfd.readouterr() == ("", "") and os.listdir(tmp_path) == []


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"cone": "round"}, "cone"),
        ({"integrator": "Verlet"}, "integrator"),
        ({"iterations": 0}, "iterations"),
        ({"iterations": 3.0}, "iterations"),
        ({"tolerance": math.nan}, "tolerance"),
        ({"impratio": 0.0}, "impratio"),
        ({"margin": math.inf}, "margin"),
        ({"solref": (0.02,)}, "solref"),
        ({"solref": (-1.0, 1.0)}, "solref"),
        ({"solref": "stick"}, "solref"),
        ({"disabled": ("contact",)}, "disabled"),
        ({"solver": "newton"}, "solver"),
        ({"solimp": (0.9, 0.95, 0.001, 0.5, math.inf)}, "solimp"),
        ({"solreffriction": (0.02, 1.0)}, "solreffriction"),
        ({"kappa_elastic": 0.1}, "kappa_elastic"),
        ({"surprise": 1}, "surprise"),
        ({"solref": "reflect"}, "kappa_elastic"),
        ({"apart": [5]}, "apart"),
        ({"apart": [(0, 1)]}, "apart"),
        ({"apart": [(0, 1, (0.02, 1.0), (0.9, 0.95, 0.001, 0.5, 2.0), None, 0.0, 1)]}, "apart"),
        ({"apart": ["0 1 .."]}, "apart"),
    ],
)
def test_bad_settings_are_refused_in_one_line(change: dict[str, Any], field: str) -> None:
    scene = make(FLOOR, ball("ball", 1.0))
    with pytest.raises(EngineError, match=rf"^{field}: [^\n]*\Z"):
        ENGINE.build(scene, DT, settings(scene, "default") | change)


def test_a_missing_setting_is_refused() -> None:
    scene = make(FLOOR, ball("ball", 1.0))
    chosen = settings(scene, "default")
    del chosen["cone"]
    with pytest.raises(EngineError, match=r"^cone: this setting is missing"):
        ENGINE.build(scene, DT, chosen)


@pytest.mark.parametrize("dt", [0.0, -1.0, math.nan, math.inf])
def test_bad_steps_are_refused(dt: float) -> None:
    scene = make(FLOOR, ball("ball", 1.0))
    with pytest.raises(EngineError, match=r"^dt: "):
        ENGINE.build(scene, dt, settings(scene, "default"))


def test_physically_impossible_moments_refused() -> None:
    scene = make(FLOOR, ball("ball", 1.0, inertia=(1.0, 1.0, 3.0)))
    refusal = ENGINE.refuses(scene, "default")
    assert refusal is not None and refusal.startswith("ball.inertia: ")
    with pytest.raises(EngineError, match=r"^ball\.inertia: "):
        drive(scene)


@pytest.mark.parametrize(
    ("mass", "said"), [(1e-30, "mass: 1e-30"), (0.9e-15, "mass: 9e-16"), (5e-15, "inertia: 5e-16")]
)
def test_negligible_masses_refused_by_name(mass: float, said: str) -> None:
    """A ball of radius .5: its moments are a tenth of its mass. At 2e-14 kg it falls like any other."""
    scene = make(FLOOR, ball("ball", 1.0, 0.0, mass, inertia=(0.1 * mass,) * 3))
    assert ENGINE.refuses(scene, "default") == f"ball.{said} is less than 1e-15, the minimum of a moving body"
    with pytest.raises(EngineError, match=rf"^ball\.{said}"):
        drive(scene)
    assert drive(make(FLOOR, ball("ball", 1.0, 0.0, 2e-14, inertia=(2e-15,) * 3)))


def test_mujoco_s_own_errors_in_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = make(FLOOR, ball("ball", 1.0, 0.0, 1e-30))
    monkeypatch.setattr(type(ENGINE), "refuses", lambda *asked: None)
    with pytest.raises(EngineError, match="MuJoCo does not compile it") as caught:
        drive(scene)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("normal", [(0, 0, 1), (0, 0, -1), (1, 0, 0), (0, -1, 0), (0.6, 0.0, 0.8), (0.48, -0.64, -0.6)])
def test_side_of_a_plane_and_a_ceiling(normal: tuple[float, ...]) -> None:
    from adapters.mujoco.spec import _turn_z_to, rotation

    turn = np.array([_turn_z_to(normal)])
    assert np.linalg.norm(turn) == pytest.approx(1.0, abs=1e-12)
    assert rotation(turn)[0] @ [0.0, 0.0, 1.0] == pytest.approx(normal, abs=1e-12)


def test_pair_friction_softened_stopped_or_left_as_asked():
    """Nothing said is MuJoCo's own (0, 0), "as solref"; -1/dt takes all of a slip off within a step of dt."""
    assert pair_solreffriction({"solreffriction": None}, 0.25) == (0.0, 0.0)
    assert pair_solreffriction({"solreffriction": "stick"}, 0.25) == (0.0, -4.0)
    assert pair_solreffriction({"solreffriction": (0.02, 0.5)}, 0.25) == (0.02, 0.5)


def pushed(mass: float, speed: float) -> Scene:
    """A box on a floor that a wall pushes along, slowly."""
    wall = Body("wall", Box((0.1, 0.5, 0.5)), pose=at(0.2, 0, 0.5), inertia=CUBE, motion="prescribed",
                twist=(-speed, 0.0, 0.0, 0.0, 0.0, 0.0))  # fmt: skip
    hand = Body("hand", Box((0.1, 0.1, 0.05)), mass, (0.01 * mass,) * 3, at(0.0, 0.0, 0.05))
    floor = Body("floor", HalfSpace((0.0, 0.0, 1.0)), motion="fixed")
    pairs = (Pair(friction=0.5), Pair("wall", "hand", friction=0.0))
    return Scene("pushed", 1, 3, (floor, wall, hand), pairs, (0.0, 0.0, -9.81), 1.0)


def before_a_mocap_body(scene: Scene, asked: dict[str, Any]) -> tuple[np.ndarray, np.ndarray]:
    """Velocity of the hand of `pushed` after each step and the force on it, of bare MuJoCo: a mocap body pushes.

    What MuJoCo does not know of such a body, how fast it moves, is entered between the halves of a step.
    """
    import mujoco

    _, wall, hand = scene.bodies
    options = " ".join(f'{name}="{asked[name]}"' for name in ("cone", "solver", "noslip_iterations") if name in asked)
    box, size = 'type="box" contype="0" conaffinity="0"', "{} {} {}".format(*wall.shape.half_extents)
    model = mujoco.MjModel.from_xml_string(
        f"""<mujoco><option timestep="{DT!r}" {options}/><worldbody>
        <geom name="floor" type="plane" size="0 0 1" contype="0" conaffinity="0"/>
        <body mocap="true" pos="{wall.pose[0]} 0 {wall.pose[2]}"><geom name="wall" {box} size="{size}"/></body>
        <body pos="0 0 {hand.pose[2]}"><freejoint/><geom name="hand" {box} size=".1 .1 .05"/>
        <inertial pos="0 0 0" mass="{hand.mass}" diaginertia="{hand.inertia[0]} {hand.inertia[1]} {hand.inertia[2]}"/>
        </body></worldbody><contact><pair geom1="floor" geom2="hand" friction=".5 .5" condim="3"/>
        <pair geom1="wall" geom2="hand" friction="0 0" condim="3"/></contact></mujoco>"""
    )
    data, speeds, forces = mujoco.MjData(model), [], []
    for _ in range(round(scene.duration / DT)):
        mujoco.mj_step1(model, data)
        enter_motions(model, data, {model.geom("wall").id: (wall.twist[:3], (0.0, 0.0, 0.0))})
        mujoco.mj_step2(model, data)
        data.mocap_pos[0] += DT * np.array(wall.twist[:3])
        speeds.append(data.qvel[:3].copy())
        forces.append(data.qfrc_constraint[:3].copy())
    return np.array(speeds), np.array(forces)


@pytest.mark.parametrize(("mass", "speed"), [(1.0, 0.1), (20.0, 0.03), (1e-3, 1.0)])
@pytest.mark.parametrize(
    "changes",
    [{}, {"cone": "elliptic"}, {"cone": "elliptic", "solver": "CG"}, {"solver": "PGS"},
     {"cone": "elliptic", "noslip_iterations": 5}],
)  # fmt: skip
def test_push_of_a_prescribed_box(changes, mass, speed):
    """Solvers stop by the mass of all that moves: with 1e15 kg in it they did at once, and a hand flew or stood still.

    Solvers multiply roundings: 12 steps, 2 of them a blow, are the same to 1e-6 of the speed. A pyramid of the smallest
    friction makes of them, by its stiffness, 2e-3 of a force (`adapters.mujoco.engine._impulses`).
    """
    scene, steps = pushed(mass, speed), 12
    asked = settings(scene, "default") | changes
    speeds, forces = before_a_mocap_body(scene, asked)
    found = run(MujocoEngine(), scene, DT, asked, Sampling(contacts_from=0.0))
    assert np.abs(found.twist[1:, 2, :3] - speeds)[:steps].max() <= 1e-6 * speed
    assert np.abs(speeds[:steps, 0]).max() > 0.9 * speed  # it is pushed
    assert np.abs(found.contacts.impulse_on(2) / DT - forces)[:steps].max() <= 1e-2 * mass * G


@pytest.mark.parametrize("profile", ["tuned", "matched"])
@pytest.mark.parametrize(("mass", "speed"), [(1.0, 0.1), (20.0, 0.03)])
def test_forces_beside_a_prescribed_body_match_momentum(profile, mass, speed):
    """Impulses that are told are m dv less the weight's, step by step; 1e15 kg made -22 kN of 5 N."""
    scene = pushed(mass, speed)
    found = run(MujocoEngine(), scene, DT, settings(scene, profile), Sampling(contacts_from=0.0))
    told = found.contacts.impulse_on(2)
    gained = mass * (np.diff(found.twist[:, 2, :3], axis=0) - DT * np.array(scene.gravity))
    assert np.abs(told - gained).max() <= 1e-2 * 9.81 * mass * DT


@pytest.mark.parametrize("cone", ["elliptic", "pyramidal"])
@pytest.mark.parametrize(("mu", "condim"), [(0.5, 3), (0.0, 3), (0.0, 1)])
def test_bits_of_contact_forces_against_mujoco(cone: str, mu: float, condim: int) -> None:
    """A tilted cube that lands beside one that slides, so that the number of contacts changes."""
    import mujoco

    tilted = replace(cube("tilted", 1.0, 3.0), pose=(3.0, 0.0, 0.9, 0.9, 0.3, 0.3, 0.1))
    scene = make(FLOOR, cube("cube", 0.5, twist=(1.0, 0.5, 0.0, 0.0, 0.0, 0.0)), tilted, mu=mu, g=(0.0, 0.0, -G))
    own = {setting.name: setting.value for setting in ENGINE.settings("default", needs(scene), DT)}
    world = ENGINE.build(scene, DT, own | {"cone": cone, "smooth_condim": condim})
    assert isinstance(world, MujocoSimulation)
    copies, wanted = [], []
    for _ in range(120):
        world.advance(1)
        copies.append(world.copy_contacts())
        for k in range(world._data.ncon):
            force = np.zeros(6)
            mujoco.mj_contactForce(world._model, world._data, k, force)
            wanted.append(DT * (force[:3] @ world._data.contact[k].frame.reshape(3, 3)))
    counts, found = world.contacts_of(copies)
    assert len(set(counts.tolist())) > 2 and np.array_equal(found.impulse, wanted) and np.any(wanted)
