"""Boxes and hulls with clipping of faces: setting ``enableSAT``.

Bullet finds all points of two convex bodies in one step if their faces are initialized, else one point per step.
PyBullet initializes the faces of bodies from URDF files only [bullet3, URDF_INITIALIZE_SAT_FEATURES].

    0   bodies come from URDF files without faces: a control for the effect of the files themselves
    1   with faces

Without the setting, as shipped, bodies are made without files.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterable
from pathlib import Path
from types import ModuleType

from adapters.scene.shapes import Hull, Shape

_BODY = """<robot name="body"><link name="body">
<inertial><mass value="{mass!r}"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
<collision><geometry>{shape}</geometry></collision>
</link></robot>
"""


def files(shape: Shape, half_extents: Iterable[float], mass: float) -> dict[str, str]:
    """Files, by name, of a body of a hull, or of a box of ``half_extents`` [m] for any other shape.

    ``body.urdf`` is loaded; a hull's vertices are in a file beside it, which Bullet reads in single precision.
    """
    if not isinstance(shape, Hull):
        stated = '<box size="{!r} {!r} {!r}"/>'.format(*(2.0 * float(half) for half in half_extents))
        return {"body.urdf": _BODY.format(mass=float(mass), shape=stated)}
    lines = ["v {!r} {!r} {!r}".format(*map(float, vertex)) for vertex in shape.vertices]
    lines += [f"f 1 {k} {k + 1}" for k in range(2, len(lines))]  # any faces with all vertices: Bullet makes its own
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
    """Make the body of `files`. Moments are set afterwards, as for other bodies.

    Parameters
    ----------
    known
        Whether its faces are initialized.
    place, turn
        Position [m] and quaternion (x, y, z, w).
    how
        Further arguments of `loadURDF`.

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
