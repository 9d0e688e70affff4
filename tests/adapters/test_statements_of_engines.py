"""What an engine says of itself: each fact that is wrong is named, and what it says is done and refused."""

import importlib.util
import math
from dataclasses import replace
from types import SimpleNamespace

import pytest
from listening import SWEEPS, Listening

from adapters.conformance import CHECKS, statements
from adapters.conformance.finding import NotAsked
from adapters.engine import EngineError, Scheme, Setting
from adapters.scene import Box


def engine_with(**changed):
    """The listening toy with other facts."""
    engine = Listening()
    engine.facts = replace(Listening.facts, **changed)
    return engine


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"name": ""}, "facts need a name and the package to install"),
        ({"package": ""}, "facts need a name and the package to install"),
        ({"dimensions": frozenset()}, "facts.dimensions: set() must be out of 2 and 3"),
        ({"dimensions": frozenset({3, 4})}, "facts.dimensions: {3, 4} must be out of 2 and 3"),
        ({"dimensions": frozenset({2})}, ""),
        ({"scheme": Scheme("odd", 1.1)}, "scheme.position_offset: 1.1 must lie in [-1, 1]"),
        ({"scheme": Scheme("odd", -1.1)}, "scheme.position_offset: -1.1 must lie in [-1, 1]"),
        ({"scheme": Scheme("odd", math.nan)}, "scheme.position_offset: nan must lie in [-1, 1]"),
        ({"scheme": Scheme("position first", -1)}, ""),
        ({"profile_schemes": {"second": Scheme("odd", 2.0)}}, "scheme.position_offset: 2.0 must lie in [-1, 1]"),
        ({"roles": {"first": "shipped", "second": "tuned"}}, ""),
        ({"roles": {"third": "shipped"}}, "facts.roles: 'third' cannot be 'shipped': no such profile, or no such"),
        ({"roles": {"first": "best"}}, "facts.roles: 'first' cannot be 'best': no such profile, or no such"),
        ({"customary_dt": 0.0}, "facts.customary_dt: 0.0 must be a positive number of seconds"),
        ({"customary_dt": -0.1}, "facts.customary_dt: -0.1 must be a positive number of seconds"),
        ({"customary_dt": math.inf}, "facts.customary_dt: inf must be a positive number of seconds"),
        ({"customary_dt": math.nan}, "facts.customary_dt: nan must be a positive number of seconds"),
    ],
)  # fmt: skip
def test_a_fact_that_is_wrong_is_named(changed, said):
    told = CHECKS["facts"](engine_with(**changed))
    assert told.startswith(said) and bool(told) == bool(said)


def test_types_of_facts_and_version():
    engine = Listening()
    engine.facts = SimpleNamespace(**{name: getattr(Listening.facts, name) for name in ("name", "package")})
    assert CHECKS["facts"](engine) == "facts need a name and the package to install"
    for version in ("", None, 3):
        engine = Listening()
        engine.version = lambda version=version: version
        assert CHECKS["facts"](engine) == "version() must return the version"


def rules(**profiles):
    engine = Listening()
    engine.profiles = profiles
    return engine


def test_profiles_present_repeatable_and_reasoned():
    good = [Setting("iterations", 3, "a reason"), Setting("slop", 0.1, "another")]
    assert CHECKS["profiles"](rules()) == "there is no profile"
    assert CHECKS["profiles"](rules(one=lambda needs, dt: good)) == ""
    calls = iter(range(1000))
    told = CHECKS["profiles"](
        rules(one=lambda needs, dt: good, two=lambda needs, dt: [Setting("n", next(calls), "so")])
    )
    assert told == "two: differs from call to call"
    for wrong, said in (
        ([*good, Setting("margin", 0.1, "")], "two: margin has no reason"),
        ([*good, Setting("slop", 0.2, "so")], "two: slop is set twice"),
        ([*good, ("slop", 0.2)], "two: ('slop', 0.2) is no Setting"),
        ([None, *good], "two: None is no Setting"),
        ([SimpleNamespace(name="slop", because="so")], "two: namespace(name='slop', because='so') is no Setting"),
        ([*good, "a line\nand more " + 99 * "x"], rf"two: 'a line\nand more {18 * 'x'} ... is no Setting"),
    ):
        assert CHECKS["profiles"](rules(one=lambda needs, dt: good, two=lambda needs, dt, own=wrong: own)) == said
    with pytest.raises(TypeError, match="JSON"):
        CHECKS["profiles"](rules(one=lambda needs, dt: [Setting("slop", {1, 2}, "a set is no data")]))


@pytest.mark.parametrize("kind", ["rest", "impact"])
def test_profiles_for_rest_and_impact_in_each_dimension(kind):
    for dimensions, asked in (({2, 3}, (2, 3)), ({2}, (2,))):
        engine = engine_with(dimensions=frozenset(dimensions))
        for dimension in (2, 3):

            def rule(needs, dt, dimension=dimension):
                wrong = needs.regime == kind and needs.dimension == dimension
                return [Setting("iterations", 3, "" if wrong else "so")]

            engine.profiles = {"one": rule}
            assert bool(CHECKS["profiles"](engine)) is (dimension in asked)


