"""Single checks of the kit against motions, contacts and engines of which it is known what they must say."""

import json
import math
import pickle
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from listening import Listening

from adapters.conformance import CHECKS, mechanics, scenes, worlds
from adapters.conformance.faults import FAULTS
from adapters.conformance.finding import Finding, NotAsked, found, judged
from adapters.conformance.mechanics import contacts
from adapters.conformance.spoilt import Spoilt
from adapters.conformance.toy import ToyEngine
from adapters.engine import Contacts, Declared, Expected
from adapters.isolation import IsolationError, Lost

DT = scenes.DT


# ---- contacts ------------------------------------------------------------------------------------------------------


def touching(**changed):
    """One contact of the `resting` scene, floor and ball, as it must be; with some of it changed."""
    told = {"a": [0], "b": [1], "point": [[0.0, 0.0]], "normal": [[0.0, 1.0]], "impulse": [[0.1, 0.2]], "gap": [0.0]}
    told |= changed
    return Contacts(**{name: np.array(value, int if name in "ab" else float) for name, value in told.items()})


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({}, ""),
        ({"a": [1], "b": [0]}, "not in order"),
        ({"a": [0], "b": [0]}, "not in order"),
        ({"a": [1], "b": [2]}, "far apart"),
        ({"normal": [[0.0, 1.0 + 2e-9]]}, "length 1"),
        ({"normal": [[0.0, 1.0 - 2e-9]]}, "length 1"),
        ({"normal": [[0.0, 1.0 + 5e-10]]}, ""),
        ({"normal": [[0.0, -1.0]]}, "from the first to the second"),
        ({"normal": [[1e-3, math.sqrt(1.0 - 1e-6)]]}, "from the first to the second"),
        ({"point": [[9.0, 0.049]]}, ""),
        ({"point": [[0.0, 0.051]]}, "not where bodies touch"),
        ({"point": [[0.0, -0.051]]}, "not where bodies touch"),
        ({"gap": [0.049]}, ""),
        ({"gap": [-0.051]}, "not where bodies touch"),
        ({"gap": [0.051]}, "not where bodies touch"),
        ({"impulse": [[5.0, -5e-10]]}, ""),
        ({"impulse": [[5.0, -2e-9]]}, "pulls"),
    ],
)  # fmt: skip
def test_what_a_contact_may_be(changed, said):
    """To a round-off of 1e-9, and to 5 cm in places, on either side of the limit."""
    told = mechanics._wrong_contact(scenes.resting(), touching(**changed), 1e-9)
    assert said in told and bool(told) == bool(said)


def test_of_several_contacts_each_one_counts():
    two = {name: np.concatenate([getattr(touching(), name)] * 2) for name in vars(touching())}
    assert mechanics._wrong_contact(scenes.resting(), Contacts(**two), 1e-9) == ""
    for name, wrong in (
        ("b", 0),
        ("normal", [0.0, 0.9]),
        ("point", [0.0, 1.0]),
        ("gap", -1.0),
        ("impulse", [0.0, -1.0]),
    ):
        for k in (0, 1):
            spoilt = {key: value.copy() for key, value in two.items()}
            spoilt[name][k] = wrong
            assert mechanics._wrong_contact(scenes.resting(), Contacts(**spoilt), 1e-9), (name, k)


def test_the_floor_may_stand_last_and_the_plane_be_lifted():
    turned = touching(a=[1], b=[2], normal=[[0.0, -1.0]], impulse=[[0.0, -1.0]])
    assert mechanics._wrong_contact(scenes.resting(-1), turned, 1e-9) == ""
    assert "from the first" in mechanics._wrong_contact(scenes.resting(-1), touching(a=[1], b=[2]), 1e-9)
    spatial = touching(point=[[0.0, 9.0, 0.04]], normal=[[0.0, 0.0, 1.0]], impulse=[[0.0, 0.0, 1.0]])
    assert mechanics._wrong_contact(scenes.lift(scenes.resting()), spatial, 1e-9) == ""


@pytest.mark.parametrize(("part", "wrong"), [("normal", "of length 1"), ("point", "not where bodies touch"),
                                             ("impulse", ""), ("gap", "")])  # fmt: skip
