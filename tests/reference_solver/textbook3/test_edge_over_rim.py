"""A box that lies with one edge across the rim of another, nearly flat on it: its normal is that of both edges."""

import math

import numpy as np
import pytest

from reference_solver import Body, Box, Model, Settings, Simulation

G, HALF = 9.81, (0.6, 0.1, 0.1)


def turned(quaternion, vector):
    w, v = quaternion[0], np.array(quaternion[1:])
    return vector + 2.0 * np.cross(v, np.cross(v, vector) + w * np.asarray(vector))


def product(p, q):
    w = p[0] * q[0] - np.dot(p[1:], q[1:])
    return np.array([w, *(p[0] * np.array(q[1:]) + q[0] * np.array(p[1:]) + np.cross(p[1:], q[1:]))])


def tipping(tilt, rate, heading=0.7):
    """A beam on edge across the rim of a fixed box, its inner end higher by ``tilt`` [rad]; nothing rubs."""
    about = (math.cos(0.5 * heading), 0.0, 0.0, math.sin(0.5 * heading))
    lean = (math.cos(0.5 * tilt), 0.0, math.sin(0.5 * tilt), 0.0)  # about y: the end at -x comes up
    q = product(about, product(lean, (math.cos(math.pi / 8), math.sin(math.pi / 8), 0.0, 0.0)))
    # The beam's lowest edge passes the rim at (.5, 0, .5) of the box, .01 m inside of the beam's middle.
    rim = turned(about, (0.5, 0.0, 0.5))
    edge = turned(product(about, lean), (-0.01, 0.0, -0.1 * math.sqrt(2.0)))
    inertia = tuple(sum(h * h for k, h in enumerate(HALF) if k != axis) / 3.0 for axis in range(3))
    table = Body(Box((0.5, 2.0, 0.5)), motion="fixed", pose=(0.0, 0.0, 0.0, *about))
    beam = Body(Box(HALF), 1.0, inertia, (*(rim - edge), *q))
    return Simulation(Model(3, [table, beam], (0.0, 0.0, -G), 0.0, 0.0), Settings.reference(1.0 / rate))


def energy(simulation):
    pose, twist = simulation.pose[1], simulation.twist[1]
    spin = turned((pose[3], *-pose[4:]), twist[3:])
    inertia = np.array(simulation.model.bodies[1].inertia)
    return 0.5 * twist[:3] @ twist[:3] + 0.5 * inertia @ spin**2 + G * pose[2]


@pytest.mark.parametrize("tilt", [1e-5, 1e-3])
def test_energy_of_a_beam_that_tips_over_a_rim(tilt):
    """No friction, no impact: energy is kept, and steps of any length agree, which a normal off by the tilt spoils."""
    poses = []
    for rate in (240, 1920):
        simulation = tipping(tilt, rate)
        start = energy(simulation)
        simulation.advance(rate // 20)
        assert np.linalg.norm(simulation.twist[1, 3:]) > 1e-2  # it does tip
        assert energy(simulation) == pytest.approx(start, abs=1e-12)
        poses.append(simulation.pose[1])
    assert poses[0] == pytest.approx(poses[1], abs=1e-11)
