"""How a command ends: what goes wrong is one line on stderr and a status of its own; names of files that fit."""

import base64
import errno
import gzip
import io
import json
import os
import sys
import zipfile
from pathlib import Path
from types import SimpleNamespace

import click
import pandas as pd
import pytest

import contact_crosscheck
from adapters.engine import EngineError
from adapters.isolation import IsolationError
from adapters.model import ReaderMissing
from adapters.scene import SceneError
from reports.command import files, group, statuses
from reports.page import takeaway
from validation.findings import FindingsError
from validation.records.store import MissingError, StoreError
from validation.workers import LimitError


def ended(capsys, raised):
    """Status and lines of a command that raises this."""

    @click.group(cls=group._Group)
    def main():
        pass

    @main.command()
    def do():
        print("begun")
        raise raised

    with pytest.raises(SystemExit) as end:
        main(["do"])
    out, err = capsys.readouterr()
    assert out in ("begun\n", "")
    return end.value.code, err


@pytest.mark.parametrize(
    ("raised", "status", "line"),
    [
        (SceneError("ball.mass: is 0"), statuses.WRONG_CALL, "ball.mass: is 0"),
        (EngineError("engine: none"), statuses.WRONG_CALL, "engine: none"),
        (MissingError("run: no such"), statuses.WRONG_CALL, "run: no such"),
        (FindingsError("findings: two"), statuses.WRONG_CALL, "findings: two"),
        (ReaderMissing("engine: drake is not installed"), statuses.INCOMPLETE, "engine: drake is not installed"),
        (LimitError("memory: too little"), statuses.INCOMPLETE, "memory: too little"),
        (IsolationError("process: none"), statuses.INCOMPLETE, "process: none"),
        (StoreError("store: is locked"), statuses.RESULTS, "store: is locked"),
        (ModuleNotFoundError("No module named 'x'", name="x"), statuses.INCOMPLETE,
         "x: is not installed here; crosscheck doctor says what is"),
        (ModuleNotFoundError("no such thing"), statuses.INCOMPLETE,
         "no such thing: is not installed here; crosscheck doctor says what is"),
        (OSError(errno.ENOSPC, "No space left", "a/file"), statuses.RESULTS, "a/file: No space left"),
        (OSError(errno.ENOSPC, "No space left"), statuses.RESULTS, "the output: No space left"),
        (OSError("odd"), statuses.RESULTS, "the output: odd"),
    ],
)  # fmt: skip
def test_error_as_one_line_and_a_status(capsys, monkeypatch, raised, status, line):
    monkeypatch.setattr(group, "_silence_stdout", lambda: None)
    assert ended(capsys, raised) == (status, f"crosscheck: {line}\n")


def test_ctrl_c_in_a_command(capsys):
    assert ended(capsys, KeyboardInterrupt()) == (statuses.INTERRUPTED, "")


def test_ctrl_c_while_modules_are_loaded(capsys, monkeypatch):
    def stopped():
        raise KeyboardInterrupt

    monkeypatch.setattr(contact_crosscheck, "foreign", stopped)
    with pytest.raises(SystemExit) as end:
        contact_crosscheck.main()
    assert end.value.code == contact_crosscheck.INTERRUPTED == statuses.INTERRUPTED
    assert capsys.readouterr() == ("", "")


def test_line_without_breaks_and_of_limited_length(capsys):
    status, err = ended(capsys, ModuleNotFoundError("first\nsecond"))
    assert (status, err) == (statuses.INCOMPLETE, "crosscheck: first\n")
    _, err = ended(capsys, ModuleNotFoundError("x" * 3000))
    assert err.startswith("crosscheck: xxx") and len(err) == len("crosscheck: ") + 2000 + 1


def test_status_told_without_a_reader(monkeypatch):
    def fail(*given, **named):
        raise OSError("gone")

    monkeypatch.setattr(group.click, "echo", fail)
    with pytest.raises(SystemExit) as end:
        group._leave("line", 7)
    assert end.value.code == 7


def test_closed_streams_replaced_and_others_kept(monkeypatch):
    out = sys.stdout
    monkeypatch.setattr(sys, "stdin", None)
    monkeypatch.setattr(sys, "stderr", None)
    group._open_streams()
    assert sys.stdout is out
    assert sys.stdin.read() == "" and sys.stderr.write("x") == 1
    assert sys.stdin.encoding.lower() == sys.stderr.encoding.lower() == "utf-8"
    assert sys.stderr.mode == "w" and sys.stdin.mode == "r"
    descriptors = sys.stdin.fileno(), sys.stderr.fileno()
    for stream, number in zip((sys.stdin, sys.stderr), descriptors, strict=True):
        stream.close()
        os.fstat(number)  # it stays open: the next file must not get its number
        os.close(number)


def test_stdout_redirected_and_special_files_kept(monkeypatch, tmp_path):
    with (tmp_path / "out").open("w") as stream:
        monkeypatch.setattr(sys, "stdout", stream)
        group._silence_stdout()
        stream.write("lost")
        stream.flush()
    assert (tmp_path / "out").read_text() == ""
    for odd in (io.StringIO(), SimpleNamespace(fileno=lambda: (_ for _ in ()).throw(ValueError("closed")))):
        monkeypatch.setattr(sys, "stdout", odd)
        group._silence_stdout()


