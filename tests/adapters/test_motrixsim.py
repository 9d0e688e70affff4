"""The adapter of MotrixSim, on small scenes with known answers."""

import math

import numpy as np
import pytest
from driven import FLOOR, driven, measured_of, struck

from adapters.conformance import items
from adapters.law.single_precision import ROUNDINGS, UNIT
from adapters.mujoco.motrixsim import MotrixSimEngine, shipped
from adapters.mujoco.motrixsim.simulation import imported
from adapters.mujoco.motrixsim.springs import OFF, Spring
from adapters.scene import Body, Box, Pair, Scene
from validation.catalogue import CATALOGUE
from validation.scenes import pinch

pytestmark = pytest.mark.optional("motrixsim")
ENGINE = MotrixSimEngine()
DT = 1.0 / 240.0
SETTINGS, DRIVE = driven(ENGINE, "default")


@pytest.mark.parametrize("item", items(ENGINE), ids=str)
def test_conformance(item):
    item.hold()


def test_shipped_numbers_equal_to_the_engine_s_own():
    world = imported().msd.from_str('<mujoco><worldbody><geom size="1"/></worldbody></mujoco>')
    option, (geom,) = world.simulate_option, world.hierarchy.geoms
    assert option.constraint_solver_iterations == shipped.ITERATIONS
    assert option.constraint_solver_tolerance == pytest.approx(shipped.TOLERANCE)
    assert str(option.solver_type) == "SolverType.PGS"
    model = geom.physics_material.contact_model
    assert model.variant == "impedance"
    (time, ratio), held, impedance = shipped.SOLREF, model.value.spring, model.value.impedance
    assert (held.k, held.d) == pytest.approx(((time * ratio) ** -2, 2.0 / time))
    told = [impedance.d0, impedance.dmax, impedance.width, impedance.middle, impedance.power]
    assert told == pytest.approx(shipped.SOLIMP)


