"""Other ways of running a scene, none of which may change its answer."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from reference_solver.certificate.relations import Change, permuted
from reference_solver.certificate.truth import PLACES, Certificate, away, certify, poses_of
from reference_solver.model import Array, Model
from reference_solver.settings import TOLERANCE, Settings
from reference_solver.simulation import Simulation
from tests.verification.fuzz.scenes import STRIDE, Scene

#: Tolerances of variants, as shares of the scene's own: neither is among those that a certificate compares (.1, 10).
TOLERANCES = {"a third of the tolerance": 1.0 / 3.0, "30 times the tolerance": 30.0}
#: Steps of a variant that is looked at more often in `STRIDE` of the scene's own: they end together at samples only.
OFTENER = 8
#: Velocity [m/s] of the observer who sees the boosted variant.
BOOST = (1.7, -0.6, 0.9)


class Variant:
    """A scene that is run in another way.

    Parameters
    ----------
    model, settings
        What is simulated, and how.
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
        settings: Settings,
        stride: int = STRIDE,
        seen: Callable[[Array, Array], Array] = lambda pose, t: pose,
        restarts: bool = False,
    ) -> None:
        self.model, self.settings, self.stride, self.seen, self.restarts = model, settings, stride, seen, restarts

    def poses(self, samples: int) -> Array:
        """Return poses (samples + 1, n, P) of a run, no numbers from where it is refused."""
        whole = poses_of(self.model, self.settings, samples * self.stride, self.stride)
        half = samples // 2
        if not self.restarts or not np.isfinite(whole[half]).all():
            return whole
        first = Simulation(self.model, self.settings)
        first.advance(half * self.stride)
        state = zip(self.model.bodies, first.pose, first.twist, strict=True)
        bodies = [replace(body, pose=tuple(pose), twist=tuple(twist)) for body, pose, twist in state]
        again = poses_of(replace(self.model, bodies=bodies), self.settings, (samples - half) * self.stride, self.stride)
        return np.concatenate([whole[:half], again])

    def certified(self, samples: int) -> Certificate:
        """Return the certificate of a run; of one without a restart, where there is one."""
        return certify(self.model, self.settings, samples * self.stride, self.stride)


def variants(scene: Scene) -> dict[str, Variant]:
    """Return all variants of a scene by name."""
    model, own = scene.model, Settings.reference(1.0 / scene.rate)
    d, n = model.dimension, len(model.bodies)
    found = {name: Variant(model, Settings.reference(own.dt, share * TOLERANCE)) for name, share in TOLERANCES.items()}
    found["looked at oftener"] = Variant(model, Settings.reference(STRIDE * own.dt / OFTENER), OFTENER)
    backwards = list(range(n))[::-1]
    found["bodies reversed"] = Variant(permuted(model, backwards), own, seen=lambda pose, t: pose[:, backwards])
    turn = {2: ((1, 0), (-1.0, 1.0)), 3: ((1, 2, 0), (1.0, 1.0, 1.0))}[d]
    changes = {
        "mirrored": Change(d, signs=(-1.0,) + (1.0,) * (d - 1)),
        "quarter turn": Change(d, axes=turn[0], signs=turn[1]),
        "boosted": Change(d, boost=BOOST[:d]),
    }
    changes |= {f"moved by {far:g}": away(model, far) for far in PLACES}
    for name, change in changes.items():
        found[name] = Variant(change.model(model), own, seen=change.pose)
    found["restarted"] = Variant(model, own, restarts=True)
    return found
