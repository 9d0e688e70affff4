"""Summaries that were kept: what is broken about the file costs the time to make them, and no run nor page."""

import sqlite3

import pytest

from reports.brief import FILE, Kept, Summary


def summary():
    return Summary(*({} for _ in Summary.__dataclass_fields__))


@pytest.fixture
def file(tmp_path):
    return tmp_path / FILE


def changed(file, *statements):
    with sqlite3.connect(file) as db:
        for statement in statements:
            db.execute(statement)
    db.close()


def test_file_that_is_no_database_left_unchanged(file):
    file.write_bytes(b"notes of somebody\n" * 100)
    kept = Kept(file.parent)
    kept.put("run", summary())
    assert kept.get("run") is None
    kept.close()
    assert file.read_bytes() == b"notes of somebody\n" * 100


def test_missing_or_foreign_summary_table(file):
    for statements in (["DROP TABLE kept"], ["DROP TABLE kept", "CREATE TABLE kept (other TEXT)"]):
        kept = Kept(file.parent)
        changed(file, *statements)
        kept.put("run", summary())
        assert kept.get("run") is None
        kept.close()


def test_summary_written_by_another_program(file):
    kept = Kept(file.parent)
    kept.put("run", summary())
    assert kept.get("run") == summary() and kept.get("other") is None
    for body in ("no JSON", "[]", "{}", "7"):
        changed(file, f"UPDATE kept SET body = '{body}'")
        assert kept.get("run") is None
    kept.put("run", summary())
    assert kept.get("run") == summary()
    changed(file, "UPDATE kept SET code = 'judged by other code'")
    assert kept.get("run") is None
    kept.close()


def test_summary_file_in_use_or_without_a_folder(file, monkeypatch):
    connect = sqlite3.connect
    monkeypatch.setattr(sqlite3, "connect", lambda path, timeout=5.0, **more: connect(path, 0.01 * timeout, **more))
    kept, other = Kept(file.parent), connect(file)
    other.execute("BEGIN EXCLUSIVE")
    kept.put("run", summary())
    other.rollback()
    other.close()
    assert kept.get("run") is None
    kept.close()
    nowhere = Kept(file.parent / "missing")
    nowhere.put("run", summary())
    assert nowhere.get("run") is None
    nowhere.close()
    assert not (file.parent / "missing").exists()
