"""What must not matter: maps that come back as they went, and engines of which each kind of dependence is seen."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from adapters.engine import Contacts
from adapters.scene import Body, Box, HalfSpace, Scene
from adapters.trajectory import ContactRecord, Trajectory
from validation.catalogue import CATALOGUE
from validation.cells import Slot
from validation.metrics import UNAVAILABLE
from validation.questions.invariance import (
    MOVES,
    RELATIONS,
    Allowances,
    Change,
    Refusal,
    _nudged,
    boosted,
    compare,
    floor,
    judged,
    measured,
    scales,
    size_of,
    unit_of,
)

BY_NAME = {relation.name: relation for relation in RELATIONS}
LINES = [(name, d) for name, scene in CATALOGUE.items() for d in scene.dimensions]


def start_of(scene):
    """A trajectory of two samples: the scene's own start, and the same moved and turned by what its twist says."""
    d = scene.dimension
    pose = np.array([body.pose for body in scene.bodies])
    twist = np.array([body.twist for body in scene.bodies])
    return Trajectory(np.array([0.0]), pose[None], twist[None], None, 0.01, "completed"), d


@pytest.mark.few(60)
@pytest.mark.parametrize("relation", [each for each in RELATIONS if each.name not in ("again", "fresh process")],
                         ids=lambda each: each.name)  # fmt: skip
@pytest.mark.parametrize(("name", "dimension"), LINES)
def test_transformed_motion_mapped_back(name, dimension, relation):
    scene = CATALOGUE[name].scene(dimension)
    posed = relation.pose(scene)
    if isinstance(posed, str):
        assert relation.name in ("boosted", "turned 33", "turned 90")
        return
    back = posed.back(start_of(posed.scene)[0])
    before, _ = start_of(scene)
    size = max(1.0, posed.shift)
    for index, body in enumerate(scene.bodies):
        if hasattr(body.shape, "normal"):
            continue  # lies where its normal says
        # There and back by maps that round: of where it is, as well.
        place = before.pose[0, index, :dimension]
        assert back.pose[0, index, :dimension] == pytest.approx(place, abs=1e-13 * max(size, np.abs(place).max()))
        turned = np.abs(back.pose[0, index, dimension:] @ before.pose[0, index, dimension:])
        if dimension == 3:  # a quaternion and its negative are one attitude
            assert turned == pytest.approx(1.0, abs=1e-12)
        assert back.twist[0, index] == pytest.approx(before.twist[0, index], abs=1e-13 * size)


@pytest.mark.parametrize("name", ["turned 33", "turned 90", "mirrored"])
def test_distances_under_a_map_of_space(name):
    scene = CATALOGUE["incline"].scene(3)
    posed = BY_NAME[name].pose(scene).scene
    for one, other in zip(scene.bodies, posed.bodies, strict=True):
        if hasattr(one.shape, "normal"):
            continue
        for face, moved in zip(scene.bodies, posed.bodies, strict=True):
            if hasattr(face.shape, "normal"):
                before = np.dot(face.shape.normal, one.pose[:3]) - face.shape.offset
                after = np.dot(moved.shape.normal, other.pose[:3]) - moved.shape.offset
                assert after == pytest.approx(before, abs=1e-12)
    assert math.hypot(*posed.gravity) == pytest.approx(math.hypot(*scene.gravity))


def corner(pose, twist, d, own):
    """Place and velocity of a point ``own`` that is fixed in a body, off its axes."""
    if d == 2:
        c, s = math.cos(pose[2]), math.sin(pose[2])
        arm = np.array([[c, -s], [s, c]]) @ own
        return pose[:2] + arm, twist[:2] + twist[2] * np.array([-arm[1], arm[0]])
    w, v = pose[3], pose[4:]
    arm = own + 2.0 * np.cross(v, np.cross(v, own) + w * own)
    return pose[:3] + arm, twist[:3] + np.cross(twist[3:], arm)


