"""The matrix as a reader sees it: every field, line, width and colour, and the sweeps beside it."""

import io
from collections import Counter

import pytest
from rich.console import Console

from reports.matrix import (
    ALARM,
    STYLES,
    Field,
    Matrix,
    leaving,
    legend,
    matrix_of,
    repeated,
    status_of,
    sweeps_of,
    tables_of,
    unranked,
    versions_of,
)


def row(scene, dimension, engine, profile, mark="pass", iterations=None):
    """What the matrix reads of a judged row."""
    outcome = mark if mark in ("unsupported", "crashed") else "ok"
    physics = None if outcome != "ok" else "pass" if mark == "pass" else "fail"
    standing = None if mark == "pass" or outcome == "crashed" else "known" if outcome == "unsupported" else mark
    return {"scene": scene, "dimension": dimension, "engine": engine, "profile": profile, "iterations": iterations,
            "metric": "drift",
            "outcome": outcome, "physics": physics, "standing": standing, "engine_version": "1.0+5f3a"}  # fmt: skip


def times(count, *what, **more):
    return [row(*what, **more) for _ in range(count)]


#: `flat` is planar; `deep` differs by dimension, is silent on one scene, and was swept.
ROWS = [
    *times(9, "impact", 2, "flat", "soft"), *times(2, "impact", 3, "flat", "soft", "unsupported"),
    *times(9, "impact", 2, "deep", "soft"), *times(9, "impact", 3, "deep", "soft"),
    *times(3, "impact", 2, "deep", "stiff"), *times(1, "impact", 2, "deep", "stiff", "explained"),
    *times(4, "impact", 3, "deep", "stiff"),
    *times(7, "stack", 2, "flat", "soft"), *times(2, "stack", 2, "flat", "soft", "known"),
    *times(1, "stack", 3, "flat", "soft", "unsupported"),
    *times(5, "stack", 2, "deep", "soft"), *times(1, "stack", 2, "deep", "soft", "new"),
    *times(5, "stack", 3, "deep", "soft"), *times(1, "stack", 3, "deep", "soft", "new"),
    *times(2, "stack", 2, "deep", "soft", "known", 30), *times(1, "stack", 2, "deep", "soft", iterations=4),
    *times(3, "stack", 3, "deep", "soft", iterations=4), *times(4, "stack", 3, "deep", "stiff", "known", 4),
    *times(1, "stack", 2, "flat", "soft", iterations=30),
]  # fmt: skip
VERSIONS = {"flat": "7.3.1", "deep": "1.0+5f3a.dirty"}


def shown(rows, width, versions=VERSIONS):
    stream = io.StringIO()
    console = Console(file=stream, width=width)
    for table in tables_of(matrix_of(rows), versions, width):
        console.print(table)
    return [line.rstrip() for line in stream.getvalue().splitlines()]


def test_full_matrix_in_a_wide_terminal():
    assert shown(ROWS, 100) == [
        "engine, profile      impact       stack",
        "─" * 52,
        "flat 7.3.1",
        "  soft 2-D           9 pass       2 of 9 fail",
        "  every profile 3-D  -            -",
        "deep 1.0",
        "  soft 2-D 3-D       9 pass       1 of 6 fail, 1 new",
        "  stiff 2-D          1 of 4 fail",
        "  stiff 3-D          4 pass",
    ]


def test_role_of_a_profile_beside_its_first_line():
    rows = [
        ROWS[0] | {"engine": "mujoco", "profile": profile, "dimension": d, "physics": said, "standing": None}
        for profile in ("default", "tuned")
        for d, said in ((2, "pass"), (3, "fail"))
    ]
    (table,) = tables_of(matrix_of(rows), {}, 100, roles=True)
    assert [str(text).strip() for text in table.columns[0].cells] == [
        "mujoco", "default 2-D (as shipped)", "default 3-D", "tuned 2-D", "tuned 3-D"
    ]  # fmt: skip


def test_further_tables_of_a_wide_matrix():
    assert [len(tables_of(matrix_of(ROWS), VERSIONS, width)) for width in (46, 45)] == [1, 2]
    apart = tables_of(matrix_of(ROWS), VERSIONS, 40)
    assert [[column.header for column in table.columns] for table in apart] == [
        ["engine, profile", "impact"], ["engine, profile", "stack"]]  # fmt: skip
    assert [len(table.rows) for table in apart] == [7, 7]
    assert shown(ROWS, 40)[:2] == ["engine, profile      impact", "─" * 29]
    assert len(tables_of(matrix_of(ROWS), VERSIONS, 1)) == 2  # one column at least, however narrow


