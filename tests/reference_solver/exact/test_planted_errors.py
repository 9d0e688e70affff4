"""Errors that are planted in the loop are seen by the certificate, or its error covers them."""

from dataclasses import replace

import numpy as np
import pytest

from reference_solver import Body, Box, Capsule, Disc, HalfSpace, Model, Settings, Simulation, Sphere
from reference_solver.certificate.truth import certify, distance
from reference_solver.exact import Refused, events, forces, impacts, loop, motion, record, rows, series, stiff, world
from reference_solver.exact.cones import NoSolution

DT, G = 1 / 240, 9.81
FLOOR = Body(HalfSpace((0.0, 1.0)), motion="fixed")
UPRIGHT = (1.0, 0.0, 0.0, 0.0)
GROUND = Body(HalfSpace((0.0, 0.0, 1.0)), pose=(0.0, 0.0, 0.0, *UPRIGHT), motion="fixed")
#: Share by which something is planted wrong.
SIZE = 1e-6


#: Two discs that graze: one goes through the other by 6e-7 of its radius.
GRAZE = Model(
    2,
    [
        Body(Disc(0.5), 1.0, 0.125, (-1.0, 0.0, 0.0), (4.0, 0.0, 0.0)),
        Body(Disc(0.5), 1.0, 0.125, (0.0, 1.0 - 3e-7, 0.0)),
    ],
    (0.0, 0.0),
    0.5,
    0.0,
)


def planar(body, restitution=0.0, friction=0.5, floor=FLOOR):
    return Model(2, [floor, body], (0.0, -G), restitution, friction)


def spatial(body, restitution=0.0, friction=0.5, floor=GROUND):
    return Model(3, [floor, body], (0.0, 0.0, -G), restitution, friction)


BOUNCE = planar(Body(Disc(0.5), 1.0, 0.125, (0.0, 0.7, 0.0), (1.0, -1.0, 3.0)), 0.8, 0.1)
FAR = planar(Body(Disc(0.5), 1.0, 0.125, (30.0, 0.7, 0.0), (1.0, -1.0, 0.0)), 0.8, 0.0)
LANDS = planar(Body(Box((0.5, 0.5)), 1.0, 1 / 6, (0.0, 0.6, 0.0), (0.5, 0.0, 0.0)))
SLIDES = planar(Body(Box((0.5, 0.25)), 1.0, 0.1, (0.0, 0.25, 0.0), (0.5, 0.0, 0.0)))
FALLS = planar(Body(Capsule(0.4, 0.1), 1.0, 0.06, (0.0, 0.1 + 0.4 * np.sin(1.2), 1.2)), friction=3.0)
HILL = planar(
    Body(Disc(0.25), 1.0, 0.03125, (0.0, 1.25, 0.0), (1.0, 0.0, 0.0)),
    friction=0.2,
    floor=Body(Disc(1.0), motion="fixed"),
)
#: Faster: it leaves the hill.
FLIES = replace(HILL, bodies=[HILL.bodies[0], replace(HILL.bodies[1], twist=(2.5, 0.0, 0.0))])
TABLE = planar(
    Body(Disc(0.25), 1.0, 0.03125, (0.3, 0.75, 0.0), (1.0, 0.0, -4.0)), floor=Body(Box((0.5, 0.5)), motion="fixed")
)
LADDER = Model(
    2,
    [
        FLOOR,
        Body(HalfSpace((1.0, 0.0)), motion="fixed"),
        Body(Capsule(0.5, 0.05), 1.0, 0.1, (0.05 + 0.5 * np.cos(1.1), 0.05 + 0.5 * np.sin(1.1), np.pi - 1.1)),
    ],
    (0.0, -G),
    0.0,
    0.1,
)
TUMBLES = spatial(
    Body(
        Box((0.3, 0.2, 0.1)),
        1.0,
        (0.05 / 3, 0.1 / 3, 0.13 / 3),
        (0.0, 0.0, 3.0, *UPRIGHT),
        (0.0,) * 3 + (2.0, -1.0, 1.0),
        torque=(0.02, 0.01, -0.01),
    )
)
SUMMIT = spatial(
    Body(Sphere(0.25), 1.0, (0.025,) * 3, (0.05, 0.0, 1.25, *UPRIGHT), (0.8, 0.3, 0.0, 0.0, 0.0, 0.0)),
    friction=0.2,
    floor=Body(Sphere(1.0), motion="fixed", pose=(0.0, 0.0, 0.0, *UPRIGHT)),
)
ROD = spatial(
    Body(Capsule(0.3, 0.1), 1.0, (0.01, 0.04, 0.04), (0.0, 0.0, 0.1, *UPRIGHT), (0.0, 1.0, 0.0, 0.0, 0.0, 0.0)),
    friction=0.2,
)
TURNS = spatial(Body(Sphere(0.5), 1.0, (0.1,) * 3, (0.0, 0.0, 0.5, *UPRIGHT), (1.0, 0.5, 0.0, 2.0, 0.0, 1.0)), 0.0, 0.1)


