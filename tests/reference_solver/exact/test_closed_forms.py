"""The event loop against motions that are known in closed form, to 1e-10."""

import math
from dataclasses import replace
from fractions import Fraction
from itertools import permutations

import numpy as np
import pytest

from reference_solver import Body, Box, Capsule, Disc, HalfSpace, Model, Polygon, Settings, Simulation, Sphere
from reference_solver.certificate.truth import certify
from reference_solver.exact.refusals import NoImpulses
from reference_solver.pieces import ROCKING

G, DT = 9.81, 1.0 / 240.0
SMALL = 1e-10
#: Orientation without a turn, by dimension.
UPRIGHT = {2: (0.0,), 3: (1.0, 0.0, 0.0, 0.0)}
SPINS = {2: 1, 3: 3}


def up(d, height=1.0):
    return (0.0,) * (d - 1) + (height,)


def ground(d, lean=0.0):
    normal = (math.sin(lean),) + (0.0,) * (d - 2) + (math.cos(lean),)
    return Body(HalfSpace(normal), motion="fixed", pose=(*(0.0,) * d, *UPRIGHT[d]))


def ball(d, place, velocity=None, mass=1.0, radius=0.5, spin=None):
    shape, inertia = (Disc(radius), 0.5) if d == 2 else (Sphere(radius), 0.4)
    moment = inertia * mass * radius**2
    velocity = (0.0,) * d if velocity is None else velocity
    spin = (0.0,) * SPINS[d] if spin is None else spin
    return Body(shape, mass, moment if d == 2 else (moment,) * 3, (*place, *UPRIGHT[d]), (*velocity, *spin))


def box(d, half, place, velocity=None, mass=1.0):
    square = [h * h for h in half]
    moments = [mass / 3.0 * (sum(square) - s) for s in square]
    inertia = mass / 3.0 * sum(square) if d == 2 else tuple(moments)
    velocity = (0.0,) * d if velocity is None else velocity
    return Body(Box(half), mass, inertia, (*place, *UPRIGHT[d]), (*velocity, *(0.0,) * SPINS[d]))


def record(model, time, stride=1):
    return Simulation(model, Settings.reference(DT)).record(round(time / DT), stride)


def height_of_bounce(t, height, e):
    """Height of a point that falls from rest and rebounds with e."""
    begin, duration, speed = 0.0, math.sqrt(2.0 * height / G), 0.0
    if t <= duration:
        return height - 0.5 * G * t * t
    begin, speed = duration, e * math.sqrt(2.0 * G * height)
    while speed > 1e-12:
        if t <= begin + 2.0 * speed / G:
            return speed * (t - begin) - 0.5 * G * (t - begin) ** 2
        begin, speed = begin + 2.0 * speed / G, e * speed
    return 0.0


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("e", [0.0, 0.5, 0.9, 1.0])
def test_bounce_down_to_rest(d, e):
    found = record(Model(d, [ground(d), ball(d, up(d, 1.5))], up(d, -G), e, 0.0), 3.0)
    truth = [0.5 + height_of_bounce(t, 1.0, e) for t in found.t]
    assert np.abs(found.pose[:, 1, d - 1] - truth).max() < SMALL


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize(("e", "far"), [(0.2, 0.0), (0.8, 0.0), (0.95, 2000.0)])
def test_time_of_all_rebounds(d, e, far):
    """They are over at (1 + e) / (1 - e) sqrt(2 h / g), ``far`` [m] from the origin as well."""
    model = Model(d, [ground(d), ball(d, (far, *up(d, 1.5)[1:]))], up(d, -G), e, 0.0)
    last = (1.0 + e) / (1.0 - e) * math.sqrt(2.0 / G)
    pieces = Simulation(model, Settings.reference(DT)).record(math.ceil(last / DT), pieces=True).pieces
    (end,) = np.flatnonzero(pieces.scheme == ROCKING)
    assert abs(pieces.begin[end] + pieces.length[end] - last) < 1e-12


