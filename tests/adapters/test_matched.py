"""MuJoCo's profile ``matched``: Newton's and Coulomb's laws by a loop around its solver, against their closed forms."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("mujoco")

from driven import driven

from adapters.engine import EngineError
from adapters.mujoco import MujocoEngine
from adapters.mujoco.matched import AGREED, SETTLED, by_geoms, law_of, matched_step2, rebounding
from adapters.needs import needs
from adapters.registry import is_ranked
from adapters.scene import Body, Box, Disc, HalfSpace, Pair, Scene, Sphere
from adapters.scene.lift import lift
from adapters.trajectory import Trajectory
from validation.posed import resolve

ENGINE = MujocoEngine()
settings, drive = driven(ENGINE, "matched")
FLOOR = Body("floor", HalfSpace((0.0, 0.0, 1.0)), motion="fixed")
DT, G = 1.0 / 240.0, 9.81
DOWN = (0.0, 0.0, -G)
#: Shifts agree to 1e-13 of the largest acceleration, and forces are differences over (1 - d)/d: 2e-16 * 99.
ROUND_OFF = 1e-12
#: The same in statics, where d = 0.9999 and forces are read: 2e-16 * 1e4, and as much for each of a few roundings.
SUMS = 2e-11


def ball(name: str, *at: float, v: tuple[float, ...] = (0.0, 0.0, 0.0), mass: float = 1.0) -> Body:
    return Body(name, Sphere(0.5), mass, (0.1 * mass,) * 3, (*at, 1.0, 0.0, 0.0, 0.0), (*v, 0.0, 0.0, 0.0))


def slab(v: tuple[float, ...] = (0.0, 0.0, 0.0), height: float = 0.1) -> Body:
    """A flat box of 1 kg on the floor."""
    moment = (1.0 + 4.0 * height**2) / 12.0
    return Body(
        "slab", Box((0.5, 0.5, height)), 1.0, (moment, moment, 1.0 / 6.0), (0.0, 0.0, height, 1.0, 0.0, 0.0, 0.0),
        (*v, 0.0, 0.0, 0.0),
    )  # fmt: skip


def scene_of(
    *bodies: Body, e: float = 0.0, mu: float = 0.0, g: tuple[float, ...] = (0.0, 0.0, 0.0), T: float = 0.5
) -> Scene:
    return Scene("test", 1, 3, bodies, (Pair(restitution=e, friction=mu),), g, T)


def settled(trajectory: Trajectory) -> bool:
    """Whether no step was left with shifts apart."""
    return "certified" not in trajectory.certificate and trajectory.certificate["shifts_apart"] <= SETTLED


# ---- blows -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("dt", [1 / 60, 1 / 240, 1 / 960])
@pytest.mark.parametrize("e", [0.0, 0.3, 0.8, 1.0])
def test_ball_rebound_equal_to_e_at_any_speed_phase_and_step(e: float, dt: float) -> None:
    for v in (0.1, 6.0, 50.0):
        for phase in (0.05, 0.5, 0.93):
            start = ball("ball", 0.0, 0.0, 0.5 + (3.0 - phase) * v * dt, v=(0.0, 0.0, -v))
            found = drive(scene_of(FLOOR, start, e=e, T=6 * dt), dt=dt)
            assert abs(found.twist[-1, 1, 2] / v - e) <= ROUND_OFF and settled(found)


@pytest.mark.parametrize("mu", [0.0, 0.1, 0.3, 1.0])
@pytest.mark.parametrize("along", [0.0, 1.0, 20.0])
def test_oblique_blow_by_newton_and_coulomb(mu: float, along: float) -> None:
    """v_n+ = e v_n; v_t - v_t+ = min(mu (1 + e) v_n, 2/7 v_t) of a solid ball."""
    e, v = 0.5, 2.0
    start = ball("ball", 0.0, 0.0, 0.5 + 2.5 * v * DT, v=(along, 0.0, -v))
    found = drive(scene_of(FLOOR, start, e=e, mu=mu, T=6 * DT))
    # The contact stands half-way into the overlap, v dt at most: the arm of what sticks is shorter by that share.
    arm = 0.5 * v * DT / 0.5
    slips = mu * (1.0 + e) * v <= (2.0 / 7.0) * along * (1.0 - arm)
    lost = mu * (1.0 + e) * v if slips else 2.0 / 7.0 * along
    assert abs(found.twist[-1, 1, 2] - e * v) <= ROUND_OFF * (v + along)
    assert abs(along - found.twist[-1, 1, 0] - lost) <= (ROUND_OFF if slips else arm) * (v + along)
    assert settled(found)


def test_where_stock_settings_throw_the_ball_up() -> None:
    """The sheet's figures: 1.00 by Newton's law, 4.85 as tuned, 7.13 with friction damped as the normal."""
    v, along, dt = 2.0, 20.0, 1e-3
    start = ball("ball", 0.0, 0.0, 0.5 + 2.3 * v * dt, v=(along, 0.0, -v))
    scene = scene_of(FLOOR, start, e=0.5, mu=0.3, T=6 * dt)
    matched, tuned = drive(scene, dt=dt), drive(scene, "tuned", dt)
    reversing = drive(scene, "tuned", dt, solreffriction=None)
    assert abs(matched.twist[-1, 1, 2] - 1.0) <= ROUND_OFF * (v + along)
    assert tuned.twist[-1, 1, 2] == pytest.approx(4.85, abs=0.01)
    assert reversing.twist[-1, 1, 2] == pytest.approx(7.13, abs=0.01)


@pytest.mark.parametrize("ratio", [1e-3, 1.0, 1e3])
def test_two_balls_keep_momentum_and_e(ratio: float) -> None:
    scene = scene_of(ball("a", 0.0, 0.0, 0.0, v=(2.0, 0.0, 0.0)), ball("b", 1.02, 0.0, 0.0, v=(-1.0, 0.0, 0.0),
                     mass=ratio), e=0.5, T=0.1)  # fmt: skip
    v = drive(scene).twist[-1, :, 0]
    assert abs((v[1] - v[0]) / 3.0 - 0.5) <= ROUND_OFF * max(ratio, 1.0 / ratio)
    assert abs(v[0] + ratio * v[1] - (2.0 - ratio)) <= ROUND_OFF * (2.0 + ratio)


def test_restitution_of_each_pair_in_either_order() -> None:
    """A sphere's geom stands before a box's in a contact, whatever their bodies' order."""
    box = Body("box", Box((0.5, 0.5, 0.5)), 1.0, (1 / 6,) * 3, (0.0, 0.0, 5.0, 1.0, 0.0, 0.0, 0.0), motion="fixed")
    up = ball("up", 0.0, 0.0, 3.98, v=(0.0, 0.0, 2.0))
    down = ball("down", 0.0, 0.0, 0.52, v=(0.0, 0.0, -2.0))
    pairs = (Pair(a="box", b="up", restitution=0.25), Pair(a="down", b="floor", restitution=0.75))
    scene = replace(scene_of(box, FLOOR, up, down, T=6 * DT), pairs=pairs)
    v = drive(scene).twist[-1, :, 2]
    assert abs(v[2] + 0.5) <= ROUND_OFF * 2.0 and abs(v[3] - 1.5) <= ROUND_OFF * 2.0


