"""Box2D's contacts within a step: geometry before the solve, impulses after it.

A manifold has the impulses of the step itself only, without those of continuous collisions within it. A listener gets
both, and a step's impulses are their sum.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import Box2D


class Listener(Box2D.b2ContactListener):
    """Sets the materials of new pairs, and records the contacts of a step while it is switched on.

    Parameters
    ----------
    radii
        Skin or radius of each body's shape [length].
    materials
        Restitution and friction by pair of bodies; a missing pair keeps Box2D's own mixed values.
    early
        Gravity of a step [length/s], if restitution is to be sampled before it.
    """

    def __init__(
        self,
        radii: list[float],
        materials: Mapping[tuple[int, int], tuple[float, float]],
        early: tuple[float, float] | None,
    ) -> None:
        super().__init__()
        self.radii, self.materials, self.early = radii, materials, early
        self.hears = False
        self.geometry: dict[tuple[int, int], tuple[Any, list[Any], list[float]]] = {}
        #: Contacts as of `adapters.copied.Copied`.
        self.rows: list[tuple[float, ...]] = []
        self.failure: Exception | None = None

    def BeginContact(self, contact: Any) -> None:
        """Give the pair its own material: overwrite Box2D's mixed values."""
        a, b = contact.fixtureA.body.userData, contact.fixtureB.body.userData
        material = self.materials.get((min(a, b), max(a, b)))
        if material is not None:
            contact.restitution, contact.friction = material

    def PreSolve(self, contact: Any, oldManifold: Any) -> None:
        """Record the place of the contact: the solver works with these normals, and the bodies move afterwards."""
        try:
            if self.early is not None:
                self._correct(contact, self.early)
            if self.hears:
                self._keep(contact)
        except Exception as error:  # the binding prints and drops exceptions of a callback
            self.failure = error

    def PostSolve(self, contact: Any, impulse: Any) -> None:
        """Add the solver's impulses."""
        if self.hears:
            try:
                self._add(contact, impulse)
            except Exception as error:
                self.failure = error

    def _keep(self, contact: Any) -> None:
        a, b = contact.fixtureA.body, contact.fixtureB.body
        world, manifold = contact.worldManifold, contact.manifold
        normal = world.normal
        points = [tuple(point) for point in world.points[: manifold.pointCount]]
        self.geometry[a.userData, b.userData] = (tuple(normal), points, self._gaps(a, b, manifold, normal))

    def _correct(self, contact: Any, kick: tuple[float, float]) -> None:
        """Lower the restitution to rebound with the velocity before this step's gravity."""
        a, b = contact.fixtureA.body, contact.fixtureB.body
        world = contact.worldManifold
        n, p = world.normal, world.points[0]
        va, vb = a.GetLinearVelocityFromWorldPoint(p), b.GetLinearVelocityFromWorldPoint(p)
        before = (vb[0] - va[0]) * n[0] + (vb[1] - va[1]) * n[1]
        falls = (b.type == Box2D.b2_dynamicBody) - (a.type == Box2D.b2_dynamicBody)
        after = before + falls * (kick[0] * n[0] + kick[1] * n[1])
        asked, _ = self.materials[min(a.userData, b.userData), max(a.userData, b.userData)]
        contact.restitution = max(0.0, asked * before / after) if after < 0.0 else asked

    def _gaps(self, a: Any, b: Any, manifold: Any, normal: Any) -> list[float]:
        """Gap of each point in the position solver [b2PositionSolverManifold::Initialize]."""
        skins = self.radii[a.userData] + self.radii[b.userData]
        kind, gaps = manifold.type_, []
        face, other, sign = (b, a, -1.0) if kind == 2 else (a, b, 1.0)
        px, py = face.GetWorldPoint(manifold.localPoint)
        for point in manifold.points[: manifold.pointCount]:
            qx, qy = other.GetWorldPoint(point.localPoint)
            x, y = qx - px, qy - py
            away = math.hypot(x, y) if kind == 0 else sign * (x * normal[0] + y * normal[1])  # 0: two circles
            gaps.append(away - skins)
        return gaps

    def _add(self, contact: Any, impulse: Any) -> None:
        a, b = contact.fixtureA.body.userData, contact.fixtureB.body.userData
        (nx, ny), points, gaps = self.geometry[a, b]
        # The solver drops the second of two almost equal points, which then has no impulse.
        solved = zip(points, gaps, impulse.normalImpulses, impulse.tangentImpulses, strict=False)
        for point, gap, jn, jt in solved:
            # The tangent is the normal turned by -90 degrees [b2Cross(normal, 1)].
            self.rows.append((a, b, *point, nx, ny, jn * nx + jt * ny, jn * ny - jt * nx, gap))
