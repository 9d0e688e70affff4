"""Quantities of contacts over time for checks of a scene file: forces, numbers of contacts, overlaps without force.

    step by step:   |impulse of a step| / dt        the finest resolution of a force
    window:         the end of the run, or the step that contains an instant
    told by:        mean, least, greatest, spread   (`validation.metrics.OVER_TIME`)

The mean can be right where contacts alternate between load and none; only values of each step show that.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from adapters.engine import Array, Contacts
from adapters.scene import Scene
from adapters.scene.shapes import ROUND
from adapters.trajectory import Trajectory
from validation import metrics
from validation.canonical import Measured
from validation.geometry import overlap

#: Force between two bodies, or of all contacts on one, by component [N].
SUMS = {2: ("fx", "fy"), 3: ("fx", "fy", "fz")}
#: Others: the force of each single contact [N], the number of contacts, and the overlap of two bodies throughout a step
#: without a force [m].
OTHERS = {
    2: ("contact_fx", "contact_fy", "contacts", "overlap_without_force"),
    3: ("contact_fx", "contact_fy", "contact_fz", "contacts", "overlap_without_force"),
}


def is_over_time(what: str) -> bool:
    """Whether a quantity belongs to contacts, with a value for each step."""
    return what in (*SUMS[3], *OTHERS[3])


def told(
    scene: Scene,
    trajectory: Trajectory,
    body: int,
    partner: int | None,
    what: str,
    by: str,
    within: tuple[float, float],
) -> Measured:
    """Value of a quantity of the contacts of ``body`` with ``partner``, or with all others.

    Parameters
    ----------
    what
        One of `SUMS` or `OTHERS`.
    by
        One of `validation.metrics.OVER_TIME`.
    within
        Steps that end within (first, second] [s].
    """
    contacts, others = trajectory.contacts, range(len(scene.bodies)) if partner is None else [partner]
    if contacts is None or not (chosen := metrics.steps_between(trajectory, *within)).any():
        return None, metrics.NOT_RECORDED
    if what in SUMS[3]:
        series = metrics.forces(trajectory, body, others, *within)[:, _axis(what)]
    elif what == "overlap_without_force":
        assert partner is not None
        series = _unloaded(scene, trajectory, body, partner)[chosen]
    elif trajectory.out_of_plane is not None and not _meets_in_points(scene, body, others):
        return None, metrics.SEVERAL
    else:
        rows, step = _touching(trajectory, body, others, chosen)
        if what == "contacts":
            series = np.bincount(step, minlength=len(chosen))[chosen].astype(float)
        elif len(step) == 0:
            return None, "there is no contact with a known force"
        else:
            sign = np.where(rows.b == body, 1.0, -1.0)
            series = sign * rows.impulse[:, _axis(what)] / trajectory.dt
    return metrics.over_time("", series, (by,))[f"[{by}]"]


def _meets_in_points(scene: Scene, body: int, others: Sequence[int]) -> bool:
    """Whether all contacts of a body are single points in 3-D as in 2-D: one body of each pair is round."""
    round_ones = [isinstance(each.shape, ROUND) for each in scene.bodies]
    return round_ones[body] or all(round_ones[other] for other in others if other != body)


def window_of(trajectory: Trajectory, at: float | None, length: float) -> tuple[float, float]:
    """Times between which steps end: the last ``length`` [s] of the run, or the step that the instant ``at`` lies in.

    An instant at which one step ends and the next begins belongs to the first; the start to the first of all.
    """
    if at is None:
        return float(trajectory.t[-1]) - length, math.inf
    step = math.ceil(at / trajectory.dt - 1e-9) or 1  # 1e-9: rounding of at / dt
    return (step - 1) * trajectory.dt, step * trajectory.dt


def _axis(what: str) -> int:
    return "xyz".index(what[-1])


def _touching(
    trajectory: Trajectory, body: int, others: Sequence[int], steps: NDArray[np.bool_]
) -> tuple[Contacts, NDArray[np.int64]]:
    """Contacts of ``body`` with ``others`` in the selected ones of the recorded ``steps``, and the step of each.

    Engines also list near pairs: a contact counts if it touches or has an impulse; unreported values count as either.
    """
    contacts = trajectory.contacts
    assert contacts is not None
    rows = contacts.rows
    other = np.where(rows.b == body, rows.a, rows.b)
    is_own = ((rows.a == body) | (rows.b == body)) & np.isin(other, list(others))
    is_contact = ~(rows.gap > 0.0) | (rows.impulse != 0.0).any(axis=1)
    step = np.repeat(np.arange(len(steps)), np.diff(contacts.offset))
    found = np.flatnonzero(is_own & is_contact & steps[step])
    names = ("a", "b", "point", "normal", "impulse", "gap")
    return Contacts(*(getattr(rows, name)[found] for name in names)), step[found]


def _unloaded(scene: Scene, trajectory: Trajectory, body: int, partner: int) -> Array:
    """Overlap throughout each recorded step without a force between the two, else 0, (s,) [m].

    It is the smaller of the depths at both ends: a first contact within a step may be found at its end. NaN where the
    engine reports no forces and they overlap.
    """
    contacts = trajectory.contacts
    assert contacts is not None
    end = np.maximum(contacts.step, 1)
    shapes, poses = zip(*((scene.bodies[i].shape, trajectory.pose[:, i]) for i in (body, partner)), strict=True)
    start_depth, end_depth = (overlap(shapes[0], poses[0][k], shapes[1], poses[1][k]) for k in (end - 1, end))
    depth = np.minimum(start_depth, end_depth)
    impulse = contacts.impulse_between(partner, body)
    pushes = (impulse != 0.0) & ~np.isnan(impulse)
    unknown = np.isnan(impulse).any(axis=1) & ~pushes.any(axis=1)
    return np.where(pushes.any(axis=1), 0.0, np.where(unknown & (depth > 0.0), np.nan, depth))
