"""The Box3D adapter, on small scenes with known answers, and reasons of known failures that no setting switches off."""

import math
from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest
from driven import FLOOR, driven, measured_of, resting
from test_rebounds_of_rapier import Blow

from adapters.box3d import Box3DEngine
from adapters.conformance import items
from adapters.engine import EngineError
from adapters.needs import needs
from adapters.scene import Body, Box, Pair, Scene, Sphere
from adapters.stepping import posed_for
from validation.catalogue import CATALOGUE

pytestmark = pytest.mark.optional("box3d")
ENGINE = Box3DEngine()
DT = 1.0 / 240.0
settings, drive = driven(ENGINE, "default")


@pytest.mark.parametrize("item", items(ENGINE), ids=str)
def test_conformance(item):
    item.hold()


def test_default_is_what_a_fresh_world_holds():
    from robox3d.core.world import ffi, lib

    world, chosen = lib.b3DefaultWorldDef(), settings(resting())
    assert chosen["hertz"] == world.contactHertz and chosen["damping_ratio"] == world.contactDampingRatio
    assert chosen["push_speed"] == world.contactSpeed and chosen["maximum_speed"] == world.maximumLinearSpeed
    assert chosen["restitution_threshold"] == world.restitutionThreshold
    assert chosen["continuous"] == world.enableContinuous
    made = lib.b3CreateWorld(ffi.addressof(world))
    assert chosen["recycle_distance"] == pytest.approx(lib.b3World_GetContactRecycleDistance(made))
    assert chosen["warm_starting"] == lib.b3World_IsWarmStartingEnabled(made)
    assert chosen["fast_rotation"] == lib.b3DefaultBodyDef().allowFastRotation
    lib.b3DestroyWorld(made)


@pytest.mark.parametrize(
    ("changes", "field"),
    [({"substeps": 0}, "substeps"), ({"hertz": -1.0}, "hertz"), ({"damping_ratio": math.inf}, "damping_ratio"),
     ({"continuous": 1}, "continuous"), ({"recycle_distance": "0"}, "recycle_distance"), ({"slop": 0.1}, "slop"),
     ({"units_per_metre": 0.0}, "units_per_metre"), ({"push_speed": math.nan}, "push_speed")],
)  # fmt: skip
def test_refusal_of_a_bad_setting_by_name(changes, field):
    with pytest.raises(EngineError, match=rf"^{field}[^\n]*\Z"):
        ENGINE.build(resting(), DT, settings(resting(), **changes))


@pytest.mark.parametrize("units", [1.0, 64.0])
def test_impulses_with_one_substep_and_none_with_more(units):
    many, smooth, rough = (
        drive(resting(mu), substeps=count, units_per_metre=units).contacts.impulse_between(0, 1)[-60:] / DT
        for mu, count in ((0.0, 4), (0.0, 1), (0.5, 1))
    )
    assert np.isnan(many).all()
    assert smooth[:, 2].mean() == pytest.approx(3.0 * 9.81, rel=1e-3)
    assert rough[:, 2].mean() == pytest.approx(3.0 * 9.81, rel=1e-3) and np.isnan(rough[:, :2]).all()


def test_torque_in_the_first_step():
    """The engine computes moments in world axes when a body is placed, not when its mass is set."""
    box = resting(0.0, DT, torque=(0.0, 0.0, 0.4), pose=(0.0, 0.0, 9.0, 1.0, 0.0, 0.0, 0.0))
    assert drive(box).twist[-1, 1, 5] == pytest.approx(DT, rel=1e-4)


def test_each_pair_has_its_own_material():
    balls = tuple(
        Body(name, Sphere(0.5), 1.0, (0.1,) * 3, (3.0 * k, 0.0, 0.52, 1.0, 0.0, 0.0, 0.0), (0.0, 0.0, -2.0, 0, 0, 0))
        for k, name in enumerate("abc")
    )
    pairs = tuple(Pair("floor", name, e) for name, e in (("a", 0.9), ("b", 0.4), ("c", 0.0)))
    found = drive(Scene("pairs", 1, 3, (FLOOR, *balls), pairs, (0.0, 0.0, 0.0), 0.2))
    assert found.twist[-1, 1:, 2] == pytest.approx([1.8, 0.8, 0.0], abs=1e-4)


# ---- families that have no switch ------------------------------------------------------------------------------------


