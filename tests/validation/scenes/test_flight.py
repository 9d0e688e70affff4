"""Bodies in free flight: their truth against independent integration, schemes that pass, and faults that each fail."""

import numpy as np
import pytest
from planted import failing, made
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation
from test_tumble import quaternion_rate

from adapters.trajectory import Trajectory
from validation.scenes import flight
from validation.scenes.flight import BOX, FALLS, SIDES, THROWN
from validation.truths import spinning

DT = 1 / 240


def flown(scene, dt=DT, offset=0.0, own=None):
    """Free fall, with places of a scheme of this offset [dt g t/2], and the box's spin by DOP853; ``own``: moments."""
    d, n = scene.dimension, round(scene.duration / dt)
    t = np.arange(n + 1) * dt
    start, first = (np.array([getattr(body, name) for body in scene.bodies]) for name in ("pose", "twist"))
    pose, twist = (np.repeat(told[None], n + 1, axis=0) for told in (start, first))
    gravity = np.array(scene.gravity)
    pose[:, :, :d] += t[:, None, None] * first[:, :d] + (0.5 * t * (t + offset * dt))[:, None, None] * gravity
    twist[:, :, :d] += t[:, None, None] * gravity
    if d == 3:
        box = np.array(scene.bodies[BOX].inertia)
        about = box if own is None else own(box)

        def rates(time, y):
            return [*quaternion_rate(y[:4], y[4:]), *(np.cross(about * y[4:], y[4:]) / about)]

        found = solve_ivp(rates, (0.0, t[-1]), [1.0, 0.0, 0.0, 0.0, *first[BOX, 3:]], "DOP853", rtol=1e-11, t_eval=t)
        pose[:, BOX, 3:] = found.y[:4].T / np.linalg.norm(found.y[:4], axis=0)[:, None]
        turned = spinning.rotation(pose[:, BOX])
        twist[:, BOX, 3:] = np.einsum("sij,sj->si", turned, found.y[4:].T)
    return Trajectory(t, pose, twist, None, dt, "completed")


def test_time_of_a_turn_over_as_integrated():
    canonical, scene = made("flight", 3)
    own, start = spinning.moments(1.0, SIDES), scene.bodies[BOX].twist[3:]
    zero = lambda t, w: w[1]  # noqa: E731
    found = solve_ivp(
        lambda t, w: np.cross(own * w, w) / own, (0.0, 3.0), start, "DOP853", rtol=1e-12, atol=1e-14, events=zero
    )
    assert canonical.exact(scene)["flip_time"] == pytest.approx(found.t_events[0][0], rel=1e-10)


def test_slow_spin_without_a_turn_over():
    canonical, scene = made("flight", 3, spin=0.5)
    assert "flip_time" not in canonical.exact(scene)
    assert failing(canonical, scene, flown(scene)) == set()


def test_late_turn_over_at_the_end_of_the_time():
    """It is due 5 ms before the end, and may be 19 ms late."""
    canonical, scene = made("flight", 3, time=1.39)
    late = flown(scene, own=lambda box: box * (0.995, 1.0, 1.0))
    assert canonical.measure(scene, late)["flip_time"][0] is None and failing(canonical, scene, late) == set()


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("dimension", [2, 3])
def test_flights_of_random_sizes(dimension, seed):
    draw = np.random.default_rng(seed).uniform
    params = {"speed": 10.0 ** draw(0, 3), "spin": 10.0 ** draw(-1, 1), "time": draw(1.0, 5.0), "g": draw(0.0, 20.0)}
    canonical, scene = made("flight", dimension, mass=10.0 ** draw(-3, 3), **params)
    record = flown(scene, offset=draw(-1.0, 1.0))
    assert failing(canonical, scene, record) == set()
    weak, late = flown(scene), flown(scene)
    weak.twist[:, :, dimension - 1] += 0.01 * scene.params["g"] * weak.t[:, None]
    late.twist[1:, FALLS] = late.twist[:-1, FALLS].copy()
    assert {"fall_speed"} <= failing(canonical, scene, weak) and {"fall_speed"} <= failing(canonical, scene, late)


