"""Bullet's adapter: physics through the one step loop, and figures that were measured without it."""

import math
import subprocess
import sys
import tempfile
from dataclasses import replace
from itertools import pairwise, product

import numpy as np
import pytest

pytest.importorskip("pybullet", reason="pybullet has no wheel for this Python")


from adapters import Body, Box, Disc, HalfSpace, Pair, Sampling, Scene, Sphere, needs, run
from adapters.bullet import BulletEngine, clipped, laws
from adapters.bullet.contact_law import ContactLaw, fall
from adapters.bullet.profiles import law_of
from adapters.bullet.shipped import WARM_STARTING
from adapters.bullet.translation import factors
from adapters.engine import EngineError
from adapters.law.moved_starts import GAP_ROUND_OFF
from adapters.receipts import receipts
from adapters.receipts.probes import Case, read_slide, slide
from adapters.scene import Hull, Polygon
from validation.catalogue import CATALOGUE
from validation.cells import Slot, plane_of
from validation.running.execution import execute
from validation.settings.switching import switched

ENGINE = BulletEngine()
#: Bullet's laws by path and settings, stated here once more: the profiles' own settings must give the same.
DEFAULT = ContactLaw(True, float(np.float32(0.04)), 0.08, 1e-5, 0.2, math.inf, math.inf, 100.0, 0.02)
REST = ContactLaw(False, 0.0, 0.08, 1e-5, 1e-4, 0.0, 0.04, math.inf, 0.1)
IMPACT = replace(REST, erp=0.0, slop=1e-6, split_depth=0.0)
ONE = replace(REST, erp=0.01)
PROFILES = ("default", "tuned", "one")
DT = 1.0 / 240.0
EVERY_STEP = Sampling(1, 0.0)
FLOOR = Body("floor", HalfSpace((0.0, 0.0, 1.0)), motion="fixed")
FLOOR_2D = Body("floor", HalfSpace((0.0, 1.0)), motion="fixed")
UPRIGHT = (1.0, 0.0, 0.0, 0.0)


def drive(scene, profile="tuned", dt=DT, sampling=EVERY_STEP, **changes):
    settings = {s.name: s.value for s in ENGINE.settings(profile, needs(scene), dt)} | changes
    return run(ENGINE, scene, dt, settings, sampling)


def ball(height, velocity=(0.0, 0.0, 0.0), spin=(0.0, 0.0, 0.0), name="ball", x=0.0, mass=0.5, inertia=0.05):
    pose = (x, 0.0, height, *UPRIGHT)
    return Body(name, Sphere(0.5), mass, (inertia,) * 3, pose, (*velocity, *spin))


def scene_of(*bodies, e=0.0, mu=0.0, gravity=(0.0, 0.0, 0.0), duration=0.25, pairs=None):
    return Scene("t", 1, 3, bodies, pairs or (Pair(restitution=e, friction=mu),), gravity, duration)


def planar(*bodies, e=0.0, mu=0.0, gravity=(0.0, 0.0), duration=0.25):
    return Scene("t", 1, 2, bodies, (Pair(restitution=e, friction=mu),), gravity, duration)


def hit(gap, v, e, **kwargs):
    return scene_of(FLOOR, ball(0.5 + gap, (0.0, 0.0, -v)), e=e, duration=gap / v + 0.1, **kwargs)


# ---- the engine stays outside until it is asked, and is quiet ----------------------------------------------------


