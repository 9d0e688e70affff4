"""Where the laws have two answers the certificate ends there, and says which contacts; where they have one it does not.

Truth: enumeration of all modes of a rod between a floor and a wall (`exact_contact`), whose problem is set up here.
"""

import math
from dataclasses import replace
from importlib import import_module

import numpy as np
import pytest
from scipy.optimize import linprog

from reference_solver import Body, Box, Capsule, Disc, HalfSpace, Model, Polygon, Settings, Simulation, Sphere
from reference_solver.certificate.audit import Answers, answers
from reference_solver.certificate.audit.rolling import accelerations
from reference_solver.certificate.audit.run import Run
from reference_solver.certificate.relations import Change
from reference_solver.certificate.truth import certify
from reference_solver.exact_contact import coulomb_solutions
from reference_solver.geometry import gap
from tests.verification.fuzz.scenes import scene

DT, G = 1.0 / 240.0, 9.81
UPRIGHT = (1.0, 0.0, 0.0, 0.0)
FLOOR, WALL = (Body(HalfSpace(n), motion="fixed") for n in ((0.0, 1.0), (1.0, 0.0)))
HALF, RADIUS = 0.5, 0.05


def axes(normal):
    return normal, (-normal[1], normal[0])


def ladder(seed, kind):
    """A rod on floor and wall that is struck, slides or rests, and how many answers it has; None if it leaves one."""
    rng = np.random.default_rng(seed)
    angle, friction, inertia = rng.uniform(0.1, 1.4), rng.uniform(0.1, 2.5, 2), HALF**2 * rng.uniform(0.05, 1.0)
    c, s = HALF * math.cos(angle), HALF * math.sin(angle)
    feet, normals = ((c, -s - RADIUS), (-c - RADIUS, s)), ((0.0, 1.0), (1.0, 0.0))
    ends = zip(feet, normals, strict=True)
    rows = np.array([(*n, x * n[1] - y * n[0]) for (x, y), normal in ends for n in axes(normal)])
    inverse, load, twist, e = np.array([1.0, 1.0, 1.0 / inertia]), np.zeros(3), np.zeros(3), 0.0
    if kind == "struck":
        twist, e = rng.uniform(-1.0, 1.0, 3) * (2.0, 2.0, 6.0), float(rng.choice([0.0, 0.5]))
        free = rows @ twist
        if (free[::2] >= 0.0).any():
            return None
        sliding, free[::2] = None, (1.0 + e) * free[::2]
    else:
        load = rng.uniform(-1.0, 1.0, 3) * (30.0, 30.0, 10.0)
        free = rows @ (inverse * load)
        sliding = [0.0, 0.0]
        if kind == "slides":
            w = rng.uniform(0.5, 4.0) * rng.choice([-1.0, 1.0])
            twist = np.array([feet[1][1], -feet[0][0], 1.0]) * w
            sliding = list(np.sign((rows @ twist)[1::2]))
            free[::2] += w * w * np.array([s, c])  # the ends of the core turn about the centre
    found = coulomb_solutions(rows * inverse @ rows.T, free, friction, sliding)
    table = np.zeros((3, 3))
    table[2, :2] = table[:2, 2] = friction
    pose = (c + RADIUS, s + RADIUS, -angle)
    rod = Body(Capsule(HALF, RADIUS), 1.0, inertia, pose, tuple(twist), force=tuple(load[:2]), torque=load[2])
    return len(found), Model(2, [FLOOR, WALL, rod], (0.0, 0.0), e, table)


def searched(model, steps=1, dt=DT):
    return answers(model, Simulation(model, Settings.reference(dt)).record(steps, pieces=True), dt)