@pytest.mark.parametrize("width", range(36, 60))
def test_no_width_cuts_a_count_short(width):
    """``12/19 fail`` cut to ``12/1`` would be a count that nobody made."""
    text = "\n".join(shown(ROWS, width))
    of = " of " if width >= 52 else "/"
    assert all(count in text for count in (f"2{of}9 fail", f"1{of}6 fail, 1 new", f"1{of}4 fail")) and "…" not in text


def test_colours_support_the_words_and_alarms_stand_out():
    (table,) = tables_of(matrix_of(ROWS), VERSIONS, 100)
    cells = [list(column.cells) for column in table.columns]
    assert [(text.plain, text.style) for text in cells[0]][:2] == [("flat 7.3.1", "bold"), ("  soft 2-D", "")]
    assert [getattr(text, "style", "") for text in cells[1]] == [
        "", STYLES["pass"], STYLES["unsupported"], "", STYLES["pass"], STYLES["explained"], STYLES["pass"]]  # fmt: skip
    assert [getattr(text, "style", "") for text in cells[2]][1:5] == [
        STYLES["known"], STYLES["unsupported"], "", ALARM]  # fmt: skip
    assert all(column.no_wrap for column in table.columns)
    (odd,) = tables_of(Matrix((("a", 2),), (("e", "p"),), {(("a", 2), ("e", "p")): Field(Counter(none=1))}), {}, 80)
    assert [getattr(text, "style", "") for text in odd.columns[1].cells][1] == ""


def test_engine_of_unknown_version():
    assert shown(ROWS, 100, {})[2] == "flat" and shown(ROWS, 100, {})[5] == "deep"


def test_matrix_without_rows():
    assert tables_of(matrix_of([]), {}, 80) == [] and sweeps_of(matrix_of([])) == []


def test_engine_asked_in_one_scene_not_called_unable():
    rows = [*ROWS, *times(1, "bounce", 3, "flat", "soft")]
    assert not any("every profile" in line for line in shown(rows, 120))
    assert any(line.split() == ["soft", "3-D", "-", "-", "1", "pass"] for line in shown(rows, 120))


def test_matrix_cell_without_rows_and_marks_in_another_order():
    rows = [row("impact", 2, "deep", "soft"), row("impact", 2, "deep", "soft", "known"),
            row("impact", 3, "deep", "soft", "known"), row("impact", 3, "deep", "soft")]  # fmt: skip
    assert shown(rows, 100)[3:] == ["  soft 2-D 3-D   1 of 2 fail"]


# ---- counting ------------------------------------------------------------------------------------------------------


def test_rows_at_iterations_asked_for_are_counted_apart():
    matrix = matrix_of(ROWS)
    assert matrix.lines == (("impact", 2), ("impact", 3), ("stack", 2), ("stack", 3))
    assert matrix.columns == (("flat", "soft"), ("deep", "soft"), ("deep", "stiff"))
    assert matrix.fields[("stack", 2), ("deep", "soft")].marks == Counter({"pass": 5, "new": 1})
    assert {key: dict(field.marks) for key, field in matrix.swept.items()} == {
        (("stack", 2), ("deep", "soft")): {"known": 2, "pass": 1},
        (("stack", 3), ("deep", "soft")): {"pass": 3},
        (("stack", 3), ("deep", "stiff")): {"known": 4},
        (("stack", 2), ("flat", "soft")): {"pass": 1},
    }
    assert matrix.counts == {"stack": (4, 30)}


def same_dimension(dimension, mark):
    return [row("stack", dimension, "deep", "soft", mark, 4)]


def test_sweep_line_with_dimensions_only_where_they_differ():
    assert sweeps_of(matrix_of(ROWS)) == [
        "stack at 4, 30 iterations instead of the profile's own, failed checks: "
        "flat/soft 0 of 1; deep/soft 2 of 3 2-D and 0 of 3 3-D; deep/stiff 4 of 4"
    ]
    three = [*same_dimension(2, "known"), *same_dimension(3, "pass"), *same_dimension(4, "known")]
    assert sweeps_of(matrix_of(three))[0].endswith("deep/soft 1 of 1 2-D 4-D and 0 of 1 3-D")
    same = [row("stack", d, "deep", "soft", iterations=4) for d in (2, 3)]
    asked = [row("stack", 3, "flat", "soft", "unsupported", 4), row("impact", 3, "deep", "soft", "known", 8)]
    assert sweeps_of(matrix_of([*same, *asked])) == [
        "stack at 4 iterations instead of the profile's own, failed checks: deep/soft 0 of 1",
        "impact at 8 iterations instead of the profile's own, failed checks: deep/soft 1 of 1",
    ]


