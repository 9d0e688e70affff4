"""Exports in full: what each format holds of a row, line by line, and that it can be read again."""

import csv
import io
import json
import os
import xml.etree.ElementTree as ElementTree
from dataclasses import replace

import pandas as pd
import pytest
from junitparser import TestSuite

from reports import exports
from reports.findings import finding_line
from reports.matrix import legend, matrix_of, status_of
from validation.cells import Observation, Outcome, Slot
from validation.judging.rows import Row
from validation.records.store import Store, StoreError

ROW = Row(
    "run", "chipmunk", "7.3.1", "tuned", "impact", 2, {"e": 0.8, "v": 6.0}, 1 / 240, None, "impact/rebound_ratio",
    "rebound_ratio", "1", 0.75, 0.8, -0.05, 1e-12, "exact | law", "ok", "fail", "new", "nobody knew", "ab", 120, 0.1,
    source="Newton", log="its words", initial_change=["moved", "turned"], cells=["c1", "c2"], floor=0.5,
    slot={"scene": "impact", "params": {"e": 0.8, "v": 6.0}, "dimension": 2, "engine": "chipmunk", "profile": "tuned",
          "dt": 1 / 240, "iterations": None, "ulp": 0},
)  # fmt: skip
PASS = replace(ROW, value=0.8, error=0.0, physics="pass", standing=None, reason="", metric="rebound_speed")
KNOWN = replace(ROW, standing="known", profile="default", slot={**ROW.slot, "profile": "default"})
SWEPT = replace(PASS, iterations=20, slot={**ROW.slot, "iterations": 20})
SPATIAL = replace(PASS, dimension=3, slot={**ROW.slot, "dimension": 3})
CRASHED = replace(ROW, outcome="crashed", value=None, error=None, physics=None, standing=None, reason="it died")
SILENT = replace(CRASHED, outcome="timed_out", log="")


def plain(*rows):
    return [row.as_dict() for row in rows]


# ---- JSON and CSV --------------------------------------------------------------------------------------------------


def test_json_array_and_json_lines():
    rows = plain(ROW, PASS)
    text = exports.as_json(rows)
    assert json.loads(text) == rows
    assert text.startswith('[\n {\n  "run": "run",\n')
    lines = exports.as_jsonl(rows).split("\n")
    assert [json.loads(line) for line in lines[:-1]] == rows and lines[-1] == ""


@pytest.mark.parametrize("write", [exports.as_json, exports.as_jsonl])
def test_non_finite_json_refused_and_not_written(write):
    with pytest.raises(ValueError, match="not JSON compliant"):
        write(plain(replace(ROW, value=float("nan"))))


def test_csv_holds_all_fields_but_slot_and_log():
    text = exports.as_csv(plain(ROW, replace(PASS, initial_change=[], reason='=cmd|"x"', cells=["c1"])))
    assert "\r" not in text and text.endswith("\n")
    first, second = csv.DictReader(io.StringIO(text))
    assert first == {
        "run": "run", "engine": "chipmunk", "engine_version": "7.3.1", "profile": "tuned", "scene": "impact",
        "dimension": "2", "params": "e=0.8 v=6", "dt": repr(1 / 240), "iterations": "", "check": "impact/rebound_ratio",
        "metric": "rebound_ratio", "unit": "1", "value": "0.75", "truth": "0.8", "error": "-0.05",
        "tolerance": "1e-12", "because": "exact | law", "outcome": "ok", "physics": "fail", "standing": "new",
        "reason": "nobody knew", "state_hash": "ab", "steps": "120", "wall_time_s": "0.1", "source": "Newton",
        "initial_change": "moved;turned", "cells": "c1;c2", "floor": "0.5", "certificate": "", "skill": "", "null": "",
    }  # fmt: skip
    assert (second["initial_change"], second["reason"], second["cells"]) == ("", '\'=cmd|"x"', "c1")


# ---- Markdown ------------------------------------------------------------------------------------------------------