@pytest.mark.parametrize("order", list(permutations(range(3))))
def test_slide_over_a_seam_of_polygons(order):
    """Corners of both meet at the seam, and are not held up by each other's sides."""
    block = Polygon(((0.5, -0.5), (0.5, 0.5), (-0.5, 0.5), (-0.5, -0.5)))
    bodies = [
        Body(block, motion="fixed", pose=(0.0, -0.5, 0.0)),
        Body(block, motion="fixed", pose=(1.0, -0.5, 0.0)),
        Body(block, 1.0, 1.0 / 6.0, (-0.25, 0.5, 0.0), (1.0, 0.0, 0.0)),
    ]
    found = record(Model(2, [bodies[i] for i in order], (0.0, -G), 0.0, 0.0), 0.5)
    assert np.abs(found.twist[:, order.index(2)] - (1.0, 0.0, 0.0)).max() < 1e-12


@pytest.mark.parametrize("heading", [0.0, 0.4])
@pytest.mark.parametrize("d", [2, 3])
def test_slide_of_a_box_until_it_stops(d, heading):
    speed, mu = 3.0, 0.4
    velocity = (speed, 0.0) if d == 2 else (speed * math.cos(heading), speed * math.sin(heading), 0.0)
    half = (0.5, 0.25) if d == 2 else (0.5, 0.5, 0.25)
    found = record(Model(d, [ground(d), box(d, half, up(d, 0.25), velocity)], up(d, -G), 0.0, mu), 2.0)
    t = np.minimum(found.t, speed / (mu * G))
    way = speed * t - 0.5 * mu * G * t * t
    truth = way[:, None] * np.array(velocity) / speed + up(d, 0.25)
    assert np.abs(found.pose[:, 1, :d] - truth).max() < SMALL


@pytest.mark.parametrize("d", [2, 3])
def test_slide_of_a_ball_until_it_rolls(d):
    """Of I = k m r^2: friction has spun it up when it is as slow as v / (1 + k)."""
    speed, mu, k = 3.0, 0.3, 0.5 if d == 2 else 0.4
    way = np.array((1.0, 0.0) if d == 2 else (math.cos(0.7), math.sin(0.7), 0.0))
    found = record(Model(d, [ground(d), ball(d, up(d, 0.5), speed * way)], up(d, -G), 0.0, mu), 2.0)
    slides, rolls = k * speed / ((1.0 + k) * mu * G), speed / (1.0 + k)
    t = np.minimum(found.t, slides)
    truth = speed * t - 0.5 * mu * G * t * t + rolls * (found.t - t)
    assert np.abs(found.pose[:, 1, :d] - truth[:, None] * way - up(d, 0.5)).max() < SMALL
    spin = (-rolls / 0.5,) if d == 2 else np.cross([0.0, 0.0, 1.0], rolls * way) / 0.5
    assert np.abs(found.twist[-1, 1] - [*rolls * way, *spin]).max() < SMALL


@pytest.mark.parametrize("d", [2, 3])
def test_rest_of_a_stack_to_the_bit(d):
    half = (0.5,) * d
    bodies = [ground(d), *(box(d, half, up(d, 0.5 + k)) for k in range(3))]
    found = record(Model(d, bodies, up(d, -G), 0.0, 0.5), 5.0, 240)
    assert np.array_equal(found.pose, np.broadcast_to(found.pose[0], found.pose.shape))


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("ratio", [0.5, 1.5])
def test_ball_on_a_slope_by_friction(d, ratio):
    """Without slip if tan(lean) <= (1 + m r^2 / I) mu."""
    lean, share = 0.3, 0.5 if d == 2 else 0.4
    mu = ratio * math.tan(lean) / (1.0 + 1.0 / share)
    start = 0.5 * np.array((math.sin(lean),) + (0.0,) * (d - 2) + (math.cos(lean),))
    found = record(Model(d, [ground(d, lean), ball(d, start)], up(d, -G), 0.0, mu), 1.0)
    pull = G * math.sin(lean)
    acceleration = pull / (1.0 + share) if ratio > 1.0 else pull - mu * G * math.cos(lean)
    way = np.linalg.norm(found.pose[:, 1, :d] - start, axis=1)
    assert np.abs(way - 0.5 * acceleration * found.t**2).max() < SMALL


