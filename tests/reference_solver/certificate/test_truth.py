"""X bounds what a run is off also where all runs of other steps are off alike."""

from dataclasses import replace

import numpy as np
import pytest

from reference_solver import Body, Box, Disc, HalfSpace, Model, Settings, Simulation, Sphere
from reference_solver.certificate import truth
from reference_solver.certificate.relations import Change
from reference_solver.certificate.truth import certify, distance


def lopsided_ball_between_a_box_and_a_ball():
    """A ball of unequal moments slips along a tilted face and over a fixed ball; one slip passes 2 mm/s as it turns."""
    q, w = (-0.6846740461593407, -0.28860825483740826, 0.6475961161859412, -0.16895560380285649), (0.0,) * 6
    box = Box((0.4363935187051362, 0.19646771016251852, 0.2906611012818231))
    bodies = [
        Body(box, pose=(-0.1358862916905388, 0.06381133589678256, -0.7713232726144083, *q), twist=w, motion="fixed"),
        Body(
            Sphere(0.2202476248077987),
            pose=(0.2824570447127887, -0.35253159831650444, -0.34154508874842937, 1.0, 0.0, 0.0, 0.0),
            motion="fixed",
        ),
        Body(
            Sphere(0.34606815068114544),
            0.7278820005688768,
            (0.02203803261020771, 0.020059730137447083, 0.01014553018010273),
            (0.0, 0.0, 0.0, -0.6578123848631221, 0.21840045873407812, 0.5507686250999153, -0.46501400790834785),
            (-0.08731886226016572, -0.06920952036059536, -0.0007767201432241633)
            + (0.9953379166431144, -0.907204459176377, 1.9393388363500055),
        ),
    ]
    friction = np.zeros((3, 3))
    friction[0, 2] = friction[2, 0] = 0.10257968
    friction[1, 2] = friction[2, 1] = 0.31466296
    gravity = (-3.5865468287202926, -2.87909702476412, -8.66507831282504)
    return Model(3, bodies, gravity, 0.0, friction)


def test_digits_gained_by_a_smaller_tolerance():
    model = lopsided_ball_between_a_box_and_a_ball()
    ends = []
    for tolerance in (1e-12, 1e-8, 1e-5):
        simulation = Simulation(model, Settings.reference(0.005, tolerance))
        simulation.advance(20)
        ends.append(simulation.pose)
    near, far = (float(distance(model, end[None], ends[0][None])[0]) for end in ends[1:])
    assert near < 1e-2 * far


def test_error_of_a_ball_that_spins_fast():
    """On a turntable Ω a ball with the moment k m r² circles at k Ω/(1 + k); its steps end by how far it has turned."""
    k, turning, speed, at, steps = 0.36, 56.0, 20.0, 2.0, 60
    still = (1.0, 0.0, 0.0, 0.0)
    table = Body(
        HalfSpace((0.0, 0.0, 1.0)), pose=(0.0,) * 3 + still, motion="prescribed", twist=(0.0,) * 5 + (turning,)
    )
    ball = Body(Sphere(1.0), 1.0, (k,) * 3, (at, 0.0, 1.0, *still), (speed, 0.0, 0.0, turning * at, speed, 0.0))
    model = Model(3, [table, ball], (0.0, 0.0, -1000.0), 0.0, 20.0)
    found = certify(model, Settings.reference(0.03, 1e-4), steps)
    assert found.holds, found.reasons
    rate = k * turning / (1.0 + k)
    way = speed / rate * np.stack([np.sin(rate * found.t), 1.0 - np.cos(rate * found.t)], axis=1)
    assert (np.linalg.norm(found.pose[:, 1, :2] - (at, 0.0) - way, axis=1) <= found.error).all()


def test_a_tolerance_below_round_off():
    with pytest.raises(ValueError, match="tolerance"):
        Settings.reference(0.01, 1e-13)


def test_refusal_of_another_outcome_far_from_the_origin(monkeypatch):
    """Gravity a millionth stronger there. Where nothing is, round-off is left, of which X has what is due here."""
    floor = Body(HalfSpace((0.0, 1.0)), motion="fixed")
    disc = Body(Disc(0.5), 1.0, 0.125, (0.0, 0.7, 0.0), (1.0, -1.0, 3.0))
    model = Model(2, [floor, disc], (0.0, -9.81), 0.8, 0.1)
    found = certify(model, Settings.reference(1.0 / 240.0), 60)
    assert found.holds

    class Heavier(Change):
        def model(self, old):
            moved = super().model(old)
            return replace(moved, gravity=tuple(1.000001 * g for g in moved.gravity))

    plain = truth.away
    monkeypatch.setattr(truth, "away", lambda model, far: Heavier(2, shift=plain(model, far).shift))
    other = certify(model, Settings.reference(1.0 / 240.0), 60)
    assert not other.holds and "moved by 30 half widths" in other.reasons[0]
    assert ((other.error <= found.error) & (found.error < 1.1 * other.error)).all()


