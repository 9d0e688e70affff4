"""Moves the corners of polygons and hulls of a scene file to their centre of mass."""

from __future__ import annotations

from typing import Any

import numpy as np

from adapters.extras import install
from adapters.scene import SceneError
from adapters.scene.shapes import CENTRED, Polygon, area_and_centroid, check_points
from validation.solids import hull_properties

#: Products of inertia that count as round-off of the given corners, as a share of the moments.
ALIGNED = 1e-9


def centre(body: dict[str, Any], notes: list[str]) -> None:
    """Move the corners of a polygon or hull so that the body's origin is its centroid, and add a note.

    A hull whose moments follow from its shape must lie along its main axes: a scene has three moments, no products.

    Raises
    ------
    SceneError
        Naming the field, for corners that do not form a polygon or hull.
    """
    shape, label = body["shape"], f"{body['name']}.shape"
    points = tuple(map(tuple, shape["vertices"]))
    try:
        if shape["type"] == "polygon":
            check_points("vertices", points, 2, 3)
            found = np.array(area_and_centroid(points)[1])
        else:
            check_points("vertices", points, 3, 4)
            _, found, tensor = hull_properties(np.array(points))
            beside = np.abs(tensor - np.diag(np.diag(tensor))).max()
            if body["inertia"] is None and body["motion"] == "free" and beside > ALIGNED * np.abs(tensor).max():
                raise SceneError("vertices: the main axes of inertia are not the body's; turn it, or give inertia")
    except ModuleNotFoundError:
        raise SceneError(f"{label}.vertices: a hull needs scipy: {install('shapes')}") from None
    except SceneError as error:
        raise SceneError(f"{label}.{error}") from None
    size = float(np.abs(np.array(points)).max())
    if np.linalg.norm(found) > 0.01 * CENTRED * size:  # corners centred to round-off are not changed
        shape["vertices"] = tuple(tuple(float(x) for x in np.array(p) - found) for p in points)
        told = ", ".join(f"{x:.6g}" for x in found)
        notes.append(f"{label}.vertices: their centroid ({told}) is now the body's centre")
    if shape["type"] == "polygon":
        Polygon(tuple(map(tuple, shape["vertices"]))).validate(body["name"])