@pytest.mark.parametrize("d", [2, 3])
def test_collision_count_of_two_balls_and_a_wall_as_pi(d):
    """Of masses 1 : 100 there are 31 blows (G. Galperin, *Regular and Chaotic Dynamics* 8, 2003)."""
    wall = Body(HalfSpace((1.0,) + (0.0,) * (d - 1)), motion="fixed", pose=(*(0.0,) * d, *UPRIGHT[d]))
    aside = (0.0,) * (d - 1)
    light, heavy = ball(d, (1.0, *aside)), ball(d, (3.0, *aside), (-1.0, *aside), 100.0)
    simulation = Simulation(Model(d, [wall, light, heavy], (0.0,) * d, 1.0, 0.0), Settings.reference(DT))
    found = simulation.record(960)
    velocity = found.twist[:, 1:, 0]
    assert simulation._world._loop.pieces == 31 + 1  # every blow ends a piece
    assert np.abs(velocity**2 @ (1.0, 100.0) - 100.0).max() < SMALL
    # Each of 16 blows between the balls turns (10 v_heavy, v_light) by twice atan(1/10); the wall mirrors v_light.
    turned = math.pi - 2.0 * 16 * math.atan(0.1)
    assert abs(velocity[-1, 1] - math.cos(turned)) < SMALL
    assert abs(velocity[-1, 0] + 10.0 * math.sin(turned)) < SMALL


def test_box_tipping_over_its_corner_without_slip():
    """Energy of the turn about the corner: I_c w^2 / 2 + m g y = constant, the corner at rest."""
    half, tilt = (0.3, 0.6), 0.5  # beyond the balance, at atan(1/2)
    c, s = math.cos(tilt), math.sin(tilt)
    arm = math.hypot(*half)
    place = (half[0] * c - half[1] * s, half[0] * s + half[1] * c)  # its lower left corner in the origin
    moment = (half[0] ** 2 + half[1] ** 2) / 3.0
    body = Body(Box(half), 1.0, moment, (place[0], place[1], tilt), (0.0, 0.0, 0.0))
    found = record(Model(2, [ground(2), body], (0.0, -G), 0.0, 2.0), 0.4)
    x, y, turned = found.pose[:, 1].T
    c, s = np.cos(turned), np.sin(turned)
    corner = np.stack([x - half[0] * c + half[1] * s, y - half[0] * s - half[1] * c])
    assert np.abs(corner).max() < SMALL
    energy = 0.5 * (moment + arm**2) * found.twist[:, 1, 2] ** 2 + G * y
    assert np.abs(energy - energy[0]).max() < SMALL
    assert np.abs(found.twist[-1, 1, 2]) > 0.1


def test_capsule_rolls_over_its_round_end():
    """A rod that stands on its end falls: it rolls without slip, and keeps its energy."""
    half, radius, lean = 0.4, 0.1, 0.1
    angle = 0.5 * math.pi + lean
    place = (half * math.cos(angle), radius + half * math.sin(angle), angle)
    moment = 0.06
    body = Body(Capsule(half, radius), 1.0, moment, place, (0.0, 0.0, 0.0))
    found = record(Model(2, [ground(2), body], (0.0, -G), 0.0, 3.0), 0.4)
    x, y, turned = found.pose[:, 1].T
    centre = np.stack([x - half * np.cos(turned), y - half * np.sin(turned)])
    assert np.abs(centre[1] - radius).max() < SMALL
    assert np.abs(centre[0] - centre[0, 0] + radius * (turned - angle)).max() < SMALL
    energy = 0.5 * (found.twist[:, 1, :2] ** 2).sum(axis=1) + 0.5 * moment * found.twist[:, 1, 2] ** 2 + G * y
    assert np.abs(energy - energy[0]).max() < SMALL
    assert abs(turned[-1] - angle) > 0.1