def test_normals_and_places_of_contacts_are_numbers_and_what_need_not_be_told_may_be_none(
    toy, monkeypatch, part, wrong
):
    """All comparisons with NaN are false: asked whether it is too large, it was not."""
    told = Contacts.from_rows

    def rows(*asked):
        found = told(*asked)
        return replace(found, **{part: np.full_like(getattr(found, part), math.nan)})

    monkeypatch.setattr(Contacts, "from_rows", rows)
    said = contacts(toy())
    assert wrong in said and bool(said) == bool(wrong)


def test_a_body_at_rest_that_touches_nothing_is_said():
    class Floating(Listening):
        def build(self, scene, dt, settings):
            world = super().build(scene, dt, settings)
            if world.profile == "second":
                world.contacts = lambda: Contacts.from_rows([], scene.dimension)
            return world

    assert contacts(Floating()) == "second: a body resting on a floor has no contact"
    assert CHECKS["impulse"](Floating()).startswith("second: body b gained [2.25")


def test_impulses_that_one_profile_does_not_tell_are_not_asked_of_it_and_others_are_asked_all_the_same():
    class Silent(Listening):
        def build(self, scene, dt, settings):
            world = super().build(scene, dt, settings)
            if world.profile == "first":
                told = world.contacts
                world.contacts = lambda: replace(told(), impulse=np.full_like(told().impulse, math.nan))
            return world

    for check in ("impulse", "sampling"):
        with pytest.raises(NotAsked, match=r"^first: contact impulses are not reported$"):
            CHECKS[check](Silent())
    assert CHECKS["impulse"](Silent("impulse of the wrong body", 1.0)).startswith("second: body b gained")
    assert CHECKS["sampling"](Silent("impulse of the step before", 1.0)).startswith("second: step ")


def test_balls_that_pass_through_each_other_are_said():
    class Ghosts(Listening):
        def build(self, scene, dt, settings):
            world = super().build(scene, dt, settings)
            if world.profile == "second":
                start = world.twist()
                world.twist = lambda: start
            return world

    for check in ("momentum", "spin", "impulse"):
        assert CHECKS[check](Ghosts()) == "second: the balls passed through each other"


@pytest.mark.parametrize(
    ("fault", "seen"),
    [("", []), ("impulse of the wrong body", ["impulse", "sampling"]), ("world shared with another", ["fresh"])],
)
def test_an_engine_without_restitution_is_asked_for_blows_without(fault, seen):
    class Dull:
        def refuses(self, scene, profile):
            rebounds = any(restitution > 0.0 for restitution, _ in scene.materials())
            return "pairs: no restitution" if rebounds else super().refuses(scene, profile)

    class Healthy(Dull, ToyEngine):
        pass

    class Broken(Dull, Spoilt):
        pass

    engine = Broken(fault, max(FAULTS[fault].sizes, default=math.nan)) if fault else Healthy()
    asked = ("momentum", "spin", "impulse", "sampling", "fresh")
    assert [name for name in asked if CHECKS[name](engine)] == seen


# ---- motion --------------------------------------------------------------------------------------------------------


class Dragged(Listening):
    """Speeds and spins die down, places lag behind; and what it declares of that."""

    def __init__(self, drag=0.0, spin=0.0, late=0.0, **declared):
        super().__init__()
        self.drag, self.spin, self.late, self.declared = drag, spin, late, declared

    def declares(self, profile, needs, dt):
        super().declares(profile, needs, dt)
        return dict(self.declared) if profile == "second" else {}

    def build(self, scene, dt, settings):
        world = super().build(scene, dt, settings)
        if world.profile == "second" and scene.dimension == 2:
            pose, twist, g = world.pose, world.twist, np.array([*scene.gravity, 0.0])
            kept = np.array([1.0 - self.drag, 1.0 - self.drag, 1.0 - self.spin])
            world.twist = lambda: twist() * kept ** (world.steps * dt)
            world.pose = lambda: pose() - self.late * g * world.steps * dt * dt
        return world


def share(rate):
    return Declared(rate, 0.0)