def test_versions_are_those_that_ran():
    nothing = {**row("impact", 2, "gone", "soft"), "engine_version": ""}
    assert versions_of([*ROWS, nothing]) == {"flat": "1.0+5f3a", "deep": "1.0+5f3a"}


def test_the_legend_explains_what_occurs():
    assert legend(matrix_of(ROWS)) == (
        "A check is one measured quantity of one case; it fails outside its tolerance. "
        "A dash: the engine cannot run the scene."
    )
    broken = Matrix((), (), {(("a", 2), ("e", "p")): Field(Counter({"invalid": 2, "pass": 1}))})
    assert "INVALID: the measurement contradicts itself" in legend(broken) and "dash" not in legend(broken)


def test_regression_status_apart_from_the_size_of_errors():
    """Of sweeps as well: `crosscheck findings` lists them with the others."""
    assert status_of(matrix_of(ROWS)) == (
        "Regression status of what fails: 2 new, 8 known (cause on record), "
        "1 explained (the engine's contact model predicts them)."
    )
    assert status_of(matrix_of([row("impact", 2, "deep", "soft")])) == ""
    unlisted = status_of(matrix_of([row("impact", 2, "deep", "soft", "fail")]))
    assert unlisted == "Regression status of what fails: 1 without a list of known failures."
    field = Field(Counter({"pass": 6, "crashed": 2, "drifted": 1}))
    assert field.text == "3 of 9 fail, 2 crashed, 1 changed"


def test_field_of_an_exact_profile_that_refuses_some_checks():
    """Energy and overlap are judged in any of several motions; where it ends up is not."""
    assert Field(Counter({"pass": 2, "declined": 8})).text == "2 pass, 8 refused"


def test_missing_cell_counted_as_not_passed():
    """Who leaves cells out must not look better by it."""
    field = Field(Counter({"pass": 6, "missing": 2, "unsupported": 5}))
    assert (field.judged, field.missed, field.mark) == (8, 2, "missing")


def test_cases_that_ended_a_reused_process():
    """They have results, of a process of their own; the summary names each once, and no more than four."""
    alone = "in a process that had run others (2): the process was killed by SIGSEGV; alone it runs"
    rows = [row("impact", d, "deep", "soft") | {"reason": said} for d, said in ((2, alone), (2, alone), (3, ""))]
    assert repeated(rows) == [
        "Ended a process that had run other cases; alone it runs: deep/soft impact 2-D (why: explain)"
    ]
    assert repeated(rows[2:]) == []
    many = [row(f"s{k}", 2, "deep", "soft") | {"reason": alone} for k in range(6)]
    assert repeated(many)[0].endswith("deep/soft s3 2-D and 2 more (why: explain)")


def test_departures_from_the_plane_by_cells_at_own_iterations():
    """Those that fail are told of all that were judged; without an answer there is no plane to leave."""

    def cell(engine, value, mark="known", scene="stack", metric="out_of_plane", **more):
        judged = row(scene, 2, engine, "soft", mark, **more)
        return {**judged, "metric": metric, "value": None if mark == "crashed" else value}

    flat = [cell("flat", 0.0, "pass"), cell("flat", 9.0, metric="drift"), cell("flat", 9.0, iterations=4)]
    lost = cell("flat", 9.0, "crashed")
    assert leaving([*flat, lost]) == []
    tipping = [cell("deep", 0.25, scene="pinch"), cell("deep", 0.5, "pass"), cell("deep", 0.004, "new")]
    assert leaving([*flat, lost, *tipping]) == [
        "2-D scenes that leave their plane in a 3-D engine: deep/soft 2 of 3 (farthest in pinch: 0.25 m)"
    ]
    others = [cell("wide", far, scene=scene) for far, scene in ((0.1, "stack"), (0.3, "arch"), (0.2, "slide"))]
    assert leaving([*tipping, *others]) == [
        "2-D scenes that leave their plane in a 3-D engine: deep/soft 2 of 3 (farthest in pinch: 0.25 m), "
        "wide/soft 3 of 3 (farthest in arch: 0.3 m)"
    ]


def test_note_of_a_profile_without_rank_only():
    """MuJoCo's `matched` is one; an engine that nobody knows is not asked."""
    columns = [("mujoco", "default"), ("mujoco", "matched"), ("nobody", "matched"), ("chipmunk", "tuned")]
    [line] = unranked(columns)
    assert line.startswith("mujoco/matched: the textbook law instead of the engine's own")
    assert unranked(columns[:1]) == unranked(columns[2:]) == []
