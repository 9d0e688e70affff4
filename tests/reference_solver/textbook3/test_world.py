"""The spatial world as a whole: agreement with the planar solver, nothing lost by leaving out, same bits."""

import math

import numpy as np
import pytest

from reference_solver import Body, Box, Disc, HalfSpace, Model, Settings, Simulation, Sphere

G = 9.81


def lifted(body):
    """Spatial counterpart of a planar body: y up becomes z up, a turn becomes one about -y."""
    x, y, angle = body.pose
    vx, vy, omega = body.twist
    if isinstance(body.shape, HalfSpace):
        shape = HalfSpace((body.shape.normal[0], 0.0, body.shape.normal[1]), body.shape.offset)
    elif isinstance(body.shape, Disc):
        shape = Sphere(body.shape.radius)
    else:
        hx, hy = body.shape.half_extents
        shape = Box((hx, max(hx, hy), hy))
    pose = (x, 0.0, y, math.cos(angle / 2), 0.0, -math.sin(angle / 2), 0.0)
    moments = (body.inertia,) * 3 if body.motion == "free" else 0.0
    return Body(shape, body.mass, moments, pose, (vx, 0.0, vy, 0.0, -omega, 0.0), body.motion)


def floor():
    return Body(HalfSpace((0.0, 1.0)), motion="fixed")


def disc(x, y, twist=(0.0, 0.0, 0.0)):
    return Body(Disc(0.5), 1.0, 0.125, (x, y, 0.0), twist)


def box(x, y, angle=0.0, twist=(0.0, 0.0, 0.0), half=(0.5, 0.5)):
    return Body(Box(half), 1.0, (half[0] ** 2 + half[1] ** 2) / 3, (x, y, angle), twist)


# (bodies, restitution, friction, tolerance of velocities [m/s, rad/s]). Round-off grows a hundredfold per impact. Faces
# that land tilted differ by more: in space heights below 1e-4 of the half width count as flat (`manifolds.FLAT`).
SCENES = {
    "bouncing, spinning disc": ([disc(0.0, 2.0, (1.0, 0.0, 3.0))], 0.8, 0.5, 1e-12),
    "tumbling box": ([box(0.0, 2.0, 0.3, (1.0, 0.0, 3.0))], 0.5, 0.5, 1e-5),
    "sliding box": ([box(0.0, 0.5, 0.0, (3.0, 0.0, 0.0), (1.0, 0.5))], 0.0, 0.3, 1e-11),
    "column of ten": ([box(0.0, 0.5 + i) for i in range(10)], 0.0, 0.5, 1e-11),
    "overhanging pile": ([box(0.0, 0.5), box(0.0, 1.5), box(0.2, 2.5)], 0.0, 0.5, 1e-11),
    "discs on each other": ([disc(0.0, 0.5), disc(0.1, 1.6), disc(-0.1, 2.8)], 0.3, 0.4, 1e-6),
}


@pytest.mark.parametrize("scene", SCENES)
def test_lifted_planar_scene_against_the_plane(scene, steps=360):
    bodies, restitution, friction, tolerance = SCENES[scene]
    bodies = [floor(), *bodies]
    settings = Settings.reference(1 / 240)
    plane = Simulation(Model(2, bodies, (0.0, -G), restitution, friction), settings).record(steps)
    model = Model(3, [lifted(body) for body in bodies], (0.0, 0.0, -G), restitution, friction)
    space = Simulation(model, settings).record(steps)
    in_plane = np.stack([space.twist[..., 0], space.twist[..., 2], -space.twist[..., 4]], axis=-1)
    assert np.abs(in_plane - plane.twist).max() <= tolerance
    assert np.abs(space.pose[..., [0, 2]] - plane.pose[..., :2]).max() <= tolerance
    assert np.abs(space.twist[..., [1, 3, 5]]).max() <= min(tolerance, 1e-11)


def sphere(place, velocity=(0.0, 0.0, 0.0), spin=(0.0, 0.0, 0.0)):
    return Body(Sphere(0.5), 1.0, (0.1, 0.1, 0.1), (*place, 1.0, 0.0, 0.0, 0.0), (*velocity, *spin))


def ground():
    return Body(HalfSpace((0.0, 0.0, 1.0)), motion="fixed", pose=(0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0))


def heap(friction, restitution=0.5):
    bodies = [
        ground(),
        sphere((0.0, 0.0, 0.6), spin=(0.0, 0.0, 1.0)),
        sphere((0.3, 0.1, 1.7)),
        sphere((-0.2, 0.2, 2.9)),
    ]
    return Model(3, bodies, (0.0, 0.0, -G), restitution, friction)


@pytest.mark.parametrize("friction", [0.0, 0.4])
@pytest.mark.parametrize("restitution", [0.0, 0.5])
def test_answer_without_parts_left_out(friction, restitution):
    """Whole records agree: frictionless spheres without angular terms, no restitution rows, no sorting."""
    model = heap(friction, restitution)
    lean = Simulation(model, Settings.reference(1 / 240))
    full = Simulation(model, Settings.reference(1 / 240), model_everything=True)
    one, other = lean.record(120), full.record(120)
    assert "rotation" in lean.left_out or friction > 0.0
    # Sums are rounded differently; three impacts amplify that a hundredfold each.
    assert np.abs(one.pose - other.pose).max() <= 1e-9
    assert np.abs(one.pose[:20] - other.pose[:20]).max() <= 1e-12


def test_spin_of_frictionless_spheres():
    simulation = Simulation(heap(0.0), Settings.classical(1 / 240))
    simulation.advance(240)
    assert (simulation.twist[1, 3:] == [0.0, 0.0, 1.0]).all()
    assert simulation.pose[1, 3:] == pytest.approx([math.cos(0.5), 0.0, 0.0, math.sin(0.5)], abs=1e-13)


def test_bits_of_runs_cut_differently():
    whole = Simulation(heap(0.4), Settings.reference(1 / 240))
    record = whole.record(200, stride=10, contacts=True)
    cut = Simulation(heap(0.4), Settings.reference(1 / 240))
    for steps in (1, 9, 50, 140):
        cut.advance(steps)
    assert cut.pose.tobytes() == whole.pose.tobytes() == record.pose[-1].tobytes()
    assert cut.twist.tobytes() == whole.twist.tobytes()
    last = cut.contacts()
    span = slice(record.offset[-2], record.offset[-1])
    assert last.impulse.tobytes() == record.contacts.impulse[span].tobytes()


def test_arrays_with_more_contacts_than_guessed():
    """A dense clump of 40 spheres has more pairs than the 4 n + 16 manifolds that are first made room for."""
    rng = np.random.default_rng(1)
    bodies = [sphere(tuple(rng.uniform(-0.5, 0.5, 3))) for _ in range(40)]
    settings = Settings.classical(1 / 240)
    simulation = Simulation(Model(3, bodies, (0.0, 0.0, 0.0), 0.0, 0.0), settings)
    record = simulation.record(3, contacts=True)
    assert len(simulation.contacts()) > 4 * 40 + 16
    assert record.offset[-1] == len(record.contacts)
    assert np.isfinite(record.pose).all()