@pytest.mark.parametrize("name", ["turned 33", "mirrored"])
@pytest.mark.parametrize("dimension", [2, 3])
def test_points_of_turning_bodies_under_a_map(name, dimension):
    """A wrong sign of a spin that goes forth and back would cancel: here it does not."""
    if dimension == 2:
        body = Body("box", Box((0.5, 0.25)), 1.0, 0.1, (1.0, 2.0, 0.7), (0.5, -0.25, 3.0))
    else:
        half = 0.35
        attitude = (math.cos(half), 0.6 * math.sin(half), 0.0, 0.8 * math.sin(half))
        body = Body("box", Box((0.5, 0.25, 0.1)), 1.0, (0.1, 0.1, 0.1), (1.0, 2.0, 3.0, *attitude),
                    (0.5, -0.25, 1.0, 3.0, -2.0, 1.0))  # fmt: skip
    posed = BY_NAME[name].pose(Scene("toy", 1, dimension, (body,), (), (0.0,) * dimension, 1.0))
    if isinstance(posed, str):
        assert dimension == 2 and name == "turned 33"
        return
    place, speed = corner(np.array(body.pose), np.array(body.twist), dimension, np.array([0.3, 0.2, 0.1][:dimension]))
    mapped = posed.scene.bodies[0]
    own = np.array([-0.3 if name == "mirrored" else 0.3, 0.2, 0.1][:dimension])
    angle = math.radians(33.0)
    world = np.diag([-1.0, 1.0, 1.0][:dimension]) if name == "mirrored" else np.array(
        [[math.cos(angle), -math.sin(angle), 0.0], [math.sin(angle), math.cos(angle), 0.0], [0.0, 0.0, 1.0]]
    )  # fmt: skip
    found = corner(np.array(mapped.pose), np.array(mapped.twist), dimension, own)
    assert found[0] == pytest.approx(world @ place) and found[1] == pytest.approx(world @ speed)


@pytest.mark.parametrize(("name", "dimension"), LINES)
def test_place_of_a_bystander(name, dimension):
    """Between walls that face each other their directions cancel: it stands beside the scene, not on its first body."""
    scene = CATALOGUE[name].scene(dimension)
    far = BY_NAME["bystander"].pose(scene).scene.bodies[-1]
    size = size_of(scene)
    place = np.array(far.pose[:dimension])
    for body in scene.bodies:
        if isinstance(body.shape, HalfSpace):
            assert place @ body.shape.normal - body.shape.offset >= 0.0
        elif body.motion == "free":
            assert np.linalg.norm(place - body.pose[:dimension]) > 40.0 * size


def test_no_place_for_a_bystander_between_closing_walls():
    scene = CATALOGUE["rod_gas"].scene(2)
    walls = [
        Body(f"w{k}", HalfSpace((math.cos(angle), math.sin(angle)), -9.0), motion="fixed")
        for k, angle in enumerate((0.5 * math.pi, 1.25 * math.pi, 1.75 * math.pi))
    ]
    closed = replace(scene, bodies=(*walls, *scene.bodies[2:]))
    assert isinstance(BY_NAME["bystander"].pose(closed), str)


def test_signs_of_contacts_of_renumbered_bodies():
    scene = CATALOGUE["head_on"].scene(2)
    posed = BY_NAME["renumbered"].pose(scene)
    rows = Contacts.from_rows([(0, 1, (0.0, 0.0), (1.0, 0.0), (2.0, 0.5), -1e-3)], 2)
    record = ContactRecord(np.array([0]), np.array([0, 1]), rows)
    found = posed.back(replace(start_of(posed.scene)[0], contacts=record)).contacts.rows
    last = len(scene.bodies) - 1
    assert (found.a[0], found.b[0]) == (last - 1, last)
    assert found.normal[0].tolist() == [-1.0, 0.0] and found.impulse[0].tolist() == [-2.0, -0.5]


BASE = {"speed": (2.0, ""), "count": (0.0, ""), "absent": (None, "why")}


def test_lost_digits_of_distant_positions_not_required():
    change = {"speed": (2.0 + 1e-11, ""), "count": (0.0, "")}
    floors = dict.fromkeys(BASE, 0.0)
    assert not judged("moved", BASE, change, Allowances(floors)).holds
    assert judged("moved", BASE, change, Allowances(floors, coarser=1024.0)).holds
    assert not judged(
        "moved", BASE, {"speed": (2.0 + 1e-10, ""), "count": (0.0, "")}, Allowances(floors, coarser=1024.0)
    ).holds


