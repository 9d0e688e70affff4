"""A store that is damaged, full, locked, read-only, of another version or crafted is one line, never a traceback."""

import json
import os
import shutil
import sqlite3
import subprocess
import sys
import tempfile
import threading
from collections import Counter
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from adapters.plain import Notice, is_visible
from validation import posed
from validation.bench.timing import Timing
from validation.cells import Observation, Outcome, Slot
from validation.judging.rows import rows_of
from validation.posed import pinned, resolve
from validation.records import store
from validation.records.keeping import Rules, merge, prune
from validation.records.store import FILE, MissingError, Store, StoreError
from validation.running.plan import Request, slots
from validation.running.tracks import Recording

ROOT = Path(__file__).resolve().parents[2]
SLOTS = [Slot("impact", (("v", v),), 2, "chipmunk", "tuned", 1 / 240) for v in (1.0, 2.0, 3.0)]
SCENE = {
    "name": "drop", "dimension": 2, "gravity": [0.0, -9.81], "duration": 0.05,
    "bodies": [
        {"name": "floor", "shape": {"type": "half_space", "normal": [0.0, 1.0]}, "motion": "fixed"},
        {"name": "ball", "shape": {"type": "disc", "radius": 0.5}, "mass": 1.0, "inertia": 0.125,
         "pose": [0.0, 0.6, 0.0]},
    ],
}  # fmt: skip


def observed(slot, **changes):
    return Observation(slot, "cell", 1, "7.3.1", Outcome.OK, metrics={"rebound_ratio": (0.8, "")}, **changes)


def filled(folder):
    """A finished run of three cells."""
    made = Store(folder)
    run, _ = made.start("test", SLOTS)
    for slot in SLOTS:
        made.add(run, observed(slot))
    made.finish(run)
    made.close()
    return run


def crowded(folder):
    """Two finished runs with rows in every table, the second with the cell of a scene file."""
    run = filled(folder)
    made, empty = Store(folder), np.zeros((0, 2))
    apart, _ = made.start("another", [*SLOTS, *written(folder / "drop.json")])
    made.add(apart, observed(SLOTS[0])), made.finish(apart)
    t, none = np.linspace(0.0, 1.0, 3), np.zeros(0, np.int64)
    recording = Recording(t, np.zeros((3, 2, 3)), none, np.zeros((0, 2), np.int64), empty, empty, None, "completed")
    for slot in SLOTS:
        made.add_recording(run, slot, recording)
    made.add_timings(run, [Timing("work", slot, "c", "1", 1, "a/b", 0, 0, 0, False, 9, 1.0, 1.0, "h", None)
                           for slot in SLOTS])  # fmt: skip
    made.set_protocol(run, {"seed": 1})
    made.close()


def sql(folder, statement, *values):
    with sqlite3.connect(folder / FILE) as database:
        database.execute(statement, values)
    database.close()


def read_all(folder):
    opened = Store(folder, create=False)
    try:
        return [opened.observations(run) for run in opened.runs()]
    finally:
        opened.close()


def everything(folder):
    """All that can be read of a store, in words."""
    opened = Store(folder, create=False)
    found = []
    for run in opened.runs():
        found += [repr(each) for each in opened.observations(run)]
        found += [f"recording {run.id} {slot}" for slot, _ in opened.recordings(run)]
        found += [repr(each) for each in (*opened.timings(run), *opened.scenes(run), opened.protocol(run))]
    opened.close()
    return found


