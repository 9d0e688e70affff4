"""Other ways of running a scene, none of which may change its answer."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from reference_solver.certificate.relations import Change, permuted
from reference_solver.certificate.truth import PLACES, Certificate, away, certify
from reference_solver.model import Array, Model
from reference_solver.settings import Settings
from reference_solver.simulation import Simulation
from tests.verification.fuzz.scenes import STRIDE, Scene

#: Steps of the finer variants in `STRIDE` of the scene's own: no two of them end together but at samples. Neither ratio
#: is among those that a certificate compares (2, 13 : 34, 13 : 144).
FINER = {"dt/1.6": 8, "dt/9.4": 47}
#: Velocity [m/s] of the observer who sees the boosted variant.
BOOST = (1.7, -0.6, 0.9)


class Variant:
    """A scene that is run in another way.

    Parameters
    ----------
    model
        What is simulated.
    dt
        Step [s].
    stride
        Steps from one sample to the next; samples are at the times of those of the scene's own run.
    seen
        What becomes of the scene's own poses (s, n, P) at times (s,) in this variant.
    restarts
        Whether the run is built anew half-way, from poses and twists.
    """

    def __init__(
        self,
        model: Model,
        dt: float,
        stride: int = STRIDE,
        seen: Callable[[Array, Array], Array] = lambda pose, t: pose,
        restarts: bool = False,
    ) -> None:
        self.model, self.dt, self.stride, self.seen, self.restarts = model, dt, stride, seen, restarts

    def poses(self, samples: int) -> Array:
        """Return poses (samples + 1, n, P) of a run."""
        settings = Settings.reference(self.dt)
        if not self.restarts:
            return Simulation(self.model, settings).record(samples * self.stride, self.stride).pose
        half = samples // 2
        first = Simulation(self.model, settings)
        before = first.record(half * self.stride, self.stride).pose
        state = zip(self.model.bodies, first.pose, first.twist, strict=True)
        bodies = [replace(body, pose=tuple(pose), twist=tuple(twist)) for body, pose, twist in state]
        again = Simulation(replace(self.model, bodies=bodies), settings)
        return np.concatenate([before, again.record((samples - half) * self.stride, self.stride).pose[1:]])

    def certified(self, samples: int) -> Certificate:
        """Return the certificate of a run; of one without a restart, where there is one."""
        return certify(self.model, Settings.reference(self.dt), samples * self.stride, self.stride)


def variants(scene: Scene) -> dict[str, Variant]:
    """Return all variants of a scene by name."""
    model, dt = scene.model, 1.0 / scene.rate
    d, n = model.dimension, len(model.bodies)
    found = {name: Variant(model, STRIDE * dt / count, count) for name, count in FINER.items()}
    backwards = list(range(n))[::-1]
    found["bodies reversed"] = Variant(permuted(model, backwards), dt, seen=lambda pose, t: pose[:, backwards])
    turn = {2: ((1, 0), (-1.0, 1.0)), 3: ((1, 2, 0), (1.0, 1.0, 1.0))}[d]
    changes = {
        "mirrored": Change(d, signs=(-1.0,) + (1.0,) * (d - 1)),
        "quarter turn": Change(d, axes=turn[0], signs=turn[1]),
        "boosted": Change(d, boost=BOOST[:d]),
    }
    changes |= {f"moved by {far:g}": away(model, far) for far in PLACES}
    for name, change in changes.items():
        found[name] = Variant(change.model(model), dt, seen=change.pose)
    found["restarted"] = Variant(model, dt, restarts=True)
    return found
