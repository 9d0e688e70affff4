"""Gates of the metamorphic relations, on every scene up to its horizon; tests let hypothesis choose the numbers."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np

from reference_solver.certificate.relations import Change, permuted
from reference_solver.certificate.truth import SOLVE
from reference_solver.settings import Settings
from tests.verification.gate import Gate
from tests.verification.relations import (
    canonical_order,
    copies_defect,
    defect,
    permutation_defect,
    reversed_defect,
    run,
)
from tests.verification.scenes import DT, GROWTH, SCENES, Numbers
from tests.verification.space import SPACES, Space, made_by

#: Trials per scene of the rows; the seed makes them the same in every run.
TRIALS, SEED = 4, 72
#: Places and speeds of the scenes stay below these [m, m/s].
PLACE, SPEED = 4.0, 8.0
#: How far apart two copies are put [m]; a power of two, so that the shift itself rounds nothing.
APART = 1024.0

#: Turns of a quarter, by dimension: axes and signs; in space about each axis, and about the diagonal.
TURNS: dict[int, tuple[tuple[tuple[int, ...], tuple[float, ...]], ...]] = {
    2: (((1, 0), (-1.0, 1.0)), ((1, 0), (1.0, -1.0))),
    3: (
        ((1, 0, 2), (-1.0, 1.0, 1.0)),
        ((0, 2, 1), (1.0, -1.0, 1.0)),
        ((2, 1, 0), (1.0, 1.0, -1.0)),
        ((1, 2, 0), (1.0, 1.0, 1.0)),
    ),
}
#: Relations that both profiles must keep; the others change the order of rows, in which a solve that stops early ends
#: elsewhere.
ANY_PROFILE = ("quarter turn", "Galilean boost", "units by powers of two", "far origin", "duplicated world")
REFERENCE_ONLY = ("mirror", "permutation", "time reversal")
#: Relations that hold to the last bit.
EXACT = ("units by powers of two",)
#: Scenes that come back when velocities are turned round: no friction, and nothing inelastic.
REVERSIBLE = ("impact", "bounce", "two balls", "box on edge")


@dataclass(frozen=True)
class Trial:
    """Numbers that one relation is tried with: each uses those it needs.

    Parameters
    ----------
    numbers
        Of the scene.
    vector
        (3,) in [-1, 1]: direction of a boost (times 5 m/s) or of a far origin (times 1 km).
    powers
        Exponents of two of the units of length, time and mass.
    choice
        Which axis is mirrored, which quarter turn, which permutation.
    """

    numbers: Numbers
    vector: tuple[float, float, float] = (0.5, -0.25, 0.75)
    powers: tuple[int, int, int] = (3, -2, 5)
    choice: int = 0


def gates() -> Iterator[Gate]:
    """Yield one row per relation, dimension and profile: the worst of all scenes and trials."""
    for space in SPACES:
        for relation in (*ANY_PROFILE, *REFERENCE_ONLY):
            yield row(relation, space, "reference")
        for relation in ANY_PROFILE:
            yield row(relation, space, "classical")
        yield from predictability(space)


def row(relation: str, space: Space, profile: str) -> Gate:
    """Return the worst of all scenes: of the bound E73, or of zero where bits are equal."""
    rng = np.random.default_rng(SEED)
    worst = 0.0
    scenes = REVERSIBLE if relation == "time reversal" else tuple(SCENES)
    for scene in scenes:
        for _ in range(TRIALS):
            worst = max(worst, measure(relation, scene, space, profile, drawn(rng, space)))
    gate, case = (0.0, "bits") if relation in EXACT else (1.0, "of its round-off bound")
    return Gate.at_most(f"relation: {relation}", f"{len(scenes)} scenes, {case}", worst, gate, made_by(space, profile))


def predictability(space: Space) -> Iterator[Gate]:
    """Growth of a disturbance of 1e-9 m/s up to the horizon, which the bound of all relations rests on (E73)."""
    rng = np.random.default_rng(SEED)
    for scene in SCENES:
        worst = max(growth(scene, space, "reference", drawn(rng, space)) for _ in range(3 * TRIALS))
        yield Gate.at_most("growth of a disturbance", scene, worst, GROWTH, made_by(space, "reference"))


def drawn(rng: np.random.Generator, space: Space) -> Trial:
    """Return a trial at random."""
    e, mu = rng.uniform(0.0, 1.0, 2)
    across = rng.uniform(-1.0, 1.0) if space.dimension == 3 else 0.0
    numbers = Numbers(e, mu, rng.uniform(0.5, 4.0), rng.uniform(0.05, 0.5), across)
    x, y, z = rng.uniform(-1.0, 1.0, 3)
    a, b, c = (int(k) for k in rng.integers(-12, 13, 3))
    return Trial(numbers, (x, y, z), (a, b, c), int(rng.integers(1000)))


def change_of(relation: str, space: Space, trial: Trial) -> Change:
    """Return the change that a relation is about."""
    d = space.dimension
    make = partial(Change, d)
    vector = np.array(trial.vector[:d])
    if relation == "mirror":
        return make(signs=tuple(-1.0 if k == trial.choice % d else 1.0 for k in range(d)))
    if relation == "quarter turn":
        axes, signs = TURNS[d][trial.choice % len(TURNS[d])]
        return make(axes=axes, signs=signs)
    if relation == "Galilean boost":
        return make(boost=tuple(5.0 * vector))
    if relation == "far origin":
        return make(shift=tuple(1000.0 * vector))
    if relation == "units by powers of two":
        length, time, mass = (2.0**k for k in trial.powers)
        return make(length=length, time=time, mass=mass)
    if relation == "duplicated world":
        return make(shift=(APART, 0.0) if d == 2 else (0.0, APART, 0.0))
    return make()


def bound(change: Change, steps: int) -> float:
    """Largest difference that round-off explains (E73) [m, m/s]."""
    far = sum(abs(s) for s in change.shift or ()) + sum(abs(v) for v in change.boost or ()) * steps * DT
    return GROWTH * (SOLVE * SPEED + steps * float(np.finfo(float).eps) * (PLACE + far))


def measure(relation: str, scene: str, space: Space, profile: str, trial: Trial) -> float:
    """Return the defect of a relation over its bound; where bits must be equal, the defect."""
    settings: Settings = getattr(Settings, profile)(DT)
    steps, build = SCENES[scene].horizon, SCENES[scene].build
    change, numbers = change_of(relation, space, trial), trial.numbers
    if relation == "permutation":
        order = np.random.default_rng(trial.choice).permutation(len(build(space, numbers).bodies))
        found = permutation_defect(build(space, numbers), [int(i) for i in order], settings, steps)
    elif relation == "time reversal":
        elastic = dataclasses.replace(numbers, restitution=1.0, friction=0.0)
        found = reversed_defect(build(space, elastic), settings, steps)
    elif relation == "duplicated world":
        found = copies_defect(build(space, dataclasses.replace(numbers, across=0.0)), change, settings, steps)
    else:
        found = defect(change, build(space, numbers), settings, steps)
    return found if relation in EXACT else found / bound(change, steps)


def renumbered_bits(scene: str, space: Space, profile: str, trial: Trial) -> float:
    """Defect between two numberings of one world, both put into canonical order before the run: zero."""
    settings: Settings = getattr(Settings, profile)(DT)
    model, steps = SCENES[scene].build(space, trial.numbers), SCENES[scene].horizon
    order = np.random.default_rng(trial.choice).permutation(len(model.bodies))
    other = permuted(model, [int(i) for i in order])
    first = run(permuted(model, canonical_order(model)), settings, steps)
    second = run(permuted(other, canonical_order(other)), settings, steps)
    return float(max(np.abs(first.pose - second.pose).max(), np.abs(first.twist - second.twist).max()))


def growth(scene: str, space: Space, profile: str, trial: Trial, size: float = 1e-9) -> float:
    """By how much a disturbance of all velocities has grown within the scene's horizon."""
    settings: Settings = getattr(Settings, profile)(DT)
    model, steps = SCENES[scene].build(space, trial.numbers), SCENES[scene].horizon
    rng = np.random.default_rng(trial.choice)
    bodies = [
        dataclasses.replace(b, twist=tuple(np.array(b.twist) + size * rng.uniform(-1.0, 1.0, len(b.twist or ()))))
        if b.motion == "free"
        else b
        for b in model.bodies
    ]
    old, new = run(model, settings, steps), run(dataclasses.replace(model, bodies=bodies), settings, steps)
    return float(max(np.abs(new.pose - old.pose).max(), np.abs(new.twist - old.twist).max())) / size
