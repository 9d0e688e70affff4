"""Rows over releases: what moved in which, and what the notes say of it."""

from dataclasses import replace

import pytest

from reports import releases as published
from reports.command import releasing
from reports.releases import sentences
from validation.cells import Observation, Outcome, Slot
from validation.findings import Family, Finding, Findings, FindingsError, row_key
from validation.judging.comparison import Change, Kind
from validation.judging.rows import rows_of
from validation.judging.verdicts import Physics
from validation.records.store import RELEASE_TITLE, Store
from validation.releases import history, notes
from validation.releases.choosing import Release
from validation.releases.driving import Effort
from validation.releases.floors import moved_starts
from validation.releases.history import Told, steps, told_by
from validation.running.execution import execute

SLOT = Slot("impact", (("e", 0.5), ("v", 4.0)), 2, "toy", "default", 1 / 240)
OTHER = Slot("impact", (("e", 0.5), ("v", 8.0)), 2, "toy", "default", 1 / 240)


def told(version, ratio, slots=(SLOT,), outcome=Outcome.OK):
    """What a release says whose balls leave with that share of their speed."""
    metrics = {} if ratio is None else {"rebound_ratio": (ratio, "")}
    found = [Observation(slot, "c", 1, version, outcome, "no wheel", metrics) for slot in slots]
    return told_by("toy", version, found)


def kinds(releases):
    return [(s.before, s.after, s.family.first.kind, len(s.family.changes)) for s in steps(releases)
            if s.family.first.metric == "rebound_ratio"]  # fmt: skip


def test_change_told_once_at_its_release():
    releases = [told("1", 0.5), told("2", 0.5), told("3", 0.4), told("4", 0.4)]
    assert kinds(releases) == [("2", "3", Kind.FLIP, 1)]


def test_a_release_that_did_not_answer_is_passed_over():
    silent = told("2", None, outcome=Outcome.NOT_INSTALLED)
    assert silent.reason == "no wheel"
    assert kinds([told("1", 0.5), silent, told("3", 0.4)]) == [("1", "3", Kind.FLIP, 1)]


def test_cells_compared_with_the_last_release_that_was_asked():
    releases = [told("1", 0.5, (SLOT, OTHER)), told("2", 0.5), told("3", 0.4, (SLOT, OTHER))]
    assert sorted(kinds(releases)) == [("1", "3", Kind.FLIP, 1), ("2", "3", Kind.FLIP, 1)]


def test_rows_that_move_together_are_one_step():
    assert kinds([told("1", 0.5, (SLOT, OTHER)), told("2", 0.4, (SLOT, OTHER))]) == [("1", "2", Kind.FLIP, 2)]


def test_crashed_and_invalid_cells_in_a_history():
    crashed = told("2", None, outcome=Outcome.CRASHED)
    assert kinds([told("1", 0.5), crashed]) == [("1", "2", Kind.OUTCOME, 1)]
    assert kinds([told("1", 0.5), told("2", 0.4, outcome=Outcome.INVALID), told("3", 0.5)]) == []


def noisy(version, ratio, scatter, moves=(0, 1, 2)):
    """A release that answers from starts moved by units in the last place, each of which adds ``scatter``."""
    found = [
        Observation(
            replace(SLOT, ulp=u), "c", 1, version, Outcome.OK, metrics={"rebound_ratio": (ratio + u * scatter, "")}
        )
        for u in moves
    ]
    return told_by("toy", version, found)


def test_change_within_moved_starts_is_no_step():
    assert kinds([noisy("1", 0.40, 0.01), noisy("2", 0.41, 0.01)]) == []
    assert kinds([noisy("1", 0.40, 0.001), noisy("2", 0.41, 0.001)]) == [("1", "2", Kind.ERROR, 1)]


def test_starts_moved_only_for_values_changed_on_both_sides():
    releases = [told("1", 0.5), told("2", 0.4), told("3", 0.41, (SLOT, OTHER)), told("4", 0.41, (SLOT, OTHER))]
    starts = [replace(SLOT, ulp=1), replace(SLOT, ulp=2)]
    assert moved_starts(releases) == {"2": starts, "3": starts}