@pytest.mark.parametrize(
    ("made", "declared", "said"),
    [
        ({"drag": 0.1}, {}, "velocity"),
        ({"drag": 0.1}, {"linear_damping": share(0.1)}, ""),
        ({"drag": 0.5}, {"linear_damping": share(0.01)}, "velocity"),
        ({"drag": 0.1}, {"linear_damping": Declared(0.0, 0.1)}, ""),
        ({"spin": 0.1}, {}, "spin"),
        ({"spin": 0.1}, {"angular_damping": share(0.1)}, ""),
        ({"spin": 0.1}, {"linear_damping": share(0.1)}, "spin"),
        ({"drag": 0.1}, {"angular_damping": share(0.1)}, "velocity"),
        ({"late": 1.0}, {}, "place"),
        ({"late": 1.0}, {"sampling": share(1.0)}, ""),
        ({"late": 1.0}, {"sampling": share(0.9)}, "place"),
        ({"late": 1.0}, {"sampling": Declared(0.5, 0.6)}, ""),
        ({"late": 1.0}, {"sampling": Declared(0.5, 0.3)}, "place"),
        ({}, {"sampling": share(1.0)}, "place"),
    ],
)  # fmt: skip
def test_a_fall_may_miss_its_law_by_what_a_profile_declares_and_no_more(made, declared, said):
    told = CHECKS["free_fall"](Dragged(**made, **declared))
    assert told.startswith(f"second: {said} misses the law") if said else told == ""


def test_drag_takes_its_share_of_the_largest_speed_and_twice_of_the_spin():
    """A profile that takes 10 % a second: 2 % of a speed of 3.1 m/s in 0.2 s, which may grow with its square."""
    scene = scenes.flying()
    linear, angular = mechanics._loss(
        Dragged(linear_damping=share(0.1), angular_damping=Declared(0.2, 0.1)), "second", scene
    )
    assert linear == pytest.approx(-math.log(0.9) * 0.2) and angular == pytest.approx(-math.log(0.7) * 0.2)
    assert mechanics._loss(Dragged(linear_damping=share(0.1)), "first", scene) == (0.0, 0.0)
    # All of it and more is 99 %: there is a logarithm of that.
    assert mechanics._loss(Dragged(linear_damping=share(7.0)), "second", scene)[0] == pytest.approx(
        -math.log(0.01) * 0.2
    )
    for spare, said in ((0.9, False), (1.1, True)):
        lost = scenes.flying().duration * 0.1

        class Off(Listening):
            def build(self, scene, dt, settings, spare=spare, lost=lost):
                world = super().build(scene, dt, settings)
                twist = world.twist
                world.twist = lambda: twist() + np.array([0.0, 0.0, spare * 2.0 * lost])
                return world

            def declares(self, profile, needs, dt):
                return {"angular_damping": share(1.0 - math.exp(-0.1))}

        assert bool(CHECKS["free_fall"](Off())) == said


class Aside(Listening):
    """The second profile's numbers are off by some from the first step on; what is declared of its drag."""

    def __init__(self, twist=(0.0, 0.0, 0.0), pose=(0.0, 0.0, 0.0), **declared):
        super().__init__()
        self.off, self.declared = (np.array(pose), np.array(twist)), declared

    def declares(self, profile, needs, dt):
        super().declares(profile, needs, dt)
        return dict(self.declared) if profile == "second" else {}

    def build(self, scene, dt, settings):
        world = super().build(scene, dt, settings)
        if world.profile == "second":
            pose, twist = world.pose, world.twist
            world.pose = lambda: pose() + self.off[0] * (world.steps > 0)
            world.twist = lambda: twist() + self.off[1] * (world.steps > 0)
        return world


#: What a quaternion that is turned to first order loses in 48 steps and the start, at 1.5 rad/s: (w dt)^3/12 each.
BENT = 49 * (1.5 / 240) ** 3 / 12
#: Nothing is faster than this in a fall of 0.2 s from 3 and 2 m/s, and a profile takes no more than this of it.
FASTEST = math.hypot(3.0 + 0.6 * 9.81 * 0.2, 2.0 - 0.8 * 9.81 * 0.2)
LOST = -math.log(0.9) * 0.2


