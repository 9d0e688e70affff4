"""What a scene reads from wrong motions is kept: right ones show nothing of most metrics."""

import math
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from made import MOTIONS
from of_motions import MOST, SAMPLES, measured, motions
from of_scenes import cells
from telling import check

from adapters.scene import Scene
from adapters.trajectory import Trajectory
from validation.canonical import CanonicalScene
from validation.catalogue import CATALOGUE

#: Parts of a body's state at a sample.
PARTS = ("place", "turn", "speed", "spin", "impulse")


@pytest.mark.parametrize("name", MOTIONS)
def test_measures_of_wrong_motions_as_kept(name):
    check(name, MOTIONS[name], share=1e-7, nothing=1e-9)


def altered(found: Trajectory, what: str, body: int, sample: int, value: float) -> Trajectory:
    """The motion with ``value`` added to one part of a body's state, or to its impulses, at one sample."""
    d, pose, twist, contacts = found.dimension, found.pose.copy(), found.twist.copy(), found.contacts
    if what == "turn" and d == 3:  # a turn by 120 degrees; a quaternion without a length
        pose[sample, body, 3:] = (0.5, 0.5, 0.5, -0.5) if math.isfinite(value) else 0.0
    else:
        part = {"place": pose[sample, body, :d], "turn": pose[sample, body, d:],
                "speed": twist[sample, body, :d], "spin": twist[sample, body, d:]}.get(what)  # fmt: skip
        if part is not None:
            part += value
    if what == "impulse" and contacts is not None:
        rows, impulse = contacts.rows, contacts.rows.impulse.copy()
        at = np.repeat(contacts.step, np.diff(contacts.offset)) == sample
        impulse[at & ((rows.a == body) | (rows.b == body))] += value
        contacts = replace(contacts, rows=replace(rows, impulse=impulse))
    return replace(found, pose=pose, twist=twist, contacts=contacts)


def values(canonical: CanonicalScene, scene: Scene, found: Trajectory) -> dict[str, float | None]:
    """Metrics, and what the bench plots; None is what has no value or is no number."""
    told = {
        name: (None if value is None or not math.isfinite(value) else float(value), reason)
        for name, (value, reason) in measured(canonical, scene, found).items()
    }
    if canonical.primary and told.get("(primary)", (None, ""))[0] is not None:  # of the values as they are kept
        told |= {"(primary)": canonical.primary.error(scene, found.dt, told)}
    return {name: value if value is None or math.isfinite(value) else None for name, (value, _) in told.items()}


@pytest.mark.few(8)
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", CATALOGUE)
def test_motions_that_are_not_a_number_not_passed_over(name):
    """A sample that changes a metric if it is far off leaves no value of it if it is NaN: that would read as good."""
    canonical = CATALOGUE[name]
    scenes = (canonical.scene(dimension, params) for _, dimension, params in cells(canonical))
    scene = [scene for scene in scenes if len(scene.bodies) <= MOST][-1]
    free = [i for i, body in enumerate(scene.bodies) if body.motion == "free"][:2]
    looked_at = set()
    for motion, found in motions(scene, canonical.sampling(scene), scene.duration / SAMPLES):
        if motion not in ("did nothing", "did nothing, shaken", "hops"):
            continue
        base, last = values(canonical, scene, found), len(found.t) - 1
        for body, sample, what in product(free, (0, last // 2, last - 1, last), PARTS):
            far, none = (values(canonical, scene, altered(found, what, body, sample, v)) for v in (1e3, math.nan))
            seen = {metric for metric in base if metric in far and far[metric] != base[metric]}
            looked_at |= seen
            passed_over = {metric: none[metric] for metric in seen if none.get(metric) is not None}
            assert not passed_over, f"{motion}: {what} of body {body} at sample {sample}"
    judged = {check.metric for check in canonical.checks(scene, 1 / 240) if check.truth is not None}
    assert looked_at & judged
