"""Scenes of bodies that stand, are held or slide to a stop: forces balanced anew, motion integrated, faults planted."""

import math
from dataclasses import replace

import numpy as np
import pytest
from planted import failing, loaded, made, still

from adapters.engine import Contacts
from adapters.trajectory import ContactRecord, Trajectory
from validation.scenes import pinch

DT = 1 / 240
G = 9.81


def scaled(trajectory, share):
    """The same record with all impulses a share of what they were."""
    rows = replace(trajectory.contacts.rows, impulse=share * trajectory.contacts.rows.impulse)
    return replace(trajectory, contacts=replace(trajectory.contacts, rows=rows))


# ---- a ball in a groove ----


def groove(left, right):
    """Scene and its record at rest, from a triangle of forces that is solved anew."""
    canonical, scene = made("v_groove", left=left, right=right)
    normals = np.array([body.shape.normal for body in scene.bodies[:2]]).T
    loads = np.linalg.solve(normals, [0.0, scene.params["mass"] * G])
    return canonical, scene, loaded(scene, {(k, 2): loads[k] * DT * normals[:, k] for k in (0, 1)}, DT, 3.0), loads


@pytest.mark.parametrize(("left", "right"), [(45.0, 45.0), (60.0, 20.0), (10.0, 80.0), (85.0, 85.0)])
def test_triangle_of_forces_on_a_ball_in_a_groove(left, right):
    canonical, scene, trajectory, loads = groove(left, right)
    for body in scene.bodies[:2]:
        assert np.dot(body.shape.normal, scene.bodies[2].pose[:2]) == pytest.approx(0.5, abs=1e-12)
    assert (loads > 0.0).all() and failing(canonical, scene, trajectory) == set()
    if left == right:
        assert loads == pytest.approx([G / (2.0 * math.cos(math.radians(left)))] * 2)


@pytest.mark.parametrize("size", [0.1, 0.01, 0.001])
def test_weak_plane_or_moving_ball_fails(size):
    canonical, scene, trajectory, _ = groove(60.0, 20.0)
    assert failing(canonical, scene, scaled(trajectory, 1.0 - size)) == {"load[left]", "load[right]"}
    sunk = trajectory.pose.copy()
    sunk[1:, 2, 1] -= size
    assert failing(canonical, scene, replace(trajectory, pose=sunk)) == {"displacement"}
    moving = trajectory.twist.copy()
    moving[:, 2, 0] = size
    assert failing(canonical, scene, replace(trajectory, twist=moving)) == {"settle_time", "kinetic_energy"}


# ---- a heavy box on a light one ----


@pytest.mark.parametrize("ratio", [1.0, 100.0, 1e6])
def test_pair_that_carries_its_load_or_not(ratio):
    canonical, scene = made("heavy_on_light", ratio=ratio)
    heavy, both = ratio * G, (1.0 + ratio) * G
    good = loaded(scene, {(0, 1): np.array([0.0, both * DT]), (1, 2): np.array([0.0, heavy * DT])}, DT, 3.0)
    assert failing(canonical, scene, good) == set()
    for size in (0.1, 0.01, 0.001):
        assert failing(canonical, scene, scaled(good, 1.0 - size)) == {"interface_impulse[1]", "interface_impulse[2]"}
        sunk = good.pose.copy()
        sunk[1:, 2, 1] -= size
        assert failing(canonical, scene, replace(good, pose=sunk)) == {"penetration"}
        aside = good.pose.copy()
        aside[1:, 2, 0] += size
        assert failing(canonical, scene, replace(good, pose=aside)) == {"drift"}
    light = loaded(scene, {(0, 1): np.array([0.0, both * DT]), (1, 2): np.array([0.0, 0.99 * heavy * DT])}, DT, 3.0)
    assert failing(canonical, scene, light) == {"interface_impulse[2]"}


# ---- a grip ----