@pytest.mark.parametrize(
    ("what", "off", "declared", "band"),
    [
        ("velocity", {"twist": (1.0, 0.0, 0.0)}, {}, 1e-9),
        ("velocity", {"twist": (0.0, -1.0, 0.0)}, {}, 1e-9),
        ("velocity", {"twist": (0.0, 1.0, 0.0)}, {"linear_damping": share(0.1)}, 1e-9 + LOST * FASTEST**2),
        ("place", {"pose": (1.0, 0.0, 0.0)}, {}, 1.2e-9),
        ("place", {"pose": (0.0, 1.0, 0.0)}, {"linear_damping": share(0.1)}, 1.2e-9 + LOST * FASTEST**2 * 0.2),
        ("spin", {"twist": (0.0, 0.0, 1.0)}, {}, 1e-9),
        ("spin", {"twist": (0.0, 0.0, 1.0)}, {"angular_damping": share(0.1)}, 1e-9 + 2.0 * LOST),
        ("angle", {"pose": (0.0, 0.0, 1.0)}, {}, 1e-9 + BENT),
        ("angle", {"pose": (0.0, 0.0, -1.0)}, {"angular_damping": share(0.1)}, 1e-9 + BENT + 2.0 * LOST),
    ],
)  # fmt: skip
def test_a_fall_may_be_off_by_this_band_and_no_more(what, off, declared, band):
    ((part, direction),) = off.items()
    # Angles are off already by what they are bent: the half of what is allowed, if anything.
    for times, said in ((0.4, False), (1.6, True)):
        told = CHECKS["free_fall"](Aside(**{part: times * band * np.array(direction)}, **declared))
        assert told.startswith(f"second: {what} misses") is said
    assert told.endswith(f", {band:.2g} is allowed")


@pytest.mark.parametrize(
    ("check", "fault"), [("impulse", "recoil felt too little"), ("impulse", "impulse of the wrong body"),
                         ("sampling", "impulse of the step before")],
)  # fmt: skip
def test_impulses_and_momenta_agree_to_a_solver_s_tolerance_and_to_what_drag_takes(check, fault):
    """The blow is of 2.25 N s; the fault takes a share of it, two of it where the impulse is of the wrong body."""
    blow = 2.25 * (2.0 if fault == "impulse of the wrong body" else 1.0)

    class Slowed(Listening):
        def declares(self, profile, needs, dt):
            super().declares(profile, needs, dt)
            return {"linear_damping": share(0.1)} if profile == "second" else {}

    for kind, limit in ((Listening, 1e-3), (Slowed, 5.1e-2)):
        for times, said in ((0.95, False), (1.05, True)):
            assert CHECKS[check](kind(fault, times * limit / blow)).startswith("second: ") is said


def test_momentum_and_spin_may_change_by_round_off_a_gap_as_an_arm_and_what_is_declared():
    assert CHECKS["momentum"](Listening("momentum out of nothing", 0.1)).endswith(", 1e-09 is allowed")
    plain = CHECKS["spin"](Listening("spin out of nothing", 1.0))
    assert plain.startswith("second: 2-D: angular momentum changes by 0.1, ") and plain.endswith(" 0.00051 is allowed")

    class Slowed(Listening):
        def declares(self, profile, needs, dt):
            return {"linear_damping": share(0.1), "angular_damping": share(0.05)} if profile == "second" else {}

    lost = -math.log(0.9) * 72 / 240  # the larger of both
    told = CHECKS["momentum"](Slowed("momentum along one axis for that along another", 1.0))
    assert told.startswith("second: 2-D: momentum changes by 3, ") and told.endswith(f" {lost:.2g} is allowed")
    told = CHECKS["spin"](Slowed("spin out of nothing", 1.0))
    assert told.endswith(f" {lost + 0.00051:.2g} is allowed")


def turning(x, v):
    return x[:, 0] * v[:, 1] - x[:, 1] * v[:, 0]