def test_json_of_any_measured_numbers():
    base = {"load": (np.float64(2.0), "")}
    found = judged("mirrored", base, {"load": (np.float64(2.0), "")},
                   Allowances({"load": 0.0}, {"load": np.float64(1.0)}))  # fmt: skip
    assert json.dumps([found.holds, found.change, found.allowed]) == "[true, 0.0, 0.0010000000000284217]"


def test_change_judged_against_moved_starts():
    floors = floor(BASE, [{"speed": (2.0 + 1e-9, ""), "count": (0.0, "")}, {"speed": (2.0, ""), "count": (0.0, "")}])
    assert floors == {"speed": pytest.approx(1e-9), "count": 0.0, "absent": 0.0}
    good = judged("mirrored", BASE, {"speed": (2.0 + 9e-9, ""), "count": (0.0, "")}, Allowances(floors))
    bad = judged("mirrored", BASE, {"speed": (2.0 + 11.1e-9, ""), "count": (0.0, "")}, Allowances(floors))
    assert good.holds and not bad.holds and bad.metric == "speed"
    worse = judged("mirrored", BASE, {"speed": (2.0, ""), "count": (1e-300, "")}, Allowances(floors))
    assert not worse.holds and worse.metric == "count"
    lost = judged("mirrored", BASE, {"speed": (None, "gone"), "count": (0.0, "")}, Allowances(floors))
    assert not lost.holds and math.isinf(lost.change)
    assert not judged("mirrored", BASE, "it crashed", Allowances(floors)).holds
    assert Change("boosted", refused="it has fixed or driven bodies").holds


def test_zero_defect_compared_at_the_resolution_of_checks():
    floors, answer = dict.fromkeys(BASE, 0.0), {"speed": (2.0, ""), "count": (1e-16, "")}
    assert not judged("mirrored", BASE, answer, Allowances(floors)).holds
    assert judged("mirrored", BASE, answer, Allowances(floors, {"count": 2e-13})).holds
    assert not judged("mirrored", BASE, answer, Allowances(floors, {"count": 0.9e-13})).holds


def test_chaotic_scene_is_no_break_of_its_engine():
    floors = floor(BASE, ["no answer"])
    assert judged("mirrored", BASE, {"speed": (7.0, ""), "count": (3.0, "")}, Allowances(floors)).holds


def test_moved_starts_rounded_as_distant_positions():
    scene = CATALOGUE["bounce"].scene(2)
    posed = BY_NAME["moved"].pose(scene)
    assert unit_of(scene, posed.shift) == np.spacing(posed.shift) > 100.0 * unit_of(scene, 0.0)
    assert unit_of(scene, 0.0, np.float32) == 2.0**29 * unit_of(scene, 0.0)
    single, double = (Allowances({"m": 0.0}, last=float(np.finfo(kind).eps)) for kind in (np.float32, np.float64))
    assert single.of("m", 1.0) == 2.0**29 * double.of("m", 1.0) == 64.0 * 2.0**-23


@pytest.mark.parametrize("dimension", [2, 3])
def test_moved_start_changes_distances_along_every_axis(dimension):
    """Raised together they would be as far apart as before: scenes along the floor would have no floor."""
    scene = CATALOGUE["cradle"].scene(dimension, {})
    moved = _nudged(scene, 1e-3)
    places, others = (np.array([b.pose[:dimension] for b in s.bodies if b.motion == "free"]) for s in (scene, moved))
    assert np.abs(np.diff(others - places, axis=0)) == pytest.approx(2e-3)
    assert _nudged(scene, 0.0) is scene


def test_dependence_on_order_and_side(monkeypatch):
    """An engine that pushes the body that is listed last to the right: order and mirror show it, place does not."""
    from adapters.registry import load
    from validation.questions import invariance

    pytest.importorskip("pymunk")
    real = invariance.run

    def pushed(engine, scene, dt, settings, sampling):
        found = real(engine, scene, dt, settings, sampling)
        found.twist[-1, -1, 0] += 1e-3
        found.pose[-1, -1, 0] += 1e-3
        return found

    monkeypatch.setattr(invariance, "run", pushed)
    assert load("chipmunk")
    slot = Slot("head_on", (), 2, "chipmunk", "tuned", 1 / 240)
    base = measured(slot, "again")
    floors = floor(base, [measured(slot, "again", k * 1e-16) for k in (1, -1, 16)])
    verdicts = {
        name: judged(name, base, measured(slot, name), Allowances(floors)).holds
        for name in ("again", "renumbered", "mirrored")
    }
    assert verdicts == {"again": True, "renumbered": False, "mirrored": False}