def slips(name, params, profile, steps):
    """Speed along the floor of a body's lowest point and of the mean of its contact's points, and the points' gaps."""
    scene = posed_for(ENGINE, CATALOGUE[name].scene(2, params))
    made = ENGINE.build(scene, DT, settings(scene, profile))
    made.advance(steps)
    k = next(k for k, body in enumerate(scene.bodies) if body.motion == "free")
    room = made.lib.b3Body_GetContactCapacity(made.bodies[k])
    held = made.ffi.new("b3ContactData[]", room)
    told = [held[n] for n in range(made.lib.b3Body_GetContactData(made.bodies[k], held, room))]
    (manifold,) = (each.manifolds[0] for each in told if made.index[each.shapeIdA.index1] == 0)
    points = [manifold.points[n] for n in range(manifold.pointCount)]
    arms = np.array([(p.anchorB.x, p.anchorB.y, p.anchorB.z) for p in points]) / made.units
    gaps, twist = np.array([p.separation for p in points]) / made.units, made.twist()[k]
    along = [abs(twist[0] + np.cross(twist[3:], arm)[0]) for arm in (arms[gaps.argmin()], arms.mean(axis=0))]
    made.close()
    return along, gaps


@pytest.mark.parametrize("profile", ["default", "tuned"])
@pytest.mark.parametrize(
    ("name", "params", "steps"),
    [("pivot", {"from": 1.0, "to": 30.0}, 200), ("domino", {}, 60),
     ("rocking_block", {"aspect": 0.5, "tilt": 0.7}, 200),
     ("tilt_table", {"ratio": 1.1, "aspect": 0.3}, 220), ("painleve", {"ratio": 1.2}, 60)],
)  # fmt: skip
def test_friction_at_the_mean_of_near_and_far_points(name, params, steps, profile):
    """The edge on which a body tips slides; the mean of its corners stands still, half of which are in the air."""
    (edge, middle), gaps = slips(name, params, profile, steps)
    assert gaps.max() > 0.02 and abs(gaps.min()) < 1e-3
    assert edge > 5e-3 > 20.0 * middle or edge > 100.0 * middle


def test_card_held_half_way_up():
    """Friction of a foot acts .8 m above it, so that a tent which should stand falls."""
    (foot, middle), gaps = slips("card_tent", {}, "tuned", 60)
    assert gaps.max() > 1.0 and foot > 1.2 * middle > 0.1


def test_tipping_on_a_tilted_table_with_kept_points():
    """Not within the run as shipped, and at its time with points found in every step."""
    params = {"ratio": 1.1, "aspect": 0.3}
    assert measured_of(ENGINE, "tilt_table", "default", 2, params)["passing_time"] is None
    found = measured_of(ENGINE, "tilt_table", "default", 2, params, recycle_distance=0.0)["passing_time"]
    assert found == pytest.approx(0.813, rel=0.05)


def test_falling_box_held_at_the_mean_of_its_corners():
    """Energy and v(mean) = 0 give spin by angle: w^2 (a^2 + b^2 + I/m) = 2 g drop, a = height - width sin/4."""
    params = {"from": 1.0, "to": 15.0}
    width, high = 0.5, 1.0
    start, end = (math.atan(width / high) + math.radians(params[name]) for name in ("from", "to"))
    height, across = (
        (lambda t: 0.5 * (high * math.cos(t) + width * math.sin(t))),
        (lambda t: 0.5 * (width * math.cos(t) - high * math.sin(t))),
    )
    square = (height(end) - 0.25 * width * math.sin(end)) ** 2 + across(end) ** 2 + (width**2 + high**2) / 12.0
    spin = math.sqrt(2.0 * 9.81 * (height(start) - height(end)) / square)
    found = measured_of(ENGINE, "pivot", "tuned", 2, params)["passing_spin"]
    truth = CATALOGUE["pivot"].exact(CATALOGUE["pivot"].scene(2, params))["passing_spin"]
    assert found == pytest.approx(spin, rel=0.01) and abs(truth / spin - 1.0) > 0.05


