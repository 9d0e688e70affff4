"""What adapters know of older releases: one table each, and code that does there what it does on the newest."""

import sys
from importlib.metadata import version
from types import SimpleNamespace

import numpy as np
import pytest
from packaging.specifiers import SpecifierSet

from adapters import registry
from adapters.engine import EngineError
from adapters.needs import needs
from adapters.stepping import posed_for
from validation.catalogue import CATALOGUE

WITH_RELEASES = ["chipmunk", "bullet", "mujoco"]


@pytest.mark.parametrize("name", WITH_RELEASES)
def test_known_installed_release(name):
    if name == "bullet":
        pytest.importorskip("pybullet", reason="pybullet has no wheel for this Python")
    releases = registry.adapter(name).releases
    assert SpecifierSet(releases.known).contains(registry.load(name).version())
    for requirement in releases.requirements:
        assert SpecifierSet(requirement.versions) and requirement.because


@pytest.mark.parametrize("name", WITH_RELEASES)
def test_each_release_is_carried_by_exactly_one_distribution(name):
    releases = registry.adapter(name).releases
    for release in ("3.0.0", "3.2.7", "3.17.0", "4.0.0", "4.0.1", "6.4.0", "7.3.1"):
        carriers = [d.name for d in releases.distributions if SpecifierSet(d.versions).contains(release)]
        assert len(carriers) == 1


def settings_of(engine, scene):
    for profile in engine.profiles:
        yield {setting.name: setting.value for setting in engine.settings(profile, needs(scene), 1.0 / 240.0)}


def scenes_of(engine):
    for canonical in CATALOGUE.values():
        for dimension in canonical.dimensions:
            try:
                scene = posed_for(engine, canonical.scene(dimension))
            except EngineError:  # asks for what it has no ability for
                continue
            if not engine.refuses(scene, "default"):
                yield scene


def arrays(model):
    """Every number of a compiled model by name."""
    for place in (model, model.opt, model.stat):
        for name in dir(place):
            value = getattr(place, name)
            if not name.startswith("_") and isinstance(value, np.ndarray | float | int):
                yield f"{type(place).__name__}.{name}", np.asarray(value)


def test_mjcf_model_equal_to_mjspec_to_the_last_bit(monkeypatch):
    pytest.importorskip("mujoco")
    import mujoco

    from adapters.mujoco import spec as adapter
    from adapters.mujoco.releases import Mjcf

    engine, compared = registry.load("mujoco"), 0
    for scene in scenes_of(engine):
        for settings in settings_of(engine, scene):
            written = []
            for make in (lambda mj: mj.MjSpec(), Mjcf):
                monkeypatch.setattr(adapter, "empty_spec", make)
                written.append(dict(arrays(adapter.Spec(scene, 1.0 / 240.0, settings).compile())))
            ours, theirs = written
            differing = [name for name in ours if not np.array_equal(ours[name], theirs[name], equal_nan=True)]
            assert differing == []
            assert int(ours["MjOption.disableflags"]) == mujoco.mjtDisableBit.mjDSBL_AUTORESET
            compared += 1
    assert compared > 40


def older_mujoco(**changed):
    """The installed MuJoCo as a release without autoreset's flag would show itself."""
    mujoco = pytest.importorskip("mujoco")
    names = {"mjtDisableBit": SimpleNamespace(), "mjtWarning": mujoco.mjtWarning, **changed}
    return SimpleNamespace(**names)


def test_reset_state_refused_where_resets_cannot_be_disabled():
    from adapters.mujoco.releases import check_state

    mujoco = older_mujoco()
    data = SimpleNamespace(warning={kind: SimpleNamespace(number=0) for kind in mujoco.mjtWarning.__members__.values()})
    check_state(mujoco, data)
    data.warning[mujoco.mjtWarning.mjWARN_BADQACC].number = 1
    with pytest.raises(EngineError, match="reset a state that was not finite"):
        check_state(mujoco, data)


@pytest.mark.parametrize(
    ("release", "own"), [("3.0.0", 1.0), ("3.4.0", 1.0), ("3.5.0", 0.5), ("3.10.1", 0.5), ("4.0.1", 0.5)]
)
def test_margin_of_two_geoms(release, own):
    """Their sum since 3.5.0, the larger of the two before."""
    from adapters.mujoco.releases import geom_margin

    assert geom_margin(SimpleNamespace(__version__=release), 0.25) == own * 0.25


