"""What a model needs, and therefore what the solver may leave out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from reference_solver.model import Array, Body, Box, Capsule, Model, Polygon

#: Up to this many bodies all pairs are tested; a grid pays off beyond.
ALL_PAIRS_LIMIT = 64


@dataclass(frozen=True)
class Needs:
    """Phenomena that a model can show. A false one is not modelled at all."""

    rotation: bool
    friction: bool
    restitution: bool
    broadphase: bool

    def left_out(self) -> tuple[str, ...]:
        """Names of what is not modelled."""
        return tuple(name for name in ("rotation", "friction", "restitution", "broadphase") if not getattr(self, name))


EVERYTHING = Needs(rotation=True, friction=True, restitution=True, broadphase=True)


def needs(model: Model) -> Needs:
    """Derive what the model needs from its bodies and pair tables.

    Rotation is the response of spins to impulses and torques: a frictionless contact acts through the centre of
    a disc or sphere, so that without torque its spin stays what it was. In space only if its moments are equal: else
    its angular momentum stays, and its spin does not. There a surface that turns needs it as well.
    """
    friction = _acts(model.friction, model)
    turned = any(_turns(body, model.dimension) for body in model.bodies)
    return Needs(
        rotation=friction or turned,
        friction=friction,
        restitution=_acts(model.restitution, model),
        broadphase=len(model.bodies) > ALL_PAIRS_LIMIT,
    )


def _turns(body: Body, dimension: int) -> bool:
    """Whether how a body turns depends on more than the spin that it starts with."""
    if body.motion != "free":
        return dimension == 3 and body.motion == "prescribed" and bool(np.any(np.asarray(body.twist)[3:]))
    if isinstance(body.shape, Box | Capsule | Polygon) or np.any(np.asarray(body.torque)):
        return True
    return dimension == 3 and len(set(np.asarray(body.inertia).tolist())) > 1


def _acts(table: Array, model: Model) -> bool:
    """Whether a pair value is positive for any two bodies one of which is free; one row at a time, to save memory."""
    indices = [i for i, body in enumerate(model.bodies) if body.motion == "free"]
    if table.strides == (0, 0):
        return bool(indices) and len(model.bodies) > 1 and bool(table[0, 0] > 0.0)
    return any((table[i, :i] > 0.0).any() or (table[i, i + 1 :] > 0.0).any() for i in indices)
