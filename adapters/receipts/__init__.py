"""Property checks: what a profile realises, measured through its adapter, against its declaration.

    asked        value of the scene: the pair's e and mu; 1 for ratios; 0 for losses and delays
    declared     by `Engine.declares`; otherwise as asked
    measured     on the probes, at the sample farthest from what is declared
    holds        |measured - declared| <= band

Probes run with exactly the settings of the judged scene, so the judged configuration is measured. A property check that
does not hold is a finding about the engine, unless the record contradicts itself (`RECORDED`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from types import MappingProxyType
from typing import Any

from adapters.engine import Declared, Engine, EngineError, Setting
from adapters.needs import Needs
from adapters.plain import kind_of
from adapters.receipts.probes import (
    GRAVITY,
    HALF_EXTENTS,
    LANDING_LEAD,
    LANDING_SPEED,
    MOST_FRICTION,
    PROBES,
    SLIDE_TIME,
    SLIDE_WIDTH,
    STEPS,
    Case,
    Samples,
    slide_height,
    slide_load,
    slide_speed,
)
from adapters.stages import stage
from adapters.stepping import posed_for, run

#: What the probes measure. ``restitution`` and ``friction`` are the pair's effective coefficients, the latter from
#: momentum; ``friction_impulse`` is the coefficient of the reported contact impulses, ``impulse`` their sum over the
#: momentum that changed; ``mass``, ``inertia``, ``gravity``, ``step`` and ``size`` are ratios measured / asked;
#: ``sampling`` is how many steps late a state is read; the dampings are the fraction of speed lost in one second;
#: ``turn`` is +1 if positive torques and contact forces turn bodies counter-clockwise where they should, -1 if not.
QUANTITIES = (
    "gravity",
    "step",
    "sampling",
    "mass",
    "inertia",
    "size",
    "linear_damping",
    "angular_damping",
    "restitution",
    "friction",
    "friction_impulse",
    "impulse",
    "turn",
)

#: Property checks that compare one part of a record with another: what such a failure means, and what the engine may
#: realise otherwise so that the record still agrees with itself, with the change of this quantity for a small change of
#: that one (None: of any size). All others compare the record with what was set, so their failure is the engine's.
RECORDED: Mapping[str, tuple[str, Mapping[str, float | None]]] = MappingProxyType(
    {
        # Longer steps than asked: bodies gain more speed and go farther, by the same share.
        "step": ("positions do not follow from velocities and times", {"gravity": 1.0}),
        # Speeds of other gravity or with drag look like other times: k g t = g (t + (k - 1) t) after `STEPS` steps.
        "sampling": ("states are not those of their times", {"gravity": -STEPS, "linear_damping": None}),
        # Impulses on a mass that is not the scene's, and a weight that is not.
        "impulse": (
            "reported impulses do not sum to the change of momentum",
            {"mass": 1.0, "gravity": 1.0, "linear_damping": None},
        ),
        "friction_impulse": ("reported friction is not that which brakes", {"friction": 1.0}),
        # No engine turns a body against its torque: signs of angles, spins or torques are mixed up.
        "turn": ("angles and spins have another sign than torques", {}),
    }
)
#: Largest ratio of a deviation in `RECORDED` to that which explains it: samples differ, and shares are of finite size.
ALIKE = 2.0

#: Quantities that depend on how a solver treats friction. Above `MOST_FRICTION` some solvers stop early, and bodies
#: sink into soft pyramids: unless a profile declares them, they are measured but not judged here; checks judge the
#: effect.
RUBBED = ("restitution", "friction", "friction_impulse")
#: Band of exact quantities, in roundings: 1e-12 in double precision.
ROUNDINGS = 1e-12 / 2.0**-52
#: Residual of friction in a profile's solver, as a share of the coefficient, unless it declares more: the tolerance of
#: a sliding box at 1/240 s (`validation.bounds.driven`, dt/100 s = 4e-5), rounded up.
FRICTION_SHARE = 1e-4
#: Residual of the sum of contact impulses by a solver's tolerance, as a share of the momentum change.
IMPULSE_SHARE = 1e-6
#: Band of a quantity that cannot be predicted: wider than any measured value, but finite.
UNTOLD = 1e9


@dataclass(frozen=True)
class Receipt:
    """One quantity: asked, declared, measured; NaN where the engine refused the probe, with its reason."""

    quantity: str
    asked: float
    declared: float
    band: float
    measured: float
    holds: bool
    because: str


@stage("property checks", whole=True)
def receipts(
    engine: Engine,
    profile: str,
    needs: Needs,
    dt: float,
    iterations: int | None = None,
    own: Sequence[Setting] | None = None,
) -> tuple[Receipt, ...]:
    """Measure what ``profile`` realises for a scene with ``needs``.

    With ``own`` settings instead of the profile's, nothing is declared, and measured values are compared with the
    scene's. Results of a probe are cached by engine, profile, settings, step and dimension, and with contact also by
    the pair's values.

    Raises
    ------
    EngineError
        For an unknown profile, or if the engine fails on a probe that it did not refuse.
    """
    settings = engine.settings(profile, needs, dt, iterations) if own is None else own
    values = tuple((setting.name, _frozen(setting.value)) for setting in settings)
    case = Case(
        needs.dimension,
        needs.restitution,
        needs.friction,
        dt,
        engine.scheme(profile).position_offset,
        engine.facts.epsilon,
    )
    names = tuple(name for name in PROBES if _applies(name, needs))
    declared = engine.declares(profile, needs, dt) if own is None else {}
    if not isinstance(declared, Mapping):
        raise EngineError(f"declares: {kind_of(declared)} was given, a table is needed")
    for quantity in declared:
        if quantity not in QUANTITIES:
            raise EngineError(f"declares: {engine.name}/{profile} declares {quantity!r}, no probe measures it")
    samples, silent = _measured(engine, profile, values, case, names)
    wanted = [q for q in QUANTITIES if any(q in PROBES[name].quantities for name in names)]
    slips = []
    for quantity in wanted:
        told = declared.get(quantity)
        if told is None:
            told = Declared(_asked(quantity, needs), *_default_band(quantity, case, declared))
        if iterations is not None:
            told = _starved(quantity, told, case, iterations, quantity in declared)
        slips.append(_receipt(quantity, _asked(quantity, needs), told, samples.get(quantity, ()), silent.get(quantity)))
    return tuple(slips)


def contradictions(slips: Sequence[Receipt]) -> list[str]:
    """Return why a measurement contradicts itself, a line for each property check that shows it.

    These are values that are no numbers, and failures of `RECORDED` that nothing explains which the engine realises
    otherwise.
    """
    failed = {slip.quantity: slip for slip in slips if not slip.holds}
    found = []
    for quantity, slip in failed.items():
        if math.isnan(slip.measured):
            found.append(f"{quantity} is not a number: {slip.because}")
        elif quantity in RECORDED:
            meaning, causes = RECORDED[quantity]
            if not any(_explains(failed[cause], slip, share) for cause, share in causes.items() if cause in failed):
                told = f"{quantity} is {slip.measured:.6g}, declared {slip.declared:.6g} +- {slip.band:.2g}"
                found.append(f"{meaning}: {told}")
    return found


def _explains(cause: Receipt, slip: Receipt, share: float | None) -> bool:
    """Whether a property that differs by as much as ``cause`` makes ``slip`` deviate as it does."""
    if share is None:
        return True
    off, made = slip.measured - slip.declared, share * (cause.measured - cause.declared)
    return off * made > 0.0 and abs(off) <= ALIKE * abs(made) + slip.band


def _applies(probe: str, needs: Needs) -> bool:
    """Restitution is measured where e > 0, friction where mu > 0."""
    if probe == "rebound":
        return needs.regime == "impact"
    return needs.friction > 0.0 if probe == "slide" else True


def _frozen(value: Any) -> Any:
    """Hashable equal of a setting's value."""
    if isinstance(value, list | tuple):
        return tuple(_frozen(item) for item in value)
    if isinstance(value, Mapping):
        raise EngineError("settings: a setting is a number, a word or a list of them, not a table")
    return value


