"""Ends of series of rebounds (E22) against each rebound: what they leave out is covered by X."""

import math
from decimal import Decimal, localcontext

import numpy as np
import pytest

from reference_solver import Body, Box, Disc, HalfSpace, Model, Settings, Sphere
from reference_solver.certificate.truth import certify

G = 9.81


def bounced(height, speed, spin, radius, share, e, mu, slope, times):
    """Return where (s,) along a slope a bouncing disc is at each time, with 40 digits [m].

    Friction takes the slip at an impact, or mu times its impulse, and nothing in flight. Slips end before bounces do.
    """
    with localcontext() as context:
        context.prec = 40
        e, mu, share, r = Decimal(e), Decimal(mu), Decimal(share), Decimal(radius)
        along, down = Decimal(G) * Decimal(math.sin(slope)), Decimal(G) * Decimal(math.cos(slope))
        x, v, w, u, h, now = Decimal(0), Decimal(speed), Decimal(spin), Decimal(0), Decimal(height), Decimal(0)
        places, resting = [], False
        for t in map(Decimal, times):
            while not resting:
                flight = (u + (u * u + 2 * down * h).sqrt()) / down
                if now + flight > t:
                    break
                x, v, now, h = (
                    x + v * flight + along * flight * flight / 2,
                    v + along * flight,
                    now + flight,
                    Decimal(0),
                )
                hits, slip = down * flight - u, v - r * w
                u = e * hits
                push = min(abs(slip) * share / (1 + share), mu * (1 + e) * hits).copy_sign(-slip)
                v, w = v + push, w - push / (share * r)
                resting = u < Decimal("1e-25")
            since = t - now
            acceleration = along / (1 + share) if resting else along
            places.append(float(x + v * since + acceleration * since * since / 2))
        return np.array(places)


@pytest.mark.parametrize("rate", [60, 240, 1000])
@pytest.mark.parametrize("e", [0.3, 0.7, 0.9])
def test_error_by_friction_at_rebounds_of_a_disc(e, rate):
    """Held, it is rubbed all along; bouncing at its impacts only: up to 1e-11 of its radius apart."""
    radius, share, slope, mu, steps = 0.8, 0.9, 0.1, 1.0, int(0.6 * rate)
    floor = Body(HalfSpace((0.0, 1.0)), motion="fixed")
    ball = Body(Disc(radius), 2.0, share * 2.0 * radius**2, (0.0, radius + 0.004, 0.0), (0.1, 0.0, 0.05))
    gravity = (G * math.sin(slope), -G * math.cos(slope))
    found = certify(Model(2, [floor, ball], gravity, e, mu), Settings.reference(1.0 / rate), steps)
    truth = bounced(0.004, 0.1, -0.05, radius, share, e, mu, slope, [k / rate for k in range(steps + 1)])
    assert found.holds, found.reasons
    assert (np.abs(found.pose[:, 1, 0] - truth) <= found.error + 2e-15).all()
    assert found.error[-1] <= 1e-9


@pytest.mark.parametrize("early", [5e-4, 1e-3])
def test_series_that_ends_before_a_step_of_all_runs(early):
    """The last rebound leaves a slip of 5e-7 m/s: what takes it out evenly until .5 s would do so in all runs."""
    radius, share, slope, mu, e, ends = 0.32, 0.37, 0.3625, 0.17, 0.39, 0.5
    down = G * math.cos(slope)
    drop = 0.5 * down * ((ends - early) * (1.0 - e) / (1.0 + e)) ** 2
    ball = Body(Disc(radius), 1.0, share * radius**2, (0.0, radius + drop, 0.0))
    gravity = (G * math.sin(slope), -down)
    found = certify(
        Model(2, [Body(HalfSpace((0.0, 1.0)), motion="fixed"), ball], gravity, e, mu), Settings.reference(1 / 60), 45
    )
    truth = bounced(drop, 0.0, 0.0, radius, share, e, mu, slope, [k / 60 for k in range(46)])
    off = np.abs(found.pose[:, 1, 0] - truth)
    assert found.holds, found.reasons
    assert (off <= found.error + 2e-15).all()
    assert found.error[-1] < 1e-8


@pytest.mark.parametrize("share", [0.05, 0.5, 0.95])
@pytest.mark.parametrize(("d", "yields"), [(2, 3.0), (3, 3.5)])
@pytest.mark.parametrize(("e", "rate"), [(0.2, 60), (0.5, 240), (0.7, 1000)])
def test_slip_that_a_blow_ends_before_a_short_series(e, rate, d, yields, share):
    """A blow of (1 + e) m v takes more slip than one of m v: with that much slip the ball rolls at once, by law."""
    radius, mu = 0.1, 0.6
    v = (1.0 - e) * G / (12.0 * e * rate)  # all rebounds are over in a sixth of a step
    slip = yields * mu * v * (1.0 + share * e)
    up = (0.0,) * (d - 1) + (1.0,)
    ball, inertia = (Disc, 0.5 * radius**2) if d == 2 else (Sphere, (0.4 * radius**2,) * 3)
    flat, still = ((0.0,), (0.0,)) if d == 2 else ((1.0, 0.0, 0.0, 0.0), (0.0,) * 3)
    floor = Body(HalfSpace(up), pose=(0.0,) * d + flat, motion="fixed")
    moving = (slip, *(-v * x for x in up[1:]))
    body = Body(ball(radius), 1.0, inertia, tuple(radius * x for x in up) + flat, moving + still)
    model = Model(d, [floor, body], tuple(-G * x for x in up), e, mu)
    found = certify(model, Settings.reference(1.0 / rate), 20)
    assert found.holds, found.reasons
    rolls = slip * (1.0 - 1.0 / yields)
    assert (np.abs(found.pose[:, 1, 0] - rolls * found.t) <= found.error).all()
    assert found.error[-1] < 1e-10


@pytest.mark.parametrize(("e", "part"), [(0.05, 0.05), (0.3, 0.01), (0.3, 0.05), (0.6, 0.02)])
def test_slip_that_a_blow_ends_elsewhere(e, part):
    """A ball lands on a block that slides: its blow presses the block on the floor, and stops it at once, by law.

    All rebounds are over in a ``part`` of a step; held, they would stop the block as much later.
    """
    dt, mu, light, heavy = 1.0 / 60.0, 0.4, 0.5, 1.0
    v = (1.0 - e) * G * dt * part / (2.0 * e)
    slip = mu * heavy * v * (1.0 + 0.9 * e) / light
    friction, restitution = np.zeros((3, 3)), np.zeros((3, 3))
    friction[0, 1] = friction[1, 0] = mu
    restitution[1, 2] = restitution[2, 1] = e
    block = Body(Box((0.5, 0.05)), light, light * 0.2525 / 3.0, (0.0, 0.05, 0.0), (slip, 0.0, 0.0))
    ball = Body(Disc(0.1), heavy, 0.005, (0.0, 0.2, 0.0), (0.0, -v, 0.0))
    floor = Body(HalfSpace((0.0, 1.0)), motion="fixed")
    found = certify(Model(2, [floor, block, ball], (0.0, -G), restitution, friction), Settings.reference(dt), 20)
    assert found.holds, found.reasons
    assert (np.abs(found.pose[:, 1, 0]) <= found.error + 1e-15).all()
    assert found.error[-1] < 1e-10