def test_a_cradle_with_gaps_hands_the_speed_on() -> None:
    scene = scene_of(*(ball(f"{k}", 1.001 * k, 0.0, 0.0, v=(float(k == 0), 0.0, 0.0)) for k in range(5)), e=1.0, T=0.2)
    v = drive(scene).twist[-1, :, 0]
    assert np.abs(v - [0.0, 0.0, 0.0, 0.0, 1.0]).max() <= ROUND_OFF


def test_a_touching_cradle_keeps_momentum_and_energy() -> None:
    """Its answer is that of blows one after another or at once; both keep what e = 1 keeps."""
    scene = scene_of(*(ball(f"{k}", 1.0 * k, 0.0, 0.0, v=(float(k == 0), 0.0, 0.0)) for k in range(5)), e=1.0, T=0.2)
    v = drive(scene).twist[-1, :, 0]
    assert abs(v.sum() - 1.0) <= ROUND_OFF and abs(v @ v - 1.0) <= ROUND_OFF


def test_energy_loss_and_momentum_of_blows_with_friction() -> None:
    start = replace(ball("ball", 0.0, 0.0, 0.52), twist=(3.0, -1.0, -2.0, 4.0, -5.0, 6.0))
    found = drive(scene_of(FLOOR, start, e=0.7, mu=0.2, T=6 * DT))
    energy = 0.5 * (found.twist[:, 1, :3] ** 2).sum(axis=1) + 0.05 * (found.twist[:, 1, 3:] ** 2).sum(axis=1)
    assert (np.diff(energy) <= ROUND_OFF * energy[0]).all() and energy[-1] < 0.9 * energy[0]
    assert found.contacts is not None
    change = found.twist[-1, 1, :3] - found.twist[0, 1, :3]
    assert np.abs(found.contacts.impulse_between(0, 1).sum(axis=0) - change).max() <= ROUND_OFF * 10.0


