"""What a scene needs and which pair values meet in it: the facts that profiles choose their settings from."""

import itertools
import math
import random
from dataclasses import replace

import pytest

from adapters.needs import Needs, needs
from adapters.scene import Body, Box, Disc, HalfSpace, Harmonic, Polygon, Scene, SceneError
from adapters.scene.materials import Materials, Pair

FLOOR = Body("floor", HalfSpace((0.0, 1.0), 0.0), motion="fixed")


def ball(name="ball", **changes):
    return Body(name, **{"shape": Disc(0.25), "mass": 2.0, "inertia": 0.5, "pose": (0.0, 1.0, 0.0), **changes})


def scene(*bodies, pair=None, gravity=(0.0, -8.0), duration=0.5):
    return Scene("s", 1, 2, bodies, (pair or Pair(restitution=0.5),), gravity, duration)


def test_what_a_scene_needs_fact_by_fact():
    moving = ball(twist=(3.0, -4.0, 0.0))
    assert needs(scene(FLOOR, moving, ball("heavy", mass=8.0), pair=Pair(restitution=0.75, friction=0.25))) == Needs(
        dimension=2, rotation=True, friction=0.25, restitution=0.75, regime="impact", slide=True, smallest_size=0.5,
        top_speed=5.0 + 8.0 * 0.5, mass_ratio=4.0, gravity=8.0, pull=8.0,
    )  # fmt: skip


def test_no_needs_without_free_bodies():
    assert needs(scene(FLOOR)) == Needs(2, False, 0.0, 0.0, "free", False, 1.0, 4.0, 1.0, 8.0, 8.0)
    still = needs(scene(ball(), gravity=(0.0, 0.0)))
    assert still == Needs(2, False, 0.0, 0.0, "free", False, 0.5, 0.0, 1.0, 0.0, 0.0)


def test_need_of_a_force_without_gravity():
    pressed = ball(force=(-6.0, 8.0))
    assert needs(scene(FLOOR, pressed)).pull == 8.0
    assert needs(scene(FLOOR, pressed, ball("other"), gravity=(0.0, 0.0))).pull == 5.0
    assert needs(scene(FLOOR, ball(), gravity=(0.0, 0.0))).pull == 0.0
    assert needs(scene(FLOOR, gravity=(0.0, 0.0))).pull == 0.0  # nobody is there to be pulled


@pytest.mark.parametrize(
    ("body", "pair", "turns"),
    [
        (ball(), Pair(), False),
        (ball(), Pair(friction=0.01), True),
        (ball(), Pair(friction=1.0), True),
        (ball(twist=(0.0, 0.0, 0.5)), Pair(), True),
        (ball(torque=(0.5,)), Pair(), True),
        (ball(twist=(0.5, 0.0, 0.0)), Pair(), False),
        (ball(shape=Box((0.25, 0.25))), Pair(), True),
    ],
)
def test_causes_that_turn_a_body(body, pair, turns):
    assert needs(scene(FLOOR, body, pair=pair)).rotation is turns
    fixed = Body("wall", Box((0.25, 0.25)), motion="fixed", pose=(9.0, 9.0, 0.0))
    assert needs(scene(FLOOR, fixed, ball(), pair=Pair())).rotation is False


@pytest.mark.parametrize(
    ("gravity", "force", "e", "regime"),
    [((0.0, -8.0), (0.0, 0.0), 0.0, "rest"), ((0.0, -0.5), (0.0, 0.0), 0.0, "rest"),
     ((0.0, 0.0), (0.0, 1.0), 0.0, "rest"), ((0.0, 0.0), (0.0, 0.0), 0.0, "impact"),
     ((0.0, -8.0), (0.0, 0.0), 0.5, "impact")],
)  # fmt: skip
def test_rebound_need_of_bodies_at_rest_under_a_load(gravity, force, e, regime):
    assert needs(scene(FLOOR, ball(force=force), pair=Pair(restitution=e), gravity=gravity)).regime == regime