@pytest.mark.parametrize("profile", ["default", "tuned"])
@pytest.mark.parametrize(("dimension", "params"), [(2, {}), (3, {}), (2, {"e": 1.0, "tilt": 30.0})], ids=str)
def test_edge_ends_thrown_back_one_after_the_other(profile, dimension, params):
    ((velocity, spin),) = Blow("edge_drop", dimension, params).over((0, 1))
    found = measured_of(ENGINE, "edge_drop", profile, dimension, params, restitution_threshold=0.0)
    assert found["rise"] == pytest.approx(velocity[2], abs=1e-3)
    assert found["spin"] == pytest.approx(abs(spin[1]), abs=2e-3)


def test_flat_box_thrown_back_corner_by_corner():
    """With its sweeps finished, in one of the orders of four corners."""
    found = measured_of(ENGINE, "flat_box", "tuned", 2, {}, substeps=256)
    speed = CATALOGUE["flat_box"].scene(2, {}).params["v"]
    orders = list(Blow("flat_box", 2, {}).over(*permutations(range(4))))
    assert min(abs(v[2] / speed - found["rebound_ratio"]) for v, _ in orders) < 0.02


def test_rebound_of_a_rod_on_its_end_without_friction():
    params = {"e": 0.5, "mu": 0.1}
    ((velocity, spin),) = Blow("kane", 2, params).over((0, 1))
    found = measured_of(ENGINE, "kane", "tuned", 2, params, substeps=64, units_per_metre=64.0)
    for metric, value in (("rise", velocity[2]), ("ahead", velocity[0]), ("spin", -spin[1])):
        assert found[metric] == pytest.approx(value, abs=0.03), metric


@pytest.mark.parametrize("profile", ["default", "tuned"])
def test_friction_by_the_compression_impulse_only(profile):
    """Of a pair mu/(1 + e) comes out; of a ball that slips, that share of what it should lose."""
    scene = CATALOGUE["pair_matrix"].scene(2, {})
    truth = CATALOGUE["pair_matrix"].exact(scene)
    found = measured_of(ENGINE, "pair_matrix", profile, units_per_metre=64.0)
    for k in range(1, 5):
        expected = truth[f"friction[{k}]"] / (1.0 + truth[f"restitution[{k}]"])
        assert found[f"friction[{k}]"] == pytest.approx(expected, rel=1e-3)
    scene = CATALOGUE["oblique"].scene(2, {"mu": 0.1})
    right, start = CATALOGUE["oblique"].exact(scene)["forward_speed"], scene.bodies[1].twist[0]
    e = scene.material("floor", "ball").restitution
    slowed = measured_of(ENGINE, "oblique", profile, 2, {"mu": 0.1})["forward_speed"]
    assert slowed == pytest.approx(start + (right - start) / (1.0 + e), rel=1e-4)


def test_energy_of_touching_balls_stopped_together():
    """Balls that meet one at a time keep it, in a row and in a rack."""
    touching, apart = ({"n": 3.0, "apart": gap} for gap in (0.0, 0.05))
    assert measured_of(ENGINE, "cradle", "tuned", 2, touching)["energy_defect"] > 0.1
    assert abs(measured_of(ENGINE, "cradle", "tuned", 2, apart)["energy_defect"]) < 1e-5
    assert abs(measured_of(ENGINE, "rack", "tuned", 2, {"rows": 1.0})["energy_defect"]) < 1e-5
    assert measured_of(ENGINE, "rack", "tuned", 2, {})["asymmetry"] > 0.1


def test_normal_on_a_wide_face():
    """By some 1e-5 of a blow at 2 m/s without friction or spin; on the side of a ball of 0.5 m the singles are 1e-7."""
    ball = Body("ball", Sphere(0.5), 1.0, (0.1,) * 3, (0.1, 0.2, 0.53, 1, 0, 0, 0), (3.0, 1.7, -2.0, 0, 0, 0))
    lean = {}
    for name, shape in (("wide", FLOOR.shape), ("narrow", Box((2.0, 2.0, 0.5)))):
        place = (0.0, 0.0, 0.0 if name == "wide" else -0.5, 1.0, 0.0, 0.0, 0.0)
        ground = Body("floor", shape, pose=place, motion="fixed")
        scene = Scene("blow", 1, 3, (ground, ball), (Pair(restitution=0.8),), (0.0, 0.0, 0.0), 0.1)
        lean[name] = np.abs(drive(scene).twist[-1, 1, :2] - (3.0, 1.7)).max()
    assert 1e-6 < lean["wide"] < 1e-4 and lean["narrow"] < 0.2 * lean["wide"]