def test_needs_of_blows_and_rest_under_gravity_of_the_earth():
    """Elastic, plastic and rough blows at 6 m/s, rest with and without a slip."""
    asked, engine = [], Listening()

    def rule(needs, dt):
        told = (needs.regime, needs.restitution, needs.friction, needs.slide, needs.rotation)
        asked.append((needs.dimension, told, needs.gravity, needs.top_speed, dt))
        return [Setting("iterations", 3, "so")]

    engine.profiles = {"one": rule}
    assert CHECKS["profiles"](engine) == ""
    kinds = [
        ("impact", 0.8, 0.0, False, False),
        ("impact", 0.0, 0.0, False, False),
        ("impact", 0.5, 0.5, True, False),
        ("rest", 0.0, 0.5, False, True),
        ("rest", 0.0, 0.5, True, True),
    ]
    assert sorted(set(asked)) == sorted((d, kind, 9.81, 6.0, statements.DT) for d in (2, 3) for kind in kinds)
    assert len(asked) == 2 * 2 * len(kinds)  # each twice: what differs from call to call is seen


def test_nan_tried_for_each_setting_of_a_profile():
    """Counts below 1, and NaN for what is a number; a word has no such thing."""
    tried = []

    class Taking(Listening):
        said: EngineError | None = EngineError("no")

        def build(self, scene, dt, settings):
            tried.append((dt, settings["iterations"], settings["slop"]))
            if self.said:
                raise self.said
            return SimpleNamespace(close=lambda: closed.append(1))

    engine, closed = Taking(), []
    settings = [Setting("iterations", 3, "so"), Setting("slop", 0.1, "so"), Setting("cone", "round", "so")]
    engine.profiles = {"first": lambda needs, dt: settings}
    assert CHECKS["bad_numbers"](engine) == ""
    steps = [(repr(dt), count, repr(slop)) for dt, count, slop in tried]
    assert [step[0] for step in steps[:4]] == ["0.0", repr(-statements.DT), "nan", "inf"]
    own = repr(statements.DT)
    assert steps[4:] == [(own, 3, "nan"), (own, 0, "0.1"), (own, -1, "0.1")]
    assert all(step[1:] == (3, "0.1") for step in steps[:4])
    Taking.said = EngineError("no\nnever")
    assert CHECKS["bad_numbers"](engine) == "first: a step of 0 s is refused in more than one line"
    Taking.said = None
    assert CHECKS["bad_numbers"](engine) == "first: a step of 0 s is accepted" and closed == [1]
    engine.profiles = {"first": lambda needs, dt: [Setting("slop", 0.1, "so"), Setting("iterations", "many", "so")]}
    Taking.said, before = EngineError("no"), len(tried)
    assert CHECKS["bad_numbers"](engine) == ""
    assert [count for _, count, _ in tried[before:]] == ["many"] * 5  # a count that is a word is no number to spoil


def test_unknown_setting_refused_with_an_engine_error():
    class Lenient(Listening):
        def settings(self, profile, needs, dt, iterations=None):
            return [] if profile not in self.profiles else super().settings(profile, needs, dt, iterations)

    assert CHECKS["refusals"](Lenient()) == "an unknown profile is accepted"

    class Talking(Listening):
        def settings(self, profile, needs, dt, iterations=None):
            if profile not in self.profiles:
                raise EngineError("there is none\nof that name")
            return super().settings(profile, needs, dt, iterations)

    assert CHECKS["refusals"](Talking()) == "an unknown profile is refused in more than one line"
    for said in (3, "two\nlines"):
        for asked in (("check_pairs", 2), ("check_pairs", 3), ("check_leaning", 2), ("check_carried", 2)):

            class Odd(Listening):
                def refuses(self, scene, profile, said=said, asked=asked):
                    odd = profile == "second" and (scene.name, scene.dimension) == asked
                    return said if odd else super().refuses(scene, profile)

            assert CHECKS["refusals"](Odd()) == f"second: refuses() must give one line or None, not {said!r}"

    class Planar(Listening):
        facts = replace(Listening.facts, dimensions=frozenset({2}))

        def refuses(self, scene, profile):
            return "two\nlines" if scene.dimension == 3 else super().refuses(scene, profile)

    assert CHECKS["refusals"](Planar()) == ""  # nobody asks an engine of the plane for space


def test_refused_dimensions_and_scenes_not_built():
    class Planar(Listening):
        facts = replace(Listening.facts, dimensions=frozenset({2}))
        strict = False

        def build(self, scene, dt, settings):
            if self.strict and scene.dimension == 3:
                raise EngineError("dimension: the toy is planar")
            return super().build(scene, dt, settings)

    assert CHECKS["capabilities"](Planar()) == "first: facts.dimensions has no 3, and a spatial scene is built"
    engine = Planar()
    Planar.strict = True
    assert CHECKS["capabilities"](engine) == ""
    assert {world.scene.dimension for world in engine.built} == {2}

    class Failing(Listening):
        def build(self, scene, dt, settings):
            if settings["iterations"] == SWEEPS["second"] and scene.name == "check_flying" and scene.dimension == 3:
                raise EngineError("no room")
            return super().build(scene, dt, settings)

    assert CHECKS["capabilities"](Failing()) == "second: check_flying, 3-D: not refused, but stopped by no room"