def test_import_of_the_adapter_without_engine_or_output():
    code = (
        "import sys, adapters, adapters.bullet as b\n"
        "assert 'pybullet' not in sys.modules\n"
        "e = b.BulletEngine(); e.version(); assert 'pybullet' not in sys.modules\n"
        "from adapters import *\n"
        "s = Scene('t', 1, 2, (Body('d', Disc(.5)),), (Pair(),), (0., -9.8), .1)\n"
        "run(e, s, .01, {x.name: x.value for x in e.settings('tuned', needs(s), .01)})\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


# ---- the law is made of the profiles' own settings ---------------------------------------------------------------


@pytest.mark.parametrize(
    ("profile", "e", "gravity", "law"),
    [
        ("default", 0.5, 9.81, DEFAULT),
        ("one", 0.5, 9.81, ONE),
        ("tuned", 0.5, 9.81, IMPACT),
        ("tuned", 0.0, 9.81, REST),
    ],
)
def test_numbers_of_a_profile_s_law(profile, e, gravity, law):
    scene = scene_of(FLOOR, ball(2.0), e=e, gravity=(0.0, 0.0, -gravity))
    assert law_of(profile, needs(scene), DT) == law


def test_unnamed_settings_as_shipped_and_settings_in_the_law():
    assert ContactLaw.of({}) == DEFAULT and ContactLaw.of({"useMaximalCoordinates": 1}).split_depth == 0.04
    named = {"linearDamping": 0.5, "contactERP": 0.3, "contactSlop": 0.002, "restitutionVelocityThreshold": 0.7,
             "contactProcessingThreshold": 0.9, "contactBreakingThreshold": 0.11}  # fmt: skip
    assert ContactLaw.of(named) == ContactLaw(True, 0.5, 0.3, 0.002, 0.7, 0.9, math.inf, 100.0, 0.11)


# ---- rebounds ----------------------------------------------------------------------------------------------------


@pytest.mark.few(9)
@pytest.mark.parametrize("dt", [1 / 60, DT, 1 / 1000])
@pytest.mark.parametrize("v", [0.1, 1.0, 10.0])
@pytest.mark.parametrize("e", [0.3, 0.8, 1.0])
def test_tuned_rebound_equal_to_e_at_any_step_and_phase(dt, v, e):
    for phase in (0.13, 0.5, 0.87):
        end = drive(hit((3.0 + phase) * v * dt, v, e), dt=dt).twist[-1, 1, 2]
        assert end / v == pytest.approx(e, abs=1e-14)  # a handful of operations of 2e-16 each


def test_worked_example_speed_and_impulse():
    record = drive(hit(0.315, 6.0, 0.8))
    assert record.twist[-1, 1, 2] == pytest.approx(4.8, abs=1e-14)
    assert record.contacts.impulse_between(0, 1).sum(axis=0)[2] == pytest.approx(5.4, abs=1e-14)


def test_default_rebound_short_by_gap_over_dt_when_first_apart():
    v, e, gap = 8.0, 0.8, 0.004  # seen apart at once, and (1 + e) v dt > gap: it bounces in the first step
    record = drive(hit(gap, v, e), "default", linearDamping=0.0)
    # 1e-11: a gap known to 2e-15 m (a few ulp of the floor's 20 m half depth) over dt.
    assert record.twist[-1, 1, 2] == pytest.approx(e * v - (gap + 1e-5) / DT, abs=1e-11)


def test_default_rebound_of_an_initial_overlap_with_baumgarte():
    v, e, gap = 8.0, 0.8, 0.025  # out of reach at .025, overlapping at .025 - v dt = -.0083
    record = drive(hit(gap, v, e), "default", linearDamping=0.0)
    assert record.twist[-1, 1, 2] == pytest.approx(e * v + 0.08 * (v * DT - gap - 1e-5) / DT, abs=1e-11)


def test_default_rebound_at_1_metre_per_second():
    assert abs(drive(hit(0.0525, 1.0, 0.8), "default").twist[-1, 1, 2]) < 1e-12


def test_one_errs_by_less_than_its_contact_erp():
    errors = []
    for phase in np.linspace(0.05, 0.95, 7):
        end = drive(hit((3.0 + phase) * 2.0 * DT, 2.0, 0.8), "one").twist[-1, 1, 2]
        errors.append(end / 2.0 - 0.8)
    assert min(errors) >= 0.0 and 0.005 < max(errors) < 0.01


@pytest.mark.parametrize(("profile", "law"), [("default", DEFAULT), ("tuned", IMPACT), ("one", ONE)])
@pytest.mark.parametrize(("v", "e", "gap"), [(0.7, 0.6, 0.031), (3.3, 0.9, 0.12), (17.0, 0.2, 0.9), (40.0, 1.0, 2.2)])
def test_recurrence_follows_every_sample_of_a_hit(profile, law, v, e, gap):
    record = drive(hit(gap, v, e), profile)
    predicted = fall(law, 0.5, gap, -v, e, 0.0, DT, len(record.t) - 1)
    # 2e-15 m of the gap over dt, twice amplified by 1/(v dt) at most where a slow approach is braked step by step.
    assert np.allclose(predicted.velocity, record.twist[:, 1, 2], rtol=0.0, atol=1e-9 * v)
    total = record.contacts.impulse_between(0, 1).sum(axis=0)[2]
    assert 0.5 * predicted.impulse.sum() == pytest.approx(total, abs=1e-9 * v)


@pytest.mark.parametrize(("profile", "law", "e"), [("default", DEFAULT, 0.8), ("tuned", REST, 0.0), ("one", ONE, 0.5)])
def test_recurrence_follows_a_dropped_ball(profile, law, e):
    scene = scene_of(FLOOR, ball(1.237), e=e, gravity=(0.0, 0.0, -9.81), duration=0.7)
    record = drive(scene, profile)
    predicted = fall(law, 0.5, 0.737, 0.0, e, 9.81, DT, len(record.t) - 1)
    assert np.allclose(predicted.gap, record.pose[:, 1, 2] - 0.5, rtol=0.0, atol=1e-9)


def test_rebound_along_the_normal_of_a_tilted_half_space():
    normal = np.array([1.0, 2.0, 2.0]) / 3.0
    wall = Body("wall", HalfSpace(tuple(normal), 0.7), motion="fixed")
    start, velocity = normal * (0.7 + 0.5 + 0.055), -3.0 * normal + 0.5 * np.array([2.0, 1.0, -2.0]) / 3.0
    striker = Body("ball", Sphere(0.5), 2.0, (0.2,) * 3, (*start, *UPRIGHT), (*velocity, 0.0, 0.0, 0.0))
    end = drive(scene_of(wall, striker, e=0.5)).twist[-1, 1, :3]
    # 1e-12: round-off of the nearest point on a turned box 400 m wide (4e-14 m) tilts the normal.
    assert np.allclose(end, velocity + (1.0 + 0.5) * 3.0 * normal, rtol=0.0, atol=1e-12)


def test_readback_of_half_space_poses():
    """A box stands for each, turned and shifted: that is no one else's business."""
    face = Body("face", HalfSpace((0.6, 0.0, 0.8), 0.2), motion="fixed")
    record = drive(scene_of(FLOOR, face, ball(5.0), gravity=(0.0, 0.0, 0.0), duration=0.1))
    # 1e-12 m: the shift of a box 400 m wide, added and taken away again
    assert np.allclose(record.pose[:, :2], (0.0, 0.0, 0.0, *UPRIGHT), rtol=0.0, atol=1e-12)


# ---- impulses ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("profile", PROFILES)
@pytest.mark.parametrize("ball_first", [False, True])
def test_impulse_sign_and_momentum_change(profile, ball_first):
    striker = ball(0.55, (0.0, 0.0, -6.0))
    bodies = (striker, FLOOR) if ball_first else (FLOOR, striker)
    index, sign = (0, -1.0) if ball_first else (1, 1.0)
    record = drive(scene_of(*bodies, e=0.5, duration=0.2), profile, linearDamping=0.0)
    change = record.twist[-1, index, 2] - record.twist[0, index, 2]
    total = record.contacts.impulse_between(0, 1).sum(axis=0)
    assert total[2] == pytest.approx(sign * 0.5 * change, abs=1e-12)  # round-off of the 48 steps
    assert np.all(record.contacts.rows.normal[:, 2] == sign)


@pytest.mark.parametrize("profile", PROFILES)
def test_weight_on_a_resting_box_counted_once(profile):
    box = Body("box", Box((0.5,) * 3), 2.0, (1 / 3,) * 3, (0.0, 0.0, 0.5, *UPRIGHT))
    record = drive(scene_of(FLOOR, box, mu=0.5, gravity=(0.0, 0.0, -9.81), duration=1.0), profile)
    late = record.contacts.impulse_between(0, 1)[-60:, 2]
    # 1e-6: residual that the shipped profile stops at is 3e-4 m/s per row, of which a flat box keeps 1e-8.
    assert np.allclose(late, 2.0 * 9.81 * DT, rtol=1e-6)


@pytest.mark.parametrize("substeps", [2, 5])
def test_share_of_the_weight_with_substeps(substeps):
    """The engine divides the impulse of its last substep by the whole step, as `readings` says."""
    box = Body("box", Box((0.5,) * 3), 2.0, (1 / 3,) * 3, (0.0, 0.0, 0.5, *UPRIGHT))
    scene = scene_of(FLOOR, box, mu=0.5, gravity=(0.0, 0.0, -9.81), duration=1.0)
    late = drive(scene, "default", numSubSteps=substeps).contacts.impulse_between(0, 1)[-60:, 2]
    assert np.allclose(late, 2.0 * 9.81 * DT / substeps, rtol=1e-6)


@pytest.mark.parametrize("profile", PROFILES)
def test_friction_impulse_of_a_slide(profile):
    box = Body("box", Box((0.5,) * 3), 2.0, (1 / 3,) * 3, (0.0, 0.0, 0.5, *UPRIGHT), (2.0, -1.0, 0.0, 0.0, 0.0, 0.0))
    scene = scene_of(FLOOR, box, mu=0.4, gravity=(0.0, 0.0, -9.81), duration=0.2)
    record = drive(scene, profile, linearDamping=0.0, angularDamping=0.0)
    total = record.contacts.impulse_between(0, 1).sum(axis=0)
    change = 2.0 * (record.twist[-1, 1, :3] - record.twist[0, 1, :3])
    assert np.allclose(total[:2], change[:2], rtol=0.0, atol=1e-11)
    assert total[0] < 0.0 < total[1]


@pytest.mark.parametrize("profile", PROFILES)
def test_pair_friction_decelerates_by_mu_g(profile):
    box = Body("box", Box((0.5,) * 3), 1.0, (1 / 6,) * 3, (0.0, 0.0, 0.5, *UPRIGHT), (3.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    for mu in (0.1, 0.5):
        scene = scene_of(FLOOR, box, mu=mu, gravity=(0.0, 0.0, -9.81), duration=0.5)
        record = drive(scene, profile, linearDamping=0.0, angularDamping=0.0)
        measured = (3.0 - record.twist[-1, 1, 0]) / (9.81 * record.t[-1])
        assert measured == pytest.approx(mu, rel=0.01)  # 0.7 % from contacts switching under a fast box


def friction_of_the_probe(e, dt, **changes):
    """What the sliding probe sees of mu = 0.3 under `one`, as a share of it."""
    case = Case(2, e, 0.3, dt, 0.0)
    asked = needs(
        planar(FLOOR_2D, Body("box", Box((0.5, 0.5)), 1.0, 1 / 6, (0.0, 0.6, 0.0)), e=e, mu=0.3, gravity=(0.0, -9.81))
    )
    settings = {s.name: s.value for s in ENGINE.settings("one", asked, dt)} | changes
    scene = slide(case)
    (found,) = read_slide(case, scene, run(ENGINE, scene, dt, settings, EVERY_STEP))["friction"]
    return found / 0.3


@pytest.mark.parametrize("dt", [1 / 240, 1 / 960])
def test_excess_friction_of_a_box_hopping_within_the_slop(dt):
    """From a slop of g dt^2/2 on, whatever the step: points hold friction without a load."""
    fall = 9.81 * dt**2
    assert friction_of_the_probe(1.0, dt, contactSlop=0.4 * fall) == pytest.approx(1.0, abs=1e-12)
    assert 1.05 < friction_of_the_probe(1.0, dt, contactSlop=0.7 * fall) < 1.0 + WARM_STARTING
    off = ({"warmStartingFactor": 0.0}, {"restitutionVelocityThreshold": 9.81 * dt})
    for change in off:
        assert friction_of_the_probe(1.0, dt, contactSlop=0.7 * fall, **change) == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize(("e", "dt", "hops"), [(1.0, 1 / 960, True), (1.0, 1 / 480, False), (0.0, 1 / 960, False)])
def test_declared_friction_band_only_where_a_box_hops(e, dt, hops):
    asked = needs(
        planar(FLOOR_2D, Body("box", Box((0.5, 0.5)), 1.0, 1 / 6, (0.0, 0.6, 0.0)), e=e, mu=0.3, gravity=(0.0, -9.81))
    )
    declared = ENGINE.declares("one", asked, dt)["friction"]
    assert (declared.band > 1e-2 * 0.3) == hops
    assert declared.value - declared.band <= 0.3 <= declared.value + declared.band
    assert not [slip for slip in receipts(ENGINE, "one", asked, dt) if not slip.holds]


def test_excess_braking_on_short_plates_by_unloaded_points():
    """Step by step: the deceleration is mu g and what points at the plates' edges hold without a load."""
    scene = CATALOGUE["seam"].scene(2, {"plate": 0.3})
    settings = {s.name: s.value for s in ENGINE.settings("tuned", needs(scene), DT)}
    record = run(ENGINE, scene, DT, settings, EVERY_STEP)
    box, contacts = len(scene.bodies) - 1, record.contacts
    slowed = -np.diff(record.twist[:, box, 0])
    carried = np.diff(record.twist[:, box, 1]) + 9.81 * DT
    rows = contacts.rows
    held = np.zeros(len(record.t))
    for step, a, b in zip(contacts.step, contacts.offset[:-1], contacts.offset[1:], strict=True):
        unloaded = (rows.b[a:b] == box) & (rows.impulse[a:b, 1] < 1e-8 * 9.81 * DT)
        held[step] = -rows.impulse[a:b][unloaded, 0].sum()
    sliding = record.twist[1:, box, 0] > 2.0 * 0.4 * 9.81 * DT
    excess = (slowed - 0.4 * carried)[sliding]
    assert excess.max() > 0.005 * 9.81 * DT and (excess > 1e-4 * 9.81 * DT).sum() == 10
    # 1e-8: what 50 sweeps leave of the loads.
    assert np.allclose(excess, held[1:][sliding], rtol=0.0, atol=1e-8 * 9.81 * DT)


# ---- signs, inertia, loads ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("profile", PROFILES)
def test_direction_and_rate_of_a_positive_planar_torque(profile):
    disc = Body("disc", Disc(0.5), 2.0, 0.7, torque=(0.3,))
    record = drive(planar(disc), profile, angularDamping=0.0, linearDamping=0.0)
    assert record.twist[-1, 0, 2] == pytest.approx(0.3 / 0.7 * record.t[-1], rel=1e-12)
    assert record.pose[-1, 0, 2] > 0.0 and record.out_of_plane == 0.0


@pytest.mark.parametrize("profile", PROFILES)
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_turn_of_a_box_that_lands_on_a_corner(profile, side):
    # Turned by a negative angle a square stands on the corner right of its centre: the floor lifts that side.
    tilt = -0.3 * side
    lowest = 0.5 * (math.cos(0.3) + math.sin(0.3))
    box = Body("box", Box((0.5, 0.5)), 1.0, 1 / 6, (0.0, lowest + 0.02, tilt), (0.0, -2.0, 0.0))
    record = drive(planar(FLOOR_2D, box, e=0.5, mu=0.0, duration=0.05), profile)
    assert side * record.twist[-1, 1, 2] > 0.5


def test_corner_strike_by_the_impulse_formula():
    mass, moment, v, e, tilt = 1.3, 0.4, 2.0, 0.5, -0.3
    lowest = 0.5 * (math.cos(tilt) - math.sin(tilt))
    arm = 0.5 * (math.cos(tilt) + math.sin(tilt))  # horizontal distance of the corner right of the centre
    box = Body("box", Box((0.5, 0.5)), mass, moment, (0.0, lowest + 0.02, tilt), (0.0, -v, 0.0))
    # Ends before the other corner comes down.
    record = drive(planar(FLOOR_2D, box, e=e, duration=0.03))
    j = (1.0 + e) * v / (1.0 / mass + arm * arm / moment)
    # 1e-12: the corner's position carries the tilt's round-off.
    assert record.twist[-1, 1, 1] == pytest.approx(-v + j / mass, abs=1e-12)
    assert record.twist[-1, 1, 2] == pytest.approx(arm * j / moment, abs=1e-12)


def test_rolling_disc_with_its_own_moment_of_inertia():
    disc = Body("disc", Disc(0.5), 1.0, 0.125, (0.0, 0.5, 0.0), (2.0, 0.0, 0.0))
    record = drive(planar(FLOOR_2D, disc, mu=0.5, gravity=(0.0, -9.81), duration=0.5))
    # Angular momentum about the contact line: 2/3 for a disc, 5/7 for a sphere; 1e-5 on a floor that is a box.
    assert record.twist[-1, 1, 0] == pytest.approx(2.0 * 2.0 / 3.0, abs=1e-5)


@pytest.mark.parametrize("profile", PROFILES)
def test_force_torque_and_three_moments_act_as_stated(profile):
    moments = (0.3, 0.5, 0.9)
    for axis in range(3):
        torque = tuple(0.02 if k == axis else 0.0 for k in range(3))
        force = tuple(1.5 if k == axis else 0.0 for k in range(3))
        body = Body("b", Box((0.5,) * 3), 2.5, moments, force=force, torque=torque)
        record = drive(scene_of(body, duration=0.1), profile, linearDamping=0.0, angularDamping=0.0)
        assert record.twist[-1, 0, axis] == pytest.approx(1.5 / 2.5 * record.t[-1], rel=1e-12)
        assert record.twist[-1, 0, 3 + axis] == pytest.approx(0.02 / moments[axis] * record.t[-1], rel=1e-12)


@pytest.mark.parametrize("profile", PROFILES)
def test_inertia_of_a_turned_body_in_the_first_step(profile):
    half = math.sqrt(0.5)  # a quarter turn about z: the body's x axis points along the world's y
    pose = (0.0, 0.0, 3.0, half, 0.0, 0.0, half)
    body = Body("b", Box((0.5,) * 3), 2.5, (0.3, 0.5, 0.7), pose, torque=(0.0, 0.02, 0.0))
    record = drive(scene_of(body, duration=DT), profile, angularDamping=0.0)
    assert record.twist[-1, 0, 4] == pytest.approx(0.02 / 0.3 * DT, rel=1e-12)


def test_force_at_the_centre_of_a_turned_body():
    half = math.sqrt(0.5)
    body = Body("b", Box((0.2, 0.5, 0.3)), 1.0, (0.1, 0.2, 0.3), (1.0, 2.0, 3.0, half, 0.0, 0.0, half), force=(1, 0, 0))
    end = drive(scene_of(body, duration=0.1)).twist[-1, 0]
    assert end[0] == pytest.approx(0.1, rel=1e-12) and np.all(end[1:] == 0.0)


@pytest.mark.parametrize("profile", PROFILES)
def test_gravity_pulls_in_any_direction_with_semi_implicit_steps(profile):
    g = (1.0, -2.0, -3.0)
    record = drive(scene_of(ball(5.0), gravity=g, duration=0.2), profile, linearDamping=0.0)
    t = record.t[:, None]
    assert np.allclose(record.twist[:, 0, :3], np.multiply(t, g), rtol=0.0, atol=1e-13)
    fallen = record.pose[:, 0, :3] - record.pose[0, 0, :3]
    assert np.allclose(fallen, 0.5 * t * (t + DT) * np.array(g), rtol=0.0, atol=1e-13)
    assert ENGINE.facts.scheme.position_offset == 1


def test_drag_by_profile():
    flying = scene_of(ball(5.0, (10.0, 0.0, 0.0)), duration=1.0)
    assert drive(flying, "default").twist[-1, 0, 0] == pytest.approx(6.90, abs=0.01)
    assert drive(flying, "tuned").twist[-1, 0, 0] == 10.0


@pytest.mark.parametrize("profile", PROFILES)
def test_rebound_from_a_prescribed_wall(profile):
    pose, twist = (-1.1, 0.0, 0.0, *UPRIGHT), (2.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    wall = Body("wall", Box((0.5, 2.0, 2.0)), pose=pose, twist=twist, motion="prescribed")
    scene = scene_of(wall, ball(0.0, x=0.0, mass=3.0), e=0.5, gravity=(0.0, -9.81, 0.0), duration=0.2)
    record = drive(scene, profile)
    assert np.allclose(record.twist[:, 0, :3], twist[:3], rtol=0.0, atol=1e-13)  # recoil of a 1e15th
    assert np.allclose(record.pose[-1, 0, :3], (-1.1 + 2.0 * record.t[-1], 0.0, 0.0), rtol=0.0, atol=1e-8)
    assert "prescribed motion of wall" in record.initial_change[0]
    if profile == "tuned":
        assert record.twist[-1, 1, 0] == pytest.approx((1.0 + 0.5) * 2.0, abs=2e-8)


# ---- materials ---------------------------------------------------------------------------------------------------


def test_every_pair_gets_its_own_coefficients():
    pairs = (Pair("floor", "a", 0.8), Pair("floor", "b", 0.5), Pair("a", "b", 0.3), Pair())
    bodies = (FLOOR, ball(0.6, (0, 0, -2.0), name="a", x=-2.0), ball(0.6, (0, 0, -2.0), name="b", x=2.0))
    end = drive(scene_of(*bodies, pairs=pairs)).twist[-1]
    assert end[1, 2] == pytest.approx(1.6, abs=1e-12) and end[2, 2] == pytest.approx(1.0, abs=1e-12)
    bodies = (FLOOR, ball(5.0, (1.0, 0, 0), name="a", x=-0.6), ball(5.0, (-1.0, 0, 0), name="b", x=0.6))
    end = drive(scene_of(*bodies, pairs=pairs)).twist[-1]
    assert end[2, 0] - end[1, 0] == pytest.approx(0.3 * 2.0, abs=1e-12)


def test_friction_zero_for_a_body_without_rough_pairs():
    names = ("floor", "a", "b")
    pairs = (Pair("floor", "a", friction=0.5), Pair("floor", "b"), Pair("a", "b"))
    scene = scene_of(FLOOR, *(ball(5.0, name=n, x=k) for k, n in enumerate(names[1:])), pairs=pairs)
    shares = factors(scene, "friction")
    assert shares[0] * shares[1] == pytest.approx(0.5, rel=1e-15) and shares[2] == 0.0


def test_refusal_of_a_table_that_no_product_gives():
    names = ("a", "b", "c")
    pairs = tuple(Pair(i, j, friction=0.5) for i, j in zip(names, names[1:] + names[:1], strict=True))
    bodies = (FLOOR, *(ball(5.0 + 2 * k, name=n) for k, n in enumerate(names)))
    table = (*pairs, Pair("floor", "*", friction=0.2), Pair("floor", "a", friction=0.9))
    scene = scene_of(*bodies, gravity=(0.0, 0.0, -9.81), duration=2.0, pairs=table)  # in which all can meet
    reason = ENGINE.refuses(scene, "tuned")
    assert reason.startswith("friction: ") and "\n" not in reason
    with pytest.raises(EngineError, match="friction: "):
        drive(scene)


# ---- state, readback, determinism --------------------------------------------------------------------------------


@pytest.mark.parametrize("profile", PROFILES)
def test_state_before_the_first_step(profile):
    post = Body("post", Box((0.2, 0.3, 0.4)), pose=(9.0, 1.0, 2.0, 0.6, 0.0, 0.8, 0.0), motion="fixed")
    scene = scene_of(ball(3.0, (1.0, 2.0, 3.0), (4.0, 5.0, 6.0)), FLOOR, post)
    record = drive(scene, profile)
    assert np.allclose(record.pose[0], [body.pose for body in scene.bodies], rtol=0.0, atol=1e-15)
    assert np.allclose(record.twist[0], [body.twist for body in scene.bodies], rtol=0.0, atol=1e-15)


@pytest.mark.parametrize("profile", PROFILES)
def test_readback_equal_to_the_requested_scene(profile):
    body = Body("b", Box((0.5,) * 3), 2.5, (0.3, 0.5, 0.9), (0.0, 0.0, 3.0, *UPRIGHT))
    held = drive(scene_of(FLOOR, body, e=0.4, mu=0.3, gravity=(0.0, 1.0, -9.0)), profile).readback
    assert held["fixedTimeStep"] == DT and held["numSolverIterations"] == 50 and held["numSubSteps"] == 0
    assert [held[f"gravityAcceleration{axis}"] for axis in "XYZ"] == [0.0, 1.0, -9.0]
    floor, box = held["bodies"]["floor"], held["bodies"]["b"]
    assert box["mass"] == pytest.approx(2.5, rel=1e-15) and box["inertia"] == pytest.approx((0.3, 0.5, 0.9), rel=1e-15)
    assert floor["friction"] * box["friction"] == pytest.approx(0.3, rel=1e-15)
    # Bullet does not fill restitution in for rigid bodies; there it must be absent rather than stale.
    assert ("restitution" in box) == (profile == "default")


@pytest.mark.parametrize("profile", PROFILES)
def test_equal_bits_of_two_builds_despite_another_client(profile):
    import pybullet

    boxes = [Body(f"b{k}", Box((0.5,) * 3), 1.0, (1 / 6,) * 3, (0.1 * k, 0.0, 0.5 + k, *UPRIGHT)) for k in range(3)]
    scene = scene_of(FLOOR, *boxes, mu=0.5, gravity=(0.0, 0.0, -9.81), duration=0.5)
    first = drive(scene, profile)
    other = pybullet.connect(pybullet.DIRECT)
    pybullet.setPhysicsEngineParameter(contactBreakingThreshold=0.5, physicsClientId=other)
    pybullet.disconnect(other)
    assert drive(scene, profile).state_hash() == first.state_hash()
    assert first.pose[-1, 3, 2] > 2.4  # and it stands


def test_worlds_built_side_by_side_share_nothing():
    def build(scene):
        return ENGINE.build(scene, DT, {s.name: s.value for s in ENGINE.settings("tuned", needs(scene), DT)})

    alone = drive(hit(0.02, 3.0, 0.8)).twist[-1, 1, 2]
    first, second = build(hit(0.02, 3.0, 0.8)), build(scene_of(ball(3.0), gravity=(0.0, 0.0, -9.81)))
    second.advance(20)
    first.advance(20)
    assert first.twist()[1, 2] == alone and second.twist()[0, 2] == pytest.approx(-9.81 * 20 * DT, rel=1e-12)
    for simulation in (first, second, first):
        simulation.close()


def test_loads_of_worlds_built_side_by_side():
    def build(force, torque):
        scene = scene_of(replace(ball(3.0, inertia=0.05), force=(force, 0.0, 0.0), torque=(0.0, torque, 0.0)))
        return ENGINE.build(scene, DT, {s.name: s.value for s in ENGINE.settings("tuned", needs(scene), DT)})

    worlds = {(1.0, 0.3): build(1.0, 0.3), (2.0, 0.1): build(2.0, 0.1)}  # [N], [N m], on 0.5 kg and 0.05 kg m^2
    for simulation in worlds.values():
        simulation.advance(10)
    for (force, torque), simulation in worlds.items():
        moved = simulation.twist()[0]
        assert moved[0] == pytest.approx(force / 0.5 * 10 * DT, rel=1e-12)
        assert moved[4] == pytest.approx(torque / 0.05 * 10 * DT, rel=1e-12)
        simulation.close()


# ---- refusals ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"contactErp": 0.1}, "contactErp: bullet has no such setting"),
        ({"contactERP": -0.1}, "contactERP: -0.1 must be a number of at least 0"),
        ({"linearDamping": math.nan}, "linearDamping: nan must be a number of at least 0"),
        ({"contactSlop": "thin"}, "contactSlop: 'thin' must be a number of at least 0"),
        ({"enableSAT": 2}, "enableSAT"),
        ({"iterations": 0}, "iterations: 0 must be a whole number from 1 to "),
        ({"iterations": 2.5}, "iterations: 2.5 must be a whole number"),
        ({"contactDamping": 1.0}, "contactStiffness: bullet takes it together with contactDamping only"),
    ],
)
def test_bad_settings_are_refused_in_one_line(changes, message):
    with pytest.raises(EngineError) as error:
        drive(hit(0.02, 1.0, 0.5), **changes)
    assert str(error.value).startswith(message) and "\n" not in str(error.value)


@pytest.mark.parametrize("dt", [0.0, -0.1, math.nan, math.inf])
def test_bad_steps_are_refused(dt):
    with pytest.raises(EngineError, match=r"dt: .* must be a positive, finite"):
        ENGINE.build(hit(0.02, 1.0, 0.5), dt, {})


@pytest.mark.parametrize(
    ("scene", "message"),
    [
        (scene_of(Body("b", Sphere(1e-3), 1.0, (1.0,) * 3)), "b.shape: "),
        (scene_of(Body("b", Sphere(0.5), 1e-13, (1.0,) * 3)), "b: "),
        (scene_of(Body("b", Sphere(0.5), 1.0, (1.0, 1.0, 1e-14))), "b: "),
        (scene_of(FLOOR, ball(2.0), gravity=(0.0, 0.0, -9.81), duration=2.0, mu=11.0), "friction: "),
    ],
)
def test_scenes_beyond_bullet_refused_with_a_reason(scene, message):
    assert ENGINE.refuses(scene, "tuned").startswith(message)
    assert ENGINE.refuses(hit(0.02, 1.0, 0.5), "tuned") is None


def test_needs_and_reasons_of_settings():
    impact, rest = needs(hit(0.02, 1.0, 0.5)), needs(scene_of(FLOOR, ball(1.0), gravity=(0.0, 0.0, -9.81)))
    names = {s.name: s.value for s in ENGINE.settings("tuned", impact, DT)}
    assert names["splitImpulsePenetrationThreshold"] == 0.0 and names["contactSlop"] == 1e-6
    names = {s.name: s.value for s in ENGINE.settings("tuned", rest, DT)}
    assert "splitImpulsePenetrationThreshold" not in names and names["contactSlop"] == 1e-5
    for profile in PROFILES:
        assert all(setting.because for setting in ENGINE.settings(profile, rest, DT))
    assert {s.name: s.value for s in ENGINE.settings("one", rest, DT, 7)}["iterations"] == 7


# ---- what profiles declare ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("dt", [1 / 60, DT, 1 / 960])
@pytest.mark.parametrize("e", [0.0, 0.4, 0.9])
@pytest.mark.parametrize("profile", ["default", "one"])
def test_declared_rebound_at_other_phases(profile, e, dt):
    declared = ENGINE.declares(profile, needs(hit(0.1, 2.0, e)), dt)["restitution"]
    phases = np.array([0.0137, 0.21, 0.333, 0.4999, 0.71, 0.8311, 0.98])  # none is (k + 1/2)/64
    balls = [
        ball(0.5 + (3.0 + phase) * 2.0 * dt, (0.0, 0.0, -2.0), name=f"b{k}", x=3.0 * k)
        for k, phase in enumerate(phases)
    ]
    scene = scene_of(FLOOR, *balls, e=e, duration=7 * dt + 0.2)
    measured = drive(scene, profile, dt, Sampling(100000)).twist[-1, 1:, 2] / 2.0
    assert np.all(np.abs(measured - declared.value) <= declared.band)
    # No blank cheque: where the law says the rebound is lost, or gains 1 %, the band says so as well.
    if profile == "one":
        assert declared.band < 0.011
    elif e > 0.0 and dt < 0.01:
        assert e - declared.value > 2.0 * declared.band


def test_declared_drag_over_a_second_of_flight():
    flying = scene_of(ball(5.0, (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)), duration=1.0)
    declared = ENGINE.declares("default", needs(flying), DT)
    end = drive(flying, "default").twist[-1, 0]
    assert 1.0 - end[0] == pytest.approx(declared["linear_damping"].value, abs=1e-12)
    assert 1.0 - end[4] == pytest.approx(declared["angular_damping"].value, abs=1e-12)
    assert ENGINE.declares("tuned", needs(flying), DT) == {}


# ---- measured without the adapter --------------------------------------------------------------------------------


def test_drift_and_weight_of_ten_boxes():
    boxes = [Body(f"b{k}", Box((0.5,) * 3), 1.0, (1 / 6,) * 3, (0.0, 0.0, 0.5 + k, *UPRIGHT)) for k in range(10)]
    scene = scene_of(FLOOR, *boxes, mu=0.5, gravity=(0.0, 0.0, -9.81), duration=5.0)
    record = drive(scene, sampling=Sampling(1, 4.0))
    drift = np.abs(record.pose[-1, :, :2] - record.pose[0, :, :2]).max()
    assert drift == pytest.approx(0.68e-3, abs=0.01e-3)  # per axis
    bottom = record.contacts.impulse_between(0, 1)[:, 2] / (10 * 9.81 * DT)
    assert bottom.mean() == pytest.approx(1.0, abs=1e-6) and bottom.std() < 1e-5


@pytest.mark.parametrize(("ratio", "slides"), [(0.5, False), (0.999, False), (1.001, True), (1.1, True)])
def test_tuned_box_below_and_above_the_cone(ratio, slides):
    theta = math.atan(0.5 * ratio)
    gravity = (9.81 * math.sin(theta), 0.0, -9.81 * math.cos(theta))
    box = Body("box", Box((0.5,) * 3), 1.0, (1 / 6,) * 3, (0.0, 0.0, 0.5, *UPRIGHT))
    end = drive(scene_of(FLOOR, box, mu=0.5, gravity=gravity, duration=1.0)).twist[-1, 1, 0]
    if slides:
        assert end == pytest.approx(9.81 * (math.sin(theta) - 0.5 * math.cos(theta)), rel=5e-3)
    else:
        assert abs(end) < 1e-6


@pytest.mark.parametrize("profile", ["tuned", "one"])
def test_contact_points_kept_where_a_box_slides_and_at_rest(profile):
    """Of a box at twice the angle of friction the shipped threshold loses a thousandth of the acceleration."""

    def measured(scene, metric, params, **changed):
        slot = switched(Slot(scene, tuple(params.items()), 3, "bullet", profile, DT), changed)
        return execute(slot).metrics[metric][0]

    canonical = CATALOGUE["incline"]
    truth = canonical.exact(canonical.scene(3, {"ratio": 2.0}))["acceleration"]
    assert measured("incline", "acceleration", {"ratio": 2.0}) == pytest.approx(truth, rel=1e-10)
    shipped = measured("incline", "acceleration", {"ratio": 2.0}, contactBreakingThreshold=0.02)
    assert abs(shipped / truth - 1.0) > 8e-4
    column = {"n": 3.0, "duration": 1.5}
    sunk = [measured("stack", "penetration", column, **changed) for changed in ({}, {"contactBreakingThreshold": 0.02})]
    assert sunk[0] == sunk[1] > 0.0


@pytest.mark.parametrize("normal", [(0, 0, 1), (0, 0, -1), (1, 0, 0), (0, -1, 0), (0.6, 0.0, 0.8), (0.48, -0.64, -0.6)])
def test_side_of_a_plane_and_a_ceiling(normal):
    from adapters.bullet.translation import _turn_up_to

    x, y, z, w = _turn_up_to(normal)
    assert math.hypot(x, y, z, w) == pytest.approx(1.0, abs=1e-12)
    assert (2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)) == pytest.approx(normal, abs=1e-12)


# ---- faces that are clipped ----------------------------------------------------------------------------------------


def test_contacts_of_a_box_on_a_hull(tmp_path, monkeypatch):
    """Without, from the same files, it stands on one in some of them; nothing else in the run differs."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    canonical = CATALOGUE["wedge"]
    scene = canonical.scene(2, {})
    fewest = {}
    for known in (0, 1):
        found = drive(scene, enableSAT=known)
        rows, starts = found.contacts.rows, found.contacts.offset
        on_the_face = (rows.a == scene.index("wedge")) & (rows.b == scene.index("block"))
        counts = [int(on_the_face[i:j].sum()) for i, j in pairwise(starts)]
        fewest[known] = min(counts)
        assert max(counts) == 4 and len(counts) == math.ceil(scene.duration / DT)
    assert fewest == {0: 1, 1: 4}
    assert list(tmp_path.iterdir()) == []


def test_hull_from_a_file():
    """It stands on a half-space, and a ball lies a millimetre deep in its upper face."""
    corners = tuple((x, y, z) for x in (-0.3, 0.3) for y in (-0.2, 0.2) for z in (-0.1, 0.1))
    above = ball(0.1 + 0.5 - 1e-3, name="above", x=0.1)
    hull = Body("hull", Hull(corners), 1.0, (0.02, 0.03, 0.04), (0.0, 0.0, 0.0, *UPRIGHT))
    floor = Body("floor", HalfSpace((0.0, 0.0, 1.0), -0.1), motion="fixed")
    gaps = {}
    for name, changes in {"vertices": {}, "file": {"enableSAT": 0}, "faces": {"enableSAT": 1}}.items():
        rows = drive(scene_of(floor, hull, above, duration=DT), "one", **changes).contacts.rows
        gaps[name] = [rows.gap[(rows.a == a) & (rows.b == b)].min() for a, b in ((0, 1), (1, 2))]
    # A hull keeps a margin of 1 mm, but where faces are clipped; vertices of a file are rounded to 24 bits.
    assert gaps["vertices"] == pytest.approx([-1e-3, -2e-3], abs=1e-12)
    assert gaps["file"] == pytest.approx([-1e-3, -2e-3], abs=1e-7)
    assert gaps["faces"] == pytest.approx([0.0, -2e-3], abs=1e-7)


def test_tuned_face_clipping_for_hulls_and_not_for_boxes():
    """Columns, slopes and blows of boxes alone have the same bits either way: theirs is another detector."""
    wedge = CATALOGUE["wedge"].scene(2, {})
    assert {s.name: s.value for s in ENGINE.settings("tuned", needs(wedge), DT)}["enableSAT"] == 1
    for name, params in (("incline", {}), ("pinch", {"margin": 100.0}), ("flat_box", {})):
        scene = replace(CATALOGUE[name].scene(2, params), duration=0.25)
        assert "enableSAT" not in {s.name for s in ENGINE.settings("tuned", needs(scene), DT)}
        plain, other = drive(scene), drive(scene, enableSAT=1)
        assert np.array_equal(plain.pose, other.pose) and np.array_equal(plain.twist, other.twist)


@pytest.mark.parametrize(("e", "mu"), [(1.0, 0.0), (0.5, 0.3)])
@pytest.mark.parametrize("corners", [3, 4, 6])
def test_no_spin_of_a_slipping_hull_that_lands_flat(corners, e, mu):
    """It leaves with (v - mu (1 + e) w, e w) and no spin: corners ahead are loaded more, and undo what friction turns.

    From vertices the blow is one corner's after another's, and turns it.
    """
    start = -0.5 * math.pi + math.pi / corners
    angles = [start + 2.0 * math.pi * k / corners for k in range(corners)]
    shape = Polygon(tuple((0.5 * math.cos(a), 0.5 * math.sin(a)) for a in angles))
    body = Body("hull", shape, 1.0, 0.1, (0.0, 0.7, 0.0), (0.5, -1.0, 0.0))
    floor = Body("floor", HalfSpace((0.0, 1.0), 0.0), motion="fixed")
    scene = planar(floor, body, e=e, mu=mu, duration=0.75)
    found = {changed: drive(scene, enableSAT=changed).twist[-1, 1] for changed in (0, 1)}
    assert found[1] == pytest.approx((0.5 - mu * (1.0 + e), e, 0.0), abs=1e-9)
    assert abs(found[0][2]) > 1e-3
    assert "enableSAT" in {s.name for s in ENGINE.settings("tuned", needs(scene), DT)}


#: Cells in which Bullet keeps the vertices of a hull, along each axis of its extents (btConvexHullComputer.cpp).
CELLS = 10216


def on_the_grid(vertices):
    """The grid points next to vertices, a thousandth of a cell outwards: what is cut off there is nothing."""
    corners = np.array(vertices)
    centre = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
    cell = (corners.max(axis=0) - corners.min(axis=0)) / CELLS
    steps = np.round((corners - centre) / cell)
    return Hull(tuple(map(tuple, (centre + cell * (steps + 1e-3 * np.sign(steps))).tolist())))


@pytest.mark.parametrize(
    ("name", "params", "metric"),
    [("arch", {}, "moved"), ("arch", {"ratio": 1.02}, "moved"), ("arch", {"ratio": 0.8}, "off_the_faces"),
     ("wedge", {"ratio": 100.0}, "acceleration"), ("wedge", {"ratio": 100.0}, "out_of_plane")],
)  # fmt: skip
def test_rounded_vertices_as_the_error_of_clipped_hulls(name, params, metric, monkeypatch):
    """Families `arch-hull-grid` and `wedge-hull-grid`: where vertices lie on the grid already, the check passes."""
    canonical = CATALOGUE[name]
    scene = canonical.scene(2, params)
    checks = [*canonical.checks(scene, DT), *plane_of(canonical, scene, DT)]
    check = next(check for check in checks if check.metric == metric)

    def error():
        found = drive(scene, sampling=canonical.sampling(scene))
        measured = {**canonical.measure(scene, found), "out_of_plane": (found.out_of_plane, "")}
        return abs(measured[metric][0] - check.truth)

    cut = error()
    as_stated = clipped.files

    def rounded(shape, *rest):
        return as_stated(on_the_grid(shape.vertices) if isinstance(shape, Hull) else shape, *rest)

    monkeypatch.setattr(clipped, "files", rounded)
    assert error() < check.bound < cut


def test_hull_rounded_by_whole_grid_cells():
    """A hull hovers where its lowest vertices are cut: round-off decides for each whether they are."""
    rng, cells = np.random.default_rng(1), []
    floor = Body("floor", HalfSpace((0.0, 0.0, 1.0), 0.0), motion="fixed")
    for half in rng.uniform(0.2, 1.5, (12, 3)):
        corners = tuple(product(*((-h, h) for h in half)))
        hull = Body("hull", Hull(corners), 1.0, (0.1, 0.1, 0.1), (0.0, 0.0, half[2] - 1e-3, *UPRIGHT))
        gap = drive(scene_of(floor, hull, duration=DT)).contacts.rows.gap.min()
        cells.append((gap + 1e-3) / (2.0 * half[2] / CELLS))
    # 1e-3 cells: the 24 bits of a vertex in a file are 6e-8 of it, and it is 5108 cells from the middle.
    assert np.abs(np.array(cells) - np.round(cells)).max() < 1e-3
    assert set(np.round(cells)) == {0.0, 1.0}


@pytest.mark.parametrize("params", [{"height": 1.09}, {"e": 0.95, "height": 1.03}], ids=str)
def test_rest_time_of_a_shipped_ball_decided_by_round_off(params):
    """Family `bounce-interval-blurred`: the law's own recurrence, started within round-off, spreads over many steps.

    Bullet's answer lies in that spread, which is wide enough for the law to be silent; tuned has none of it.
    """
    canonical, dt = CATALOGUE["bounce"], 1.0 / 120.0
    scene = canonical.scene(2, params)
    moved = [k * GAP_ROUND_OFF for k in range(-20, 21)]
    shipped, better = (law_of(profile, needs(scene), dt) for profile in ("default", "tuned"))
    times = [laws._measured(scene, dt, canonical.measure, shipped, by)["rest_time"][0] for by in moved]
    found = canonical.measure(scene, drive(scene, "default", dt, canonical.sampling(scene)))["rest_time"][0]
    assert max(times) - min(times) > 10.0 * dt
    assert min(times) - dt <= found <= max(times) + dt
    steady = {laws._measured(scene, dt, canonical.measure, better, by)["rest_time"][0] for by in moved[::8]}
    assert max(steady) - min(steady) <= dt


@pytest.mark.parametrize("off", [0.0, 1e-3, 5e-3, -5e-3])
def test_refusal_of_a_table_near_a_product(off: float) -> None:
    """Four balls that can all meet have six pairs and four factors: one pair that is off leaves no product."""
    balls = [ball(0.5 + k, (0.0, 0.0, 3.0), name=f"b{k}") for k in range(4)]
    pairs = (Pair(friction=0.5, restitution=0.0), Pair("b0", "b3", friction=0.5 + off, restitution=0.0))
    scene = scene_of(*balls, pairs=pairs, duration=1.0)
    found = factors(scene, "friction")
    assert (found is None) == (off != 0.0)
    assert off or found == pytest.approx([math.sqrt(0.5)] * 4)
