"""A motion that hangs on how redundant contacts share a load is no truth; one that does not stays certified."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import linprog

from reference_solver import Body, Box, Capsule, Disc, HalfSpace, Model, Polygon, Settings, Simulation, Sphere
from reference_solver.certificate.audit import CHECKS, shared_loads, sharing
from reference_solver.certificate.audit.run import Run
from reference_solver.certificate.audit.sharing import farthest
from reference_solver.certificate.truth import certify
from reference_solver.pieces import IMPACT

DT, G = 1.0 / 240.0, 9.81
UPRIGHT = (1.0, 0.0, 0.0, 0.0)


def turned(angle):
    return (math.cos(0.5 * angle), 0.0, 0.0, math.sin(0.5 * angle))


def floor(dimension):
    if dimension == 2:
        return Body(HalfSpace((0.0, 1.0)), motion="fixed")
    return Body(HalfSpace((0.0, 0.0, 1.0)), pose=(0.0, 0.0, 0.0, *UPRIGHT), motion="fixed")


def box(half, place, twist=None, yaw=0.0, **fields):
    """A box of 1 kg: planar with two half extents, else turned about the vertical."""
    if len(half) == 2:
        inertia, turn = (half[0] ** 2 + half[1] ** 2) / 3.0, (0.0,)
    else:
        x, y, z = (h * h / 3.0 for h in half)
        inertia, turn = (y + z, x + z, x + y), turned(yaw)
    if fields.get("motion", "free") != "free":
        return Body(Box(half), pose=(*place, *turn), twist=twist, **fields)
    return Body(Box(half), 1.0, inertia, (*place, *turn), twist, **fields)


def world(bodies, friction, restitution=0.0):
    """Bodies under gravity; friction is one number, or a dict of those of pairs."""
    n, d = len(bodies), bodies[0].dimension
    table = friction
    if isinstance(friction, dict):
        table = np.zeros((n, n))
        for (a, b), mu in friction.items():
            table[a, b] = table[b, a] = mu
    return Model(d, bodies, (0.0,) * (d - 1) + (-G,), restitution, table)


def spinning(yaw, twist, restitution=0.0, height=0.0):
    """A square box that slides and spins on its corners."""
    v, w, fall = twist
    return world(
        [floor(3), box((0.5, 0.5, 0.2), (0, 0, 0.2 + height), (v, 0.1 * v, fall, 0, 0, w), yaw)], 0.3, restitution
    )


def tiles(*twists, dimension=2):
    """Two fixed boxes, flush, whose seam is at x = 0, or two belts."""
    half, y = ((2.0, 0.5), ()) if dimension == 2 else ((2.0, 2.0, 0.5), (0.0,))
    motion = "prescribed" if twists else "fixed"
    return [
        box(half, (x, *y, -0.5), twist, motion=motion)
        for x, twist in zip((-2.0, 2.0), twists or (None,) * 2, strict=True)
    ]


#: Ice on the left, asphalt on the right.
SEAM = {(1, 2): 0.5}


def over_a_seam(shape="box"):
    if shape == "box in space":
        body = box((0.5, 0.3, 0.1), (-0.1, 0.2, 0.1), (3.0, 0.0, 0.0, 0.0, 0.0, 0.0))
        return world([*tiles(dimension=3), body], SEAM)
    if shape == "capsule":
        body = Body(Capsule(0.4, 0.1), 1.0, 0.1, (-0.1, 0.1, 0.0), (3.0, 0.0, 0.0))
    else:
        body = box((0.5, 0.1), (-0.1, 0.1), (3.0, 0.0, 0.0))
    return world([*tiles(), body], SEAM)


def on_two_belts():
    """Both rub with one mu, one forwards and the other backwards."""
    return world([*tiles((2.0, 0.0, 0.0), (-1.0, 0.0, 0.0)), box((0.5, 0.1), (-0.1, 0.1), (0.2, 0.0, 0.0))], 0.4)


def plate_on_two_blocks():
    """A plate slides over two free blocks that stand on the floor; its faces share its weight, and push them along."""
    blocks = [box((0.3, 0.2), (x, 0.2)) for x in (-0.7, 0.7)]
    bodies = [floor(2), *blocks, box((1.2, 0.1), (0.0, 0.5), (2.0, 0.0, 0.0))]
    return world(bodies, {(0, 1): 0.05, (0, 2): 0.05, (1, 3): 0.5, (2, 3): 0.2})


UNDETERMINED = {
    **{f"box that spins at {yaw}": (lambda yaw=yaw: spinning(yaw, (1.0, 3.0, 0.0)), 4) for yaw in (0.0, 0.37, 2.9)},
    "box over a seam": (over_a_seam, 4),
    "capsule over a seam": (lambda: over_a_seam("capsule"), 4),
    "box over a seam in space": (lambda: over_a_seam("box in space"), 8),
    "box on two belts": (on_two_belts, 4),
    "box that lands flat and spins": (lambda: spinning(0.3, (1.0, 3.0, -1.0), height=0.01), 4),
    "box that rebounds and spins": (lambda: spinning(0.3, (1.0, 3.0, -1.0), 0.5, 0.01), 4),
}


def on_supports(*mus):
    """A box on as many fixed balls as there are numbers, which slides over them and spins."""
    places = [(0.4, 0.0), (-0.2, 0.35), (-0.2, -0.35)][: len(mus)]
    balls = [Body(Sphere(0.1), pose=(x, y, -0.1, *UPRIGHT), motion="fixed") for x, y in places]
    slab = box((0.8, 0.8, 0.1), (0, 0, 0.1), (0.5, 0.2, 0, 0, 0, 2.0))
    return world([*balls, slab], {(i, len(mus)): mu for i, mu in enumerate(mus)})


def on_two_posts():
    """A box on two round posts, one of ice: two contacts, whose loads moments tell."""
    posts = [Body(Capsule(0.2, 0.05), pose=(x, -0.25, 0.5 * math.pi), motion="fixed") for x in (-0.3, 0.3)]
    return world([*posts, box((0.8, 0.1), (0.0, 0.1), (0.5, 0.0, 0.0))], {(0, 2): 0.1, (1, 2): 0.6})


def triangle_that_slides():
    triangle = Polygon.about_centroid(((-0.5, 0.0), (0.5, 0.0), (0.1, 0.6)))
    low = min(y for _, y in triangle.vertices)
    return world([floor(2), Body(triangle, 1.0, 0.05, (0.0, -low, 0.0), (2.0, 0.0, 0.0))], 0.3)


DETERMINED = {
    "straight slide": lambda: spinning(0.4, (1.0, 0.0, 0.0)),
    "spin about the centre": lambda: spinning(0.4, (0.0, 3.0, 0.0)),
    "straight landing": lambda: spinning(0.4, (1.0, 0.0, -1.0), height=0.01),
    "slides and spins without friction": lambda: replace(spinning(0.4, (1.0, 3.0, 0.0)), friction=0.0),
    "seam of one floor": lambda: replace(over_a_seam(), friction=0.5),
    "seam of one floor in space": lambda: replace(over_a_seam("box in space"), friction=0.5),
    "two belts that go one way": lambda: world(
        [*tiles((2.0, 0.0, 0.0), (1.0, 0.0, 0.0)), box((0.5, 0.1), (-0.1, 0.1), (0.2, 0.0, 0.0))], 0.4
    ),
    "three balls under a box": lambda: on_supports(0.1, 0.3, 0.6),
    "two posts under a box": on_two_posts,
    "triangle": triangle_that_slides,
    "box at rest on a seam": lambda: replace(over_a_seam(), bodies=[*tiles(), box((0.5, 0.1), (-0.1, 0.1))]),
}


@pytest.mark.parametrize("name", UNDETERMINED)
def test_refusal_of_loads_that_the_laws_leave_open(name):
    model, contacts = UNDETERMINED[name][0](), UNDETERMINED[name][1]
    found = certify(model, Settings.reference(DT), 12)
    assert not found.holds and all(reason.startswith("beyond ") for reason in found.reasons[1:])
    assert found.reasons[0].startswith("the motion is not determined: bodies ")
    assert f"among {contacts} contacts" in found.reasons[0]
    assert found.error[-1] > 1e-5


@pytest.mark.parametrize("name", DETERMINED)
def test_certificate_of_redundant_loads_of_one_motion(name):
    model = DETERMINED[name]()
    found = certify(model, Settings.reference(DT), 12)
    assert found.holds, found.reasons
    assert next(each.value for each in found.findings if each.name == "shared") < 1e-11
    assert found.error[-1] < 1e-9


def test_two_answers_by_shares_of_load():
    model = plate_on_two_blocks()
    found = certify(model, Settings.reference(DT), 12)
    assert found.unique == "two motions obey the laws from 0 s: bodies 0 and 2 may slip, or stick"
    assert found.determined == 0.0 and found.horizon == found.t[1] and found.error[-1] > 1e-5


def shared(model, record):
    ways, finding = shared_loads(model, record, DT, np.inf)
    return float(ways[-1]), finding


@pytest.mark.parametrize("spin", [1e-9, 1e-7])
def test_spread_too_small_to_matter_in_x(spin):
    """Slips that differ by w r/v in direction: what that moves is in proportion, and certified while it is small."""
    model = spinning(0.4, (1.0, spin, 0.0))
    found = certify(model, Settings.reference(DT), 12)
    way, finding = shared(model, Simulation(model, Settings.reference(DT)).record(12, pieces=True))
    assert found.holds and finding.holds
    assert 0.1 < way / (0.3 * G * spin * (12 * DT) ** 2) < 2.0
    assert found.error[-1] >= way


def test_what_rests_goes_apart_no_farther():
    """The box stops after .15 s; the wider way is what it was then, but for what it takes to stop."""
    model = spinning(0.4, (0.45, 1e-7, 0.0))
    ways, _ = shared_loads(model, Simulation(model, Settings.reference(DT)).record(96, pieces=True), DT, np.inf)
    assert ways[45] > 0.9 * ways[96] > 0.0


def admissible(pick, yaw, v, w, times):
    """Places (k, 3) x, y, yaw of `spinning`, its load at one end of what is admissible at every instant."""
    corner, height, mu = np.array([[0.5, 0.5], [-0.5, 0.5], [-0.5, -0.5], [0.5, -0.5]]), 0.2, 0.3

    def rate(_, y):
        c, s = math.cos(y[2]), math.sin(y[2])
        r = corner @ np.array([[c, s], [-s, c]])
        slip = np.stack([y[3] - y[5] * r[:, 1], y[4] + y[5] * r[:, 0]], 1)
        f = -mu * slip / np.linalg.norm(slip, axis=1)[:, None]
        rows = np.stack([np.ones(4), r[:, 1] + height * f[:, 1], -height * f[:, 0] - r[:, 0]])
        first, way = np.linalg.lstsq(rows, [G, 0.0, 0.0], rcond=None)[0], np.linalg.svd(rows)[2][3]
        way = way * np.sign(way[0])
        ends = np.max(-first[way > 0] / way[way > 0]), np.min(-first[way < 0] / way[way < 0])
        force = f * (first + ends[pick] * way)[:, None]
        return [*y[3:], *force.sum(axis=0), 6.0 * (r[:, 0] * force[:, 1] - r[:, 1] * force[:, 0]).sum()]

    start = [0.0, 0.0, yaw, v, 0.1 * v, w]
    return solve_ivp(rate, (0.0, times[-1]), start, "DOP853", times, rtol=1e-10, atol=1e-12).y[:3].T


@pytest.mark.parametrize(("yaw", "v", "w"), [(0.37, 1.0, 3.0), (0.8, 2.0, 5.0), (0.1, 0.8, -6.0)])
def test_spread_of_two_motions_that_obey_the_laws(yaw, v, w):
    """Truth: the same box integrated twice, its load at either end of what its corners can share."""
    model = spinning(yaw, (v, w, 0.0))
    record = Simulation(model, Settings.reference(DT)).record(48, pieces=True)
    ways, _ = shared_loads(model, record, DT, np.inf)
    one, other = (admissible(pick, yaw, v, w, record.t[1:]) for pick in (0, 1))
    apart = np.linalg.norm((one - other)[:, :2], axis=1) + 2.0 * math.hypot(0.5, 0.5, 0.2) * np.abs(
        np.sin(0.5 * (one - other)[:, 2])
    )
    assert (apart[5:] <= ways[6:]).all() and ways[-1] < 3.0 * apart[-1]


def test_spread_from_another_recorded_answer():
    """The same forces on the body, from loads at an end of what is admissible: two of four contacts carry nothing."""
    model = over_a_seam()
    record = Simulation(model, Settings.reference(DT)).record(1, pieces=True)
    pieces = record.pieces
    way, _ = shared(model, record)
    x, mu = pieces.point[:, 0] + 0.1, np.array([0.0, 0.0, 0.5, 0.5])
    # The same sum, and moment about the centre, .1 above the floor, of loads and of the friction mu N backwards.
    rows = np.array([np.ones(4), x - 0.1 * mu])
    load = linprog([0.0, 0.0, 1.0, 1.0], A_eq=rows, b_eq=rows @ pieces.impulse[:, 1]).x
    assert (load < 1e-12).sum() == 2
    impulse = np.column_stack([-mu * load, load])
    moved = pieces.twist_after.copy()
    moved[0] += [*((impulse - pieces.impulse).sum(axis=0)), 0.0]
    other = replace(record, pieces=replace(pieces, impulse=impulse, twist_after=moved))
    assert shared(model, other)[0] == pytest.approx(way, rel=1e-9) and way > 1e-5


def test_shares_of_impulses_of_a_landing():
    model = spinning(0.3, (1.0, 3.0, -1.0), height=0.01)
    record = Simulation(model, Settings.reference(DT)).record(6, pieces=True)
    found = sharing.shared_loads(Run(model, record.pieces, DT))
    kinds = record.pieces.kind[np.repeat(np.arange(len(record.pieces)), np.diff(record.pieces.first_body))]
    assert found.gain[kinds == IMPACT].max() > 1e-2


@pytest.mark.parametrize("restitution", [0.0, 0.5])
def test_load_of_a_corner_that_an_impact_leaves_without(restitution):
    """The spread of a landing is the same where all four corners are hit and where the record has one that is not."""
    model = spinning(0.3, (1.0, 3.0, -1.0), restitution, 0.01)
    record = Simulation(model, Settings.reference(DT)).record(6, pieces=True)
    pieces = record.pieces
    k = int(np.flatnonzero(pieces.kind == IMPACT)[0])
    own, row = slice(pieces.first_contact[k], pieces.first_contact[k + 1]), pieces.first_body[k]
    r, twist, load = pieces.point[own] - pieces.pose_before[row, :3], pieces.twist_after[row], pieces.impulse[own, 2]
    slip = (twist[:3] + np.cross(twist[3:], r))[:, :2]
    push = np.column_stack([-0.3 * slip / np.linalg.norm(slip, axis=1)[:, None], np.ones(4)])
    way = np.linalg.svd(np.vstack([np.ones(4), np.cross(r, push)[:, :2].T]))[2][3]
    load = load + np.min(-load[way < 0.0] / way[way < 0.0]) * way
    assert (load < 1e-12).sum() == 1 and (load > -1e-12).all()
    impulse = pieces.impulse.copy()
    impulse[own] = load[:, None] * push
    gains = [sharing.shared_loads(Run(model, x, DT)).gain[row] for x in (pieces, replace(pieces, impulse=impulse))]
    assert gains[1] == pytest.approx(gains[0], rel=1e-9) and gains[0] > 1e-2


def walls(dimension, slant, apart):
    """Two walls that face each other, ``slant`` [rad] from the vertical, open upwards; ``apart`` [m] at the origin."""
    co, si, fields = math.cos(slant), math.sin(slant), {"motion": "fixed"}
    if dimension == 2:
        return [Body(HalfSpace((s * co, si)), pose=(-0.5 * s * apart, 0.0, 0.0), **fields) for s in (1.0, -1.0)]
    places = [(-0.5 * s * apart, 0.0, 0.0, *UPRIGHT) for s in (1.0, -1.0)]
    normals = [(s * co, 0.0, si) for s in (1.0, -1.0)]
    return [Body(HalfSpace(n), pose=place, **fields) for n, place in zip(normals, places, strict=True)]


def drawn_out(dimension, slant):
    """A ball at rest in a wedge that is drawn up out of it; contacts can hold it from ``mu = tan(slant)`` on."""
    height = (0.5 / math.cos(slant) - 0.5) / math.tan(slant)
    if dimension == 2:
        return [*walls(2, slant, 1.0), Body(Disc(0.5), 1.0, 0.125, (0.0, height, 0.0), force=(0.0, 2.0 * G))], math.tan(
            slant
        )
    ball = Body(Sphere(0.5), 1.0, (0.1,) * 3, (0.0, 0.0, height, *UPRIGHT), force=(0.0, 0.0, 2.0 * G))
    return [*walls(3, slant, 1.0), ball], math.tan(slant)


def across_a_slot(dimension, angle):
    """A rod at rest between two walls; contacts can hold it if the line through them lies within their cones."""
    half, r = 0.4, 0.05
    a, b = half * math.cos(angle) + r, half * math.sin(angle)
    if dimension == 2:
        return [*walls(2, 0.0, 2.0 * a), Body(Capsule(half, r), 1.0, 0.06, (0.0, 1.0, angle))], b / a
    turn = (math.cos(0.5 * angle), 0.0, -math.sin(0.5 * angle), 0.0)
    rod = Body(Capsule(half, r), 1.0, (0.01, 0.06, 0.06), (0.0, 0.0, 1.0, *turn))
    return [*walls(3, 0.0, 2.0 * a), rod], b / a


@pytest.mark.parametrize("share", [0.9, 1.1])
@pytest.mark.parametrize(("scene", "angle"), [(drawn_out, 0.05), (drawn_out, 0.4), (across_a_slot, 0.6)])
@pytest.mark.parametrize("dimension", [2, 3])
def test_certificate_of_a_body_that_may_be_wedged(dimension, scene, angle, share):
    """It leaves in the run. With friction above what can hold it, it might as well stay: neither has to be."""
    bodies, threshold = scene(dimension, angle)
    found = certify(world(bodies, share * threshold), Settings.reference(DT), 24)
    moved = np.abs(found.pose[-1, 2, dimension - 1] - found.pose[0, 2, dimension - 1])
    assert moved == pytest.approx(0.5 * G * (24 * DT) ** 2, rel=1e-9)
    assert found.holds and found.determined == (0.0 if share > 1.0 else np.inf)
    assert found.horizon == (found.t[1] if share > 1.0 else np.inf)
    assert found.unique.startswith("two motions obey the laws from 0 s: bodies ") is (share > 1.0)


def test_spread_of_a_load_without_bound():
    """A box that fits between a floor and a ceiling: they may squeeze it as hard as they like, and brake it so."""
    ceiling = Body(HalfSpace((0.0, -1.0)), pose=(0.0, 0.2, 0.0), motion="fixed")
    found = certify(
        world([floor(2), ceiling, box((0.5, 0.1), (0.0, 0.1), (2.0, 0.0, 0.0))], 0.3), Settings.reference(DT), 12
    )
    assert found.reasons == (
        "the motion is not determined: bodies 0, 1 and 2 can share their load among 4 contacts with friction in more "
        "than one way, which moves body 2 by any distance: shared inf, at most 1e-06",
    )
    assert np.isinf(found.error[-1])


def test_loads_open_beyond_the_horizon():
    model = spinning(0.37, (1.0, 3.0, 0.0))
    record = Simulation(model, Settings.reference(DT)).record(12, pieces=True)
    assert not shared_loads(model, record, DT, np.inf)[1].holds
    assert shared_loads(model, record, DT, 0.5 * DT)[1].holds


def test_a_run_without_pieces_is_refused():
    model = spinning(0.0, (1.0, 0.0, 0.0))
    with pytest.raises(ValueError, match="no pieces"):
        shared_loads(model, Simulation(model, Settings.reference(DT)).record(2), DT, np.inf)


def test_the_linear_program_agrees_with_another():
    """Random and degenerate ones: rooms that are zero, rows that repeat, nothing that bounds."""
    rng, bounded = np.random.default_rng(5), 0
    for k in range(300):
        size = int(rng.integers(1, 6))
        limits = rng.normal(size=(int(rng.integers(size, 4 * size + 3)), size))
        room = np.maximum(rng.normal(size=len(limits)), 0.0)
        if k % 3 == 0:
            limits, room = np.concatenate([limits, limits[:2]]), np.concatenate([room, room[:2]])
        aim = rng.normal(size=size)
        truth = linprog(-aim, A_ub=-limits, b_ub=room, bounds=(None, None))
        found = farthest(aim, limits, room)
        if truth.status == 0:
            bounded += 1
            assert found == pytest.approx(-truth.fun, rel=1e-9, abs=1e-9)
        else:
            assert math.isinf(found)
    assert 50 < bounded < 300


def test_loads_open_by_as_much_as_bodies_may_overlap():
    assert CHECKS["shared"].limit == CHECKS["start"].limit
