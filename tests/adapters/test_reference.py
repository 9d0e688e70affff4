"""The adapter of our own solver: both dimensions, both profiles, certificate and readback."""

from __future__ import annotations

import json
import math
from dataclasses import fields, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from adapters.conformance.planted_faults import Planted
from adapters.engine import EngineError
from adapters.needs import needs
from adapters.receipts import FRICTION_SHARE, receipts
from adapters.reference import ReferenceEngine
from adapters.reference.profiles import FORMER, KINDS, REASONS
from adapters.scene import Body, Box, Disc, HalfSpace, Pair, Scene, Sphere
from adapters.settings.own import given, own
from adapters.stepping import run
from adapters.trajectory import Sampling, Trajectory
from reference_solver.model import Array
from reference_solver.simulation import UNCERTIFIED

ENGINE = ReferenceEngine()
PROFILES = ("classical", "reference")
DT = 1.0 / 240.0
EPS = np.finfo(float).eps


def floor(dimension: int) -> Body:
    return Body("floor", HalfSpace((0.0,) * (dimension - 1) + (1.0,), 0.0), motion="fixed")


def body(name: str, dimension: int, position: tuple[float, float], velocity: tuple[float, float] = (0.0, 0.0),
         box: bool = False, **changes: Any) -> Body:  # fmt: skip
    """Disc, sphere, square or cube of 1 m and 1 kg; positions and velocities in the vertical plane."""
    (x, z), (vx, vz) = position, velocity
    if dimension == 2:
        made = Body(name, Box((0.5, 0.5)) if box else Disc(0.5), 1.0, 0.125, (x, z, 0.0), (vx, vz, 0.0))
    else:
        shape = Box((0.5, 0.5, 0.5)) if box else Sphere(0.5)
        pose = (x, 0.0, z, 1.0, 0.0, 0.0, 0.0)
        made = Body(name, shape, 1.0, (0.1, 0.1, 0.1), pose, (vx, 0.0, vz, 0.0, 0.0, 0.0))
    return replace(made, **changes)


def make(*bodies: Body, e: float = 0.0, mu: float = 0.0, g: float = 0.0, T: float = 0.1,
         pairs: tuple[Pair, ...] = ()) -> Scene:  # fmt: skip
    dimension = 2 if len(bodies[-1].pose) == 3 else 3
    gravity = (0.0,) * (dimension - 1) + (-g,)
    return Scene("test", 1, dimension, bodies, (Pair(restitution=e, friction=mu), *pairs), gravity, T)


def drive(scene: Scene, profile: str, dt: float = DT, iterations: int | None = None) -> Trajectory:
    chosen = ENGINE.settings(profile, needs(scene), dt, iterations)
    return run(ENGINE, scene, dt, {s.name: s.value for s in chosen}, Sampling(1, 0.0))


both = pytest.mark.parametrize("dimension", [2, 3])
profiles = pytest.mark.parametrize("profile", PROFILES)


@both
@profiles
@pytest.mark.parametrize(("e", "v"), [(0.0, 6.0), (0.2, 0.1), (0.8, 6.0), (1.0, 50.0)])
def test_exact_rebound_of_a_single_contact(dimension: int, profile: str, e: float, v: float) -> None:
    ball = body("ball", dimension, (0.0, 0.5 + 3.4 * v * DT), (0.0, -v))
    trajectory = drive(make(floor(dimension), ball, e=e, T=8 * DT), profile)
    up = dimension - 1
    assert abs(trajectory.twist[-1, 1, up] - e * v) <= 4.0 * EPS * v
    assert trajectory.contacts is not None
    impulse = trajectory.contacts.impulse_between(0, 1).sum(axis=0)
    assert abs(impulse[up] - (1.0 + e) * v) <= 8.0 * EPS * v
    assert np.all(trajectory.contacts.rows.normal[:, up] == 1.0)


@both
@profiles
def test_each_pair_has_its_own_restitution(dimension: int, profile: str) -> None:
    balls = [body(f"b{i}", dimension, (3.0 * i, 0.51), (0.0, -3.0)) for i in range(3)]
    pairs = tuple(Pair(f"b{i}", "floor", e) for i, e in enumerate((0.0, 0.3, 1.0)))
    trajectory = drive(make(*balls, floor(dimension), body("far", dimension, (-9.0, 9.0)), pairs=pairs), profile)
    assert np.allclose(trajectory.twist[-1, :3, dimension - 1], [0.0, 0.9, 3.0], rtol=0.0, atol=1e-14)


