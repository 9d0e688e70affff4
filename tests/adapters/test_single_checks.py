"""Single checks of the kit against motions, contacts and engines of which it is known what they must say."""

import math
from dataclasses import replace

import numpy as np
import pytest
from listening import Dull, Listening

from adapters.conformance import CHECKS, mechanics, scenes
from adapters.conformance.faults import FAULTS
from adapters.conformance.finding import NotAsked
from adapters.conformance.mechanics import contacts
from adapters.conformance.toy import ToyEngine
from adapters.engine import Contacts, Declared

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
        ({"a": [1], "b": [0]}, "not in the scene's order"),
        ({"a": [0], "b": [0]}, "not in the scene's order"),
        ({"a": [1], "b": [2]}, "far apart"),
        ({"normal": [[0.0, 1.0 + 2e-9]]}, "length 1"),
        ({"normal": [[0.0, 1.0 - 2e-9]]}, "length 1"),
        ({"normal": [[0.0, 1.0 + 5e-10]]}, ""),
        ({"normal": [[0.0, -1.0]]}, "from the first to the second"),
        ({"normal": [[1e-3, math.sqrt(1.0 - 1e-6)]]}, "from the first to the second"),
        ({"point": [[9.0, 0.049]]}, ""),
        ({"point": [[0.0, 0.051]]}, "does not fit the surfaces"),
        ({"point": [[0.0, -0.051]]}, "does not fit the surfaces"),
        ({"gap": [0.049]}, ""),
        ({"gap": [-0.051]}, "does not fit the surfaces"),
        ({"gap": [0.051]}, "does not fit the surfaces"),
        ({"impulse": [[5.0, -5e-10]]}, ""),
        ({"impulse": [[5.0, -2e-9]]}, "pulls"),
    ],
)  # fmt: skip
def test_allowed_contents_of_a_contact(changed, said):
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


def test_floor_listed_last_and_lifted_plane():
    turned = touching(a=[1], b=[2], normal=[[0.0, -1.0]], impulse=[[0.0, -1.0]])
    assert mechanics._wrong_contact(scenes.resting(-1), turned, 1e-9) == ""
    assert "from the first" in mechanics._wrong_contact(scenes.resting(-1), touching(a=[1], b=[2]), 1e-9)
    spatial = touching(point=[[0.0, 9.0, 0.04]], normal=[[0.0, 0.0, 1.0]], impulse=[[0.0, 0.0, 1.0]])
    assert mechanics._wrong_contact(scenes.lift(scenes.resting()), spatial, 1e-9) == ""


@pytest.mark.parametrize(("part", "wrong"), [("normal", "of length 1"), ("point", "does not fit the surfaces"),
                                             ("impulse", ""), ("gap", "")])  # fmt: skip
def test_contact_normals_and_places_are_numbers_or_absent(toy, monkeypatch, part, wrong):
    """All comparisons with NaN are false: asked whether it is too large, it was not."""
    told = Contacts.from_rows

    def rows(*asked):
        found = told(*asked)
        return replace(found, **{part: np.full_like(getattr(found, part), math.nan)})

    monkeypatch.setattr(Contacts, "from_rows", rows)
    said = contacts(toy())
    assert wrong in said and bool(said) == bool(wrong)


def test_resting_body_without_contacts_told():
    class Floating(Listening):
        def build(self, scene, dt, settings):
            world = super().build(scene, dt, settings)
            if world.profile == "second":
                world.contacts = lambda: Contacts.from_rows([], scene.dimension)
            return world

    assert contacts(Floating()) == "second: a body resting on a floor has no contact"
    assert CHECKS["impulse"](Floating()).startswith("second: body b gained [2.25")


def test_impulse_check_only_for_profiles_that_report_them():
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


def test_balls_passing_through_each_other_told():
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
    [("", []), ("impulse of the wrong body", ["impulse", "sampling"]), ("state shared with another world", ["fresh"])],
)
def test_plastic_blows_for_an_engine_without_restitution(fault, seen):
    engine = Dull(fault, max(FAULTS[fault].sizes, default=math.nan)) if fault else Dull()
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
def test_free_fall_within_the_declared_departure(made, declared, said):
    told = CHECKS["free_fall"](Dragged(**made, **declared))
    assert told.startswith(f"second: {said} differs from free fall") if said else told == ""