@pytest.mark.parametrize("kind", ["struck", "slides", "rests"])
def test_rods_with_two_answers_and_with_one(kind):
    counts = {1: 0, 2: 0}
    for seed in range(6000):
        drawn = ladder(seed, kind)
        if drawn is None or not drawn[0] or counts[min(drawn[0], 2)] >= 15:
            continue
        counts[min(drawn[0], 2)] += 1
        found = searched(drawn[1])
        assert np.isinf(found.unsearched) and (found.begin <= 1e-12) is (drawn[0] > 1), (seed, drawn[0], found)
        if min(counts.values()) == 15:
            break
    assert min(counts.values()) == 15


def test_certified_time_of_rods_with_two_answers():
    """One of each kind; the reason and the verdict in one line say from when, and who may do what."""
    for kind in ("struck", "slides", "rests"):
        model = next(drawn[1] for seed in range(4000) if (drawn := ladder(seed, kind)) and drawn[0] > 1)
        found = certify(model, Settings.reference(DT), 6)
        assert found.determined == 0.0 and found.horizon == found.t[1] and np.isinf(found.error_until(DT))
        assert found.unique in found.reasons and f"{found.unique!r}" in repr(found)
        assert found.unique.startswith("two motions obey the laws from 0 s: bodies ") and " may " in found.unique


def slot(**motion):
    """A rod across a slot that turns and moves with it: within the cones, it might be wedged, or fall."""
    a = HALF * math.cos(0.2) + RADIUS
    walls = [Body(HalfSpace(n), pose=(x, 0.0, 0.0), **motion) for n, x in (((1.0, 0.0), -a), ((-1.0, 0.0), a))]
    rod = Body(Capsule(HALF, RADIUS), 1.0, 0.1, (0.0, 0.0, 0.2), motion.get("twist"))
    return Model(2, [*walls, rod], (0.0, -G), 0.0, 1.0)


FRAMES = [(0.0, 1e-6, 0.0), (0.0, 1.0, 0.0), (0.5, 0.0, 0.0), (-3.0, 20.0, 0.0)]


@pytest.mark.parametrize("twist", [None, *FRAMES])
def test_rod_wedged_in_a_moving_slot(twist):
    model = slot(motion="fixed") if twist is None else slot(motion="prescribed", twist=twist)
    assert searched(model, 4).begin == 0.0
    assert np.isinf(searched(replace(model, friction=0.1), 4).begin)


@pytest.mark.parametrize("frame", [(0.0, 0.0), (-3.0, 20.0)])
@pytest.mark.parametrize("spin", [-2.0, 0.5])
def test_rod_wedged_in_a_turning_slot(spin, frame):
    """About a point 1.5 m up the slot: forces within the cones hold the rod on its circle, or none press it."""
    half, up = HALF * math.cos(0.2) + RADIUS, 1.5
    twist = (*frame, spin)
    walls = [
        Body(HalfSpace((x, 0.0), -half), pose=(0.0, up, 0.0), motion="prescribed", twist=twist) for x in (1.0, -1.0)
    ]
    rod = Body(Capsule(HALF, RADIUS), 1.0, 0.1, (0.0, 0.0, 0.2), (frame[0] + spin * up, frame[1], spin))
    for friction, two in ((1.0, True), (0.1, False)):
        assert (searched(Model(2, [*walls, rod], (0.0, 0.0), 0.0, friction)).begin == 0.0) is two


@pytest.mark.parametrize(
    ("angle", "mu", "v", "w"), [(0.9, 3.0, 1.0, 4.0), (0.9, 2.0, 1.0, 5.0), (1.0, 1.6, 2.0, 5.0), (1.05, 1.5, 2.0, 5.0)]
)
def test_sliding_end_that_lifts_off_or_jams(angle, mu, v, w):
    """Painleve: nothing touches and it flies, or friction presses it down so that it jams."""
    r = 1e-3
    x, y = math.cos(angle), -math.sin(angle) - r
    twist = (v + w * y, -w * x, w)
    rod = Body(Capsule(1.0, r), 1.0, 1.0 / 3.0, (0.0, -y, -angle), twist)
    model = Model(2, [FLOOR, rod], (0.0, -G), 0.0, mu)
    assert w * w * math.sin(angle) > G and 1.0 + 3.0 * (x * x + mu * x * y) < 0.0
    found = searched(model)
    assert found.begin == 0.0 and found.told == "bodies 0 and 1 may part, or stay in contact"
    assert np.isinf(searched(replace(model, friction=0.5)).begin)


