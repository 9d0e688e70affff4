"""compare finds each planted change of the golden set, and nothing else."""

import json
from pathlib import Path

import pytest
from click.testing import CliRunner

from reports.command import main

GOLDEN = Path(__file__).parent.parent / "data" / "golden"


def compare(before, after, *options):
    arguments = ["compare", str(GOLDEN / f"{before}.jsonl"), str(GOLDEN / f"{after}.jsonl"), *options]
    return CliRunner().invoke(main, arguments)


def changes(before, after, *options):
    result = compare(before, after, "--json", *options)
    assert "Traceback" not in result.output
    return result.exit_code, json.loads(result.stdout)["changes"]


@pytest.mark.parametrize(
    ("planted", "kind", "metric", "exit_code"),
    [
        ("flip", "verdict flipped", "apex[1]", 1),
        ("drift", "value changed", "apex[1]", 1),
        ("slow", "speed changed", "time", 1),
    ],
)
def test_a_planted_change_is_found_and_nothing_else(planted, kind, metric, exit_code):
    code, found = changes("base", planted)
    assert [(c["kind"], c["metric"], c["regressed"]) for c in found] == [(kind, metric, True)]
    assert code == exit_code
    code, found = changes(planted, "base")
    assert [(c["kind"], c["metric"], c["regressed"]) for c in found] == [(kind, metric, False)]
    assert code == 0


@pytest.mark.parametrize("same", ["base", "noise"])
def test_equal_runs_and_noise_below_the_floor_change_nothing(same):
    assert changes("base", same) == (0, [])


def test_a_slow_down_is_the_factor_that_was_planted():
    _, (change,) = changes("base", "slow")
    assert change["size"] == pytest.approx(2.0)
    assert change["engine"] == "bullet"


def test_filters_and_exit_codes():
    assert changes("flip", "base", "--only-regressed") == (0, [])
    assert changes("flip", "base", "--fail-on", "changes")[0] == 1
    assert changes("base", "flip", "--fail-on", "never")[0] == 0
    assert changes("base", "drift", "--fail-on", "flips")[0] == 0


def test_text_and_markdown_name_the_row_and_the_command():
    text = compare("base", "flip").stdout
    assert "1 verdict flipped (1 regressed)" in text
    assert "crosscheck run bounce" in text
    markdown = compare("base", "flip", "--markdown").stdout
    assert "| verdict flipped | worse | chipmunk/tuned bounce 2-D" in markdown


def test_rows_of_one_side_only_are_said(tmp_path):
    lines = (GOLDEN / "base.jsonl").read_text().splitlines()
    shorter = tmp_path / "shorter.jsonl"
    shorter.write_text("\n".join(lines[1:]) + "\n")
    base = GOLDEN / "base.jsonl"
    result = CliRunner().invoke(main, ["compare", str(base), str(shorter), "--json"])
    assert [c["kind"] for c in json.loads(result.stdout)["changes"]] == ["only in A"]
    assert result.exit_code == 1
    result = CliRunner().invoke(main, ["compare", str(base), str(shorter), "--json", "--only-changed"])
    assert json.loads(result.stdout)["changes"] == []


@pytest.mark.parametrize("content", ["not json", '{"a": 1}', "[1, 2]"])
def test_a_file_of_something_else_is_refused_in_one_line(tmp_path, content):
    path = tmp_path / "x.jsonl"
    path.write_text(content)
    result = CliRunner().invoke(main, ["compare", str(path), str(path)])
    assert result.exit_code == 2
    assert len(result.stderr.strip().splitlines()) == 1
