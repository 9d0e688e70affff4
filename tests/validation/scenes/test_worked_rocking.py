"""Boards that rock on a log, worked out by hand: how they start, friction that they need, what is forgiven, numbers."""

import math

import numpy as np
import pytest
from planted import made, stated, still
from scipy.integrate import quad, solve_ivp

from adapters.scene import SceneError
from adapters.trajectory import Trajectory

DT = 1 / 64


BOARD = {"tilt": 20.0, "radius": 0.6, "thickness": 0.4, "length": 1.8, "mu": 2.0, "g": 8.0, "mass": 3.0}
THETA, R, H, SQUARE = math.radians(20.0), 0.6, 0.2, (1.8**2 + 0.4**2) / 12.0


@pytest.mark.parametrize("dimension", [2, 3])
def test_contact_of_a_rolled_board(dimension):
    canonical, scene = made("rocker", dimension, **BOARD)
    log, board = scene.bodies
    assert (scene.name, scene.version, log.name, log.motion, board.name) == ("rocker", 1, "log", "fixed", "board")
    assert log.shape.radius == R and not any(log.pose[:dimension]) and board.mass == 3.0
    assert board.shape.half_extents == (0.9, *(0.9,) * (dimension - 2), 0.2)
    x, z = board.pose[0], board.pose[dimension - 1]
    # R + h off the log's middle, and as far along its own face as the log's arc.
    assert -x * math.sin(THETA) + z * math.cos(THETA) == pytest.approx(R + H)
    assert x * math.cos(THETA) + z * math.sin(THETA) == pytest.approx(R * THETA)
    assert (scene.pairs[0].restitution, scene.pairs[0].friction) == (0.0, 2.0)
    assert scene.gravity == (*(0.0,) * (dimension - 1), -8.0)
    assert scene.duration == pytest.approx(3.25 * canonical.exact(scene)["swing_time"])


def swung(theta=THETA, r=R, h=H, square=SQUARE, g=8.0):
    """Swing of the board from side to side: times, angles, accelerations of its centre (s, 2) by second differences.

    Lagrange's equation is differenced from kinetic and potential energy; the path is that of the rolling centre.
    """

    def centre(phi):
        return np.array([
            -(r + h) * np.sin(phi) + r * phi * np.cos(phi), (r + h) * np.cos(phi) + r * phi * np.sin(phi)
        ])  # fmt: skip

    def inertia(phi, d=1e-5):
        way = (centre(phi + d) - centre(phi - d)) / (2.0 * d)
        return way @ way + square

    def rates(t, y):
        d = 1e-4
        slope = g * (centre(y[0] + d)[1] - centre(y[0] - d)[1]) / (2.0 * d)
        bent = (inertia(y[0] + d) - inertia(y[0] - d)) / (2.0 * d)
        return [y[1], (-slope - 0.5 * bent * y[1] ** 2) / inertia(y[0])]

    def side(t, y):
        return y[1]

    side.terminal, side.direction = True, 1.0
    found = solve_ivp(rates, (0.0, 9.0), [theta, -1e-12], "DOP853", events=side, dense_output=True, rtol=1e-10,
                      atol=1e-11)  # fmt: skip
    end, e = found.t[-1], 1e-3
    t = np.linspace(0.0, end, 401)
    # It goes back from either side as it came.
    path = [centre(found.sol(end - np.abs(end - np.abs(t + k * e)))[0]) for k in (-1, 0, 1)]
    return t, found.sol(t)[0], ((path[0] - 2.0 * path[1] + path[2]) / e**2).T