def struck_by_walls(seed):
    """A disc that three walls strike at once, e = .5, and at how many of them impulses by Coulomb may stop its slip.

    Three normals in a plane share their impulses in more than one way. The disc leaves with -e v; its spin hangs on
    where it sticks. A linear program asks for impulses: those of the others rub against their slips.
    """
    rng, r, m, inertia, e = np.random.default_rng(seed), 0.25, 2.0, 0.05, 0.5
    normals = [np.array([math.cos(a), math.sin(a)]) for a in rng.uniform(-math.pi, math.pi, 3)]
    friction, (vx, vy, w) = rng.uniform(0.2, 1.2, 3), rng.uniform(-1.0, 1.0, 3) * (2.0, 2.0, 6.0)
    v, across = np.array([vx, vy]), np.array([axes(n)[1] for n in normals])
    if any(v @ n > -0.1 for n in normals):
        return None
    stops = 0
    after = -e * across @ v
    for i in range(3):
        spin = after[i] / r  # the point of contact moves along a tangent with v.t - r w
        ways = np.sign(after - r * spin)
        rubs = [[0.0] if j == i else [-friction[j] * ways[j]] for j in range(3)]
        rubs[i] = [friction[i], -friction[i]]  # edges of its cone, of which any sum
        edges = [(*(normals[j] + rub * across[j]), -r * rub) for j in range(3) for rub in rubs[j]]
        change = (*(-(1.0 + e) * m * v), inertia * (spin - w))
        done = linprog(np.ones(4), A_eq=np.array(edges).T, b_eq=change, bounds=(1e-3, None))
        stops += done.status == 0
    table = np.zeros((4, 4))
    table[3, :3] = table[:3, 3] = friction
    walls = [Body(HalfSpace(tuple(n), -r), motion="fixed") for n in normals]
    disc = Body(Disc(r), m, inertia, (0.0, 0.0, 0.0), (vx, vy, w))
    return stops, Model(2, [*walls, disc], (0.0, 0.0), e, table)


def test_discs_that_stop_spinning_at_one_of_several_walls():
    found = [searched(drawn[1]).begin for seed in range(700, 1300) if (drawn := struck_by_walls(seed)) and drawn[0] > 1]
    assert len(found) > 8 and not any(found)


def test_random_scene_with_three_answers_to_a_blow():
    drawn = scene(79, 2)
    found = searched(drawn.model, drawn.steps, 1.0 / drawn.rate)
    assert found.begin == pytest.approx(0.06605546, abs=1e-8)


def in_space(model):
    """The same rod as a capsule in the plane y = 0."""
    bodies = []
    for body in model.bodies:
        place, angle = (body.pose[0], 0.0, body.pose[1]), body.pose[2]
        if body.motion == "fixed":
            n = body.shape.normal
            bodies.append(Body(HalfSpace((n[0], 0.0, n[1])), pose=(*place, *UPRIGHT), motion="fixed"))
            continue
        turn, (vx, vz, w), (fx, fz) = (math.cos(0.5 * angle), 0.0, -math.sin(0.5 * angle), 0.0), body.twist, body.force
        inertia, twist = (0.01 * body.inertia, *(body.inertia,) * 2), (vx, 0, vz, 0, -w, 0)
        loads = {"force": (fx, 0, fz), "torque": (0, -body.torque, 0)}
        shape = Capsule(body.shape.half_length, body.shape.radius)
        bodies.append(Body(shape, 1.0, inertia, (*place, *turn), twist, **loads))
    return Model(3, bodies, (0.0, 0.0, 0.0), model.restitution, model.friction)


