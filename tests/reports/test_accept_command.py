"""``accept``: shows families, asks for the reason of each, and cannot be talked into what must not be listed."""

import io
import json
import re
import sys
from types import SimpleNamespace

import pytest
from click.testing import CliRunner
from rich.console import Console

from adapters import registry
from reports.command import accepting, main
from validation.findings import files
from validation.judging.acceptance import Change

FAMILY = """
[[family]]
id = "starved"
profiles = ["default"]
scene = "stack"
metrics = ["drift", "penetration", "settle_time", "kinetic_energy", "impulse_scatter", "interface_impulse",
           "load", "unbalanced"]
reason = "four sweeps do not solve a column of ten"
source = "its manual"
releases = ">=7.3,<7.4"
"""
CELL = ["run", "stack", "--param", "n=10", "--iterations", "1", "--engine", "chipmunk", "--profile", "default",
        "--dim", "2", "--jobs", "1"]  # fmt: skip
IMPACT = ["impact", "--param", "v=6", "--dim", "2", "--jobs", "1"]


def call(*arguments, **kwargs):
    return CliRunner().invoke(main, [str(a) for a in arguments], **kwargs)


@pytest.fixture(scope="module")
def out(tmp_path_factory):
    """One starved column, and its scatter from moved starts."""
    folder = tmp_path_factory.mktemp("accept")
    call(*CELL, "--out", folder)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(files, "findings_folder", lambda engine: folder / engine)
        result = call("accept", "--engine", "chipmunk", "--jobs", 1, "--out", folder)
    assert "4 cases with moved starts" in result.stderr, result.output
    return folder


@pytest.fixture
def findings(tmp_path, monkeypatch):
    """A folder of findings to write to."""
    monkeypatch.setattr(files, "findings_folder", lambda engine: tmp_path / engine)
    files.findings_of.cache_clear()
    yield tmp_path / "chipmunk"
    files.findings_of.cache_clear()


def accept(out, *arguments, **kwargs):
    return call("accept", "--engine", "chipmunk", "--out", out, *arguments, **kwargs)


def members(findings):
    return (findings / files.MEMBERS).read_text().splitlines()[1:] if findings.exists() else []


def test_no_listing_without_a_terminal_unless_named(out, findings):
    findings.mkdir()
    (findings / files.FAMILIES).write_text(FAMILY)
    result = accept(out)
    assert result.exit_code == 1
    assert "not accepted: starved" in result.stderr
    assert members(findings) == []


def test_run_after_nothing_was_accepted(out, findings):
    """Without a list no failure is new: `run` exited with 0 after every check had been refused."""
    assert call(*CELL, "--out", out).exit_code == 0
    result = accept(out)
    assert result.exit_code == 1 and "0 checks with 0 causes listed" in result.stdout, result.output
    assert "default-stack-interface-impulse" in result.stderr.partition("not accepted")[0], "an id is not cut off"
    assert f"write into {findings / files.FAMILIES} a [[family]] with id" in result.stderr
    assert members(findings) == [] and call(*CELL, "--out", out).exit_code == 1


def test_engine_without_failures(findings, tmp_path):
    """It had no list after `accept`, so that no later failure was ever new."""
    run = ["run", *IMPACT, "--engine", "chipmunk", "--profile", "tuned", "--out", tmp_path / "out"]
    assert call(*run).exit_code == 0
    accepted = accept(tmp_path / "out")
    assert accepted.exit_code == 0, accepted.output
    assert "0 checks with 0 causes" in accepted.stdout and "every other failure is new" in accepted.stdout
    assert not files.findings_of("chipmunk").members and call(*run).exit_code == 0
    failing = call(*CELL, "--out", tmp_path / "out")
    assert failing.exit_code == 1 and "new" in failing.stdout


def test_a_run_without_a_case_of_the_engine(findings, tmp_path):
    call("run", *IMPACT, "--engine", "mujoco", "--out", tmp_path / "out")
    refused = accept(tmp_path / "out")
    assert refused.exit_code == 2 and "has no case of the standard suite on chipmunk" in refused.stderr
    assert not findings.exists()