def test_friction_for_a_rocking_board():
    """Along and across the board, from the acceleration of its centre; a per cent of it decides."""
    _, phi, a = swung()
    force = a + [0.0, 8.0]
    along = force[:, 0] * np.cos(phi) + force[:, 1] * np.sin(phi)
    across = -force[:, 0] * np.sin(phi) + force[:, 1] * np.cos(phi)
    needed = float((np.abs(along) / across).max())
    assert (across > 0.0).all() and 0.1 < needed < 1.0
    made("rocker", **{**BOARD, "mu": 1.01 * needed})
    with pytest.raises(SceneError, match=r"rocker\.mu"):
        made("rocker", **{**BOARD, "mu": 0.99 * needed})
    # Friction and load both go with gravity: a twentieth of it changes nothing.
    made("rocker", **{**BOARD, "g": 0.4, "mu": 1.01 * needed})
    with pytest.raises(SceneError, match=r"rocker\.mu"):
        made("rocker", **{**BOARD, "g": 0.4, "mu": 0.99 * needed})


def test_allowance_of_a_rocking_board():
    """Of each swing a first-order step leaves out the integral of |a| dt/sqrt(2), and a^2 dt/(2 g) as height."""
    canonical, scene = made("rocker", 3, **BOARD)
    t, _, a = swung()
    size = np.hypot(*a.T)
    way, energy = np.trapezoid(size, t) / math.sqrt(2.0), 0.5 * np.trapezoid(size**2, t) / 8.0
    slope = R * THETA * math.cos(THETA) - H * math.sin(THETA)
    inertia = H**2 + (R * THETA) ** 2 + SQUARE
    kick = 0.5 * (1.5 / 64) ** 2 * 8.0 * slope**2 / inertia
    error = (3.0 * energy / 64 + kick) / slope / THETA
    swing = canonical.exact(scene)["swing_time"]
    others = [canonical.exact(made("rocker", **{**BOARD, "tilt": 20.0 * (1.0 + s * error)})[1]) for s in (-1, 1)]
    found = stated(canonical.checks(scene, DT))
    close = 1e-4  # of integrals by a trapezium
    assert found["slip"] == ("m", pytest.approx(3.0 * way / 64 + 8.0 / 4096, rel=close))
    assert found["amplitude"] == ("1", pytest.approx(error, rel=close))
    assert found["swing_time"] == (
        "s", pytest.approx(1.0 / 64 + max(abs(other["swing_time"] - swing) for other in others), rel=close)
    )  # fmt: skip
    assert found["yaw"] == ("rad/s", pytest.approx(0.01 * 8.0 / 64 / 0.9))
    assert {check.source for check in canonical.checks(scene, DT)} == {
        "Lagrange's equation of a board that rolls on a log; energy", "symmetry"
    }  # fmt: skip
    # A step so short that nothing is left of it leaves round-off, and one so long no more than a fifth of the tilt.
    assert stated(canonical.checks(scene, 1e-16))["amplitude"][1] == pytest.approx(1e-12, rel=1e-2)
    long = stated(canonical.checks(scene, 1.0))["swing_time"][1]
    fifth = [canonical.exact(made("rocker", **{**BOARD, "tilt": t})[1])["swing_time"] for t in (16.0, 24.0)]
    assert long == pytest.approx(1.0 + max(abs(each - swing) for each in fifth))


def test_error_of_a_rocking_board():
    canonical, scene = made("rocker", **BOARD)
    swing = canonical.exact(scene)["swing_time"]
    assert canonical.primary.error(scene, DT, {"swing_time": (0.9 * swing, "")}) == (pytest.approx(0.1), "")
    assert canonical.primary.error(scene, DT, {"swing_time": (None, "never")}) == (None, "never")


def test_swing_time_as_twice_the_integral_to_level():
    """Between the side, taken out by theta = start (1 - u^2), and level."""
    canonical, scene = made("rocker", **BOARD)

    def raised(phi):
        return R * phi * math.sin(phi) + (R + H) * (math.cos(phi) - 1.0)

    def slowness(u):
        phi = THETA * (1.0 - u * u)
        return 2.0 * THETA * u * math.sqrt((H**2 + (R * phi) ** 2 + SQUARE) / (16.0 * (raised(THETA) - raised(phi))))

    assert canonical.exact(scene)["swing_time"] == pytest.approx(2.0 * quad(slowness, 1e-9, 1.0)[0], rel=1e-6)


