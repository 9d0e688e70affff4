"""Motions that laws hand to a scene's measure are whole: what is read from them is read as from an engine's run."""

from collections import defaultdict

import numpy as np
import pytest

from adapters.engine_folder import laws_of
from validation.catalogue import CATALOGUE

DT = 1 / 240
#: Engines whose laws need no engine; Newton's take twenty seconds and have tests of their own.
ENGINES = ("chipmunk", "bullet", "mujoco", "box2d", "box2d3", "box3d", "rapier", "dart", "drake", "physx")


def assert_whole(scene, motion):
    """As `adapters.trajectory.Trajectory` says of its fields."""
    samples, bodies = len(motion.t), len(scene.bodies)
    places, speeds = (3, 3) if scene.dimension == 2 else (7, 6)
    assert (motion.finish, motion.reason) == ("completed", "")
    assert motion.pose.shape == (samples, bodies, places) and motion.twist.shape == (samples, bodies, speeds)
    assert motion.t[0] >= 0.0 and np.all(np.diff(motion.t) > 0.0) and motion.dt > 0.0
    assert all(np.all(np.isfinite(each)) for each in (motion.t, motion.pose, motion.twist))
    if motion.contacts is not None:
        offset, rows = motion.contacts.offset, motion.contacts.rows
        assert offset[0] == 0 and np.all(np.diff(offset) >= 0) and offset[-1] == len(rows.a)
        assert len(motion.contacts.step) == len(offset) - 1


@pytest.mark.few(3)
@pytest.mark.parametrize("engine", ENGINES)
def test_a_law_measures_whole_motions(engine):
    """Of the last two quick cells of each scene; the numbers themselves stand in the tables of laws."""
    met = 0

    def measure(scene, motion):
        nonlocal met
        met += 1
        assert_whole(scene, motion)
        return defaultdict(lambda: (1.0, ""))

    for law in laws_of(engine):
        canonical = CATALOGUE[law.scene]
        for dimension in canonical.dimensions:
            for variation in canonical.quick[-2:]:
                scene = canonical.scene(dimension, variation.params)
                with np.errstate(all="ignore"):
                    law.says(scene, DT, measure)
    assert met > 0
