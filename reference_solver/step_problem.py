"""The contact problem of one step as matrices, so that other solvers can be given the same problem (E64).

    u = W p + q,   per contact and with û = u + mu |u_t| n:   C* contains û,  C contains p,  û . p = 0

C is the cone |p_t| <= mu p_n. Components of a contact are (n, t) in the plane and (n, t1, t2) in space. What a normal
row must reach (restitution, a gap to close) is taken off q, so that u is the velocity beyond its target.

File names are those of FCLib's local problem: ``W``, ``q``, ``mu``, ``spacedim`` (V. Acary, M. Bremond, T. Koziara,
F. Perignon, *FCLIB: a collection of discrete 3D Frictional Contact problems*, INRIA RT-0444, 2014), with Siconos'
``numberOfContacts`` for the length of ``mu``. What FCLib does not have (bodies, frames) stands beside them.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from os import PathLike

import numpy as np
from numpy.typing import NDArray

from reference_solver.exact_contact import ContactSolution, coulomb_solutions
from reference_solver.model import Array

#: FCLib's name of each field that has one.
FCLIB = {"matrix": "W", "free": "q", "friction": "mu"}
#: Relative asymmetry of W that is round-off of its products.
SYMMETRIC = 1e-12


@dataclass(frozen=True)
class StepProblem:
    """c contacts in d dimensions.

    Parameters
    ----------
    matrix
        W (c d, c d) [1/kg], symmetric, positive semi-definite.
    free
        q (c d,) [m/s]: velocities without impulses, the normal rows less their targets.
    friction
        mu (c,).
    frame
        (c, d, d): rows n, t or n, t1, t2 in world axes, n from body A to body B.
    body_a, body_b
        (c,) indices of the bodies.

    Raises
    ------
    ValueError
        Naming the field whose shape or symmetry is wrong.
    """

    matrix: Array
    free: Array
    friction: Array
    frame: Array
    body_a: NDArray[np.int64]
    body_b: NDArray[np.int64]

    def __post_init__(self) -> None:
        c, d = self.contacts, self.dimension
        shapes = {"matrix": (c * d, c * d), "free": (c * d,), "friction": (c,), "frame": (c, d, d)}
        for name, shape in (shapes | {"body_a": (c,), "body_b": (c,)}).items():
            found = np.shape(getattr(self, name))
            if found != shape:
                raise ValueError(f"{name}: shape {found} where {shape} is needed")
        skew = np.abs(self.matrix - self.matrix.T).max(initial=0.0)
        if skew > SYMMETRIC * np.abs(self.matrix).max(initial=0.0):
            raise ValueError(f"matrix: not symmetric, by {skew:.3g}")

    @property
    def contacts(self) -> int:
        """Number of contacts."""
        return len(self.friction)

    @property
    def dimension(self) -> int:
        """Numbers per contact, 2 or 3."""
        return int(np.shape(self.frame)[-1])

    def velocity(self, impulse: Array) -> Array:
        """Return u (c, d) [m/s] that impulses (c, d) [N s] bring about, normal components beyond their target."""
        return (self.matrix @ np.ravel(impulse) + self.free).reshape(-1, self.dimension)

    def pair_sums(self, impulse: Array) -> Array:
        """Return the sum of impulses on B of each pair of bodies (pairs, d), world axes [N s].

        Single impulses of a face that rests on several points are not determined, their sums are, unless bodies
        stand in closed loops (a pyramid): see `body_sums`.
        """
        world = np.einsum("ci,cij->cj", np.reshape(impulse, (-1, self.dimension)), self.frame)
        pairs = np.unique(np.column_stack([self.body_a, self.body_b]), axis=0, return_inverse=True)
        sums = np.zeros((len(pairs[0]), self.dimension))
        np.add.at(sums, pairs[1].ravel(), world)
        return sums

    def body_sums(self, impulse: Array) -> Array:
        """Return the sum of impulses on each body that any contact names (bodies, d), world axes [N s].

        Determined wherever velocities are, also in heaps that carry stresses of their own.
        """
        world = np.einsum("ci,cij->cj", np.reshape(impulse, (-1, self.dimension)), self.frame)
        bodies, index = np.unique(np.concatenate([self.body_a, self.body_b]), return_inverse=True)
        sums = np.zeros((len(bodies), self.dimension))
        np.add.at(sums, index.ravel(), np.concatenate([-world, world]))
        return sums

    def solutions(self) -> list[ContactSolution]:
        """Return every solution of a planar problem of at most six contacts (O9), one per distinct velocity.

        None, one or several: the certificate's question of uniqueness. Two may be the ends of a continuum.

        Raises
        ------
        ValueError
            In space, or for more contacts than can be enumerated.
        """
        if self.dimension != 2:
            raise ValueError(f"dimension: enumeration is planar, this problem has {self.dimension}")
        return coulomb_solutions(self.matrix, self.free, self.friction.tolist())

    def save(self, path: str | PathLike[str]) -> None:
        """Write an ``.npz`` file under FCLib's names."""
        named = {FCLIB.get(field.name, field.name): getattr(self, field.name) for field in fields(self)}
        np.savez(path, spacedim=self.dimension, numberOfContacts=self.contacts, **named)

    @classmethod
    def load(cls, path: str | PathLike[str]) -> StepProblem:
        """Read what `save` wrote.

        Raises
        ------
        ValueError
            If an entry is missing, or does not fit the others.
        """
        with np.load(path) as file:
            missing = [name for f in fields(cls) if (name := FCLIB.get(f.name, f.name)) not in file]
            if missing:
                raise ValueError(f"{path}: no {', '.join(missing)}")
            problem = cls(*(file[FCLIB.get(field.name, field.name)] for field in fields(cls)))
            told = (int(file["spacedim"]), int(file["numberOfContacts"]))
        if told != (problem.dimension, problem.contacts):
            raise ValueError(f"{path}: spacedim, numberOfContacts are {told}")
        return problem