@pytest.mark.parametrize("kind", ["struck", "slides", "rests"])
def test_rods_in_space_with_two_answers_and_with_one(kind):
    counts = {1: 0, 2: 0}
    for seed in range(6000):
        drawn = ladder(seed, kind)
        if drawn is None or not drawn[0] or counts[min(drawn[0], 2)] >= 8:
            continue
        counts[min(drawn[0], 2)] += 1
        found = searched(in_space(drawn[1]))
        assert np.isinf(found.unsearched) and (found.begin <= 1e-12) is (drawn[0] > 1), (seed, drawn[0], found)
        if min(counts.values()) == 8:
            break
    assert min(counts.values()) == 8


def between_walls(friction, up):
    """A box that fits between two walls, on a floor, and is drawn up by ``up`` [N]."""
    sides = (((0.0, 0.0, 1.0), (0.0, 0.0, 0.0)), ((1.0, 0.0, 0.0), (-0.3, 0, 0)), ((-1.0, 0.0, 0.0), (0.3, 0, 0)))
    walls = [Body(HalfSpace(n), pose=(*place, *UPRIGHT), motion="fixed") for n, place in sides]
    box = Body(Box((0.3, 0.2, 0.25)), 1.0, (0.03, 0.04, 0.03), (0.0, 0.0, 0.25, *UPRIGHT), force=(0.0, 0.0, up))
    return Model(3, [*walls, box], (0.0, 0.0, -G), 0.0, friction)


def test_a_box_between_two_walls_and_a_floor():
    """Twelve contacts, searched face by face: drawn up it leaves, or is wedged; on the floor it stays."""
    assert searched(between_walls(0.5, 2.0 * G)).begin == 0.0
    for friction, up in ((0.0, 2.0 * G), (0.5, 0.0)):
        assert searched(between_walls(friction, up))[::2] == (np.inf, np.inf)


def funnel(friction, up, **motion):
    """A ball that touches three walls, which lean over it: drawn down it leaves, or is held by friction."""
    walls, r, slant = [], 0.5, 0.3
    for k in range(3):
        angle = 2.0 * math.pi * k / 3.0
        n = np.array([*(math.cos(slant) * np.array([math.cos(angle), math.sin(angle)])), -math.sin(slant)])
        walls.append(Body(HalfSpace(tuple(n)), pose=(*(-r * n), *UPRIGHT), **motion))
    ball = Body(Sphere(r), 1.0, (0.1,) * 3, (0.0, 0.0, 0.0, *UPRIGHT), motion.get("twist"), force=(0.0, 0.0, up))
    return Model(3, [*walls, ball], (0.0, 0.0, -G), 0.0, friction)


@pytest.mark.parametrize("motion", [{"motion": "fixed"}, {"motion": "prescribed", "twist": (0.1, -2.0, 0.3, 0, 0, 0)}])
def test_a_ball_between_three_walls(motion):
    """Their friction holds it from ``mu = tan(.3)`` on."""
    for friction, two in ((1.1 * math.tan(0.3), True), (0.9 * math.tan(0.3), False)):
        assert (searched(funnel(friction, -1.0, **motion)).begin == 0.0) is two


def test_redundant_contacts_of_a_known_answer(monkeypatch):
    """A box at rest: its four corners stick, and the record has shares with which they do."""
    module, asked = import_module(Answers.__module__), []
    monkeypatch.setattr(module, "_of_redundant", lambda *how: asked.append(how) or np.zeros((0, 4, 3)))
    box = Body(Box((0.1, 0.1, 0.1)), 1.0, (1.0 / 150.0,) * 3, (0.0, 0.0, 0.1, *UPRIGHT))
    floor = Body(HalfSpace((0.0, 0.0, 1.0)), pose=(0.0, 0.0, 0.0, *UPRIGHT), motion="fixed")
    model = Model(3, [floor, box], (0.0, 0.0, -G), 0.0, 0.5)
    assert searched(model) == Answers(np.inf, "", np.inf, 0)
    assert not asked
    monkeypatch.setattr(module, "_is_of_mode", lambda *how: False)  # planted
    searched(model)
    assert asked