def test_contents_of_markdown():
    rows = plain(KNOWN, ROW, PASS, SPATIAL, CRASHED)
    matrix = matrix_of(rows)
    assert exports.as_markdown(rows) == "\n".join([
        "| scene | chipmunk/default<br>7.3.1 | chipmunk/tuned<br>7.3.1 |",
        "|---|---|---|",
        "| impact 2-D | 1 of 1 fail | 2 of 3 fail, 1 crashed, 1 new |",
        "| impact 3-D |  | 1 pass |",
        "", legend(matrix), "", status_of(matrix), "",
        "**CRASHED**: 1 check",
        "* " + finding_line(rows[4]).replace("|", "\\|"),
        "**FAIL, new**: 1 check",
        "* " + finding_line(rows[1]).replace("|", "\\|"),
        "**FAIL, known**: 1 check",
        "",
    ])  # fmt: skip


def test_markdown_of_an_engine_that_did_not_run():
    row = replace(CRASHED, engine="another", engine_version="", outcome="not_installed")
    assert exports.as_markdown(plain(row)).startswith("| scene | another/tuned<br> |\n|---|---|\n")


def test_markdown_notes_on_rankings_and_plane():
    """Each a paragraph of its own, in one line: what stands there must end no list or cell."""
    matched = replace(PASS, engine="mujoco", engine_version="3.3", profile="matched")
    out = replace(ROW, engine="mujoco", engine_version="3.3", metric="out_of_plane", value=0.25, truth=0.0,
                  standing="known", scene="im|pact")  # fmt: skip
    lines = exports.as_markdown(plain(PASS, matched, out)).split("\n")
    start = lines.index(status_of(matrix_of(plain(PASS, matched, out))))
    assert lines[start + 1] == lines[start + 3] == lines[start + 5] == ""
    assert lines[start + 2].startswith("mujoco/matched: the textbook law")
    assert lines[start + 4] == (
        "2-D scenes that leave their plane in a 3-D engine: mujoco/tuned 1 of 1 (farthest in im\\|pact: 0.25 m)"
    )
    assert lines[start + 6].startswith("**FAIL, known**")


# ---- JUnit ---------------------------------------------------------------------------------------------------------


def junit(*rows):
    return ElementTree.fromstring(exports.as_junit(plain(*rows)))


def test_suites_and_failures_of_junit():
    document = junit(ROW, KNOWN, PASS, SWEPT, SPATIAL, CRASHED)
    assert document.get("name") == "contact-crosscheck"
    suites = {suite.get("name"): suite for suite in document.iter("testsuite")}
    assert list(suites) == ["chipmunk/tuned", "chipmunk/default"]
    counts = {name: [suite.get(n) for n in ("tests", "failures", "errors")] for name, suite in suites.items()}
    assert counts == {"chipmunk/tuned": ["5", "1", "1"], "chipmunk/default": ["1", "0", "0"]}
    assert [document.get(n) for n in ("tests", "failures", "errors")] == ["6", "1", "1"]
    names = [(case.get("classname"), case.get("name")) for case in suites["chipmunk/tuned"].iter("testcase")]
    assert names == [
        ("chipmunk/tuned.impact2d", "rebound_ratio e=0.8 v=6 dt=0.00416667 it=own"),
        ("chipmunk/tuned.impact2d", "rebound_speed e=0.8 v=6 dt=0.00416667 it=own"),
        ("chipmunk/tuned.impact2d", "rebound_speed e=0.8 v=6 dt=0.00416667 it=20"),
        ("chipmunk/tuned.impact3d", "rebound_speed e=0.8 v=6 dt=0.00416667 it=own"),
        ("chipmunk/tuned.impact2d", "rebound_ratio e=0.8 v=6 dt=0.00416667 it=own"),
    ]


def test_junit_of_many_cases(monkeypatch):
    """Counted, not timed: 35 000 rows of `make soak` took half an hour of counting each suite anew for every case."""
    counted = []
    real = TestSuite.update_statistics
    monkeypatch.setattr(TestSuite, "update_statistics", lambda suite: counted.append(len(suite)) or real(suite))
    document = junit(*[replace(ROW, metric=f"metric[{k}]") for k in range(200)], PASS, KNOWN)
    assert [suite.get("tests") for suite in document.iter("testsuite")] == ["201", "1"]
    assert sum(counted) <= 3 * 202


def outcome_of(row):
    (case,) = junit(row).iter("testcase")
    return [(child.tag, child.get("message"), child.text) for child in case]


NO_VALUE = replace(ROW, value=None, error=None, physics=None, standing=None, reason="there is no apex")


@pytest.mark.parametrize("row", [CRASHED, SILENT])
def test_crashed_cell_as_a_junit_error(row):
    assert outcome_of(row) == [("error", finding_line(row.as_dict()), row.log or None)]


