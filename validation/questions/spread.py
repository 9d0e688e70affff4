"""Distance of engines on a scene without closed form, at the horizon of predictability.

    horizon    time until which a disturbance in the last place stays small, from the certified
               run of our own solver; at most the end of the run
    spread     largest distance of a free body's centre from its place in that run, at the horizon [m]

Beyond the horizon two correct engines differ; before it they must not. Distances are from recordings, whose positions
are rounded to 1/32767 of half their range; smaller distances count as 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from adapters.registry import profile_of, solver
from validation.cells import Observation, Outcome, Slot
from validation.posed import resolve
from validation.running.tracks import Recording


@dataclass(frozen=True)
class Spread:
    """One engine and profile beside the certified run; ``distance`` [m] of ``body`` at ``time`` [s].

    ``unique`` says from when ``several`` motions obey the laws, or that this was not searched; it is empty if one does.
    """

    scene: str
    dimension: int
    engine: str
    profile: str
    time: float
    body: str
    distance: float
    certified: bool
    unique: str = ""
    several: bool = False

    def as_dict(self) -> dict[str, Any]:
        """Plain data."""
        return asdict(self)


def spreads(observations: Sequence[Observation], recordings: Sequence[tuple[Slot, Recording]]) -> list[Spread]:
    """Distance of every recorded run from our solver's on the same scene; none where that did not run."""
    kept, found = dict(recordings), {observation.slot: observation for observation in observations}
    ours = (solver(), profile_of(solver(), "solution"))
    told = []
    for slot, recording in kept.items():
        partner = next((s for s in kept if (s.engine, s.profile) == ours and _posed(s) == _posed(slot)), None)
        if partner is None or partner == slot or slot not in found or found[slot].outcome is not Outcome.OK:
            continue
        time = _horizon(found[partner], kept[partner])
        body, distance = _apart(slot, recording, kept[partner], time)
        said = found[partner].certificate
        certified, full = bool(said.get("certified")), said.get("full", {})
        unique, several = str(full.get("unique", "")), bool(full.get("several"))
        who = slot.scene, slot.dimension, slot.engine, slot.profile
        told.append(Spread(*who, time, body, distance, certified, unique, several))
    return told


def _posed(slot: Slot) -> tuple[Any, ...]:
    return slot.scene, slot.params, slot.dimension


def _horizon(observation: Observation, recording: Recording) -> float:
    """Horizon of predictability [s]."""
    said = observation.certificate.get("full", {}).get("horizon")
    end = float(recording.t[-1])
    return min(end, float(said)) if isinstance(said, int | float) else end


def _apart(slot: Slot, recording: Recording, partner: Recording, time: float) -> tuple[str, float]:
    """The free body that is farthest from its place in ``partner`` at ``time``, and how far [m]."""
    scene = resolve(slot.scene).scene(slot.dimension, dict(slot.params))
    free = [i for i, body in enumerate(scene.bodies) if body.motion == "free"]
    places = [_at(each, time, scene.dimension)[free] for each in (recording, partner)]
    distances = np.linalg.norm(places[0] - places[1], axis=1)
    worst = int(distances.argmax())
    return scene.bodies[free[worst]].name, float(distances[worst])


def _at(recording: Recording, time: float, dimension: int) -> np.ndarray:
    """Centres at ``time``, between two frames in proportion, (n, d) [m]."""
    k = int(np.clip(np.searchsorted(recording.t, time), 1, len(recording.t) - 1))
    before, after = recording.t[k - 1], recording.t[k]
    share = float(np.clip((time - before) / (after - before), 0.0, 1.0))
    places: np.ndarray = recording.pose[:, :, :dimension]
    return np.asarray((1.0 - share) * places[k - 1] + share * places[k])
