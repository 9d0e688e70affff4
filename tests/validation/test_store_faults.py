"""A store that is damaged, full, locked, read-only, of another version or crafted is one line, never a traceback."""

import json
import shutil
import sqlite3
import subprocess
import sys
import tempfile
from datetime import UTC, datetime
from pathlib import Path

import pytest

from validation import posed
from validation.cells import Observation, Outcome, Slot
from validation.judging.rows import rows_of
from validation.posed import pinned, resolve
from validation.records import store
from validation.records.store import FILE, MissingError, Store, StoreError
from validation.running.plan import Request, slots

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


@pytest.mark.parametrize(
    ("statement", "values"),
    [
        ("UPDATE observations SET body = ?", ("{",)),
        ("UPDATE observations SET body = ?", ("[]",)),
        ("UPDATE observations SET body = ?", ("null",)),
        ("UPDATE observations SET body = json_set(body, '$.field_of_the_future', 1)", ()),
        ("UPDATE observations SET body = json_remove(body, '$.metrics')", ()),
        ("UPDATE observations SET body = json_set(body, '$.outcome', 'splendid')", ()),
        ("UPDATE observations SET body = json_set(body, '$.slot.dt', 'soon')", ()),
        ("UPDATE observations SET body = json_set(body, '$.metrics', 7)", ()),
        ("UPDATE observations SET body = ?", (b"\x00\x01",)),
        ("UPDATE runs SET plan = ?", ("{",)),
        ("UPDATE runs SET machine = ?", ("[1]",)),
        ("UPDATE runs SET id = ?", ("../../etc/x",)),
        ("UPDATE runs SET id = ?", ("a\nb",)),
        ("UPDATE runs SET id = ?", ("",)),
        ("DROP TABLE observations", ()),
        ("DROP TABLE runs", ()),
        ("INSERT INTO scenes SELECT id, 'drop.json@00000000', '{}' FROM runs", ()),
        ("ALTER TABLE runs RENAME COLUMN title TO name", ()),
    ],
)
def test_a_store_that_was_tampered_with_is_one_line(tmp_path, statement, values):
    filled(tmp_path)
    sql(tmp_path, statement, *values)
    with pytest.raises(StoreError) as caught:
        read_all(tmp_path)
    assert "\n" not in str(caught.value) and len(str(caught.value)) < 1000
    assert not isinstance(caught.value, MissingError)


def test_a_file_cut_short_is_one_line(tmp_path):
    filled(tmp_path)
    whole = (tmp_path / FILE).read_bytes()
    (tmp_path / FILE).write_bytes(whole[: len(whole) // 2])
    with pytest.raises(StoreError, match="cannot"):
        read_all(tmp_path)


def test_a_full_disk_is_one_line_and_loses_nothing_that_was_there(tmp_path):
    made = Store(tmp_path)
    run, _ = made.start("test", SLOTS)
    made.add(run, observed(SLOTS[0]))
    pages = made._db.execute("PRAGMA page_count").fetchone()[0]
    made._db.execute(f"PRAGMA max_page_count = {pages}")
    with pytest.raises(StoreError, match="full"):
        made.add(run, observed(SLOTS[1], readback={str(k): "x" * 100 for k in range(1000)}))
    assert made.observations(run) == [observed(SLOTS[0])]


def test_text_in_a_store_is_cleaned_when_it_is_read(tmp_path):
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


def test_a_store_from_before_versions_can_be_read_and_gets_what_it_lacks_when_written(tmp_path):
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


def test_six_simultaneous_starts_are_six_runs(tmp_path):
    command = [sys.executable, "-c", START, str(tmp_path)]
    starts = [subprocess.Popen(command, cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
              for _ in range(6)]  # fmt: skip
    for start in starts:  # all are loaded and wait
        start.stdin.write("go\n")
    for start in starts:
        start.stdin.flush()
    ids = [start.communicate(timeout=120)[0].strip() for start in starts]
    assert [start.returncode for start in starts] == [0] * 6
    assert len(set(ids)) == 6
    assert len(Store(tmp_path, create=False).runs()) == 6


def test_whoever_reads_what_it_will_write_by_has_the_lock_to_write_already(tmp_path, monkeypatch):
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


def test_the_latest_run_is_the_one_started_last_whatever_the_clock_said(tmp_path, monkeypatch):
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


def test_a_scene_file_that_was_edited_is_another_plan_and_the_old_run_keeps_its_scene(tmp_path, forget):
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


def test_a_scene_file_that_was_moved_does_not_matter_to_its_run(tmp_path, forget):
    path = tmp_path / "drop.json"
    cells = written(path)
    made = Store(tmp_path)
    run, _ = made.start("test", cells)
    made.add(run, observed(cells[0]))
    expected = rows_of(run.id, made.observations(run))
    shutil.move(path, tmp_path / "elsewhere.json")
    forget()
    assert rows_of(run.id, made.observations(run)) == expected


def test_a_pinned_name_of_a_file_that_has_changed_is_refused(tmp_path, forget):
    path = tmp_path / "drop.json"
    name = written(path)[0].scene
    assert pinned(name) == name and name.startswith(f"{path}@")
    forget()
    written(path, duration=0.1)
    with pytest.raises(posed.SceneError, match="has changed"):
        forget()
        pinned(name)
