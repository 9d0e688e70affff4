"""Everything a kernel would not survive is refused here, in one line that names the field."""

import math

import numpy as np
import pytest

from reference_solver import Body, Box, Disc, HalfSpace, Model, Settings, Simulation, Sphere
from reference_solver.model import pair_table

FLOOR = Body(HalfSpace((0.0, 1.0)), motion="fixed")
BALL = Body(Disc(0.5), 1.0, 0.125, (0.0, 0.5, 0.0))
STANDING = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)


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
        (lambda: Body(Sphere(1.0), 1.0, (1.0, 1.0, 5.0), STANDING), "inertia"),
        (lambda: Body(Box((1.0,) * 3), 1.0, (2.1, 1.0, 1.0), STANDING), "inertia"),
        (lambda: Body(Sphere(1.0), 1.0, (1.0, 2.0 + 1e-4, 1.0), STANDING), "inertia"),
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
def test_refusal_of_bad_models_by_field(make, field):
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
def test_refusal_of_bad_settings_by_field(wrong):
    field = next(iter(wrong))
    with pytest.raises(ValueError, match=f"^{field}: "):
        Settings(**({"dt": 0.01} | wrong))


def test_restitution_outside_0_to_1():
    with pytest.warns(UserWarning, match="restitution"):
        model = Model(2, [FLOOR, BALL], (0.0, 0.0), [[0.0, 1.2], [1.2, -0.5]], 0.0)
    assert model.restitution.tolist() == [[0.0, 1.0], [1.0, 0.0]]


def test_model_after_a_change_of_the_caller_s_array():
    table = np.full((2, 2), 0.5)
    model = Model(2, [FLOOR, BALL], (0.0, 0.0), table, table)
    table[:] = 0.0
    assert model.restitution[0, 1] == model.friction[0, 1] == 0.5


def test_normalisation_of_nearly_unit_quaternions_and_normals():
    body = Body(Sphere(1.0), 1.0, (1.0, 1.0, 1.0), (0.0, 0.0, 0.0, 1.0 + 1e-9, 0.0, 0.0, 0.0))
    assert body.pose[3] == 1.0
    assert HalfSpace((0.6, 0.8 + 1e-9)).normal == pytest.approx((0.6, 0.8), abs=1e-8)


@pytest.mark.parametrize("steps", [-1, 1.5, True])
def test_step_counts_are_checked(steps):
    simulation = Simulation(Model(2, [FLOOR, BALL], (0.0, 0.0), 0.0, 0.0), Settings.classical(0.01))
    with pytest.raises(ValueError, match=r"^steps: "):
        simulation.advance(steps)


@pytest.mark.parametrize("moments", [(1.0, 1.0, 2.0), (0.083333, 0.083333, 0.166667), (1.0, 1.0, 1e-12)])
def test_moments_of_a_plate_and_a_rod(moments):
    """Flat: the largest is the sum of the others; thin: one is nearly nothing."""
    assert Body(Sphere(1.0), 1.0, moments, STANDING).inertia == moments


@pytest.mark.parametrize("dimension", [2, 3])
def test_room_of_pair_values_that_are_one_number(dimension):
    """1e5 bodies have 1e10 pairs: 80 GB a table. 2-D: a model of that many is made and stepped."""
    count = 100_000
    if dimension == 2:
        bodies = [FLOOR, *(Body(Disc(0.4), 1.0, 0.08, (float(i), 0.5, 0.0)) for i in range(count))]
        model = Model(2, bodies, (0.0, -9.81), 0.5, 0.3)
        simulation = Simulation(model, Settings.classical(1.0 / 240.0))
        simulation.advance(1)
        assert (simulation.twist[1:, 1] == -9.81 / 240.0).all()
    else:
        model = Model(3, [Body(Sphere(1.0), 1.0, (1.0,) * 3, STANDING)] * count, (0.0,) * 3, 0.5, 0.3)
    for table, value in ((model.restitution, 0.5), (model.friction, 0.3)):
        assert table.shape == (len(model.bodies),) * 2 and table[0, -1] == value
        kept = pair_table(table)
        assert kept[0, -1] == value and kept.strides == (0, 0)


@pytest.mark.parametrize("n", [1, 2, 3])
def test_layout_of_pair_tables(n):
    """Another layout would be another type, and all kernels compiled anew for it."""
    values = np.arange(float(n * n)).reshape(n, n)
    for table in (values, np.broadcast_to(0.5, (n, n))):
        kept = pair_table(table)
        assert not kept.flags.c_contiguous and not kept.flags.f_contiguous and kept.flags.writeable
        assert (kept[:n, :n] == table).all()