def test_real_engine_under_every_transformation():
    pytest.importorskip("pymunk")
    found = {change.relation: change for change in compare(Slot("bounce", (), 2, "chipmunk", "tuned", 1 / 240))}
    assert list(found) == [relation.name for relation in RELATIONS]
    assert found["again"].holds and found["fresh process"].holds and found["mirrored"].holds
    assert "no vertical axis" in found["turned 33"].refused and "left behind" in found["boosted"].refused


class Here:
    """Asks in this process, so that what is asked can be replaced."""

    def __enter__(self):
        return self

    def __exit__(self, *gone):
        pass

    def ask(self, question, *args, fresh=False):
        return question(*args)


def compared(monkeypatch, answers):
    """Changes of a cell of which ``answers(relation, moves, turns)`` is the spin of the bar after the blow."""
    from validation.questions import invariance

    def answer(slot, relation, moves=0.0, turns=0.0):
        return {"spin": (answers(relation, moves, turns), "")}

    monkeypatch.setattr(invariance, "measured", answer)
    monkeypatch.setattr(invariance, "Apart", Here)
    return {change.relation: change for change in compare(Slot("off_centre", (), 3, "chipmunk", "tuned", 1 / 240))}


def test_scatter_in_the_other_pose(monkeypatch):
    """Renumbered, an engine that sees no order gets the same numbers from every start."""

    def answers(relation, moves, turns):
        return 3.0 if relation == "again" else 3.0 + 1e-3 + 10.0 * moves * 1e12

    found = compared(monkeypatch, answers)
    held = {name for name, change in found.items() if change.holds and not change.refused}
    rounding = {relation.name for relation in RELATIONS if relation.rounds}
    assert rounding == {"turned 33", "turned 90", "boosted", "moved"}
    assert held == {"again", *({*found} & rounding)} - {name for name, change in found.items() if change.refused}


def test_scene_size_by_distance_and_largest_free_body():
    def box(name, x, y, half, motion="free"):
        return Body(name, Box((half, half)), pose=(x, y, 0.0), motion=motion)

    bodies = (box("left", 0.0, 1.0, 0.3), box("right", 4.0, 2.0, 0.5), box("wall", 90.0, 0.0, 9.0, "fixed"))
    scene = Scene("apart", 1, 2, bodies, (), (0.0, -9.81), 1.0)
    assert size_of(scene) == pytest.approx(4.0 + 2.0 * math.hypot(0.5, 0.5))
    assert size_of(replace(scene, bodies=(*bodies, box("high", 1.0, 9.0, 0.1)))) == pytest.approx(8.0 + math.sqrt(2.0))


@pytest.mark.parametrize(("share", "holds"), [(0.5, True), (20.0, False)])
def test_scatter_of_turned_and_moved_starts(monkeypatch, share, holds):
    """A box that lands flat scatters when it is turned in the last place, and not when it is moved."""
    size = size_of(CATALOGUE["off_centre"].scene(3))
    unit = unit_of(CATALOGUE["off_centre"].scene(3), 0.0)

    def answers(relation, moves, turns):
        scattered = 1e-6 * turns / (16.0 * unit / size)
        return 3.0 + scattered + (share * 10.0 * 1e-6 if relation == "mirrored" else 0.0)

    assert compared(monkeypatch, answers)["mirrored"].holds is holds


