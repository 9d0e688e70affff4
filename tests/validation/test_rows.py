"""A row says all that its cell was asked, what came out, and why it is judged as it is."""

import math
from dataclasses import replace

import pytest

from adapters.engine import EngineError
from adapters.law import Deviation
from reports.exports import as_junit, as_markdown
from reports.findings import alarms
from reports.wording import mark_of
from validation.catalogue import CATALOGUE
from validation.cells import Observation, Outcome, Slot
from validation.findings import FindingsError
from validation.judging import predicting, rows
from validation.judging.comparison import Kind, compare_rows
from validation.judging.rows import Row, frame, predictions_of, rows_of
from validation.metrics import NEWER, UNTOLD
from validation.posed import pinned, written
from validation.running.execution import UNMEASURED, execute

#: A box below the edge of the friction cone: one check, its creep.
SLOT = Slot("incline", (("ratio", 0.99),), 3, "nameless", "soft", 1 / 240, 7)
OWN = replace(SLOT, iterations=None)
CHECK = CATALOGUE["incline"].checks(CATALOGUE["incline"].scene(3, {"ratio": 0.99}), 1 / 240)[0]
SEEN = Observation(
    SLOT, "c0ffee", 1, "1.2", Outcome.OK, "", {"creep": (0.5, "read late"), "acceleration": (2.0, "")}, "5ta7e", 480,
    0.25, initial_change=("box lowered",), log="its words",
)  # fmt: skip


def judged(observation=SEEN, **changes):
    (row,) = rows_of("run1", [replace(observation, **changes)])
    return row


def test_a_row_says_its_cell_field_by_field():
    params = {p.name: p.default for p in CATALOGUE["incline"].parameters} | {"ratio": 0.99}
    assert judged() == Row(
        run="run1", engine="nameless", engine_version="1.2", profile="soft", scene="incline", dimension=3,
        params=params, dt=1 / 240, iterations=7, check="incline/creep", metric="creep", unit="m/s", value=0.5,
        truth=0.0, error=0.5, tolerance=CHECK.bound, because=CHECK.because, outcome="ok", physics="fail",
        standing=None, reason="read late; the engine has no list of findings", state_hash="5ta7e", steps=480,
        wall_time_s=0.25, source=CHECK.source, log="its words", initial_change=["box lowered"], slot=SLOT.as_dict(),
        cells=["c0ffee"], floor=None, certificate="",
    )  # fmt: skip


def test_a_row_as_plain_data_has_every_field():
    plain = judged().as_dict()
    assert list(plain) == list(Row.__dataclass_fields__)
    assert Row(**plain) == judged()


def test_metric_reason_before_the_verdict_reason():
    assert judged(metrics={"creep": (0.0, "")}).reason == ""
    assert judged(metrics={"creep": (0.0, "read late")}).reason == "read late"
    assert judged(metrics={"creep": (0.5, "the engine has no list of findings")}).reason == (
        "the engine has no list of findings"
    )
    assert judged(metrics={"creep": (None, "it never touched")}).reason == "the engine has no list of findings"
    assert judged(metrics={}).value is None
    assert judged(metrics={"creep": (0.0, "")}, reason="alone it runs").reason == "alone it runs"


def test_own_model_without_engine_laws_or_list(monkeypatch):
    class Brought:
        def brought(self, engine, profile):
            return "its softness" if (engine, profile) == ("nameless", "soft") else None

    real = rows.resolve
    monkeypatch.setattr(rows, "resolve", lambda scene: Brought() if scene == "incline" else real(scene))
    why = "as soft as the model: the profile is the model's own, not the engine's"
    assert rows._known(SEEN, SLOT, CHECK) == rows.Known(None, False, why)


def test_reason_of_a_missing_value_of_a_listed_engine(monkeypatch):
    monkeypatch.setattr(rows, "known_of", lambda *asked: rows.Known(None, True))
    monkeypatch.setattr(rows, "findings_of", lambda engine: None)
    said = "has no value; not on record; it never touched"
    assert judged(metrics={"creep": (None, "it never touched")}).reason == said
    missed = judged(metrics={"creep": (None, UNMEASURED)})
    assert missed.alarming and missed.reason.endswith("; it was not measured")