@pytest.mark.parametrize(
    ("changes", "friction", "slides"),
    [
        ({"twist": (0.5, 0.0, 0.0)}, 0.25, True),
        ({"twist": (0.5, 0.0, 0.0)}, 0.0, False),  # nothing rubs
        ({"twist": (0.0, -5.0, 0.0)}, 0.25, False),
        ({"twist": (0.0, 0.0, 0.5)}, 0.25, True),
        ({"force": (0.5, 0.0)}, 0.25, True),
        ({"force": (0.0, 0.5)}, 0.25, False),
        ({"twist": (1e-9, -1.0, 0.0)}, 0.25, True),
        ({"twist": (1e-13, -1.0, 0.0)}, 0.25, False),  # round-off
        ({"twist": (1e-7, -1e6, 0.0)}, 0.25, False),  # round-off of a million
    ],
)
def test_sliding_by_friction_with_motion_or_a_tangential_load(changes, friction, slides):
    assert needs(scene(FLOOR, ball(**changes), pair=Pair(friction=friction))).slide is slides


@pytest.mark.parametrize(
    "mover", [{"surface_velocity": (0.5, 0.0)}, {"motion": "prescribed", "course": Harmonic((0.02, 0.0), 2.0)}]
)
def test_sliding_on_running_surfaces_and_shaken_supports(mover):
    moved = replace(FLOOR, **mover)
    assert needs(scene(moved, ball(), pair=Pair(friction=0.25))).slide is True
    assert needs(scene(FLOOR, ball(), pair=Pair(friction=0.25))).slide is False


def test_no_slide_under_a_load_normal_to_a_tilted_face():
    for k in range(1, 400):
        normal = (math.sin(0.005 * k), math.cos(0.005 * k))
        tilted = Body("ramp", HalfSpace(normal, 0.0), motion="fixed")
        for gravity, slides in ((tuple(-9.81 * n for n in normal), False), ((0.0, -9.81), True)):
            assert needs(scene(tilted, ball(), pair=Pair(friction=0.5), gravity=gravity)).slide is slides


@pytest.mark.parametrize(
    ("platform", "twist", "gravity", "slides"),
    [
        ({"shape": Box((2.0, 0.5))}, (0.5, 0.0, 0.0), (0.0, -8.0), True),
        ({"shape": Box((2.0, 0.5))}, (0.5, 0.0, 0.0), (0.0, -1.0), True),
        ({"shape": Box((2.0, 0.5))}, (0.0, -0.5, 0.0), (0.0, -8.0), False),  # it falls
        ({"shape": Box((2.0, 0.5))}, (0.5, 0.0, 0.0), (0.0, 0.0), False),  # nothing presses it down
        ({"shape": Box((2.0, 0.5))}, (0.3, -0.4, 0.0), (6.0, -8.0), False),  # it falls, aslant
        ({"shape": Box((2.0, 0.5))}, (0.5, 0.0, 0.0), (6.0, -8.0), True),
        ({"shape": Box((2.0, 0.5)), "motion": "free", "mass": 1.0}, (0.5, 0.0, 0.0), (0.0, -8.0), False),
        ({"shape": Disc(0.5)}, (0.5, 0.0, 0.0), (0.0, -8.0), False),
    ],
)
def test_sliding_need_of_level_motion_over_a_fixed_box(platform, twist, gravity, slides):
    under = Body("platform", **{"motion": "fixed", **platform})
    assert needs(scene(under, ball(twist=twist), pair=Pair(friction=0.25), gravity=gravity)).slide is slides


@pytest.mark.parametrize(("speed", "slides"), [(1e-12, False), (1.5e-12, True)])
def test_round_off_of_slow_bodies_at_one_metre_a_second(speed, slides):
    assert needs(scene(FLOOR, ball(twist=(speed, 0.0, 0.0)), pair=Pair(friction=0.25))).slide is slides


# ---- materials -----------------------------------------------------------------------------------------------------