@both
@profiles
@pytest.mark.parametrize("swapped", [False, True])
def test_impulses_act_on_the_higher_index(dimension: int, profile: str, swapped: bool) -> None:
    left = body("left", dimension, (-0.52, 0.0), (3.0, 0.0), mass=2.0)
    right = body("right", dimension, (0.52, 0.0), (-1.0, 0.0))
    bodies = (right, left) if swapped else (left, right)
    trajectory = drive(make(*bodies, e=0.5), profile)
    assert trajectory.contacts is not None
    impulse = trajectory.contacts.impulse_between(0, 1).sum(axis=0)
    gained = bodies[1].mass * (trajectory.twist[-1, 1, :dimension] - np.array(bodies[1].twist[:dimension]))
    assert np.allclose(impulse, gained, rtol=0.0, atol=1e-14)
    assert impulse[0] == pytest.approx(-4.0 if swapped else 4.0, abs=1e-14)  # 2/3 kg x 1.5 x 4 m/s
    assert np.allclose(trajectory.contacts.rows.normal[:, 0], -1.0 if swapped else 1.0)


@both
@profiles
def test_free_fall_ahead_of_the_parabola(dimension: int, profile: str) -> None:
    trajectory = drive(make(body("ball", dimension, (0.0, 0.0)), g=9.81, T=1.0), profile)
    t, up = trajectory.t, dimension - 1
    offset = ENGINE.scheme(profile).position_offset
    exact = -0.5 * 9.81 * t * t - offset * 0.5 * 9.81 * t * DT
    assert np.abs(trajectory.pose[:, 0, up] - exact).max() < 3e-13


@profiles
def test_forces_and_torques_act_with_the_stated_mass_and_inertia(profile: str) -> None:
    flat = body("b", 2, (0.0, 0.0), box=True, mass=4.0, inertia=0.7, force=(2.0, -6.0), torque=(1.4,))
    assert np.allclose(drive(make(flat, T=1.0), profile).twist[-1, 0], [0.5, -1.5, 2.0], rtol=0.0, atol=1e-12)
    moments = (0.7, 0.7, 0.7)  # equal moments: no gyroscopic term
    loads = {"force": (2.0, 4.0, -6.0), "torque": (1.4, 0.0, -0.7)}
    solid = body("b", 3, (0.0, 0.0), box=True, mass=4.0, inertia=moments, **loads)
    expected = [0.5, 1.0, -1.5, 2.0, 0.0, -1.0]
    assert np.allclose(drive(make(solid, T=1.0), profile).twist[-1, 0], expected, rtol=0.0, atol=1e-12)


@both
@profiles
def test_a_resting_box_carries_its_weight(dimension: int, profile: str) -> None:
    box = body("box", dimension, (0.0, 0.5), box=True)
    trajectory = drive(make(floor(dimension), box, mu=0.5, g=9.81, T=0.1), profile)
    assert trajectory.contacts is not None
    load = trajectory.contacts.impulse_between(0, 1)[-1]
    # Forces at rest are solved to round-off, 10 sweeps with warm starting 1e-6 after two dozen steps.
    assert load[dimension - 1] == pytest.approx(9.81 * DT, rel=1e-12 if profile == "reference" else 1e-6)
    assert len(trajectory.contacts.rows.a[trajectory.contacts.offset[-2] :]) == (2 if dimension == 2 else 4)


@both
@profiles
def test_a_sliding_box_is_braked_by_mu_g(dimension: int, profile: str) -> None:
    box = body("box", dimension, (0.0, 0.5), (3.0, 0.0), box=True)
    trajectory = drive(make(floor(dimension), box, mu=0.3, g=9.81, T=0.5), profile)
    rate = (trajectory.twist[-1, 1, 0] - trajectory.twist[60, 1, 0]) / (trajectory.t[-1] - trajectory.t[60])
    assert rate == pytest.approx(-0.3 * 9.81, rel=1e-9)