def test_check_newer_than_a_stored_run_not_judged(monkeypatch):
    monkeypatch.setattr(rows, "known_of", lambda *asked: rows.Known(None, True))
    monkeypatch.setattr(rows, "findings_of", lambda engine: None)
    newer = judged(metrics={"another": (0.5, "")})
    assert (newer.value, newer.physics, newer.standing, newer.reason) == (None, None, None, NEWER)
    assert not newer.alarming and not newer.failing and mark_of(newer.as_dict()) == "none"
    seen = judged(metrics={"creep": (0.5, "")})
    (change,) = compare_rows([newer.as_dict()], [seen.as_dict()])  # neither better nor worse
    assert (change.kind, change.regressed) == (Kind.ADDED, False)
    assert compare_rows([newer.as_dict()], [newer.as_dict()]) == []


@pytest.mark.parametrize("outcome", ["not_installed", "crashed", "timed_out", "invalid"])
def test_row_without_an_answer(outcome):
    row = judged(outcome=Outcome(outcome), reason="it is so", metrics={})
    assert (row.outcome, row.physics, row.standing, row.reason) == (outcome, None, None, "it is so")


def test_unsupported_and_diverged_cells_say_why():
    assert judged(outcome=Outcome.UNSUPPORTED, reason="only planar", metrics={}).reason == "only planar"
    row = judged(outcome=Outcome.DIVERGED, reason="not finite after 3 steps", metrics={})
    assert (row.physics, row.reason) == ("fail", "not finite after 3 steps; the engine has no list of findings")


def test_reason_of_an_unsupported_cell(monkeypatch):
    class Listed:
        def unsupported_by(self, slot):
            return None

    monkeypatch.setattr(rows, "findings_of", lambda engine: Listed())
    row = judged(outcome=Outcome.UNSUPPORTED, reason="only planar", metrics={})
    assert (row.standing, row.reason) == ("new", "only planar")


def test_missing_cell_without_empty_fields():
    (row,) = rows_of("run1", [], [SLOT])
    said = "the run has no observation of this planned case"
    assert (row.run, row.outcome, row.engine_version, row.cells, row.reason) == ("run1", "missing", "", [""], said)
    assert (row.value, row.steps, row.physics, row.standing, row.alarming) == (None, 0, None, None, True)
    assert [row.outcome for row in rows_of("run1", [SEEN], [SLOT])] == ["ok"]
    assert rows._missing(SLOT) == Observation(SLOT, "", 0, "", Outcome.MISSING, said)


# ---- what moves by itself ------------------------------------------------------------------------------------------


def moved(ulp, value, outcome=Outcome.OK):
    return replace(SEEN, slot=replace(SLOT, ulp=ulp), outcome=outcome, metrics={"creep": (value, "")} if value else {})


@pytest.mark.parametrize(
    ("others", "floor"),
    [
        ([], None),
        ([moved(1, 0.5)], 0.0),
        ([moved(1, 0.625), moved(2, 0.25)], 0.25),
        ([moved(1, 0.625), moved(2, None)], 0.125),
        ([moved(1, None)], None),
        ([moved(1, 0.625), moved(2, 9.0, Outcome.INVALID)], 0.125),
        ([moved(1, math.inf), moved(2, 0.625)], 0.125),
        ([replace(moved(1, 9.0), slot=replace(OWN, ulp=1))], None),  # of another cell
    ],
)
def test_floor_of_a_value(others, floor):
    (row,) = rows_of("run1", [SEEN, *others])
    assert row.floor == floor


@pytest.mark.parametrize(
    ("value", "other", "found"),
    [(0.75, 0.5, 0.25), (None, 0.5, None), (0.5, None, None), (1e308, -1e308, None), (1e308, 1e308, 0.0)],
)
def test_difference_with_a_nan_as_missing(value, other, found):
    assert rows._difference(value, other) == found


