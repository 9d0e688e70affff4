"""Boxes and hulls whose faces are clipped against each other: setting ``enableSAT``.

Bullet finds all points of two convex bodies in one step where it knows their faces, and one point a step where it does
not. PyBullet lets it know those of bodies that come in URDF files alone [bullet3, URDF_INITIALIZE_SAT_FEATURES].

    0   bodies come in URDF files and their faces stay unknown: a control of what the files themselves change
    1   they are known

Without the setting, as shipped, bodies are made as everywhere here and no file is written.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterable
from pathlib import Path
from types import ModuleType

from adapters.shapes import Hull, Shape

_BODY = """<robot name="body"><link name="body">
<inertial><mass value="{mass!r}"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
<collision><geometry>{shape}</geometry></collision>
</link></robot>
"""


def box(half_extents: Iterable[float]) -> str:
    """A box of these half extents [m] in URDF."""
    return '<box size="{!r} {!r} {!r}"/>'.format(*(2.0 * float(half) for half in half_extents))


def hull(vertices: Iterable[Iterable[float]], folder: Path) -> str:
    """The hull of vertices [m] in URDF, beside a file in ``folder``; Bullet reads them in single precision."""
    lines = ["v {!r} {!r} {!r}".format(*map(float, vertex)) for vertex in vertices]
    lines += [f"f 1 {k} {k + 1}" for k in range(2, len(lines))]  # any faces that name all vertices: it makes its own
    path = folder / "hull.obj"
    path.write_text("\n".join(lines) + "\n", encoding="ascii")
    return f'<mesh filename="{path}"/>'


def made(
    p: ModuleType,
    shape: Shape,
    half_extents: Iterable[float],
    mass: float,
    known: bool,
    place: Iterable[float],
    turn: Iterable[float],
    **how: int,
) -> int:
    """Make a body of a hull, or of a box of ``half_extents`` [m] that stands for any other shape.

    Moments are set afterwards, as for bodies that are made otherwise.

    Parameters
    ----------
    known
        Whether Bullet knows its faces.
    place, turn
        Position [m] and quaternion (x, y, z, w).
    how
        What else `loadURDF` is told.

    Returns
    -------
    int
        The body's number in Bullet.
    """
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        stated = hull(shape.vertices, folder) if isinstance(shape, Hull) else box(half_extents)
        path = folder / "body.urdf"
        path.write_text(_BODY.format(mass=float(mass), shape=stated), encoding="ascii")
        flags = p.URDF_USE_INERTIA_FROM_FILE | (p.URDF_INITIALIZE_SAT_FEATURES if known else 0)
        fixed = int(mass == 0.0)
        return int(p.loadURDF(str(path), list(place), list(turn), useFixedBase=fixed, flags=flags, **how))
