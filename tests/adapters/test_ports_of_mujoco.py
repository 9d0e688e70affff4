"""Ports of MuJoCo, each in an environment beside MuJoCo C of its release (``make ports``)."""

import math
import os
from dataclasses import replace

import numpy as np
import pytest

from adapters import registry
from adapters.conformance import items
from adapters.engine import EngineError
from adapters.mujoco.mjx import MujocoMjxEngine, MujocoMjxSingleEngine
from adapters.mujoco.newton import NewtonMujocoEngine
from adapters.mujoco.newton import engine as of_newton
from adapters.mujoco.port import ORIGINAL
from adapters.mujoco.warp import MujocoWarpEngine
from adapters.needs import needs
from adapters.scene import Body, Box, HalfSpace, Pair, Scene, Sphere
from adapters.stepping import posed_for, run
from adapters.trajectory import Sampling
from validation.catalogue import CATALOGUE
from validation.running.apart import Apart

UPRIGHT, DT = (1.0, 0.0, 0.0, 0.0), 1.0 / 240.0
FLOOR = Body("floor", HalfSpace((0.0, 0.0, 1.0), 0.0), motion="fixed", pose=(0.0, 0.0, 0.0, *UPRIGHT))
ENGINES = (MujocoWarpEngine(), NewtonMujocoEngine(), MujocoMjxEngine(), MujocoMjxSingleEngine())
PORTS = [pytest.param(engine, marks=pytest.mark.optional(engine.name)) for engine in ENGINES]


def ball(mu, speed=1.0):
    """A ball that strikes a floor at 2 m/s, with a ``speed`` along it [m/s]."""
    body = Body("ball", Sphere(0.5), 1.0, (0.1,) * 3, (0.0, 0.0, 0.6, *UPRIGHT), (speed, 0.0, -2.0, 0.0, 0.0, 0.0))
    return Scene("fall", 1, 3, (FLOOR, body), (Pair(friction=mu),), (0.0, 0.0, -9.81), 0.25)


def ran(engine, scene, profile="default", **changes):
    settings = {each.name: each.value for each in engine.settings(profile, needs(scene), DT)} | changes
    return run(engine, scene, DT, settings, Sampling(contacts_from=0.0))


@pytest.mark.parametrize(
    "item",
    [
        pytest.param(item, marks=pytest.mark.optional(engine.name), id=f"{engine.name}-{item}")
        for engine in ENGINES[:-1]  # the last has the steps of the one before
        for item in items(engine)
    ],
)
def test_conformance(item):
    item.hold()


@pytest.mark.parametrize("engine", PORTS)
def test_process_that_has_imported_a_port(engine, monkeypatch):
    """It answers again: what cells share is as before, also where JAX finds none of the variables that it sets."""
    for name in ("TF_CPP_MIN_LOG_LEVEL", "TPU_SKIP_MDS_QUERY"):
        monkeypatch.delenv(name, raising=False)
    with Apart() as apart:
        first = apart.ask(os.getpid)
        apart.ask(registry.find, engine.name)
        assert apart.ask(os.getpid) == first


@pytest.mark.parametrize("engine", PORTS)
@pytest.mark.parametrize("solref", [(0.02, 1.0), (-1e4, 0.0)], ids=["as shipped", "undamped"])
def test_rough_ball_as_in_c(engine, solref):
    """Undamped contacts: public reports of MJX 3.1 to 3.3 (google-deepmind/mujoco#1668, #2548) found no rebound."""
    here, there = (ran(each, ball(0.3), solref=solref) for each in (ORIGINAL, engine))
    assert (here.twist[-1, 1, 2] > 0.5) == (solref[0] < 0.0)
    within = 1e-5 if engine.facts.precision == "single" else 1e-9
    assert np.abs(here.pose - there.pose).max() < within
    assert len(there.contacts.rows.a) == len(here.contacts.rows.a) > 7
    assert np.allclose(there.contacts.rows.impulse, here.contacts.rows.impulse, atol=10.0 * within)


@pytest.mark.parametrize("engine", PORTS[:2])
def test_flat_pyramid_in_warp(engine):
    """In single precision its edges are alike; C moves the ball by its law."""
    for mu in (0.0, 1e-5, 1e-3):
        assert ran(engine, ball(mu, 0.0)).finish == "diverged"
        assert ran(ORIGINAL, ball(mu, 0.0)).finish == "completed"
    for mu, changes in ((0.01, {}), (0.0, {"smooth_condim": 1}), (0.0, {"cone": "elliptic"})):
        here, there = (ran(each, ball(mu, 0.0), **changes) for each in (ORIGINAL, engine))
        assert np.abs(here.pose - there.pose).max() < 1e-6


