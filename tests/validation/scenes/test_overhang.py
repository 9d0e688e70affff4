"""Blocks as far out as they stand: balances of moments anew, loads at rest, and what sinks, slips or falls fails."""

from dataclasses import replace

import numpy as np
import pytest
from planted import failing, loaded, made

from validation.scenes.overhang import HEIGHT, LENGTH

DT = 1 / 240


def at_rest(scene, duration=2.0):
    """A record in which nothing moves and each face carries the weight of all above it."""
    blocks = len(scene.bodies) - 1
    weights = {(k, k + 1): (0.0, scene.params["g"] * (blocks - k) * DT) for k in range(blocks)}
    return loaded(scene, weights, DT, duration)


@pytest.mark.parametrize("n", [2, 4, 8])
@pytest.mark.parametrize("margin", [0.3, 0.05, 1e-6, -1e-6, -0.05])
def test_moments_about_each_edge_say_whether_it_stands(n, margin):
    """The centre of all above an interface, against the face that both blocks share there."""
    canonical, scene = made("overhang", n=float(n), margin=margin)
    x = np.array([body.pose[0] for body in scene.bodies[1:]])
    stands = all(
        x[k - 1] - LENGTH / 2 < x[k:].mean() < x[k - 1] + LENGTH / 2 and x[k] - LENGTH / 2 < x[k:].mean()
        for k in range(1, n)
    )
    assert canonical.exact(scene)["stands"] == float(stands) == float(margin > 0.0)


def test_reach_without_a_margin():
    """Four blocks reach L/2 (1 + 1/2 + 1/3) beyond the one that stands on the floor: 11/12 of a block."""
    _, scene = made("overhang", margin=0.0)
    assert scene.bodies[-1].pose[0] - scene.bodies[1].pose[0] == pytest.approx(LENGTH * 11 / 12)


@pytest.mark.parametrize("size", [0.1, 0.01, 0.001])
def test_overhang_that_sinks_slips_shakes_or_carries_too_little(size):
    canonical, scene = made("overhang")
    good = at_rest(scene)
    assert failing(canonical, scene, good) == set()
    for axis, metric in ((1, "penetration"), (0, "drift")):
        moved = good.pose.copy()
        moved[1:, 4, axis] += -size if axis else size
        assert failing(canonical, scene, replace(good, pose=moved)) == {metric}
    light = replace(good.contacts.rows, impulse=(1.0 - size) * good.contacts.rows.impulse)
    light = replace(good, contacts=replace(good.contacts, rows=light))
    assert failing(canonical, scene, light) == {f"interface_impulse[{k}]" for k in range(1, 5)}
    moving = good.twist.copy()
    moving[:, 2, 2] = 4.0 * size
    assert failing(canonical, scene, replace(good, twist=moving)) == {"settle_time", "kinetic_energy"}


def test_stack_on_both_sides_of_the_limit():
    for margin, fails in ((0.05, True), (-0.05, False)):
        canonical, scene = made("overhang", margin=margin)
        fallen = at_rest(scene)
        fallen.pose[-1, -1, :2] += [LENGTH, -2.0 * HEIGHT]
        assert ("stands" in failing(canonical, scene, fallen)) is fails
    assert failing(canonical, scene, at_rest(scene)) == {"stands"}


def test_leaning_block_counts_as_fallen():
    """Its end stands on the floor: it has turned by .53 rad and sunk by .17 blocks, less than half of one."""
    canonical, scene = made("overhang", n=2.0, margin=-0.05)
    leaning = at_rest(scene)
    leaning.pose[-1, -1] += [0.0, -0.17 * HEIGHT, -0.53]
    assert failing(canonical, scene, leaning) == set()
    straight = at_rest(scene)
    straight.pose[-1, -1, 1] -= 0.17 * HEIGHT
    assert failing(canonical, scene, straight) == {"stands"}
