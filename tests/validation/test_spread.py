"""How far engines are apart where no closed form tells who is right: recordings whose distances are known."""

import math

import numpy as np
import pytest

from adapters.registry import profile_of, solver
from validation.cells import Observation, Outcome, Slot
from validation.posed import resolve
from validation.questions.spread import spreads
from validation.running.tracks import Recording

OURS = (solver(), profile_of(solver(), "solution"))
PARAMS = (("n", 3.0),)
TIMES = np.array([0.0, 1.0, 3.0, 4.0])


def slot(engine="toy", profile="default", params=PARAMS, dimension=2, scene="stack"):
    return Slot(scene, params, dimension, engine, profile, 1 / 240)


def recording(of, shift=(), times=TIMES):
    """Bodies where they start, each free one moved by ``shift[k] * t^2`` along the last of the axes, and turned."""
    scene = resolve(of.scene).scene(of.dimension, dict(of.params))
    pose = np.repeat([[body.pose for body in scene.bodies]], len(times), axis=0).astype(float)
    free = [i for i, body in enumerate(scene.bodies) if body.motion == "free"]
    for k, rate in enumerate(shift):
        pose[:, free[k], of.dimension - 1] += rate * times**2
    pose[:, :, of.dimension :] += 7.0  # turns count for nothing
    none = np.zeros(0)
    return Recording(times, pose, none.astype(int), none, none, none, None, "completed")


def answered(of, outcome=Outcome.OK, **certificate):
    return Observation(of, "c", 1, "1", outcome, certificate=certificate)


def told(slots, shifts, certificate=None, outcome=Outcome.OK):
    """Spreads of engines that move away by ``shifts``, beside our own that moves by nothing."""
    own = slot(*OURS, params=slots[0].params, dimension=slots[0].dimension)
    kept = [(own, recording(own))] + [(each, recording(each, shift)) for each, shift in zip(slots, shifts, strict=True)]
    found = [answered(own, **(certificate or {}))] + [answered(each, outcome) for each in slots]
    return spreads(found, kept)


@pytest.mark.parametrize("dimension", [2, 3])
def test_farthest_body_at_the_end_with_its_distance(dimension):
    (found,) = told([slot(dimension=dimension)], [(0.01, -0.03, 0.02)])
    names = [body.name for body in resolve("stack").scene(dimension, dict(PARAMS)).bodies if body.motion == "free"]
    assert (found.scene, found.dimension, found.engine, found.profile) == ("stack", dimension, "toy", "default")
    assert found.time == TIMES[-1] and found.body == names[1]
    assert found.distance == pytest.approx(0.03 * TIMES[-1] ** 2, rel=1e-12) and found.certified is False
    assert found.as_dict()["distance"] == found.distance


@pytest.mark.parametrize(
    ("horizon", "time", "distance"),
    [
        (3.0, 3.0, 9.0),
        (2.0, 2.0, 5.0),  # half way between the frames at 1 and 3 s: half way between 1 and 9
        (0.5, 0.5, 0.5),
        (0.0, 0.0, 0.0),
        (99.0, 4.0, 16.0),
        (None, 4.0, 16.0),
        ("none", 4.0, 16.0),
    ],
)
def test_spread_time_within_the_predictable_run(horizon, time, distance):
    certificate = {"certified": True, "full": {"horizon": horizon}}
    (found,) = told([slot()], [(0.01,)], certificate)
    assert (found.time, found.certified) == (time, True)
    assert found.distance == pytest.approx(0.01 * distance, abs=1e-14)


def test_distances_are_of_centres_in_all_directions():
    own, other = slot(*OURS), slot()
    first, second = recording(own), recording(other)
    second.pose[:, 1, :2] += (0.3, 0.4)
    (found,) = spreads([answered(own), answered(other)], [(own, first), (other, second)])
    assert found.distance == pytest.approx(0.5)


def test_spread_against_the_same_scene():
    taller = (("n", 2.0),)
    own, other = slot(*OURS), slot(*OURS, params=taller)
    asked = [slot(), slot(profile="tuned"), slot(params=taller), slot(dimension=3), slot(*OURS[:1], "classical")]
    shifts = {own: (), other: (), asked[0]: (0.01,), asked[1]: (0.02,), asked[2]: (0.05,), asked[3]: (), asked[4]: ()}
    kept = [(each, recording(each, shift)) for each, shift in shifts.items()]
    found = spreads([answered(each) for each in shifts], kept)
    assert [(s.engine, s.profile, pytest.approx(s.distance)) for s in found] == [
        ("toy", "default", 0.16), ("toy", "tuned", 0.32), ("toy", "default", 0.8), (OURS[0], "classical", 0.0)
    ]  # fmt: skip
    assert all(math.isfinite(s.distance) for s in found)


def test_crashed_or_absent_engine_without_a_distance():
    assert told([slot()], [(0.01,)], outcome=Outcome.CRASHED) == []
    own, other = slot(*OURS), slot()
    assert spreads([answered(own)], [(own, recording(own)), (other, recording(other))]) == []
    assert spreads([answered(other)], [(other, recording(other))]) == []