def test_world_that_ends_early_and_fixed_body_that_moves():
    class Ending(Listening):
        def build(self, scene, dt, settings):
            world = super().build(scene, dt, settings)
            if world.profile == "second" and scene.name == "check_resting":
                twist = world.twist
                world.twist = lambda: twist() * (math.nan if world.steps > 3 else 1.0)
            return world

    # A floor that is nowhere moves neither so nor otherwise: what ended the run is said.
    assert "the state is not finite" in CHECKS["capabilities"](Ending())
    for size, said in ((0.5, ""), (2.0, "second: check_resting, 2-D: floor is fixed but does not move like that")):

        class Sinking(Listening):
            def build(self, scene, dt, settings, size=size):
                world = super().build(scene, dt, settings)
                if world.profile == "second" and scene.name == "check_resting":
                    twist, floor = world.twist, scene.index("floor")

                    def sinking():
                        told = twist()
                        told[floor, 1] -= size * 1e-9
                        return told

                    world.twist = sinking
                return world

        assert CHECKS["capabilities"](Sinking()) == said


def test_package_on_the_path_of_this_project(monkeypatch, tmp_path):
    assert CHECKS["packages"](Listening()) == ""
    elsewhere = tmp_path / "adapters" / "__init__.py"
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: SimpleNamespace(origin=str(elsewhere)))
    assert CHECKS["packages"](Listening()) == f"`adapters` on this path is {elsewhere.parent}"
    for none in (None, SimpleNamespace(origin=None)):
        monkeypatch.setattr(importlib.util, "find_spec", lambda name, none=none: none)
        assert CHECKS["packages"](Listening()) == "`adapters` on this path is None"


class Round(Listening):
    """The toy that has no boxes."""

    def refuses(self, scene, profile):
        said = super().refuses(scene, profile)
        return "it has no boxes" if any(isinstance(body.shape, Box) for body in scene.bodies) else said


@pytest.mark.parametrize("check", ["refusals", "bad_numbers", "capabilities"])
def test_questions_to_an_engine_without_boxes(check):
    engine = Round()
    assert CHECKS[check](engine) == ""
    shapes = {type(body.shape).__name__ for world in engine.built for body in world.scene.bodies}
    assert "Box" not in shapes and ("Disc" in shapes) is (check == "capabilities")


def test_unknown_settings_asked_with_unused_names():
    profiles, built = [], []

    class Heard(Listening):
        def settings(self, profile, needs, dt, iterations=None):
            if profile not in self.profiles:
                profiles.append((profile, needs.regime, needs.dimension, dt))
            return super().settings(profile, needs, dt, iterations)

        def build(self, scene, dt, settings):
            built.append((scene.name, type(scene.bodies[-1].shape).__name__, dt, dict(settings)))
            return super().build(scene, dt, settings)

    assert CHECKS["refusals"](Heard()) == ""
    assert profiles == [("no such profile", "rest", 2, statements.DT)]
    own = {"iterations": SWEEPS["first"]}
    assert built == [("check_resting", "Box", statements.DT, own | {"no_such_setting": 1.0})]


def test_engine_that_accepts_any_setting_named_and_closed():
    class Lax(Listening):
        def build(self, scene, dt, settings):
            return super().build(scene, dt, {k: v for k, v in settings.items() if k != "no_such_setting"})

    engine = Lax()
    assert CHECKS["refusals"](engine) == "an unknown setting is accepted"
    assert [world.closed for world in engine.built] == [1]


def test_planar_engine_asked_on_after_a_spatial_scene():
    class Planar(Listening):
        facts = replace(Listening.facts, dimensions=frozenset({2}))

        def refuses(self, scene, profile):
            return 3 if scene.name == "check_leaning" else super().refuses(scene, profile)

    assert CHECKS["refusals"](Planar()) == "first: refuses() must give one line or None, not 3"


def test_engine_that_refuses_everything_unproven():
    class Nothing(Listening):
        def refuses(self, scene, profile):
            return "not today"

    with pytest.raises(NotAsked, match=r"^every scene is refused, even check_striking$"):
        CHECKS["capabilities"](Nothing())


def test_place_of_a_fixed_body_at_the_end():
    for after, said in ((0, "second: check_resting, 2-D: floor is fixed but does not move like that"), (-1, "")):

        class Late(Listening):
            def build(self, scene, dt, settings, after=after):
                world = super().build(scene, dt, settings)
                if world.profile == "second" and scene.name == "check_resting":
                    twist, floor = world.twist, scene.index("floor")

                    def moving():
                        told = twist()
                        told[floor, 0] += (world.steps > 3) if after == 0 else (0 < world.steps <= 3)
                        return told

                    world.twist = moving
                return world

        assert CHECKS["capabilities"](Late()) == said
