"""Reasons of Rapier that no setting switches off: figures computed without it, and what it makes of the scenes."""

import math
from itertools import permutations

import numpy as np
import pytest

from adapters.needs import needs
from adapters.rapier import RapierEngine
from adapters.scene.lift import lift
from adapters.stepping import run
from validation.catalogue import CATALOGUE
from validation.scenes import domino

pytestmark = pytest.mark.optional("rapier")
ENGINE = RapierEngine()
DT = 1.0 / 240.0
UP, AHEAD = np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])
#: Sweeps until nothing is left to correct, and contacts that are seen when they touch.
SWEPT = {"iterations": 30, "relaxations": 30}
UNSEEN = {"prediction": 1e-5}


def ran(name, dimension=2, params=None, profile="default", **changes):
    scene = CATALOGUE[name].scene(dimension, params or {})
    settings = {s.name: s.value for s in ENGINE.settings(profile, needs(scene), DT)} | changes
    return scene, run(ENGINE, scene, DT, settings, CATALOGUE[name].sampling(scene))


def measured(name, dimension=2, params=None, profile="default", **changes):
    scene, found = ran(name, dimension, params, profile, **changes)
    return {metric: value for metric, (value, _) in CATALOGUE[name].measure(scene, found).items()}


class Blow:
    """A box on the floor: stopped at all its lowest corners together, thrown back at one after the other, once."""

    def __init__(self, name, dimension, params):
        scene = CATALOGUE[name].scene(dimension, params)
        material = scene.material(*(body.name for body in scene.bodies))
        self.e, self.mu = material.restitution, material.friction
        box = (scene if dimension == 3 else lift(scene)).bodies[1]
        w, x, y, z = box.pose[3:]
        turn = np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
            ]
        )
        corners = [turn @ ((2 * np.array(signs) - 1) * box.shape.half_extents) for signs in np.ndindex(2, 2, 2)]
        lowest = min(corner[2] for corner in corners)
        self.points = [corner for corner in corners if corner[2] < lowest + 1e-9]
        self.mass, self.light = box.mass, turn @ np.diag(1.0 / np.array(box.inertia)) @ turn.T
        self.v, self.w = np.array(box.twist[:3]), np.array(box.twist[3:])

    def speed(self, at, along):
        return along @ (self.v + np.cross(self.w, at))

    def push(self, at, along, impulse):
        self.v = self.v + impulse * along / self.mass
        self.w = self.w + self.light @ np.cross(at, impulse * along)

    def stopping(self, at, along, left=0.0):
        """Impulse along ``along`` that leaves a point with the speed ``left``."""
        return (left - self.speed(at, along)) / (1 / self.mass + along @ np.cross(self.light @ np.cross(at, along), at))

    def stopped(self):
        """Stop all points and, as far as it can, friction at their middle; returns the points' speeds before."""
        before = [self.speed(point, UP) for point in self.points]
        pressed, rubbed, middle = [0.0] * len(self.points), 0.0, sum(self.points) / len(self.points)
        change = 1.0
        while change > 1e-12:
            change = 0.0
            for k, point in enumerate(self.points):
                impulse = max(0.0, pressed[k] + self.stopping(point, UP))
                self.push(point, UP, impulse - pressed[k])
                change, pressed[k] = max(change, abs(impulse - pressed[k])), impulse
            most = self.mu * sum(pressed)
            impulse = min(max(rubbed + self.stopping(middle, AHEAD), -most), most)
            self.push(middle, AHEAD, impulse - rubbed)
            change, rubbed = max(change, abs(impulse - rubbed)), impulse
        return before

    def over(self, *orders):
        """Velocity and spin after the blow, for each order in which the points are thrown back."""
        before = self.stopped()
        start = self.v, self.w
        for order in orders:
            self.v, self.w = start
            for k in order:
                self.push(self.points[k], UP, self.stopping(self.points[k], UP, -self.e * before[k]))
            yield self.v, self.w


