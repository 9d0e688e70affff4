"""What judging a run gave: kept beside it, and made anew where nothing can be kept or something is other code."""

import sqlite3
from dataclasses import replace

import pytest

from adapters.plain import Notice
from reports import brief
from reports.brief import Judged, Kept, Summary, judged, keep, summarise
from validation.catalogue import CATALOGUE
from validation.cells import Observation, Outcome, Slot
from validation.judging.rows import rows_of
from validation.records.store import Store
from validation.running.plan import QUICK_DT

SLOT = Slot("impact", (("e", 0.5), ("v", 2.0)), 2, "chipmunk", "tuned", QUICK_DT)
PANEL = ("chipmunk", "tuned", "impact", 2)


def cell(slot=SLOT, ratio=0.75, outcome=Outcome.OK, version="7.2"):
    metrics = {"rebound_ratio": (ratio, ""), "rebound_speed": (1.0, "")}
    return Observation(slot, "c", CATALOGUE["impact"].version, version, outcome, "", metrics)


@pytest.fixture
def stored(tmp_path):
    """A store with one finished run, the run, and what it observed."""
    store = Store(tmp_path)
    run, _ = store.start("impact", [SLOT])
    store.add(run, cell())
    store.finish(run)
    yield store, store.run(), store.observations(run)
    store.close()


def test_judged_run_not_judged_again(stored, monkeypatch):
    store, run, seen = stored
    rows = rows_of(run.id, seen)
    failing = sum(row.physics == "fail" for row in rows)
    monkeypatch.setattr(brief, "rows_of", lambda *given: pytest.fail("judged again"))
    keep(store, run, seen, Judged.of(rows))
    assert judged(store, run) == Judged.of(rows) and judged(store, run).nulls
    kept = Kept(store.path.parent)
    found = kept.get(run.id)
    assert found == summarise([cell()], rows) and kept.get("another") is None
    error, fails, asked, sure = found.cells[PANEL][SLOT.key()]
    assert fails == sure == failing > 0 and asked == sum(row.physics is not None for row in rows) > failing
    assert error == pytest.approx(0.25) and found.versions == {"chipmunk": "7.2"} and found.times == {}
    kept.close()
    none = summarise([cell()], []).cells[PANEL][SLOT.key()]
    assert none == (pytest.approx(0.25), 0, 0, 0), "no row is not the same as not judged"


def test_judgement_kept_until_code_or_results_change(stored, monkeypatch):
    store, run, _ = stored
    asked = []
    monkeypatch.setattr(brief, "rows_of", lambda *given: asked.append(given) or rows_of(*given))
    first = judged(store, run)
    assert judged(store, run) == first and len(asked) == 1
    store.add(run, cell(ratio=0.5))
    (value,) = (row.value for row in judged(store, run).rows if row.metric == "rebound_ratio")
    assert value == 0.5 and len(asked) == 2
    monkeypatch.setattr(brief, "row_code", lambda: "other code")
    assert judged(store, run) == judged(store, run) and len(asked) == 3
    with sqlite3.connect(store.path.parent / brief.FILE) as db:
        db.execute("UPDATE kept SET body = 'spoilt'")
    assert judged(store, run).rows and len(asked) == 4


def test_a_damaged_result_is_told_to_each_reader(stored):
    store, run, _ = stored
    with store.writing() as db:
        db.execute("UPDATE observations SET body = '{}'")
    for _ in range(2):
        with pytest.warns(Notice, match="damaged and left out"):
            assert judged(store, run).rows == []


def test_unfinished_run_judged_each_time_and_deleted_run_dropped(stored, monkeypatch):
    store, run, _ = stored
    asked = []
    monkeypatch.setattr(brief, "rows_of", lambda *given: asked.append(given) or rows_of(*given))
    going = replace(run, finished=False)
    assert judged(store, going) == judged(store, going) and len(asked) == 2
    judged(store, run)
    kept = Kept(store.path.parent)
    kept.forget([run.id])
    kept.close()
    assert judged(store, run) and len(asked) == 4