# ---- certificates --------------------------------------------------------------------------------------------------

MOST = 0.1 * CHECK.bound


@pytest.mark.parametrize(
    ("certificate", "shown"),
    [
        ({}, ""),
        ({"kernel": "blocks"}, ""),
        ({"certified": True}, "light"),
        ({"certified": True, "full": {}}, "full"),
        ({"certified": True, "full": {}, "metric_errors": {"acceleration": 1e-9}}, "full"),
        ({"certified": True, "full": {}, "metric_errors": {"creep": 1.234e-9}}, "full, to 1.2e-09 m/s"),
    ],
)
def test_certificate_and_exactness_of_a_row(certificate, shown):
    assert judged(certificate=certificate).certificate == shown


def test_text_of_an_empty_unit():
    observation = replace(SEEN, certificate={"certified": True, "full": {}, "metric_errors": {"m": 0.25}})
    assert rows._certificate(observation, replace(CHECK, metric="m", unit="")) == "full, to 0.25"


@pytest.mark.parametrize(
    ("error", "outcome", "said"),
    [
        (0.0, "ok", ""),
        (MOST, "ok", ""),
        (math.nextafter(MOST, 1.0), "refused", f"{MOST:.3g}"),
        (0.25, "refused", "0.25"),
        (None, "refused", "infinite"),
    ],
)
def test_reference_run_with_too_large_a_step_error(error, outcome, said):
    row = judged(metrics={"creep": (0.0, "")}, certificate={"metric_errors": {"creep": error}})
    wanted = f"its error is {said}; a truth has at most {MOST:.3g}, a tenth of the tolerance" if said else ""
    assert (row.outcome, row.reason) == (outcome, wanted)
    assert row.physics == ("pass" if outcome == "ok" else None)
    assert (row.value, row.cells) == (0.0, ["c0ffee"])  # what was measured stays to be seen


def test_truth_kept_despite_errors_of_other_metrics():
    sound = {"metrics": {"creep": (0.0, "")}}
    assert judged(**sound, certificate={"metric_errors": {"acceleration": 9.0}}).outcome == "ok"
    bad = {"metric_errors": {"creep": 9.0}}
    row = judged(outcome=Outcome.CRASHED, reason="gone", metrics={}, certificate=bad)
    assert (row.outcome, row.reason) == ("crashed", "gone")
    observation = replace(SEEN, certificate=bad)
    assert rows._doubt(observation, replace(CHECK, bound=None)) == ""  # shown and not judged


# ---- laws and lists ------------------------------------------------------------------------------------------------


@pytest.fixture
def law(monkeypatch):
    """One law of the engine, that speaks of exactly this row; it predicts ``centre`` and remembers what it got."""
    given = []

    def predict(scene, dt, measure):
        given.append((scene.name, scene.dimension, scene.params["ratio"], dt, measure))
        return 0.5, 1e-3

    own = Deviation("nameless", ("soft",), "incline", "creep", predict, "it is soft", "its manual", ("1.2",))
    monkeypatch.setattr(predicting, "covering", lambda *row: [own] if own.covers(*row) else [])
    return given


GIVEN = [("incline", 3, 0.99, 1 / 240, CATALOGUE["incline"].measure)]


def test_row_explained_by_a_law(law):
    row = judged(slot=OWN)
    assert row.standing == "explained" and "it is soft" in row.reason
    assert law == GIVEN


def test_rows_without_a_law(law):
    judged(slot=OWN, metrics={"creep": (0.0, "")})
    judged(slot=SLOT)
    judged(slot=replace(OWN, profile="other"))
    assert law == []


