"""How far apart two bodies are, exactly, from their shapes and poses alone; shares no code with any solver.

Every shape but a half-space is a *core* (a point, a segment, a polygon or a box) and all points within a radius of
it. With K = {b - a} the set of differences of two cores, the gap of the shapes is the signed distance of the origin
from K, less both radii: growing a convex set by a ball moves its boundary by the radius, seen from either side.

Cores apart: the least distance over pairs of features (corner and solid, edge and edge), each of them the distance of
two actual points, so that none is too small and one of them is right. Cores that meet: the least over the directions
n of K's faces of the way along n that parts them (separating axes; S. Gottschalk, M. Lin, D. Manocha, *OBBTree*,
SIGGRAPH 1996): of a planar core its edge normals, of a box its face normals, and the products of edges of both.

Shapes are known by what they have, so that `reference_solver.shapes` and any other shapes with the same fields serve:
``normal`` and ``offset`` (half-space), ``half_extents`` (box), ``vertices`` (polygon), ``half_length`` and ``radius``
(capsule along x), ``radius`` alone (disc, sphere). Poses are (x, y, angle) or (x, y, z, qw, qx, qy, qz).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from reference_solver.model import Array

#: Poses of one pair that are looked at together: two boxes have 144 pairs of edges, 3 kB a number.
BATCH = 1024
#: Share of the cores' size that is round-off of their distance: below it two points have no direction, and an axis
#: that tells the distance to this is the normal, since its direction has no round-off.
ROUND_OFF = 1e-14


class Nearest(NamedTuple):
    """Where two bodies are nearest, or deepest in each other.

    Parameters
    ----------
    gap
        (...,) signed distance [m]; < 0 is how far they must be moved to part.
    normal
        (..., d) unit vector from A to B along which the gap is measured.
    point_a, point_b
        (..., d) the points of A and of B on that line, world axes [m]: ``point_b = point_a + gap * normal``, but for
        bodies that overlap: there each is a point of its body that lies deepest in the other.
    """

    gap: Array
    normal: Array
    point_a: Array
    point_b: Array


class Core(NamedTuple):
    """One shape at s poses: what its radius grows."""

    kind: str  # "point", "segment", "polygon" or "box"
    vertex: Array  # (s, k, d) corners, world axes [m]
    edge: Array  # (e, 2) indices of corners: the edges, of polygons counter-clockwise
    axes: Array  # (s, d, d) columns are the body axes
    centre: Array  # (s, d)
    half: Array  # (d,) half extents of a box [m]; zeros for others
    radius: float


def gap(shape_a: Any, pose_a: ArrayLike, shape_b: Any, pose_b: ArrayLike) -> Any:
    """Return the signed distance of two bodies [m], < 0 where they overlap: a float, or (...,) for poses (..., 3 | 7).

    Raises
    ------
    ValueError
        For two half-spaces, for shapes of different dimensions, and for what is no shape.
    """
    found = nearest(shape_a, pose_a, shape_b, pose_b).gap
    return float(found) if np.ndim(found) == 0 else found


def nearest(shape_a: Any, pose_a: ArrayLike, shape_b: Any, pose_b: ArrayLike) -> Nearest:
    """Return where two bodies are nearest; poses (..., 3 | 7) are broadcast against each other.

    Raises
    ------
    ValueError
        As in `gap`.
    """
    a, b = np.broadcast_arrays(np.asarray(pose_a, float), np.asarray(pose_b, float))
    if a.shape[-1] not in (3, 7):
        raise ValueError(f"pose: has {a.shape[-1]} numbers where 3 or 7 are needed")
    form, size = a.shape[:-1], a.shape[-1]
    flat_a, flat_b = a.reshape(-1, size), b.reshape(-1, size)
    # Seen from A, so that places far from the origin cost no digits but those they are given with.
    d = 2 if size == 3 else 3
    origin = flat_a[:, :d].copy()
    flat_a, flat_b = flat_a.copy(), flat_b.copy()
    flat_a[:, :d] -= origin
    flat_b[:, :d] -= origin
    parts = [
        _nearest(shape_a, flat_a[k : k + BATCH], shape_b, flat_b[k : k + BATCH])
        for k in range(0, max(len(flat_a), 1), BATCH)
    ]
    joined = [np.concatenate([part[k] for part in parts]) for k in range(4)]
    joined[2], joined[3] = joined[2] + origin, joined[3] + origin
    return Nearest(*(field.reshape(form + field.shape[1:]) for field in joined))


def distinct(shape_a: Any, pose_a: Array, shape_b: Any, pose_b: Array) -> Nearest:
    """As `nearest`, asked once where poses (s, P) repeat those before: what rests costs nothing."""
    both = np.concatenate([pose_a, pose_b], axis=1)
    new = np.ones(len(both), bool)
    new[1:] = (both[1:] != both[:-1]).any(axis=1)
    found = nearest(shape_a, pose_a[new], shape_b, pose_b[new])
    which = np.cumsum(new) - 1
    return Nearest(*(field[which] for field in found))


class Partings(NamedTuple):
    """Directions in which two cores of corners can part.

    Parameters
    ----------
    apart
        (s, m) how far apart they are along each [m].
    axes
        (s, m, d) unit vectors from A to B, world axes: normals of faces (planar: of edges), and in space what is square
        to an edge of each.
    faces
        (m,) whether it is a face's.
    """

    apart: Array
    axes: Array
    faces: Array


def partings(shape_a: Any, pose_a: Array, shape_b: Any, pose_b: Array) -> Partings:
    """Return along which directions two bodies with corners can part at poses (s, 3 | 7).

    Raises
    ------
    ValueError
        For shapes whose cores have neither edges (planar) nor faces (spatial).
    """
    a, b = core_of(shape_a, pose_a), core_of(shape_b, pose_b)
    axes = _edge_normals(a, b) if a.centre.shape[1] == 2 else _face_normals(a, b)
    if axes is None:
        raise ValueError("shapes: cores have no normals of their own")
    faces = np.ones(axes.shape[1], bool)
    if a.centre.shape[1] == 3:
        faces = np.arange(len(faces)) % (len(faces) // 2) < 3 * ((a.kind == "box") + (b.kind == "box"))
    return Partings(_parted(a, b, axes), axes, faces)


def rotation(pose: Array) -> Array:
    """Return the rotation matrices (..., d, d) of poses (..., 3 | 7), body axes to world axes.

    A quaternion need not have exactly the length one: the matrix is that of its direction.
    """
    rows: tuple[tuple[Array, ...], ...]
    if pose.shape[-1] == 3:
        c, s = np.cos(pose[..., 2]), np.sin(pose[..., 2])
        rows = ((c, -s), (s, c))
    else:
        q = pose[..., 3:] / np.linalg.norm(pose[..., 3:], axis=-1, keepdims=True)
        w, x, y, z = (q[..., k] for k in range(4))
        rows = (
            (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
            (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
            (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
        )
    matrix = np.empty((*pose.shape[:-1], len(rows), len(rows)))
    for i, row in enumerate(rows):
        for j, entry in enumerate(row):
            matrix[..., i, j] = entry
    return matrix


def reach(shape: Any) -> float:
    """Return the largest distance of a point of ``shape`` from its centre of mass [m]; infinite for a half-space."""
    if hasattr(shape, "normal"):
        return float("inf")
    size = 7 if len(getattr(shape, "half_extents", ())) == 3 else 3
    core = core_of(shape, np.eye(1, size, 3) if size == 7 else np.zeros((1, 3)))
    return float(np.linalg.norm(core.vertex - core.centre[:, None], axis=2).max() + core.radius)


def _nearest(shape_a: Any, pose_a: Array, shape_b: Any, pose_b: Array) -> Nearest:
    if hasattr(shape_a, "normal") and hasattr(shape_b, "normal"):
        raise ValueError("shapes: two half-spaces have no finite distance")
    if hasattr(shape_a, "normal"):
        return _over_plane(shape_a, pose_a, core_of(shape_b, pose_b))
    if hasattr(shape_b, "normal"):
        found = _over_plane(shape_b, pose_b, core_of(shape_a, pose_a))
        return Nearest(found.gap, -found.normal, found.point_b, found.point_a)
    a, b = core_of(shape_a, pose_a), core_of(shape_b, pose_b)
    between = _between_planar if pose_a.shape[1] == 3 else _between_spatial
    apart, point_a, point_b = between(a, b)
    along, normal = _deepest(a, b)
    distance = np.linalg.norm(point_b - point_a, axis=1)
    # Cores that meet, and cores whose distance an axis tells.
    meet = along < 0.0
    size = np.abs(a.vertex - a.centre[:, None]).max() + np.abs(b.vertex - b.centre[:, None]).max()
    told = meet | ((along >= distance - ROUND_OFF * size) & np.isfinite(along))
    line = np.divide(point_b - point_a, distance[:, None], out=np.zeros_like(point_a), where=distance[:, None] > 0.0)
    normal = np.where((told | (distance <= ROUND_OFF * size))[:, None], normal, line)
    apart = np.where(meet, along, distance)
    point_a = np.where(meet[:, None], _support(a, normal), point_a)
    point_b = np.where(meet[:, None], _support(b, -normal), point_b)
    return Nearest(apart - a.radius - b.radius, normal, point_a + a.radius * normal, point_b - b.radius * normal)


def core_of(shape: Any, pose: Array) -> Core:
    """Return corners, edges and axes of a shape's core at poses (s, 3 | 7).

    Raises
    ------
    ValueError
        For what is no shape of that dimension, half-spaces included.
    """
    d = 2 if pose.shape[1] == 3 else 3
    axes, centre = rotation(pose), pose[:, :d]
    half, radius, kind = np.zeros(d), 0.0, "point"
    if hasattr(shape, "half_extents"):
        half = np.array(shape.half_extents, float)
        if len(half) != d:
            raise ValueError(f"shapes: {shape!r} has no pose of {pose.shape[1]} numbers")
        local = half * _SIGNS[d]
        kind, edge = ("polygon" if d == 2 else "box"), _EDGES[d]
    elif hasattr(shape, "vertices"):
        local = np.array(shape.vertices, float)
        kind, edge = "polygon", np.array([(k, (k + 1) % len(local)) for k in range(len(local))])
    elif hasattr(shape, "half_length"):
        local = np.zeros((2, d))
        local[:, 0] = -shape.half_length, shape.half_length
        kind, edge, radius = "segment", np.array([(0, 1)]), float(shape.radius)
    elif hasattr(shape, "radius"):
        local, edge, radius = np.zeros((1, d)), np.zeros((0, 2), int), float(shape.radius)
    else:
        raise ValueError(f"shapes: {shape!r} is none of half-space, disc, sphere, box, capsule, polygon")
    vertex = centre[:, None] + local @ axes.swapaxes(1, 2)
    return Core(kind, vertex, edge, axes, centre, half, radius)


#: Corners of a box as signs of its half extents, and its edges: of the planar one counter-clockwise.
_SIGNS = {
    2: np.array([(1, 1), (-1, 1), (-1, -1), (1, -1)], float),
    3: np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float),
}
_EDGES = {
    2: np.array([(0, 1), (1, 2), (2, 3), (3, 0)]),
    3: np.array([(i, j) for i in range(8) for j in range(i) if np.abs(_SIGNS[3][i] - _SIGNS[3][j]).sum() == 2]),
}


def _over_plane(plane: Any, pose: Array, core: Core) -> Nearest:
    """Lowest corner of a core over the surface of a half-space."""
    normal = np.einsum("sij,j->si", rotation(pose), np.array(plane.normal, float))
    d = normal.shape[1]
    heights = np.einsum("ski,si->sk", core.vertex - pose[:, None, :d], normal) - plane.offset
    least = heights.min(axis=1)
    # Corners that are equally low touch together: their mean is the point.
    low = heights <= (least + 1e-12 * np.abs(heights).max(axis=1))[:, None]
    point = np.einsum("sk,ski->si", low / low.sum(axis=1, keepdims=True), core.vertex) - core.radius * normal
    gap_ = least - core.radius
    return Nearest(gap_, normal, point - gap_[:, None] * normal, point)


def _support(core: Core, direction: Array) -> Array:
    """Corner farthest along ``direction`` (s, d), or the mean of those that are equally far."""
    along = np.einsum("ski,si->sk", core.vertex - core.centre[:, None], direction)
    most = along.max(axis=1)
    far = along >= (most - 1e-12 * np.abs(along).max(axis=1))[:, None]
    found: Array = np.einsum("sk,ski->si", far / far.sum(axis=1, keepdims=True), core.vertex)
    return found


def _deepest(a: Core, b: Core) -> tuple[Array, Array]:
    """Separation (s,) along the axis of largest separation, and that axis (s, d), from A to B; -inf without axes.

    Negative exactly where the cores overlap with a common interior; else a lower bound of their distance.
    """
    s, d = a.centre.shape
    candidates = _edge_normals(a, b) if d == 2 else _face_normals(a, b)
    if candidates is None:
        return np.full(s, np.inf), _across(a, b)
    if d == 2:
        candidates = np.concatenate([candidates, *_ends(a, b)], axis=1)
    apart = _parted(a, b, candidates)
    best = apart.argmax(axis=1)
    rows = np.arange(s)
    return apart[rows, best], candidates[rows, best]


def _parted(a: Core, b: Core, axes: Array) -> Array:
    """How far apart (s, m) cores are along directions (s, m, d) from A to B."""
    directions = axes.swapaxes(1, 2)
    low = ((b.vertex - a.centre[:, None]) @ directions).min(axis=1)
    high = ((a.vertex - a.centre[:, None]) @ directions).max(axis=1)
    return np.asarray(low - high)


def _across(a: Core, b: Core) -> Array:
    """Direction (s, d) in which points and segments part that meet: any that is square to their lines."""
    s, d = a.centre.shape
    across = np.tile(np.eye(d)[-1], (s, 1))
    lines = [core.axes[:, :, 0] for core in (a, b) if core.kind == "segment"]
    if d == 2 or not lines:
        return across
    other = lines[1] if len(lines) == 2 else np.zeros((s, d))
    square = np.cross(lines[0], other)
    alone = np.linalg.norm(square, axis=1) < 1e-6  # of unit vectors: parallel, or one line only
    square[alone] = np.cross(lines[0], np.eye(3)[np.abs(lines[0]).argmin(axis=1)])[alone]
    return np.asarray(square / np.linalg.norm(square, axis=1, keepdims=True))


def _edge_normals(a: Core, b: Core) -> Array | None:
    """Directions from A to B (s, m, 2) in which planar cores can part: outward of A's edges, inward of B's."""
    found = []
    for core, sign in ((a, 1.0), (b, -1.0)):
        if core.kind == "point":
            continue
        edges = core.edge if core.kind == "polygon" else np.array([(0, 1), (1, 0)])
        along = core.vertex[:, edges[:, 1]] - core.vertex[:, edges[:, 0]]
        outward = np.stack([along[..., 1], -along[..., 0]], -1)
        found.append(sign * outward / np.linalg.norm(outward, axis=2, keepdims=True))
    return np.concatenate(found, axis=1) if found else None


def _ends(a: Core, b: Core) -> Iterator[Array]:
    """Directions (s, 2, 2) in which planar cores part beyond the ends of a segment: what lies on its line is not in it.

    Square to the line both are apart by nothing but round-off, of either sign.
    """
    for core in (a, b):
        if core.kind == "segment":
            along = core.vertex[:, 1:] - core.vertex[:, :1]
            along = along / np.linalg.norm(along, axis=2, keepdims=True)
            yield np.concatenate([along, -along], axis=1)


def _face_normals(a: Core, b: Core) -> Array | None:
    """Directions from A to B (s, m, 3) in which spatial cores can part; None if their differences have no interior."""
    if "box" not in (a.kind, b.kind):
        return None
    faces = [core.axes.swapaxes(1, 2) for core in (a, b) if core.kind == "box"]
    lines = [core.axes.swapaxes(1, 2)[:, : 3 if core.kind == "box" else 1] for core in (a, b) if core.kind != "point"]
    if len(lines) == 2:
        products = np.cross(lines[0][:, :, None], lines[1][:, None]).reshape(len(a.centre), -1, 3)
        size = np.linalg.norm(products, axis=2, keepdims=True)
        # Parallel edges: a face normal stands in. Any unit vector is a valid axis, so that none must be exact.
        faces.append(np.where(size > 1e-14, products / np.maximum(size, 1e-14), faces[0][:, :1]))
    axes = np.concatenate(faces, axis=1)
    return np.concatenate([axes, -axes], axis=1)


def _between_planar(a: Core, b: Core) -> tuple[Array, Array, Array]:
    """Least distance (s,) of corners of one planar core and edges of the other, and the points (s, 2) of A and B."""
    return _least([_corners_to_edges(a, b), _corners_to_edges(b, a, swap=True)])


def _between_spatial(a: Core, b: Core) -> tuple[Array, Array, Array]:
    """Least distance (s,) of corners and solids and of edges, and the points (s, 3) of A and B."""
    found = []
    for one, other, swap in ((a, b, False), (b, a, True)):
        if other.kind == "box":
            found.append(_corners_to_box(one, other, swap))
        else:
            found.append(_corners_to_edges(one, other, swap))
    if len(a.edge) and len(b.edge):
        found.append(_edges_to_edges(a, b))
    return _least(found)


def _least(candidates: list[tuple[Array, Array, Array]]) -> tuple[Array, Array, Array]:
    distance, point_a, point_b = (np.concatenate([c[k] for c in candidates], axis=1) for k in range(3))
    rows, best = np.arange(len(distance)), distance.argmin(axis=1)
    return distance[rows, best], point_a[rows, best], point_b[rows, best]


def _pairs(point: Array, foot: Array, swap: bool) -> tuple[Array, Array, Array]:
    """Distances (s, m), and the points as those of A and B; inf where a foot is none."""
    s, d = point.shape[0], point.shape[-1]
    point, foot = (np.broadcast_to(x, np.broadcast_shapes(point.shape, foot.shape)) for x in (point, foot))
    distance = np.linalg.norm(foot - point, axis=-1).reshape(s, -1)
    first, second = (foot, point) if swap else (point, foot)
    return distance, first.reshape(s, -1, d), second.reshape(s, -1, d)


def _corners_to_edges(a: Core, b: Core, swap: bool = False) -> tuple[Array, Array, Array]:
    """From each corner of A to each edge of B, or to B's one corner."""
    corner = a.vertex[:, :, None]
    if not len(b.edge):
        return _pairs(corner, b.vertex[:, None], swap)
    start = b.vertex[:, None, b.edge[:, 0]]
    along = b.vertex[:, None, b.edge[:, 1]] - start
    share = np.clip(((corner - start) * along).sum(-1) / (along * along).sum(-1), 0.0, 1.0)
    # Measured from the nearer end, so that a foot at an end is that corner to the bit.
    end = start + along
    foot = np.where(share[..., None] <= 0.5, start + share[..., None] * along, end - (1.0 - share)[..., None] * along)
    return _pairs(corner, foot, swap)