def test_command_for_changed_cells_only(monkeypatch):
    asked = []

    def drive(store, release, cells, effort, console):
        asked.append((release.version, [cell.ulp for cell in cells], effort.fresh))
        return noisy(release.version, {"2": 0.40, "3": 0.41}[release.version], 0.01)

    monkeypatch.setattr(releasing, "_drive", drive)
    releases = [Release("toy", version, "toyphysics", ()) for version in "123"]
    before = [told("1", 0.40), told("2", 0.40), told("3", 0.41)]
    assert kinds(before) == [("2", "3", Kind.ERROR, 1)]
    after = releasing._with_floors(None, releases, [SLOT], before, Effort(fresh=True), None)
    assert asked == [("2", [0, 1, 2], False), ("3", [0, 1, 2], False)]
    assert after[0] is before[0] and kinds(after) == []


@pytest.mark.parametrize(
    ("outcome", "ended"),
    [(Outcome.OK, False), (Outcome.UNSUPPORTED, False), (Outcome.NOT_INSTALLED, False), (Outcome.CRASHED, True),
     (Outcome.TIMED_OUT, True), (Outcome.INVALID, True)],
)  # fmt: skip
def test_rows_without_an_answer_counted_apart_from_failures(outcome, ended):
    release = told("2", 0.4 if outcome is Outcome.OK else None, outcome=outcome)
    assert release.ended == (len(release.rows) if ended else 0) and len(release.rows) > 1


def test_a_missing_answer_never_replaces_one(tmp_path):
    store = Store(tmp_path)
    for outcome in (Outcome.OK, Outcome.NOT_INSTALLED):
        run, _ = store.start(f"{RELEASE_TITLE}chipmunk==1.0: impact", [], fresh=True)
        slot = Slot("impact", (), 2, "chipmunk", "tuned", 1 / 240)
        store.add(run, Observation(slot, "c", 1, "1.0", outcome, "gone"))
    assert [o.outcome for o in history.observations(store, "chipmunk", "1.0")] == [Outcome.OK]
    assert history.engines(store) == ["chipmunk"] and history.versions(store, "chipmunk") == ["1.0"]
    assert history.versions(store, "chip") == []
    store.close()


def test_versions_are_in_the_order_of_versions(tmp_path):
    store = Store(tmp_path)
    for version in ("3.10.0", "3.9.0", "3.9.0", "4.0.0rc1", "4.0.0"):
        store.start(f"{RELEASE_TITLE}toy=={version}: impact", [], fresh=True, apart=version)
    assert history.versions(store, "toy") == ["3.9.0", "3.10.0", "4.0.0rc1", "4.0.0"]
    assert [run.title for run in store.release_runs("toy", "4.0.0")] == ["release toy==4.0.0: impact"]
    store.close()


@pytest.mark.parametrize(
    ("value", "releases", "is_mended"), [(0.4, "<2", True), (0.4, ">=2", False), (0.5, "<2", False)]
)
def test_pass_beyond_an_older_finding_s_band(monkeypatch, value, releases, is_mended):
    """What passes within the band was marginal there, and is the same here."""
    family = Family("slow", ("default",), "impact", ("rebound_ratio",), "it is slow", "measured", releases)
    monkeypatch.setattr(history, "finding_of", lambda row: Finding(family, value, 0.01))
    (row,) = [row for row in told("2.5", 0.5).rows if row.metric == "rebound_ratio"]
    assert row.physics == "pass" and history.mended(row) is is_mended


# ---- what one release says of itself ----


def test_name_rows_and_times_of_a_release():
    times = {("toy", "default", "impact", 2): 2.0}
    release = told_by(
        "toy", "2", [Observation(SLOT, "c", 1, "2", Outcome.OK, metrics={"rebound_ratio": (0.4, "")})], times
    )
    assert (release.name, release.reason, release.doubted, release.times) == ("toy==2", "", (), times)
    assert {row.run for row in release.rows} == {"toy==2"} and release.count(Physics.FAIL) >= 1
    fails = [row for row in release.rows if row.physics == "fail"]
    assert release.count(Physics.FAIL) == len(fails) < len(release.rows)
    nothing = told_by("toy", "2", [])
    assert (nothing.rows, nothing.reason, nothing.times) == ((), "it was not run", {})


def test_invalid_release_as_an_answer_without_a_reason():
    assert told("2", None, outcome=Outcome.INVALID).reason == ""


