"""Scenes: a bad number is named in one line, a good scene survives JSON, and its hash means its physics."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable
from dataclasses import replace

import pytest

from adapters.needs import needs
from adapters.scene import (
    Body,
    Box,
    Disc,
    HalfSpace,
    Harmonic,
    Pair,
    Scene,
    SceneError,
    Sphere,
    check_body,
    scene_from_dict,
)

FLOOR = Body("floor", HalfSpace((0.0, 1.0), 0.0), motion="fixed")
BALL = Body("ball", Disc(0.5), 1.0, 0.125, (0.0, 1.0, 0.0))


def scene(*bodies: Body, pairs: tuple[Pair, ...] = (), **changes: object) -> Scene:
    base: dict = {
        "name": "test",
        "version": 1,
        "dimension": 2,
        "bodies": bodies or (FLOOR, BALL),
        "pairs": pairs or (Pair(restitution=0.5, friction=0.3),),
        "gravity": (0.0, -9.81),
        "duration": 1.0,
    }
    return Scene(**{**base, **changes})


def spatial(body: Body) -> Scene:
    return scene(body, dimension=3, gravity=(0.0, 0.0, -9.81))


NAN, INF = math.nan, math.inf
FAULTS: list[tuple[Callable[[], object], str]] = [
    (lambda: scene(dimension=4), "dimension"),
    (lambda: scene(duration=0.0), "duration"),
    (lambda: scene(duration=-1.0), "duration"),
    (lambda: scene(duration=NAN), "duration"),
    (lambda: scene(duration=True), "duration"),
    (lambda: scene(gravity=(0.0, NAN)), "gravity"),
    (lambda: scene(gravity=(0.0, 0.0, -9.81)), "gravity"),
    (lambda: scene(gravity=[0.0, -9.81]), "gravity"),
    (lambda: scene(bodies=()), "bodies"),
    (lambda: scene(FLOOR, BALL, BALL), "bodies"),
    (lambda: scene(replace(BALL, name="*")), "bodies"),
    (lambda: scene(replace(BALL, name="")), "bodies"),
    (lambda: scene(replace(BALL, mass=0.0)), "ball.mass"),
    (lambda: scene(replace(BALL, mass=-1.0)), "ball.mass"),
    (lambda: scene(replace(BALL, mass=NAN)), "ball.mass"),
    (lambda: scene(replace(BALL, mass=INF)), "ball.mass"),
    (lambda: scene(replace(BALL, mass="1")), "ball.mass"),
    (lambda: scene(replace(BALL, inertia=0.0)), "ball.inertia"),
    (lambda: scene(replace(BALL, inertia=(1.0, 1.0, 1.0))), "ball.inertia"),
    (lambda: scene(replace(BALL, shape=Disc(0.0))), "ball.shape.radius"),
    (lambda: scene(replace(BALL, shape=Disc(NAN))), "ball.shape.radius"),
    (lambda: scene(replace(BALL, shape=Box((0.5, -0.5)))), "ball.shape.half_extents"),
    (lambda: scene(replace(BALL, shape=Box((0.5, 0.5, 0.5)))), "ball.shape.half_extents"),
    (lambda: scene(replace(BALL, shape=Sphere(0.5))), "ball.shape"),
    (lambda: scene(replace(BALL, pose=(0.0, 1.0))), "ball.pose"),
    (lambda: scene(replace(BALL, pose=(0.0, INF, 0.0))), "ball.pose"),
    (lambda: scene(replace(BALL, twist=(0.0, NAN, 0.0))), "ball.twist"),
    (lambda: scene(replace(BALL, force=(1.0,))), "ball.force"),
    (lambda: scene(replace(BALL, torque=(1.0, 2.0))), "ball.torque"),
    (lambda: scene(replace(BALL, motion="flying")), "ball.motion"),
    (lambda: scene(replace(BALL, motion="fixed", twist=(1.0, 0.0, 0.0))), "ball.twist"),
    (lambda: scene(replace(FLOOR, shape=HalfSpace((0.0, 2.0)))), "floor.shape.normal"),
    (lambda: scene(replace(FLOOR, shape=HalfSpace((0.0, 1.0), NAN))), "floor.shape.offset"),
    (lambda: scene(replace(FLOOR, shape=HalfSpace((0.0, 0.0, 1.0)))), "floor.shape.normal"),
    (lambda: scene(replace(FLOOR, motion="free")), "floor.motion"),
    (lambda: scene(replace(FLOOR, pose=(0.0, 1.0, 0.0))), "floor.pose"),
    (lambda: scene(pairs=(Pair(restitution=1.2),)), "restitution"),
    (lambda: scene(pairs=(Pair(restitution=-0.1),)), "restitution"),
    (lambda: scene(pairs=(Pair(restitution=NAN),)), "restitution"),
    (lambda: scene(pairs=(Pair(friction=-0.1),)), "friction"),
    (lambda: scene(pairs=(Pair(friction=INF),)), "friction"),
    (lambda: spatial(Body("cube", Box((1.0, 1.0, 1.0)), 1.0, 1.0)), "cube.inertia"),
    (lambda: spatial(Body("cube", Box((1.0, 1.0, 1.0)), 1.0, (1.0, 1.0))), "cube.inertia"),  # type: ignore[arg-type]
    (lambda: spatial(Body("b", Sphere(1.0), 1.0, (1.0, 1.0, 1.0), (0.0,) * 3 + (2.0, 0.0, 0.0, 0.0))), "b.pose"),
    (lambda: spatial(Body("b", Disc(1.0), 1.0, (1.0, 1.0, 1.0))), "b.shape: a Disc cannot be used in 3-D"),
    (lambda: scene(replace(BALL, inertia=(1.0, 1.0))), "ball.inertia: needs one number"),
    (lambda: spatial(Body("b", Sphere(1.0), 1.0, 1.0)), "b.inertia: needs three principal moments"),
    (lambda: scene(replace(BALL, name="n" * 81)), f"bodies: '{'n' * 70}"),
    (lambda: scene(pairs=(Pair("ball", "wall"),)), "pair ball-wall: there is no body called 'wall'"),
    (lambda: check_body(replace(BALL, mass=-1.0), 2), "ball.mass"),
    (lambda: check_body(replace(BALL, pose=(0.0, 1.0)), 2), "ball.pose"),
]


def test_values_at_the_limits_allowed() -> None:
    scene(pairs=(Pair(restitution=1.0),))
    scene(replace(BALL, name="n" * 80))
    check_body(Body("b", Sphere(1.0), 1.0, (1.0, 1.0, 1.0)), 3)  # what a body leaves out is filled in first
    check_body(Body("b", Disc(1.0)), 2)


def test_body_and_materials_by_names() -> None:
    pairs = (Pair(friction=0.1), Pair("floor", "other", friction=0.3))
    made = scene(FLOOR, BALL, replace(BALL, name="other"), pairs=pairs)
    assert [made.index(name) for name in ("floor", "ball", "other")] == [0, 1, 2]
    material = made.material("other", "floor")
    assert (material.a, material.b, material.friction) == ("other", "floor", 0.3)
    assert {(i, j): pair.friction for i, j, pair in made.contact_pairs()} == {(0, 1): 0.1, (0, 2): 0.3, (1, 2): 0.1}


def test_drives_survive_json_and_labels_may_be_missing() -> None:
    shaken = replace(BALL, motion="prescribed", course=Harmonic((0.02, 0.01), 2.0, 0.5))
    belt = replace(FLOOR, surface_velocity=(1.0, 0.0))
    made = scene(belt, shaken)
    data = json.loads(json.dumps(made.as_dict()))
    assert scene_from_dict(data) == made and made.bodies[1].course == shaken.course
    del data["params"]
    assert scene_from_dict(data).params == {}


@pytest.mark.parametrize(("make", "field"), FAULTS, ids=[f"{k}-{field}" for k, (_, field) in enumerate(FAULTS)])
def test_refusal_of_a_bad_value_by_field(make: Callable[[], object], field: str) -> None:
    with pytest.raises(SceneError) as caught:
        make()
    assert re.match(rf"(pair [^ .:]+[.:] ?)?{re.escape(field)}", str(caught.value))
    assert "\n" not in str(caught.value)


def test_mass_and_inertia_of_bodies_that_are_not_free() -> None:
    assert scene(replace(BALL, mass=0.0, inertia=0.0, motion="prescribed")).bodies[0].mass == 0.0


def test_empty_pose_twist_and_loads_as_rest_at_the_origin() -> None:
    planar = scene(Body("a", Disc(1.0))).bodies[0]
    assert (planar.pose, planar.twist, planar.force, planar.torque) == ((0.0,) * 3, (0.0,) * 3, (0.0,) * 2, (0.0,))
    cube = spatial(Body("a", Sphere(1.0), 1.0, (1.0, 1.0, 1.0))).bodies[0]
    assert cube.pose == (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)


def test_most_specific_pair_in_any_order() -> None:
    pairs = (Pair(friction=0.1), Pair("ball", "*", friction=0.2), Pair("floor", "ball", friction=0.3))
    made = scene(FLOOR, BALL, replace(BALL, name="other"), pairs=pairs)
    assert made.material("ball", "floor").friction == made.material("floor", "ball").friction == 0.3
    assert made.material("other", "ball").friction == 0.2
    assert made.material("other", "floor").friction == 0.1


def test_a_scene_without_pairs_is_smooth_and_plastic() -> None:
    made = Scene("t", 1, 2, (FLOOR, BALL), (), (0.0, 0.0), 1.0)
    assert (made.material("floor", "ball").restitution, made.material("floor", "ball").friction) == (0.0, 0.0)


def test_free_body_in_pairs_that_can_meet() -> None:
    wall = replace(FLOOR, name="wall")
    pushed = replace(BALL, name="pushed", motion="prescribed")
    made = scene(FLOOR, wall, BALL, pushed)
    assert [(i, j) for i, j, _ in made.contact_pairs()] == [(0, 2), (1, 2), (2, 3)]


def test_a_scene_survives_json_with_its_hash() -> None:
    made = scene(FLOOR, replace(BALL, twist=(1.0, -2.0, 0.1), torque=(0.7,)), params={"e": 0.5})
    again = scene_from_dict(json.loads(json.dumps(made.as_dict())))
    assert again == made and again.hash() == made.hash()


def test_the_hash_is_the_same_in_every_process() -> None:
    # Pinned: it identifies stored results. A change here is a change of every key in every store.
    assert scene().hash() == scene().hash()
    assert len(scene().hash()) == 16 and int(scene().hash(), 16) >= 0
    assert scene().hash() == PINNED


@pytest.mark.parametrize(
    "changed",
    [
        scene(gravity=(0.0, -9.80)),
        scene(duration=1.1),
        scene(version=2),
        scene(pairs=(Pair(restitution=0.5, friction=math.nextafter(0.3, 1.0)),)),
        scene(FLOOR, replace(BALL, mass=math.nextafter(1.0, 2.0))),
        scene(FLOOR, replace(BALL, shape=Box((0.5, 0.5)))),
        scene(FLOOR, replace(BALL, motion="prescribed")),
        scene(BALL, FLOOR),
    ],
)
def test_any_change_of_physics_changes_the_hash(changed: Scene) -> None:
    assert changed.hash() != scene().hash()


def test_equal_scenes_have_equal_hashes() -> None:
    whole = scene(FLOOR, replace(BALL, mass=1, pose=(-0.0, 1, 0)), gravity=(-0.0, -9.81), duration=1)
    assert whole == scene() and whole.hash() == scene().hash()


def test_labels_do_not_change_the_hash() -> None:
    assert scene(params={"height": 3.0}).hash() == scene().hash()


def test_change_of_a_validated_scene() -> None:
    with pytest.raises(AttributeError):
        scene().duration = 2.0  # type: ignore[misc]


def test_needs_follow_from_the_scene() -> None:
    box = Body("box", Box((0.25, 0.5)), 4.0, 1.0, (0.0, 0.5, 0.0))
    resting = needs(scene(FLOOR, box, pairs=(Pair(friction=0.5),)))
    assert (resting.regime, resting.rotation, resting.slide) == ("rest", True, False)
    assert resting.smallest_size == 0.5
    assert needs(scene()).regime == "impact"
    assert needs(scene(FLOOR, BALL, pairs=(Pair(),), gravity=(0.0, 0.0))).regime == "impact"
    assert needs(scene(BALL)).regime == "free"
    assert needs(scene(FLOOR, box, replace(BALL, mass=0.04))).mass_ratio == pytest.approx(100.0)
    assert needs(scene(FLOOR, replace(BALL, twist=(3.0, 0.0, 0.0)))).slide
    assert needs(scene(FLOOR, BALL, gravity=(1.0, -9.0))).slide
    assert needs(scene()).top_speed == 9.81


PINNED = "43a280c6c7e6f74a"


def test_contradicting_entries_of_a_pair_that_never_meets():
    wall = Body("wall", HalfSpace((1.0, 0.0), 0.0), motion="fixed")
    doubtful = (Pair("wall", "*", 0.5, 0.1), Pair("*", "floor", 0.2, 0.1), Pair("ball", "floor"), Pair("ball", "wall"))
    posed = scene(FLOOR, wall, BALL, pairs=doubtful)
    with pytest.raises(SceneError, match=r"^pair wall-floor: 2 entries contradict each other"):
        posed.material("wall", "floor")


def test_invalid_name_cut_to_the_allowed_length():
    with pytest.raises(SceneError, match="cannot be the name of a body") as caught:
        scene(FLOOR, replace(BALL, name="b" * 500))
    assert len(str(caught.value)) < 300


def test_invalid_quaternion_shown_whole():
    with pytest.raises(SceneError, match=re.escape("the quaternion (1.0, 0.25, 0.0, 0.0) must have length 1")):
        spatial(Body("ball", Sphere(0.5), 1.0, (0.1,) * 3, (0.0, 0.0, 1.0, 1.0, 0.25, 0.0, 0.0)))


def test_restitution_above_one_only_where_declared():
    gains = (Pair(restitution=1.5, friction=0.0),)
    assert scene(pairs=gains, gaining=True).material("ball", "floor").restitution == 1.5
    with pytest.raises(SceneError, match="restitution"):
        scene(pairs=gains)
