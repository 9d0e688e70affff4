"""``crosscheck bench --targets``: the table as it is printed, its JSON, its refusals."""

import json

import pytest
from click.testing import CliRunner

from adapters import registry
from reports.command import main
from reports.command import targets as shown
from validation.bench import targets
from validation.bench.targets import AT_END, AT_ERROR, AT_SWEEPS, Row
from validation.records.store import Store

OURS, THEIRS = {"drift [m]": 3.5e-3, "sag [m]": 8.4e-4}, {"drift [m]": 1e-9, "sag [m]": 1.1e-3}
SHARE = {"ahead": 6, "levels": 40, "only_ours": 8}


def rows():
    """One of each kind: with a floor at equal error, with one at 10 sweeps and no equal error, a drift, a share."""

    def pair(against, at, told, asked, sweeps, reason=""):
        return Row("a column, plane", against, at, *told, *asked, OURS, THEIRS, sweeps, {"rounds": 9}, reason)

    none = (None, None, None)
    return [
        pair("first/default", AT_SWEEPS, (0.8333, 0.81, 0.86), none[:2], 10),
        pair("first/default", AT_ERROR, (0.7, 0.68, 0.72), (1.8, 2.4), 14),
        pair("second/tuned", AT_SWEEPS, (123.4, 120.0, 130.0), (5.0, 8.0), 10),
        pair("second/tuned", AT_ERROR, none, none[:2], None, f"{targets.NOT_THERE} up to 640 sweeps"),
        pair("third/default", AT_SWEEPS, none, (5.0, 8.0), 10, "it broke"),
        Row("it stands", "first/default", AT_END, 0.46, None, None, 0.1, None, OURS, THEIRS, 10, {}),
        Row("a share", "others", AT_ERROR, 0.15, None, None, 0.5, 0.8, {}, {}, None, SHARE),
    ]


@pytest.fixture
def measured(monkeypatch):
    asked = []
    monkeypatch.setattr(targets, "measure", lambda table, seed, tell: asked.append((table, seed)) or rows())
    return asked


def call(*arguments):
    return CliRunner().invoke(main, ["bench", "--targets", *map(str, arguments)])


def test_targets_table_by_opponent_within_a_hundred_columns():
    told = shown.lines(rows())
    assert max(map(len, told)) <= 100 and all(line == line.rstrip() for line in told)
    plain = [" ".join(line.split()) for line in told]
    assert "a column, plane; error: drift [mm], sag [mm]" in plain
    assert "first 0.83 [0.81 0.86] *0.70 [0.68 0.72] x14 3.5, 0.84 1.0e-6, 1.1 1.8/2.4 below floor" in plain
    assert "second *123 [120 130] not at this error 3.5, 0.84 1.0e-6, 1.1 5/8 meets target" in plain
    assert "third - 3.5, 0.84 1.0e-6, 1.1 5/8 below floor" in plain
    standing = plain[plain.index("it stands; error: drift [mm], sag [mm]") + 1]
    assert standing == "first 3.5, 0.84 1.0e-6, 1.1 <= 100 below floor"
    assert (
        plain[plain.index("a share: 6 of 40; 8 more are reached by ours only") + 1] == "others *15% 0.5/0.8 below floor"
    )


def test_json_rows_of_ratios_with_both_errors(measured, tmp_path):
    result = call("--json", "--seed", 7, "--out", tmp_path / "none")
    assert result.exit_code == 0, result.output
    data = json.loads(result.stdout)
    fields = {"scene", "against", "measured", "low", "high", "floor", "target", "our_error", "their_error", "sweeps"}
    assert all(fields | {"counts", "at", "mark"} <= set(row) for row in data["rows"])
    assert [row["mark"] for row in data["rows"]] == [row.mark for row in rows()]
    assert data["rows"][1]["our_error"] == OURS and data["protocol"]["seed"] == 7
    assert registry.solver() in data["protocol"]["versions"] and not (tmp_path / "none").exists()


def test_a_ratio_below_its_floor_is_no_failure(measured, tmp_path):
    result = call("--out", tmp_path)
    assert result.exit_code == 0 and "below floor" in result.stdout


def test_scene_outside_the_table_refused(measured):
    assert call("stack").exit_code == 0
    ((table, _),) = measured
    assert {case.scene for case in table.cases} == {"stack"} and len(table.cases) == 4
    refused = call("hilltop")
    assert refused.exit_code == 2 and "the table has no scene 'hilltop', only bounce, stack" in refused.output


def test_targets_without_a_stored_benchmark(measured, tmp_path):
    for made in (False, True):
        if made:
            Store(tmp_path).close()
        data = json.loads(call("--json", "--out", tmp_path).stdout)
        assert len(data["rows"]) == len(rows()) and any(tmp_path.iterdir()) == made
