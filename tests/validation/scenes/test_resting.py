"""Walls and pressed boxes: balances solved anew as linear programs, records at rest pass, planted faults fail."""

from dataclasses import replace
from itertools import chain

import numpy as np
import pytest
from planted import carried, failing, loaded, made, still
from scipy.optimize import linprog

from adapters.trajectory import Trajectory
from validation.scenes import pyramid

DT, G = 1 / 240, 9.81
SIZES = (0.1, 0.01, 0.001)


def scaled(trajectory, share, axis=slice(None)):
    """The same record with impulses (along one axis) a share of what they were."""
    impulse = trajectory.contacts.rows.impulse.copy()
    impulse[:, axis] *= share
    return with_impulses(trajectory, impulse)


def with_impulses(trajectory, impulse):
    rows = replace(trajectory.contacts.rows, impulse=impulse)
    return replace(trajectory, contacts=replace(trajectory.contacts, rows=rows))


# ---- a wall ----


def contacts_of(scene):
    """Ends of the faces that boxes of neighbouring rows share: (lower body, upper body, place)."""
    half = np.array(scene.bodies[1].shape.half_extents)
    for j, upper in enumerate(scene.bodies[1:], 1):
        x, y = upper.pose[:2]
        if y < 2.0 * half[1]:
            yield from ((0, j, np.array([x + side * half[0], 0.0])) for side in (-1.0, 1.0))
            continue
        for i, lower in enumerate(scene.bodies[1:], 1):
            low, high = max(x, lower.pose[0]) - half[0], min(x, lower.pose[0]) + half[0]
            if abs(y - lower.pose[1] - 2.0 * half[1]) < 1e-9 and high > low:
                yield from ((i, j, np.array([place, y - half[1]])) for place in (low, high))


@pytest.mark.parametrize("n", [1, 2, 4, 6])
def test_wall_rows_carry_the_weight_above(n):
    """Forces in all cones that hold every box: least and largest load of each row, by linear programs."""
    _, scene = made("pyramid", rows=n)
    found = list(contacts_of(scene))
    rows, weight = pyramid.layers(n), scene.params["mass"] * G
    # Unknown: normal force, and the two sides of friction, of each end; a balance of x, y and moment of each box.
    balance = np.zeros((3 * (len(scene.bodies) - 1), 3 * len(found)))
    for k, (i, j, place) in enumerate(found):
        for column, force in ((0, (0.0, 1.0)), (1, (1.0, 0.0)), (2, (-1.0, 0.0))):
            for body, sign in ((j, 1.0), (i, -1.0)):
                if body:
                    arm = place - np.array(scene.bodies[body].pose[:2])
                    row = (*force, arm[0] * force[1] - arm[1] * force[0])
                    balance[3 * body - 3 : 3 * body, 3 * k + column] += sign * np.array(row)
    load = np.tile([0.0, weight, 0.0], len(scene.bodies) - 1)
    cone = np.kron(np.eye(len(found)), [[-scene.params["mu"], 1.0, 1.0]])
    for k, below in enumerate(rows[:-1]):
        share = np.repeat([1.0 if i in below and j in rows[k + 1] else 0.0 for i, j, _ in found], 3)
        share[1::3] = share[2::3] = 0.0
        above = weight * sum(map(len, rows[k + 1 :]))
        for sense in (1.0, -1.0):
            best = linprog(sense * share, cone, np.zeros(len(found)), balance, load, (0, None), method="highs")
            assert best.success and sense * best.fun == pytest.approx(above, rel=1e-9)


@pytest.mark.parametrize("dimension", [2, 3])
def test_wall_that_sinks_leans_shakes_or_carries_too_little(dimension):
    canonical, scene = made("pyramid", dimension, rows=2)
    up = np.eye(dimension)[-1] * G * DT
    good = loaded(scene, {(0, 1): 1.4 * up, (0, 2): 1.6 * up, (1, 3): 0.4 * up, (2, 3): 0.6 * up}, DT, 2.0)
    assert failing(canonical, scene, good) == set()
    loads = {"interface_impulse[1]", "interface_impulse[2]"}
    for size in SIZES:
        assert failing(canonical, scene, scaled(good, 1.0 - size)) == loads
        sunk = good.pose.copy()
        sunk[1:, 3, dimension - 1] -= size
        assert failing(canonical, scene, replace(good, pose=sunk)) == {"penetration"}
        aside = good.pose.copy()
        aside[1:, 2, 0] += size
        assert failing(canonical, scene, replace(good, pose=aside)) == {"drift"}
        moving = good.twist.copy()
        moving[:, 2, 0] = size
        assert failing(canonical, scene, replace(good, twist=moving)) == {"settle_time", "kinetic_energy"}
        shaking = good.contacts.rows.impulse.copy()
        shaking[2::8] *= 1.0 + 100.0 * size
        shaking[6::8] *= 1.0 - 100.0 * size
        assert failing(canonical, scene, with_impulses(good, shaking)) - loads == {"impulse_scatter"}