@pytest.mark.optional("mujoco_mjx")
def test_pair_without_friction_in_mjx():
    """C has friction 1e-5 in its rows, the port has 0."""
    engine, within = MujocoMjxEngine(), {}
    for name, mu, changes in (("none", 0.0, {}), ("that of C", 1e-5, {}), ("no rows", 0.0, {"smooth_condim": 1})):
        here, there = (ran(each, ball(mu), **changes) for each in (ORIGINAL, engine))
        within[name] = np.abs(here.pose - there.pose).max()
    assert within["none"] > 1e-3 and within["that of C"] < 1e-6 and within["no rows"] < 1e-9


@pytest.mark.optional("mujoco_mjx")
@pytest.mark.parametrize("rough", [False, True])
def test_elliptic_cones_of_pairs_without_friction_in_mjx(rough):
    """Scenes with and without a cone; tuned: elliptic cones, no friction rows of pairs without friction."""
    scene = ball(0.0)
    if rough:
        far = replace(scene.bodies[1], name="far", pose=(3.0, 0.0, 0.6, *UPRIGHT))
        scene = replace(scene, bodies=(*scene.bodies, far), pairs=(*scene.pairs, Pair("floor", "far", friction=0.3)))
    here, there = (ran(each, scene, "tuned") for each in (ORIGINAL, MujocoMjxEngine()))
    assert np.abs(here.pose - there.pose).max() < 1e-9


@pytest.mark.optional("mujoco_mjx")
def test_overlap_below_a_micrometre_in_mjx():
    """Of two boxes it has no contacts then; of a box and a plane it has."""
    lower = Body("box", Box((0.2,) * 3), 1.0, (0.03,) * 3, (0.0, 0.0, 0.2, *UPRIGHT))
    for deep, boxes in ((5e-7, 0), (2e-6, 4)):
        upper = replace(lower, name="upper", pose=(0.0, 0.0, 0.6 - deep, *UPRIGHT))
        scene = replace(ball(0.3), bodies=(FLOOR, replace(lower, motion="fixed"), upper), duration=DT)
        counts = [len(ran(each, scene).contacts.rows.a) for each in (ORIGINAL, MujocoMjxEngine())]
        assert counts == [4, boxes]


@pytest.mark.optional("mujoco_mjx")
@pytest.mark.parametrize("angle", [30.0, 45.0])
def test_edge_on_a_box_in_mjx(angle):
    """The face of the edge nearest to the normal is at an angle to it; so is the overlap that MJX measures."""
    turn, deep = math.radians(angle), 1e-3
    lower = Body("box", Box((0.5,) * 3), motion="fixed", pose=(0.0, 0.0, 0.5, *UPRIGHT))
    pose = (0.0, 0.0, 1.0 + 0.2 * (math.cos(turn) + math.sin(turn)) - deep, math.cos(turn / 2), 0.0, math.sin(turn / 2))
    upper = Body("upper", Box((0.2,) * 3), 1.0, (0.03,) * 3, (*pose, 0.0))
    scene = replace(ball(0.3), bodies=(lower, upper), duration=DT)
    here, there = (ran(each, scene).contacts.rows.gap for each in (ORIGINAL, MujocoMjxEngine()))
    assert np.allclose(here, -deep) and np.allclose(there, -deep / math.cos(turn)) and len(there) == 2 * len(here) == 4


@pytest.mark.optional("mujoco_mjx")
def test_box_in_the_margin_of_a_plane_in_mjx():
    """No corner overlaps the plane, and not all four lowest ones are contacts."""
    for gap, corners in ((1e-4, False), (-1e-4, True)):
        box = Body("box", Box((0.2,) * 3), 1.0, (0.03,) * 3, (0.0, 0.0, 0.2 + gap, *UPRIGHT))
        scene = replace(ball(0.3), bodies=(FLOOR, box), duration=DT)
        here, there = (len(ran(each, scene, margin=1e-3).contacts.rows.a) for each in (ORIGINAL, MujocoMjxEngine()))
        assert here == 4 and (there == 4) == corners