def test_accepted_family_listed_and_run_quiet(out, findings):
    findings.mkdir()
    (findings / files.FAMILIES).write_text(FAMILY)
    result = accept(out, "--family", "starved")
    assert result.exit_code == 0 and "as before" not in result.stdout, result.output
    listed = members(findings)
    assert len(listed) > 5
    assert all(line.startswith("starved,default,2,n=10,1/240,1,") for line in listed)
    assert call(*CELL, "--out", out).exit_code == 0
    again = accept(out, "--family", "starved")
    assert members(findings) == listed and again.stdout.strip().endswith("members.csv, as before"), again.output
    # More digits than a band needs are somebody's, and none of ours to take away.
    finer = (findings / files.MEMBERS).read_text().replace("e-", "00e-").encode()
    (findings / files.MEMBERS).write_bytes(finer)
    files.findings_of.cache_clear()
    accept(out, "--family", "starved")
    assert (findings / files.MEMBERS).read_bytes() == finer


def test_reason_of_every_family_at_a_terminal(out, findings, monkeypatch):
    monkeypatch.setattr(accepting, "_on_a_terminal", lambda: True)
    result = accept(out, input="one sweep is not enough\nits manual\n" + "\n" * 10)
    assert result.exit_code == 1  # the others got no reason
    (family,) = files.findings_of("chipmunk").families.values()
    assert (family.reason, family.source) == ("one sweep is not enough", "its manual")
    assert family.profiles == ("default",) and family.scene == "stack" and len(family.metrics) == 1
    listed = files.findings_of("chipmunk").members
    assert {key[6].partition("[")[0] for key in listed} == set(family.metrics)
    # Asked again about a family that has not changed since, it does not ask.
    assert "is this still the cause" not in accept(out, input="\n" * 10).stderr


def test_family_without_a_reason_refused(out, findings):
    result = accept(out, "--family", "default-stack-drift")
    assert result.exit_code == 2
    assert "has no reason" in result.stderr
    assert members(findings) == []


def test_table_of_rows_per_family_aligned():
    """Listed are those that stay, those that drifted, those that are gone and those with another band."""
    counts = {"one": (111, 2, 30, 4, 5), "another": (0, 12345, 0, 0, 0)}
    changes = [
        Change(SimpleNamespace(id=name, reason="four sweeps" if name == "one" else ""),
               *(dict.fromkeys(range(number)) for number in each)) for name, each in counts.items()
    ]  # fmt: skip
    told = io.StringIO()
    accepting._print_changes("toy", changes, Console(file=told, width=80))
    title, header, first, second, *reasons = (line for line in told.getvalue().splitlines() if re.search(r"\w", line))
    assert title.strip() == "Known failures of toy: checks per cause"
    assert [re.split(r" {2,}", line.strip()) for line in (header, first, second)] == [
        ["cause", "listed", "new", "changed", "gone", "other band"],
        ["one", "150", "2", "30", "4", "5"],
        ["another", "0", "12345", "0", "0", "0"],
    ]
    ends = [[found.end() for found in re.finditer(r"other band|\S+", line)][1:] for line in (header, first, second)]
    assert ends[0] == ends[1] == ends[2]
    assert [line.strip() for line in reasons] == ["one: four sweeps", "another: none yet"]


def test_band_remeasured_from_further_starts_when_it_hides(out, findings):
    findings.mkdir()
    (findings / files.FAMILIES).write_text(FAMILY)
    accept(out, "--family", "starved")
    path = findings / files.MEMBERS
    kept = path.read_text()
    place, line = next((k, line) for k, line in enumerate(kept.splitlines()) if files.TO in line)
    *cell, value, _ends = line.split(",")
    lines = kept.splitlines()
    lines[place] = ",".join((*cell, value, f"{3.0 * abs(float(value)):.1e}"))
    path.write_text("\n".join(lines) + "\n")
    files.findings_of.cache_clear()
    asked = accept(out)  # a band as wide as this one holds the truth
    assert asked.exit_code == 1 and "not accepted: starved" in asked.stderr and path.read_text() != kept
    assert accept(out, "--family", "starved").exit_code == 0 and path.read_text() == kept


def test_table_of_changed_families_only(out, findings):
    findings.mkdir()
    other = FAMILY.replace('"starved"', '"elsewhere"').replace('"stack"', '"bounce"').replace("drift", "apex")
    (findings / files.FAMILIES).write_text(FAMILY + other)
    asked = accept(out).stderr
    assert "starved" in asked and "elsewhere" not in asked
    accept(out, "--family", "starved")
    files.findings_of.cache_clear()
    again = accept(out)
    assert again.exit_code == 0 and "checks per cause" not in again.stderr


def test_an_unknown_family_is_a_wrong_call(out, findings):
    result = accept(out, "--family", "unheard-of")
    assert result.exit_code == 2
    assert "no such cause" in result.stderr


