"""Four pairs of materials: each pair's own numbers come out of balls that obey them, and no other table does."""

import numpy as np
import pytest
from planted import failing, made, still

from adapters.scene import SceneError
from adapters.trajectory import Trajectory
from validation.scenes.pair_matrix import GAP, RADIUS, materials
from validation.scenes.pair_matrix import _times as times

DT = 1 / 240


def bouncing(scene, table, dt=DT):
    """Balls stepped between both faces, with Newton's and Coulomb's laws of impacts that slip at each, found late."""
    d, p = scene.dimension, scene.params
    times = np.arange(round(scene.duration / dt) + 1) * dt
    pose, twist = still(scene, len(times))
    for ball in (0, 1):
        height, along, up = RADIUS + p["fall"] * p["delay"], p["v"], -p["fall"]
        for k in range(len(times)):
            pose[k, 2 + ball, d - 1], twist[k, 2 + ball, 0], twist[k, 2 + ball, d - 1] = height, along, up
            height += dt * up
            if height < RADIUS and up < 0.0:
                e, mu = table[2 * ball]
            elif height > RADIUS + GAP and up > 0.0:
                e, mu = table[2 * ball + 1]
            else:
                continue
            along, up = along - mu * (1.0 + e) * abs(up), -e * up
    return Trajectory(times, pose, twist, None, dt, "completed")


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("dt", [1 / 60, DT, 1 / 960])
@pytest.mark.parametrize("cross", [0.5, 1.0, 1.5])
def test_coefficients_of_balls_by_the_table_in_every_phase(cross, dt, dimension):
    canonical, scene = made("pair_matrix", dimension, cross=cross)
    table = materials(scene.params)
    assert table[3] == pytest.approx((0.4 * cross, 0.05 * cross))
    assert failing(canonical, scene, bouncing(scene, table, dt)) == set()


@pytest.mark.parametrize("size", [0.1, 0.01, 0.001])
@pytest.mark.parametrize("pair", [0, 1, 2, 3])
def test_deviating_pair_named(pair, size):
    canonical, scene = made("pair_matrix")
    for quantity, name in ((0, "restitution"), (1, "friction")):
        table = [list(row) for row in materials(scene.params)]
        table[pair][quantity] *= 1.0 - size
        assert failing(canonical, scene, bouncing(scene, table)) == {f"{name}[{pair + 1}]"}


@pytest.mark.parametrize("rule", [np.minimum, np.maximum, lambda a, b: 0.5 * (a + b), lambda a, b: np.sqrt(a * b)])
def test_wrong_rules_of_combining_two_numbers(rule):
    """Each face's and ball's number is its pairs' mean; no such rule gives all four pairs back."""
    canonical, scene = made("pair_matrix", cross=1.5)
    table = np.array(materials(scene.params)).reshape(2, 2, 2)
    balls, faces = table.mean(axis=1), table.mean(axis=0)
    combined = [tuple(rule(balls[i], faces[j])) for i in (0, 1) for j in (0, 1)]
    assert failing(canonical, scene, bouncing(scene, combined))


def test_ball_without_a_return_has_no_restitution():
    canonical, scene = made("pair_matrix")
    table = [(0.0, 0.2), *materials(scene.params)[1:]]
    measured = canonical.measure(scene, bouncing(scene, table))
    assert measured["restitution[1]"] == (0.0, "")
    assert measured["restitution[2]"] == measured["friction[2]"] == (None, "it does not come back")


def test_impacts_with_gripping_refused():
    with pytest.raises(SceneError, match=r"pair_matrix\.v"):
        made("pair_matrix", v=1.0)


def test_short_record_without_a_ceiling_coefficient():
    canonical, scene = made("pair_matrix")
    whole = bouncing(scene, materials(scene.params))
    (first, _), _ = times(scene.params)
    kept = int(np.searchsorted(whole.t, first + 5.0 * DT))
    short = Trajectory(whole.t[:kept], whole.pose[:kept], whole.twist[:kept], None, DT, "completed")
    measured = canonical.measure(scene, short)
    assert measured["restitution[1]"][0] == pytest.approx(0.9) and measured["friction[1]"][0] == pytest.approx(0.2)
    assert measured["restitution[2]"] == (None, "it does not come back")


def slips_at_all(v, p, spinning):
    """Whether every impact of both balls ends before its slip does; ``spinning`` is I / (m r^2), all per mass."""
    for low in (0, 2):
        along, surface, up = v, 0.0, p["fall"]  # what a spin adds to the slip at the face that is met
        for e, mu in materials(p)[low : low + 2]:
            rubbed = mu * (1.0 + e) * up
            slip = along + surface - rubbed * (1.0 + 1.0 / spinning)
            if slip <= 0.0:
                return False
            along, surface, up = along - rubbed, -(surface - rubbed / spinning), e * up
    return True


@pytest.mark.parametrize(("dimension", "spinning"), [(2, 0.5), (3, 0.4)])
def test_slowest_ball_that_slips_at_every_face(dimension, spinning):
    """A disc's and a sphere's own moments; the speed between is found by halves, down to a millionth of it."""
    canonical, scene = made("pair_matrix", dimension)

    def is_a_scene(v):
        try:
            canonical.scene(dimension, {"v": v})
        except SceneError:
            return False
        return True

    slow, fast = 0.0, scene.params["v"]
    while fast - slow > 1e-7 * fast:
        middle = 0.5 * (slow + fast)
        slow, fast = (slow, middle) if slips_at_all(middle, scene.params, spinning) else (middle, fast)
    assert is_a_scene(fast * (1.0 + 1e-6)) and not is_a_scene(slow * (1.0 - 1e-6))