def test_margin_of_a_contact_as_asked_for():
    pytest.importorskip("mujoco")
    engine, checked = registry.load("mujoco"), 0
    for scene in scenes_of(engine):
        for settings in settings_of(engine, scene):
            simulation = engine.build(scene, 1.0 / 240.0, settings)
            simulation.advance(1)
            for contact in simulation._data.contact:
                assert contact.includemargin == pytest.approx(settings["margin"], rel=1e-12)
                checked += settings["margin"] > 0.0
    assert checked > 10


def test_mjspec_without_attributes_replaced():
    from adapters.mujoco.releases import Mjcf, empty_spec

    def refusing(**attributes):
        raise TypeError("add_body(): incompatible function arguments")

    body = SimpleNamespace(add_body=refusing)
    assert isinstance(empty_spec(older_mujoco(MjSpec=lambda: SimpleNamespace(worldbody=body))), Mjcf)
    assert isinstance(empty_spec(older_mujoco()), Mjcf)

    class Keeping:
        """Takes attributes, as 3.2.3 does, and cannot hand out its options."""

        worldbody = SimpleNamespace(add_body=lambda **attributes: None)

        @property
        def option(self):
            raise TypeError("Unable to convert function return value to a Python type!")

    assert isinstance(empty_spec(older_mujoco(MjSpec=Keeping)), Mjcf)


def test_impulses_of_an_opaque_arbiter():
    pymunk = pytest.importorskip("pymunk")
    from adapters.chipmunk.releases import points_of, shape_key

    space, found = pymunk.Space(), []
    space.gravity = (0.0, -10.0)
    box = pymunk.Body(2.0, 1.0)
    box.position = (0.0, 0.45)
    shapes = [pymunk.Poly.create_box(box, (1.0, 1.0)), pymunk.Segment(space.static_body, (-5, 0), (5, 0), 0.0)]
    space.add(box, *shapes)
    space.step(0.1)
    told = {shape_key(shape): k for k, shape in enumerate(shapes)}, (True, False), (box.position, (0.0, 0.0))

    def look(arbiter):
        public = {name: getattr(arbiter, name) for name in ("total_impulse", "shapes", "contact_point_set")}
        opaque = SimpleNamespace(**public, _arbiter=SimpleNamespace())
        found.append((points_of(arbiter, 0, *told), points_of(opaque, 0, *told)))

    box.each_arbiter(look)
    exact, parts = (np.array(points) for points in found[0])
    turned = exact[:, [1, 0, *range(2, 9)]] * np.where(np.isin(np.arange(9), (4, 5, 6, 7)), -1.0, 1.0)
    exact = exact if exact[0, 0] == 0 else turned  # a and b are the arbiter's own, or as seen from the body
    assert parts[:, 6:8].sum(axis=0) == pytest.approx(exact[:, 6:8].sum(axis=0), abs=1e-12)
    assert parts[0, 6:8].tolist() == parts[1, 6:8].tolist() and parts[0, 7] < 0.0  # on the second body: downwards
    others = [0, 1, 2, 3, 4, 5, 8]
    assert parts[:, others] == pytest.approx(exact[:, others], abs=1e-15)


def test_pymunk_s_version_is_that_of_its_distribution():
    pytest.importorskip("pymunk")
    assert registry.load("chipmunk").version() == version("pymunk")


# ---- DART ----


class WorldOf618:
    """A world of dartpy 6.18: bodies are never deactivated, and the solver has no second choice."""

    def getConstraintSolver(self):
        return SimpleNamespace()


def test_dart_world_without_deactivation_unchanged():
    from adapters.dart.releases import keep_awake, may_sleep, second_choice, splits_impulses

    world = WorldOf618()
    keep_awake(world)
    assert may_sleep(world) is False
    assert second_choice(world.getConstraintSolver()) is None
    assert splits_impulses(world.getConstraintSolver()) is False


def test_dart_world_kept_awake():
    from adapters.dart.releases import keep_awake, may_sleep

    options = SimpleNamespace(mEnabled=True)
    world = SimpleNamespace(getDeactivationOptions=lambda: options, setDeactivationOptions=lambda new: None)
    assert may_sleep(world) is True
    keep_awake(world)
    assert may_sleep(world) is False


def test_dart_profiles_missing_from_a_release_refused(monkeypatch):
    from adapters.dart.releases import refusal

    for names, refused in (({}, ["pgs", "nsgs", "fbf"]), ({"NsgsFrictionSolver": object}, [])):
        monkeypatch.setitem(sys.modules, "dartpy", SimpleNamespace(constraint=SimpleNamespace(**names)))
        profiles = ("default", "pgs", "nsgs", "fbf")
        assert [name for name in profiles if refusal(name)] == refused