def test_drag_loss_of_speed_and_spin():
    """A profile that takes 10 % a second: 2 % of a speed of 3.1 m/s in 0.2 s, which may grow with its square."""
    scene = scenes.flying()
    linear, angular = mechanics.loss(
        Dragged(linear_damping=share(0.1), angular_damping=Declared(0.2, 0.1)), "second", scene
    )
    assert linear == pytest.approx(-math.log(0.9) * 0.2) and angular == pytest.approx(-math.log(0.7) * 0.2)
    assert mechanics.loss(Dragged(linear_damping=share(0.1)), "first", scene) == (0.0, 0.0)
    # All of it and more is 99 %: there is a logarithm of that.
    assert mechanics.loss(Dragged(linear_damping=share(7.0)), "second", scene)[0] == pytest.approx(
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
def test_free_fall_off_by_the_band_and_slightly_more(what, off, declared, band):
    ((part, direction),) = off.items()
    # Angles are off already by what they are bent: the half of what is allowed, if anything.
    for times, said in ((0.4, False), (1.6, True)):
        told = CHECKS["free_fall"](Aside(**{part: times * band * np.array(direction)}, **declared))
        assert told.startswith(f"second: {what} differs") is said
    assert told.endswith(f", {band:.2g} is allowed")


@pytest.mark.parametrize(
    ("check", "fault"), [("impulse", "recoil too small"), ("impulse", "impulse of the wrong body"),
                         ("sampling", "impulse of the step before")],
)  # fmt: skip
def test_impulse_and_momentum_within_solver_tolerance_and_drag(check, fault):
    """The blow is of 2.25 N s; the fault takes a share of it, two of it where the impulse is of the wrong body."""
    blow = 2.25 * (2.0 if fault == "impulse of the wrong body" else 1.0)

    class Slowed(Listening):
        def declares(self, profile, needs, dt):
            super().declares(profile, needs, dt)
            return {"linear_damping": share(0.1)} if profile == "second" else {}

    for kind, limit in ((Listening, 1e-3), (Slowed, 5.1e-2)):
        for times, said in ((0.95, False), (1.05, True)):
            assert CHECKS[check](kind(fault, times * limit / blow)).startswith("second: ") is said


def test_allowed_change_of_momentum_and_spin():
    assert CHECKS["momentum"](Listening("momentum without a cause", 0.1)).endswith(", 1e-09 is allowed")
    plain = CHECKS["spin"](Listening("spin without a cause", 1.0))
    assert plain.startswith("second: 2-D: angular momentum changes by 0.1, ") and plain.endswith(" 0.00051 is allowed")

    class Slowed(Listening):
        def declares(self, profile, needs, dt):
            return {"linear_damping": share(0.1), "angular_damping": share(0.05)} if profile == "second" else {}

    lost = -math.log(0.9) * 72 / 240  # the larger of both
    told = CHECKS["momentum"](Slowed("momentum moved from one axis to another", 1.0))
    assert told.startswith("second: 2-D: momentum changes by 3, ") and told.endswith(f" {lost:.2g} is allowed")
    told = CHECKS["spin"](Slowed("spin without a cause", 1.0))
    assert told.endswith(f" {lost + 0.00051:.2g} is allowed")


def turning(x, v):
    return x[:, 0] * v[:, 1] - x[:, 1] * v[:, 0]


def test_angular_momentum_about_the_origin_with_a_gap_as_arm():
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
def test_motions_equal_to_a_thousandth_with_angles_as_turns(off, said):
    pose, twist = np.ones((4, 2, 3)), np.ones((4, 2, 3))
    for k, what in ((0, "poses"), (1, "twists")):
        for place in ((0, 0, 0), (3, 1, 2)):
            other = [pose.copy(), twist.copy()]
            other[k][place] += off
            told = mechanics._differing(pose, other[0], twist, other[1])
            assert told == (f"{what} {said}" if said else "")
    assert mechanics._differing(pose, pose + [0.0, 0.0, 2.0 * math.pi], twist, twist) == ""
    assert mechanics._differing(pose, pose + [0.0, 0.0, math.pi], twist, twist).startswith("poses differ by 3.1")
