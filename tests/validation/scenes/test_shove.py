"""A box on a slope that shoves another: accelerations from all contacts as constraints; planted faults of sizes."""

import math

import numpy as np
import pytest
from planted import carried, failing, made, still

from adapters.scene import SceneError
from adapters.trajectory import Trajectory

DT = 1 / 240
SIZES = [0.1, 0.01, 0.001]


def corners(body):
    c, s = math.cos(body.pose[2]), math.sin(body.pose[2])
    signs = np.array([[x, y] for x in (-1, 1) for y in (-1, 1)])
    return signs * body.shape.half_extents @ np.array([[c, s], [-s, c]])


def held(scene):
    """Accelerations (3 per box) and force of the corner: five contacts that keep their distance, none known to push.

    Two corners on the slope, two on the floor, one on the face; the forces of four are redundant by nothing.
    """
    upper, lower = scene.bodies[2:]
    normal = np.array(scene.bodies[1].shape.normal)
    rows = []
    for body, way, offset in ((upper, normal, 0), (lower, np.array([0.0, 1.0]), 3)):
        arms = corners(body)
        for arm in arms[np.argsort((arms + body.pose[:2]) @ way)[:2]]:
            assert abs((arm + body.pose[:2]) @ way) < 1e-12
            row = np.zeros(6)
            row[offset : offset + 3] = *way, arm[0] * way[1] - arm[1] * way[0]
            rows.append(row)
    arms = corners(upper)
    arm = arms[arms[:, 0].argmax()]
    on_face = arm + upper.pose[:2] - np.array(lower.pose[:2])
    assert on_face[0] == pytest.approx(-lower.shape.half_extents[0], abs=1e-12)
    rows.append(np.array([-1.0, 0.0, arm[1], 1.0, 0.0, -on_face[1]]))
    contacts = np.array(rows)
    masses = np.diag([upper.mass, upper.mass, upper.inertia, lower.mass, lower.mass, lower.inertia])
    loads = masses @ np.array([0.0, -scene.params["g"], 0.0] * 2)
    system = np.block([[masses, -contacts.T], [contacts, np.zeros((5, 5))]])
    found = np.linalg.solve(system, [*loads, *(0.0,) * 5])
    return found[:6], found[6:]


def moving(scene, dt=DT, heavy=1.0, offset=0.0):
    """Both boxes under these accelerations from rest; ``offset`` of a step order, in steps."""
    rates, forces = held(scene)
    n = round(scene.duration / dt) + 1
    t = np.arange(n) * dt
    pose, twist = still(scene, n)
    twist[:, 2:] = t[:, None, None] * rates.reshape(2, 3) / heavy
    pose[:, 2:] += (0.5 * t**2 + offset * dt * t)[:, None, None] * rates.reshape(2, 3) / heavy
    contacts = carried([(2, 3)], np.tile([forces[4] * dt, 0.0], (n, 1, 1)))
    return Trajectory(t, pose, twist, contacts, dt, "completed")


CELLS = [{}, {"ratio": 20.0}, {"ratio": 0.5}, {"angle": 60.0}, {"mass": 5.0, "g": 3.0}]


@pytest.mark.parametrize("offset", [-0.5, 0.0, 0.5])
@pytest.mark.parametrize("params", CELLS)
def test_boxes_with_five_holding_contacts(params, offset):
    canonical, scene = made("shove", **params)
    _, forces = held(scene)
    assert (forces > 0.0).all(), "nothing tips: every corner pushes"
    trajectory = moving(scene, offset=offset)
    measured = canonical.measure(scene, trajectory)
    for name, truth in canonical.exact(scene).items():
        assert measured[name][0] == pytest.approx(truth, abs=1e-9), name
    assert failing(canonical, scene, trajectory) == set()


@pytest.mark.parametrize("dt", [1 / 60, DT])
@pytest.mark.parametrize("params", CELLS)
@pytest.mark.parametrize(("share", "fails"), [(0.99, set()), (1.01, {"down", "ahead"})])
def test_shove_a_hundredth_of_a_step_too_fast(params, dt, share, fails):
    """Speeds that go wrong by g dt/100 over the second half of the run, whatever its length, and no more."""
    canonical, scene = made("shove", **params)
    trajectory = moving(scene, dt)
    middle = len(trajectory.t) // 2
    late = (trajectory.t - trajectory.t[middle]).clip(0.0) / (trajectory.t[-1] - trajectory.t[middle])
    slope = math.radians(scene.params["angle"])
    for body, along in ((2, (math.cos(slope), -math.sin(slope))), (3, (1.0, 0.0))):
        trajectory.twist[:, body, :2] += share * 0.01 * scene.params["g"] * dt * late[:, None] * np.array(along)
    assert failing(canonical, scene, trajectory) == fails


@pytest.mark.parametrize("size", SIZES)
def test_shove_with_wrong_accelerations_forces_gaps_or_turns(size):
    canonical, scene = made("shove")
    assert failing(canonical, scene, moving(scene, heavy=1.0 + size)) >= {"down", "ahead"}
    weak = moving(scene)
    weak.contacts.rows.impulse[:] *= 1.0 - size
    assert failing(canonical, scene, weak) == {"force"}
    apart = moving(scene)
    apart.pose[60:, 3, 0] += size
    assert failing(canonical, scene, apart) == {"parted"}
    leaning = moving(scene)
    leaning.pose[60:, 3, 2] += size
    assert failing(canonical, scene, leaning) == {"turned"}


def test_boxes_that_stay_at_rest_fail():
    canonical, scene = made("shove")
    still = moving(scene, heavy=1e12)
    still.contacts.rows.impulse[:] = 0.0
    assert failing(canonical, scene, still) == {"down", "ahead", "force"}


@pytest.mark.parametrize(("params", "named"), [({"angle": 30.0}, "angle"), ({"ratio": 1e-2, "angle": 65.0}, "angle")])
def test_shoved_boxes_that_separate_refused(params, named):
    with pytest.raises(SceneError, match=rf"shove\.{named}"):
        made("shove", **params)
