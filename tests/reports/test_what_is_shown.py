"""What is shown is what was judged: every digit, every count, every alarm, in every format."""

import csv
import io
import json
import xml.etree.ElementTree as ElementTree
from dataclasses import replace

import pytest

from reports import exports
from reports.findings import finding_line, grouped
from reports.matrix import Field, matrix_of
from reports.wording import MARKS, mark_of, markdown, number
from validation.judging.rows import Row

VALUE, TRUTH = 0.12345678901234567, 0.8
ROW = Row(
    "run", "chipmunk", "7.3.1", "tuned", "impact", 2, {"e": 0.8}, 1 / 240, None, "impact/rebound_ratio",
    "rebound_ratio", "1", VALUE, TRUTH, VALUE - TRUTH, 1e-12, "exact law", "ok", "fail", "new", "nobody knew", "ab",
    120, 0.1, slot={"scene": "impact", "params": {"e": 0.8}, "dimension": 2, "engine": "chipmunk", "profile": "tuned",
                    "dt": 1 / 240, "iterations": None, "ulp": 0},
)  # fmt: skip
PASS = replace(ROW, value=TRUTH, error=0.0, physics="pass", standing=None, reason="")


def with_outcome(outcome):
    return replace(ROW, value=None, error=None, physics=None, standing=None, outcome=outcome, log="its last words")


#: Every kind of row: what makes the command fail, and what does not.
ALARMING = {
    "new": ROW,
    "drifted": replace(ROW, standing="drifted"),
    "a pass that drifted": replace(PASS, standing="drifted"),
    "no value, and not listed": replace(ROW, value=None, error=None, physics=None),
    "invalid": with_outcome("invalid"),
    "refused, in the standard suite": replace(with_outcome("refused"), standing="new"),
    "crashed": with_outcome("crashed"),
    "timed_out": with_outcome("timed_out"),
    "missing": with_outcome("missing"),
    "unsupported, and not listed": replace(with_outcome("unsupported"), standing="new"),
}
QUIET = {
    "pass": PASS,
    "known": replace(ROW, standing="known"),
    "a pass within the band of a finding": replace(PASS, standing="known"),
    "explained": replace(ROW, standing="explained"),
    "unlisted": replace(ROW, standing=None),
    "no value, listed": replace(ROW, value=None, error=None, physics=None, standing="known"),
    "unsupported": replace(with_outcome("unsupported"), standing="known"),
    "not_installed": with_outcome("not_installed"),
    "refused, of a file": with_outcome("refused"),
}


def junit(row):
    (case,) = ElementTree.fromstring(exports.as_junit([row.as_dict()])).iter("testcase")
    return {child.tag for child in case} & {"failure", "error"}


@pytest.mark.parametrize("name", ALARMING)
def test_failure_everywhere_for_what_fails_the_command(name):
    row = ALARMING[name]
    assert row.alarming
    assert junit(row)
    assert "* " + markdown(finding_line(row.as_dict())) in exports.as_markdown([row.as_dict()])
    assert [mark for mark, _ in grouped([row.as_dict()])] == [mark_of(row.as_dict())]


@pytest.mark.parametrize("name", QUIET)
def test_failure_nowhere_for_what_does_not_fail_the_command(name):
    row = QUIET[name]
    assert not row.alarming
    assert not junit(row)


def test_full_digits_in_every_format():
    plain = [ROW.as_dict()]
    (row,) = csv.DictReader(io.StringIO(exports.as_csv(plain)))
    assert float(row["value"]) == VALUE
    assert float(row["error"]) == VALUE - TRUTH
    assert float(row["dt"]) == 1 / 240
    assert json.loads(exports.as_jsonl(plain))["value"] == json.loads(exports.as_json(plain))[0]["value"] == VALUE


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [
        (None, 4, "-"), (0.0, 4, "0"), (0.123456, 4, "0.1235"), (-0.123456, 4, "-0.1235"), (1.0, 4, "1"),
        (5500.0, 4, "5500"), (99999.0, 4, "100000"), (1e5, 4, "1.00e+5"), (1e-3, 4, "0.001"), (9.99e-4, 4, "9.99e-4"),
        (1.23456e-7, 4, "1.23e-7"), (1.23456e-12, 6, "1.2346e-12"), (2.5e10, 3, "2.5e+10"),
        (0.123456789, 6, "0.123457"),
    ],
)  # fmt: skip
def test_number_shown_literally(value, digits, text):
    assert number(value, digits) == text


def test_finding_with_value_truth_tolerance_and_command():
    line = finding_line(ROW.as_dict())
    assert line.startswith("FAIL, new: chipmunk/tuned impact 2-D e=0.8: ")
    for text in ("rebound_ratio 0.123457", "truth 0.8", "tolerance 1.0e-12", "exact law", "nobody knew"):
        assert text in line
    assert line.endswith("crosscheck run impact --param e=0.8 --dim 2 --engine chipmunk --profile tuned --dt 1/240")


# ---- the matrix ----------------------------------------------------------------------------------------------------


def field_of(*rows):
    (field,) = matrix_of([row.as_dict() for row in rows]).fields.values()
    return field


def test_failed_share_of_judged_rows_in_a_field():
    known = QUIET["known"]
    assert field_of(PASS, PASS, PASS).text == "3 pass"
    assert field_of(PASS, known, known).text == "2 of 3 fail"
    assert field_of(known, QUIET["no value, listed"], QUIET["unsupported"]).text == "1 of 1 fail"
    assert field_of(PASS, QUIET["explained"], known, ROW).text == "3 of 4 fail, 1 new"
    assert field_of(QUIET["unsupported"]).text == "-"


def test_a_known_fail_is_never_counted_as_clean():
    assert mark_of(QUIET["known"].as_dict()) == "known"
    assert "pass" not in field_of(QUIET["known"]).text
    assert field_of(PASS, QUIET["known"]).missed == 1


@pytest.mark.parametrize("worse, better", [(a, b) for i, a in enumerate(MARKS) for b in MARKS[i + 1 :]])
def test_mark_of_a_field_by_its_worst_row(worse, better):
    from collections import Counter

    assert Field(Counter({better: 5, worse: 1})).mark == worse
    assert Field(Counter({worse: 1, better: 5})).mark == worse


def test_alarms_are_worse_than_everything_else():
    alarms = {mark_of(row.as_dict()) for row in ALARMING.values()}
    quiet = {mark_of(row.as_dict()) for row in QUIET.values()} & set(MARKS)
    assert max(map(MARKS.index, alarms)) < min(map(MARKS.index, quiet))


def test_one_field_for_each_scene_dimension_engine_and_profile():
    rows = [ROW, replace(ROW, scene="bounce"), replace(ROW, dimension=3), replace(ROW, engine="bullet"),
            replace(ROW, profile="default")]  # fmt: skip
    matrix = matrix_of([row.as_dict() for row in rows])
    assert len(matrix.fields) == 5
    assert {field.text for field in matrix.fields.values()} == {"1 of 1 fail, 1 new"}
