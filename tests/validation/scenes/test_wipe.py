"""A hand held on a moving table: Coulomb's law stepped anew, forces that come and go, are left out or turned round."""

from dataclasses import replace

import numpy as np
import pytest
from planted import failing, made, still

from adapters.engine import Contacts
from adapters.trajectory import ContactRecord, Trajectory
from validation.scenes import wipe

DT = 1 / 240
TABLE, STOP, HAND = range(3)
ALL = {f"{force}[{by}]" for force in wipe.FORCES for by in ("mean", "least", "greatest")}


def held(scene, dt=DT, late=0):
    """The hand stepped under gravity, Coulomb's friction at two points and the stop's push, each found at old places.

    ``late``: steps at the start in which nothing is found.
    """
    p, d = scene.params, scene.dimension
    g, mu, mass = p["g"], p["mu"], p["mass"]
    x, z, vx, vz = 0.0, 0.0, 0.0, 0.0
    pose = [(x, z)]
    twist, rows = [(vx, vz)], []
    for k in range(round(scene.duration / dt)):
        touches, reaches = k >= late and z <= 0.0, k >= late and x >= 0.0
        vz -= g * dt
        normal = mass * max(0.0, -vz) if touches else 0.0
        vz += normal / mass
        drag = min(mu * normal, mass * abs(p["v"] - vx))
        vx += drag / mass
        push = mass * max(0.0, vx) if reaches else 0.0
        vx -= push / mass
        x, z = x + vx * dt, z + vz * dt
        pose.append((x, z))
        twist.append((vx, vz))
        across = (0.0,) * (d - 2)
        rows += [(TABLE, HAND, (0.0,) * d, (0.0,) * d, (0.5 * drag, *across, 0.5 * normal), 0.0)] * 2
        rows.append((STOP, HAND, (0.0,) * d, (0.0,) * d, (-push, *across, 0.0), 0.0))
    n = len(pose)
    poses, twists = still(scene, n)
    poses[:, HAND, [0, d - 1]] += np.array(pose)
    twists[:, HAND, [0, d - 1]] = np.array(twist)
    record = ContactRecord(np.arange(1, n), 3 * np.arange(n), Contacts.from_rows(rows, d))
    return Trajectory(np.arange(n) * dt, poses, twists, record, dt, "completed")


def changed(trajectory, table=1.0, stop=1.0, axes=None):
    """The record with the impulses of the table, of the components ``axes``, and of the stop multiplied."""
    rows = trajectory.contacts.rows
    share = np.where(rows.a == TABLE, table, stop)[:, None] * np.ones_like(rows.impulse)
    if axes is not None:
        share[:, [k for k in range(share.shape[1]) if k not in axes]] = 1.0
    return replace(trajectory, contacts=replace(trajectory.contacts, rows=replace(rows, impulse=share * rows.impulse)))


def test_start_of_the_hand_on_the_table():
    for dimension in (2, 3):
        _, scene = made("wipe", dimension, v=0.5, mu=0.25, mass=2.0)
        table, stop, hand = scene.bodies
        assert table.surface_velocity == (0.5, *(0.0,) * (dimension - 1)) and table.motion == "fixed"
        assert stop.shape.normal == (-1.0, *(0.0,) * (dimension - 1)) and stop.shape.offset == 0.0
        assert hand.pose[0] + hand.shape.half_extents[0] == 0.0 and hand.pose[dimension - 1] == 0.05
        assert scene.material("table", "hand").friction == 0.25 and scene.material("stop", "hand").friction == 0.0


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("dt", [1 / 60, DT, 1 / 960])
@pytest.mark.parametrize("params", [{}, {"v": 1.0}, {"mu": 0.1, "mass": 3.0}, {"mu": 1.0, "g": 3.7}])
@pytest.mark.parametrize("late", [0, 1])
def test_wipe_with_contacts_a_step_late(dimension, dt, params, late):
    canonical, scene = made("wipe", dimension, **params)
    trajectory = held(scene, dt, late)
    measured, truth = canonical.measure(scene, trajectory), canonical.exact(scene)
    assert failing(canonical, scene, trajectory) == set()
    assert {name: measured[name][0] for name in ALL} == pytest.approx({name: truth[name] for name in ALL})


def test_wipe_bounds_by_weight_step_of_fall_and_drag():
    canonical, scene = made("wipe", mu=0.25, g=8.0)
    allowed = {check.metric: (check.unit, check.truth, check.bound) for check in canonical.checks(scene, 1 / 64)}
    expected = {"moved": ("m", 0.0, pytest.approx(1.5 * 8.0 / 64**2, rel=1e-9))}
    for force, share in (("normal", 1.0), ("friction", 1.0), ("stop", 5.0)):
        expected |= {f"{force}[{by}]": ("1", 1.0, pytest.approx(0.02 * share)) for by in ("least", "greatest")}
        expected[f"{force}[mean]"] = ("1", 1.0, pytest.approx(0.02 * share / 64))
    assert allowed == expected


def test_flickering_forces_with_right_means_fail():
    canonical, scene = made("wipe")
    good = held(scene)
    by_turns = 1.0 + np.repeat((-1.0) ** np.arange(len(good.contacts.step)), 3)
    wrong = failing(canonical, scene, changed(good, by_turns, by_turns))
    assert wrong == {name for name in ALL if "mean" not in name}
    measured = canonical.measure(scene, changed(good, by_turns, by_turns))
    assert [measured[f"normal[{by}]"][0] for by in ("mean", "least", "greatest")] == pytest.approx([1.0, 0.0, 2.0])
    # A single step is enough, wherever it lies in the last second.
    once = np.ones(len(by_turns))
    once[3 * 300 : 3 * 301] = 1.03
    assert failing(canonical, scene, changed(good, once)) == {
        "normal[greatest]",
        "friction[greatest]",
        "normal[mean]",
    } | {"friction[mean]"}


def test_wipe_with_a_missing_contact_wrong_sign_or_friction():
    canonical, scene = made("wipe", 3)
    good = held(scene)
    of = {force: {f"{force}[{by}]" for by in ("mean", "least", "greatest")} for force in wipe.FORCES}
    one_of_two = np.tile([1.0, 0.0, 1.0], len(good.contacts.step))
    assert failing(canonical, scene, changed(good, one_of_two)) == of["normal"] | of["friction"]
    assert failing(canonical, scene, changed(good, -1.0)) == of["normal"] | of["friction"]
    assert failing(canonical, scene, changed(good, stop=-1.0)) == of["stop"]
    assert failing(canonical, scene, changed(good, 0.97, axes=[0])) == of["friction"]
    assert failing(canonical, scene, changed(good, 0.999, axes=[0])) == {"friction[mean]"}


def test_yielding_hand_fails():
    canonical, scene = made("wipe")
    good = held(scene)
    for axis in (0, 1):
        moved = good.pose.copy()
        moved[200:, HAND, axis] += 4.0 * 9.81 * DT**2
        assert failing(canonical, scene, replace(good, pose=moved)) == {"moved"}


def test_missing_forces_of_an_engine_have_no_value():
    canonical, scene = made("wipe")
    measured = canonical.measure(scene, changed(held(scene), np.nan, np.nan))
    assert {measured[name] for name in ALL} == {(None, "the engine does not tell the impulses of these contacts")}
    measured = canonical.measure(scene, replace(held(scene), contacts=None))
    assert {measured[name] for name in ALL} == {(None, "contacts were not recorded")}