@pytest.mark.optional("mujoco_mjx")
@pytest.mark.parametrize(("margin", "near"), [(0.0, False), (-1e-5, True)])
def test_boxes_that_touch_at_the_start_in_mjx(margin, near):
    """They fall alike, so none overlaps the other; contacts of both engines begin at the same overlap of 1e-5 m."""
    scene = posed_for(ORIGINAL, CATALOGUE["heavy_on_light"].scene(3, {}))
    changes = {"margin": margin, "disabled": ("warmstart",)}  # where its solver starts is another cause
    here, there = (ran(each, scene, "tuned", **changes) for each in (ORIGINAL, MujocoMjxEngine()))
    apart = np.abs(here.pose - there.pose).max()
    assert apart < 1e-9 if near else apart > 1e-4


@pytest.mark.optional("mujoco_mjx")
@pytest.mark.parametrize(("changes", "near"), [({}, False), ({"disabled": ("warmstart",)}, True)])
def test_start_of_the_solver_in_mjx(changes, near):
    """From the forces of the last step it may stop far from the solution: two dominoes fly away."""
    scene = posed_for(ORIGINAL, CATALOGUE["domino"].scene(2, {}))
    here, there = (ran(each, scene, "tuned", **changes) for each in (ORIGINAL, MujocoMjxEngine()))
    apart = np.abs(here.pose - there.pose).max()
    assert apart < 1e-3 if near else apart > 1.0


@pytest.mark.optional("mujoco_mjx")
def test_contacts_that_do_not_fit_in_mjx(monkeypatch):
    """Four boxes on a floor have sixteen contacts; of 40 that they might have it solves for 32."""
    from adapters.mujoco import mjx

    boxes = [
        Body(f"box{k}", Box((0.2,) * 3), 1.0, (0.03,) * 3, (k, 0.0, 0.19, *UPRIGHT), (0.1, *[0.0] * 5))
        for k in range(mjx.MANY)
    ]
    scene = replace(ball(0.3), bodies=(FLOOR, *boxes), duration=10.0 * DT)
    here, there = (ran(each, scene) for each in (ORIGINAL, MujocoMjxEngine()))
    assert np.abs(here.pose - there.pose).max() < 1e-9 and len(there.contacts.rows.a) == len(here.contacts.rows.a) > 16
    monkeypatch.setattr(mjx, "CONTACTS", 4)
    with pytest.raises(EngineError, match="contacts do not fit"):
        ran(MujocoMjxEngine(), scene)


@pytest.mark.optional("mujoco_mjx")
def test_mappings_of_memory_that_mjx_keeps():
    """Linux allows 65530 of a process, and beyond it JAX aborts."""
    from adapters.mujoco import mjx

    def mappings():
        with open("/proc/self/maps", encoding="ascii") as stream:
            return sum(1 for _ in stream)

    mjx._steps.cache_clear()
    ran(MujocoMjxEngine(), ball(0.3))
    kept, held = mjx._steps.cache_info().maxsize, mappings()
    mjx._steps.cache_clear()
    assert 300 < held - mappings() < 65530 / 2 / kept


@pytest.mark.optional("mujoco_mjx")
def test_precision_of_mjx():
    double, single = (ran(engine, ball(0.3)) for engine in (MujocoMjxEngine(), MujocoMjxSingleEngine()))
    assert 1e-9 < np.abs(double.pose - single.pose).max() < 1e-5
    assert math.isclose(double.readback["tolerance"], 1e-8)


# ---- Newton's MuJoCo solver ------------------------------------------------------------------------------------------

BOX = Body("box", Box((0.2, 0.2, 0.2)), 1.0, (0.1,) * 3, (3.0, 0.0, 0.3, *UPRIGHT))


@pytest.mark.optional("mujoco_newton")
@pytest.mark.parametrize(
    ("changes", "line"),
    [
        ({"margin": 0.01}, "geom_margin: "),
        ({"noslip_iterations": 5}, "option noslip_iterations: Newton has [0] for [5]"),
    ],
)
def test_setting_that_newton_does_not_carry_over(changes, line):
    scene = ball(0.3)
    with pytest.raises(EngineError) as caught:
        ran(NewtonMujocoEngine(), replace(scene, bodies=(*scene.bodies, BOX)), **changes)
    assert str(caught.value).startswith(line)


