"""pymunk over its releases: changes of the readings of the adapter."""

from __future__ import annotations

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


def point_impulses(arbiter: Any, count: int) -> list[tuple[float, float]]:
    """Impulses [N s] on the second body at each of ``count`` points, world axes.

    ``J = n jn + t jt`` with t the normal turned by +90 degrees (cpArbiter.c, cpArbiterTotalImpulse); the accumulated
    values are not public, pymunk's own pickling reads them the same way.
    """
    try:
        accumulated = [(each.jnAcc, each.jtAcc) for each in arbiter._arbiter.contacts[0:count]]
    except AttributeError:  # opaque before 6.5
        x, y = arbiter.total_impulse
        return [(-x / count, -y / count)] * count
    nx, ny = arbiter.contact_point_set.normal
    return [(nx * jn - ny * jt, ny * jn + nx * jt) for jn, jt in accumulated]