@pytest.mark.parametrize("beside", [False, True])
def test_symmetric_top_precesses(beside):
    """Without torque its axis goes round its momentum L at |L| / I_1 (Euler), whatever a ball does that slides by."""
    moments, spin = (0.2, 0.2, 0.1), (0.5, 0.0, 3.0)
    top = Body(Box((0.5, 0.5, 0.1)), 1.0, moments, (0.0, 0.0, 99.0, 1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, *spin))
    others = [ground(3), ball(3, up(3, 0.5), (3.0, 1.0, 0.0))] if beside else []
    found = record(Model(3, [*others, top], up(3, -G), 0.0, 0.1), 4.0, 48)
    momentum = np.array(moments) * spin
    rate = np.linalg.norm(momentum) / moments[0]
    along = momentum / np.linalg.norm(momentum)
    w, x, y, z = found.pose[:, -1, 3:].T
    axis = np.stack([2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)], axis=1)
    start = np.array([0.0, 0.0, 1.0])
    kept = (start @ along) * along
    across, beyond = start - kept, np.cross(along, start)
    turn = (rate * found.t)[:, None]
    error = np.abs(axis - kept - np.cos(turn) * across - np.sin(turn) * beyond).max()
    assert error < 1e-12


@pytest.mark.parametrize("slow", [1e-9, 1e-7])
def test_rebound_of_a_rod_beside_a_negligible_one(slow):
    """A blow P at one end of a uniform rod slows the other by 2 P / m; about the other it falls with 1.5 g."""
    e, half, radius, fast, short = 0.8, 0.4, 0.1, 0.01, 1e-5
    blow = (1.0 + e) * fast / 4.0  # 1 / m + a^2 / I = 4 / m
    left, right = 2.0 * blow + slow, -fast
    twist = (0.0, 0.5 * (left + right), 0.5 * (right - left) / half)
    rod = Body(Capsule(half, radius), 1.0, half**2 / 3.0, (0.0, radius, 0.0), twist)
    simulation = Simulation(Model(2, [ground(2), rod], (0.0, -G), e, 0.0), Settings.reference(short))
    simulation.advance(1)
    speed, spin = simulation.twist[1, 1:]
    assert abs(speed - half * spin) < SMALL
    assert abs(speed + half * spin - (e * fast - 1.5 * G * short)) < slow


@pytest.mark.parametrize(("e", "speed"), [(0.0, 1.0), (0.5, 1e-8), (0.5, 1.0)])
def test_disc_thrown_into_a_wedge_that_friction_closes(e, speed):
    """Rebounds from both sides at once would need friction beyond its cone; which of them comes first matters."""
    half, radius = 0.2, 0.5
    sides = [
        Body(HalfSpace((side * math.cos(half), math.sin(half))), motion="fixed", pose=(0.0, 0.0, 0.0))
        for side in (1.0, -1.0)
    ]
    place = (0.0, radius / math.sin(half))
    model = Model(2, [*sides, ball(2, place, (0.0, -speed))], (0.0, -G), e, 1.0)
    if e * speed > 1e-6:
        with pytest.raises(NoImpulses):
            record(model, 0.1)
        return
    found = record(model, 0.1)
    assert np.abs(found.pose[:, 2, :2] - place).max() < SMALL
    assert np.abs(found.twist[1:, 2]).max() < SMALL


def test_boxes_of_one_height_on_a_floor():
    """Their corners run along each other's sides until their faces meet; both have gaps of zero there."""
    left, right = box(2, (0.25, 0.25), (0.0, 0.25), (1.0, 0.0)), box(2, (0.25, 0.25), (0.6, 0.25), (0.0, 0.0))
    found = record(Model(2, [ground(2), left, right], (0.0, -G), 1.0, 0.0), 0.5)
    begin = 0.1  # the gap over the speed
    truth = np.minimum(found.t, begin), 0.6 + np.maximum(found.t - begin, 0.0)
    assert np.abs(found.pose[:, 1:, 0].T - truth).max() < SMALL


