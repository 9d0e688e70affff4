"""A sliding rod that lands: its blow against the equations of a rigid body, and speeds and energies that are wrong."""

import math

import numpy as np
import pytest
from planted import failing, made, still

from adapters.scene import SceneError
from adapters.trajectory import Trajectory
from validation.catalogue import CATALOGUE
from validation.scenes.kane import answers

DT = 1 / 240
SIZES = [0.1, 0.01, 0.001]
CELLS = [{}, {"mu": 0.1, "e": 0.5}, {"along": -0.727}, {"along": 1.5, "mu": 0.1}, {"aspect": 0.4, "lean": 65.0}]


def blown(scene, e=None, mu=None, heavy=1.0):
    """Velocities after the blow: five linear equations for each way to stick or slip, from where the corners are.

    Unknown are the three velocities and both impulses; nothing is divided by a matrix of the contact.
    """
    p, rod = scene.params, scene.bodies[1]
    e, mu = p["e"] if e is None else e, p["mu"] if mu is None else mu
    c, s = math.cos(rod.pose[2]), math.sin(rod.pose[2])
    half = np.array(rod.shape.half_extents)
    corners = [np.array([[c, -s], [s, c]]) @ (half * side) for side in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    x, y = min(corners, key=lambda corner: corner[1])
    before, inertia = np.array(rod.twist), heavy * rod.inertia
    tangent, normal = np.array([1.0, 0.0, -y]), np.array([0.0, 1.0, x])
    masses = np.diag([rod.mass, rod.mass, inertia])
    found = []
    for law in ("stick", 1.0, -1.0):
        rows = np.zeros((5, 5))
        rows[:3, :3], rows[:3, 3], rows[:3, 4] = masses, -normal, -tangent
        rows[3, :3] = normal
        right = np.array([*(masses @ before), -e * (normal @ before), 0.0])
        if law == "stick":
            rows[4, :3] = tangent
        else:
            rows[4, 3:] = law * mu, 1.0
        after = np.linalg.solve(rows, right)
        if after[3] < 0.0:
            continue
        if (abs(after[4]) <= mu * after[3]) if law == "stick" else (law * (tangent @ after[:3]) > 0.0):
            found.append(after[:3])
    (only,) = found
    return only


def recorded(scene, after, dt=DT):
    """A record that ends with the velocities ``after``."""
    n = round(scene.duration / dt) + 1
    pose, twist = still(scene, n)
    twist[:, 1] = scene.bodies[1].twist
    twist[n // 2 :, 1] = after
    return Trajectory(np.arange(n) * dt, pose, twist, None, dt, "completed")


@pytest.mark.parametrize("params", CELLS)
def test_blow_by_the_equations_of_a_rigid_body(params):
    canonical, scene = made("kane", **params)
    assert failing(canonical, scene, recorded(scene, blown(scene))) == set()


def test_energy_gain_of_a_thin_rod_as_published():
    """.1236 m v^2 for a rod without thickness: twice that is over the energy of the approach."""
    _, scene = made("kane", aspect=1e-9)
    assert CATALOGUE["kane"].exact(scene)["gain"] == pytest.approx(2.0 * 0.1236, abs=1e-4)


def test_no_energy_gain_without_slide_or_friction():
    for params in ({"along": 0.0, "mu": 0.0}, {"mu": 0.0}, {"along": -0.727}):
        _, scene = made("kane", **params)
        assert CATALOGUE["kane"].exact(scene)["gain"] < 1e-12


@pytest.mark.parametrize("size", SIZES)
def test_kane_blow_with_wrong_restitution_friction_or_inertia(size):
    canonical, scene = made("kane")
    assert failing(canonical, scene, recorded(scene, blown(scene, e=0.9988 * (1.0 - size)))) >= {"rise", "gain"}
    assert failing(canonical, scene, recorded(scene, blown(scene, heavy=1.0 + size))) >= {"spin", "gain"}
    canonical, slips = made("kane", mu=0.1, e=0.5)
    wrong = failing(canonical, slips, recorded(slips, blown(slips, mu=0.1 * (1.0 + size))))
    assert wrong == {"rise", "ahead", "spin", "gain"}
    for component, metric in enumerate(("ahead", "rise", "spin")):
        off = blown(scene)
        off[component] += size
        assert failing(canonical, scene, recorded(scene, off)) == {metric, "gain"}


def test_motion_without_the_energy_gain_fails():
    """Energy clipped by a smaller normal rebound, the end sticking as it should."""
    canonical, scene = made("kane")
    assert failing(canonical, scene, recorded(scene, blown(scene, e=0.8))) >= {"rise", "spin", "gain"}


@pytest.mark.parametrize(
    ("params", "named"), [({"lean": 35.0, "e": 0.1, "v": 10.0}, "lean"), ({"aspect": 0.0}, "aspect"), ({"e": 1.1}, "e")]
)
def test_second_landing_or_other_shape_refused(params, named):
    with pytest.raises(SceneError, match=rf"kane\.{named}"):
        made("kane", **params)


@pytest.mark.parametrize("scale", [1e-6, 1e-3, 1.0, 1e3])
@pytest.mark.parametrize(("e", "mu"), [(0.0, 0.1), (0.5, 0.1), (0.9, 0.3), (0.0, 0.0)])
def test_point_slowed_by_friction_at_any_speed(scale, e, mu):
    """A mass point that comes down at 1 and along at 1/2: (1 + e) up, mu (1 + e) back, or all of it if that is less."""
    normal = 1.0 + e
    tangent = min(mu * normal, 0.5)
    for way in (1.0, -1.0):
        found = answers(np.eye(2), scale * np.array([-1.0, way * 0.5]), e, mu)
        assert [one.tolist() for one in found] == [pytest.approx([scale * normal, -way * scale * tangent])]
    sticking = answers(np.eye(2), scale * np.array([-1.0, 0.5]), e, 1.0)
    assert [one.tolist() for one in sticking] == [pytest.approx([scale * normal, -0.5 * scale])]
