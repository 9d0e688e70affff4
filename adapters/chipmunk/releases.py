"""pymunk over its releases: changes of the readings of the adapter."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from adapters.releases import Difference, Distribution, Releases

RELEASES = Releases(
    distributions=(Distribution("pymunk"),),
    known=">=6.4.0,<8",
    differences=(
        Difference("<6.5", "the arbiter structure is opaque: impulses of single points cannot be read",
                   "the public total is divided equally among the points; sums over a pair are exact",
                   "measured: 6.4.0 refuses to read fields of cpArbiter, 6.5.2 does not"),
        Difference("6.6.0 and 7.0.0", "pymunk.version is not the release (6.6.2 in 6.6.0, 2.0.0 in 7.0.0)",
                   "the version is read from the distribution's metadata, in every release",
                   "measured"),
    ),
)  # fmt: skip


#: A point of an arbiter: its bodies a and b by index, place between them, normal from a to b, impulse on b, distance.
Point = tuple[int, int, float, float, float, float, float, float, float]


def shape_key(shape: Any) -> Any:
    """Key of a shape, equal to that of the same shape in an arbiter."""
    return shape._shape


def points_of(
    arbiter: Any, body: int, index: Mapping[Any, int], free: Sequence[bool], places: Sequence[tuple[float, float]]
) -> list[Point]:
    """Points of an arbiter of ``body``; none if they are those of another free body before it.

    Fields are read as by pymunk's own pickling, since its public reading takes as long as ten steps. The place on a
    body is its position plus ``r`` (cpArbiter.c, cpArbiterGetContactPointSet), the impulse ``n jn + t jt`` with t the
    normal turned by +90 degrees (cpArbiterTotalImpulse).
    """
    raw = arbiter._arbiter
    try:
        a, b, normal, contacts = index[raw.a], index[raw.b], raw.n, raw.contacts[0 : raw.count]
    except AttributeError:
        return _public_points(arbiter, body, index, free)
    other = b if a == body else a
    if other < body and free[other]:
        return []
    (ax, ay), (bx, by), nx, ny = places[a], places[b], normal.x, normal.y
    points = []
    for contact in contacts:
        on_a, on_b, jn, jt = contact.r1, contact.r2, contact.jnAcc, contact.jtAcc
        px, py, qx, qy = ax + on_a.x, ay + on_a.y, bx + on_b.x, by + on_b.y
        gap = (qx - px) * nx + (qy - py) * ny
        middle = 0.5 * (px + qx), 0.5 * (py + qy)
        points.append((a, b, *middle, nx, ny, nx * jn - ny * jt, ny * jn + nx * jt, gap))
    return points


def _public_points(arbiter: Any, body: int, index: Mapping[Any, int], free: Sequence[bool]) -> list[Point]:
    """As `points_of`, before 6.5, whose arbiters are opaque."""
    other = index[shape_key(arbiter.shapes[1])]
    if other < body and free[other]:
        return []
    told = arbiter.contact_point_set
    (x, y), count = arbiter.total_impulse, len(told.points)
    return [
        (body, other, *(0.5 * (each.point_a + each.point_b)), *told.normal, -x / count, -y / count, each.distance)
        for each in told.points
    ]
