"""Studies: what several cells say together (thresholds, suprema); judged like an observation."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass

from validation.canonical import Check
from validation.cells import Observation, Outcome, Slot
from validation.posed import resolve
from validation.scenes.incline import exact


@dataclass(frozen=True)
class StudyResult:
    """One judged number of one study for one engine, profile, dimension and step."""

    slot: Slot
    observation: Observation
    check: Check
    value: float | None
    reason: str
    cells: tuple[str, ...]


@dataclass(frozen=True)
class Study:
    """A reduction of the observations of one scene.

    Parameters
    ----------
    name, scene
        Its metric's name and the scene whose cells it reads.
    reduce
        ``reduce(observations) -> (value, reason, check)`` or None if the cells do not allow it.
    """

    name: str
    scene: str
    reduce: Callable[[Sequence[Observation]], tuple[float | None, str, Check] | None]

    def results(self, observations: Iterable[Observation]) -> Iterator[StudyResult]:
        """Reduce every group of cells that differ in parameters only."""
        groups: dict[Slot, list[Observation]] = defaultdict(list)
        for observation in observations:
            if observation.slot.scene == self.scene and not observation.slot.ulp:
                groups[observation.slot.with_params({})].append(observation)
        for slot, members in groups.items():
            good = [member for member in members if member.outcome is Outcome.OK]
            reduced = self.reduce(good)
            if reduced is not None:
                value, reason, check = reduced
                cells = tuple(member.cell for member in good)
                yield StudyResult(slot, good[0], check, value, reason, cells)


def _slides(observation: Observation) -> bool:
    """Whether the box accelerates like a sliding one rather than creeping like a sticking one.

    It slides if its acceleration is more than half of what Coulomb's law gives at the same distance beyond the
    threshold: a slow creep, however wrong, does not accelerate.
    """
    canonical = resolve(observation.slot.scene)
    params = canonical.complete(dict(observation.slot.params))
    distance = abs(params["ratio"] - 1.0)
    beyond = canonical.scene(observation.slot.dimension, {**params, "ratio": 1.0 + distance})
    acceleration = observation.metrics["acceleration"][0]
    return acceleration is not None and acceleration > 0.5 * exact(beyond)["acceleration"]


def _threshold(observations: Sequence[Observation]) -> tuple[float | None, str, Check] | None:
    """Middle of the bracket [largest ratio that sticks, smallest that slides], and half its width as bound."""
    canonical = resolve("incline")
    measured = [o for o in observations if o.metrics.get("acceleration", (None, ""))[0] is not None]
    ratios = [(canonical.complete(dict(o.slot.params))["ratio"], _slides(o)) for o in measured]
    below = [ratio for ratio, _ in ratios if ratio < 1.0]
    above = [ratio for ratio, _ in ratios if ratio > 1.0]
    if not below or not above:
        return None
    sliding = [ratio for ratio, slides in ratios if slides]
    low = max((ratio for ratio, slides in ratios if not slides and ratio < min(sliding, default=2e9)), default=None)
    bound = 0.5 * (min(above) - max(below))
    because = f"half the distance between the ratios tried next to 1, {max(below):g} and {min(above):g}"
    check = Check("threshold", "1", 1.0, bound, because, "Coulomb's law: sticks iff tan(theta) <= mu")
    if not sliding or low is None:
        return (
            (max(above) if not sliding else min(below)),
            "it never slides" if not sliding else "it never sticks",
            check,
        )
    return 0.5 * (low + min(sliding)), f"sticks at {low:g}, slides at {min(sliding):g}", check


STUDIES = (Study("threshold", "incline", _threshold),)