@both
@profiles
def test_a_prescribed_body_keeps_its_motion_and_pushes(dimension: int, profile: str) -> None:
    wall = body("wall", dimension, (-1.02, 0.0), (1.0, 0.0), box=True, motion="prescribed")
    trajectory = drive(make(wall, body("ball", dimension, (0.0, 0.0)), e=0.5), profile)
    assert np.all(trajectory.twist[:, 0, 0] == 1.0)
    assert trajectory.twist[-1, 1, 0] == pytest.approx(1.5, abs=1e-14)


@both
def test_what_steps_and_the_loop_say_of_themselves(dimension: int) -> None:
    boxes = [body(f"b{i}", dimension, (0.0, 0.5 + i), box=True) for i in range(2)]
    ball = make(floor(dimension), body("ball", dimension, (0.0, 0.5)), mu=0.5, g=9.81, T=0.1)
    column = make(floor(dimension), *boxes, mu=0.5, g=9.81, T=0.1)
    exact, starved = drive(ball, "reference").certificate, drive(column, "classical", iterations=1).certificate
    assert exact == {"closed": True}  # what is certified afterwards does not certify itself
    # A fixed number of sweeps promises no solution: nothing is measured but the sweeps and how far bodies were pushed.
    assert starved["worst_sweeps"] == 1 and starved["sweeps"] == 24 and set(starved) == {*UNCERTIFIED}
    assert json.loads(json.dumps(starved)) == starved


@both
def test_certificate_refused_for_a_run_with_another_end(dimension: int) -> None:
    """By the last place of one coordinate of a body that is free; where others are the audit knows."""
    scene = make(floor(dimension), body("ball", dimension, (0.0, 0.5), (1.0, 0.0)), g=9.81)
    settings = {s.name: s.value for s in ENGINE.settings("reference", needs(scene), DT)}
    end = drive(scene, "reference").pose[-1]
    elsewhere, fixed = end.copy(), end.copy()
    elsewhere[1, 0] = np.nextafter(elsewhere[1, 0], 1.0)
    fixed[0, 0] = 1.0
    for pose, holds in ((end, True), (fixed, True), (elsewhere, False)):
        found = ENGINE.certify(scene, DT, settings, round(scene.duration / DT), pose)
        assert found is not None and found["holds"] is holds
        assert ("the certified run does not end where" in " ".join(found["reasons"])) is not holds


@both
@profiles
def test_solver_state_equal_to_the_requested_scene(dimension: int, profile: str) -> None:
    inertia: Any = 0.11 if dimension == 2 else (0.11, 0.12, 0.13)
    ball = body("ball", dimension, (0.0, 0.6), mass=2.0, inertia=inertia)
    held = drive(make(floor(dimension), ball, e=0.5, mu=0.3, g=9.0), profile).readback
    assert held["dt"] == DT and held["gravity"][-1] == -9.0
    assert held["bodies"] == {"ball": {"mass": 2.0, "inertia": 0.11 if dimension == 2 else [0.11, 0.12, 0.13]}}
    assert held["pairs"] == {"floor-ball": {"restitution": 0.5, "friction": 0.3}}
    assert (held["tolerance"] is None) == (profile == "classical")
    assert isinstance(held["left_out"], list)
    assert json.loads(json.dumps(held)) == held


def test_every_setting_of_the_solver_has_its_reason() -> None:
    from reference_solver import Settings

    names = {field.name for field in fields(Settings)} - {"dt"} - set(FORMER)
    assert set(REASONS) == set(KINDS) == names
    scene = make(floor(2), body("ball", 2, (0.0, 1.0)))
    classical, reference = (ENGINE.settings(profile, needs(scene), DT) for profile in PROFILES)
    assert {s.name for s in classical} == names - {"tolerance"} and {s.name for s in reference} == {"tolerance"}
    assert all(s.because and s.source for s in (*classical, *reference))
    assert {s.name: s.value for s in classical}["iterations"] == 10