@pytest.mark.parametrize("margin", [1.05, 2.0, 100.0])
@pytest.mark.parametrize("share", [0.3, 0.5])
def test_balance_of_a_grip_at_any_share(margin, share):
    canonical, scene = made("pinch", margin=margin)
    p, force = scene.params, pinch.grip(scene.params)
    weight = p["mass"] * G
    # The pad's balance: pressed by its force, pushed back by the box; the floor carries it and its share.
    wall = np.array([force, share * weight]) * DT
    pad = np.array([force, -(1.0 - share) * weight]) * DT
    floor = np.array([0.0, p["pad"] * G + (1.0 - share) * weight]) * DT
    box = wall - pad + np.array([0.0, -weight]) * DT
    assert box == pytest.approx([0.0, 0.0], abs=1e-12)
    assert pad + floor + DT * (np.array(scene.bodies[3].force) + [0.0, -p["pad"] * G]) == pytest.approx(
        [0, 0], abs=1e-12
    )
    good = loaded(scene, {(0, 3): floor, (1, 2): wall, (2, 3): pad}, DT, 3.0)
    assert failing(canonical, scene, good) == set()
    for size in (0.1, 0.01, 0.001):
        steps = {f"{load}[{by}]" for load in ("grip", "carried") for by in ("least", "greatest")}
        weak = failing(canonical, scene, scaled(good, 1.0 - size))
        assert weak - steps == {"grip", "carried"} and (weak >= steps) is (size == 0.1)
        sinking = good.pose.copy()
        sinking[:, 2, 1] -= size * good.t
        assert failing(canonical, scene, replace(good, pose=sinking)) == {"creep"}
        turning = good.twist.copy()
        turning[-1, 2, 2] = 10.0 * size
        assert failing(canonical, scene, replace(good, twist=turning)) == {"turned"}


def test_grip_that_flickers_or_differs_between_sides():
    """By a tenth of the weight, which is 2.5 % of this grip: what a step may be off by is 2 % of the weight."""
    canonical, scene = made("pinch", margin=2.0)
    p, force = scene.params, pinch.grip(scene.params)
    weight = p["mass"] * G
    held = np.array([force, 0.5 * weight]) * DT
    good = loaded(scene, {(1, 2): held, (2, 3): held * [1.0, -1.0]}, DT, 3.0)
    assert failing(canonical, scene, good) == set()

    def pushed(pair, axis, share):
        """The record with one side's impulses more and less by turns, by a share of the weight."""
        rows = good.contacts.rows
        sample = np.repeat(np.arange(len(good.contacts.step)), 2)
        impulse = rows.impulse.copy()
        is_pair = (rows.a == pair[0]) & (rows.b == pair[1])
        impulse[:, axis] += np.where(is_pair, share * weight * DT * (-1.0) ** sample, 0.0)
        return replace(good, contacts=replace(good.contacts, rows=replace(rows, impulse=impulse)))

    grip, carried = ({f"{load}[least]", f"{load}[greatest]"} for load in ("grip", "carried"))
    assert failing(canonical, scene, pushed((1, 2), 0, 0.15)) == grip | {"unbalanced"}
    assert failing(canonical, scene, pushed((2, 3), 0, 0.03)) == {"unbalanced"}
    assert failing(canonical, scene, pushed((2, 3), 1, 0.03)) == carried
    assert failing(canonical, scene, pushed((2, 3), 1, 0.01)) == set()


def test_grip_strength_by_its_margin():
    """Friction of both faces at the limit, over the weight."""
    for margin in (1.0, 1.05, 7.0):
        _, scene = made("pinch", margin=margin, mu=0.3)
        force = -scene.bodies[3].force[0]
        assert 2.0 * 0.3 * force / (scene.params["mass"] * G) == pytest.approx(margin)


# ---- a box that slides to a stop ----


def sliding(scene, dt, mu=None, offset=0.0):
    """Independent integration: dv/dt = -mu g along the motion, in many small steps, and at rest once it has stopped.

    ``offset`` in steps shifts what is sampled, as step orders do.
    """
    p = scene.params
    mu = p["mu"] if mu is None else mu
    x, v, path, fine = 0.0, p["v"], [], 200
    h = dt / fine
    for k in range(round(scene.duration / dt) * fine + fine):
        if k % fine == 0:
            path.append((x, v))
        before, v = v, max(0.0, v - mu * p["g"] * h)
        x += 0.5 * (before + v) * h
    path = np.array(path)
    n = len(path)
    pose, twist = still(scene, n)
    heading = np.array([1.0]) if scene.dimension == 2 else np.array(
        [math.cos(math.radians(p["heading"])), math.sin(math.radians(p["heading"]))]
    )  # fmt: skip
    flat = scene.dimension - 1
    place = path[:, 0] + offset * dt * (path[:, 1] - p["v"])
    pose[:, 1, :flat], twist[:, 1, :flat] = np.outer(place, heading), np.outer(path[:, 1], heading)
    # What changed the velocity, and carried the weight, at two points of the box.
    impulse = 0.5 * p["mass"] * np.column_stack([np.diff(twist[:, 1, :flat], axis=0), np.full(n - 1, p["g"] * dt)])
    return Trajectory(np.arange(n) * dt, pose, twist, told(np.repeat(impulse, 2, axis=0), 2), dt, "completed")