HELD, BROKEN, WORSE = ({"quantity": name, "holds": holds} for name, holds in
                       (("mass", True), ("friction", False), ("gravity", False)))  # fmt: skip


def test_failed_receipt_removes_verdicts_of_its_profile_only():
    """Two cells of one profile, the second right: what is right by chance is not right either."""
    metrics = {"rebound_ratio": (0.5, "")}
    sound = replace(SLOT, profile="sound")
    found = [
        Observation(SLOT, "c", 1, "2", Outcome.OK, metrics=metrics, receipts=(HELD, BROKEN, WORSE)),
        Observation(OTHER, "c", 1, "2", Outcome.OK, metrics=metrics, receipts=(WORSE,)),
        Observation(sound, "c", 1, "2", Outcome.OK, metrics=metrics, receipts=(HELD,)),
    ]
    release = told_by("toy", "2", found)
    why = "receipt friction fails in impact"
    assert release.doubted == (f"default: {why}",)
    doubted = [row for row in release.rows if row.profile == "default"]
    assert {(r.outcome, r.physics, r.standing, r.reason) for r in doubted} == {
        ("invalid", None, None, f"no verdict: {why}")
    }
    assert len({row.slot["params"]["v"] for row in doubted}) == 2
    kept = [row for row in release.rows if row.profile == "sound" and row.metric == "rebound_ratio"]
    assert [(row.outcome, row.physics) for row in kept] == [("ok", "pass")]


def test_earlier_invalid_cell_keeps_its_reason():
    found = [Observation(SLOT, "c", 1, "2", Outcome.INVALID, "it sinks", receipts=(BROKEN,))]
    assert all("no verdict" not in row.reason and "it sinks" in row.reason for row in told_by("toy", "2", found).rows)


@pytest.mark.parametrize(
    ("own", "other", "pace"),
    [({"a": 6.0, "b": 2.0, "c": 9.0}, {"a": 2.0, "b": 1.0, "d": 5.0}, 2.5), ({"a": 6.0}, {"b": 1.0}, None)],
)
def test_pace_of_a_release_as_median_over_common_cells(own, other, pace):
    first, second = (Told("toy", "1", (), times=times) for times in (own, other))
    assert first.pace(second) == pace


# ---- what a store has of releases ----


@pytest.fixture
def releases(tmp_path):
    """A store, and `add(version, ratio, slot)` that answers a cell on a release."""
    store = Store(tmp_path)

    def add(version, ratio, slot=SLOT, outcome=Outcome.OK, engine="toy"):
        run, _ = store.start(f"{RELEASE_TITLE}{engine}=={version}: a: b==c", [], fresh=True, apart=version)
        store.add(run, Observation(slot, "c", 1, version, outcome, "gone", {"rebound_ratio": (ratio, "")}))
        return run

    yield store, add
    store.close()


def ratios_of(release):
    return {row.params["v"]: row.value for row in release.rows if row.metric == "rebound_ratio"}


def test_releases_of_an_engine_oldest_first(releases, monkeypatch):
    store, add = releases
    for version, ratio, slot in (("10", 0.3, SLOT), ("9", 0.5, SLOT), ("9", 0.4, OTHER)):
        add(version, ratio, slot)
    add("1", 0.2, engine="other")
    monkeypatch.setattr(history, "times", lambda *asked: {"asked": asked})
    every = history.told(store, "toy")
    assert [(t.engine, t.version, ratios_of(t)) for t in every] == [
        ("toy", "9", {4.0: 0.5, 8.0: 0.4}), ("toy", "10", {4.0: 0.3})
    ]  # fmt: skip
    assert [t.times["asked"] for t in every] == [(store, "toy", "9"), (store, "toy", "10")]
    assert [t.version for t in history.told(store, "toy", ["10"])] == ["10"]
    assert [ratios_of(t) for t in history.told(store, "toy", ["9"], [OTHER])] == [{8.0: 0.4}]
    assert history.engines(store) == ["toy", "other"] and history.versions(store, "toy") == ["9", "10"]