@pytest.mark.parametrize("dimension", [2, 3])
def test_turned_start_keeps_positions_and_turns_bodies(dimension):
    scene = CATALOGUE["cradle"].scene(dimension, {})
    turned = _nudged(scene, 0.0, 1e-5)
    free = [(one, other) for one, other in zip(scene.bodies, turned.bodies, strict=True) if one.motion == "free"]
    assert all(one.pose[:dimension] == other.pose[:dimension] for one, other in free)
    if dimension == 2:
        assert [other.pose[2] - one.pose[2] for one, other in free] == pytest.approx([1e-5, -1e-5] * (len(free) // 2))
    else:  # about all three axes by as much: half of it in each part of the quaternion
        parts = np.array([other.pose[4:] for _, other in free])
        assert parts[0] == pytest.approx([0.5e-5] * 3) and parts[1] == pytest.approx([-0.5e-5] * 3)


def test_last_digits_of_a_defect_by_its_operands():
    """Momentum that should vanish is a difference of momenta, a place at the origin one of places."""
    canonical = CATALOGUE["slide"]
    scene = canonical.scene(3)
    sizes = scales(canonical, scene, 1 / 240)
    assert sizes["stopping_distance"] == sizes["hop"] == size_of(scene)
    assert sizes["end_speed"] == max(3.0, math.sqrt(9.81 * size_of(scene)))
    assert sizes["braking"] == max(9.81, sizes["end_speed"] ** 2 / size_of(scene))
    floors, answer = {"hop": 0.0}, {"hop": (60.0 * np.finfo(float).eps * size_of(scene), "")}
    assert judged("mirrored", {"hop": (0.0, "")}, answer, Allowances(floors, sizes=sizes)).holds
    worse = {"hop": (65.0 * np.finfo(float).eps * size_of(scene), "")}
    assert not judged("mirrored", {"hop": (0.0, "")}, worse, Allowances(floors, sizes=sizes)).holds


@pytest.mark.parametrize("finish", ["diverged", "completed"])
def test_diverged_motion_told_and_not_measured(monkeypatch, finish):
    from validation.questions import invariance

    pytest.importorskip("pymunk")
    real = invariance.run
    monkeypatch.setattr(
        invariance, "run", lambda *given: replace(real(*given), finish=finish, reason="a speed beyond 1e9 m/s")
    )
    found = measured(Slot("head_on", (), 2, "chipmunk", "tuned", 1 / 240), "again")
    assert found == "a speed beyond 1e9 m/s" if finish == "diverged" else "impulse" in found


def asked_of(monkeypatch, answers, relations=()):
    """What is asked of a cell, in order, and what changed; as `compared`, with who is asked in a fresh process."""
    from validation.questions import invariance

    asked = []

    class Listening:
        def __enter__(self):
            return self

        def __exit__(self, *ended):
            asked.append("over")

        def ask(self, question, slot, relation, moves=0.0, turns=0.0, fresh=False):
            assert question is measured
            asked.append((relation, moves, turns, fresh))
            return answers(relation, moves, turns)

    monkeypatch.setattr(invariance, "Apart", Listening)
    return asked, compare(Slot("off_centre", (), 3, "chipmunk", "tuned", 1 / 240), relations)


def test_number_of_moved_and_turned_starts(monkeypatch):
    canonical = CATALOGUE["off_centre"]
    scene = canonical.scene(3)
    unit = unit_of(scene, 0.0)
    steps = [sign * k for k in MOVES for sign in (1, -1)]
    moved = [("again", k * unit, 0.0, False) for k in steps]
    turned = [("again", 0.0, k * unit / size_of(scene), False) for k in steps]

    def same(relation, moves, turns):
        return {"spin": (3.0, "")}

    asked, found = asked_of(monkeypatch, same, ["again", "fresh process", "mirrored"])
    one = ("again", 0.0, 0.0, False)
    rest = [("fresh process", 0.0, 0.0, True), ("mirrored", 0.0, 0.0, False)]
    assert asked == [one, *moved, one, *rest, "over"]
    assert [change.relation for change in found] == ["again", "fresh process", "mirrored"]
    assert all(change.holds and not change.lost and not change.refused for change in found)

    def broken(relation, moves, turns):
        return {"spin": (3.0 + 1e-9 * bool(moves) + 2e-9 * bool(turns) + (1e-3 if relation == "mirrored" else 0.0), "")}

    # In the order in which relations stand, however they were named.
    asked, found = asked_of(monkeypatch, broken, ["mirrored", "again"])
    assert asked == [one, *moved, one, ("mirrored", 0.0, 0.0, False), *turned, "over"]
    change = found[-1]
    assert (change.relation, change.metric, change.holds) == ("mirrored", "spin", False)
    assert change.change == pytest.approx(1e-3, rel=1e-9)
    bound = next(check.bound for check in canonical.checks(scene, 1 / 240) if check.metric == "spin")
    size = scales(canonical, scene, 1 / 240)["spin"]
    allowed = Allowances({"spin": 2e-9}, {"spin": bound}, {"spin": size}).of("spin", 3.0)
    assert change.allowed == pytest.approx(allowed, rel=1e-6)


def test_rounding_map_checked_by_moved_starts_before_a_break(monkeypatch):
    scene = CATALOGUE["off_centre"].scene(3)
    shift = next(each for each in RELATIONS if each.name == "turned 33").pose(scene).shift
    unit = unit_of(scene, shift)
    steps = [sign * k for k in MOVES for sign in (1, -1)]

    def answers(relation, moves, turns):
        return {"spin": (3.0 + (1e-3 + 1e-3 * bool(moves) if relation == "turned 33" else 0.0), "")}

    asked, (change,) = asked_of(monkeypatch, answers, ["turned 33"])
    assert change.holds  # its own starts scatter by as much
    assert asked[-1 - len(steps) : -1] == [("turned 33", k * unit, 0.0, False) for k in steps]


def test_unanswered_and_lost_cells_in_every_pose(monkeypatch):
    asked, found = asked_of(monkeypatch, lambda *given: "it crashed")
    assert asked == [("again", 0.0, 0.0, False), "over"]
    assert found == [Change(each.name, refused="it crashed") for each in RELATIONS]
    asked, (change,) = asked_of(
        monkeypatch, lambda relation, *more: "it hung" if relation == "mirrored" else {"spin": (3.0, "")}, ["mirrored"]
    )
    assert change == Change("mirrored", refused="it hung", lost=True)


def test_untold_force_and_otherwise_lost_value_in_a_pose():
    floors = dict.fromkeys(BASE, 0.0)
    told = {"speed": (None, UNAVAILABLE), "count": BASE["count"]}
    assert judged("mirrored", BASE, told, Allowances(floors)).holds
    lost = judged("mirrored", BASE, told | {"speed": (None, "never settles")}, Allowances(floors))
    assert not lost.holds and lost.metric == "speed"
    # What is told is compared all the same.
    changed = judged("mirrored", BASE, told | {"count": (BASE["count"][0] + 1.0, "")}, Allowances(floors))
    assert not changed.holds and changed.metric == "count"


def test_pose_refused_and_pose_failed_by_an_engine():
    refused = judged("bystander", BASE, Refusal("bodies: more than it takes"), Allowances({}))
    assert (refused.refused, refused.lost, refused.holds) == ("bodies: more than it takes", False, True)
    assert judged("bystander", BASE, "it hung", Allowances({})).lost


@pytest.mark.parametrize("dimension", [2, 3])
def test_bystanders_and_their_contacts_mapped_back(dimension):
    """A contact at one place of the scene, told where it was carried to at its time, is at that place again."""
    turn, inertia = ((0.0,), 1.0) if dimension == 2 else ((1.0, 0.0, 0.0, 0.0), (1.0, 1.0, 1.0))
    places = [(0.0,) * dimension, (1.0,) + (0.0,) * (dimension - 1)]
    bodies = tuple(Body(f"b{k}", Box((0.5,) * dimension), 1.0, inertia, (*x, *turn)) for k, x in enumerate(places))
    scene = Scene("two", 1, dimension, bodies, (), (0.0,) * dimension, 1.0)
    posed = boosted(scene)
    speed = np.array(posed.scene.bodies[0].twist[:dimension])
    assert speed[0] == size_of(scene) and not speed[1:].any()
    t = np.array([0.0, 0.25, 0.5, 1.0])
    pose = np.array([[body.pose for body in bodies]] * len(t))
    pose[..., :dimension] += t[:, None, None] * speed
    twist = np.array([[body.twist for body in posed.scene.bodies]] * len(t))
    point = np.array([0.5] + [0.0] * (dimension - 1))
    # Two contacts at the second sample, none at the third, one at the last.
    rows = [(0, 1, tuple(point + t[k] * speed), (1.0,) * dimension, (1.0,) * dimension, 0.0) for k in (1, 1, 3)]
    record = ContactRecord(np.array([1, 2, 3]), np.array([0, 2, 2, 3]), Contacts.from_rows(rows, dimension))
    found = posed.back(Trajectory(t, pose, twist, record, 0.25, "completed"))
    assert found.contacts.rows.point == pytest.approx(np.array([point] * 3), abs=1e-12)
    assert found.pose[-1, :, :dimension] == pytest.approx(np.array(places), abs=1e-12) and not found.twist.any()