# ---- names of files ----------------------------------------------------------------------------------------------


def refused(call, *given):
    with pytest.raises(SceneError) as error:
        call(*given)
    return str(error.value)


def test_output_to_a_file_or_a_full_folder():
    parameter = click.Option(["--junit", "junit_path"])
    assert files.FILE.convert("a/b.xml", None, None) == Path("a/b.xml")
    assert refused(files.FILE.convert, "a/", parameter, None) == "junit: a/ is a folder, not a file"
    assert refused(files.FILE.convert, "a/", None, None) == "file: a/ is a folder, not a file"
    assert files.FOLDER.convert("a/", None, None) == Path("a")
    long = 300 * "x"
    assert refused(files.FOLDER.convert, long, click.Option(["-o", "--output"]), None) == (
        f"output: {long[:40]}...: File name too long"
    )
    assert refused(files.FILE.convert, long, None, None).startswith("file: xxx")
    assert (files.FILE.name, files.FOLDER.name) == ("file", "folder")


def test_output_file_in_an_existing_folder(tmp_path):
    there = tmp_path / "there.txt"
    there.write_text("x")
    assert files.writable(there, "junit") == there and files.writable(tmp_path / "new", "junit") == tmp_path / "new"
    assert refused(files.writable, tmp_path, "junit") == f"junit: {tmp_path} is a folder, not a file"
    deep = tmp_path / "none" / "deep" / "new"
    assert refused(files.writable, deep, "junit") == f"junit: there is no folder {deep.parent}"
    assert files.writable(deep, "output") == deep
    assert files.folder(deep) == deep and files.folder(tmp_path) == tmp_path
    assert refused(files.folder, there) == f"out: {there} is a file, not a folder"
    assert refused(files.folder, there / "below", "parquet") == (
        f"parquet: {there / 'below'} cannot be made, {there} is not a folder that may be written"
    )
    assert files.nearest(deep) == tmp_path and files.nearest(there) == there
    assert files.nearest(Path("no-such-folder-here")) == Path.cwd()


def test_write_without_permission_told(tmp_path, monkeypatch):
    there = tmp_path / "there.txt"
    there.write_text("x")
    asked = []
    monkeypatch.setattr(files.os, "access", lambda path, mode: asked.append((path, mode)))
    for path, looked_at in ((there, there), (tmp_path / "new", tmp_path)):
        assert refused(files.writable, path, "csv") == f"csv: {path} may not be written"
        assert asked.pop() == (looked_at, os.W_OK)
    assert refused(files.folder, tmp_path / "new") == (
        f"out: {tmp_path / 'new'} cannot be made, {tmp_path} is not a folder that may be written"
    )
    assert asked.pop() == (tmp_path, os.W_OK)
    assert refused(files.folder, tmp_path) == f"out: {tmp_path} may not be written; name a folder that may"


# ---- tables to take away -------------------------------------------------------------------------------------------


def test_page_tables_equal_to_rows_and_bench(monkeypatch):
    rows = [{"a": 1, "cells": "c", "b": 0.5}, {"a": 2, "cells": "d", "b": None}]
    monkeypatch.setattr(takeaway, "flattened", lambda row: row)
    table = pd.DataFrame({"slot": ["s", "t"], "x": [1.23456789, 2.0], "n": ["one", "two"]})
    bench = SimpleNamespace(tables={"work": table, "timings": table, "bare": table[["n"]]})
    rows_only, both = SimpleNamespace(rows=rows, bench=None), SimpleNamespace(rows=rows, bench=bench)
    (first,) = takeaway.takeaway(rows_only)
    again, second = takeaway.takeaway(both)
    assert again == first and takeaway.takeaway(both)[1] == second, "the same page of the same run"
    head = "data:application/gzip;base64,"
    packed = base64.b64decode(first.href.removeprefix(head))
    assert first.name == "rows.json.gz" and first.href.startswith(head) and len(packed) == first.size
    assert first.what == "all 2 values and their checks, a list per column: pandas.read_json"
    assert gzip.decompress(packed) == b'{"a":[1,2],"b":[0.5,null]}' and packed[4:8] == b"\0\0\0\0"
    assert packed == gzip.compress(
        json.dumps({"a": [1, 2], "b": [0.5, None]}, separators=(",", ":")).encode(), 9, mtime=0
    )
    head = "data:application/zip;base64,"
    content = base64.b64decode(second.href.removeprefix(head))
    assert (second.name, second.size) == ("bench.zip", len(content)) and second.href.startswith(head)
    assert second.what == "tables of the bench as CSV (its single timings: crosscheck bundle)"
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        assert archive.namelist() == ["work.csv", "bare.csv"]
        assert archive.read("work.csv").decode() == "x,n\n1.23457,one\n2,two\n"
        assert archive.read("bare.csv").decode() == "n\none\ntwo\n"
        assert all(each.compress_type == zipfile.ZIP_DEFLATED for each in archive.infolist())
        assert all(each.date_time == (1980, 1, 1, 0, 0, 0) for each in archive.infolist())
    assert takeaway.columns(SimpleNamespace(rows=[])) == {}
