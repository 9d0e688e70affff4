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


def files(shape: Shape, half_extents: Iterable[float], mass: float) -> dict[str, str]:
    """Files, by name, of a body of a hull, or of a box of ``half_extents`` [m] that stands for any other shape.

    ``body.urdf`` is what is loaded; a hull's vertices stand beside it, and Bullet reads them in single precision.
    """
    if not isinstance(shape, Hull):
        stated = '<box size="{!r} {!r} {!r}"/>'.format(*(2.0 * float(half) for half in half_extents))
        return {"body.urdf": _BODY.format(mass=float(mass), shape=stated)}
    lines = ["v {!r} {!r} {!r}".format(*map(float, vertex)) for vertex in shape.vertices]
    lines += [f"f 1 {k} {k + 1}" for k in range(2, len(lines))]  # any faces that name all vertices: it makes its own
    text = "\n".join(lines) + "\n"
    return {"hull.obj": text, "body.urdf": _BODY.format(mass=float(mass), shape='<mesh filename="hull.obj"/>')}


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
    """Make the body of `files`. Moments are set afterwards, as for bodies that are made otherwise.

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
    with tempfile.TemporaryDirectory() as folder:
        for name, text in files(shape, half_extents, mass).items():
            Path(folder, name).write_text(text, encoding="ascii")
        flags = p.URDF_USE_INERTIA_FROM_FILE | (p.URDF_INITIALIZE_SAT_FEATURES if known else 0)
        fixed, path = int(mass == 0.0), str(Path(folder, "body.urdf"))
        return int(p.loadURDF(path, list(place), list(turn), useFixedBase=fixed, flags=flags, **how))