@pytest.mark.parametrize(
    ("statement", "values"),
    [
        ("UPDATE observations SET body = ?", ("{",)),
        ("UPDATE observations SET body = ?", ("[]",)),
        ("UPDATE observations SET body = ?", ("[" * 100_000,)),
        ("UPDATE observations SET body = json_set(body, '$.field_of_the_future', 1)", ()),
        ("UPDATE observations SET body = json_remove(body, '$.metrics')", ()),
        ("UPDATE observations SET body = json_set(body, '$.outcome', 'splendid')", ()),
        ("UPDATE observations SET body = json_set(body, '$.slot.dt', 'soon')", ()),
        ("UPDATE observations SET body = json_set(body, '$.metrics', 7)", ()),
        ("UPDATE observations SET body = json_set(body, '$.slot.engine', 'bullet')", ()),
        ("UPDATE observations SET body = json_set(body, '$.steps', 'many')", ()),
        ("UPDATE observations SET body = json_set(body, '$.settings', json('[1]'))", ()),
        ("UPDATE observations SET body = ?", (b"\x00\x01",)),
        ("UPDATE observations SET body = CAST(? AS TEXT)", (b'{"slot": "\xff"',)),
        ("UPDATE recordings SET body = substr(body, 1, 100)", ()),
        ("UPDATE recordings SET body = 'text'", ()),
        ("UPDATE recordings SET request = 'null'", ()),
        ("UPDATE timings SET body = '{}'", ()),
        ("UPDATE protocols SET body = '['", ()),
        ("UPDATE scenes SET body = 'another'", ()),
        ("UPDATE runs SET plan = ?", ("{",)),
        ("UPDATE runs SET plan = ?", ("[1]",)),
        ("UPDATE runs SET machine = ?", ("[1",)),
        ("UPDATE runs SET machine = ?", ("[1]",)),
        ("UPDATE runs SET date = ?", ("yesterday",)),
        ("UPDATE runs SET title = ?", (b"\x00",)),
        ("UPDATE runs SET id = ?", ("../../x",)),
        ("UPDATE runs SET id = ?", ("a\nb",)),
        ("UPDATE runs SET id = ?", ("",)),
    ],
)
def test_a_damaged_row(tmp_path, statement, values):
    """One line names its run and table, and the other rows are read."""
    crowded(tmp_path)
    whole = everything(tmp_path)
    sql(tmp_path, f"{statement} WHERE rowid = (SELECT min(rowid) FROM {statement.split()[1]})", *values)
    with pytest.warns(Notice) as said:
        left = everything(tmp_path)
    assert all(is_visible(str(each.message)) and len(str(each.message)) < 1000 for each in said)
    assert left and Counter(left) < Counter([*whole, "None"]) and left != whole
    assert "damaged" in str(said[0].message)


@pytest.mark.parametrize(
    "statement",
    ["DROP TABLE observations", "DROP TABLE runs", "ALTER TABLE runs RENAME COLUMN title TO name"],
)
def test_a_damaged_table(tmp_path, statement):
    filled(tmp_path)
    sql(tmp_path, statement)
    with pytest.raises(StoreError) as caught:
        read_all(tmp_path)
    assert is_visible(str(caught.value)) and not isinstance(caught.value, MissingError)


def test_a_damaged_run(tmp_path):
    """It cannot be asked for, does not hinder the next one, is not merged, and can be deleted."""
    crowded(tmp_path / "a")
    sql(tmp_path / "a", "UPDATE runs SET machine = '[1', finished = 0 WHERE rowid = 1")
    opened = Store(tmp_path / "a")
    (first,) = opened._db.execute("SELECT id FROM runs WHERE rowid = 1").fetchone()
    with pytest.raises(StoreError, match=rf"run '{first}' is damaged \(machine\)"):
        opened.run(first)
    latest = opened.run()
    with pytest.warns(Notice, match="is damaged"):
        again, done = opened.start("test", SLOTS)
    assert latest.id != first and again.id not in (first, latest.id) and done == set()
    ours = Store(tmp_path / "b")
    with pytest.raises(StoreError, match=rf"^merge: cannot read .*: run '{first}' is damaged"):
        merge(ours, tmp_path / "a")
    assert ours.runs() == []
    gone = prune(opened, Rules(unfinished=True))
    assert first in [run.id for run in gone] and opened.damaged() == {}
    assert not opened._db.execute("SELECT 1 FROM observations WHERE run = ?", (first,)).fetchone()
    assert latest.id in [run.id for run in opened.runs()]


@pytest.mark.parametrize("name", ["a?b", "a#b", "a%20b"])
def test_a_folder_with_the_name_of_an_address(tmp_path, name):
    """It is merged, and no other file is opened or made."""
    crowded(tmp_path / name)
    ours = Store(tmp_path / "ours")
    assert merge(ours, tmp_path / name).runs == 2
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted([name, "ours"])


def test_lasting_lock(tmp_path, monkeypatch):
    """Who writes says that it waits, and writes when it is gone."""
    run = filled(tmp_path)
    made = Store(tmp_path)
    other = sqlite3.connect(tmp_path / FILE, isolation_level=None, check_same_thread=False)
    other.execute("BEGIN IMMEDIATE")
    monkeypatch.setattr(store, "PATIENCE", 0.2)
    made._db.execute("PRAGMA busy_timeout = 100")
    timer = threading.Timer(1.0, other.execute, ["COMMIT"])
    timer.start()
    with pytest.warns(Notice, match="locked by another process; waiting") as said:
        made.add(run, observed(SLOTS[0], reason="later"))
    assert len(said) == 1 and "later" in [each.reason for each in made.observations(run)]
    timer.join(), other.close()