def _corners_to_box(a: Core, b: Core, swap: bool) -> tuple[Array, Array, Array]:
    """From each corner of A to the solid box B."""
    local = (a.vertex - b.centre[:, None]) @ b.axes
    outside = local - np.clip(local, -b.half, b.half)
    return _pairs(a.vertex, a.vertex - outside @ b.axes.swapaxes(1, 2), swap)


def _edges_to_edges(a: Core, b: Core) -> tuple[Array, Array, Array]:
    """Lines of edges at their nearest points, where those lie on both edges; parallel ones are told by corners."""
    start_a, start_b = a.vertex[:, a.edge[:, 0], None], b.vertex[:, None, b.edge[:, 0]]
    u, v = a.vertex[:, a.edge[:, 1], None] - start_a, b.vertex[:, None, b.edge[:, 1]] - start_b
    w = start_a - start_b
    uu, uv, vv = (u * u).sum(-1), (u * v).sum(-1), (v * v).sum(-1)
    uw, vw = (u * w).sum(-1), (v * w).sum(-1)
    cross = np.cross(u, v)
    spread = (cross * cross).sum(-1)
    safe = np.where(spread > 1e-28 * uu * vv, spread, 1.0)
    on_a = np.clip(np.where(safe == spread, (uv * vw - vv * uw) / safe, 0.0), 0.0, 1.0)
    # Clipped, every choice is a pair of actual points, whose distance is never too small.
    on_b = np.clip((vw + on_a * uv) / vv, 0.0, 1.0)
    return _pairs(start_a + on_a[..., None] * u, start_b + on_b[..., None] * v, swap=False)