@pytest.mark.parametrize(
    ("profile", "text", "said"),
    [
        ("reference", "scheme=fixed", "reference has no setting 'scheme'; the profile takes its place: reference goes "
         "from event to event, classical makes steps; crosscheck describe reference lists all"),
        ("classical", "accuracy=1e-9", "reference has no setting 'accuracy'; tolerance of profile reference takes its "
         "place; crosscheck describe reference lists all"),
        ("reference", "residual=1e-9", "residual: is of the steps of profile classical; profile reference has "
         "tolerance alone"),
        ("classical", "tolerance=1e-9", "tolerance: is of profile reference; classical makes steps, which have no such "
         "setting"),
        ("reference", "tolerance=1e-12", "tolerance=1e-12: must be a number from 1e-11 to 1e-05"),
        ("reference", "tolerance=none", "tolerance=none: must be a number from 1e-11 to 1e-05"),
        ("reference", "tolerance=fine", "tolerance=fine: must be a number from 1e-11 to 1e-05"),
    ],
)  # fmt: skip
def test_setting_of_the_other_profile_or_of_an_earlier_version(profile: str, text: str, said: str) -> None:
    scene = make(floor(2), body("ball", 2, (0.0, 1.0)))
    with pytest.raises(EngineError) as error:
        own(ENGINE, given([text]), ENGINE.settings(profile, needs(scene), DT))
    assert str(error.value) == f"set: {said}"


@pytest.mark.parametrize("tolerance", [1e-11, 1e-5])
def test_both_ends_of_the_tolerance_certified(tolerance: float) -> None:
    scene = make(floor(2), body("ball", 2, (0.0, 0.6)), e=0.5, g=9.81)
    settings = {"tolerance": tolerance}
    end = run(ENGINE, scene, DT, settings, Sampling(1, 0.0)).pose[-1]
    found = ENGINE.certify(scene, DT, settings, round(scene.duration / DT), end)
    assert found is not None and found["holds"], found["reasons"]


def test_error_from_runs_to_other_tolerances_that_are_known() -> None:
    """The same X as from runs that the certificate makes itself; and one of them that is off by 1 um shows in X."""
    brick = body("brick", 3, (0.0, 0.0), box=True, inertia=(0.1, 0.2, 0.3))
    scene = make(replace(brick, twist=(0.0, 0.0, 0.0, 2.0, 0.01, 1.0)), T=1.0)
    settings = {"tolerance": 1e-11}
    asked = ENGINE.at_other_tolerances(settings, {"closed": False})
    runs = [run(ENGINE, scene, DT, each, Sampling(1, 0.0)).pose for each in (settings, *asked)]

    def error(*others: Array) -> float:
        found = ENGINE.certify(scene, DT, settings, round(scene.duration / DT), runs[0][-1], others)
        assert found is not None
        return float(found["error"])

    assert 0.0 < error() == error(*runs[1:])
    assert error(runs[1], runs[2] + 1e-6) > 2e-6


@pytest.mark.parametrize(("spins", "others"), [((0.0, 0.0, 0.0), 0), ((2.0, 0.01, 1.0), 2)])
def test_tolerance_of_a_step(spins: tuple[float, ...], others: int) -> None:
    """A brick that flies without a spin is in closed form; one that tumbles is not, and differs a little."""
    brick = body("brick", 3, (0.0, 0.0), box=True, inertia=(0.1, 0.2, 0.3))
    scene = make(replace(brick, twist=(0.0, 0.0, 0.0, *spins)), T=1.0)
    found = drive(scene, "reference")
    asked = ENGINE.at_other_tolerances({"tolerance": 1e-11}, found.certificate)
    apart = [np.abs(run(ENGINE, scene, DT, other, Sampling(1, 0.0)).pose - found.pose).max() for other in asked]
    assert len(asked) == others and all(0.0 < each < 1e-9 for each in apart)
    assert ENGINE.build(scene, DT, {"tolerance": 1e-12}) and found.certificate["closed"] is (others == 0)


def test_refusal_of_the_loop_in_one_line() -> None:
    lid = Body("lid", HalfSpace((0.0, -1.0), -2.0), twist=(0.0, -1.0, 0.0), motion="prescribed")
    scene = make(floor(2), lid, body("ball", 2, (0.0, 0.5)), g=9.81, T=2.0)
    with pytest.raises(EngineError, match=r"^no impulses part the bodies that meet at 1 s: [^\n]*\Z"):
        drive(scene, "reference")


def test_iteration_count_for_classical_and_refused_by_reference() -> None:
    scene = make(floor(2), body("ball", 2, (0.0, 1.0)))
    assert drive(scene, "classical", iterations=7).readback["iterations"] == 7
    with pytest.raises(EngineError, match=r"^iterations: reference/reference does not stop at an iteration count"):
        drive(scene, "reference", iterations=7)