def of_world(field, change):
    """Change what the loop reads of its world, or of its bodies."""

    def plant(monkeypatch):
        def wrong(model):
            found = world_of(model)
            if hasattr(found.bodies, field):
                return replace(found, bodies=found.bodies._replace(**{field: change(getattr(found.bodies, field))}))
            return replace(found, **{field: change(getattr(found, field))})

        world_of = world.world_of
        monkeypatch.setattr(world, "world_of", wrong)

    return plant


def larger(values):
    return values * (1.0 + SIZE)


def impulse(monkeypatch):
    """Impulses that are too large, in the record as in the motion."""

    def wrong(state, part, stopped):
        blow = struck(state, part, stopped)
        velocity = state.velocity + (1.0 + SIZE) * (blow.after.velocity - state.velocity)
        acting = blow.acting._replace(impulse=larger(blow.acting.impulse), moment=larger(blow.acting.moment))
        return replace(blow, after=replace(blow.after, velocity=velocity), acting=acting)

    struck = impacts._struck
    monkeypatch.setattr(impacts, "_struck", wrong)


def missed_contact(monkeypatch):
    find = rows.find
    monkeypatch.setattr(rows, "find", lambda *asked: find(*asked)[:1])


def missed_body(monkeypatch):
    """Nothing meets the disc before it is a hundredth of a half width deep."""
    meeting = events.next_meeting
    monkeypatch.setattr(events, "next_meeting", lambda *asked: (2.0, meeting(*asked)[1]))


def accelerations(change):
    """Change accelerations (n, q) of free bodies that nothing touches, given those and twists (n, q)."""

    def plant(monkeypatch):
        def wrong(world, axes, velocity):
            found = free(world, axes, velocity)
            turns = np.arange(found.shape[1]) >= world.dimension
            found[:] = np.where((world.bodies.free == 1)[:, None], change(found, velocity, turns), found)
            return found

        free = motion.free_acceleration
        for module in (motion, loop, events, series, impacts, record):
            monkeypatch.setattr(module, "free_acceleration", wrong)

    return plant


gyroscopic = accelerations(lambda found, velocity, turns: np.where(turns, found * (1.0 - SIZE), found))
drag = accelerations(lambda found, velocity, turns: np.where(turns, found, found - SIZE * velocity))
braked_spin = accelerations(lambda found, velocity, turns: np.where(turns, found - SIZE * velocity, found))


def late_impact(monkeypatch):
    def wrong(world, piece, *asked):
        share, stopped = meeting(world, piece, *asked)
        return share + SIZE * DT / piece.length, stopped

    meeting = events.next_meeting
    monkeypatch.setattr(events, "next_meeting", wrong)


def slip_direction(monkeypatch):
    def wrong(self, contacts):
        found = onward(self, contacts)
        return found + SIZE * np.stack([-found[:, 1], found[:, 0]], axis=1)

    onward = forces.Held.onward
    monkeypatch.setattr(forces.Held, "onward", wrong)


def rate_of_rows(monkeypatch):
    """What contacts do by turning alone (gamma, E36) is left out in part."""

    def wrong(self, *state):
        found = at(self, *state)
        found.rows.rate[:] *= 1.0 - 100.0 * SIZE
        return found

    at = rows.Contacts.at
    monkeypatch.setattr(rows.Contacts, "at", wrong)


