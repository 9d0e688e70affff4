"""Rows: every engine x profile x scene x check, judged. All output is made from these."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from adapters.engine import EngineError
from adapters.scene import Scene
from adapters.stages import stage
from validation.canonical import Check
from validation.catalogue import CATALOGUE
from validation.cells import Observation, Outcome, Slot, checks_of, scene_of, slot_from_dict
from validation.files.distance import posed
from validation.files.invariants import LAWS
from validation.files.stated import STATED, instant_of
from validation.findings import Findings, FindingsError, Known, known_of
from validation.findings.files import brought_by_ours, findings_of
from validation.judging.predicting import Asked, cause_in_file, foretold, predictions
from validation.judging.studies import StudyResult, results, study_of
from validation.judging.verdicts import (
    NOT_JUDGED,
    Physics,
    Prediction,
    Standing,
    Verdict,
    judge,
    judge_divergence,
    judge_physics,
)
from validation.metrics import NEWER, UNTOLD
from validation.posed import is_file, is_model, resolve

if TYPE_CHECKING:
    import pandas as pd

#: Standings and outcomes that make the command exit 1.
ALARMING_STANDINGS = ("new", "drifted")
ALARMING_OUTCOMES = ("invalid", "crashed", "timed_out", "missing")
#: Reason of rows of a model, which have no standing.
OWN_MODEL = "not listed: your own model"
#: Reason of rows with settings of a user, which have none.
OWN_SETTINGS = "not listed: with settings of your own"
#: Short names of what property checks measure.
SYMBOLS = {"restitution": "e", "friction": "mu"}
#: What laws say about rows, asked ahead of the others.
Ready = Mapping[Asked, list[Prediction]]
#: Scenes from files with several motions: by what was asked, when they part [s], and what is said of them.
Several = Mapping[tuple[object, ...], tuple[float, str]]
#: Largest error of a run that is truth, as a share of the tolerance it is judged with.
TRUTH_SHARE = 0.1


@dataclass(frozen=True)
class Row:
    """One judged check of one cell (or of one study); JSON-ready. Field names are the public ones."""

    run: str
    engine: str
    engine_version: str
    profile: str
    scene: str
    dimension: int
    params: dict[str, float]
    dt: float
    iterations: int | None
    check: str
    metric: str
    unit: str
    value: float | None
    truth: float | None
    error: float | None
    tolerance: float | None
    because: str
    outcome: str
    physics: str | None
    standing: str | None
    reason: str
    state_hash: str
    steps: int
    wall_time_s: float
    source: str = ""
    log: str = ""
    initial_change: list[str] = field(default_factory=list)
    slot: dict[str, Any] = field(default_factory=dict)
    cells: list[str] = field(default_factory=list)
    floor: float | None = None
    certificate: str = ""
    #: 1 - error/error of the best null, and which null that is; see `validation.questions.nulls`, which fills them in.
    skill: float | None = None
    null: str = ""

    @property
    def alarming(self) -> bool:
        """Whether this row makes the command fail."""
        return is_alarming(vars(self))

    @property
    def failing(self) -> bool:
        """Whether this row makes a strict command fail: every row that ran without a PASS, listed or not."""
        return self.alarming or self.physics == Physics.FAIL.value or self.outcome in ALARMING_OUTCOMES

    def as_dict(self) -> dict[str, Any]:
        """Plain data; its lists and tables are not copied."""
        return dict(vars(self))


def is_alarming(row: Mapping[str, Any]) -> bool:
    """Whether a row, as plain data, makes the command fail.

    Alarms are cells that crash, time out or are missing, rows that should be listed and are not, values stated in a
    scene file, and catalogue scenes that an exact profile refuses (`_known` and `_verdict` give their standing). For
    models, and for engines without a list, neither INVALID nor FAIL is an alarm.
    """
    if row["outcome"] == Outcome.INVALID.value and not is_listed(row["engine"], row["scene"]):
        return False
    return row["standing"] in ALARMING_STANDINGS or row["outcome"] in ALARMING_OUTCOMES


def is_listed(engine: str, scene: str) -> bool:
    """Whether failures of an engine in a scene can be listed."""
    return not is_model(scene) and _findings(engine)[0] is not None


@stage("judging")
def rows_of(run: str, observations: Iterable[Observation], plan: Iterable[Slot] = ()) -> list[Row]:
    """Judge all checks of all observations, and their studies.

    Every slot of ``plan`` gets rows: a cell without observation is *missing*, which is an alarm. Cells with a moved
    start are not judged: they give the noise floor of the unmoved cell's row.
    """
    observations = list(observations)
    seen = {observation.slot for observation in observations}
    observations += [_missing(slot) for slot in plan if slot not in seen]
    judged = [(o, *checks_of(o)) for o in observations if not o.slot.ulp]
    ready = foretold([_asked(o, check) for o, _, checks in judged for check in checks if _is_asked(o, check)])
    several = _several(observations)
    rows = [_row(run, o, scene, check, ready, several) for o, scene, checks in judged for check in checks]
    return with_floors(rows, observations) + [_study_row(run, result) for result in results(observations)]


def in_order(rows: Iterable[Row], plan: Sequence[Slot]) -> list[Row]:
    """Rows of parts of a plan in the order of `rows_of` for all of it: cells, missing cells, studies."""
    cells, groups = {slot: k for k, slot in enumerate(plan)}, dict[Slot, int]()
    for k, slot in enumerate(plan):
        groups.setdefault(slot.with_params({}), k)
    studies = [(name, study.name) for name, canonical in CATALOGUE.items() for study in canonical.studies]

    def place(row: Row) -> tuple[int, int, int]:
        slot = slot_from_dict(row.slot)
        if (row.scene, row.metric) in studies:
            return 2, studies.index((row.scene, row.metric)), groups[slot]
        return row.outcome == Outcome.MISSING.value, 0, cells[slot]

    return sorted(rows, key=place)


def with_floors(rows: Iterable[Row], observations: Iterable[Observation]) -> list[Row]:
    """Judged rows with noise floors from cells with moved starts; studies have none."""
    moved: dict[Slot, list[Observation]] = defaultdict(list)
    for observation in observations:
        if observation.slot.ulp:
            moved[replace(observation.slot, ulp=0)].append(observation)
    if not moved:
        return list(rows)
    return [
        row if study_of(row.scene, row.metric) else replace(row, floor=_floor(row, moved[slot_from_dict(row.slot)]))
        for row in rows
    ]


def _missing(slot: Slot) -> Observation:
    """Observation for a planned cell without a result; it is shown, never stored."""
    return Observation(slot, "", 0, "", Outcome.MISSING, "the run has no observation of this planned case")


def _floor(row: Row, moved: Iterable[Observation]) -> float | None:
    """Largest change of a value when its start moves by some units in the last place; runs without answer excluded."""
    sound = [observation for observation in moved if observation.outcome not in (Outcome.INVALID, Outcome.REFUSED)]
    values = [observation.metrics.get(row.metric, (None, ""))[0] for observation in sound]
    changes = [_difference(value, row.value) for value in values]
    return max((abs(change) for change in changes if change is not None), default=None)


def _difference(value: float | None, other: float | None) -> float | None:
    """``value - other``; None where either is missing, or where the difference overflows."""
    if value is None or other is None or not math.isfinite(value - other):
        return None
    return value - other


def _several(observations: Iterable[Observation]) -> Several:
    """Scenes from files of which two motions obey the laws, with when they part [s] and what is said of them."""
    found: dict[tuple[object, ...], tuple[float, str]] = {}
    for observation in observations:
        full = observation.certificate.get("full", {})
        if is_file(observation.slot.scene) and full.get("lawful") and full.get("several"):
            told = (float(full.get("determined") or 0.0), str(full["unique"]))
            found[posed(observation.slot)] = min(told, found.get(posed(observation.slot), told))
    return found


def _is_left_open(observation: Observation, check: Check, value: float | None, several: Several) -> str:
    """Why a value that a file states is not judged: the run may follow another motion that obeys the laws.

    What it states is judged where a run agrees, and until the motions part.
    """
    if check.source != STATED or posed(observation.slot) not in several:
        return ""
    until, told = several[posed(observation.slot)]
    at = instant_of(check.metric)
    certificate = observation.certificate.get("full", {})
    runs = observation.outcome is Outcome.OK or (observation.outcome is Outcome.REFUSED and certificate.get("several"))
    if not runs or (at is not None and at <= until) or judge_physics(value, check) is not Physics.FAIL:
        return ""
    return f"{NOT_JUDGED}: {told}"


def _row(run: str, observation: Observation, scene: Scene, check: Check, ready: Ready, several: Several) -> Row:
    value, why = observation.metrics.get(check.metric, (None, NEWER))
    left_open = _is_left_open(observation, check, value, several)
    if left_open or _is_lawful(observation, check):
        observation = replace(observation, outcome=Outcome.OK, reason="")
    doubt = _doubt(observation, check)
    if doubt:
        observation = replace(observation, outcome=Outcome.REFUSED, reason=doubt)
    if value is None and why in UNTOLD and observation.outcome is Outcome.OK and not _is_found(observation, check):
        # A value that an engine does not report is no failure of its motion, unless it once reported it.
        observation = replace(observation, outcome=Outcome.UNSUPPORTED, reason=why)
    verdict = Verdict(None, None, left_open) if left_open else _verdict(observation, scene, check, value, why, ready)
    off = _not_as_asked(observation) if verdict.physics is Physics.FAIL else []
    own = observation.reason * (observation.outcome is Outcome.OK)
    texts = why if value is not None else "", own, verdict.reason, *off
    reason = "; ".join(dict.fromkeys(text for text in texts if text))
    return _assemble(run, observation, observation.slot, dict(scene.params), check, value, verdict, reason)


def _verdict(
    observation: Observation, scene: Scene, check: Check, value: float | None, why: str, ready: Ready
) -> Verdict:
    """Verdict of an observation; cells without a result have no physics, and unsupported ones must be listed."""
    slot, outcome = observation.slot, observation.outcome
    if outcome is Outcome.OK and check.metric not in observation.metrics:
        return Verdict(None, None, NEWER)
    if outcome is Outcome.OK:
        known, said = _known(observation, slot, check), []
        try:
            said = _predictions(observation, scene, check, ready)
        except EngineError as error:  # laws of another package fail: no predictions
            known = replace(known, remark="; ".join(filter(None, (known.remark, str(error)))))
        verdict = judge(value, check, said, known, why)
        return replace(verdict, reason=_cause(observation, scene, check, verdict) or verdict.reason)
    if outcome is Outcome.DIVERGED:
        return judge_divergence(_known(observation, slot, check), observation.reason)
    findings, _ = _findings(slot.engine)
    refused = outcome is Outcome.REFUSED or (outcome is Outcome.UNSUPPORTED and observation.reason not in UNTOLD)
    if refused and findings is not None and not is_file(slot.scene) and not slot.is_own:
        expected = outcome is Outcome.UNSUPPORTED and findings.unsupported_by(slot)
        return Verdict(None, Standing.KNOWN if expected else Standing.NEW, observation.reason)
    return Verdict(None, None, observation.reason)


def _cause(observation: Observation, scene: Scene, check: Check, verdict: Verdict) -> str:
    """The cause of a failure in a scene file, where a law of the engine as it is set predicts the value."""
    slot = observation.slot
    value = observation.metrics[check.metric][0]
    if verdict.physics is not Physics.FAIL or value is None or not is_file(slot.scene) or slot.switched:
        return ""
    if resolve(slot.scene).brought(slot.engine, slot.profile) is not None:
        return ""
    return cause_in_file(slot, observation.engine_version, check.metric, value, scene)


def _known(observation: Observation, slot: Slot, check: Check) -> Known:
    if check.source == STATED:  # stated by the file's author: neither a list nor a user's settings excuse it
        return Known(None, True)
    if slot.is_own:
        return Known(None, False, OWN_SETTINGS)
    if resolve(slot.scene).brought(slot.engine, slot.profile) is not None:
        return Known(None, False, "as soft as the model: the profile is the model's own, not the engine's")
    if is_model(slot.scene):  # its failures cannot be listed
        return Known(None, False, OWN_MODEL)
    findings, why_not = _findings(slot.engine)
    if why_not:
        return Known(None, False, why_not)
    return known_of(slot, check.metric, observation.engine_version, findings)


def _is_found(observation: Observation, check: Check) -> bool:
    """Whether a check of a catalogue scene is listed, with a value or without."""
    return not is_file(observation.slot.scene) and _known(observation, observation.slot, check).finding is not None


def _not_as_asked(observation: Observation) -> list[str]:
    """What the engine realises, beside what the scene has, where a property check does not hold."""
    off = [slip for slip in observation.receipts if not slip["holds"] and slip["measured"] is not None]
    return [
        f"realised {SYMBOLS.get(s['quantity'], s['quantity'])} = {s['measured']:.6g} of {s['asked']:.6g}"
        + (f" (declared {s['declared']:.6g})" if s["declared"] != s["asked"] else "")
        for s in off
    ]


def _findings(engine: str) -> tuple[Findings | None, str]:
    """Findings of an engine; where the files of another package are wrong, none and the reason."""
    try:
        return findings_of(engine), ""
    except FindingsError as error:
        if brought_by_ours(engine):
            raise
        return None, str(error)


def _is_lawful(observation: Observation, check: Check) -> bool:
    """Whether the certificate fails because the motion is not unique, while the check holds for every lawful motion.

    Where contacts can share a load in several ways there are many lawful motions, and the run is one of them: it is no
    truth for positions, but its energy and overlaps are judged like those of any engine. Before that time the motion is
    unique, for checks that end there.
    """
    if observation.outcome is not Outcome.REFUSED or not is_file(observation.slot.scene):
        return False
    full = observation.certificate.get("full", {})
    if not full.get("lawful") or not all(slip["holds"] for slip in observation.receipts):
        return False
    at = instant_of(check.metric)
    return check.metric in LAWS or (at is not None and at <= (full.get("determined") or 0.0))


def _doubt(observation: Observation, check: Check) -> str:
    """Why a certified run cannot be the truth of this check: its error is not small against the tolerance."""
    errors = observation.certificate.get("metric_errors")
    if observation.outcome is not Outcome.OK or errors is None or check.bound is None:
        return ""
    error, most = errors.get(check.metric, 0.0), TRUTH_SHARE * check.bound
    if error is not None and error <= most:
        return ""
    known = "infinite" if error is None else f"{error:.3g}"
    return f"its error is {known}; a truth has at most {most:.3g}, a tenth of the tolerance"


def _certificate(observation: Observation, check: Check) -> str:
    """Which certificate ran, and the certified error of the value."""
    found = observation.certificate
    if "certified" not in found:
        return ""
    if "full" not in found:
        return "light"
    error, unique = found.get("metric_errors", {}).get(check.metric), found["full"].get("unique", "")
    told = "full" if error is None else f"full, to {error:.2g} {check.unit}".rstrip()
    return f"{told}; {unique}" if unique else told


def _is_asked(observation: Observation, check: Check) -> bool:
    """Whether contact laws apply to a row: a FAIL of a catalogue cell.

    A file with the name of a scene is another scene, and laws hold for settings of profiles only. At iteration counts
    set by the user only laws apply that model the iterations.
    """
    if observation.outcome is not Outcome.OK or is_file(observation.slot.scene) or observation.slot.switched:
        return False
    return judge_physics(observation.metrics.get(check.metric, (None, ""))[0], check) is Physics.FAIL


def _asked(observation: Observation, check: Check) -> Asked:
    return observation.slot, observation.engine_version, check.metric


def _predictions(observation: Observation, scene: Scene, check: Check, ready: Ready) -> list[Prediction]:
    """Predictions for a FAIL, made now if not available."""
    if not _is_asked(observation, check):
        return []
    asked = _asked(observation, check)
    return ready[asked] if asked in ready else predictions(*asked, scene)


def predictions_of(row: Row) -> list[Prediction]:
    """Predictions of contact laws for a failing row, right or wrong; none for a study."""
    if row.physics != Physics.FAIL.value or len(row.cells) > 1 or is_file(row.scene):
        return []
    slot = slot_from_dict(row.slot)
    if slot.switched:
        return []
    scene = scene_of(slot)
    try:
        return predictions(slot, row.engine_version, row.metric, scene)
    except EngineError:  # laws of another package; their row has the error
        return []


def _assemble(
    run: str,
    observation: Observation,
    slot: Slot,
    params: dict[str, float],
    check: Check,
    value: float | None,
    verdict: Verdict,
    reason: str,
) -> Row:
    return Row(
        run=run,
        engine=slot.engine,
        engine_version=observation.engine_version,
        profile=slot.profile,
        scene=slot.scene,
        dimension=slot.dimension,
        params=params,
        dt=slot.dt,
        iterations=slot.iterations,
        check=f"{slot.scene}/{check.metric}",
        metric=check.metric,
        unit=check.unit,
        value=value,
        truth=check.truth,
        error=_difference(value, check.truth),
        tolerance=check.bound,
        because=check.because,
        outcome=observation.outcome.value,
        physics=verdict.physics.value if verdict.physics else None,
        standing=verdict.standing.value if verdict.standing else None,
        reason=reason,
        state_hash=observation.state_hash,
        steps=observation.steps,
        wall_time_s=observation.wall_time_s,
        source=check.source,
        log=observation.log,
        initial_change=list(observation.initial_change),
        slot=slot.as_dict(),
        cells=[observation.cell],
        certificate=_certificate(observation, check),
    )


def _study_row(run: str, result: StudyResult) -> Row:
    """Judge a study like an observation; its row lists its cells."""
    slot, check = result.slot, result.check
    verdict = judge(result.value, check, (), _known(result.observation, slot, check), result.reason)
    said = result.reason if result.value is not None else ""
    reason = "; ".join(text for text in (said, verdict.reason) if text)
    row = _assemble(run, result.observation, slot, {}, check, result.value, verdict, reason)
    return replace(row, cells=list(result.cells), state_hash="", steps=0, wall_time_s=0.0)


def frame(rows: Sequence[Row]) -> pd.DataFrame:
    """Rows as a DataFrame, one column per field, parameters as ``param.<name>`` columns as well."""
    import pandas as pd

    plain = [row.as_dict() for row in rows]
    table = pd.DataFrame(plain, columns=list(Row.__dataclass_fields__))
    params = pd.json_normalize([row["params"] for row in plain]).add_prefix("param.")
    params.index = table.index
    return pd.concat([table, params], axis=1)