@pytest.mark.parametrize(
    ("settings", "field"),
    [({"iterations": 0}, "iterations"), ({"slop": -1.0}, "slop"), ({"speed": 1.0}, "speed"), ({"beta": 2.0}, "beta")],
)
def test_a_bad_setting_is_refused_in_one_line(settings: dict[str, Any], field: str) -> None:
    with pytest.raises(EngineError, match=rf"^{field}: [^\n]*\Z"):
        ENGINE.build(make(floor(2), body("ball", 2, (0.0, 1.0))), DT, settings)


@pytest.mark.parametrize("e", [0.1, 0.5, 1.0])
@pytest.mark.parametrize("dt", [1.0 / 60.0, DT])
def test_friction_of_fixed_sweeps_where_a_box_rocks(e: float, dt: float) -> None:
    """At e = 1 and 1/60 s the box loses 3e-4 of mu N: more than an exact solve may, less than its corners slip aside.

    The band is as wide as the cosine that is lost, 1.4 % at the most of these: twice as much is a fault.
    """
    asked = needs(make(floor(3), body("box", 3, (0.0, 0.5), box=True), e=e, mu=0.3, g=9.81))
    for quantity in ("friction", "friction_impulse"):
        band = ENGINE.declares("classical", asked, dt)[quantity].band
        assert FRICTION_SHARE * 0.3 < band < 0.007 * 0.3
        for engine, holds in ((ENGINE, True), (Planted(ENGINE, "friction", 2.1 * band / 0.3), False)):
            (told,) = (r for r in receipts(engine, "classical", asked, dt) if r.quantity == quantity)
            assert told.holds == holds, told
    assert not ENGINE.declares("reference", asked, dt)
    assert not ENGINE.declares("classical", replace(asked, dimension=2), dt)
    assert not ENGINE.declares("classical", replace(asked, restitution=0.0), dt)


@pytest.mark.parametrize("dt", [0.0, -1.0, math.nan])
def test_a_bad_step_is_refused(dt: float) -> None:
    with pytest.raises(EngineError, match=r"^dt: "):
        ENGINE.build(make(floor(2), body("ball", 2, (0.0, 1.0))), dt, {})


@both
@profiles
def test_two_builds_give_the_same_bits(dimension: int, profile: str) -> None:
    boxes = [body(f"b{i}", dimension, (0.01 * i, 0.5 + i), box=True) for i in range(2)]
    scene = make(floor(dimension), *boxes, mu=0.5, g=9.81, T=0.1)
    first, second = drive(scene, profile), drive(scene, profile)
    assert first.state_hash() == second.state_hash()
    assert first.contacts is not None and second.contacts is not None
    assert first.contacts.rows.impulse.tobytes() == second.contacts.rows.impulse.tobytes()


def test_version_of_package_and_solver_sources() -> None:
    package, _, sources = ENGINE.version().partition("+")
    assert package and len(sources) == 8 and int(sources, 16) >= 0
    assert ENGINE.version() == ENGINE.version()


def test_version_without_the_installed_package(monkeypatch: pytest.MonkeyPatch) -> None:
    for spec in (None, SimpleNamespace(submodule_search_locations=None)):
        monkeypatch.setattr("adapters.reference.engine.find_spec", lambda name, spec=spec: spec)
        with pytest.raises(ImportError, match=r"^No module named 'reference_solver'$"):
            ENGINE.version()


def test_every_valid_scene_accepted() -> None:
    for dimension in (2, 3):
        scene = make(floor(dimension), body("ball", dimension, (0.0, 1.0)), e=1.0, mu=2.0)
        assert all(ENGINE.refuses(scene, profile) is None for profile in PROFILES)


@both
def test_distant_scene_refused_before_the_run(dimension: int) -> None:
    """On either side of the limit of one step of numbers in half widths."""
    limit = 1e-8 * 0.5 / float(np.finfo(float).eps)
    near, far = (make(floor(dimension), body("ball", dimension, (share * limit, 1.0))) for share in (0.9, 1.1))
    assert ENGINE.refuses(near, "reference") is None and ENGINE.refuses(far, "classical") is None
    refusal = ENGINE.refuses(far, "reference")
    assert refusal is not None and refusal.startswith(f"ball lies {1.1 * limit:.3g} m from the origin")