def test_gaps_and_supports_of_a_row_of_boxes():
    _, scene = made("pyramid", rows=5)
    rows = pyramid.layers(5)
    assert [len(row) for row in rows] == [1, 5, 4, 3, 2, 1] and list(chain(*rows)) == list(range(len(scene.bodies)))
    for row in rows[1:]:
        x = [scene.bodies[k].pose[0] for k in row]
        assert np.allclose(np.diff(x), pyramid.SIDE + pyramid.GAP)
    supports = {}
    for i, j, _ in contacts_of(scene):
        supports.setdefault(j, set()).add(i)
    assert {j: len(below) for j, below in supports.items()} == {j: 1 if j in rows[1] else 2 for j in supports}


# ---- a box that is pressed and pushed ----


def pushed(scene, dt=DT, order=0.0, mu=None):
    """Coulomb's law of a block, integrated in a hundred parts of a step, and the impulses that it takes."""
    p, d = scene.params, scene.dimension
    mu = p["mu"] if mu is None else mu
    weight, fine = p["mass"] * p["g"], 100
    normal, x, v = weight * (1.0 + p["load"]), 0.0, 0.0
    n = round(scene.duration / dt) + 1
    track, impulse = np.zeros((n, 2)), np.zeros((n, d))
    for k in range(1, n):
        for _ in range(fine):
            push = p["shear"] * weight
            grip = mu * normal if v > 0.0 or push > mu * normal else push
            v += (push - grip) / p["mass"] * dt / fine
            x += v * dt / fine
            impulse[k, 0] -= grip * dt / fine
        impulse[k, -1] = normal * dt
        track[k] = x, v
    pose, twist = still(scene, n)
    pose[:, 1, 0] = track[:, 0] + order * dt * track[:, 1]
    twist[:, 1, 0] = track[:, 1]
    return Trajectory(np.arange(n) * dt, pose, twist, carried([(0, 1)], impulse[:, None]), dt, "completed")


CASES = ({}, {"load": 0.0}, {"load": 9.0, "shear": 4.9}, {"load": 3.0, "shear": 2.5})


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("order", [-0.5, 0.0, 0.5])
@pytest.mark.parametrize("params", CASES)
def test_acceleration_of_a_slide_by_coulomb_s_law(params, order, dimension):
    canonical, scene = made("pressed_box", dimension, **params)
    trajectory = pushed(scene, order=order)
    assert failing(canonical, scene, trajectory) == set()
    slides = params.get("shear", 0.8) > 0.5 * (1.0 + params.get("load", 1.0))
    assert ("acceleration" in canonical.exact(scene)) is slides


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("params", CASES)
def test_weak_floor_creeping_box_and_wrong_slide_fail(params, size):
    canonical, scene = made("pressed_box", **params)
    good = pushed(scene)
    assert failing(canonical, scene, scaled(good, 1.0 - size, -1)) == {"carried"}
    assert failing(canonical, scene, scaled(good, 1.0 - size, 0)) == {"sheared"}
    if "creep" in canonical.exact(scene):
        creeping = good.pose.copy()
        creeping[:, 1, 0] += size * good.t
        assert failing(canonical, scene, replace(good, pose=creeping)) == {"creep"}
    else:
        assert {"acceleration", "sheared"} == failing(canonical, scene, pushed(scene, mu=0.5 * (1.0 - size)))


def test_refusal_of_a_push_that_tips_the_box():
    with pytest.raises(ValueError, match=r"pressed_box\.shear"):
        made("pressed_box", mu=2.0, shear=1.9)