def by_hand(pairs, free):
    """Values of all pairs, one by one: the most specific entries say it, and one value must be said."""

    def said(a, b):
        both = {(p.restitution, p.friction) for p in pairs if {p.a, p.b} == {a, b} and "*" not in (p.a, p.b)}
        one = {(p.restitution, p.friction) for p in pairs if ("*" in (p.a, p.b)) and {p.a, p.b} & {a, b}}
        none = {(p.restitution, p.friction) for p in pairs if p.a == p.b == "*"}
        return both or one or none or {(0.0, 0.0)}

    found = set()
    for a, b in itertools.combinations(free, 2):
        if free[a] or free[b]:
            values = said(a, b)
            if len(values) > 1:
                return f"{a}-{b}"
            found |= values
    return found


def test_values_of_all_pairs_equal_to_those_of_single_pairs():
    """Bodies that no entry tells apart are looked at together; that must never change what is found."""
    dice = random.Random(12)
    agreed = refused = 0
    for _ in range(3000):
        free = {name: dice.random() < 0.6 for name in "abcdef"[: dice.randint(1, 6)]}
        names = [*free, "*"]
        pairs = tuple(
            Pair(dice.choice(names), dice.choice(names), dice.choice((0.0, 0.5)), dice.choice((0.0, 0.25)))
            for _ in range(dice.randint(0, 7))
        )
        pairs = tuple(p for p in pairs if p.a != p.b or p.a == "*")
        expected = by_hand(pairs, free)
        if isinstance(expected, str):
            refused += 1
            with pytest.raises(SceneError, match=r"^pair \w-\w: \d entries contradict each other"):
                Materials(pairs).materials(free)
        else:
            agreed += 1
            assert Materials(pairs).materials(free) == expected, (pairs, free)
    assert agreed > 500 and refused > 500


def test_conflicting_default_entries_of_materials():
    free = {"a": True, "b": False}
    assert Materials((Pair(friction=0.5), Pair(friction=0.5))).materials(free) == {(0.0, 0.5)}
    with pytest.raises(SceneError, match="pair a-b: 2 entries contradict each other; give an entry that names both"):
        Materials((Pair(friction=0.5), Pair(friction=0.25))).materials(free)
    named = (Pair(friction=0.5), Pair(friction=0.25), Pair("b", "a", 0.75, 0.0))
    assert Materials(named).materials(free) == {(0.75, 0.0)}


def test_contradiction_about_a_pair_that_no_entry_names():
    """a-b and a-c are named and agree; b-c is what two entries say different things of."""
    pairs = (Pair("a", "b", 0.5), Pair("a", "c", 0.5), Pair("b", "*", 0.25), Pair("c", "*", 0.75), Pair("a", "*", 0.25))
    with pytest.raises(SceneError, match="pair b-c: 2 entries"):
        Materials(pairs).materials(dict.fromkeys("abc", True))
    alone = (Pair("*", "*", 0.5), Pair("*", "*", 0.25), Pair("a", "b", 0.125), Pair("a", "c", 0.125))
    with pytest.raises(SceneError, match="pair b-c: 2 entries"):
        Materials(alone).materials(dict.fromkeys("abc", True))


def test_order_of_entries_with_both_one_and_no_name():
    said = Materials((Pair("*", "*", 0.125), Pair("a", "*", 0.25), Pair("*", "b", 0.25), Pair("a", "b", 0.5))).said
    assert said("a", "b") == said("b", "a") == {(0.5, 0.0)}
    assert said("a", "c") == said("c", "b") == {(0.25, 0.0)}
    assert said("c", "d") == {(0.125, 0.0)}
    assert Materials(()).said("a", "b") == frozenset()


def test_hull_need_of_polygons_and_not_of_boxes():
    corners = ((-0.5, -0.5), (0.5, -0.5), (0.0, 1.0))
    assert not needs(scene(FLOOR, ball(shape=Box((0.25, 0.25))))).hulls
    assert needs(scene(FLOOR, ball(shape=Polygon(corners)))).hulls
    assert needs(scene(ball(), Body("step", Polygon(corners), pose=(0.0, 0.0, 0.0), motion="fixed"))).hulls
