"""compare finds each planted change of the golden set, and nothing else."""

import json
import math
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
def test_comparison_of_equal_runs_and_noise(same):
    assert changes("base", same) == (0, [])


def test_factor_of_a_planted_slow_down():
    _, (change,) = changes("base", "slow")
    assert change["size"] == pytest.approx(2.0)
    assert change["engine"] == "bullet"


def test_comparison_with_filters_and_its_exit_code():
    assert changes("flip", "base", "--only-regressed") == (0, [])
    assert changes("flip", "base", "--fail-on", "changes")[0] == 1
    assert changes("base", "flip", "--fail-on", "never")[0] == 0
    assert changes("base", "drift", "--fail-on", "flips")[0] == 0


def test_text_and_markdown_name_the_row_and_the_command():
    text = compare("base", "flip").stdout
    assert "1 newly failing" in text
    assert "crosscheck run bounce" in text
    markdown = compare("base", "flip", "--markdown").stdout
    assert "| newly failing | worse | 1 | chipmunk/tuned bounce 2-D" in markdown


def test_rows_of_one_side_told(tmp_path):
    lines = (GOLDEN / "base.jsonl").read_text().splitlines()
    shorter = tmp_path / "shorter.jsonl"
    shorter.write_text("\n".join(lines[1:]) + "\n")
    base = GOLDEN / "base.jsonl"
    result = CliRunner().invoke(main, ["compare", str(base), str(shorter), "--json"])
    assert [(c["kind"], c["regressed"]) for c in json.loads(result.stdout)["changes"]] == [("not run in B", False)]
    assert result.exit_code == 0  # what was not run is no regression
    result = CliRunner().invoke(main, ["compare", str(base), str(shorter), "--json", "--only-changed"])
    assert json.loads(result.stdout)["changes"] == []


@pytest.mark.parametrize("fail_on", ["never", "regressions"])
def test_two_runs_without_a_common_check(tmp_path, fail_on):
    """It exited with 0, which a gate takes for "nothing got worse"."""
    lines = (GOLDEN / "base.jsonl").read_text().splitlines()
    rows = [line for line in lines if "value" in json.loads(line)]
    for name, line in (("a", rows[0]), ("b", rows[1])):
        (tmp_path / f"{name}.jsonl").write_text(line + "\n")
    sides = [str(tmp_path / "a.jsonl"), str(tmp_path / "b.jsonl")]
    result = CliRunner().invoke(main, ["compare", *sides, "--fail-on", fail_on])
    assert result.exit_code == 4 and "no check is in both; 1 only in B; 1 not run in B" in result.stdout
    assert CliRunner().invoke(main, ["compare", *sides, "--fail-on", "changes"]).exit_code == 1


@pytest.mark.parametrize("content", ["not json", '{"a": 1}', "[1, 2]"])
def test_refusal_of_a_file_of_something_else(tmp_path, content):
    path = tmp_path / "x.jsonl"
    path.write_text(content)
    result = CliRunner().invoke(main, ["compare", str(path), str(path)])
    assert result.exit_code == 2
    assert len(result.stderr.strip().splitlines()) == 1


@pytest.mark.parametrize("side", ["{}/none", "{}/none:latest", "none:latest"])
def test_refusal_of_a_missing_folder(tmp_path, side):
    """It was looked for as a run of another folder, and that folder was blamed."""
    asked = side.format(tmp_path)
    result = CliRunner().invoke(main, ["compare", str(GOLDEN / "base.jsonl"), asked, "--out", str(tmp_path / "out")])
    assert result.exit_code == 2
    assert result.stderr.startswith(f"crosscheck: run: there is no folder {asked.removesuffix(':latest')};")


def planted(tmp_path, change):
    """Path of the golden rows with ``change(row)`` done to every row that has a value and a tolerance."""
    lines = [json.loads(line) for line in (GOLDEN / "base.jsonl").read_text().splitlines()]
    for line in lines:
        if line.get("value") is not None and line.get("tolerance"):
            line |= {"floor": None, **change(line)}
            line["error"] = None if line["truth"] is None else line["value"] - line["truth"]
    path = tmp_path / "planted.jsonl"
    path.write_text("".join(json.dumps(line) + "\n" for line in lines))
    return path


@pytest.mark.parametrize(("share", "counts"), [(1e-9, False), (0.009, False), (0.02, True)])
def test_least_change_that_counts(tmp_path, share, counts):
    base = planted(tmp_path, lambda row: {})
    before = tmp_path / "before.jsonl"
    base.rename(before)
    after = planted(tmp_path, lambda row: {"value": row["value"] + share * row["tolerance"]})
    result = CliRunner().invoke(main, ["compare", str(before), str(after), "--json"])
    found = json.loads(result.stdout)["changes"]
    assert bool(found) == counts
    assert {c["kind"] for c in found} <= {"value changed"}


def test_difference_of_one_last_bit_ignored(tmp_path):
    before = planted(tmp_path, lambda row: {}).rename(tmp_path / "before.jsonl")
    after = planted(tmp_path, lambda row: {"value": math.nextafter(row["value"], math.inf)})
    result = CliRunner().invoke(main, ["compare", str(before), str(after)])
    assert result.exit_code == 0 and "in both: none changed" in result.stdout


def test_head_and_lines_of_a_comparison(tmp_path):
    before = planted(tmp_path, lambda row: {}).rename(tmp_path / "before.jsonl")
    change = {"run": "other", "engine_version": "9.9"}
    after = planted(tmp_path, lambda row: change | {"value": row["value"] + 0.5 * row["tolerance"]})
    text = CliRunner().invoke(main, ["compare", str(before), str(after)]).stdout
    assert text.startswith("A: ") and "\nB: other (" in text and "-> 9.9" in text
    every = json.loads(CliRunner().invoke(main, ["compare", str(before), str(after), "--json"]).stdout)
    lines = [line for line in text.splitlines() if line.startswith("value changed")]
    metrics = {(c["engine"], c["profile"], c["scene"], c["metric"].partition("[")[0]) for c in every["changes"]}
    assert len(lines) <= 2 * len(metrics) and len(metrics) <= len(every["changes"])
    assert every["b"]["versions"] and set(every["b"]["versions"].values()) == {"9.9"}
