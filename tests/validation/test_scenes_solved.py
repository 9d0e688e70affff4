"""Every scene against our event-driven solver, which knows the bodies and none of the closed forms.

It finds each impact and each end of a slip, so that what it does differs from a closed form by round-off
alone: its verdicts must be PASS, and ghosts of the replay must stand where its bodies are.
"""

import numpy as np
import pytest
from planted import failing

from adapters.registry import load
from adapters.scene import Scene
from adapters.stepping import run
from adapters.trajectory import Trajectory
from validation.bounds import ROUND_OFF
from validation.catalogue import CATALOGUE
from validation.cells import Slot, settings_of

DT = 1 / 240
#: Scenes that our solver refuses: it has no contacts that gain energy, and no motion of bodies that overlap.
REFUSED = {"restitution_above_one", "overlap", "position_correction"}


def solved(name: str, dimension: int, params) -> tuple[Scene, Trajectory]:
    canonical, engine = CATALOGUE[name], load("reference")
    scene = canonical.scene(dimension, params)
    slot = Slot(name, canonical.minimal(params), dimension, "reference", "reference", DT)
    settings = {setting.name: setting.value for setting in settings_of(engine, slot, scene)}
    return scene, run(engine, scene, DT, settings, canonical.sampling(scene))


def of_the_suite(name):
    canonical = CATALOGUE[name]
    for variation in canonical.variations("standard"):
        for dimension in canonical.dimensions:
            if variation.runs_in(dimension):
                yield solved(name, dimension, variation.params)


@pytest.mark.few(20)
@pytest.mark.parametrize("name", sorted(CATALOGUE.keys() - REFUSED))
def test_reference_solver_along_the_replay_truth(name):
    canonical = CATALOGUE[name]
    for scene, trajectory in of_the_suite(name):
        assert failing(canonical, scene, trajectory) == set(), scene.params
        measured = canonical.measure(scene, trajectory)
        # A number needs no excuse, unless it is nothing because what was to be measured did not come.
        assert {metric for metric, (value, reason) in measured.items() if reason and value} == set()
        if (track := canonical.track(scene)) is not None:
            told = np.array([track.position(float(t)) for t in trajectory.t])
            place = trajectory.pose[:, scene.index(track.body), : scene.dimension]
            # As `bounds.ROUND_OFF`: a thousand updates, each rounded in the size of the coordinates and of the ways.
            size = 1.0 + np.abs(trajectory.pose[:, :, : scene.dimension]).max() + np.abs(trajectory.twist).max() * DT
            assert np.abs(told - place).max() <= ROUND_OFF * size, scene.params