@pytest.mark.parametrize("offset", [-1.0, 0.0, 1.0])
@pytest.mark.parametrize("dt", [1 / 60, DT])
@pytest.mark.parametrize("dimension", [2, 3])
def test_flight_in_any_order_of_a_step(dimension, dt, offset):
    canonical, scene = made("flight", dimension)
    assert failing(canonical, scene, flown(scene, dt, offset)) == set()


def damped(scene, record):
    """One per cent of every velocity and spin a second."""
    record.twist[...] *= np.exp(-0.01 * record.t)[:, None, None]


def capped(scene, record):
    """No body is faster than 120 m/s."""
    speed = np.linalg.norm(record.twist[:, :, : scene.dimension], axis=2, keepdims=True)
    record.twist[:, :, : scene.dimension] *= np.minimum(1.0, 120.0 / np.maximum(speed, 1e-9))


def drifting(scene, record):
    """The box slips along x with a millionth of a millimetre a second."""
    record.pose[:, BOX, 0] += 1e-9 * record.t


def headed(scene, record):
    """What flies askew, along no axis, loses a part in 1e9."""
    record.twist[:, BOX - 1, : scene.dimension] *= 1.0 - 1e-9


def twice(scene, record):
    """Gravity acts twice in one step."""
    record.twist[10:, :, : scene.dimension] += DT * np.array(scene.gravity)


def short(scene, record):
    """A step is left out of the ways, not of the speeds."""
    d = scene.dimension
    record.pose[1:, THROWN:BOX, :d] -= DT * record.twist[1:, THROWN:BOX, :d]


def swapped(scene, record):
    """What is read of the first throw is the second's."""
    record.pose[:, THROWN] = record.pose[:, THROWN + 1]
    record.twist[:, THROWN] = record.twist[:, THROWN + 1]


def spun(scene, record):
    """The ball's spin has the other sign."""
    record.twist[:, FALLS, scene.dimension :] *= -1.0


def leaning(scene, record):
    """Gravity leans by a microradian."""
    way = 0.5e-6 * scene.params["g"] * record.t[:, None] ** 2
    record.pose[:, :, 0] += way
    record.twist[:, :, 0] += 1e-6 * scene.params["g"] * record.t[:, None]


@pytest.mark.parametrize(
    "fault, noticed",
    [
        (damped, {"fall_speed", "throw_speed", "ball_spin"}),
        (capped, {"throw_speed", "heading_spread"}),
        (drifting, {"drift_across"}),
        (headed, {"heading_spread"}),
        (twice, {"fall_speed"}),
        (short, {"throw_way"}),
        (swapped, {"throw_speed", "throw_way"}),
        (spun, {"ball_spin"}),
        (leaning, {"drift_across"}),
    ],
)
@pytest.mark.parametrize("dimension", [2, 3])
def test_planted_faults_of_a_flight(dimension, fault, noticed):
    canonical, scene = made("flight", dimension)
    record = flown(scene)
    fault(scene, record)
    found = failing(canonical, scene, record)
    assert noticed <= found and (fault is damped or "fall" not in found)
    assert fault is not drifting or found == {"drift_across"}


def test_spin_without_its_gyroscopic_term():
    """The spin stays as it was in space, and the box turns about it for ever."""
    canonical, scene = made("flight", 3)
    record = flown(scene)
    spin = record.twist[0, BOX, 3:]
    record.twist[:, BOX, 3:] = spin
    record.pose[:, BOX, 3:] = Rotation.from_rotvec(record.t[:, None] * spin).as_quat()[:, [3, 0, 1, 2]]
    assert failing(canonical, scene, record) == {"flip_time"}
    assert canonical.measure(scene, record)["flip_time"][0] is None


@pytest.mark.parametrize("dimension", [2, 3])
def test_bodies_of_a_flight_never_meet(dimension):
    """Nor does a throw meet the box, which stays beside the ball that falls."""
    _, scene = made("flight", dimension, speed=1.0)
    place = flown(scene).pose[:, :, :dimension]
    for k in range(len(scene.bodies)):
        others = [j for j in range(len(scene.bodies)) if j != k]
        assert np.linalg.norm(place[:, others] - place[:, [k]], axis=2).min() > 2.0 * flight.RADIUS + max(SIDES)
    assert (FALLS, THROWN) == (0, 1)