# ---- friction ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("heading", [0.0, 15.0, 30.0, 45.0, 67.5, 90.0])
@pytest.mark.parametrize("mu", [0.1, 0.5, 0.9])
def test_box_stopping_distance_by_coulomb_in_any_heading(mu: float, heading: float) -> None:
    """Each step takes mu g dt of the speed until less is left, all of it then; positions follow the new speed."""
    way = np.array([math.cos(math.radians(heading)), math.sin(math.radians(heading)), 0.0])
    found = drive(scene_of(FLOOR, slab(tuple(way)), mu=mu, g=DOWN, T=1.3 / (mu * G)))
    speeds = np.maximum(0.0, 1.0 - mu * G * DT * np.arange(1, len(found.t)))
    path = found.pose[:, 1, :3] - found.pose[0, 1, :3]
    assert np.abs(path[1:, :2] - np.cumsum(speeds)[:, None] * DT * way[:2]).max() <= SUMS
    assert np.abs(path[:, 2]).max() <= SUMS  # neither hops nor sinks
    assert np.abs(found.twist[:, 1, 3:]).max() <= SUMS  # nor turns
    assert settled(found)


@pytest.mark.parametrize("mu", [0.2, 0.5, 1.0])
def test_friction_limit_within_a_thousandth(mu: float) -> None:
    for ratio in (0.999, 1.001):
        lean = math.atan(ratio * mu)
        scene = scene_of(FLOOR, slab(), mu=mu, g=(G * math.sin(lean), 0.0, -G * math.cos(lean)), T=1.0)
        found = drive(scene)
        pull = max(0.0, G * (math.sin(lean) - mu * math.cos(lean)))
        assert abs(found.twist[-1, 1, 0] - pull * found.t[-1]) <= SUMS
        assert np.abs(found.pose[:, 1, 2] - 0.1).max() <= SUMS and settled(found)


# ---- rest --------------------------------------------------------------------------------------------------------


def test_a_column_carries_its_weight_without_sinking() -> None:
    boxes = [replace(slab(height=0.5), name=f"{k}", pose=(0.0, 0.0, 0.5 + k, 1.0, 0.0, 0.0, 0.0)) for k in range(10)]
    found = drive(scene_of(FLOOR, *boxes, mu=0.5, g=DOWN, T=0.5))
    assert np.abs(found.pose[-1, 1:, 2] - found.pose[0, 1:, 2]).max() <= 10.0 * SUMS
    assert np.abs(found.twist[-1]).max() <= SUMS
    assert found.contacts is not None
    for k in range(10):
        carried = found.contacts.impulse_between(k, k + 1).sum(axis=0)[2] / found.t[-1]
        assert abs(carried - (10 - k) * G) <= 10.0 * SUMS * G