def test_predictions_of_any_row(law):
    row = replace(judged(slot=OWN), standing="known")
    law.clear()
    ((_, centre, band),) = predictions_of(row)
    assert (centre, band) == (0.5, 1e-3)
    assert law == GIVEN
    asked = {**row.slot, "iterations": 7}
    for other in (replace(row, physics="pass"), replace(row, iterations=7, slot=asked), replace(row, cells=["a", "b"]),
                  replace(row, engine_version="1.3"), replace(row, slot={**row.slot, "engine": "other"}),
                  replace(row, slot={**row.slot, "profile": "hard"}), replace(row, metric="acceleration")):  # fmt: skip
        assert predictions_of(other) == []


def test_file_with_the_name_of_a_scene(law, monkeypatch):
    listed = judged(slot=OWN)
    law.clear()
    monkeypatch.setattr(rows, "is_file", lambda scene: scene == "incline")
    row = judged(slot=OWN)
    assert (row.physics, row.standing, law) == ("fail", None, [])
    assert listed.standing == "explained" and predictions_of(listed) == [] and law == []


@pytest.mark.parametrize(
    ("outcome", "alarming"), [(Outcome.OK, False), (Outcome.INVALID, False), (Outcome.CRASHED, True)]
)
def test_own_model_without_list_and_alarm_for_lost_cells(monkeypatch, outcome, alarming):
    monkeypatch.setattr(rows, "is_model", lambda scene: scene == "incline")
    row = judged(slot=OWN, outcome=outcome, reason="so")
    assert (row.standing, row.alarming, row.failing) == (None, alarming, True)
    assert outcome is not Outcome.OK or row.reason.endswith("not listed: your own model")


def test_verdict_without_laws(monkeypatch):
    def gone(*row):
        raise EngineError("nameless: its laws cannot be loaded: no such file")

    monkeypatch.setattr(predicting, "covering", gone)
    row = judged(slot=OWN)
    said = "read late; the engine has no list of findings; nameless: its laws cannot be loaded: no such file"
    assert (row.physics, row.reason) == ("fail", said)
    assert predictions_of(row) == []


@pytest.mark.parametrize("outcome", [Outcome.OK, Outcome.UNSUPPORTED])
def test_wrong_findings_of_an_outside_package(monkeypatch, outcome):
    def wrong(engine):
        raise FindingsError(f"{engine}: families.toml: no such field")

    monkeypatch.setattr(rows, "findings_of", wrong)
    row = judged(slot=OWN, outcome=outcome, reason="only planar" if outcome is Outcome.UNSUPPORTED else "")
    assert (row.standing, row.alarming) == (None, False)
    said = "read late; nameless: families.toml: no such field" if outcome is Outcome.OK else "read late; only planar"
    assert row.reason == said
    with pytest.raises(FindingsError):  # our own are a mistake of ours
        judged(slot=replace(OWN, engine="mujoco"), outcome=outcome)


# ---- what several cells say together -------------------------------------------------------------------------------


def inclines(*slides):
    """One observation per (ratio, slides) at the profile's own settings, then the row of their threshold."""
    observations = []
    for k, (ratio, does) in enumerate(slides):
        slot = replace(OWN, params=(("ratio", ratio),))
        metrics = {"creep": (0.0, ""), "acceleration": (9.0 if does else 0.0, "")}
        observations.append(replace(SEEN, slot=slot, cell=f"cell{k}", metrics=metrics))
    return rows_of("run1", observations)[-1]


def test_row_of_a_study():
    row = inclines((0.9, False), (0.99, False), (1.01, True), (1.1, True))
    assert (row.run, row.metric, row.unit, row.value, row.truth) == ("run1", "threshold", "1", 1.0, 1.0)
    assert (row.physics, row.reason) == ("pass", "sticks at 0.99, slides at 1.01")
    assert (row.cells, row.params) == (["cell0", "cell1", "cell2", "cell3"], {})
    assert (row.state_hash, row.steps, row.wall_time_s, row.floor) == ("", 0, 0.0, None)
    assert row.slot == replace(OWN, params=()).as_dict()
    assert not predictions_of(replace(row, physics="fail"))