@pytest.mark.optional("mujoco_newton")
def test_order_of_pairs_in_newton(monkeypatch):
    """After MuJoCo has sorted pairs, Newton enters their materials in the order of the file."""
    scene, engine = ball(0.3), NewtonMujocoEngine()
    bodies = (BOX, *reversed(scene.bodies))
    scene = replace(scene, bodies=bodies, pairs=(Pair("floor", "ball", friction=0.3), Pair("box", "*", friction=0.1)))
    here, there = ran(ORIGINAL, scene), ran(engine, scene)
    assert np.abs(here.pose - there.pose).max() < 1e-5
    monkeypatch.setattr(of_newton, "sorted", lambda pairs, key: list(pairs), raising=False)
    with pytest.raises(EngineError, match=r"^pair_friction: Newton has"):
        ran(engine, scene)


@pytest.mark.optional("mujoco_newton")
def test_spin_in_newton():
    """Each step converts the state to that of MuJoCo and back, in single precision; a free ball gains speed."""
    scene = replace(ball(0.0), bodies=(replace(ball(0.0).bodies[1], twist=(0.0, 0.0, 0.0, 3.0, -2.0, 4.0)),), pairs=())
    scene, gained = replace(scene, gravity=(0.0,) * 3, duration=1000.0 * DT), []
    for engine, changes in (
        (MujocoWarpEngine(), {}),
        (NewtonMujocoEngine(), {}),
        (NewtonMujocoEngine(), {"update_data_interval": 0}),
    ):
        spin = np.linalg.norm(ran(engine, scene, **changes).twist[:, 0, 3:], axis=1)
        gained.append(spin[-1] / spin[0] - 1.0)
    assert 1e-4 < gained[1] < 1e-3 and max(abs(gained[0]), abs(gained[2])) < 1e-5


@pytest.mark.optional("mujoco_newton")
@pytest.mark.parametrize("e", [0.0, 1.0])
def test_restitution_of_newtons_shapes(e):
    """A public report (isaac-sim/IsaacSim, discussion 698): e = 1 falls as e = 0 does; true is a rebound to e^2 h."""
    import newton
    import warp

    builder = newton.ModelBuilder()
    config = newton.ModelBuilder.ShapeConfig(restitution=e)
    builder.add_ground_plane(cfg=config)
    place = warp.transform((0.0, 0.0, 1.5), warp.quat_identity())
    builder.add_shape_sphere(builder.add_body(xform=place), radius=0.5, cfg=config)
    model = builder.finalize(device="cpu")
    solver, heights = newton.solvers.SolverMuJoCo(model), []
    now, after, control = model.state(), model.state(), model.control()
    for _ in range(round(1.0 / DT)):
        solver.step(now, after, control, None, DT)
        now, after = after, now
        heights.append(float(now.body_q.numpy()[0, 2]))
    lowest = int(np.argmin(heights))
    assert lowest < len(heights) - 100 and max(heights[lowest:]) < 0.5


@pytest.mark.parametrize("engine", PORTS[:2])
def test_fast_cube_that_lifts(engine):
    """A public report (Genesis-Embodied-AI/genesis-world#3115): true is no lift: friction is below b/h = 1."""
    cube = Body("cube", Box((0.05,) * 3), 1.0, (1.0 / 600.0,) * 3, (0.0, 0.0, 0.05, *UPRIGHT), (6.0, *[0.0] * 5))
    scene = Scene("cube", 1, 3, (FLOOR, cube), (Pair(friction=0.5),), (0.0, 0.0, -9.81), 0.5)
    settings = {each.name: each.value for each in engine.settings("default", needs(scene), 0.005)}
    lifted = run(engine, scene, 0.005, settings).pose[:, 1, 2].max() - 0.05
    assert 0.07 < lifted < 0.08


@pytest.mark.optional("mujoco_newton")
def test_body_without_mass_in_newton():
    """A public report (newton-physics/newton#2301): such a wall let bodies through; now MuJoCo refuses it."""
    import newton

    builder = newton.ModelBuilder()
    builder.add_shape_box(builder.add_body(mass=0.0), cfg=newton.ModelBuilder.ShapeConfig(density=0.0))
    with pytest.raises(ValueError, match="mass and inertia of moving bodies"):
        newton.solvers.SolverMuJoCo(builder.finalize(device="cpu"))