def test_overlap_removed_without_a_hop() -> None:
    deep = replace(slab(), pose=(0.0, 0.0, 0.05, 1.0, 0.0, 0.0, 0.0))
    found = drive(scene_of(FLOOR, deep, mu=0.5, g=DOWN, T=4.0))
    assert found.twist[:, 1, 2].max() <= G * DT + SUMS
    assert abs(found.pose[-1, 1, 2] - 0.1) <= SUMS and found.pose[:, 1, 2].max() <= 0.1 + SUMS


# ---- how it converges --------------------------------------------------------------------------------------------


def made(mu: float, rounds: int) -> float:
    """How far shifts are apart after so many rounds of the first step of a slide."""
    import mujoco

    scene = scene_of(FLOOR, slab((1.0, 0.0, 0.0)), mu=mu, g=DOWN)
    chosen = settings(scene, rounds=rounds)
    simulation = ENGINE.build(scene, DT, chosen)
    model, data = simulation._model, simulation._data  # type: ignore[attr-defined]
    mujoco.mj_step1(model, data)
    return float(matched_step2(mujoco, model, data, by_geoms(model, rebounding(scene)), law_of(chosen))[1])


@pytest.mark.parametrize("mu", [0.2, 0.5, 1.0, 2.0])
def test_residual_after_a_round_by_its_contraction(mu: float) -> None:
    """mu^2/(1 + mu^2) of a box that does not turn, but for softness: 1e-4 of an inverse mass, across and along."""
    assert abs(made(mu, 2) / made(mu, 1) - mu**2 / (1.0 + mu**2)) <= 2e-4


def test_fewer_rounds_with_the_secant_method() -> None:
    scene = scene_of(FLOOR, slab((1.0, 0.0, 0.0)), mu=1.0, g=DOWN, T=0.05)
    contraction = math.log(AGREED) / math.log(0.5)  # 43 rounds
    assert drive(scene).certificate["rounds"] <= 10 < contraction


def test_run_with_unsettled_shifts_not_certified() -> None:
    scene = scene_of(FLOOR, slab((1.0, 0.0, 0.0)), mu=0.5, g=DOWN, T=0.05)
    cut = drive(scene, rounds=1)
    assert cut.certificate["certified"] is False and "do not converge" in cut.certificate["reasons"][0]
    assert settled(drive(scene))


@pytest.mark.parametrize("ratio", [1e-6, 1e-5, 1e5])
def test_shared_motion_differs_only_by_round_off(ratio: float) -> None:
    """Two balls of which one weighs next to nothing: after a blow with e = 0 the contact lasts and carries nothing.

    All that shifts are made of is one rounding of 4 m/s over a step, and they cannot agree to a share of that.
    """
    assert settled(drive(resolve("head_on").scene(2, {"ratio": ratio, "e": 0.0})))


# ---- what it is --------------------------------------------------------------------------------------------------


def test_matched_profile_without_rank_and_in_flight_like_tuned() -> None:
    assert ENGINE.facts.roles["matched"] == "matched"
    assert not is_ranked("mujoco", "matched")
    assert is_ranked("mujoco", "tuned") and is_ranked("mujoco", "default") and is_ranked("nobody", "matched")
    free = scene_of(ball("ball", 0.0, 0.0, 1.0), g=DOWN)
    assert settings(free) == settings(free, "tuned") and settings(free)["integrator"] == "RK4"
    touching = scene_of(FLOOR, slab(), mu=0.5, g=DOWN)
    assert all(s.because and s.source for s in ENGINE.settings("matched", needs(touching), DT))


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"rounds": 0}, "rounds: 0"),
        ({"agreed": -1.0}, "agreed: -1"),
        ({"push_out": -0.1}, "push_out: -0.1"),
        ({"kappa_plastic": 0.1}, "kappa_plastic"),
    ],
)
def test_wrong_settings_of_the_loop_refused(changes: dict[str, Any], said: str) -> None:
    scene = scene_of(FLOOR, slab(), mu=0.5, g=DOWN)
    with pytest.raises(EngineError, match=said):
        ENGINE.build(scene, DT, settings(scene, **changes))
    lacking = settings(scene)
    del lacking["push_out"]
    with pytest.raises(EngineError, match="push_out: this setting is missing"):
        ENGINE.build(scene, DT, lacking)


