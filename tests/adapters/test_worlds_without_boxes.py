"""Worlds of engines without boxes are asked with a ball; impulses that nobody tells are the same as themselves."""

import numpy as np
import pytest
from listening import SWEEPS, Discs, Listening

from adapters.conformance import CHECKS, worlds
from adapters.conformance.scenes import resting, rolling, sliding
from adapters.engine import Contacts, Recorded


def test_memory_is_asked_with_a_ball(monkeypatch):
    monkeypatch.setattr(worlds, "WARM", 1)
    monkeypatch.setattr(worlds, "BUILDS", 1)
    monkeypatch.setattr(worlds, "resident", lambda: 1e6)
    engine = Discs()
    assert CHECKS["memory"](engine) == ""
    assert set(engine.worlds("first")) == {"resting floor 2"} and not engine.worlds("second")


@pytest.mark.parametrize(("kind", "scene"), [(Discs, rolling()), (Listening, sliding())])
def test_bits_of_every_profile_against_one_scene(kind, scene):
    engine = kind()
    found = worlds._hashes(engine)
    assert list(found) == list(SWEEPS) and all(len(each) >= 16 for each in found.values())
    assert found == worlds._hashes(kind()), "and the same again"
    assert {world.scene.name for world in engine.built} == {scene.name}
    assert {tuple(body.name for body in world.scene.bodies) for world in engine.built} == {
        tuple(body.name for body in scene.bodies)}  # fmt: skip


class Recorder(Listening):
    """A toy that keeps a record of its own: one by one, with what a test makes of it."""

    def __init__(self, change=lambda told: told, silent=False):
        super().__init__()
        self.change, self.silent = change, silent

    def build(self, scene, dt, settings):
        world = super().build(scene, dt, settings)
        if self.silent:
            inner = world.inner.contacts
            world.inner.contacts = lambda: muted(inner())
        world.record = lambda samples, stride, contacts: self.change(worlds.one_by_one(world, samples, stride))
        return world


def muted(told):
    return Contacts(told.a, told.b, told.point, told.normal, np.full_like(told.impulse, np.nan), told.gap)


def without(told):
    return Recorded(told.pose, told.twist, told.counts, None)


def off(name):
    def change(told):
        rows = {field: getattr(told.contacts, field) for field in ("a", "b", "point", "normal", "impulse", "gap")}
        values = {"pose": told.pose, "twist": told.twist, "counts": told.counts}
        for kept in (rows, values):
            if name in kept:
                kept[name] = kept[name] + 1
        return Recorded(values["pose"], values["twist"], values["counts"], Contacts(**rows))

    return change


@pytest.mark.parametrize("silent", [False, True])
def test_record_equal_to_readers_without_impulses(silent):
    scene = sliding()
    assert worlds._recorded_otherwise(Recorder(silent=silent), scene, "first", 4, 3) == ""


@pytest.mark.parametrize(
    ("change", "said"),
    [(without, "contacts"), (off("pose"), "poses"), (off("twist"), "twists"), (off("counts"), "counts"),
     *((off(name), f"contacts' {name}") for name in ("a", "b", "point", "normal", "impulse", "gap"))],
)  # fmt: skip
def test_part_of_a_recorded_run_that_differs_named(change, said):
    engine = Recorder(change)
    assert worlds._recorded_otherwise(engine, sliding(), "second", 4, 3) == said
    assert all(world.closed == 1 and world.steps == 13 for world in engine.built)
    assert [world.profile for world in engine.built] == ["second"] * 2


def test_engine_without_a_record_not_asked_further():
    engine = Recorder(lambda told: None)
    assert worlds._recorded_otherwise(engine, resting(), "first", 4, 3) == ""
    assert all(world.closed == 1 for world in engine.built)
