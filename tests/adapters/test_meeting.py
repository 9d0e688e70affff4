"""Who can meet: bounds that hold whatever the contacts do, and engines that refuse no pair which never meets."""

import math

import pytest

from adapters.needs import needs
from adapters.registry import load
from adapters.scene import Body, Disc, HalfSpace, Harmonic, Pair, Scene
from adapters.scene.lift import lift
from adapters.scene.meeting import meeting_pairs, representable
from validation.catalogue import CATALOGUE


def ball(name, x, y=0.5, v=0.0, mass=1.0, spin=0.0, **more):
    return Body(name, Disc(0.5), mass, 0.125 * mass, (x, y, 0.0), (v, 0.0, spin), **more)


FLOOR = Body("floor", HalfSpace((0.0, 1.0), 0.0), motion="fixed")


def met(*bodies, gravity=0.0, duration=1.0):
    scene = Scene("toy", 1, 2, bodies, (Pair(),), (0.0, -gravity), duration)
    return {frozenset((bodies[i].name, bodies[j].name)) for i, j, _ in meeting_pairs(scene)}


def pair(*names):
    return frozenset(names)


def test_distant_bodies_never_meet_and_near_ones_do():
    assert met(ball("a", 0.0), ball("b", 10.0)) == set()
    assert met(ball("a", 0.0, v=5.0), ball("b", 10.0)) == {pair("a", "b")}
    assert met(ball("a", 0.0, v=4.0), ball("b", 10.0)) == set()
    assert met(ball("a", 0.0, y=9.0), FLOOR) == set()
    assert met(ball("a", 0.0, y=9.0), FLOOR, gravity=9.81) == {pair("a", "floor")}


def test_spin_load_and_gravity_as_possible_speed():
    assert met(ball("a", 0.0, spin=20.0), ball("b", 10.0)) == {pair("a", "b")}
    assert met(ball("a", 0.0, force=(6.0, 0.0)), ball("b", 10.0)) == {pair("a", "b")}
    assert met(ball("a", 0.0, torque=(3.0,)), ball("b", 10.0)) == {pair("a", "b")}


def test_momentum_passed_on_by_a_struck_body():
    struck = ball("a", 0.0, v=3.0), ball("b", 2.0)
    assert met(*struck, ball("c", 20.0)) == {pair("a", "b")}
    light = ball("a", 0.0, v=3.0), ball("b", 2.0, mass=0.01)
    assert met(*light, ball("c", 20.0)) == {pair("a", "b"), pair("b", "c")}


def test_momentum_passed_on_by_fixed_and_driven_bodies():
    lanes = ball("a", 0.0, v=1.0), ball("b", 50.0, v=1.0)
    assert met(FLOOR, *lanes) == {pair("a", "floor"), pair("b", "floor")}
    belt = Body("belt", HalfSpace((0.0, 1.0), 0.0), motion="fixed", surface_velocity=(1.0, 0.0))
    assert pair("a", "b") in met(belt, *lanes)
    course = Harmonic((0.0, 1.0), 1.0)
    table = Body("table", HalfSpace((0.0, 1.0), -3.0), motion="prescribed", course=course)
    assert met(table, *lanes) == {pair("a", "table"), pair("b", "table"), pair("a", "b")}
    assert met(table, *lanes, duration=0.05) == set()


def test_no_contact_of_bodies_that_cannot_meet():
    """Contacts that a healthy engine reports, in every scene that it plays in the plane."""
    pytest.importorskip("pymunk")
    engine, seen = load("chipmunk"), 0
    for name in ("pair_matrix", "head_on", "cradle", "galperin", "pinch", "pyramid", "off_centre"):
        canonical = CATALOGUE[name]
        scene = canonical.scene(2, dict(canonical.representative))
        allowed = {(i, j) for i, j, _ in meeting_pairs(scene)}
        settings = {s.name: s.value for s in engine.settings("tuned", needs(scene), 1 / 240)}
        made = engine.build(scene, 1 / 240, settings)
        for _ in range(math.ceil(scene.duration * 240)):
            made.advance(1)
            touched = made.contacts()
            seen += len(touched.a)
            assert set(zip(touched.a.tolist(), touched.b.tolist(), strict=True)) <= allowed
    assert seen > 100


#: Pairs of three balls that are no products: a-b rough, b-c rough, a-c smooth; c is far away, or near.
TABLE = (Pair("a", "b", 0.0, 0.5), Pair("b", "c", 0.0, 0.5), Pair("a", "c", 0.0, 0.0))


@pytest.mark.parametrize("engine", ["chipmunk", "bullet"])
def test_table_refused_only_for_pairs_that_meet(engine):
    adapter = load(engine) if pytest.importorskip({"chipmunk": "pymunk", "bullet": "pybullet"}[engine]) else None
    for x, refused in ((4.0, True), (400.0, False)):
        scene = Scene("toy", 1, 2, (ball("a", 0.0, v=1.0), ball("b", 1.5), ball("c", x)), TABLE, (0.0, 0.0), 1.0)
        posed = scene if engine == "chipmunk" else lift(scene)
        assert bool(adapter.refuses(posed, "tuned")) is refused
    # Bullet clamps friction at 10.
    rough = (Pair("a", "b", 0.0, 0.5), Pair("*", "*", 0.0, 50.0))
    scene = Scene("toy", 1, 2, (ball("a", 0.0, v=1.0), ball("b", 1.5), ball("c", 400.0)), rough, (0.0, 0.0), 1.0)
    assert not adapter.refuses(scene if engine == "chipmunk" else lift(scene), "tuned")


def test_all_pairs_tried_before_single_ones():
    scene = Scene("toy", 1, 2, (ball("a", 0.0), ball("b", 10.0)), (Pair(),), (0.0, 0.0), 1.0)
    asked = []

    def solve(pairs):
        asked.append(len(pairs))
        return [1.0, 2.0]

    assert representable(scene, solve) == [1.0, 2.0] and asked == [1]
    assert representable(scene, lambda pairs: None) == [0.0, 0.0]