@pytest.mark.parametrize(
    "row",
    [ROW, replace(ROW, standing="drifted"), replace(PASS, standing="drifted"), replace(CRASHED, outcome="invalid"),
     replace(CRASHED, outcome="missing")],
)  # fmt: skip
def test_alarm_as_a_junit_failure(row):
    assert outcome_of(row) == [("failure", finding_line(row.as_dict()), None)]


@pytest.mark.parametrize(
    "row", [NO_VALUE, replace(CRASHED, outcome="not_installed"), replace(CRASHED, outcome="unsupported")]
)
def test_rows_without_a_verdict_skipped_with_a_reason(row):
    assert outcome_of(row) == [("skipped", row.reason, None)]


@pytest.mark.parametrize("row", [KNOWN, replace(ROW, standing="explained"), replace(ROW, standing=None)])
def test_known_failure_as_a_junit_pass_with_a_note(row):
    assert outcome_of(row) == [("system-out", None, finding_line(row.as_dict()))]


def test_pass_without_a_junit_message():
    assert outcome_of(PASS) == []


# ---- files and DataFrames ------------------------------------------------------------------------------------------


def test_all_files_are_written_in_utf_8(tmp_path):
    rows = plain(replace(ROW, reason="3 µm"))
    paths = exports.write_all(tmp_path, rows)
    assert paths == {name: tmp_path / name for name in ("rows.jsonl", "rows.csv", "summary.md")}
    texts = [exports.as_jsonl(rows), exports.as_csv(rows), exports.as_markdown(rows)]
    assert [path.read_bytes().decode("utf-8").replace(os.linesep, "\n") for path in paths.values()] == texts
    assert "3 µm" in texts[1] and "3 µm" in texts[2]


def test_file_of_null_rows(tmp_path):
    nulls = plain(replace(ROW, engine="none", profile="did nothing"))
    paths = exports.write_all(tmp_path, plain(ROW), nulls)
    assert list(paths) == ["rows.jsonl", "rows.csv", "summary.md", "nulls.csv"]
    (only,) = csv.DictReader(io.StringIO((tmp_path / "nulls.csv").read_text(encoding="utf-8")))
    assert (only["engine"], only["profile"]) == ("none", "did nothing")


@pytest.fixture
def two_runs(tmp_path, monkeypatch):
    """A folder of results with two runs: one cell each, with the rebound at 0.5 and at 0.8 of 0.8."""
    monkeypatch.chdir(tmp_path)
    slot = Slot("impact", (("e", 0.8),), 2, "nameless", "default", 1 / 240)
    ids = []
    for ratio, title in ((0.5, "first"), (0.8, "second")):
        store = Store(tmp_path / "crosscheck-out")
        asked = slot if title == "first" else replace(slot, params=(("e", 0.8), ("v", 5.0)))
        run, _ = store.start(title, [asked])
        store.add(
            run, Observation(asked, f"cell {title}", 1, "1.0", Outcome.OK, metrics={"rebound_ratio": (ratio, "")})
        )
        store.finish(run)
        store.close()
        ids.append(run.id)
    return ids


def ratio(table):
    return table[table["metric"] == "rebound_ratio"][["run", "value"]].values.tolist()


def test_load_of_the_usual_folder_or_another(two_runs, tmp_path):
    first, last = two_runs
    assert isinstance(exports.load(), pd.DataFrame)
    assert ratio(exports.load()) == ratio(exports.load(tmp_path / "crosscheck-out", "latest")) == [[last, 0.8]]
    assert ratio(exports.load("crosscheck-out", first)) == [[first, 0.5]]
    rows = exports.load_rows()
    assert {row.run for row in rows} == {last} and [r.value for r in rows if r.metric == "rebound_ratio"] == [0.8]
    assert {row.run for row in exports.load_rows("crosscheck-out", first)} == {first}


def test_null_answers_behind_rows_when_requested(two_runs):
    alone, both = exports.load(), exports.load(nulls=True)
    assert set(alone["engine"]) == {"nameless"} and set(both["engine"]) == {"nameless", "none"}
    assert both["engine"].tolist()[: len(alone)] == alone["engine"].tolist()


def test_missing_results_folder_not_created(tmp_path):
    with pytest.raises(StoreError):
        exports.load(tmp_path / "nothing")
    assert not (tmp_path / "nothing").exists()
