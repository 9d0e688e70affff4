"""A packed replay gives back what was recorded: places, turns, contacts, times, in the units that its head states."""

import base64
import zlib
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from adapters.scene import Body, Box, HalfSpace, Scene
from reports.page import replay
from validation.cells import Slot
from validation.running.tracks import Recording

WHO = (("toy", "default"), ("toy", "tuned"))


def recording(dimension, frames, seed):
    """Two bodies that wander and turn, a fixed one before them, and some contacts."""
    source, parts = np.random.default_rng(seed), {2: 3, 3: 7}[dimension]
    walk = np.cumsum(source.normal(0.0, 0.02, (frames, 3, parts)), axis=0)
    walk[..., dimension:] = source.uniform(-1.0, 1.0, walk[..., dimension:].shape)
    frame = np.sort(source.integers(0, frames, 7))
    point, impulse = source.uniform(-0.3, 0.3, (7, dimension)), source.uniform(-5.0, 5.0, (7, dimension))
    return Recording(
        np.arange(frames) / 60.0, walk, frame, np.tile([0, 1], (7, 1)), point, impulse, 0.1234567, "completed"
    )


@pytest.mark.parametrize("dimension", [2, 3])
def test_numbers_of_an_unpacked_replay(dimension):
    up = (*(0.0,) * (dimension - 1), 1.0)
    inertia = 0.1 if dimension == 2 else (0.1,) * 3
    box = Box((0.25,) * dimension)
    bodies = (
        Body("floor", HalfSpace(up), motion="fixed"),
        Body("one", box, 1.0, inertia),
        Body("two", box, 1.0, inertia),
    )
    scene = Scene("toy", 1, dimension, bodies, (), (0.0,) * dimension, 1.0, {})
    members = [
        (Slot("toy", (), dimension, *who, 1 / 240), recording(dimension, frames, k))
        for k, (who, frames) in enumerate(zip(WHO, (40, 25), strict=True))
    ]
    t = members[0][1].t
    exact = np.linspace(0.0, 0.5, len(t))[:, None] * np.ones(dimension)
    head, packed = replay._packed(SimpleNamespace(columns=WHO[::-1]), scene, members, t, exact, 2)
    planes = np.frombuffer(zlib.decompress(base64.b64decode(packed)), np.uint8).reshape(2, -1)
    levels = list(np.ascontiguousarray(planes.T).view("<i2").ravel())

    def take(rows, columns, summed):
        own = np.array([levels.pop(0) for _ in range(rows * columns)], dtype=np.int64).reshape(columns, rows)
        return (np.cumsum(own, axis=-1) if summed else own).T

    assert head["dt"] == 1 / 240 and head["tracked"] == 1 and head["count"] == len(t) and not head["static"]
    assert take(len(t), 1, True)[:, 0] * head["dt"] == pytest.approx(t, abs=1e-12)
    strongest = max(float(np.abs(each.impulse).max()) for _, each in members)
    for one, (slot, own) in zip(head["series"], members, strict=True):
        frames, parts = len(own.t), own.pose.shape[2]
        assert one["who"] == WHO[::-1].index((slot.engine, slot.profile)) and one["departure"] == 0.123457
        assert one.get("frames") == (None if frames == len(t) else frames) and one["contacts"] == 7
        pose = take(frames, 2 * parts, True).reshape(frames, 2, parts)
        for unit, told, was in (
            (head["unit"], pose[..., :dimension], own.pose[:, 1:, :dimension]),
            (head["angle"], pose[..., dimension:], own.pose[:, 1:, dimension:]),
        ):
            assert 0.0 < unit < 2e-3 and np.abs(told * unit - was).max() <= 0.5 * unit * (1.0 + 1e-9)
        assert list(take(7, 1, True)[:, 0]) == list(own.frame)
        assert np.abs(take(7, dimension, False) * head["place"] - own.point).max() <= 0.5 * head["place"] * (1.0 + 1e-9)
        force = take(7, dimension, False) * head["arrow"]
        assert np.abs(force - own.impulse / strongest).max() <= 0.5 * head["arrow"] * (1.0 + 1e-9)
    assert np.abs(take(len(t), dimension, True) * head["unit"] - exact).max() <= 0.5 * head["unit"] * (1.0 + 1e-9)
    assert levels == []


def test_replay_motion_still_or_along_one_axis():
    body = Body("one", Box((0.25, 0.25)), 1.0, 0.1)
    scene = Scene("toy", 1, 2, (body,), (), (0.0, 0.0), 1.0, {})
    run = recording(2, 8, 1)
    members = [(Slot("toy", (), 2, *WHO[0], 1 / 240), replace(run, pose=run.pose[:, :1]))]
    place = np.broadcast_to([3.0, 1.0], (8, 2))
    ramp = np.linspace(0.0, 0.25, 8)[:, None]
    for exact, still in (
        (None, False), (place, True), (place * 0.0, True), (place + ramp * [1.0, 0.0], False),
        (place + ramp * [0.0, 1.0], False),
    ):  # fmt: skip
        assert replay._packed(SimpleNamespace(columns=WHO), scene, members, run.t, exact, 0)[0]["static"] is still