def _measured(
    engine: Engine, profile: str, values: tuple[tuple[str, Any], ...], case: Case, names: tuple[str, ...]
) -> tuple[Samples, dict[str, tuple[str, bool]]]:
    """Samples by quantity; for quantities without samples the reason, and whether the engine refused."""
    samples: Samples = {}
    silent: dict[str, tuple[str, bool]] = {}
    for name in names:
        # Probes without contact do not depend on the pair: measured once for all pairs.
        probe, own = PROBES[name], case
        if not probe.touches:
            own = replace(own, restitution=0.0, friction=0.0)
        elif not probe.rubs:
            own = replace(own, friction=min(case.friction, MOST_FRICTION))
        found = _probe(engine, profile, values, own, name)
        if isinstance(found, dict):
            for quantity, numbers in found.items():
                samples[quantity] = samples.get(quantity, ()) + tuple(float(x) for x in numbers)
        else:
            silent.update((quantity, found) for quantity in PROBES[name].quantities)
    return samples, silent


@lru_cache(maxsize=4096)
def _probe(
    engine: Engine, profile: str, values: tuple[tuple[str, Any], ...], case: Case, name: str
) -> Samples | tuple[str, bool]:
    """Run one probe: its samples, or why there are none and whether the engine refused."""
    probe = PROBES[name]
    scene = probe.make(case)
    refusal = engine.refuses(posed_for(engine, scene), profile)
    if refusal:
        return f"probe {name} refused: {refusal}", True
    trajectory = run(engine, scene, case.dt, dict(values), probe.sampling(case, scene))
    if trajectory.finish == "diverged":
        return f"probe {name} diverged: {trajectory.reason}", False
    return probe.read(case, scene, trajectory)


def _receipt(
    quantity: str, asked: float, declared: Declared, samples: tuple[float, ...], silent: tuple[str, bool] | None
) -> Receipt:
    """Compare the sample farthest from the declared value with it; a quantity without samples has the reason."""
    if silent and not (silent[1] and samples):
        return Receipt(quantity, asked, declared.value, declared.band, math.nan, silent[1], silent[0])
    if not samples:
        why = "contact impulses are not reported at these settings"
        return Receipt(quantity, asked, declared.value, declared.band, math.nan, True, why)
    measured = max(samples, key=lambda x: math.inf if math.isnan(x) else abs(x - declared.value))
    holds = abs(measured - declared.value) <= declared.band
    return Receipt(quantity, asked, declared.value, declared.band, measured, holds, declared.because)


