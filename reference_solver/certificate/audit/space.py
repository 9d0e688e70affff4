"""Where bodies are to each other at all times, by the certificate's own geometry: overlaps and missed contacts."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from reference_solver.certificate.audit.motion import integrated_turn
from reference_solver.certificate.audit.run import Indices, Run, scaled_along, twist_of
from reference_solver.certificate.audit.turning import cubic, missed_by_cubic, moved_by, way_between
from reference_solver.geometry import distinct, gap, rotation
from reference_solver.model import Array, HalfSpace
from reference_solver.shapes import Disc, Sphere

#: Halvings of an interval in which two bodies might have met: sixteen parts of it.
HALVINGS = 4
#: Turn in a piece [rad] beyond which it is cut into parts, and that of a part.
FAR, PART, MOST_PARTS = 0.3, 0.1, 512
#: How far a body may be from the cubic polynomials of a piece whose rows turn: its place, as a share of the smallest
#: half width, and its turn [rad]. The record cuts pieces so that each number of either is off by half of that (E80).
BESIDE = 2e-9
#: Share of a half width by which bodies may overlap at their contacts, as in the check ``apart``.
ACROSS = 1e-9
#: Share of a half width by which what may be missed is not looked into: a tenth of the overlap that is allowed.
SHALLOW = 1e-12


class Path(NamedTuple):
    """Motion of one body: k intervals that follow each other."""

    begin: Array  # (k,)
    length: Array  # (k,)
    pose: Array  # (k, 3 | 7) at their starts
    way: Array  # (k, 3 | 6) displacement and turn over each
    first: Array  # (k, 3 | 6) twist at the start of each
    last: Array  # (k, 3 | 6) and at its end
    beside: Array  # (k,) bound of the distance of any point from where these cubic polynomials have it [m]


def measured(run: Run, start: Array) -> Iterator[tuple[str, float]]:
    """Yield what is measured of all pairs of bodies; ``start`` (n, P) are the poses at the start."""
    yield "resolution", float(np.spacing(np.abs(start[run.free, : run.d]).max(initial=0.0)) / run.size)
    deep, first = _overlaps(run, start)
    yield "overlap", deep
    yield "start", first


def _overlaps(run: Run, start: Array) -> tuple[float, float]:
    """Deepest overlap of any pair at any time, and at the start, as shares of the smaller half width.

    The first is what is deeper than at the start, and than paths are known; and than contacts are closed, of bodies
    that touch.
    """
    pieces, n = run.pieces, len(run.free)
    carry = (pieces.impulse != 0.0).any(axis=1)
    touch = set((pieces.body_a * n + pieces.body_b)[carry].tolist())
    paths = [_path(run, i, start) for i in range(len(run.free))]
    low, high = np.array([_extremes(path) for path in paths]).swapaxes(0, 1)
    arm = np.where(np.isfinite(run.reach), run.reach, np.inf)[:, None]
    worst, first = 0.0, 0.0
    for i in range(len(paths)):
        meets = ((low[i] - arm[i] <= high + arm) & (low - arm <= high[i] + arm[i])).all(axis=1)
        for j in np.flatnonzero(meets):
            if j <= i or not (run.free[i] or run.free[j]):
                continue
            size = min(run.extent[i], run.extent[j])
            begin = gap(run.model.bodies[i].shape, start[i], run.model.bodies[int(j)].shape, start[int(j)])
            deep = min(begin, _pair(run, i, int(j), paths[i], paths[int(j)]))
            # What is no number stays none, and is within no limit.
            known = max(-begin, ACROSS * size if i * n + j in touch else 0.0)
            worst = float(np.maximum(worst, (-deep - known) / size))
            first = float(np.maximum(first, -begin / size))
    return worst, first


def _extremes(path: Path) -> Array:
    """Lowest and highest coordinates (2, d) of a path, which may leave the straight line between two ends."""
    d = 2 if path.pose.shape[1] == 3 else 3
    bulge = 0.5 * path.length * np.linalg.norm(path.last[:, :d] - path.first[:, :d], axis=1)
    ends = path.pose[:, :d], path.pose[:, :d] + path.way[:, :d]
    low, high = np.minimum(*ends) - bulge[:, None], np.maximum(*ends) + bulge[:, None]
    return np.array((low.min(axis=0), high.max(axis=0)))


def _path(run: Run, i: int, start: Array) -> Path:
    """Motion of body i: of a free one by its pieces, of others as prescribed, step by step."""
    pieces = run.pieces
    rows = np.flatnonzero((pieces.body == i) & run.is_forces[run.owner])
    if not run.free[i] or not len(rows):
        twist = twist_of(run.model.bodies[i])
        steps = int(pieces.step.max()) + 1 if len(pieces) else 1
        count = steps if twist.any() else 1
        length: Array = np.full(count, steps * run.dt / count)
        begin: Array = np.arange(count, dtype=np.float64) * length
        twists = np.tile(twist, (count, 1))
        poses = np.tile(start[i], (count, 1)) if run.free[i] else run.prescribed_pose(i, begin)
        return Path(begin, length, poses, length[:, None] * twists, twists, twists, np.zeros(count))
    begin, length, before, after, first, last, frozen = _parts(run, rows)
    reach = 0.0 if isinstance(run.model.bodies[i].shape, Disc | Sphere) else run.reach[i]
    beside = np.where(frozen, 0.0, BESIDE * (run.size + reach))
    if run.d == 3:
        beside += missed_by_cubic(reach, length, first[:, 3:], last[:, 3:])
    return Path(begin, length, before, way_between(before, after), first, last, beside)


def _parts(run: Run, rows: Indices) -> tuple[Any, ...]:
    """Begin, length, poses, twists at both ends, and whether forces are even, of rows of one body, far turns in parts.

    Between its ends a turn of more than a half is not to be told, and one of `FAR` known to its fourth power over 384.
    Where forces are even it is integrated.
    """
    pieces, owner = run.pieces, run.owner[rows]
    even = (run.pushed[2][rows] == 0.0) | run.is_frozen[owner]
    even &= ~run.is_rocking[owner]
    spin = np.maximum(*(np.linalg.norm(x[rows, 3:], axis=1) for x in (pieces.twist_before, pieces.twist_after)))
    turns = np.where(even, np.nan_to_num(run.length[rows] * spin), 0.0)
    count = np.where(turns > FAR, np.ceil(turns / PART), 1.0).clip(max=MOST_PARTS).astype(np.int64)
    at, cuts, first = (np.repeat(x, count) for x in (rows, count, np.cumsum(count) - count))
    part = np.arange(len(at)) - first
    (pose, twist), (later, last) = (_state(run, at, (k / cuts)[:, None]) for k in (part, part + 1))
    begin = pieces.begin[run.owner[at]] + part / cuts * run.length[at]
    return begin, run.length[at] / cuts, pose, later, twist, last, (run.is_frozen & ~run.is_rocking)[run.owner[at]]


def _state(run: Run, rows: Indices, share: Array) -> tuple[Array, Array]:
    """Poses and twists after a ``share`` (s, 1) of rows; those that are cut are in space, and forces even."""
    pieces = run.pieces
    ends = (pieces.pose_before, pieces.pose_after), (pieces.twist_before, pieces.twist_after)
    pose, twist = (np.where(share < 1.0, start[rows], end[rows]) for start, end in ends)
    cut = np.flatnonzero((share > 0.0) & (share < 1.0))
    if not len(cut):
        return pose, twist
    rows, share = rows[cut], share[cut]
    time, moments, (first, last) = share[:, 0] * run.length[rows], run.moments[pieces.body[rows]], run.spin
    momentum = (1.0 - share) * first[rows] + share * last[rows]
    change = share * (pieces.twist_after[rows, :3] - twist[cut, :3])
    pose[cut, :3] += time[:, None] * (twist[cut, :3] + 0.5 * change)
    pose[cut, 3:], _ = integrated_turn(pose[cut, 3:], first[rows], momentum, moments, time)
    twist[cut, :3] += change
    twist[cut, 3:] = scaled_along(rotation(pose[cut]), 1.0 / moments, momentum)
    return pose, twist


def _pose_at(path: Path, k: Indices, t: Array) -> Array:
    """Poses (s, P) on intervals k after the time t (s,) of each."""
    h = path.length[k][:, None]
    t = np.clip(t[:, None], 0.0, h)
    moved, _ = cubic(path.way[k], path.first[k], path.last[k], path.length[k], t)
    return moved_by(path.pose[k], moved)


def _pair(run: Run, i: int, j: int, one: Path, other: Path) -> float:
    """Least gap of two bodies over the run, if both are beside their paths [m]; what may be missed is looked into.

    Over an interval h a gap cannot fall by more than the bound L of its rate times the time, so that it stays above
    (g_0 + g_1 - L h)/2. Where that is above the deepest found, nothing is missed; else the interval is halved, and in
    the end its gap is taken where a parabola has its least.
    """
    shapes = run.model.bodies[i].shape, run.model.bodies[j].shape
    times = np.unique(np.concatenate([one.begin, other.begin, [one.begin[-1] + one.length[-1]]]))
    k, m = (np.clip(np.searchsorted(p.begin, times, "right") - 1, 0, len(p.begin) - 1) for p in (one, other))

    def gaps(t: Array, k: Indices, m: Indices) -> Array:
        pose_i, pose_j = _pose_at(one, k, t - one.begin[k]), _pose_at(other, m, t - other.begin[m])
        return distinct(shapes[0], pose_i, shapes[1], pose_j).gap + one.beside[k] + other.beside[m]

    rate = _closing(run, i, j, one, other, k[:-1], m[:-1])
    near = _near(run, i, j, one, other, times, k, m, rate)
    if not near.any():
        return np.inf
    begin, end, k, m, rate = times[:-1][near], times[1:][near], k[:-1][near], m[:-1][near], rate[near]
    first, last = gaps(begin, k, m), gaps(end, k, m)
    least = min(float(first.min()), float(last.min()))
    tolerance = SHALLOW * min(run.extent[i], run.extent[j])
    for _ in range(HALVINGS):
        open_ = 0.5 * (first + last - rate * (end - begin)) < min(least, 0.0) - tolerance
        if not open_.any():
            break
        begin, end, k, m, rate, first, last = (x[open_] for x in (begin, end, k, m, rate, first, last))
        middle = 0.5 * (begin + end)
        between = gaps(middle, k, m)
        least = min(least, float(between.min()))
        bend, slope = 2.0 * (first + last) - 4.0 * between, 4.0 * between - 3.0 * first - last
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.where(bend > 0.0, -0.5 * slope / bend, np.nan)
        dips = (share > 0.0) & (share < 1.0)
        if dips.any():
            least = min(least, float(gaps((begin + share * (end - begin))[dips], k[dips], m[dips]).min()))
        begin, end = np.concatenate([begin, middle]), np.concatenate([middle, end])
        first, last = np.concatenate([first, between]), np.concatenate([between, last])
        k, m, rate = (np.concatenate([x, x]) for x in (k, m, rate))
    return least


def _closing(run: Run, i: int, j: int, one: Path, other: Path, k: Indices, m: Indices) -> Array:
    """Bound of the rate at which the gap of two bodies falls on intervals k of one and m of the other [m/s]."""
    d = run.d
    starts, ends = one.first[k] - other.first[m], one.last[k] - other.last[m]
    speed = np.zeros(len(k))
    for relative in (starts, ends):
        straight = np.linalg.norm(relative[:, :d], axis=1)
        for a in (i, j):
            shape = run.model.bodies[a].shape
            fixed = run.model.bodies[a].motion == "fixed"
            if isinstance(shape, HalfSpace) and fixed:  # only what goes along its normal closes
                pose = np.array(run.model.bodies[a].pose, dtype=float)
                straight = np.abs(relative[:, :d] @ (rotation(pose) @ np.array(shape.normal)))
        speed = np.maximum(speed, straight)
    for a, path, at in ((i, one, k), (j, other, m)):
        arm = run.reach[a]
        if not np.isfinite(arm):
            centre = (other if a == i else one).pose[m if a == i else k][:, :d]
            arm = np.linalg.norm(centre - path.pose[at][:, :d], axis=1) + run.reach[j if a == i else i]
        spin = np.maximum(np.linalg.norm(path.first[at][:, d:], axis=1), np.linalg.norm(path.last[at][:, d:], axis=1))
        with np.errstate(invalid="ignore"):
            speed = speed + np.where(spin > 0.0, arm * spin, 0.0)
    return speed


def _near(run: Run, i: int, j: int, one: Path, other: Path, times: Array, k: Indices, m: Indices, rate: Array) -> Any:
    """Intervals (t - 1,) in which the balls about two bodies could touch; all of them for half-spaces."""
    if not np.isfinite(run.reach[i] + run.reach[j]):
        return np.ones(len(times) - 1, bool)
    places = [_pose_at(p, at, times - p.begin[at])[:, : run.d] for p, at in ((one, k), (other, m))]
    apart = np.linalg.norm(places[0] - places[1], axis=1) - run.reach[i] - run.reach[j]
    change = rate * np.diff(times)
    return np.minimum(apart[:-1], apart[1:]) <= change
