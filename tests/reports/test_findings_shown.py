"""Findings as they are shown: a line per row, families by their worst row, refusals by their reason."""

import json

import pytest

from reports import findings
from reports.findings import alarms, families, finding_line, grouped, refusals, said, severity
from reports.wording import NEVER, row_id


def row(metric="creep", value=0.5, tolerance=0.1, standing="known", **more):
    """A row as plain data: off by its value, for its truth is zero."""
    slot = {"scene": more.get("scene", "incline"), "params": {"ratio": 0.99}, "dimension": 3, "engine": "mujoco",
            "profile": more.get("profile", "default"), "dt": 1 / 240, "iterations": more.get("iterations"),
            "ulp": 0}  # fmt: skip
    plain = {"scene": "incline", "dimension": 3, "engine": "mujoco", "profile": "default", "iterations": None,
             "metric": metric, "unit": "m/s", "value": value, "truth": 0.0, "error": value, "tolerance": tolerance,
             "because": "Coulomb", "reason": "it is soft", "outcome": "ok", "physics": "fail", "standing": standing,
             "slot": slot}  # fmt: skip
    return plain | more


COMMAND = "crosscheck run incline --param ratio=0.99 --dim 3 --engine mujoco --profile default --dt 1/240"


# ---- one line ------------------------------------------------------------------------------------------------------


def test_finding_line_with_engine_value_reason_and_command():
    assert finding_line(row()) == (
        "FAIL, known: mujoco/default incline 3-D ratio=0.99: creep 0.5 m/s, truth 0 m/s, tolerance 0.1 (Coulomb); "
        f"it is soft | {COMMAND}"
    )
    assert f"tolerance 0.1 (Coulomb) | {COMMAND}" in finding_line(row(reason=""))


def test_sweep_line_with_iterations_or_reason():
    assert finding_line(row(iterations=30)).startswith("FAIL, known: mujoco/default incline 3-D ratio=0.99 at 30 iter")
    bare = row(iterations=30)
    bare["slot"] = {**bare["slot"], "params": {}}
    assert finding_line(bare).startswith("FAIL, known: mujoco/default incline 3-D at 30 iterations: creep")
    crashed = row(value=None, outcome="crashed", reason="signal 11")
    assert finding_line(crashed) == f"CRASHED: mujoco/default incline 3-D ratio=0.99: signal 11 | {COMMAND}"


def test_units_and_digits_of_measured_values():
    off = row(value=0.123456789, truth=0.987654321, tolerance=0.0123456)
    assert said(off) == "creep 0.1235 m/s, truth 0.9877 m/s, tolerance 0.0123"
    assert said(off, 6) == "creep 0.123457 m/s, truth 0.987654 m/s, tolerance 0.0123"
    assert said(row(unit="1")) == "creep 0.5, truth 0, tolerance 0.1"
    assert said(row(value=None)) == "it is soft"
    assert said(row(reason=f"{NEVER} within 2 s")).startswith(f"creep {NEVER}, truth")


# ---- families ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("error", "tolerance", "found"),
    [(0.5, 0.1, 5.0), (-0.5, 0.1, 5.0), (None, 0.1, 0.0), (0.5, None, 0.0), (0.5, 0.0, 0.0), (0.0, 0.1, 0.0)],
)
def test_severity_of_a_row_in_tolerances(error, tolerance, found):
    assert severity(row(error=error, tolerance=tolerance)) == found


def test_rows_of_a_family_with_the_worst_first():
    interfaces = [row(f"impulse[{k}]", value) for k, value in ((1, 0.2), (12, -0.9), (3, 0.4))]
    others = [
        row("impulse_scatter"), row("impulse[1]", standing="new"), row("impulse[1]", profile="tuned"),
        row("impulse[1]", scene="stack"), row("impulse[1]", engine="bullet"),
    ]  # fmt: skip
    found = families([*interfaces[:2], *others, interfaces[2]])
    assert [(f.mark, f.engine, f.profile, f.scene, f.metric, len(f.rows)) for f in found] == [
        ("new", "mujoco", "default", "incline", "impulse", 1),
        ("known", "mujoco", "default", "incline", "impulse", 3),
        ("known", "mujoco", "default", "incline", "impulse_scatter", 1),
        ("known", "mujoco", "tuned", "incline", "impulse", 1),
        ("known", "mujoco", "default", "stack", "impulse", 1),
        ("known", "bullet", "default", "incline", "impulse", 1),
    ]
    assert [r["metric"] for r in found[1].rows] == ["impulse[12]", "impulse[3]", "impulse[1]"]
    assert found[1].worst["value"] == -0.9