def test_momentum_is_counted_about_the_origin_and_may_change_by_a_gap_as_an_arm():
    scene = scenes.glancing()
    found = scenes.driven(ToyEngine(), scene, "default")
    total, slack = mechanics._linear(scene, found)
    mass = [body.mass for body in scene.bodies]
    assert np.allclose(total, sum(m * found.twist[:, i, :2] for i, m in enumerate(mass))) and slack == 0.0
    total, slack = mechanics._angular(scene, found)
    spins = sum(
        body.inertia * found.twist[:, i, 2] + body.mass * turning(found.pose[:, i], found.twist[:, i])
        for i, body in enumerate(scene.bodies)
    )
    assert np.allclose(total, spins) and np.ptp(total) > 0.0
    # The light one comes at 0.25 m/s; what the blow changes of its momentum acts at an arm of two steps of that.
    blow = np.linalg.norm(found.twist[-1, 0, :2] - found.twist[0, 0, :2])
    assert slack == pytest.approx(2.0 * 0.25 * DT * blow) and blow > 0.1
    assert mechanics._swapped(scene).bodies == scene.bodies[::-1]


@pytest.mark.parametrize(("off", "said"), [(0.9e-3, ""), (1.1e-3, "differ by 0.0011"), (math.nan, "differ by nan")])
def test_motions_are_the_same_to_a_thousandth_and_angles_as_turns(off, said):
    pose, twist = np.ones((4, 2, 3)), np.ones((4, 2, 3))
    for k, what in ((0, "poses"), (1, "twists")):
        for place in ((0, 0, 0), (3, 1, 2)):
            other = [pose.copy(), twist.copy()]
            other[k][place] += off
            told = mechanics._differing(pose, other[0], twist, other[1])
            assert told == (f"{what} {said}" if said else "")
    assert mechanics._differing(pose, pose + [0.0, 0.0, 2.0 * math.pi], twist, twist) == ""
    assert mechanics._differing(pose, pose + [0.0, 0.0, math.pi], twist, twist).startswith("poses differ by 3.1")


# ---- worlds --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("asked", "told", "same"),
    [
        ("elliptic", "mjCONE_ELLIPTIC", True), ("elliptic", "pyramidal", False), (True, True, True), (True, 1, True),
        (True, False, False), (None, None, True), (None, 3, False), (0.5, 0.5, True), (0.5, 0.501, False),
        (2.0, 2.0 + 1e-9, True), (2.0, 2.0 + 3e-9, False), (0.0, 0.9e-12, True), (0.0, 1.1e-12, False),
        ((1.0, 2.0), [1.0, 2.0], True), ((1.0, 2.0), [1.0, 2.1], False), ((1.0, 2.0), 1.0, True),
        (1.0, "its own word", True), (1.0, {"a": 1}, True), (1.0, math.nan, False),
    ],
)  # fmt: skip
def test_what_is_read_back_is_what_was_declared_as_far_as_its_words_are_known(asked, told, same):
    assert worlds._same(asked, told, 1e-9) is same


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({}, ""),
        ({"iterations": 5}, "settings.iterations was declared 4, the engine holds 5"),
        ({"dt": 0.5}, "dt was declared 0.00416"),
        ({"gravity": [0.0, 9.81]}, "gravity was declared (0.0, -9.81), the engine holds [0.0, 9.81]"),
        ({"bodies": {"ball": {"mass": 2.1}}}, "ball.mass was declared 2.0, the engine holds 2.1"),
        ({"bodies": {"box": {"inertia": 0.3}}}, "box.inertia was declared 0.4, the engine holds 0.3"),
        ({"bodies": {"floor": {"mass": 7.0}}}, ""),  # what is fixed has whatever mass an engine likes
        ({"bodies": {}}, ""),
        ({"pairs": {"floor-ball": {"friction": 0.4}}}, "floor-ball.friction was declared 0.5, the engine holds 0.4"),
        ({"pairs": {"floor-box": {"restitution": 0.1}}}, "floor-box.restitution was declared 0.0, "),
        ({"pairs": {"floor-ball": {"friction": 0.5, "restitution": 0.0}}}, ""),
        ({"pairs": {"ball-floor": {"friction": 0.4}}}, ""),  # no name that the contract knows
    ],
)  # fmt: skip
def test_each_thing_that_is_read_back_is_compared(change, said):
    class Telling(Listening):
        def build(self, scene, dt, settings):
            world = super().build(scene, dt, settings)
            if world.profile == "second":
                held = world.readback()
                world.readback = lambda: held | change
            return world

    told = CHECKS["readback"](Telling())
    assert told.startswith(f"second: {said}") if said else told == ""