@pytest.mark.parametrize(
    ("first", "second", "kept"),
    [(Outcome.OK, Outcome.OK, 0.4), (Outcome.OK, Outcome.INVALID, 0.4), (Outcome.OK, Outcome.NOT_INSTALLED, 0.5),
     (Outcome.NOT_INSTALLED, Outcome.UNSUPPORTED, 0.4), (Outcome.INVALID, Outcome.NOT_INSTALLED, 0.4)],
)  # fmt: skip
def test_newest_answer_kept_over_later_non_answers(releases, first, second, kept):
    store, add = releases
    add("1", 0.5, outcome=first)
    add("1", 0.4, outcome=second)
    add("2", 0.1)
    (found,) = history.observations(store, "toy", "1")
    assert found.metrics["rebound_ratio"][0] == kept


def test_time_of_a_release_by_its_newest_ratios(releases, monkeypatch):
    import pandas as pd

    store, add = releases
    runs = {add(version, 0.5).id: k for k, version in enumerate(("1", "1", "2"))}
    add("1", 0.5, engine="other")

    def ratios(asked, run):
        assert asked is store
        row = {"engine": "toy", "profile": "soft", "scene": "impact", "dimension": 3, "ratio": 2.0 + runs[run.id]}
        return pd.DataFrame([row, row | {"scene": f"scene{runs[run.id]}"}])

    monkeypatch.setattr(history, "ratios", ratios)
    assert history.times(store, "toy", "1") == {
        ("toy", "soft", "impact", 3): 3.0, ("toy", "soft", "scene0", 3): 2.0, ("toy", "soft", "scene1", 3): 3.0
    }  # fmt: skip
    assert history.times(store, "toy", "3") == {}


# ---- what moved, as data and in words ----


def test_step_data_with_releases_largest_change_and_count():
    step = next(s for s in steps([told("1", 0.5, (SLOT, OTHER)), told("2", 0.4, (SLOT, OTHER))])
                if s.family.first.metric == "rebound_ratio")  # fmt: skip
    assert step.as_dict() == {"before": "1", "after": "2", "rows": 2, "change": step.family.first.as_dict()}


def test_slot_with_fields_in_any_order():
    slot = SLOT.as_dict()
    other = dict(reversed(slot.items()))
    assert list(other) != list(slot)
    assert history.identity({"slot": slot, "metric": "a"}) == history.identity({"slot": other, "metric": "a"})


@pytest.mark.parametrize(
    ("iterations", "said"),
    [(None, "soft stack 3-D n=10 apex: 1 -> 2"), (4, "soft stack 3-D n=10 at 4 iterations apex: 1 -> 2")],
)
def test_a_change_is_told_with_its_cell(iterations, said):
    change = Change(
        Kind.FLIP, True, "toy", "soft", "stack", 3, "n=10", "apex", "1", "2", 1.0, {"iterations": iterations}
    )
    assert history.sentence(change) == said


def test_finding_of_a_row(monkeypatch):
    family = Family("slow", ("default",), "impact", ("rebound_ratio",), "it is slow", "measured", "")
    finding = Finding(family, 0.4, 0.01)
    listed = Findings("toy", {"slow": family}, (), {row_key(SLOT, "rebound_ratio"): finding})
    monkeypatch.setattr(history, "findings_of", lambda engine: listed if engine == "toy" else None)
    rows = told("2", 0.4, (SLOT, OTHER)).rows
    assert [(row.params["v"], row.metric) for row in rows if history.finding_of(row) is finding] == [
        (4.0, "rebound_ratio")
    ]
    assert history.finding_of(replace(rows[0], engine="other")) is None
    mended = next(row for row in told("2", 0.5).rows if row.metric == "rebound_ratio")
    assert not history.mended(replace(mended, engine="other"))


@pytest.mark.parametrize(("listed", "found", "is_mended"), [(None, 0.5, True), (0.4, 0.41, False), (0.4, 0.411, True)])
def test_mended_value_once_missing_or_at_a_limit(monkeypatch, listed, found, is_mended):
    family = Family("slow", ("default",), "impact", ("rebound_ratio",), "it is slow", "measured", "<2")
    monkeypatch.setattr(history, "finding_of", lambda row: Finding(family, listed, 0.41 - 0.4))
    row = next(row for row in told("2.5", 0.5).rows if row.metric == "rebound_ratio")
    assert history.mended(replace(row, value=found)) is is_mended
    assert not history.mended(replace(row, value=found, physics="fail"))


