"""Everything a kernel would not survive is refused here, in one line that names the field."""

import math

import numpy as np
import pytest

from reference_solver import Body, Box, Disc, HalfSpace, Model, Settings, Simulation, Sphere

FLOOR = Body(HalfSpace((0.0, 1.0)), motion="fixed")
BALL = Body(Disc(0.5), 1.0, 0.125, (0.0, 0.5, 0.0))


@pytest.mark.parametrize(
    ("make", "field"),
    [
        (lambda: Disc(0.0), "radius"),
        (lambda: Disc(math.nan), "radius"),
        (lambda: Sphere(-1.0), "radius"),
        (lambda: Box((1.0, 0.0)), "half_extents"),
        (lambda: Box((1.0,)), "half_extents"),
        (lambda: Box(1.0), "half_extents"),
        (lambda: HalfSpace((0.0, 2.0)), "normal"),
        (lambda: HalfSpace((0.0, 1.0), math.inf), "offset"),
        (lambda: Body("disc", 1.0, 1.0), "shape"),
        (lambda: Body(Disc(1.0), 0.0, 1.0), "mass"),
        (lambda: Body(Disc(1.0), math.inf, 1.0), "mass"),
        (lambda: Body(Disc(1.0), 1.0, -1.0), "inertia"),
        (lambda: Body(Disc(1.0), 1.0, (1.0, 1.0, 1.0)), "inertia"),
        (lambda: Body(Disc(1.0), 1.0, 1.0, (0.0, 0.0)), "pose"),
        (lambda: Body(Disc(1.0), 1.0, 1.0, (0.0, math.nan, 0.0)), "pose"),
        (lambda: Body(Disc(1.0), 1.0, 1.0, (0.0, 0.0, 0.0), (1.0, 2.0)), "twist"),
        (lambda: Body(Disc(1.0), 1.0, 1.0, motion="kinematic"), "motion"),
        (lambda: Body(Disc(1.0), 1.0, 1.0, force=(1.0,)), "force"),
        (lambda: Body(Disc(1.0), 1.0, 1.0, torque=(1.0, 0.0, 0.0)), "torque"),
        (lambda: Body(HalfSpace((0.0, 1.0)), 1.0, 1.0), "motion"),
        (lambda: Body(Disc(1.0), motion="fixed", twist=(1.0, 0.0, 0.0)), "twist"),
        (lambda: Body(Sphere(1.0), 1.0, (1.0, 1.0, 1.0), (0.0,) * 3 + (0.5, 0.0, 0.0, 0.0)), "pose"),
        (lambda: Model(4, [BALL], (0.0, 0.0), 0.0, 0.0), "dimension"),
        (lambda: Model(2, [], (0.0, 0.0), 0.0, 0.0), "bodies"),
        (lambda: Model(3, [BALL], (0.0, 0.0, 0.0), 0.0, 0.0), r"bodies\[0\]"),
        (lambda: Model(2, [Body(Sphere(1.0), 1.0, 1.0)], (0.0, 0.0), 0.0, 0.0), r"bodies\[0\]"),
        (lambda: Model(2, [BALL], (0.0, 0.0, -9.81), 0.0, 0.0), "gravity"),
        (lambda: Model(2, [BALL], (0.0, math.nan), 0.0, 0.0), "gravity"),
        (lambda: Model(2, [FLOOR, BALL], (0.0, 0.0), np.zeros((3, 3)), 0.0), "restitution"),
        (lambda: Model(2, [FLOOR, BALL], (0.0, 0.0), math.nan, 0.0), "restitution"),
        (lambda: Model(2, [FLOOR, BALL], (0.0, 0.0), 0.0, -0.1), "friction"),
        (lambda: Model(2, [FLOOR, BALL], (0.0, 0.0), 0.0, [[0.0, 1.0], [0.0, 0.0]]), "friction"),
    ],
)
def test_bad_models_are_refused_naming_the_field(make, field):
    with pytest.raises(ValueError, match=f"^{field}: ") as caught:
        make()
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "wrong",
    [
        {"dt": 0.0},
        {"dt": math.nan},
        {"dt": -0.1},
        {"iterations": 0},
        {"iterations": 2.5},
        {"residual": 0.0},
        {"max_sweeps": 0},
        {"relaxation": 2.0},
        {"position_correction": "ngs"},
        {"beta": 0.0},
        {"slop": -1.0},
        {"solver": "newton"},
        {"margin": 0.5},
    ],
)
def test_bad_settings_are_refused_naming_the_field(wrong):
    field = next(iter(wrong))
    with pytest.raises(ValueError, match=f"^{field}: "):
        Settings(**({"dt": 0.01} | wrong))


def test_restitution_outside_0_to_1_is_clamped_with_a_warning():
    with pytest.warns(UserWarning, match="restitution"):
        model = Model(2, [FLOOR, BALL], (0.0, 0.0), [[0.0, 1.2], [1.2, -0.5]], 0.0)
    assert model.restitution.tolist() == [[0.0, 1.0], [1.0, 0.0]]


def test_a_model_does_not_change_when_the_callers_array_does():
    table = np.full((2, 2), 0.5)
    model = Model(2, [FLOOR, BALL], (0.0, 0.0), table, table)
    table[:] = 0.0
    assert model.restitution[0, 1] == model.friction[0, 1] == 0.5


def test_nearly_unit_quaternions_and_normals_are_normalised():
    body = Body(Sphere(1.0), 1.0, (1.0, 1.0, 1.0), (0.0, 0.0, 0.0, 1.0 + 1e-9, 0.0, 0.0, 0.0))
    assert body.pose[3] == 1.0
    assert HalfSpace((0.6, 0.8 + 1e-9)).normal == pytest.approx((0.6, 0.8), abs=1e-8)


@pytest.mark.parametrize("steps", [-1, 1.5, True])
def test_step_counts_are_checked(steps):
    simulation = Simulation(Model(2, [FLOOR, BALL], (0.0, 0.0), 0.0, 0.0), Settings.classical(0.01))
    with pytest.raises(ValueError, match=r"^steps: "):
        simulation.advance(steps)
