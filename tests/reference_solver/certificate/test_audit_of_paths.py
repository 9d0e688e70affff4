"""Where bodies are within a piece is known as well as a run knows it: what is right passes, what is not does not."""

from dataclasses import replace
from math import atan2, cos, hypot, sin

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from reference_solver import Body, Box, Disc, HalfSpace, Model, Polygon, Settings, Simulation
from reference_solver.certificate.audit import audit
from reference_solver.pieces import TURNING
from tests.verification import self_test

G = 9.81
FLOOR = Body(HalfSpace((0.0, 1.0)), motion="fixed")


def sliding_block(seed):
    """A slender block that slides along and falls over its leading corner, and the time in which it leans by 1.45 rad.

    With r from the corner to the centre and phi its angle from upright, which the pressure N and its friction turn by
    ``I phi'' = N r (sin phi + mu cos phi)``, ``N = m g - m r (sin phi phi'' + cos phi phi'^2)``.
    """
    random = np.random.default_rng(seed)
    half, mu, lean = random.uniform(0.02, 0.06), random.choice([0.0, 0.2]), random.uniform(0.12, 0.2)
    high = half * random.uniform(6.0, 10.0)
    r, lag, inertia = hypot(half, high), atan2(half, high), (half**2 + high**2) / 3.0

    def rate(t, state):
        phi, spin = state
        arm = r * (sin(phi) + mu * cos(phi))
        return spin, arm * (G - r * cos(phi) * spin**2) / (inertia + r * sin(phi) * arm)

    def fallen(t, state):
        return state[0] + lag - 1.45

    fallen.terminal = True
    found = solve_ivp(rate, (0.0, 10.0), (lean - lag, 0.0), "DOP853", rtol=1e-12, atol=1e-14, events=fallen)
    place = -half * cos(lean) + high * sin(lean), half * sin(lean) + high * cos(lean)
    block = Body(Box((half, high)), 1.0, inertia, (*place, -lean), (8.0, 0.0, 0.0))
    return Model(2, [FLOOR, block], (0.0, -G), 0.0, mu), float(found.t_events[0][0])


def see_saw(seed):
    """A plank on a fixed wedge or log, struck by a ball that falls on one of its halves."""
    random = np.random.default_rng(seed)
    half, thin, high, mu = (random.uniform(*span) for span in ((0.5, 2.0), (0.01, 0.03), (0.1, 0.3), (0.4, 1.2)))
    wedge = Polygon(((-0.6 * high, -high / 3.0), (0.6 * high, -high / 3.0), (0.0, high / 1.5)))
    under = (Disc(0.5 * high), 0.5 * high) if not random.integers(2) else (wedge, high / 3.0)
    mass, x = random.uniform(0.3, 2.0), random.uniform(-0.05, 0.05) * half
    plank = Body(Box((half, thin)), mass, mass * (half**2 + thin**2) / 3.0, (x, high + thin, 0.0))
    radius, aside, mass = random.uniform(0.03, 0.08), random.uniform(0.5, 0.9), random.uniform(1.0, 6.0)
    over, speed = high + 2.0 * thin + radius + random.uniform(0.02, 0.3), random.uniform(0.0, 4.0)
    ball = Body(Disc(radius), mass, 0.5 * mass * radius**2, (aside * half, over, 0.0), (0.0, -speed, 0.0))
    fulcrum = Body(under[0], pose=(0.0, under[1], 0.0), motion="fixed")
    return Model(2, [FLOOR, fulcrum, plank, ball], (0.0, -G), float(random.choice([0.0, 0.3])), mu)


def refused(model, record, dt):
    """Names of the checks that refuse a run."""
    return {finding.name for finding in audit(model, record, dt) if not finding.holds}


def in_steps(model, time, rate):
    """Run for ``time`` in steps of about 1/rate; the record and the step."""
    steps = max(2, round(time * rate))
    dt = time / steps
    return Simulation(model, Settings.reference(dt)).record(steps, pieces=True), dt