@pytest.fixture
def noted(tmp_path, monkeypatch):
    """`noted(text)` makes the notes on the toy."""

    def write(text):
        (tmp_path / notes.FILE).write_text(text)
        monkeypatch.setattr(notes, "inside", lambda engine, name: tmp_path / name)
        notes.notes_of.cache_clear()

    yield write
    notes.notes_of.cache_clear()


NOTE = """
[[change]]
release = "2.5"
scenes = ["impact"]
profiles = ["*"]
says = "speeds are capped"
source = "notes of 2.5"
"""


def test_step_between_releases_with_its_note_or_unexplained(noted):
    noted(NOTE)
    found = steps([told("2", 0.5), told("3", 0.4)])
    (said,) = sentences("toy", [step for step in found if step.family.first.metric == "rebound_ratio"])
    assert said == (
        "**3** (after 2). Speeds are capped (notes of 2.5).\n"
        "  * default impact: 1 check begins to fail; first `rebound_ratio` (2-D e=0.5 v=4) 0.5 (pass) -> 0.4 (fail)"
    )
    assert notes.explanations("toy", "impact", "default", "2.5", "3") == ["unexplained"]
    assert notes.explanations("toy", "impact", "default", "2", "2.5") == ["speeds are capped (notes of 2.5)"]
    assert notes.explanations("toy", "bounce", "default", "2", "3") == ["unexplained"]


def test_rows_explained_by_one_note_under_it(noted):
    noted(NOTE)
    slots = (SLOT, replace(SLOT, profile="other"))
    (said,) = sentences("toy", steps([told("2", 0.5, slots), told("3", 0.4, slots)]))
    head, *lines = said.splitlines()
    assert head.count("Speeds are capped") == 1 == said.count("Speeds are capped")
    assert [line.split(":")[0] for line in lines] == ["  * default impact", "  * other impact"]


def test_changes_without_notes_unexplained():
    assert notes.explanations("chipmunk", "impact", "tuned", "1", "2") == ["unexplained"]


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [('release = "2.5"', 'release = "two"', "release 'two' is not a version"),
     ('["*"]', '"*"', "profiles must be a list"),
     ("says", "tells", "needs exactly"), ('"notes of 2.5"', '" "', "source is missing"),
     ("[[change]]", "[[change]", ":")],
)  # fmt: skip
def test_wrong_notes_in_one_line(noted, old, new, said):
    noted(NOTE.replace(old, new))
    with pytest.raises(FindingsError, match=r"^[^\n]*$") as caught:
        notes.notes_of("toy")
    assert said in str(caught.value)


def test_every_note_of_ours_can_be_read():
    from adapters import registry

    for engine in registry.names():
        for note in notes.notes_of(engine):
            assert note.says and note.source


def test_a_doubted_row_has_neither_verdict_nor_standing():
    pytest.importorskip("pymunk")
    row = rows_of("r", [execute(Slot("impact", (), 2, "chipmunk", "tuned", 1 / 240))])[0]
    known = replace(row, standing="known", physics="fail")
    doubted = history._doubted(known, {"tuned": "a receipt fails"})
    assert (doubted.physics, doubted.standing, doubted.outcome) == (None, None, Outcome.INVALID.value)
    assert doubted.reason == "no verdict: a receipt fails"
    assert history._doubted(known, {"default": "a receipt fails"}) is known


def test_published_page_part_per_engine(tmp_path, monkeypatch):
    store = Store(tmp_path)
    monkeypatch.setattr(history, "engines", lambda store: ["one", "other"])
    monkeypatch.setattr(history, "told", lambda store, engine: [])
    monkeypatch.setattr(history, "steps", lambda told: [])
    monkeypatch.setattr(published, "as_table", lambda told, steps: "a table")
    monkeypatch.setattr(published, "sentences", lambda engine, steps: ["two rows moved"] if engine == "one" else [])
    lines = published.page(store).splitlines()
    store.close()
    assert lines[0] == "# Physics over engine releases"
    assert lines[lines.index("## one") :] == [
        "## one", "", "a table", "* two rows moved", "", "## other", "", "a table", "Nothing changed.",
    ]  # fmt: skip
