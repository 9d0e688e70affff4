"""Groups of planar worlds: their arrays, and how long they stay together (`worlds.Members`)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.lib.stride_tricks import as_strided

from reference_solver.lanes import LANES, room
from reference_solver.many.planar import Group, hand_over, run_group
from reference_solver.model import Array, Model
from reference_solver.needs import needs
from reference_solver.planar.columns import ROW_INTEGERS, ROW_REALS
from reference_solver.planar.state import (
    COUNTS,
    MANIFOLDS,
    Bodies,
    Pairs,
    allocate_bodies,
    allocate_pairs,
    allocate_rows,
)
from reference_solver.planar.world import World
from reference_solver.settings import Settings
from reference_solver.stepping.broadphase import allocate_boxes, doubled
from reference_solver.stepping.options import Options, options
from reference_solver.tally import SIZE as TALLY_SIZE

#: Steps between two looks at whether worlds still fit together.
STEPS_BETWEEN_LOOKS = 64


class Together:
    """Up to `LANES` models whose bodies are alike, stepped in one while they touch alike (`worlds.Members`)."""

    def __init__(self, models: Sequence[Model], settings: Settings) -> None:
        self.models, self.settings, self.needs = models, settings, needs(models[0])
        # A lane that is left over steps the last world once more.
        padded = [*models, *[models[-1]] * (LANES - len(models))]
        worlds = [(allocate_bodies(each, self.needs), allocate_pairs(each, 0)) for each in padded]
        # A body of similar size has at most six neighbours, each pair counted once; columns have fewer.
        contacts = 4 * len(models[0].bodies) + 16
        self.group = allocate_group(worlds, options(settings, self.needs, False), contacts)
        self.apart: list[World] = []

    def states(self) -> tuple[Array, Array]:
        """See `Members.states`."""
        if self.apart:
            return np.stack([each.pose for each in self.apart]), np.stack([each.twist for each in self.apart])
        return self._by_world(self.group.pose), self._by_world(self.group.twist)

    def run(self, steps: int, stride: int) -> tuple[Array, Array]:
        """See `Members.run`."""
        samples = steps // stride if stride else 0
        pose, twist = (np.empty((samples, *self.group.pose.shape)) for _ in range(2))
        part = stride * max(1, STEPS_BETWEEN_LOOKS // stride) if stride else STEPS_BETWEEN_LOOKS
        done = 0
        while done < steps and not self.apart:
            end = min(done + part, steps)
            while (done := run_group(self.group, pose, twist, done, end, stride)) < end:
                self.group = grown(self.group)
            if not self._fit():
                self.apart = [self._alone(lane) for lane in range(len(self.models))]
        sampled = done // stride if stride else 0
        found = self._by_world(pose[:sampled]), self._by_world(twist[:sampled])
        if not self.apart:
            return found
        rest = [each.run(steps - done, stride, False) for each in self.apart]
        last = np.stack([each.pose for each in rest]), np.stack([each.twist for each in rest])
        return np.concatenate([found[0], last[0]], axis=1), np.concatenate([found[1], last[1]], axis=1)

    def _by_world(self, array: Array) -> Array:
        """World first, without those that are left over."""
        return np.moveaxis(array, -1, 0)[: len(self.models)].copy()

    def _fit(self) -> bool:
        """Whether at least half of the bodies and pairs that are stepped are there: lanes cost what two worlds cost.

        A pair that touches in one world is solved in all of them. Piles of different discs soon have little in common.
        """
        pairs, bodies = self.group.counts[MANIFOLDS], len(self.group.kind)
        touching = np.count_nonzero(self.group.found[:pairs, : len(self.models)])
        return bool(2 * (touching + len(self.models) * bodies) >= LANES * (pairs + bodies))

    def _alone(self, lane: int) -> World:
        """A world that goes on from the state of one lane."""
        world = World(self.models[lane], self.settings, self.needs, False)
        hand_over(self.group, lane, *world.opened(len(self.group.old)))
        return world


def allocate_group(worlds: list[tuple[Bodies, Pairs]], options: Options, contacts: int) -> Group:
    """Return `LANES` worlds of one kind side by side, with room for ``contacts``.

    Parameters
    ----------
    worlds
        Bodies and pairs of each world, from `state.allocate_bodies` and `state.allocate_pairs`.
    """
    bodies, pairs = [each for each, _ in worlds], [each for _, each in worlds]
    n = len(bodies[0].kind)
    fields = ("pose", "twist", "pseudo", "real", "vertex")
    numbers: dict[str, Any] = {name: stacked([getattr(each, name) for each in bodies]) for name in fields}
    return Group(
        **numbers,
        restitution=laws([each.restitution for each in pairs]),
        friction=laws([each.friction for each in pairs]),
        **rooms(contacts),
        kind=bodies[0].kind,
        low=room(n, 2, LANES),
        high=room(n, 2, LANES),
        boxes=allocate_boxes(n, 2, contacts),
        probe=allocate_rows(2),
        saved=room(15, LANES),
        tally=room(TALLY_SIZE, LANES),
        options=options,
    )


def stacked(arrays: list[Array]) -> Array:
    """Arrays of one shape side by side."""
    result = room(*arrays[0].shape, len(arrays))
    return np.stack(arrays, axis=-1, out=result)


def rooms(contacts: int) -> dict[str, Any]:
    """Arrays of a `Group` that grow."""
    count = np.int64
    return {
        "row": room(contacts, ROW_REALS, LANES),
        "integer": np.zeros((contacts, ROW_INTEGERS), count),
        "counts": np.zeros(COUNTS, count),
        "manifold": np.zeros(contacts + 1, count),
        "block": room(contacts, 4, 4, LANES),
        "found": room(contacts, LANES),
        "feature": room(contacts, LANES),
        "impact": room(contacts, LANES),
        "old_pair": np.zeros(contacts, count),
        "old_first": np.zeros(contacts + 1, count),
        "old_count": np.zeros(1, count),
        "old": room(contacts, 3, LANES),
    }


def laws(tables: list[Array]) -> Array:
    """Tables of pairs side by side; one number for each world where each has one number for all pairs."""
    n = len(tables[0])
    if all(table.strides == (0, 0) for table in tables):
        return as_strided(stacked([table[:1, 0] for table in tables])[0], (n, n, LANES), (0, 0, 8))
    padded = room(n, n + 1, LANES)
    padded[:, :n] = np.stack(tables, axis=-1)
    return padded[:, :n]


def grown(group: Group) -> Group:
    """Return twice the room, with what is remembered of the step before."""
    bigger = rooms(2 * len(group.row))
    for name in ("old_pair", "old_first", "old_count", "old"):
        bigger[name][: len(getattr(group, name))] = getattr(group, name)
    return group._replace(boxes=doubled(group.boxes), **bigger)