@pytest.mark.parametrize(("dimension", "params"), [(2, {}), (3, {}), (2, {"e": 1.0, "tilt": 30.0})], ids=str)
def test_edge_ends_thrown_back_one_after_the_other(dimension, params):
    """Off by what the box turns in the step of the blow, some 1e-4; thrown back together it would be by 1e-3 and more.

    As shipped the sweeps that stop it are not finished: three digits.
    """
    ((velocity, spin),) = Blow("edge_drop", dimension, params).over((0, 1))
    for changes, within in (({**SWEPT, **UNSEEN}, 1e-4), ({}, 1e-3)):
        found = measured("edge_drop", dimension, params, **changes)
        assert found["rise"] == pytest.approx(velocity[2], abs=within)
        assert found["spin"] == pytest.approx(abs(spin[1]), abs=within)
        if dimension == 3:
            assert found["twisted"] == pytest.approx(math.hypot(spin[0], spin[2]), abs=within)
    truth = CATALOGUE["edge_drop"].exact(CATALOGUE["edge_drop"].scene(dimension, params))
    assert abs(truth["rise"] - velocity[2]) > 1.5e-3


@pytest.mark.parametrize("params", [{}, {"e": 1.0}], ids=str)
def test_flat_box_corners_thrown_back_one_after_the_other(params):
    """In one of the orders that four corners have: 0.48828 of the approach at 0.5, and 0.97656 at 1."""
    found = measured("flat_box", 2, params, **SWEPT)
    scene = CATALOGUE["flat_box"].scene(2, params)
    speed, reach = scene.params["v"], math.hypot(0.5, 0.5)
    orders = list(Blow("flat_box", 2, params).over(*permutations(range(4))))
    fits = [(v, w) for v, w in orders if abs(v[2] / speed - found["rebound_ratio"]) < 1e-6]
    assert any(abs(abs(w[1]) * reach - found["edge_speed"]) < 1e-4 for _, w in fits)
    assert all(abs(v[2] / speed - scene.material("floor", "box").restitution) > 1e-2 for v, _ in orders)


@pytest.mark.parametrize(("params", "within"), [({}, 5e-3), ({"e": 0.5, "mu": 0.1}, 5e-3)], ids=str)
def test_a_rod_on_its_end_rebounds_without_friction(params, within):
    """Off by what the rod turns in the step of the blow, w dt = 0.013 of its arm; the law of the scene is 0.1 away."""
    ((velocity, spin),) = Blow("kane", 2, params).over((0, 1))
    found = measured("kane", 2, params, substeps=64, **SWEPT, **UNSEEN)
    truth = CATALOGUE["kane"].exact(CATALOGUE["kane"].scene(2, params))
    for metric, value in (("rise", velocity[2]), ("ahead", velocity[0]), ("spin", -spin[1])):
        assert found[metric] == pytest.approx(value, abs=within), metric
        assert abs(truth[metric] - value) > 0.08, metric


def test_friction_by_the_compression_impulse_only():
    """Of a pair mu/(1 + e) comes out where the contact is seen when it touches; as shipped to three digits."""
    scene = CATALOGUE["pair_matrix"].scene(2, {})
    truth = CATALOGUE["pair_matrix"].exact(scene)
    found, shipped = measured("pair_matrix", **UNSEEN), measured("pair_matrix")
    for k in range(1, 5):
        expected = truth[f"friction[{k}]"] / (1.0 + truth[f"restitution[{k}]"])
        assert found[f"friction[{k}]"] == pytest.approx(expected, rel=2e-6)
        assert shipped[f"friction[{k}]"] == pytest.approx(expected, rel=1e-3)


def test_slip_braked_by_the_compression_impulse_only():
    params = {"mu": 0.1}
    scene = CATALOGUE["oblique"].scene(2, params)
    truth, start = CATALOGUE["oblique"].exact(scene)["forward_speed"], scene.bodies[1].twist[0]
    e = scene.material("floor", "ball").restitution
    expected = start + (truth - start) / (1.0 + e)
    assert measured("oblique", 2, params, **UNSEEN)["forward_speed"] == pytest.approx(expected, rel=1e-6)
    assert measured("oblique", 2, params)["forward_speed"] == pytest.approx(expected, rel=1e-4)


def test_stop_of_touching_balls_before_the_first_two_rebound():
    """v/3 each, then the first two at v/2 apart from that: (1 + 25 + 4)/36 of the energy is left."""
    assert measured("cradle", 2, {"n": 3.0, "apart": 0.0}, **SWEPT)["energy_defect"] == pytest.approx(1 / 6, abs=1e-6)
    assert measured("cradle", 2, {"n": 3.0, "apart": 0.0})["energy_defect"] == pytest.approx(1 / 6, abs=0.015)