def test_floor_of_a_study():
    """What several cells say together is none of their values, not even of the one that it is told under."""
    sets = ((), (("ratio", 0.9),), (("ratio", 1.01),), (("ratio", 1.1),))
    slots = [Slot("incline", params, 2, "nameless", "default", 1 / 240) for params in sets]
    metrics = {"creep": (0.0, ""), "acceleration": (0.5, ""), "threshold": (9.0, "")}
    cells = [Observation(slot, "c", 1, "1", Outcome.OK, metrics=metrics) for slot in slots]
    moved = [replace(cell, slot=replace(cell.slot, ulp=1), metrics=metrics | {"creep": (0.25, "")}) for cell in cells]
    floors = {(row.metric, row.floor) for row in rows.with_floors(rows_of("run", cells), moved)}
    assert floors == {("threshold", None), ("creep", 0.25), ("acceleration", 0.0)}


def test_failing_study():
    row = inclines((0.9, True), (0.99, True), (1.01, True))
    assert (row.physics, row.value) == ("fail", 0.9)
    assert row.reason == "it never sticks; the engine has no list of findings"


def test_a_study_without_a_value_says_why(monkeypatch):
    result = next(iter(rows.results([replace(SEEN, slot=replace(OWN, params=(("ratio", r),))) for r in (0.9, 1.1)])))
    monkeypatch.setattr(rows, "known_of", lambda *asked: rows.Known(None, True))
    row = rows._study_row("run1", replace(result, value=None, reason="it never ran"))
    assert row.reason == "has no value; not on record; it never ran"


# ---- as a table ----------------------------------------------------------------------------------------------------


def test_columns_of_a_table():
    other = replace(judged(), scene="impact", params={"e": 0.8}, value=None)
    table = frame([judged(), other])
    fields = list(Row.__dataclass_fields__)
    assert list(table.columns[: len(fields)]) == fields
    assert list(table.index) == [0, 1] and len(table) == 2
    assert table["param.ratio"].tolist()[0] == 0.99 and math.isnan(table["param.ratio"].tolist()[1])
    assert table["param.e"].tolist()[1] == 0.8
    assert table["metric"].tolist() == ["creep", "creep"]


def test_no_rows_are_a_table_with_all_columns():
    assert list(frame([]).columns) == list(Row.__dataclass_fields__)


def test_law_predictions_asked_only_once(monkeypatch):
    """Laws of thousands of rows are asked in processes side by side before the first row is made."""
    scene = CATALOGUE["incline"].scene(3, {"ratio": 0.99})
    monkeypatch.setattr(rows, "predictions", lambda slot, version, metric, scene: ["now", slot, version, metric])
    asked = (SLOT, "1.2", "creep")
    assert CHECK.metric == "creep" and rows._predictions(SEEN, scene, CHECK, {asked: ["ahead"]}) == ["ahead"]
    assert rows._predictions(SEEN, scene, CHECK, {asked: []}) == []
    assert rows._predictions(SEEN, scene, CHECK, {}) == ["now", *asked]
    passing = replace(SEEN, metrics={"creep": (CHECK.truth, "")})
    for silent in (passing, replace(SEEN, metrics={}), replace(SEEN, outcome=Outcome.CRASHED)):
        assert rows._predictions(silent, scene, CHECK, {asked: ["ahead"]}) == []


# ---- what is not listed, and the exit status ----

FILE_TEXT = """
name = "ball"
dimension = 2
gravity = [0.0, -9.81]
duration = 0.1
[[bodies]]
name = "ball"
shape = { type = "disc", radius = 0.5 }
mass = 1.0
inertia = 0.125
[[pairs]]
friction = 0.0
restitution = 0.0
[[checks]]
quantity = "ball.y"
value = 0.0
tolerance = 0.01
"""
OWN_CHECK, INVARIANT = "final[ball.y]", "energy_growth"