def over_the_edge(d, large, r, v, e, way):
    """A ball that rolls off a table, at whose end a fixed ball of radius ``large`` stands as high as the table."""
    flat, still = ((0.0,), (0.0,)) if d == 2 else ((1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0))

    def at(x, up):
        return (x, up) if d == 2 else (x, 0.0, up)

    table = Body(Box(at(2.0, 0.5) if d == 2 else (2.0, 1.0, 0.5)), pose=at(-2.0, -0.5) + flat, motion="fixed")
    ball, inertia = (Disc, 0.5 * r * r) if d == 2 else (Sphere, (0.4 * r * r,) * 3)
    spin = (-v / r,) if d == 2 else (0.0, v / r, 0.0)
    below = Body(ball(large), pose=at(0.0, -large) + flat, twist=at(0.0, 0.0) + still, motion="fixed")
    bodies = [table, below, Body(ball(r), 1.0, inertia, at(-way, r) + flat, at(v, 0.0) + spin)]
    return Model(d, bodies, at(0.0, -9.81), e, 0.5)


@pytest.mark.parametrize(
    ("d", "large", "r", "v", "e", "rate"),
    [
        (2, 2.0, 0.05, 9.0, 0.4, 240),
        (2, 0.3, 0.1, 5.0, 0.7, 500),
        (2, 4.0, 0.5, 25.0, 0.2, 120),
        (2, 1.0, 0.3, 5.5, 0.0, 250),
        (3, 2.0, 0.1, 9.0, 0.6, 240),
        (3, 1.0, 0.02, 10.0, 0.5, 240),
    ],
)
def test_error_of_a_ball_that_flies_off_an_edge(d, large, r, v, e, rate):
    """Faster than sqrt(g (R + r)) it leaves both at once. What meets within a gap that counts as none is in X."""
    way = 0.61
    model, left = over_the_edge(d, large, r, v, e, way), way / v
    found = certify(model, Settings.reference(1.0 / rate), int((left + 0.08) * rate))
    assert found.holds, found.reasons
    flown = np.maximum(found.t - left, 0.0)
    off = np.hypot(found.pose[:, 2, 0] + way - v * found.t, found.pose[:, 2, d - 1] - r + 0.5 * 9.81 * flown**2)
    within = found.t < found.horizon
    assert within[found.t < left].all()
    assert (off <= found.error)[within].all()
    assert found.error[within].max() < 1e-4 * r


def test_error_of_bodies_that_meet_by_round_off(monkeypatch):
    """Planted: X without it is too small where a ball flies off an edge."""
    way, v, r, rate = 0.93, 10.0, 0.02, 240
    model, left = over_the_edge(2, 1.0, r, v, 0.5, way), way / v
    monkeypatch.setattr(truth, "grazes", lambda model, record, dt, noise, growth: np.zeros(len(record.t)))
    found = certify(model, Settings.reference(1.0 / rate), int((left + 0.1) * rate))
    flown = np.maximum(found.t - left, 0.0)
    off = np.abs(found.pose[:, 2, 1] - r + 0.5 * 9.81 * flown**2)
    assert (off > found.error).any()


@pytest.mark.parametrize("shift", [(300.0, -70.0), (1000.0, 1000.0)])
def test_error_of_bodies_that_meet_across_a_rounded_gap(shift):
    """Gaps count as none up to their round-off, which is that of the place."""
    way, v, r, rate = 0.93, 10.0, 0.02, 240
    model, left = Change(2, shift=shift).model(over_the_edge(2, 1.0, r, v, 0.5, way)), way / v
    found = certify(model, Settings.reference(1.0 / rate), int((left + 0.1) * rate))
    flown = np.maximum(found.t - left, 0.0)
    off = np.abs(found.pose[:, 2, 1] - shift[1] - r + 0.5 * 9.81 * flown**2)
    assert not found.holds or (off <= found.error)[found.t < found.horizon].all()


@pytest.mark.parametrize("place", [(20476.0, -3055.0), (17098.0, -20320.0), (23677.0, -16002.0)])
def test_error_of_bounces_far_from_the_origin(place):
    """Each of them is met some units of the coordinates late. All numbers of the start are exact."""
    up, angle, g, e = np.array([-0.8, 0.6]), np.arctan2(0.8, 0.6), 9.81, 0.9
    floor = Body(HalfSpace((0.0, 1.0)), motion="fixed", pose=(*place, angle))
    ball = Body(Disc(0.25), 1.0, 0.03125, (place[0] - 1.0, place[1] + 0.75, 0.0))

    def height(t):
        here, v = 1.0, 0.0
        while t > (flight := (v + np.sqrt(v * v + 2.0 * g * here)) / g):
            here, v, t = 0.0, e * (g * flight - v), t - flight
        return here + v * t - 0.5 * g * t * t

    found = certify(Model(2, [floor, ball], tuple(-g * up), e, 0.0), Settings.reference(1.0 / 60.0), 180, 5)
    off = np.abs((found.pose[:, 1, :2] - place) @ up - 0.25 - [height(t) for t in found.t])
    assert found.holds and (off <= found.error).all()


def test_certificate_of_a_world_without_free_bodies():
    still = Body(Disc(0.1), pose=(0.0, 0.0, 0.0), twist=(1.0, 0.0, 0.0), motion="prescribed")
    assert certify(Model(2, [still], (0.0, 0.0), 0.0, 0.0), Settings.reference(0.01), 5).holds