def told(impulse, each):
    """Contacts of the first two bodies, ``each`` at every step from the first on, with these impulses."""
    zero, n = np.zeros_like(impulse), len(impulse)
    rows = Contacts(np.zeros(n, int), np.ones(n, int), zero, zero, impulse, np.zeros(n))
    return ContactRecord(np.arange(1, n // each + 1), each * np.arange(n // each + 1), rows)


@pytest.mark.parametrize("offset", [-0.5, 0.0, 0.5])
@pytest.mark.parametrize("dt", [1 / 60, DT, 1 / 960])
@pytest.mark.parametrize(("dimension", "heading"), [(2, 0.0), (3, 0.0), (3, 30.0)])
def test_standing_box_stopping_distance_by_coulomb_in_every_order(dimension, heading, dt, offset):
    canonical, scene = made("slide", dimension, heading=heading)
    trajectory = sliding(scene, dt, offset=offset)
    assert failing(canonical, scene, trajectory) == set()
    if not offset:
        way = canonical.measure(scene, trajectory)["stopping_distance"][0]
        assert way == pytest.approx(canonical.exact(scene)["stopping_distance"], abs=1e-6)


@pytest.mark.parametrize("size", [0.1, 0.01, 0.001])
def test_slide_with_wrong_friction_hop_turn_or_bend(size):
    canonical, scene = made("slide", 3)
    wrong = failing(canonical, scene, sliding(scene, DT, mu=0.4 * (1.0 - size)))
    assert "braking" in wrong
    assert size < 0.02 or "stopping_distance" in wrong
    good = sliding(scene, DT)
    raised = good.pose.copy()
    raised[10, 1, 2] += size
    assert failing(canonical, scene, replace(good, pose=raised)) == {"hop"}
    turned = good.pose.copy()
    turned[10:, 1, 3:] = [math.cos(0.5 * size), 0.0, 0.0, math.sin(0.5 * size)]
    assert failing(canonical, scene, replace(good, pose=turned)) == {"turned"}
    bent = good.pose.copy()
    bent[-1, 1, 1] += size
    assert failing(canonical, scene, replace(good, pose=bent)) == {"astray"}
    late = good.twist.copy()
    late[-1, 1, 1] = size
    assert failing(canonical, scene, replace(good, twist=late)) == {"end_speed"}


def test_slide_with_flickering_or_partial_forces():
    """The mean is right, and the motion: who looks at either alone sees nothing."""
    canonical, scene = made("slide")
    good = sliding(scene, DT)
    impulse = good.contacts.rows.impulse
    by_turns = np.repeat((-1.0) ** np.arange(len(impulse) // 2), 2)[:, None]
    steps = {f"{force}[{by}]" for force in ("normal", "friction") for by in ("least", "greatest")}
    for size in (0.03, 1.0):
        assert failing(canonical, scene, replace(good, contacts=told((1.0 + size * by_turns) * impulse, 2))) == steps
    every = steps | {"normal[mean]", "friction[mean]"}
    assert failing(canonical, scene, replace(good, contacts=told(impulse[::2], 1))) == every  # one of two points
    assert failing(canonical, scene, replace(good, contacts=told(-impulse, 2))) == every
    backwards = told(impulse * [-1.0, 1.0], 2)
    assert failing(canonical, scene, replace(good, contacts=backwards)) == {
        m for m in every if m.startswith("friction")
    }


def test_a_pyramid_of_friction_fails_at_45_degrees():
    """mu/sqrt(2) along a diagonal of the L1 cone."""
    canonical, scene = made("slide", 3, heading=45.0)
    assert {"braking", "stopping_distance"} <= failing(canonical, scene, sliding(scene, DT, mu=0.4 / math.sqrt(2.0)))
