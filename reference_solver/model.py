"""What is simulated: shapes, bodies and the pair values of restitution and friction.

SI units. Planar: y up, pose (x, y, angle counter-clockwise), twist (vx, vy, omega). Spatial: z up, pose
(x, y, z, qw, qx, qy, qz) with the quaternion turning body axes into world axes, twist (vx, vy, vz, wx, wy, wz)
in world axes. Normals point from body A to body B, and A has the lower index. Separation < 0 is overlap.
Everything is checked here, because compiled kernels check nothing.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.lib.stride_tricks import as_strided
from numpy.typing import NDArray

from reference_solver.checks import load, require_moments, require_positive, unit, vector
from reference_solver.shapes import Box, Capsule, Disc, HalfSpace, Polygon, Shape, Sphere, smallest_extent

Motion = Literal["free", "fixed", "prescribed"]
Array = NDArray[np.float64]

#: Numbers per pose and twist, by dimension.
POSE_SIZE = {2: 3, 3: 7}
TWIST_SIZE = {2: 3, 3: 6}

__all__ = [
    "POSE_SIZE",
    "TWIST_SIZE",
    "Array",
    "Body",
    "Box",
    "Capsule",
    "Disc",
    "HalfSpace",
    "Model",
    "Motion",
    "Polygon",
    "Shape",
    "Sphere",
    "pair_table",
    "smallest_extent",
]


@dataclass(frozen=True)
class Body:
    """One rigid body.

    Parameters
    ----------
    shape
        A shape of the model's dimension, centred on the centre of mass.
    mass
        [kg], ignored unless free.
    inertia
        About the centre of mass [kg m^2]: a number (planar) or three principal moments in body axes (spatial);
        ignored unless free.
    pose, twist
        At the start, layout as in the module's docstring. A missing twist is rest.
    motion
        ``free``; ``fixed`` (immovable); ``prescribed`` (moves with its constant twist, whatever it meets).
    force, torque
        Constant external load in world axes [N, N m]; zero where missing.

    Raises
    ------
    ValueError
        Naming the field.
    """

    shape: Shape
    mass: float = 0.0
    inertia: float | tuple[float, ...] = 0.0
    pose: tuple[float, ...] = (0.0, 0.0, 0.0)
    twist: tuple[float, ...] | None = None
    motion: Motion = "free"
    force: tuple[float, ...] | None = None
    torque: float | tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.shape, Shape):
            raise ValueError(f"shape: {self.shape!r} is none of Disc, Sphere, Box, Capsule, Polygon, HalfSpace")
        if self.motion not in ("free", "fixed", "prescribed"):
            raise ValueError(f"motion: {self.motion!r} is none of 'free', 'fixed', 'prescribed'")
        pose = vector("pose", self.pose, (3, 7))
        dimension = 2 if len(pose) == 3 else 3
        if dimension == 3:
            pose = pose[:3] + unit("pose", pose[3:])
        self._set(pose=pose)
        self._set(twist=load("twist", self.twist, TWIST_SIZE[dimension]))
        self._set(force=load("force", self.force, dimension))
        self._set(torque=load("torque", self.torque, 1 if dimension == 2 else 3))
        if self.motion == "fixed" and any(self.twist or ()):
            raise ValueError(f"twist: a fixed body must be at rest, not {self.twist!r}; use motion='prescribed'")
        if self.motion == "free":
            self._check_inertia(dimension)

    def _check_inertia(self, dimension: int) -> None:
        if isinstance(self.shape, HalfSpace):
            raise ValueError("motion: a HalfSpace cannot be free")
        require_positive("mass", self.mass)
        inertia = load("inertia", self.inertia, 1 if dimension == 2 else 3)
        for value in inertia if isinstance(inertia, tuple) else (inertia,):
            require_positive("inertia", value)
        if isinstance(inertia, tuple):
            require_moments("inertia", inertia)
        self._set(inertia=inertia)

    def _set(self, **fields: Any) -> None:
        for name, value in fields.items():
            object.__setattr__(self, name, value)

    @property
    def dimension(self) -> int:
        """2 or 3, from the length of the pose."""
        return 2 if len(self.pose) == 3 else 3


@dataclass(frozen=True)
class Model:
    """Bodies, gravity and the law of every pair.

    Parameters
    ----------
    dimension
        2 or 3.
    bodies
        At least one, all of this dimension.
    gravity
        (dimension,) [m/s^2].
    restitution, friction
        (n, n) symmetric pair values: Newton's e, clamped to [0, 1] with a warning, and Coulomb's mu >= 0. A
        number stands for the same value in all pairs; it is kept as a read-only view of that one number, so that
        memory grows with the number of bodies, not with that of pairs.

    Raises
    ------
    ValueError
        Naming the field.
    """

    dimension: int
    bodies: Sequence[Body]
    gravity: tuple[float, ...]
    restitution: Any  # (n, n) float64 once built
    friction: Any

    def __post_init__(self) -> None:
        if self.dimension not in (2, 3):
            raise ValueError(f"dimension: {self.dimension!r} is neither 2 nor 3")
        if not self.bodies:
            raise ValueError("bodies: a model needs at least one body")
        for index, body in enumerate(self.bodies):
            _require_dimension(f"bodies[{index}]", body, self.dimension)
        n = len(self.bodies)
        restitution = _pair_table("restitution", self.restitution, n)
        if (restitution < 0.0).any() or (restitution > 1.0).any():
            warnings.warn("restitution: clamped to [0, 1]; outside it a collision is no passive process", stacklevel=3)
        friction = _pair_table("friction", self.friction, n)
        if (friction < 0.0).any():
            raise ValueError("friction: must not be negative")
        object.__setattr__(self, "bodies", tuple(self.bodies))
        object.__setattr__(self, "gravity", vector("gravity", self.gravity, (self.dimension,)))
        object.__setattr__(self, "restitution", _spread(np.clip(restitution, 0.0, 1.0), n))
        object.__setattr__(self, "friction", _spread(friction, n))


def _require_dimension(name: str, body: Body, dimension: int) -> None:
    if body.dimension != dimension:
        raise ValueError(f"{name}: pose has {len(body.pose)} numbers where {POSE_SIZE[dimension]} are needed")
    shape = body.shape
    fits = {
        Disc: dimension == 2,
        Sphere: dimension == 3,
        Capsule: True,
        Polygon: dimension == 2,
        Box: isinstance(shape, Box) and len(shape.half_extents) == dimension,
        HalfSpace: isinstance(shape, HalfSpace) and len(shape.normal) == dimension,
    }
    if not fits[type(shape)]:
        raise ValueError(f"{name}: shape {shape!r} is not a {dimension}-D shape")


def _pair_table(name: str, value: Any, n: int) -> Array:
    """Return pair values (n, n), or one number as an array without axes."""
    table = np.array(value, dtype=np.float64)
    if table.shape not in ((), (n, n)):
        raise ValueError(f"{name}: shape {table.shape} where ({n}, {n}) is needed")
    if not np.isfinite(table).all():
        raise ValueError(f"{name}: not finite")
    if (table != table.T).any():
        raise ValueError(f"{name}: not symmetric")
    return table


def _spread(table: Array, n: int) -> Array:
    return table if table.ndim == 2 else np.broadcast_to(table, (n, n))


def pair_table(table: Array) -> Array:
    """Return pair values in the one layout that kernels are compiled for, of their own: (n, n), strided.

    One number for all pairs stays one number (strides of zero). At least two rows, and a column of padding where values
    differ: an array that happens to be contiguous has another type, for which all kernels would be compiled anew.
    """
    n = max(len(table), 2)
    if table.strides == (0, 0):
        return as_strided(np.array([table[0, 0]]), (n, n), (0, 0))
    padded = np.zeros((n, n + 1))
    padded[: len(table), : len(table)] = table
    return padded[:, :n]