def test_row_judged_by_laws_and_known_failures(tmp_path, monkeypatch):
    """An edit of any of them is other code."""
    for name in ("validation", "adapters/toy/findings"):
        (tmp_path / name).mkdir(parents=True)
    files = [tmp_path / "validation" / "rows.py", tmp_path / "adapters" / "laws.py"]
    files += [tmp_path / "adapters" / "toy" / "findings" / name for name in ("families.toml", "members.csv")]
    for package in ("validation", "adapters"):
        monkeypatch.setattr(getattr(brief, package), "__file__", str(tmp_path / package / "__init__.py"))
    codes = [brief.row_code.__wrapped__()]
    for file in files:
        file.write_text("changed")
        codes.append(brief.row_code.__wrapped__())
    assert len(set(codes)) == len(codes)


def test_failure_mended_by_a_moved_start_not_sure():
    moved = cell(replace(SLOT, ulp=3), ratio=0.5)
    alone, both = (summarise(cells).cells[PANEL][SLOT.key()] for cells in ([cell()], [cell(), moved]))
    assert both[:3] == alone[:3] and both[3] < alone[3]
    assert summarise([cell(), cell(replace(SLOT, ulp=3), ratio=0.75)]).cells[PANEL][SLOT.key()] == alone
    assert summarise([moved]).cells == {} and summarise([moved]).versions == {}


@pytest.mark.parametrize(
    "other", [{"iterations": 4}, {"dt": 1 / 60}, {"switched": (("iterations", 4),)}, {"ulp": 1}],
)  # fmt: skip
def test_cells_at_other_steps_or_settings_are_not_shown(other):
    assert summarise([cell(replace(SLOT, **other))], []).cells == {}
    assert list(summarise([cell(replace(SLOT, **other)), cell()]).cells) == [PANEL]


def test_crashed_cell_without_error_or_check():
    lost = Observation(SLOT, "c", CATALOGUE["impact"].version, "7.2", Outcome.CRASHED, "signal 11")
    assert summarise([lost]) == Summary({}, {"chipmunk": "7.2"})
    assert brief._error(cell(outcome=Outcome.DIVERGED)) == pytest.approx(0.25)
    assert brief._error(cell(outcome=Outcome.INVALID)) is None


def test_summary_of_other_code_or_damaged_replaced(tmp_path, monkeypatch):
    one, other = Summary({PANEL: {"a": (0.5, 1, 2, 1)}}, {"chipmunk": "1"}, {PANEL: (2.5, "bullet")}), Summary({}, {})
    kept = Kept(tmp_path)
    kept.put("run", other)
    kept.put("run", one)
    assert kept.get("run") == one
    kept.close()
    kept = Kept(tmp_path)
    assert kept.get("run") == one, "of a later process as well"
    monkeypatch.setattr(brief, "judging_code", lambda: "other")
    assert kept.get("run") is None
    kept.put("run", other)
    assert kept.get("run") == other
    for body in ("no json", "{}", "[1]", '{"panels": ["[1]"], "versions": {}, "times": []}'):
        with sqlite3.connect(tmp_path / brief.FILE) as db:
            db.execute("UPDATE kept SET body = ?", (body,))
        assert kept.get("run") is None, body
    kept.close()


def test_no_kept_summary_in_a_read_only_folder(tmp_path):
    kept = Kept(tmp_path / "nowhere")
    kept.put("run", Summary({}, {}))
    assert kept.get("run") is None
    kept.forget(["run"])
    kept.close()
    assert not (tmp_path / "nowhere").exists()


@pytest.mark.parametrize(("tolerances", "mends"), [(0.5, True), (0.9, True), (1.1, False), (1.9, False)])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_moved_start_that_passes_and_one_that_narrowly_fails(tolerances, mends, side):
    (row,) = [row for row in rows_of("", [cell()]) if row.metric == "rebound_ratio"]
    assert row.physics == "fail" and row.tolerance > 0.0
    moved = cell(replace(SLOT, ulp=3), ratio=row.truth + side * tolerances * row.tolerance)
    alone, both = (summarise(cells).cells[PANEL][SLOT.key()] for cells in ([cell()], [cell(), moved]))
    assert both[3] == alone[3] - mends


def test_a_damaged_name_in_the_schema(tmp_path):
    """SQLite's message is no text then; the file is as if it were not there."""
    kept = brief.Kept(tmp_path)
    kept.write("run", "what", "code", "body")
    kept.close()
    path = tmp_path / brief.FILE
    path.write_bytes(path.read_bytes().replace(b"kept (name TEXT, what", b"kept (name TEXT, w\xd7at"))
    kept = brief.Kept(tmp_path)
    kept.write("run", "what", "code", "body")
    kept.forget(["run"])
    assert kept.read("run", "what", "code", str) is None
