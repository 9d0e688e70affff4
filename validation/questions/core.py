"""The core suite: scenes that every solver of rigid contact solves, judged by bound and by order alone.

    bound    at each step of `DTS` every check of every case is within its tolerance
    order    the declared error of the scene is round-off at every step, or falls as fast as the scene states

The cases are those of the scene's declared error (`validation.canonical.Primary`): phases, both sides of a threshold.
Laws and lists of known failures play no part.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from adapters.engine import EngineFacts
from validation.bounds import ROUND_OFF
from validation.canonical import Primary, halves
from validation.catalogue import CATALOGUE
from validation.cells import Observation, Outcome, Slot, format_dt, slot_from_dict
from validation.judging.rows import Row, rows_of
from validation.questions.convergence import Limit, declared_errors, limit_of

#: Steps [s]: an octave apart, from that of games to that of a careful simulation.
DTS = halves(60.0, 480.0)
#: An order that is nearer to the next lower one is that one.
SLACK = 0.5


@dataclass(frozen=True)
class Line:
    """Result of one scene on one profile.

    Parameters
    ----------
    errors
        Declared error at each of `DTS`; NaN where a case has none.
    wanted
        Order that the scene states; 0: round-off at every step.
    order
        Measured order; None where the errors are round-off, or no line fits.
    wrong
        What is wrong, in lines; empty if the scene passes.
    refused
        Why the engine does not run the scene; empty if it does.
    """

    scene: str
    dimension: int
    profile: str
    errors: tuple[float, ...]
    wanted: int
    order: float | None
    wrong: tuple[str, ...]
    refused: str = ""


def core() -> dict[str, Primary]:
    """Declared errors of the scenes of the suite."""
    return {
        name: scene.primary for name, scene in CATALOGUE.items() if scene.primary and scene.primary.order is not None
    }


def slots_of(scene: str, engine: EngineFacts, name: str, profile: str) -> list[Slot]:
    """Cases of one scene, in the first dimension that it and the engine share."""
    canonical, primary = CATALOGUE[scene], core()[scene]
    dimension = min(engine.dimensions & set(canonical.dimensions), default=canonical.dimensions[0])
    cases = ((dt, canonical.minimal(params)) for dt in DTS for params in primary.variations(dt))
    return list(dict.fromkeys(Slot(scene, params, dimension, name, profile, dt) for dt, params in cases))


def judged(engine: EngineFacts, observations: Sequence[Observation]) -> Line:
    """Result from the observations of `slots_of`."""
    first = observations[0].slot
    primary = core()[first.scene]
    assert primary.order is not None
    found = next(iter(declared_errors(observations).values()), {})
    errors = tuple(found.get((dt, None), math.nan) for dt in DTS)
    line = first.scene, first.dimension, first.profile, errors, primary.order
    if refused := [each.reason for each in observations if each.outcome is Outcome.UNSUPPORTED]:
        return Line(*line, None, (), refused[0])
    floor = max(ROUND_OFF, 0.0 if engine.precision == "double" else engine.round_off)
    wrong = _beyond(rows_of("", list(observations)), {each.slot: each for each in observations}, floor)
    order = None
    if all(map(math.isfinite, errors)):
        fit, limit, because = limit_of(DTS, errors, floor)
        order = fit.order if fit else None
        if primary.order == 0 and max(errors) > floor:
            wrong.append(f"order: {because}; round-off is expected at every step")
        elif limit is not Limit.TRUTH or (order is not None and order < primary.order - SLACK):
            wrong.append(f"order: {because}; at least order {primary.order} is expected")
    return Line(*line, order, tuple(wrong))


def _beyond(rows: Iterable[Row], seen: Mapping[Slot, Observation], floor: float) -> list[str]:
    """The worst case of each check that is out of bounds or has no value, and how many others there are."""
    worst: dict[str, tuple[float, str]] = {}
    counts: Counter[str] = Counter()
    for row in rows:
        if row.tolerance is None and row.outcome == Outcome.OK.value:
            continue
        where = f"at dt = {format_dt(row.dt)} s" + "".join(
            f", {name}={value:g}" for name, value in row.slot.get("params", {}).items()
        )
        if row.outcome != Outcome.OK.value:
            name, far, said = row.outcome, math.inf, _why(row, seen)
        elif row.value is None or row.truth is None or row.tolerance is None:
            name, far, said = row.metric, math.inf, _why(row, seen)
        else:
            bound = max(row.tolerance, floor * max(1.0, abs(row.truth)) if floor > ROUND_OFF else 0.0)
            off = abs(row.value - row.truth)
            far = off / bound if bound else math.inf if off else 0.0
            name, said = (
                row.metric,
                f"{row.value:.8g}, truth {row.truth:.8g} +- {bound:.2g} {row.unit}".removesuffix(" 1"),
            )
            if far <= 1.0:
                continue
        counts[name] += 1
        if not far < worst.get(name, (0.0, ""))[0]:  # NaN too
            worst[name] = far, f"{name}: {said} {where}"
    return [
        f"{said}" + (f", and {counts[name] - 1} more" if counts[name] > 1 else "") for name, (_, said) in worst.items()
    ]


def _why(row: Row, seen: Mapping[Slot, Observation]) -> str:
    """Why there is no value, as the case says; a row's reason tells of lists of known failures as well."""
    own = seen.get(slot_from_dict(row.slot))
    if own is None or row.outcome != own.outcome.value:  # of a study, or judged as another outcome
        return row.reason
    return own.reason if own.outcome is not Outcome.OK else own.metrics.get(row.metric, (None, ""))[1] or row.reason