def lever(recorded):
    """Levers of contacts are off along the floor, by a share of the radius; so are recorded places, or moments only."""

    def plant(monkeypatch):
        def wrong(self, *state):
            found = at(self, *state)
            known, aside = found.rows, 0.5 * SIZE
            known.place[:] += aside * known.frame[:, 1] * recorded
            for side, arm in enumerate((aside, -aside)):
                body = found.features[:, side]
                known.row[:, 0, side, 2] += arm
                known.yields[:, 0, side, 2] += arm / found.world.bodies.moment[body, 0]
                known.speed[:, 0] += arm * state[2][body, 2]
            return found

        def of(contacts, impulse):
            acting, aside = whole(contacts, impulse), 0.5 * SIZE * contacts.rows.frame[:, 1]
            return acting if recorded else acting._replace(moment=rows.moments(acting.point + aside, impulse))

        at, whole = rows.Contacts.at, record.Acting.of
        monkeypatch.setattr(rows.Contacts, "at", wrong)
        monkeypatch.setattr(record.Acting, "of", of)

    return plant


def rates_of_ways(columns):
    """Ways in Runge-Kutta steps that are too long for their velocities, or turns for their spins."""

    def plant(monkeypatch):
        def wrong(self, *asked):
            rate, *others = after(self, *asked)
            rate[:, columns] *= 1.0 + SIZE
            return rate, *others

        after = motion.Turning.after
        monkeypatch.setattr(motion.Turning, "after", wrong)

    return plant


def without_end(column):
    """An end that is not looked for: of a slide (0), of a load (1), of a feature (-1)."""

    def plant(monkeypatch):
        def wrong(self, share):
            found = call(self, share)
            if column < 0:
                found[:, : self.width] = np.inf
            else:
                found[:, self.width + column] = np.inf
            return found

        call = events.Monitors.__call__
        monkeypatch.setattr(events.Monitors, "__call__", wrong)

    return plant


def rough_steps(monkeypatch):
    """Steps whose errors are a hundred thousand times what is asked for."""
    step = stiff.step
    monkeypatch.setattr(loop, "step", lambda w, s, h, tolerance, length: step(w, s, h, 1e5 * tolerance, length))


def forces_of_a_step(monkeypatch):
    """Runge-Kutta steps with accelerations that are too large."""
    follow = forces.Held.follow

    def wrong(self, place, axes, velocity, free, directions=None):
        forces, acceleration = follow(self, place, axes, velocity, free, directions)
        return forces, free + (1.0 + SIZE) * (acceleration - free)

    monkeypatch.setattr(forces.Held, "follow", wrong)


PLANTED = {
    "inertia": (BOUNCE, of_world("moment", larger)),
    "inertia of a rod that falls": (FALLS, of_world("moment", larger)),
    "inertia of a ball that slides": (TURNS, of_world("moment", larger)),
    "mass": (FALLS, of_world("inverse_mass", larger)),
    "gravity": (BOUNCE, of_world("load", larger)),
    "friction of a slide": (SLIDES, of_world("friction", larger)),
    "friction of a slide over a hill": (HILL, of_world("friction", larger)),
    "friction of a slide in space": (TURNS, of_world("friction", larger)),
    "friction of a ladder that slides": (LADDER, of_world("friction", larger)),
    "friction of a rod that lies and slips": (ROD, of_world("friction", larger)),
    "restitution": (BOUNCE, of_world("restitution", larger)),
    "impulse": (BOUNCE, impulse),
    "contact that is missed": (LANDS, missed_contact),
    "body that is missed": (BOUNCE, missed_body),
    "bodies that graze and are missed": (GRAZE, missed_body),
    "gyroscopic terms": (TUMBLES, gyroscopic),
    "torque": (TUMBLES, of_world("torque", larger)),
    "drag": (TUMBLES, drag),
    "spin that is braked": (BOUNCE, braked_spin),
    "time of an impact": (BOUNCE, late_impact),
    "direction of a slip": (TURNS, slip_direction),
    "direction of a slip over a hill": (SUMMIT, slip_direction),
    "direction of a slip of a rod that lies": (ROD, slip_direction),
    "rate of rows": (FALLS, rate_of_rows),
    "place of a contact": (BOUNCE, lever(recorded=True)),
    "lever of a contact far from the origin": (FAR, lever(recorded=False)),
    "accelerations of a step": (FALLS, forces_of_a_step),
    "ways of a step": (TURNS, rates_of_ways(slice(0, 3))),
    "turns of a step": (HILL, rates_of_ways(slice(2, None))),
    "end of a slide": (SLIDES, without_end(0)),
    "end of a load": (FLIES, without_end(1)),
    "end of a feature": (TABLE, without_end(-1)),
    "tolerance of steps": (FALLS, rough_steps),
}