def test_limit_of_speed_as_shipped_and_none_in_tuned():
    box = replace(resting().bodies[1], twist=(500.0, 0.0, 0.0, 0.0, 0.0, 0.0), pose=(0.0, 0.0, 9.0, 1.0, 0.0, 0.0, 0.0))
    fast = replace(resting(), bodies=(FLOOR, box), gravity=(0.0, 0.0, 0.0), duration=5 * DT)
    assert needs(fast).top_speed == 500.0
    assert drive(fast).twist[-1, 1, 0] == pytest.approx(400.0, rel=1e-6)
    assert drive(fast, "tuned").twist[-1, 1, 0] == pytest.approx(500.0, rel=1e-6)


# ---- reports of the engine's users -----------------------------------------------------------------------------------


def test_fast_balls_pass_through_each_other():
    """Balls of 0.2 m at 50 m/s: sweeps look for static bodies only; at 20 m/s they still meet."""
    for speed, after in ((20.0, -20.0), (50.0, 50.0)):
        left, right = (
            Body(name, Sphere(0.1), 1.0, (0.004,) * 3, (x, 0, 0, 1, 0, 0, 0), (v, 0, 0, 0, 0, 0))
            for name, x, v in (("left", -2.03, speed), ("right", 2.0, -speed))
        )
        scene = Scene("pass", 1, 3, (left, right), (Pair(restitution=1.0),), (0.0, 0.0, 0.0), 0.5)
        assert drive(scene, dt=1.0 / 60.0).twist[-1, 0, 0] == pytest.approx(after, rel=1e-3)


def test_compound_contact_with_the_material_of_its_first_child():
    """Of a ball on the second child of a compound shape the engine mixes friction with that of the first."""
    from robox3d.core.world import ffi, lib

    def vector(*numbers):
        return ffi.new("b3Vec3*", numbers)[0]

    seen = set()
    rule = ffi.callback("b3FrictionCallback", lambda a, i, b, j: seen.add((i, j)) or a)
    world = lib.b3DefaultWorldDef()
    world.frictionCallback = rule
    held = lib.b3CreateWorld(ffi.addressof(world))
    children = ffi.new("b3CompoundSphereDef[2]")
    for child, x, number in ((children[0], -3.0, 101), (children[1], 3.0, 202)):
        child.sphere.center, child.sphere.radius = vector(x, 0.0, 0.0), 1.0
        child.material.userMaterialId = number
    both = lib.b3CreateCompound(ffi.new("b3CompoundDef*", {"spheres": children, "sphereCount": 2}))
    shape, ground, body = lib.b3DefaultShapeDef(), lib.b3DefaultBodyDef(), lib.b3DefaultBodyDef()
    lib.b3CreateCompoundShape(lib.b3CreateBody(held, ffi.addressof(ground)), ffi.addressof(shape), both)
    body.type, body.position, shape.baseMaterial.userMaterialId = lib.b3_dynamicBody, vector(3.0, 1.5, 0.0), 7
    ball = ffi.new("b3Sphere*", {"radius": 0.5})
    lib.b3CreateSphereShape(lib.b3CreateBody(held, ffi.addressof(body)), ffi.addressof(shape), ball)
    lib.b3World_Step(held, DT, 4)
    lib.b3DestroyWorld(held)
    assert {min(pair) for pair in seen} == {7} and {max(pair) for pair in seen} == {101}


@pytest.mark.parametrize(("profile", "dt", "off"), [("default", 1.0 / 60.0, 0.022), ("tuned", DT, -0.03)])
def test_thrown_ball_turns_too_fast_or_too_slowly(profile, dt, off):
    """A ball thrown level keeps I w + m R v in every blow and rolls at 5/7 of its speed; here to a few percent."""
    ball = Body("ball", Sphere(0.1), 1.0, (0.004,) * 3, (0, 0, 1.35, 1, 0, 0, 0), (2.0, 0, 0, 0, 0, 0))
    scene = Scene("throw", 1, 3, (FLOOR, ball), (Pair(friction=0.5),), (0.0, 0.0, -9.81), 4.0)
    assert drive(scene, profile, dt).twist[-1, 1, 4] / (10.0 / 7.0 / 0.1) - 1.0 == pytest.approx(off, abs=0.004)