def test_a_start_that_was_changed_is_no_fault_where_it_is_said_and_shapes_and_speeds_are_all_the_same():
    class Lifted(Listening):
        said = ("raised by a margin",)

        def build(self, scene, dt, settings):
            world = super().build(scene, dt, settings)
            pose = world.pose
            world.pose, world.initial_change = (lambda: pose() + 1e-3), self.said
            return world

    assert CHECKS["states"](Lifted()) == ""
    Lifted.said = ()
    assert CHECKS["states"](Lifted()).startswith("first: bodies start in another pose")

    class Short(Listening):
        wrong = "pose"

        def build(self, scene, dt, settings):
            world = super().build(scene, dt, settings)
            whole = getattr(world, self.wrong)
            setattr(world, self.wrong, lambda: whole()[:, :2])
            return world

    assert CHECKS["states"](Short()) == "first: shapes are (3, 2) and (3, 3)"
    Short.wrong = "twist"
    assert CHECKS["states"](Short()) == "first: shapes are (3, 3) and (3, 2)"


def record_with(**changed):
    """An engine of which the second profile's records are changed in one part."""

    class Recording(Listening):
        def build(self, scene, dt, settings):
            world = super().build(scene, dt, settings)
            if world.profile == "second":
                world.record = lambda samples, stride, contacts: _changed(
                    worlds.one_by_one(world, samples, stride), world, changed
                )
            return world

    return Recording()


def _changed(told, world, changed):
    world.steps += changed.get("steps", 0)
    if changed.get("contacts", 0) is None:
        return replace(told, contacts=None)
    if more := changed.get("more"):
        world.inner.advance(more)
    for name in ("pose", "twist"):
        if name in changed:
            value = getattr(told, name).copy()
            value[-1, -1, -1] += changed[name]
            told = replace(told, **{name: value})
    if "counts" in changed:
        told = replace(told, counts=told.counts[::-1] + changed["counts"])
    if "of" in changed:
        rows = {name: getattr(told.contacts, name).copy() for name in worlds.CONTACT_FIELDS}
        rows[changed["of"]][-1] += 1
        told = replace(told, contacts=Contacts(**rows))
    return told


@pytest.mark.parametrize(
    ("changed", "said"),
    [({}, ""), ({"pose": 1e-12}, "poses"), ({"twist": 1e-12}, "twists"), ({"counts": 1}, "counts"),
     ({"contacts": None}, "contacts"), ({"more": 1}, "ends"),
     *(({"of": name}, f"contacts' {name}") for name in worlds.CONTACT_FIELDS)],
)  # fmt: skip
def test_a_record_is_compared_part_by_part_and_ends_where_single_steps_do(changed, said):
    engine = record_with(**changed)
    told = CHECKS["stride"](engine)
    where = f"second: {said} recorded at once (24 of 1 steps) are others than one by one"
    assert told == (where if said else "")
    assert all(world.closed == 1 for world in engine.built)
    if not said:
        assert engine.worlds("second") == {"sliding floor box 2": [24, 24, 24, 25, 25, 25, 25]}
        assert engine.worlds("first") == {"sliding floor box 2": [24, 24, 24, 1, 1, 1, 1]}


class Line:
    """The end of a connection at which a child sits, and what it sent."""

    def __init__(self, asked=b""):
        self.asked, self.sent = asked, []

    def recv_bytes(self):
        return self.asked

    def send_bytes(self, told):
        self.sent.append(json.loads(told))


def test_a_child_runs_the_scene_on_the_engine_that_it_gets_or_says_why_it_has_none():
    line = Line(pickle.dumps(ToyEngine()))
    worlds.serve_hashes(line)
    assert line.sent == [worlds._hashes(ToyEngine())] and set(line.sent[0]) == {"default"}
    line = Line(b"no engine")
    worlds.serve_hashes(line)
    assert len(line.sent) == 1 and line.sent[0]["not there"].startswith("UnpicklingError: ")


