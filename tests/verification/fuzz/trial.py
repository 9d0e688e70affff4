"""What becomes of one random scene: whether it is certified, why not, and how far its variants are from it.

`scenes` draws a world from a seed, `variants` are the other ways of running it. A certified run that differs from a
certified variant by more than both bounds X together is a defect, whoever of the two is wrong.
"""

from __future__ import annotations

import re
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from reference_solver.certificate.truth import Certificate, certify, distance
from reference_solver.settings import Settings
from tests.verification.fuzz.scenes import DRAWN, STRIDE
from tests.verification.fuzz.variants import TOLERANCES, variants

#: What the reason says that a scene comes out otherwise far from the origin.
MISPLACED = "it comes out otherwise"


@dataclass(frozen=True)
class Trial:
    """What became of one scene.

    Parameters
    ----------
    seed, dimension
        Of the scene.
    certified
        Whether its certificate holds.
    conditions
        What refused it, by name, with the value.
    bound
        X at the end, or at the horizon where that comes sooner [m].
    off
        Largest distance from any variant up to there [m], and that variant's name; of a refused scene from those to
        other tolerances: small where a right answer was refused.
    defects
        Certified variants that differ by more than both bounds and what the coordinates of both round: name, time [s],
        difference, and all that is allowed [m].
    refused_variants
        Variants that differ by more than X and are refused, with the conditions.
    """

    seed: int
    dimension: int
    certified: bool
    conditions: dict[str, float]
    bound: float
    off: float
    farthest: str
    defects: tuple[tuple[str, float, float, float], ...]
    refused_variants: dict[str, tuple[str, ...]]

    def as_dict(self) -> dict[str, Any]:
        """Plain data."""
        return asdict(self)


def attack(seed: int, dimension: int, kind: str = "any") -> Trial:
    """Certify the scene of a seed, of a kind in `DRAWN`, and compare it with its variants."""
    drawn = DRAWN[kind](seed, dimension)
    samples = drawn.steps // STRIDE
    found = certify(drawn.model, Settings.reference(1.0 / drawn.rate), drawn.steps, STRIDE)
    within = found.t < found.horizon
    last = int(np.flatnonzero(within)[-1])
    off, farthest = 0.0, ""
    defects: list[tuple[str, float, float, float]] = []
    refused: dict[str, tuple[str, ...]] = {}
    for name, variant in variants(drawn).items():
        if not (found.holds or name in TOLERANCES):
            continue
        poses = variant.poses(samples)
        apart = distance(variant.model, variant.seen(found.pose, found.t), poses)
        worst = float(apart[within].max())
        if not worst <= off:
            off, farthest = worst, name
        if not found.holds:
            continue
        rounds = sum(found.rounding(float(np.nanmax(np.abs(pose[:, :, :dimension])))) for pose in (found.pose, poses))
        if not (apart <= found.error + rounds)[within].all():
            other = variant.certified(samples)
            if not other.holds:
                refused[name] = tuple(conditions(other))
                continue
            allowed = found.error + other.error + rounds
            beyond = np.flatnonzero(within & (other.t < other.horizon) & ~(apart <= allowed))
            if len(beyond):
                k = int(beyond[0])
                defects.append((name, float(found.t[k]), float(apart[k]), float(allowed[k])))
    return Trial(
        seed,
        dimension,
        found.holds,
        conditions(found),
        float(found.error[last]),
        off,
        farthest,
        tuple(defects),
        refused,
    )


def conditions(certificate: Certificate) -> dict[str, float]:
    """Return what refuses a certificate, with values: its checks by their names, the loop by its sentence."""
    found = {finding.name: finding.value for finding in certificate.findings if not finding.holds}
    if not certificate.findings:
        found[re.sub(r"\d\S*", "...", certificate.reasons[0])] = 1.0
    if any(MISPLACED in reason for reason in certificate.reasons):
        found["far from the origin"] = 1.0
    if not found and not certificate.holds:
        found["another run"] = float("inf")
    return found