@pytest.mark.parametrize("outcome", ["crashed", "timed_out", "missing"])
def test_cell_without_an_answer_told_once(outcome):
    lost = {"outcome": outcome, "value": None, "error": None, "physics": None, "standing": None}
    names = ("impulse[1]", "impulse[2]", "drift")
    first = [row(metric, **lost | {"reason": "SIGSEGV"}) for metric in names]
    found = families([*first, row("drift", **lost | {"reason": "SIGABRT"})])
    assert [(f.mark, f.metric, len(f.rows)) for f in found] == [(outcome, "*", 3), (outcome, "*", 1)]
    assert found[0].line.endswith("mujoco/default incline 3-D ratio=0.99: SIGSEGV (3 checks)")
    assert found[1].line.endswith(": SIGABRT")


def test_uncertified_run_told_once_with_its_reason():
    """It has values, but none that counts."""
    why = "bodies overlap at the start: 0.1, at most 1e-06; energy was gained: 2, at most 1e-09; a third"
    ended = {"outcome": "refused", "physics": None, "standing": "new"}
    (family,) = families([row("impulse[1]", **ended, reason=why), row("drift", **ended, reason=why)])
    told = "bodies overlap at the start: 0.1, at most 1e-06 (and 2 more)"
    assert family.line == f"REFUSED: mujoco/default incline 3-D ratio=0.99: {told} (2 checks)"
    assert families([row(**ended, reason="receipt mass: 2")])[0].line.endswith("ratio=0.99: receipt mass: 2")


def test_family_in_one_line_and_as_data():
    worst, mild = row("impulse[2]", 0.9, iterations=4), row("impulse[1]", 0.2, iterations=4)
    (family,) = families([mild, worst])
    line = "FAIL, known: mujoco/default incline 3-D ratio=0.99 at 4 iterations: impulse[2] 0.9 m/s, truth 0 m/s, " \
        "tolerance 0.1"  # fmt: skip
    assert family.line == f"{line}, the worst of 2 checks"
    assert families([worst])[0].line == line
    assert families([row()])[0].where == "3-D ratio=0.99"
    assert json.loads(json.dumps(family.as_dict())) == {
        "mark": "known", "engine": "mujoco", "profile": "default", "scene": "incline", "metric": "impulse",
        "count": 2, "worst": worst, "reason": "it is soft", "rows": [row_id(worst), row_id(mild)],
    }  # fmt: skip


def test_order_of_marks_by_weight_without_passes():
    marks = ["explained", "known", "drifted", "new", "refused", "invalid", "missing", "timed_out", "crashed"]
    ended = ("invalid", "missing", "timed_out", "crashed")
    rows = [row(standing=None if m in ended else m, outcome=m if m in ended else "ok") for m in marks if m != "refused"]
    rows.append(row(standing="new", outcome="refused"))
    rows.append(row(standing=None, outcome="refused"))
    rows += [row(standing=None), row(physics="pass", standing=None), row(physics="pass", standing="known")]
    assert [mark for mark, _ in grouped(rows)] == list(findings.ORDER)
    assert [family.mark for family in alarms(rows)] == list(findings.ALARMING)
    assert set(findings.ORDER) - set(findings.ALARMING) == {"fail", "known", "explained"}


# ---- refusals ------------------------------------------------------------------------------------------------------


def refused(outcome="unsupported", reason="it has no boxes", **more):
    return row(value=None, error=None, physics=None, standing=None, outcome=outcome, reason=reason, **more)


def test_unsupported_scenes_in_the_matrix_alone():
    assert list(refusals([row(), refused(), refused("not_installed")])) == []


def test_reasons_told_once_when_nothing_ran():
    rows = [refused(), refused(metric="other"), refused("not_installed", "pip install it", engine="bullet"),
            refused(scene="stack")]  # fmt: skip
    assert list(refusals(rows)) == [
        "UNSUPPORTED: mujoco incline: it has no boxes",
        "NOT INSTALLED: bullet: pip install it",
        "UNSUPPORTED: mujoco stack: it has no boxes",
    ]


def test_scene_file_that_an_engine_cannot_run():
    file = "/somewhere/my-scene.toml"
    rows = [row(), refused(scene=file), refused("not_installed", scene=file), refused(), row(scene=file)]
    assert list(refusals(rows)) == [f"UNSUPPORTED: mujoco {file}: it has no boxes"]


def test_single_line_for_a_missing_engine():
    rows = [
        refused("not_installed", "pip install it", engine="drake", scene=scene)
        for scene in ("incline", "stack", "slide")
    ]
    assert list(refusals(rows)) == ["NOT INSTALLED: drake: pip install it"]