def test_a_pipe_in_place_of_the_file(tmp_path):
    """Nothing waits for what comes out of it."""
    os.mkfifo(tmp_path / FILE)
    with pytest.raises(StoreError, match="is a pipe, not a file"):
        Store(tmp_path, create=False)


def test_a_machine_without_its_facts(tmp_path):
    filled(tmp_path)
    sql(tmp_path, 'UPDATE runs SET machine = \'{"cpu": "a"}\'')
    told = Store(tmp_path, create=False).run().machine
    assert told == {"cpu": "a"} | dict.fromkeys(("cores", "memory_gib", "system", "python"), "unknown")


def test_a_file_cut_short_is_one_line(tmp_path):
    filled(tmp_path)
    whole = (tmp_path / FILE).read_bytes()
    (tmp_path / FILE).write_bytes(whole[: len(whole) // 2])
    with pytest.raises(StoreError, match="cannot"):
        read_all(tmp_path)


def test_full_disk_in_one_line_without_loss(tmp_path):
    made = Store(tmp_path)
    run, _ = made.start("test", SLOTS)
    made.add(run, observed(SLOTS[0]))
    pages = made._db.execute("PRAGMA page_count").fetchone()[0]
    made._db.execute(f"PRAGMA max_page_count = {pages}")
    with pytest.raises(StoreError, match="full"):
        made.add(run, observed(SLOTS[1], readback={str(k): "x" * 100 for k in range(1000)}))
    assert made.observations(run) == [observed(SLOTS[0])]


def test_text_cleaned_as_a_store_is_read(tmp_path):
    run = filled(tmp_path)
    sql(tmp_path, "UPDATE observations SET body = json_set(body, '$.reason', ?, '$.engine_version', ?, '$.log', ?)",
        "\x1b[2J\nsecond", "9" * 10**6, "\x07" * 10**6)  # fmt: skip
    opened = Store(tmp_path, create=False)
    for observation in opened.observations(run):
        assert observation.reason.isprintable() and observation.engine_version.isprintable()
        assert len(observation.engine_version) <= 80 and len(observation.log) <= 5 * 501


def test_reading_leaves_a_folder_as_it_is(tmp_path):
    filled(tmp_path)
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir() if "-shm" not in path.name}
    assert len(read_all(tmp_path)[0]) == len(SLOTS)
    after = {path.name: path.read_bytes() for path in tmp_path.iterdir() if "-shm" not in path.name}
    assert {name: data for name, data in after.items() if data} == before


@pytest.fixture
def public():
    """A folder that every user may enter; pytest's own are private."""
    folder = Path(tempfile.mkdtemp(prefix="crosscheck-test-"))
    folder.chmod(0o755)
    yield folder
    folder.chmod(0o755)
    shutil.rmtree(folder)


@pytest.mark.skipif(sys.platform == "win32", reason="permissions are another matter on Windows")
def test_results_that_cannot_be_written_can_be_read(public):
    """As a user who may read the folder and no more: an archive, somebody else's results."""
    filled(public)
    code = (
        "import os, sys; from pathlib import Path; from validation.records.store import Store\n"
        "if os.getuid() == 0: os.setgid(65534), os.setuid(65534)\n"  # root may write anywhere
        "try: open(Path(sys.argv[1], 'probe'), 'w'); sys.exit('the folder can be written')\n"
        "except PermissionError: pass\n"
        "opened = Store(Path(sys.argv[1]), create=False); print(len(opened.observations(opened.run())))"
    )
    (public / FILE).chmod(0o444)
    public.chmod(0o555)
    done = subprocess.run([sys.executable, "-c", code, str(public)], cwd=ROOT, capture_output=True, text=True)
    assert done.stdout.strip() == str(len(SLOTS)), done.stderr


def test_store_of_an_old_version_read_and_upgraded(tmp_path):
    run = filled(tmp_path)
    sql(tmp_path, "DROP TABLE scenes")
    sql(tmp_path, "PRAGMA user_version = 0")
    assert len(read_all(tmp_path)[0]) == len(SLOTS)
    again = Store(tmp_path)
    assert again.scenes(run) == {}
    assert again._db.execute("PRAGMA user_version").fetchone()[0] == store.VERSION


START = """
import sys
from pathlib import Path
from validation.cells import Slot
from validation.records.store import Store
slots = [Slot("impact", (("v", float(v)),), 2, "chipmunk", "tuned", 1 / 240) for v in range(1, 4)]
sys.stdin.readline()
run, _ = Store(Path(sys.argv[1])).start("test", slots, fresh=True)
print(run.id)
"""


def test_simultaneous_starts_are_runs_of_their_own(tmp_path):
    command = [sys.executable, "-c", START, str(tmp_path)]
    starts = [subprocess.Popen(command, cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
              for _ in range(3)]  # fmt: skip
    for start in starts:  # all are loaded and wait
        start.stdin.write("go\n")
    for start in starts:
        start.stdin.flush()
    ids = [start.communicate(timeout=120)[0].strip() for start in starts]
    assert [start.returncode for start in starts] == [0] * 3
    assert len(set(ids)) == 3
    assert len(Store(tmp_path, create=False).runs()) == 3


def test_write_lock_taken_before_a_dependent_read(tmp_path, monkeypatch):
    """Else two that start at once read that there is no such run, and one of them cannot write any more."""
    made, asked = Store(tmp_path), []

    class Now(datetime):
        @classmethod
        def now(cls, tz=None):  # called between what is read and what is written
            other = sqlite3.connect(made.path, timeout=0.0, isolation_level=None)
            with pytest.raises(sqlite3.OperationalError, match="locked"):
                other.execute("BEGIN IMMEDIATE")
            other.close()
            asked.append(tz)
            return datetime.now(tz)

    monkeypatch.setattr(store, "datetime", Now)
    made.start("test", SLOTS)
    assert asked == [UTC]


def test_latest_run_by_start_order_despite_the_clock(tmp_path, monkeypatch):
    made = Store(tmp_path)

    class Past(datetime):
        year_of_the_clock = 2030

        @classmethod
        def now(cls, tz=None):
            return datetime(cls.year_of_the_clock, 1, 1, tzinfo=UTC)

    monkeypatch.setattr(store, "datetime", Past)
    first, _ = made.start("test", SLOTS)
    Past.year_of_the_clock = 2001
    second, _ = made.start("test", SLOTS[:2])
    assert (first.date[:4], second.date[:4]) == ("2030", "2001")
    assert made.run().id == second.id
    assert [run.id for run in made.runs()] == [first.id, second.id]


def written(path, **changes):
    path.write_text(json.dumps(SCENE | changes))
    return [slot for slot in slots(Request([str(path)], ["chipmunk"], ["tuned"])) if slot.dimension == 2]


@pytest.fixture
def forget(monkeypatch):
    """Forget all scene files, as another process would never have known them."""

    def forgotten():
        monkeypatch.setattr(posed, "_texts", {})
        resolve.cache_clear()

    yield forgotten
    resolve.cache_clear()


def test_edited_scene_file_as_another_plan(tmp_path, forget):
    path = tmp_path / "drop.json"
    before = written(path)
    made = Store(tmp_path)
    first, _ = made.start("test", before)
    made.add(first, observed(before[0]))
    forget()
    after = written(path, duration=0.1)
    second, done = made.start("test", after)
    assert second.id != first.id and done == set()
    forget()
    path.unlink()
    assert [resolve(o.slot.scene).scene(2).duration for o in made.observations(first)] == [0.05]
    assert rows_of(first.id, made.observations(first))
    with pytest.raises(posed.SceneError, match="no such file"):
        forget()
        resolve(before[0].scene)


def test_moved_scene_file_without_effect_on_its_run(tmp_path, forget):
    path = tmp_path / "drop.json"
    cells = written(path)
    made = Store(tmp_path)
    run, _ = made.start("test", cells)
    made.add(run, observed(cells[0]))
    expected = rows_of(run.id, made.observations(run))
    shutil.move(path, tmp_path / "elsewhere.json")
    forget()
    assert rows_of(run.id, made.observations(run)) == expected


def test_refusal_of_a_pinned_name_of_a_changed_file(tmp_path, forget):
    path = tmp_path / "drop.json"
    name = written(path)[0].scene
    assert pinned(name) == name and name.startswith(f"{path}@")
    forget()
    written(path, duration=0.1)
    with pytest.raises(posed.SceneError, match="has changed"):
        forget()
        pinned(name)