def _asked(quantity: str, needs: Needs) -> float:
    given = {"restitution": needs.restitution, "sampling": 0.0}
    given |= dict.fromkeys(("friction", "friction_impulse"), needs.friction)
    return given.get(quantity, 0.0 if quantity.endswith("damping") else 1.0)


def _default_band(quantity: str, case: Case, declared: Mapping[str, Declared]) -> tuple[float, str]:
    """Default band and its reason: round-off, the resolution of the probe, and declared drag."""
    if quantity == "turn":
        return 0.0, "a sign"
    if quantity in RUBBED and case.friction > MOST_FRICTION:
        return UNTOLD, "friction above 1 is not measured here, but by the checks"
    round_off = ROUNDINGS * case.epsilon
    if quantity == "size":
        # A speculative contact acts up to a step of approach and one of rebound early, others up to a step late.
        path = (1.0 + case.restitution) * LANDING_SPEED * case.dt
        return path / HALF_EXTENTS[0] + round_off, "one step of motion, and a predicted rebound"
    band, because = round_off, "exact up to round-off"
    if quantity == "impulse":
        band, because = (
            max(IMPULSE_SHARE, round_off),
            "reported impulses must sum to m dv, up to the solver's tolerance",
        )
    if quantity in ("friction", "friction_impulse"):
        band = (FRICTION_SHARE + _jolts(case)) * case.friction + round_off
        because = "a sliding box is solved to a share of 1e-4 of its friction"
        because += ", and the rounding of its position rebounds" if case.restitution > 0.0 else ""
    drag = _drag(quantity, case, declared)
    return (band + drag, f"{because}; and declared drag") if drag else (band, because)


def _jolts(case: Case) -> float:
    """Share of the load on a sliding box that rebounds carry, which have no friction in engines that add them last.

    The position of a corner is rounded by epsilon/2 of the box's height and half width. A stiff contact corrects that
    within a step of the engine's own, which is a speed; where e > 0 it rebounds, once in a step at most, with 1 + e
    times that. In double precision this is nothing; in single precision it is .2 % of a step of 1/240 s with four of
    the engine's own (e = 1).
    """
    if case.restitution <= 0.0:
        return 0.0
    own = case.dt * (abs(case.position_offset) or 1.0)
    speed = 0.5 * case.epsilon * (slide_height(case.friction) + SLIDE_WIDTH) / own
    return (1.0 + case.restitution) * speed / (slide_load(case.friction) * case.dt)


def _starved(quantity: str, told: Declared, case: Case, iterations: int, is_declared: bool) -> Declared:
    """Bands at an iteration count set by the user: a parameter is checked, not convergence.

    An iteration limits friction by the load found so far; the residual falls faster than 1/N with N iterations. In the
    first one there is no load yet: anything from no friction to a stop within the window is possible. The first and
    last step of the window may have friction without its load. Impulses sum to the momentum change at any count where
    they move the bodies; where a profile declares that only to its solver's tolerance, a solve that is cut off predicts
    nothing. With one iteration a body may stop a step of motion above the face, in addition to the step that any
    landing is allowed.
    """
    if quantity == "size" and iterations == 1:
        early = LANDING_SPEED * case.dt / HALF_EXTENTS[0]
        return Declared(told.value, told.band + early, f"{told.because}; with 1 iteration: a step of motion more")
    if quantity == "impulse" and is_declared:
        return Declared(told.value, UNTOLD, f"{told.because}; {iterations} iterations are set: no prediction")
    if quantity not in ("friction", "friction_impulse"):
        return told
    stop = slide_speed(case.friction) / (slide_load(case.friction) * SLIDE_TIME)
    band = case.friction / iterations if iterations > 1 else stop
    band += 2.0 * case.dt / SLIDE_TIME * case.friction
    because = f"{told.because}; {iterations} iterations are set, and a load may be off by 1/{iterations}"
    return Declared(told.value, told.band + band, because)


def _drag(quantity: str, case: Case, declared: Mapping[str, Declared]) -> float:
    """Largest effect of declared damping on a probe; drag may grow with the square of a speed above 1 m/s.

    Its effect on a slide is large and follows a law, so a profile with drag declares its friction itself.
    """
    which = "angular_damping" if quantity == "inertia" else "linear_damping"
    untouched = ("step", "linear_damping", "angular_damping", "restitution", "friction", "friction_impulse")
    if which not in declared or quantity in untouched:
        return 0.0
    rate = -math.log1p(-min(declared[which].value + declared[which].band, 0.99))
    if quantity == "impulse":
        return rate * (2.0 * LANDING_LEAD + 1.0) * case.dt
    window = STEPS * case.dt
    share = rate * window * max(1.0, GRAVITY * window)
    return STEPS * share if quantity == "sampling" else share
