"""NUMBA_DISABLE_JIT=1 gives the same bits on the small scenes, in both dimensions and with both profiles.

Compiled and plain code do the same operations in the same order, rounded alike: no fused or reordered arithmetic is
allowed to the compiler. Only sine and cosine may come from different libraries and then differ in their last place.
Where they do, the runs may differ by what such a disturbance grows to (E73); where they do not, by nothing.
"""

import itertools
import math
import os
import subprocess
import sys
from dataclasses import replace

import numba
import numpy as np
import pytest

from reference_solver import Settings
from reference_solver.certificate.relations import Change
from tests.verification.metamorphic import bound
from tests.verification.relations import run
from tests.verification.scenes import DT, SCENES, Numbers, Scene, model
from tests.verification.space import SPACES

SCRIPT = "import sys; sys.path.insert(0, {!r}); import test_uncompiled; test_uncompiled.save(sys.argv[1])"


def ball_on_box(space, numbers):
    """A spinning ball falls on a box."""
    ball = space.ball(0.3, 1.55, space.twist(0.3, -3.0, 4.0))
    return model(space, [space.floor(), space.box(0.0, 0.5, mass=2.0), ball], numbers)


#: Steps of what touches throughout: uncompiled, a box in space takes a tenth of a second for each.
TOUCHING = 15
#: Those that relations are measured on, and one in which a ball meets a box.
WORLDS = SCENES | {name: replace(SCENES[name], horizon=TOUCHING) for name in ("stack", "incline")}
WORLDS |= {"ball on box": Scene(ball_on_box, 8)}


def states(name, profile, space):
    """Poses and twists of a run, (samples, bodies, numbers)."""
    numbers = Numbers(across=0.5 if space.dimension == 3 else 0.0)
    record = run(WORLDS[name].build(space, numbers), getattr(Settings, profile)(DT), WORLDS[name].horizon)
    return np.concatenate([record.pose, record.twist], axis=2)


def save(path):
    """Run everything, as the process without a compiler does."""
    cases = itertools.product(WORLDS, ("classical", "reference"), SPACES)
    np.savez(
        path, **{" ".join((name, profile, space.name)): states(name, profile, space) for name, profile, space in cases}
    )


@numba.njit
def compiled_sines(angles, out):
    for i in range(len(angles)):
        out[i, 0], out[i, 1] = math.sin(angles[i]), math.cos(angles[i])


@pytest.fixture(scope="module")
def one_library():
    """Whether compiled and plain sines are the same, on angles up to those of the scenes."""
    angles = np.linspace(-7.0, 7.0, 20_001)
    compiled = np.zeros((len(angles), 2))
    compiled_sines(angles, compiled)
    return all(compiled[i, 0] == math.sin(x) and compiled[i, 1] == math.cos(x) for i, x in enumerate(angles.tolist()))


@pytest.fixture(scope="module")
def uncompiled(tmp_path_factory):
    path = tmp_path_factory.mktemp("uncompiled") / "runs.npz"
    environment = os.environ | {"NUMBA_DISABLE_JIT": "1"}
    code = SCRIPT.format(os.path.dirname(__file__))
    done = subprocess.run([sys.executable, "-c", code, path], capture_output=True, text=True, env=environment)
    assert done.returncode == 0, done.stderr
    return dict(np.load(path))


@pytest.mark.parametrize("space", SPACES, ids=lambda space: space.name)
@pytest.mark.parametrize("profile", ["classical", "reference"])
def test_uncompiled_runs_have_the_same_bits(uncompiled, one_library, profile, space):
    for name, world in WORLDS.items():
        difference = np.abs(states(name, profile, space) - uncompiled[f"{name} {profile} {space.name}"]).max()
        assert difference <= (0.0 if one_library else bound(Change(space.dimension), world.horizon)), name