@pytest.mark.parametrize("size", [1e-6, 1e-8])
@pytest.mark.parametrize("name", PLANTED)
def test_planted_error_is_seen_or_covered(name, size, monkeypatch):
    model, plant = PLANTED[name]
    monkeypatch.setitem(globals(), "SIZE", size)
    truth = Simulation(model, Settings.reference(DT, 1e-12)).record(100).pose
    plant(monkeypatch)
    found = certify(model, Settings.reference(DT), 100)
    if found.holds:
        within = (found.t < found.horizon) & (found.t > 2.0 * DT)  # forces are not told in the first pieces of a motion
        assert (distance(model, found.pose, truth) <= found.error)[within].all()


@pytest.mark.parametrize("name", PLANTED)
def test_bound_without_error_is_a_tenth_of_what_the_error_moves(name, monkeypatch):
    """Each error of a millionth has an effect, and the run without it is certified to far less."""
    model, plant = PLANTED[name]
    right = certify(model, Settings.reference(DT), 100)
    assert right.holds, right.reasons
    plant(monkeypatch)
    try:
        pose = Simulation(model, Settings.reference(DT)).record(100).pose
    except Refused:
        return
    within = right.t < right.horizon
    assert 10.0 * right.error[within].max() < distance(model, pose, right.pose)[within].max()


@pytest.mark.parametrize("gap", [4e-14, 4e-12])
@pytest.mark.parametrize("pull", [0.0, G])
@pytest.mark.parametrize("small", [0.5, 0.01])
def test_gap_of_a_joint_blow(small, pull, gap):
    """A disc meets the floor and, a gap later, the wall; what is moved along one moves no other.

    Gaps that are none go by the bodies that meet: a smaller one elsewhere changes none of them.
    """
    wall = Body(HalfSpace((1.0, 0.0)), motion="fixed")
    disc = Body(Disc(0.5), 1.0, 0.125, (0.5987 + gap, 0.5987, 0.0), (-1.0, -1.0, 0.0))
    other = Body(Disc(small), 1.0, 0.5 * small**2, (3.0, 3.0, 0.0))
    both, alone = (Model(2, [*those, other, disc], (-pull, -pull), 0.5, 0.0) for those in ([FLOOR, wall], [wall]))
    found = certify(both, Settings.reference(DT), 48)
    truth = Simulation(alone, Settings.reference(DT)).record(48).pose[:, -1, 0]
    assert found.holds, found.reasons
    off = np.abs(found.pose[:, -1, 0] - truth)
    is_none = gap < 5e-14  # a ten-trillionth of the radius
    assert (gap < off.max() < 1e-12 if is_none else off.max() < 1e-14) and found.error[-1] < 1e-9
    assert (off <= found.error).all()


def rod(spin, friction):
    """A thin rod that is pushed along the floor, 30 degrees from upright and its lower end ahead; it stays down."""
    wide, long = 0.1, 5.0
    a, b = 0.5 * long - np.sqrt(0.75) * wide, np.sqrt(0.75) * long + 0.5 * wide
    body = Body(Box((wide, long)), 1.0, (wide**2 + long**2) / 3.0, (0.0, b, np.pi / 6), (6.0, -spin * a, spin))
    return planar(body, friction=friction)


def test_single_motion_without_sliding():
    """Beyond a friction of (i^2 + a^2)/(a b) = 1.34 an impulse stops the end, and no forces would hold it up."""
    found = certify(rod(0.0, 1.6), Settings.reference(DT), 12)
    assert found.holds and not found.several and not found.unique, found.reasons


def test_jam_where_forces_exist_seen(monkeypatch):
    decide, calls = loop.decide, []

    def none_at_first(*asked):
        calls.append(asked)
        if len(calls) == 1:
            raise NoSolution
        return decide(*asked)

    monkeypatch.setattr(loop, "decide", none_at_first)
    found = certify(rod(2.0, 1.6), Settings.reference(DT), 12)
    assert found.several and found.determined == 0.0 and "go on as they are, or jam" in found.unique


def test_refused_run_has_no_certificate():
    roof = Body(HalfSpace((0.0, -1.0), -0.5), motion="prescribed", twist=(0.0, -1.0, 0.0))
    model = Model(2, [FLOOR, roof, Body(Disc(0.2), 1.0, 0.02, (0.0, 0.25, 0.0))], (0.0, -G), 0.0, 0.0)
    with pytest.raises(Refused):
        Simulation(model, Settings.reference(DT)).advance(240)
    found = certify(model, Settings.reference(DT), 240)
    assert not found.holds and "crushed" in found.reasons[0] and np.isinf(found.error).all()