@pytest.fixture
def child(monkeypatch):
    """`child(answer)`: another process that answers so, or does not."""

    def made(answer):
        heard = SimpleNamespace(sent=[], stopped=0, serve=None, patience=None)

        class Child:
            def __init__(self, serve):
                if isinstance(answer, IsolationError):
                    raise answer
                heard.serve = serve

            def send(self, message):
                heard.sent.append(pickle.loads(message))

            def receive(self, timeout):
                heard.patience = timeout
                if isinstance(answer, Lost):
                    raise answer
                return json.dumps(answer).encode()

            def tail(self):
                return "Segmentation fault\nin the engine"

            def stop(self):
                heard.stopped += 1

        monkeypatch.setattr(worlds, "Child", Child)
        return heard

    return made


def test_bits_of_another_process_are_compared_profile_by_profile(child, monkeypatch):
    here = worlds._hashes(ToyEngine())["default"]
    monkeypatch.setattr(worlds, "_hashes", lambda engine: {"first": here, "second": here})
    for there, said in (
        ({"first": here, "second": here}, ""),
        ({"first": here, "second": "ff"}, "second: comes out otherwise in a fresh process"),
        ({"second": here}, "first: comes out otherwise in a fresh process"),
        ({}, "first, second: comes out otherwise in a fresh process"),
    ):
        heard = child(there)
        assert CHECKS["process"](ToyEngine()) == said
        assert heard.stopped == 1 and heard.serve is worlds.serve_hashes and heard.patience == worlds.PATIENCE
        assert [type(engine) for engine in heard.sent] == [ToyEngine]


def test_a_process_that_ends_is_a_fault_and_one_that_cannot_be_is_not_asked(child, monkeypatch):
    monkeypatch.setattr(worlds, "_hashes", lambda engine: {"default": "00"})
    heard = child(Lost("it ended with signal 11"))
    assert CHECKS["process"](ToyEngine()) == "it ended with signal 11: Segmentation fault"
    assert heard.stopped == 1
    child(IsolationError("process: cannot start one: no memory"))
    with pytest.raises(NotAsked, match=r"^process: cannot start one: no memory$"):
        CHECKS["process"](ToyEngine())
    child({"not there": "ImportError: no toy"})
    with pytest.raises(NotAsked, match=r"^the engine cannot be had in another process: ImportError: no toy$"):
        CHECKS["process"](ToyEngine())

    class Local(ToyEngine):
        pass

    with pytest.raises(NotAsked, match=r"^the engine cannot be named to another process: "):
        CHECKS["process"](Local())


# ---- what is found -------------------------------------------------------------------------------------------------


def test_what_a_check_says_is_a_finding_of_its_name():
    def check(engine):
        """All is well.

        And more of it.
        """
        return engine.said

    toy = SimpleNamespace(said="", expected=())
    assert found("name", check, toy) == Finding("name", "ok", "All is well")
    toy.said = "wrong"
    assert found("name", check, toy) == Finding("name", "FAIL", "wrong")
    toy.expected = (Expected("other", "no", "none"), Expected("name", "it is old", "its manual"))
    assert found("name", check, toy) == Finding("name", "expected", "it is old (its manual): wrong")
    toy.said = ""
    assert found("name", check, toy) == Finding("name", "unexpected pass", "it holds, but is listed: it is old")

    def refusing(engine):
        raise NotAsked("no scene\nfor it")

    def raising(engine):
        raise ArithmeticError("no\nnumber")

    assert found("name", refusing, toy).status == "refused" and found("name", refusing, toy).message == "no scene"
    toy.expected = ()
    assert found("name", raising, toy) == Finding("name", "FAIL", "ArithmeticError: no")
    assert found("name", lambda engine: "", toy) == Finding("name", "ok", "name")


@pytest.mark.parametrize(
    ("status", "holds"),
    [("ok", True), ("FAIL", False), ("refused", True), ("expected", True), ("unexpected pass", False)],
)
def test_what_holds_and_how_it_is_told(status, holds):
    finding = Finding("states", status, "as it is")
    assert finding.holds is holds
    assert str(finding) == f"{status:8s}  states: as it is"
    assert judged("x", "", "good", None) == Finding("x", "ok", "good")