@pytest.mark.parametrize(("closing", "steps"), [(1, 696), (1, 717), (Fraction(1, 2), 1437)])
def test_ball_between_closing_walls(closing, steps):
    """It goes back and forth ever faster, hundreds of times; here with whole numbers and shares of them."""
    wall, end, x, v, now = Fraction(closing), Fraction(steps, 240), Fraction(1), Fraction(1), Fraction(0)
    while True:
        wait = (Fraction(7, 2) - wall * now - x) / (v + wall) if v > 0 else (x - Fraction(1, 2)) / -v
        if now + wait >= end:
            break
        x, v, now = x + wait * v, -v - 2 * wall if v > 0 else -v, now + wait
    fixed = Body(HalfSpace((1.0, 0.0)), motion="fixed")
    lid = Body(HalfSpace((-1.0, 0.0)), pose=(4.0, 0.0, 0.0), twist=(-float(wall), 0.0, 0.0), motion="prescribed")
    ball = Body(Disc(0.5), 1.0, 0.125, (1.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    found = record(Model(2, [fixed, lid, ball], (0.0, 0.0), 1.0, 0.0), float(end), steps)
    assert abs(found.pose[-1, 2, 0] - float(x + v * (end - now))) < SMALL


@pytest.mark.parametrize("along", [False, True])
def test_ball_in_a_groove_with_a_slow_side(along):
    """It stays on both sides. They brake its spin with mu r (N_1 + N_2) = mu r sqrt(2) m g / (1 + mu^2)."""
    radius, mu, half = 0.5, 0.3, math.sqrt(0.5)
    slow = 1e-3 * half * np.array((-1.0, -1.0) if along else (-1.0, 1.0))  # of the right side, along it or outwards
    sides = [
        Body(HalfSpace((half, half)), motion="fixed"),
        Body(HalfSpace((-half, half)), twist=(*slow, 0.0), motion="prescribed"),
    ]
    place, velocity = np.array((0.0, radius / half)), np.array((0.0, 0.0)) if along else slow
    model = Model(2, [*sides, ball(2, place, velocity, spin=(20.0,))], (0.0, -G), 0.0, mu)
    found = certify(model, Settings.reference(DT), 120)
    assert found.holds
    rate = 2.0 * math.sqrt(2.0) * mu * G / (radius * (1.0 + mu * mu))
    angle = 20.0 * found.t - 0.5 * rate * found.t**2
    truth = np.column_stack([place + velocity * found.t[:, None], angle])
    assert np.abs(found.pose[:, 2] - truth).max() < SMALL


@pytest.mark.parametrize("d", [2, 3])
def test_row_of_capsules_and_a_box_that_collapses(d):
    """If e < 7 - 4 sqrt(3), three equal bodies never cease to collide: they go on together, with the mean velocity."""
    half, radius, aside = 0.3, 0.2, (0.0,) * (d - 1)
    rod, block = Capsule(half, radius), Box((0.4,) * d)
    moment = 0.1 if d == 2 else (0.1,) * 3
    spins = (0.0,) * SPINS[d]
    row = [
        Body(shape, 1.0, moment, (x, *aside, *UPRIGHT[d]), (v, *aside, *spins))
        for shape, x, v in ((rod, 0.0, 1.0), (block, 1.0, 0.0), (rod, 2.0, 0.0))
    ]
    found = certify(Model(d, row, (0.0,) * d, 0.05, 0.0), Settings.reference(DT), 240)
    assert found.holds
    mean = (0.0 + 1.0 + 2.0 + 1.0) / 3.0
    assert np.abs(found.pose[-1, :, 0] - (mean - 0.9, mean, mean + 0.9)).max() < SMALL


def test_three_discs_that_come_to_rest_in_a_corner():
    """Their rebounds accumulate from the floor and from the wall, and end where all touch."""
    radius, lean, wall = 0.3, 0.8, Body(HalfSpace((1.0, 0.0)), motion="fixed")
    discs = [ball(2, (0.4 + 0.9 * k, 0.35 - 0.02 * k), (-0.5, 0.1 * k), 1.0 + k, radius) for k in range(3)]
    gravity = (-G * math.sin(lean), -G * math.cos(lean))
    found = certify(Model(2, [ground(2), wall, *discs], gravity, 0.3, 0.0), Settings.reference(DT), 480)
    assert found.holds
    assert np.abs(found.pose[-1, 2:, :2] - [((1 + 2 * k) * radius, radius) for k in range(3)]).max() < SMALL


def test_slide_of_a_box_that_is_turned_and_boosted():
    lean, mu, speed, boost = 0.7, 0.4, 3.0, np.array((-30.0, 20.0))
    normal, way = np.array((math.sin(lean), math.cos(lean))), np.array((math.cos(lean), -math.sin(lean)))
    floor = Body(HalfSpace(tuple(normal)), twist=(*boost, 0.0), motion="prescribed")
    start = box(2, (0.5, 0.25), tuple(0.25 * normal), tuple(boost + speed * way))
    turned = replace(start, pose=(*start.pose[:2], -lean))
    found = certify(Model(2, [floor, turned], tuple(-G * normal), 0.0, mu), Settings.reference(DT), 240)
    assert found.holds
    t = np.minimum(found.t, speed / (mu * G))[:, None]
    truth = boost * found.t[:, None] + (speed * t - 0.5 * mu * G * t * t) * way + 0.25 * normal
    assert np.abs(found.pose[:, 1, :2] - truth).max() < SMALL


def test_slide_with_a_closing_speed_of_round_off():
    """An edge meets the floor with 2e-10 m/s where the box slides with 2 m/s: no impact without end, and it slides."""
    sliding = box(2, (1.0, 0.25), up(2, 0.25))
    model = Model(2, [ground(2), replace(sliding, twist=(2.0, 1.8e-10, -7.7e-10))], (0.0, -G), 0.0, 0.28)
    end = record(model, 0.5).pose[-1, 1]
    assert np.abs(end - (2.0 * 0.5 - 0.5 * 0.28 * G * 0.25, 0.25, 0.0)).max() < 1e-9
    assert certify(model, Settings.reference(DT), 120).holds


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("mu", [0.1, 0.5])
def test_ball_that_rolls_against_a_wall(d, mu):
    """The wall's friction lifts it: by k/(1 + k) v, which stops the slip v of its front, or by mu (1 + e) v."""
    speed, e, k, radius = 2.0, 0.6, 0.5 if d == 2 else 0.4, 0.5
    aside = (0.0,) * (d - 2)
    wall = Body(HalfSpace((-1.0, *aside, 0.0)), motion="fixed", pose=(1.0, *(0.0,) * (d - 1), *UPRIGHT[d]))
    spin = (-speed / radius,) if d == 2 else (0.0, speed / radius, 0.0)
    bodies = [ground(d), wall, ball(d, up(d, radius), (speed, *(0.0,) * (d - 1)), radius=radius, spin=spin)]
    friction = np.full((3, 3), mu)
    found = record(Model(d, bodies, up(d, -G), e, friction), 0.3)
    rise, back = min(k / (1.0 + k), mu * (1.0 + e)) * speed, e * speed
    t = np.maximum(found.t - 0.5 / speed, 0.0)
    assert t[-1] < 2.0 * rise / G
    truth = np.minimum(speed * found.t, 0.5) - back * t, radius + rise * t - 0.5 * G * t * t * (t > 0.0)
    assert np.abs(found.pose[:, 2, [0, d - 1]].T - truth).max() < SMALL
    left = found.twist[-1, 2, 2 if d == 2 else 4] * (1.0 if d == 2 else -1.0)
    assert abs(left - (rise / (k * radius) - speed / radius)) < SMALL


@pytest.mark.parametrize("d", [2, 3])
def test_plate_on_supports_of_different_restitution(d):
    """It falls flat; over each support it leaves with e of its speed, and the middle with the mean of both."""
    low, high, apart, speed, radius = 0.3, 0.8, 0.6, 2.0, 0.2
    aside = (0.0,) * (d - 2)
    supports = [replace(ball(d, (side * apart, *aside, -radius), radius=radius), motion="fixed") for side in (-1, 1)]
    plate = box(d, (1.0, *(0.5,) * (d - 2), 0.1), up(d, 0.3), up(d, -speed))
    e = np.array([[0.0, 0.0, low], [0.0, 0.0, high], [low, high, 0.0]])
    found = record(Model(d, [*supports, plate], (0.0,) * d, e, 0.0), 0.2, 48)
    after = found.t[-1] - 0.2 / speed
    rise, turn = 0.5 * (low + high) * speed, 0.5 * (high - low) * speed / apart
    axis, sign = (2, 1.0) if d == 2 else (4, -1.0)
    assert abs(found.pose[-1, 2, d - 1] - 0.1 - rise * after) < SMALL
    assert abs(sign * found.twist[-1, 2, axis] - turn) < SMALL


def test_capsule_that_spins_on_its_side():
    """Both ends carry half of its weight and rub against it: w = w_0 - mu m g a t / I, until it stops."""
    half, radius, mu, spin, moment = 0.4, 0.1, 0.3, 5.0, 0.06
    rod = Body(Capsule(half, radius), 1.0, (0.01, moment, moment), (0.0, 0.0, radius, *UPRIGHT[3]), (*(0.0,) * 5, spin))
    found = record(Model(3, [ground(3), rod], up(3, -G), 0.0, mu), 0.5)
    rate = mu * G * half / moment
    t = np.minimum(found.t, spin / rate)
    angle = spin * t - 0.5 * rate * t * t
    assert spin / rate < found.t[-1]
    assert np.abs(found.pose[:, 1, :3] - up(3, radius)).max() < SMALL
    quaternion = np.stack([np.cos(0.5 * angle), 0.0 * t, 0.0 * t, np.sin(0.5 * angle)], axis=1)
    assert np.abs(found.pose[:, 1, 3:] - quaternion).max() < SMALL


@pytest.mark.parametrize("share", [1.0 - 1e-8, 1.0 + 1e-8, 1.5])
def test_disc_that_a_torque_drives(share):
    """Of I = k m r^2, it rolls up to a torque of (1 + k) mu m g r and slips beyond."""
    k, mu, radius = 0.5, 0.4, 0.5
    torque = share * (1.0 + k) * mu * G * radius
    driven = replace(ball(2, up(2, radius), radius=radius), torque=torque)
    found = record(Model(2, [ground(2), driven], up(2, -G), 0.0, mu), 2.0)
    pull = min(share, 1.0) * mu * G  # friction over the mass
    turns = (torque - pull * radius) / (k * radius**2)
    t = found.t[:, None]
    truth = 0.5 * t * t * (-pull, 0.0, turns) + (0.0, radius, 0.0)
    assert np.abs(found.pose[:, 1] - truth).max() < SMALL


def test_board_on_rollers_that_turn_outwards():
    """Friction draws it away from the middle: x'' = mu g x / (d + mu b), with rollers at +-d and the half height b."""
    aside, half, mu, radius, start = 0.8, 0.1, 0.4, 0.3, 0.01
    rollers = [
        Body(Disc(radius), motion="prescribed", pose=(side * aside, -radius, 0.0), twist=(0.0, 0.0, -20.0 * side))
        for side in (-1.0, 1.0)
    ]
    found = record(Model(2, [*rollers, box(2, (3.0, half), (start, half))], up(2, -G), 0.0, mu), 1.0)
    truth = start * np.cosh(math.sqrt(mu * G / (aside + mu * half)) * found.t)
    assert np.abs(found.pose[:, 2, 0] - truth).max() < SMALL
    assert np.abs(found.pose[:, 2, 1] - half).max() < SMALL


@pytest.mark.parametrize("share", [1.0 - 1e-8, 1.0 + 1e-8])
def test_block_on_a_slope_at_the_limit_of_friction(share):
    """It starts at 1e-8 less friction than holds it, and stays at 1e-8 more."""
    lean, time = 0.2, 20.0
    mu = share * math.tan(lean)
    pull = G * math.sin(lean), -G * math.cos(lean)
    found = record(Model(2, [ground(2), box(2, (0.5, 0.2), up(2, 0.2))], pull, 0.0, mu), time, 240)
    truth = 0.5 * max(pull[0] + mu * pull[1], 0.0) * found.t**2
    assert truth[-1] == 0.0 if share > 1.0 else truth[-1] > 1e-6
    assert np.abs(found.pose[:, 1, 0] - truth).max() < 1e-12