@pytest.mark.parametrize(
    ("params", "named"),
    [
        ({"thickness": 1.2, "mu": 9.0}, r"rocker\.radius: 0.6 m does not hold a board of 1.2 m"),
        ({"length": 0.6 * THETA / 0.45 * 0.999}, r"rocker\.tilt: at 20 degrees"),
    ],
)
def test_boards_at_their_limits_are_refused(params, named):
    with pytest.raises(SceneError, match=named):
        made("rocker", **{**BOARD, **params})
    made("rocker", **{**BOARD, "length": 0.6 * THETA / 0.45 * 1.001, "mu": 9.0})


def test_measures_of_a_rocking_board():
    """Half a turn of a cosine a swing, in two fifths of its angle, rolling but for 1/50 m; a yaw of 0.5, twice.

    It begins a tenth of a metre off where it should be, and a hundredth more in the next sample: no slip from there on.
    """
    canonical, scene = made("rocker", 3, **BOARD)
    swing = canonical.exact(scene)["swing_time"]
    t = np.arange(round(scene.duration / DT) + 1) * DT
    own = 0.95 * swing  # it swings faster than it should
    phi = 0.4 * THETA * np.cos(np.pi * t / own)
    spin = -0.4 * THETA * np.pi / own * np.sin(np.pi * t / own)
    pose, twist = still(scene, len(t))
    slipped = 0.1 + 0.02 * (np.arange(len(t)) == 7) - 0.01 * (np.arange(len(t)) == 1)
    rolled = R * phi + slipped
    pose[:, 1, 0] = -(R + H) * np.sin(phi) + rolled * np.cos(phi)
    pose[:, 1, 2] = (R + H) * np.cos(phi) + rolled * np.sin(phi)
    pose[:, 1, 3:] = np.column_stack([np.cos(phi / 2), 0 * phi, -np.sin(phi / 2), 0 * phi])
    twist[:, 1, 4] = -spin
    twist[9, 1, [3, 5]] = twist[11, 1, [3, 5]] = (0.3, 0.4)
    found = canonical.measure(scene, Trajectory(t, pose, twist, None, DT, "completed"))
    assert found == {
        "swing_time": (pytest.approx(own, rel=1e-5), ""),
        "amplitude": (pytest.approx(0.4, rel=1e-3), ""),
        "slip": (pytest.approx(0.02), ""),
        "yaw": (pytest.approx(0.5), ""),
    }
    # One that stays where it is after its first swing has none.
    stopped = Trajectory(t, pose.copy(), twist.copy(), None, DT, "completed")
    stopped.pose[t > 0.8 * swing] = stopped.pose[np.argmax(t > 0.8 * swing)]
    stopped.twist[t > 0.8 * swing] = 0.0
    assert canonical.measure(scene, stopped)["swing_time"] == (None, "it never arrives there")


def swinging(scene, period, share):
    """A board that swings in ``period`` [s] from side to side, by ``share`` (of times) of its first tilt."""
    t = np.arange(round(scene.duration / DT) + 1) * DT
    phi = share(t) * THETA * np.cos(np.pi * t / period)
    pose, twist = still(scene, len(t))
    pose[:, 1, 2], twist[:, 1, 2] = phi, -share(t) * THETA * np.pi / period * np.sin(np.pi * t / period)
    return Trajectory(t, pose, twist, None, DT, "completed")


def test_the_amplitude_is_that_of_the_last_side():
    """It loses a quarter of its tilt after two swings and a quarter."""
    canonical, scene = made("rocker", **BOARD)
    swing = canonical.exact(scene)["swing_time"]
    found = canonical.measure(scene, swinging(scene, swing, lambda t: np.where(t < 2.25 * swing, 1.0, 0.75)))
    assert found["amplitude"] == (pytest.approx(0.75, rel=1e-3), "")


def test_board_level_at_a_wrong_time():
    """In three quarters of its time it is level the third time before the last swing has begun; then no more."""
    canonical, scene = made("rocker", **BOARD)
    fast = swinging(scene, 0.75 * canonical.exact(scene)["swing_time"], np.ones_like)
    assert canonical.measure(scene, fast)["swing_time"] == (None, "it never arrives there")
