"""A scene as the solver's model, and one simulation of it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict
from typing import Any

import numpy as np

from adapters.engine import Array, Contacts, EngineError, Recorded, Simulation
from adapters.scene import Body, Box, Capsule, Disc, HalfSpace, Polygon, Scene, Shape, Sphere
from adapters.scene.meeting import told_pairs


def _shape(shape: Shape) -> Any:
    from reference_solver import model

    if isinstance(shape, Disc):
        return model.Disc(shape.radius)
    if isinstance(shape, Sphere):
        return model.Sphere(shape.radius)
    if isinstance(shape, Box):
        return model.Box(shape.half_extents)
    if isinstance(shape, Capsule):
        return model.Capsule(shape.half_length, shape.radius)
    if isinstance(shape, Polygon):
        return model.Polygon(shape.vertices)
    assert isinstance(shape, HalfSpace)
    return model.HalfSpace(shape.normal, shape.offset)


def _body(body: Body, dimension: int) -> Any:
    from reference_solver import model

    return model.Body(
        shape=_shape(body.shape),
        mass=body.mass,
        inertia=body.inertia,
        pose=body.pose,
        twist=body.twist,
        motion=body.motion,
        force=body.force,
        torque=body.torque[0] if dimension == 2 else body.torque,
    )


def solver_model(scene: Scene) -> Any:
    """The scene as a `reference_solver.model.Model`."""
    from reference_solver import model

    n = len(scene.bodies)
    restitution, friction = np.zeros((n, n)), np.zeros((n, n))
    materials = scene.materials()
    if len(materials) == 1:  # without checks of every pair
        free = np.array([body.motion == "free" for body in scene.bodies])
        restitution[:], friction[:] = materials.pop()
        for table in (restitution, friction):
            table[np.outer(~free, ~free) | np.eye(n, dtype=bool)] = 0.0
    for i, j, material in scene.contact_pairs() if materials else ():
        restitution[i, j] = restitution[j, i] = material.restitution
        friction[i, j] = friction[j, i] = material.friction
    return model.Model(
        dimension=scene.dimension,
        bodies=tuple(_body(body, scene.dimension) for body in scene.bodies),
        gravity=scene.gravity,
        restitution=restitution,
        friction=friction,
    )


class ReferenceSimulation(Simulation):
    """One `reference_solver.Simulation`."""

    def __init__(self, scene: Scene, model: Any, settings: Any) -> None:
        from reference_solver import Simulation as Solver

        self.scene, self.model, self.settings = scene, model, settings
        # Fixed sweeps promise nothing that would have to be measured: see `certificate`.
        self.solver = Solver(model, settings, certified=False)

    def advance(self, steps: int) -> None:
        """See `Simulation.advance`.

        Raises
        ------
        EngineError
            Where the loop of events has no answer.
        """
        with _answering():
            self.solver.advance(steps)

    def pose(self) -> Array:
        """See `Simulation.pose`."""
        return np.asarray(self.solver.pose, float)

    def twist(self) -> Array:
        """See `Simulation.twist`."""
        return np.asarray(self.solver.twist, float)

    def contacts(self) -> Contacts:
        """See `Simulation.contacts`."""
        return _contacts(self.solver.contacts())

    def record(self, samples: int, stride: int, contacts: bool) -> Recorded | None:
        """See `Simulation.record`: one call of compiled code takes all samples."""
        with _answering():
            found = self.solver.record(samples * stride, stride, contacts)
        counts = np.diff(found.offset)[1:]  # the first sample is the state before
        return Recorded(found.pose[1:], found.twist[1:], counts, _contacts(found.contacts) if contacts else None)

    def readback(self) -> dict[str, Any]:
        """Settings and model of the solver, and settings without effect in the scene."""
        names = [body.name for body in self.scene.bodies]
        return {
            **asdict(self.settings),
            "gravity": [float(x) for x in self.model.gravity],
            "bodies": {
                name: {"mass": float(body.mass), "inertia": np.asarray(body.inertia, float).tolist()}
                for name, body in zip(names, self.model.bodies, strict=True)
                if body.motion == "free"
            },
            "pairs": {
                f"{names[i]}-{names[j]}": {
                    "restitution": float(self.model.restitution[i, j]),
                    "friction": float(self.model.friction[i, j]),
                }
                for i, j in told_pairs(self.scene)
            },
            "left_out": list(self.solver.left_out),
        }

    def certificate(self) -> dict[str, Any]:
        """Of steps what `reference_solver.Simulation.certificate` counts.

        Of the loop of events ``closed``, whether all motion was in closed form; `ReferenceEngine.certify` judges it.
        """
        if self.settings.tolerance is not None:
            return {"closed": self.solver.is_closed}
        return {key: json_ready(value) for key, value in self.solver.certificate.items()}


@contextmanager
def _answering() -> Iterator[None]:
    """What the loop of events refuses is an error of the engine."""
    from reference_solver.exact import Refused

    try:
        yield
    except Refused as refused:
        raise EngineError(str(refused)) from None


def _contacts(found: Any) -> Contacts:
    """Contacts of the solver's (`reference_solver.records.Contacts`)."""
    a, b = (np.asarray(x, np.int64) for x in (found.body_a, found.body_b))
    return Contacts(a, b, found.point, found.normal, found.impulse, found.gap)


def json_ready(value: Any) -> Any:
    """A value for JSON: lists for tuples, plain numbers for NumPy scalars, null for non-finite numbers."""
    if isinstance(value, tuple):
        return list(value)
    plain = value.item() if isinstance(value, np.generic) else value
    return None if isinstance(plain, float) and not math.isfinite(plain) else plain