@pytest.mark.parametrize("e", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("erp", [0.0, 0.2])
def test_rebound_of_a_hard_contact(e, erp):
    """The pair's, and the speed that corrects a share of the overlap in a step: here of 0.7 of the way of a step."""
    found = DRIVE(struck(e, 2.0, 1.3 * 2.0 * DT, steps=6), erp=erp).twist[-1, 1, 2]
    assert found == pytest.approx(2.0 * (e + 0.7 * erp), abs=1e-4)


@pytest.mark.parametrize("phase", [0.05, 0.3, 0.7, 0.95])
@pytest.mark.parametrize("dt", [1 / 60, 1 / 240, 1 / 1000])
def test_rebound_of_a_spring(phase, dt):
    """Figure by figure by the recurrence of a spring and a damper, whatever the restitution."""
    spring = {"solref": shipped.SOLREF, "solimp": shipped.SOLIMP, "margin": 0.0}
    said = Spring.of_settings(spring, dt).rebound_ratio(1.0, phase)
    for e in (0.0, 0.8):
        ball = struck(e, 1.0, (2.0 - phase) * dt, steps=math.ceil(0.2 / dt), dt=dt)
        assert DRIVE(ball, dt=dt).twist[-1, 1, 2] == pytest.approx(said, abs=OFF)


@pytest.mark.parametrize(
    "heading, solver, factor", [(0, "PGS", 1.0), (45, "PGS", math.sqrt(2.0)), (45, "Newton", 0.92)]
)
def test_friction_of_a_square(heading, solver, factor):
    """Along an axis mu, between two of them as much along each; with Newton's solver a cone, and a hopping box."""
    a, mu, speed = math.radians(heading), 0.4, 3.0
    twist = (speed * math.cos(a), speed * math.sin(a), 0.0, 0.0, 0.0, 0.0)
    box = Body("box", Box((0.5, 0.5, 0.1)), 1.0, (1 / 6,) * 3, (0, 0, 0.0995, 1, 0, 0, 0), twist)
    found = DRIVE(
        Scene("slide", 1, 3, (FLOOR, box), (Pair(friction=mu),), (0.0, 0.0, -9.81), 0.3), solver=solver
    ).twist[:, 1, :2]
    late = np.linalg.norm(found[[24, 71]], axis=1)
    assert (late[0] - late[1]) / (47 * DT) == pytest.approx(factor * mu * 9.81, rel=0.02)


@pytest.mark.parametrize("profile", ENGINE.profiles)
@pytest.mark.parametrize("margin, held", [(0.98, False), (1.02, True)])
def test_least_friction_that_holds_a_box(profile, margin, held):
    """MotrixSim's grasp benchmark: at 0.98 times the friction that a grip needs a cube slides, at 1.02 it is held."""
    canonical = CATALOGUE["pinch"]
    scene = pinch.make(3, canonical.scene(3, {}).params | {"margin": margin})
    creep, _ = canonical.measure(scene, DRIVE(scene, profile))["creep"]
    assert (abs(creep) < 1e-3) is held


def test_loads_in_world_axes_on_a_body_that_turns():
    """Found from the pose of the step, not of the one before, which would turn a force by the spin times the step."""
    box = Body("box", Box((0.5, 0.5, 0.5)), 2.0, (0.4,) * 3, (0, 0, 0, 1, 0, 0, 0), (0, 0, 0, 0, 0, 9), force=(2, 0, 0))
    found = DRIVE(Scene("pushed", 1, 3, (box,), (), (0.0, 0.0, 0.0), 0.5)).twist[-1, 0]
    assert found == pytest.approx([0.5, 0, 0, 0, 0, 9], abs=1e-5)


@pytest.mark.parametrize("profile", ENGINE.profiles)
@pytest.mark.parametrize(
    "scene, dimension, params, size",
    [
        ("edge_drop", 3, {"e": 0.5, "tilt": 20}, {"twisted": 2.0}),
        ("rolling_spin", 3, {}, {"spin": 10.0}),
    ],
)
def test_errors_that_rounding_explains(scene, dimension, params, size, profile):
    """As many halves of a last place of single precision as there are steps."""
    canonical = CATALOGUE[scene]
    posed = canonical.scene(dimension, params)
    found, truth = measured_of(ENGINE, scene, profile, dimension, params), canonical.exact(posed)
    for metric, scale in size.items():
        assert abs(found[metric] - truth.get(metric, 0.0)) <= posed.duration / DT * UNIT * scale


@pytest.mark.parametrize("e, tilt", [(0.5, 20), (1.0, 30)])
def test_edge_struck_by_a_hard_contact(e, tilt):
    """The textbook's blow but for roundings, also in space."""
    params = {"e": e, "tilt": tilt}
    found, truth = (
        measured_of(ENGINE, "edge_drop", "tuned", 3, params),
        CATALOGUE["edge_drop"].exact(CATALOGUE["edge_drop"].scene(3, params)),
    )
    for metric in ("rise", "spin", "impulse"):
        assert found[metric] == pytest.approx(truth[metric], abs=ROUNDINGS * UNIT)


@pytest.mark.parametrize(
    "scene, params, metric",
    [("rack", {}, "energy_defect"), ("rack", {}, "asymmetry"), ("overlap", {"depth": 0.01, "ratio": 100}, "thrown")],
)
def test_hard_balls_but_for_roundings(scene, params, metric):
    assert abs(measured_of(ENGINE, scene, "tuned", 2, params)[metric]) <= ROUNDINGS * UNIT


@pytest.mark.parametrize("profile", ENGINE.profiles)
def test_distant_box_without_any_motion(profile):
    """A motion of a step below half the spacing of places is lost, and no overlap is found: it only gets faster."""
    far = CATALOGUE["far_origin"]
    scene = far.scene(3, {})
    found = DRIVE(scene, profile)
    assert np.ptp(found.pose[:, 1], axis=0).max() == 0.0
    assert found.twist[-1, 1, 2] == pytest.approx(-9.81 * found.t[-1], rel=1e-4)
