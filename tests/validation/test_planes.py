"""A planar scene that an engine runs in space owes its plane: how far it may leave it, and who is asked at all."""

import math
from dataclasses import replace

import numpy as np
import pytest

from adapters.needs import needs
from adapters.planted_faults import Planted
from adapters.registry import find
from adapters.scene import Body, Box, Disc, HalfSpace, Scene
from adapters.stepping import run
from validation import bounds
from validation.catalogue import CATALOGUE
from validation.cells import Outcome, Slot, checks_of
from validation.judging.rows import rows_of
from validation.running import execution
from validation.running.execution import execute

DT = 1 / 240


def flying(body, gravity=(0.0, -9.81), duration=2.0):
    return Scene("flight", 1, 2, (body,), (), gravity, duration)


@pytest.mark.parametrize(
    ("body", "gravity", "size"),
    [
        (Body("a", Disc(0.5), 1.0, 0.1, (3.0, 4.0, 0.0)), (0.0, 0.0), 5.5),  # its farthest point, at rest
        (Body("a", Box((0.3, 0.4)), 1.0, 0.1, (0.0, 0.0, 0.0), (3.0, 4.0, 2.0)), (0.0, 0.0), 12.0),  # (5 + .5 x 2) 2 s
        (Body("a", Disc(0.5), 1.0, 0.1, (3.0, 4.0, 0.0)), (6.0, -8.0), 5.5),
    ],
)
def test_a_plane_is_owed_to_a_step_of_gravity_and_to_round_off_of_the_largest_numbers(body, gravity, size):
    """1e-12 for a thousand updates, a thousandfold growth: 1e-9 of places and ways; and g dt^2."""
    found = bounds.planar(flying(body, gravity), DT)
    assert (found.metric, found.unit, found.truth) == ("out_of_plane", "m", 0.0)
    assert found.bound == pytest.approx(math.hypot(*gravity) * DT**2 + 1e-9 * size, rel=1e-12)


def test_the_growth_that_a_plane_is_owed_is_the_horizon_of_the_certificate():
    from reference_solver.certification import truth

    assert bounds.GROWTH == truth.GROWTH


def test_a_motion_that_multiplies_what_is_off_is_allowed_as_much_and_beyond_a_thousandth_is_not_judged():
    scene = flying(Body("a", Disc(0.5), 1.0, 0.1, (3.0, 4.0, 0.0)), (0.0, 0.0))
    assert bounds.planar(scene, DT, 0.5).bound == bounds.planar(scene, DT).bound == pytest.approx(1e-9 * 5.5)
    assert bounds.planar(scene, DT, 1e8).bound == pytest.approx(1e-4 * 5.5)
    beyond = bounds.planar(scene, DT, 4e10)
    assert (beyond.truth, beyond.bound) == (None, None) and "4e+10 times" in beyond.because


@pytest.mark.parametrize(("ratio", "gap"), [(1.0, 2.0), (3.0, 2.0), (16.0, 1.0)])
def test_blows_of_balls_multiply_what_is_off_the_line_as_their_scene_says(ratio, gap):
    """By the reference, in the plane: the small ball begins 1e-11 m off the line, and ends that many times as far."""
    canonical = CATALOGUE["galperin"]
    scene = canonical.scene(2, {"ratio": ratio, "gap": gap})
    engine, off = find("reference").engine, 1e-11
    bodies = [replace(b, pose=(b.pose[0], off, 0.0)) if b.name == "small" else b for b in scene.bodies]
    settings = {each.name: each.value for each in engine.settings("reference", needs(scene), DT)}
    found = run(engine, replace(scene, bodies=tuple(bodies)), DT, settings)
    apart = abs(found.pose[-1, 1, 1] - found.pose[-1, 2, 1])
    assert apart / off == pytest.approx(canonical.growth(scene), rel=0.02)


def test_half_spaces_count_by_where_they_stand():
    ground = Body("floor", HalfSpace((0.0, 1.0), 0.0), motion="fixed")
    ball = Body("a", Disc(0.5), 1.0, 0.1, (0.0, 0.5, 0.0))
    assert bounds.planar(Scene("s", 1, 2, (ground, ball), (), (0.0, 0.0), 1.0), DT).bound == pytest.approx(1e-9)


class Sideways(Planted):
    """An engine that moves all bodies across the plane, by ``size`` m once half of a second is over."""

    def __init__(self, inner, size):
        super().__init__(inner, "drift", 0.0)
        self.size = size

    def build(self, scene, dt, settings):
        simulation = self.inner.build(scene, dt, settings)
        inner, steps = simulation.advance, [0]
        seen = simulation.pose

        def advance(count):
            steps[0] += count
            inner(count)

        def pose():
            found = np.array(seen())
            found[:, 1] += self.size * (steps[0] * dt > 0.5)
            return found

        simulation.advance, simulation.pose, simulation.record = advance, pose, lambda *asked: None
        return simulation


@pytest.fixture
def observed(monkeypatch):
    """`observed(size, scene)`: what MuJoCo, moved across the plane by that, gives of a cell of the scene."""
    pytest.importorskip("mujoco")

    def run(size, scene="impact", dimension=2):
        slot = Slot(scene, (), dimension, "mujoco", "tuned", DT)
        prepared = execution.prepare(slot)
        engine = Sideways(find("mujoco").engine, size)
        settings = {each.name: each.value for each in execution.settings_of(engine.inner, slot, prepared.scene)}
        trajectory = execution.run(engine, prepared.scene, DT, settings, prepared.canonical.sampling(prepared.scene))
        monkeypatch.setattr(execution, "run", lambda *asked: trajectory)
        found = execute(slot)
        monkeypatch.undo()
        return found[0] if isinstance(found, tuple) else found

    return run


@pytest.mark.parametrize("scene", ["impact", "slide", "stack"])
@pytest.mark.parametrize("share", [1.01, 2.0, 100.0])
def test_whoever_leaves_the_plane_by_more_fails_and_by_less_passes(observed, scene, share):
    canonical = CATALOGUE[scene]
    allowed = bounds.planar(canonical.scene(2), DT).bound
    for size, physics in ((share * allowed, "fail"), (0.5 * allowed, "pass")):
        observation = observed(size, scene)
        assert observation.outcome is Outcome.OK
        (row,) = (row for row in rows_of("run", [observation]) if row.metric == "out_of_plane")
        assert row.value == pytest.approx(size, rel=0.5) and row.physics == physics
        assert row.alarming is (physics == "fail")


def test_only_what_is_lifted_is_asked(observed):
    def asked(observation):
        return [check.metric for check in checks_of(observation)[1]].count("out_of_plane")

    assert asked(observed(0.0)) == 1
    assert asked(observed(0.0, dimension=3)) == 0
    pytest.importorskip("pymunk")
    planar = execute(Slot("impact", (), 2, "chipmunk", "tuned", DT))
    assert asked(planar[0] if isinstance(planar, tuple) else planar) == 0


def test_a_cell_without_an_answer_owes_no_plane(observed):
    crashed = replace(observed(0.0), outcome=Outcome.CRASHED, metrics={})
    assert "out_of_plane" not in {row.metric for row in rows_of("run", [crashed])}