def test_rack_asymmetry_by_the_order_of_bodies():
    """Balls that meet one at a time keep their energy: what is lost is lost where several are met within a step."""
    assert measured("rack", 2, {"rows": 1.0})["energy_defect"] < 1e-6
    assert measured("rack", 2, {})["asymmetry"] > 0.1


def test_domino_foot_free_while_thrown_back():
    """Both stop, feet held; the blow's rebound turns both freely; then the feet are stopped again: 0.380 rad/s."""
    scene = CATALOGUE["domino"].scene(2, {})
    p, on = scene.params, domino._pivot(scene.params)
    theta, high, wide, far = domino._hit(p), p["height"], p["aspect"] * p["height"], p["gap"] * p["height"]
    moment, c, s = (high**2 + wide**2) / 12.0, math.cos(theta), math.sin(theta)
    first = np.array([-0.5 * wide * c + 0.5 * high * s, 0.5 * wide * s + 0.5 * high * c])
    hit, second, foot = np.array([high * s, high * c]), np.array([far + 0.5 * wide, 0.5 * high]), [far + wide, 0.0]
    spin = -on.speed(-on.alpha, domino._spin(p), theta - on.alpha)
    a, b, at, by = -first, foot - second, hit - first, hit - second
    feet = [[1, 0, -a[1], 0, 0, 0], [0, 1, a[0], 0, 0, 0], [0, 0, 0, 1, 0, -b[1]], [0, 0, 0, 0, 1, b[0]]]
    blow = np.array([-1, 0, at[1], 1, 0, -by[1]])
    lightness = np.diag([1, 1, 1 / moment, 1, 1, 1 / moment])
    u = np.array([-spin * first[1], spin * first[0], spin, 0, 0, 0])
    before = blow @ u

    def stopped(rows, u, left):
        rows = np.array(rows, float)
        return u + lightness @ rows.T @ np.linalg.solve(rows @ lightness @ rows.T, left - rows @ u)

    u = stopped([*feet, blow], u, np.zeros(5))
    u = stopped([blow], u, np.array([-p["e"] * before]))
    u = stopped(feet, u, np.zeros(4))
    expected = on.speed(-on.alpha, -u[5], domino.STRUCK - on.alpha)
    hard = {"frequency": 19200.0, "static_frequency": 19200.0, "substeps": 640, "allowed_error": 1e-5}
    found = measured("domino", 2, {}, **hard, **UNSEEN)["struck_spin"]
    assert found == pytest.approx(expected, abs=2e-3)
    assert CATALOGUE["domino"].exact(scene)["struck_spin"] - expected > 0.015


@pytest.mark.parametrize(
    ("name", "params", "within"),
    [("edge_drop", {"e": 1.0, "tilt": 30.0}, 0.01), ("kane", {}, 0.03), ("kane", {"e": 0.5, "mu": 0.1}, 0.03),
     ("flat_box", {}, 0.01), ("flat_box", {"e": 1.0}, 0.01), ("flat_box", {"e": 0.8, "aspect": 4.0}, 0.01)],
    ids=str,
)  # fmt: skip
def test_out_of_plane_turn_by_points_thrown_back_in_sequence(name, params, within):
    """By the spin of the blow, for as long as the flight after it; thrown back together by nothing.

    The flight is shorter by up to the step that finds the blow; besides, off by a share: what the body turns in the
    step of the blow, which of a rod that leans is 0.013 of its arm and more.
    """
    scene, found = ran(name, 2, params, substeps=64, **SWEPT, **UNSEEN)
    box, blow = lift(scene).bodies[1], Blow(name, 2, params)
    flight, told = scene.duration - scene.params["delay"], []
    w, _, y, _ = box.pose[3:]
    for _, spin in blow.over(*permutations(range(len(blow.points)))):
        half = 0.5 * float(np.linalg.norm(spin)) * flight
        across = math.sin(half) * spin[[0, 2]] / np.linalg.norm(spin)
        # The part across the plane of a turn by the spin after the box's own about y.
        tilt = math.hypot(w * across[0] - y * across[1], w * across[1] + y * across[0])
        told.append(2.0 * tilt * math.hypot(*scene.bodies[1].shape.half_extents))
    assert any(found.out_of_plane == pytest.approx(each, rel=within + DT / flight) for each in told)
    assert min(told) > 1e-3