def of_a_file(tmp_path, engine, outcome=Outcome.OK, **metrics):
    """Rows of a scene file by metric, each with the value given, else 0."""
    path = tmp_path / "ball.toml"
    path.write_text(FILE_TEXT)
    slot = Slot(pinned(str(path)), (), 2, engine, "default", 1 / 240)
    found = {name: (0.0, "") for name in (OWN_CHECK, INVARIANT, "penetration", "deepest_overlap")} | metrics
    observation = Observation(slot, "c", 1, "1.0", outcome, "said so", metrics=found)
    return {row.metric: row for row in rows_of("r", [observation])}


@pytest.mark.parametrize("engine", ["bullet", "an engine without a list"])
def test_alarm_for_a_missed_number_of_a_scene_file(tmp_path, engine):
    missed = of_a_file(tmp_path, engine, **{OWN_CHECK: (0.5, "")})[OWN_CHECK]
    assert (missed.physics, missed.standing, missed.alarming) == ("fail", "new", True)
    met = of_a_file(tmp_path, engine, **{OWN_CHECK: (0.005, "")})[OWN_CHECK]
    assert met.physics == "pass" and not met.alarming and not met.failing


@pytest.mark.parametrize(("profile", "named"), [("default", True), ("tuned", False)])
def test_cause_of_a_file_s_failure(profile, named):
    """A ball without friction falls on the floor: as shipped MuJoCo does not throw it up again, whatever e is."""
    pytest.importorskip("mujoco")
    checks = [{"quantity": "ball.y", "value": 9.0, "tolerance": 0.01}]
    fall = CATALOGUE["bounce"].scene(2, {"e": 0.8}).as_dict() | {"duration": 0.6, "checks": checks}
    del fall["params"]
    ran = execute(Slot(written(fall), (), 2, "mujoco", profile, 1 / 240))
    (row,) = [row for row in rows_of("r", [ran]) if row.metric == OWN_CHECK]
    assert (row.physics, row.standing, row.alarming) == ("fail", "new", True)
    assert ("and e is none of its parameters (predicted" in row.reason) == named


def test_engine_without_a_list_alarms_for_lost_cells_alone(tmp_path):
    engine = "an engine without a list"
    grown = of_a_file(tmp_path, engine, **{INVARIANT: (0.5, "")})[INVARIANT]
    assert (grown.physics, grown.standing, grown.alarming, grown.failing) == ("fail", None, False, True)
    for outcome, alarming in ((Outcome.INVALID, False), (Outcome.CRASHED, True), (Outcome.TIMED_OUT, True)):
        rows = of_a_file(tmp_path, engine, outcome).values()
        assert {row.alarming for row in rows} == {alarming} and all(row.failing for row in rows)
    assert all(row.alarming for row in of_a_file(tmp_path, "bullet", Outcome.INVALID).values())
    plain = [row.as_dict() for row in of_a_file(tmp_path, engine, Outcome.INVALID).values()]
    assert alarms(plain) == [] and "* INVALID" not in as_markdown(plain) and "<failure" not in as_junit(plain)


def test_missing_force_of_an_engine_in_a_file(tmp_path):
    for why in UNTOLD:
        told = of_a_file(tmp_path, "bullet", **{OWN_CHECK: (None, why)})[OWN_CHECK]
        assert (told.outcome, told.physics, told.standing, told.failing) == ("unsupported", None, None, False)
        assert told.reason == why
    slot = Slot("bounce", (("e", 1.0),), 3, "newton", "default", 1 / 240)
    told = {row.metric: row for row in rows_of("run", [Observation(slot, "c", 1, "9", Outcome.OK, metrics={
        "force_in_flight": (None, UNTOLD[0]), "apex[1]": (None, "there is no apex")
    })])}  # fmt: skip
    silent, lost = told["force_in_flight"], told["apex[1]"]
    assert (silent.outcome, silent.standing, silent.alarming) == ("unsupported", None, False)
    assert lost.alarming
    lost = of_a_file(tmp_path, "bullet", **{OWN_CHECK: (None, "the value is inf, not a finite number")})[OWN_CHECK]
    assert lost.alarming and lost.outcome == "ok"