def test_a_run_of_other_code_is_refused(out, findings, monkeypatch):
    monkeypatch.setattr("validation.cells.adapter_hash", lambda engine: "other")
    result = accept(out)
    assert result.exit_code == 2
    assert "was made by other code" in result.stderr


# ---- the exit status of a run says whether there is an alarm -------------------------------------------------------


@pytest.mark.long
def test_run_fails_on_new_and_drifted_rows_only(out, findings):
    findings.mkdir()
    (findings / files.FAMILIES).write_text(FAMILY)
    assert call(*CELL, "--out", out).exit_code == 1  # new
    accept(out, "--family", "starved")
    assert call(*CELL, "--out", out).exit_code == 0
    path = findings / files.MEMBERS
    lines = path.read_text().splitlines()
    fields = lines[1].split(",")
    low, high = map(float, fields[8].split(files.TO))
    fields[7:] = [str(high + (high - low)), str(0.1 * (high - low))]
    path.write_text("\n".join([lines[0], ",".join(fields), *lines[2:]]) + "\n")
    files.findings_of.cache_clear()
    assert call(*CELL, "--out", out).exit_code == 1  # drifted


def test_planned_cell_without_a_result(tmp_path, monkeypatch):
    from reports import progress

    monkeypatch.setattr(progress, "run_cells", lambda *arguments, **options: iter(()))
    cell = [
        "run",
        "impact",
        "--param",
        "v=6",
        "--engine",
        "chipmunk",
        "--profile",
        "tuned",
        "--jobs",
        "1",
        "--dim",
        "2",
    ]
    result = call(*cell, "--out", tmp_path)
    assert result.exit_code == 1
    assert "MISSING" in result.stdout


# ---- an adapter with a fault of two per cent cannot be blessed away ------------------------------------------------

FAULTY = """
from dataclasses import replace
from adapters.chipmunk import ChipmunkEngine
from adapters.conformance.planted_faults import Planted


class {name}(Planted):
    def __init__(self):
        super().__init__(ChipmunkEngine(), "{fault}", 0.02)
        self.facts = replace(self.inner.facts, name="weak{fault}", title="Weak", package="weak")

    facts = replace(ChipmunkEngine.facts, name="weak{fault}", title="Weak", package="weak")
    profiles = ChipmunkEngine.profiles
"""


@pytest.fixture
def weak(tmp_path, monkeypatch):
    """Chipmunk with two per cent of its reported impulses missing, and with two per cent less friction."""
    folder = tmp_path / "site"
    info = folder / "weak-1.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: weak\nVersion: 1\n")
    entries = ""
    for fault in ("impulse", "friction"):
        (folder / f"weak_{fault}.py").write_text(FAULTY.format(name=fault.title(), fault=fault))
        entries += f"weak{fault} = weak_{fault}:{fault.title()}\n"
    (info / "entry_points.txt").write_text(f"[{registry.GROUP}]\n{entries}")
    monkeypatch.syspath_prepend(str(folder))
    registry.forget()
    yield
    registry.forget()
    for fault in ("impulse", "friction"):
        sys.modules.pop(f"weak_{fault}", None)


@pytest.mark.few(1)
@pytest.mark.parametrize(("fault", "cell"), [("impulse", ["impact", "--param", "v=6"]),
                                             ("friction", ["incline", "--param", "ratio=1.1"])])  # fmt: skip
def test_fault_of_two_per_cent_not_listable(weak, findings, tmp_path, fault, cell):
    """It became known as what the engine's ways are: 288 rows of a reason that was another's."""
    findings = findings.with_name(f"weak{fault}")
    findings.mkdir()
    family = FAMILY.replace("default", "tuned").replace('"stack"', f'"{cell[0]}"')
    (findings / files.FAMILIES).write_text(family.replace('"drift"', '"impulse", "acceleration"'))
    own = ["--engine", f"weak{fault}", "--out", tmp_path / "out"]
    run = ["run", *cell, "--profile", "tuned", "--dim", 2, "--jobs", 1, *own]
    ran = call(*run, "--json")
    assert ran.exit_code == 1
    rows = json.loads(ran.stdout)
    assert {row["outcome"] for row in rows} == {"invalid" if fault == "impulse" else "ok"}
    assert any(row["metric"] == f"realised_{fault}" for row in rows)
    blessed = call("accept", "--family", "starved", *own)
    assert blessed.exit_code == 1, blessed.output
    assert ("invalid: " if fault == "impulse" else "its property checks do not hold") in blessed.stderr
    assert "{" not in blessed.stderr  # parameters in words
    assert not (findings / files.MEMBERS).exists() or members(findings) == []
    assert call(*run).exit_code == 1