def in_space(model):
    """The same block, .1 m wide across its plane."""
    block = model.bodies[1]
    (x, z), across, (along, up, angle) = block.shape.half_extents, 0.05, block.pose
    moments = tuple((a**2 + b**2) / 3.0 for a, b in ((across, z), (x, z), (x, across)))
    pose = (along, 0.0, up, cos(0.5 * angle), 0.0, -sin(0.5 * angle), 0.0)
    floor = Body(HalfSpace((0.0, 0.0, 1.0)), motion="fixed", pose=(0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0))
    box = Body(Box((x, across, z)), 1.0, moments, pose, (8.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    return Model(3, [floor, box], (0.0, 0.0, -G), 0.0, model.friction[0, 1])


@pytest.mark.parametrize("rate", [30, 60, 100])
@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("dimension", [2, 3])
def test_block_that_falls_over_at_coarse_steps(dimension, seed, rate):
    """It turns by up to .1 rad in a piece; a cubic polynomial has its corner in the floor by 1e-5 of its half width."""
    model, time = sliding_block(seed)
    model = model if dimension == 2 else in_space(model)
    record, dt = in_steps(model, time, rate)
    end = record.pose[-1, 1]
    angle = end[2] if dimension == 2 else -2.0 * atan2(end[5], end[3])
    assert angle == pytest.approx(-1.45, abs=1e-8)
    assert not refused(model, record, dt)


@pytest.mark.parametrize(("seed", "rate"), [(8, 30), (9, 30), (11, 60), (33, 30)])
def test_see_saw_at_coarse_steps(seed, rate):
    """Struck by a ball, twice with restitution; where it is at the end steps of a 20th tell.

    Hundreds of rebounds come in one instant, and contacts part as slowly as the last of them are.
    """
    model, steps = see_saw(seed), int(0.8 * rate)
    record = Simulation(model, Settings.reference(1.0 / rate)).record(steps, pieces=True)
    fine = Simulation(model, Settings.reference(0.05 / rate)).record(20 * steps)
    assert record.pose[-1] == pytest.approx(fine.pose[-1], abs=1e-7)
    assert not refused(model, record, 1.0 / rate)


@pytest.mark.parametrize("seed", range(5))
def test_post_beside_a_falling_block_by_a_ten_millionth(seed):
    """A fixed disc that the run does not look at, where a corner of the block is in the middle of a piece.

    The corner's path there, which a run to that time tells, curves away from the post.
    """
    model, time = sliding_block(seed)
    steps, dt = round(60 * time), time / round(60 * time)
    scene = self_test.Scene(model, steps, Settings.reference(dt))
    pieces = self_test.obstacle(lambda size: (0.0, -9.0))(scene, 0.0)[1].pieces
    turning = np.flatnonzero(pieces.scheme == TURNING)
    piece = turning[4 * len(turning) // 5]
    middle, close = pieces.begin[piece] + 0.5 * pieces.length[piece], 200
    fine = Simulation(model, Settings.reference(middle / close)).record(close + 1).pose[:, 1]
    half = np.array(model.bodies[1].shape.half_extents)
    corner = [pose[:2] + np.array([[cos(pose[2]), -sin(pose[2])], [sin(pose[2]), cos(pose[2])]]) @ (half * (-1.0, 1.0))
              for pose in fine[close - 1 :]]  # fmt: skip
    along, bend = corner[2] - corner[0], corner[2] - 2.0 * corner[1] + corner[0]
    out = np.array([-along[1], along[0]]) / np.linalg.norm(along)
    out *= -np.sign(out @ bend)
    for deep, seen in ((1e-7, {"overlap"}), (-1e-7, set())):
        place = corner[1] + (0.5 - deep * half[0]) * out
        truth, changed = self_test.obstacle(lambda size, place=place: tuple(place))(scene, deep)
        assert refused(truth, changed, dt) == seen, deep


def test_refusal_of_a_contact_lost_for_one_step():
    """In its last step a block that falls over has no floor."""
    model, time = sliding_block(1)
    record, dt = in_steps(model, 0.8 * time, 60)
    block = replace(model.bodies[1], pose=tuple(record.pose[-1, 1]), twist=tuple(record.twist[-1, 1]))
    away = replace(FLOOR, pose=(0.0, -10.0, 0.0))
    then = Simulation(replace(model, bodies=[away, block]), Settings.reference(dt)).record(1, pieces=True)
    then.pose[:, 0] = 0.0
    then.pieces.pose_before[then.pieces.body == 0] = 0.0
    then.pieces.pose_after[then.pieces.body == 0] = 0.0
    assert not refused(model, record, dt)
    assert refused(model, self_test._joined(record, then), dt) == {"overlap"}