@pytest.mark.parametrize("second", [0.0, 0.5])
def test_contacts_that_differ_in_their_second_tangent(second):
    """One sticks and the other slips: with one velocity along both tangents they cannot, as at a pivot they can."""
    module = import_module(Answers.__module__)
    matrix = np.tile(np.eye(3)[:, None], (2, 1, 2, 1))
    free = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, second]])
    slip = np.array([[0.0, 0.0], [0.0, 1.0]])
    problem = module.Problem(matrix, free, np.ones(2), slip, free, np.zeros((1, 2), int))
    closed, sticks = np.ones((1, 2), bool), np.array([[True, False]])
    assert module._agree(problem, closed, sticks, slip[None])[0] == (second > 0.0)


def test_refusal_of_too_many_contacts():
    """A pile of ten boxes: their modes are more than can be tried, and the verdict in one line tells."""
    boxes = [Body(Box((0.5, 0.5)), 1.0, 1.0 / 6.0, (0.0, 0.5 + k, 0.0)) for k in range(10)]
    found = certify(Model(2, [FLOOR, *boxes], (0.0, -G), 0.0, 0.5), Settings.reference(DT), 6)
    assert found.holds and found.unique == "uniqueness not searched from 0 s: 20 contacts in one solve"
    assert "uniqueness not searched" in repr(found)


ROLLING = {
    "disc on a disc": (Disc(0.3), Disc(0.2), (0.0, 0.5, 0.0), (0.7, 0.0, 2.0)),
    "disc on a plane": (HalfSpace((0.0, 1.0)), Disc(0.2), (0.0, 0.2, 0.0), (0.7, 0.0, -3.5)),
    "corner on a plane": (HalfSpace((0.0, 1.0)), Box((0.3, 0.4)), (0.0, 0.5, math.atan2(0.3, 0.4)), (-1.0, 0.0, 2.0)),
    "disc on a corner": (Box((0.5, 0.5)), Disc(0.3), (0.5 + 0.18, 0.5 + 0.24, 0.0), (0.8, -0.6, -1.0 / 0.3)),
    "triangle on a plane": (
        HalfSpace((0.0, 1.0)),
        Polygon.about_centroid(((0.0, -0.5), (0.6, 0.4), (-0.6, 0.4))),
        (0.1, 0.6, 0.0),
        (1.0, 0.0, 1.5),
    ),
}


@pytest.mark.parametrize("name", ROLLING)
def test_accelerations_without_loads(name):
    """Truth: the second difference of distances between bodies that keep their velocities."""
    fixed, shape, pose, twist = ROLLING[name]
    if name == "triangle on a plane":
        pose = (pose[0], -min(y for _, y in shape.vertices), 0.0)
    model = Model(2, [Body(fixed, motion="fixed"), Body(shape, 1.0, 0.1, pose, twist)], (0.0, -50.0), 0.0, 0.5)
    record = Simulation(model, Settings.reference(1e-4)).record(1, pieces=True)
    run = Run(model, record.pieces, 1e-4)
    first = np.arange(record.pieces.first_contact[1]) if len(record.pieces) > 1 else np.arange(1)
    found = accelerations(run, np.ones(len(record.pieces.body_a), bool))[first[0], 0]
    h = 1e-4
    at = [np.array(pose) + t * np.array(twist) for t in (-h, 0.0, h)]
    gaps = [gap(fixed, np.zeros(3), shape, place) for place in at]
    assert found == pytest.approx((gaps[0] - 2.0 * gaps[1] + gaps[2]) / h**2, abs=1e-5)


def test_answers_by_observer():
    drawn = next(d[1] for seed in range(4000) if (d := ladder(seed, "struck")) and d[0] > 1)
    for change in (
        Change(2, boost=(1.7, -0.6)),
        Change(2, axes=(1, 0), signs=(-1.0, 1.0)),
        Change(2, shift=(30.0, 7.0)),
    ):
        assert searched(change.model(drawn)).begin == 0.0