def test_bits_of_many_steps_at_once() -> None:
    """The bench times `advance` of many steps; what is judged is stepped as it is sampled."""
    scene = scene_of(FLOOR, replace(ball("ball", 0.0, 0.0, 0.6), twist=(1.0, 0.5, -1.0, 2.0, 0.0, 0.0)), e=0.5, mu=0.4,
                     g=DOWN)  # fmt: skip
    chosen = settings(scene)
    at_once, singly = ENGINE.build(scene, DT, chosen), ENGINE.build(scene, DT, chosen)
    at_once.advance(60)
    for _ in range(60):
        singly.advance(1)
    assert np.array_equal(at_once.pose(), singly.pose()) and np.array_equal(at_once.twist(), singly.twist())


def test_lifted_planar_scenes_in_their_plane() -> None:
    flat = Body("floor", HalfSpace((0.0, 1.0)), motion="fixed")
    disc = Body("disc", Disc(0.5), 1.0, 0.125, (0.0, 0.6, 0.0), (3.0, -1.0, 2.0))
    scene = Scene("test", 1, 2, (flat, disc), (Pair(restitution=0.5, friction=0.3),), (0.0, -G), 0.5)
    found = drive(scene)
    assert found.out_of_plane <= SUMS and settled(found)
    assert lift(scene).dimension == 3


def test_running_surface_carries_a_box_to_its_speed() -> None:
    belt = replace(FLOOR, surface_velocity=(1.0, 0.0, 0.0))
    found = drive(scene_of(belt, slab(), mu=0.3, g=DOWN, T=0.5))
    speeds = np.minimum(1.0, 0.3 * G * found.t)
    assert np.abs(found.twist[:, 1, 0] - speeds).max() <= SUMS and np.abs(found.pose[:, 1, 2] - 0.1).max() <= SUMS


def test_steps_with_unsettled_rounds_counted(monkeypatch):
    """Where they run out they may miss what they end at; where they end before, a thousandth."""
    from adapters.mujoco import matched

    scene = scene_of(FLOOR, ball("ball", 0.0, 0.0, 0.5))
    answers = iter([(2, 0.0), (9, 1e-6), (5, 0.9 * SETTLED), (7, 1.1 * SETTLED), (5, math.nan)])
    monkeypatch.setattr(matched, "matched_step2", lambda *asked: next(answers))
    monkeypatch.setattr(matched, "by_geoms", lambda model, rows: {})
    own = settings(scene)
    made = matched.Matched(None, scene, own | {"rounds": 9, "agreed": 1e-5}, None, None)
    for unsolved, most, apart in ((0, 2, 0.0), (0, 9, 1e-6), (0, 9, 0.9 * SETTLED), (1, 9, 1.1 * SETTLED)):
        made.step2()
        assert (made.unsolved, made.most, made.apart) == (unsolved, most, apart)
    assert made.told()["reasons"] == ["in 1 step the shifts of references do not converge: 0.0011 apart"]
    made.step2()
    told = made.told()
    assert told["certified"] is False and told["rounds"] == 9 and told["shifts_apart"] == made.apart
    assert told["reasons"][0].startswith("in 2 steps the shifts of references do not converge: ")
    fine = matched.Matched(None, scene, own | {"rounds": 9, "agreed": 1e-7}, None, None)
    assert fine.told() == {"rounds": 0, "shifts_apart": 0.0}
    monkeypatch.setattr(matched, "matched_step2", lambda *asked: (9, 1e-6))
    fine.step2()
    assert fine.unsolved == 1  # all rounds are made, and more is missed than they end at
