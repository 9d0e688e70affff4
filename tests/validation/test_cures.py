"""Cures: the smallest change that mends most and breaks nothing, told of the scene and dimension it was measured on."""

import io
import re
import shlex
from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner
from rich.console import Console

from adapters.engine_folder import CURES, inside
from adapters.registry import facts, find, names
from reports.command import curing, main
from reports.fixes import (
    changes_in_words,
    cure_of,
    cure_paste,
    cure_text,
    decided_by,
    fix,
    nothing_to_paste,
    told_cure,
    told_cures,
)
from validation.cells import Observation, Outcome, Slot, scene_of
from validation.fixes import search as cures
from validation.fixes.kept import Cure, cures_of, read, write
from validation.fixes.search import Unsearched, _best, _Trials, asked_of, search
from validation.metrics import OUT_OF_PLANE
from validation.posed import resolve
from validation.settings.switching import readings

CURE = Cure(
    "mujoco", "4.0.1", "default", "pinch", 2, ({}, {"margin": 1.05}), 5, 0, 12, "creep", "m/s", {"margin": 1.05}, 0.0,
    5.7e-5, 0.0157, 1.4e-6, {"cone": "elliptic", "solimp": (0.9999, 0.9999, 0.001, 0.5, 1.0)}, "tuned",
    ({"tolerance": 0.0},), 45, 1.5e-5, 2.5e-5,
)  # fmt: skip


def test_a_table_is_read_back_with_its_tuples(tmp_path):
    other = replace(CURE, dimension=3, before=None, changes={}, profile="", others=(), cost_before=None, left=5)
    write([CURE, other], tmp_path / "cures.csv")
    assert read(tmp_path / "cures.csv") == [CURE, other]
    mending = replace(CURE, mends=("creep", "turned"))
    write([mending], tmp_path / "cures.csv")
    assert read(tmp_path / "cures.csv") == [mending]


def test_old_table_of_cures_without_mended_checks(tmp_path):
    path = tmp_path / "cures.csv"
    write([CURE], path)
    later = ",mends,dt,alone,alone_after,panel,shown"
    head, line = path.read_text().splitlines()
    assert head.endswith(later)
    path.write_text(f"{head.removesuffix(later)}\n{line.rsplit(',', later.count(','))[0]}\n")
    assert "mends" not in path.read_text() and read(path) == [CURE]


def test_table_of_cures_with_numpy_numbers_or_unwritable(tmp_path):
    path = tmp_path / "cures.csv"
    write([replace(CURE, failing=np.int64(CURE.failing), truth=np.float64(CURE.truth))], path)
    assert read(path) == [CURE]
    with pytest.raises(TypeError, match="table of cures"):
        write([CURE, replace(CURE, dimension=3, changes={"solref": object()})], path)
    assert read(path) == [CURE]


def test_line_of_a_cure_with_error_and_cost():
    text = cure_text(CURE)
    assert text.startswith("2-D: cone=elliptic, solimp=0.9999 0.9999 0.001 0.5 1; creep at margin=1.05: ")
    assert "0.0157 -> 1.4e-6 m/s" in text and text.endswith("at 1.7 times the cost") and "\n" not in text
    assert "2 of 5 checks still fail" in cure_text(replace(CURE, left=2))
    told = cure_text(replace(CURE, metric="rebound_ratio", unit="1", before=1.00036, after=1.0, truth=1.0))
    assert "1.0004 -> 1, at" in told  # as many digits as tell them apart
    short = cure_text(replace(CURE, metric="acceleration", unit="m/s^2", before=0.0016, after=0.00416, truth=0.00439))
    assert "0.0016 -> 0.00416 m/s^2 (true: 0.00439), at" in short
    assert cure_text(replace(CURE, cost_after=CURE.cost_before)).endswith(", at the same cost")
    assert "no value -> 0.00416" in cure_text(replace(CURE, before=None, after=0.00416))
    assert cure_text(replace(CURE, left=5, changes={})).endswith("2-D: no setting helps (45 tried)")


def test_number_of_tried_settings_without_a_cure(monkeypatch):
    nothing = replace(CURE, left=CURE.failing, changes={})
    listed = {("pinch", 2): nothing, ("pinch", 3): replace(nothing, dimension=3, tried=30)}
    monkeypatch.setattr("reports.fixes.cures_of", lambda engine: listed)
    (said,) = told_cures("mujoco", "4.0.1", "pinch", "default", [2, 3])
    assert said == "no setting helps (45 tried in 2-D, 30 tried in 3-D)"


def test_settings_with_mostly_failed_checks_not_recommended(monkeypatch):
    most = replace(CURE, failing=20, left=19)
    monkeypatch.setattr("reports.fixes.cures_of", lambda engine: {("pinch", 2): most})
    assert told_cures("mujoco", "4.0.1", "pinch", "default", [2]) == [
        "2-D: the best settings found fix 1 of 20 checks (45 tried)"
    ]
    monkeypatch.setattr("reports.fixes.cures_of", lambda engine: {("pinch", 2): replace(most, left=10)})
    (said,) = told_cures("mujoco", "4.0.1", "pinch", "default", [2])
    assert said.startswith("best settings found, 2-D: cone=elliptic") and "10 of 20 checks still fail" in said


def test_planar_cures_not_told_in_space(monkeypatch):
    monkeypatch.setattr("reports.fixes.cures_of", lambda engine: {("pinch", 2): CURE})
    assert len(told_cures("mujoco", "4.0.1", "pinch", "default", [2, 3])) == 1
    assert told_cures("mujoco", "4.0.1", "pinch", "default", [3]) == []
    assert told_cures("mujoco", "4.0.2", "pinch", "default", [2]) == []
    assert told_cures("mujoco", "4.0.1", "pinch", "tuned", [2]) == []
    assert decided_by("mujoco", "4.0.1", "pinch", [3], "default", "tuned") == ""
    planar = decided_by("mujoco", "4.0.1", "pinch", [2], "default", "tuned")
    assert planar and decided_by("mujoco", "4.0.1", "pinch", [2, 3], "default", "tuned") == f"{planar} (2-D)"


def test_cure_of_a_row_s_own_check(monkeypatch):
    listed = {("pinch", 2): replace(CURE, mends=("creep", "turned"))}
    monkeypatch.setattr("reports.fixes.cures_of", lambda engine: listed)
    row = {"engine": "mujoco", "engine_version": "4.0.1", "scene": "pinch", "dimension": 2, "profile": "default"}
    row |= {"metric": "turned"}
    assert told_cure(row) == cure_text(CURE)
    other = told_cure({**row, "metric": "out_of_plane"})
    assert other == f"none is known for this check; for creep, turned in this scene, {cure_text(CURE)}"
    # What is told is mended in the cell that is told, though the same check fails elsewhere with the cure.
    listed["pinch", 2] = replace(CURE, cells=(*CURE.cells, {"margin": 100.0}), mends=("turned",))
    assert told_cure({**row, "metric": "creep", "params": {"margin": 1.05, "g": 9.81}}) == cure_text(CURE)
    assert "none is known" in told_cure({**row, "metric": "creep", "params": {"margin": 100.0}})
    unsearched = "none was searched for in this case; to search: crosscheck cure mujoco pinch"
    assert told_cure({**row, "dimension": 3}) == told_cure({**row, "engine_version": "4.0.2"}) == unsearched
    assert told_cure({**row, "profile": "tuned"}) == ""
    listed["pinch", 2] = CURE  # a table of before kinds were written down: what it tells is of its own metric
    assert told_cure({**row, "metric": "creep[1]"}) == cure_text(CURE)
    assert "none is known" in told_cure(row)
    listed["pinch", 2] = replace(CURE, left=5, changes={})
    assert told_cure({**row, "metric": "out_of_plane"}).startswith("2-D: no setting helps (45 tried)")


@pytest.mark.parametrize(
    ("case", "command"),
    [
        ({"params": {"margin": 3.0}}, "crosscheck cure mujoco pinch --param margin=3 --dim 2"),
        (
            {"params": {"mu": 5.0, "margin": 1.05}},
            "crosscheck cure mujoco pinch --param margin=1.05 --param mu=5 --dim 2",
        ),
        ({"dt": 1 / 500}, "crosscheck cure mujoco pinch --dt 1/500 --dim 2"),
        ({"params": {"margin": 100.0}}, "crosscheck cure mujoco pinch"),  # standard, though this table has it not
    ],
)
def test_cure_of_another_case_not_told(monkeypatch, case, command):
    monkeypatch.setattr("reports.fixes.cures_of", lambda engine: {("pinch", 2): replace(CURE, mends=("creep",))})
    row = {"engine": "mujoco", "engine_version": "4.0.1", "scene": "pinch", "dimension": 2, "profile": "default"}
    row |= {"metric": "creep", "params": {}, "dt": 1 / 240, "iterations": None, "outcome": "ok"}
    assert told_cure(row) == cure_text(CURE) and cure_of(row).changes == CURE.changes
    assert (
        told_cure(row | case) == f"none was searched for in this case; to search: {command}"
        and cure_of(row | case) is None
    )
    assert told_cure(row | case | {"outcome": "not_installed"}) == told_cure(row | case | {"profile": "tuned"}) == ""


def test_values_of_a_cure_for_the_asked_cell(monkeypatch):
    """What a profile chooses by the material is chosen anew: the listed numbers are those of the cell that is told."""
    listed = {("bounce", 2): replace(
        CURE, scene="bounce", cells=({}, {"e": 1.0}), metric="apex", params={"e": 1.0}, mends=("apex",),
        changes={"solref": "reflect", "kappa_elastic": 0.0, "kappa_plastic": 0.1, "smooth_condim": 1}, others=(),
    )}  # fmt: skip
    monkeypatch.setattr("reports.fixes.cures_of", lambda engine: listed)
    row = {"engine": "mujoco", "engine_version": "4.0.1", "scene": "bounce", "dimension": 2, "profile": "default"}
    row |= {"metric": "apex[1]", "dt": 1 / 240, "iterations": None}
    for params, damping in (({"e": 1.0}, -1000), ({}, -900)):
        found = cure_of(row | {"params": params})
        assert f'solref="0 {damping}"' in cure_paste(found) and found.params == params


def test_smallest_known_cure_for_pasting_or_none_without_lines(monkeypatch):
    listed = {("pinch", 2): replace(CURE, mends=("creep",))}
    monkeypatch.setattr("reports.fixes.cures_of", lambda engine: listed)
    monkeypatch.setattr("reports.fixes.pasteable", lambda *asked: "<option/>")
    row = {"engine": "mujoco", "engine_version": "4.0.1", "scene": "pinch", "dimension": 2, "profile": "default"}
    row |= {"metric": "creep", "params": {"margin": 1.05}, "dt": 1 / 240, "iterations": None}
    paste, said = fix(row, [], "tuned")
    assert paste == cure_paste(CURE) and "smallest" in said
    assert fix(row | {"dt": 1 / 500}, [], "tuned") == ("<option/>", "to paste (all that profile tuned changes):")
    assert fix(row | {"dt": 1 / 500}, [], "") == ("", "")
    monkeypatch.setattr("reports.fixes.pasteable", lambda *asked: "")
    export = (
        "crosscheck export pinch --param margin=1.05 --dt 1/500 --dim 2 --engine mujoco --profile tuned --to python"
    )
    said = f"nothing to paste: mujoco is set by calls; {export} writes them"
    assert fix(row | {"dt": 1 / 500}, [], "tuned") == ("", said)


def test_cure_of_an_engine_without_setting_lines_as_calls(monkeypatch):
    """Neither `explain` nor `cure` is silent about it, though no profile has the settings."""
    cure = replace(CURE, mends=("creep",), changes={"cone": "elliptic", "impratio": 10.0}, alone={}, profile="")
    monkeypatch.setattr("reports.fixes.cures_of", lambda engine: {("pinch", 2): cure})
    monkeypatch.setattr("adapters.mujoco.engine.snippet", lambda *asked: "")
    row = {"engine": "mujoco", "engine_version": "4.0.1", "scene": "pinch", "dimension": 2, "profile": "default"}
    row |= {"metric": "creep", "params": cure.params, "dt": 1 / 240, "iterations": None}
    paste, said = fix(row, [], "")
    assert paste == "" and said == nothing_to_paste(cure)
    start, command = said.split("; ")
    words = shlex.split(command.removesuffix(" writes them"))
    assert start == "nothing to paste: mujoco is set by calls"
    assert words[:3] == ["crosscheck", "export", "pinch"]
    done = CliRunner().invoke(main, words[1:])
    assert done.exit_code == 0 and "default+cone=elliptic+impratio=10" in done.output
    shown = Console(file=io.StringIO(), width=300)
    curing._show("mujoco", "pinch", 2, cure, shown)
    assert said in shown.file.getvalue()


def test_printed_fixes_with_words_of_their_engine():
    ours = {"mujoco": "reflect|stick|kappa|smooth_condim", "chipmunk": "start_overlap", "bullet": r"\biterations\b"}
    for engine, words in ours.items():
        for cure in cures_of(engine).values():
            every = (cure.changes, cure.alone, *cure.others)
            told = [f"{name}={value}" for each in every for name, value in changes_in_words(cure, each)]
            assert not re.search(words, " ".join([cure_text(cure), cure_paste(cure), *told])), cure


def test_single_line_for_a_cure_of_both_dimensions(monkeypatch):
    both = {("pinch", 2): CURE, ("pinch", 3): replace(CURE, dimension=3, cost_after=4.5e-5)}
    monkeypatch.setattr("reports.fixes.cures_of", lambda engine: both)
    (text,) = told_cures("mujoco", "4.0.1", "pinch", "default", [2, 3])
    assert text.startswith("smallest fix, 2-D and 3-D: cone=elliptic") and text.endswith("at 3 times the cost")
    both["pinch", 3] = replace(CURE, dimension=3, changes={"tolerance": 0.0})
    assert len(told_cures("mujoco", "4.0.1", "pinch", "default", [2, 3])) == 2


def test_pasted_values_of_a_cure():
    pytest.importorskip("mujoco")
    assert 'cone="elliptic"' in cure_paste(CURE) and 'solimp="0.9999 0.9999 0.001 0.5 1"' in cure_paste(CURE)
    assert cure_paste(replace(CURE, changes={})) == ""


def test_number_of_cases_searched_for_a_fix():
    for scene in ("impact", "bounce", "stack", "pinch"):
        found = asked_of(scene, 2)
        assert 1 <= len(found) <= cures.MOST_CELLS
        assert dict(resolve(scene).minimal(resolve(scene).representative)) in found


# ---- the search, on an engine whose settings do what a table says ----

NAMES = ("a", "b", "c")


class Toy:
    """Two checks fail as shipped; ``mended(settings)`` says by how many tolerances each is off."""

    profiles = ("default", "tuned")

    def __init__(self, off):
        self.off = off


def trials_of(monkeypatch, off, candidates, whole=None, handed=False, elsewhere=None):
    """Trials on one cell of which the first checks are off by ``off(settings)`` tolerances, the others by 0.

    In other sizes they are off by ``elsewhere(settings)``.
    """
    slot = Slot("pinch", (), 2, "toy", "default", 1 / 240)

    def observe(slots, jobs=1):
        found = {}
        for asked in slots:
            blank = Observation(asked, "c", 1, "1", Outcome.OK)
            checks = [each.check for each in readings(blank)]
            says = off if asked.scene == "pinch" else elsewhere
            by = says(dict(asked.switched) | ({"iterations": asked.iterations} if asked.iterations else {}))
            by = [*by, *[0.0] * (len(checks) - len(by))]
            metrics = {c.metric: (c.truth + k * c.bound, "") for c, k in zip(checks, by, strict=True)}
            found[asked] = replace(blank, metrics=metrics)
        return found

    monkeypatch.setattr(cures, "observe", observe)
    monkeypatch.setattr(cures, "values_of", lambda slot: dict.fromkeys(NAMES, 0))
    monkeypatch.setattr(cures, "load", lambda engine: Toy(off))
    monkeypatch.setattr(cures, "candidates_of", lambda engine: candidates)
    monkeypatch.setattr(cures, "belongs_of", lambda engine: {})
    monkeypatch.setattr(cures, "has_iterations", lambda engine, slot: False)
    monkeypatch.setattr(cures, "changes_of", lambda slot, name: dict(whole or {}))
    trials = _Trials([slot], 1, cures.in_other_size if elsewhere else lambda slot: ())
    failing = sum(each.badness > 1.0 for each in trials.start)
    every = _best("toy", trials, [slot], failing)
    best = every[0] if every else None
    found = best, [each for each in every if each.size == 1 and each.failing == best.failing]
    return (found, trials) if handed else found


def test_single_setting_that_mends_all_with_equivalents(monkeypatch):
    def off(s):
        return (0.5, 0.5) if s.get("b") == 2 or s.get("c") == 1 else (9.0, 9.0)

    best, singles = trials_of(monkeypatch, off, {"a": (1,), "b": (1, 2), "c": (1,)})
    assert best.failing == 0 and best.size == 1
    assert [dict(each.changes[0]) for each in singles] == [{"b": 2}, {"c": 1}]


def test_change_that_breaks_a_passed_check(monkeypatch):
    def off(s):
        return (0.0, 0.0, 1.5) if s.get("a") else (9.0, 0.5) if s.get("b") else (9.0, 9.0)

    best, _ = trials_of(monkeypatch, off, {"a": (1,), "b": (1,)})
    assert dict(best.changes[0]) == {"b": 1} and best.failing == 1


def test_two_settings_that_mend_only_together(monkeypatch):
    def off(s):
        return (0.5 if s.get("a") else 9.0, 0.5 if s.get("a") and s.get("c") else 9.0)

    best, _ = trials_of(monkeypatch, off, {"a": (1,), "b": (1,), "c": (1,)})
    assert dict(best.changes[0]) == {"a": 1, "c": 1} and best.failing == 0


def test_profile_reduced_to_necessary_settings(monkeypatch):
    def off(s):
        return (0.5, 0.5) if s.get("a") and s.get("c") else (9.0, 9.0)

    best, _ = trials_of(monkeypatch, off, {}, {"a": 1, "b": 1, "c": 1})
    assert dict(best.changes[0]) == {"a": 1, "c": 1} and best.failing == 0


def test_no_advice_without_a_helpful_change(monkeypatch):
    best, singles = trials_of(monkeypatch, lambda s: (9.0, 9.0), {"a": (1, 2)}, {"b": 1})
    assert best is None and singles == []


def test_told_check_mended_by_its_cure(monkeypatch):
    def off(s):
        return (8.0, 0.5) if s.get("b") else (9.0, 5.0)  # the first check stays wrong

    (best, _), trials = trials_of(monkeypatch, off, {"b": (1,)}, handed=True)
    failing = [each for each in trials.start if each.badness > 1.0]
    assert [each.check.metric for each in failing] == ["creep", "turned"]
    assert [each.check.metric for each in cures._shown(trials, failing, best)] == ["turned"]
    assert [each.check.metric for each in cures._shown(trials, failing, None)] == ["creep", "turned"]
    assert cures._mended(trials, failing, best) == ("turned",) and cures._mended(trials, failing, None) == ()


def test_cure_in_one_size_alone_not_counted(monkeypatch):
    """The same cells in other sizes at another step: what fails as shipped must be mended there as well."""

    def off(s):
        return (0.5, 0.5) if s.get("a") or s.get("b") else (9.0, 9.0)

    def small(s):
        return (0.5, 2.0) if s.get("a") else (0.5, 0.5) if s.get("b") else (0.5, 9.0)

    best, singles = trials_of(monkeypatch, off, {"a": (1,), "b": (1,)}, elsewhere=small)
    assert dict(best.changes[0]) == {"b": 1} and best.failing == 0 and len(singles) == 1
    best, _ = trials_of(monkeypatch, off, {"a": (1,)}, elsewhere=small)
    assert best.failing == 1


def test_single_best_setting_beside_a_cure_of_several(monkeypatch):
    def off(s):
        first = 0.5 if s.get("a") and s.get("c") else 2.0 if s.get("c") else 900.0
        return (first, 0.5 if s.get("c") else 9.0)

    (best, _), trials = trials_of(monkeypatch, off, {"a": (1,), "c": (1,)}, handed=True)
    told = cures._shown(trials, trials.start[:2], best)[0]
    changes, value = cures._alone(trials, told, best)
    assert dict(best.changes[0]) == {"a": 1, "c": 1} and changes == {"c": 1}
    assert value == pytest.approx(told.check.truth + 2.0 * told.check.bound)
    text = cure_text(replace(CURE, alone={"cone": "elliptic"}, alone_after=0.0034))
    assert text.endswith("; cone=elliptic alone: 0.0034 m/s")


@pytest.mark.parametrize("left, told", [(450.0, True), (451.0, False), (899.0, False)])
def test_single_setting_that_leaves_most_error(monkeypatch, left, told):
    def off(s):
        return (0.5 if s.get("a") and s.get("c") else left if s.get("c") else 900.0, 0.5 if s.get("c") else 9.0)

    (best, _), trials = trials_of(monkeypatch, off, {"a": (1,), "c": (1,)}, handed=True)
    changes, value = cures._alone(trials, cures._shown(trials, trials.start[:2], best)[0], best)
    assert (changes, value is not None) == (({"c": 1}, True) if told else ({}, False))


@pytest.mark.long
def test_real_engine_cured_by_its_documented_setting():
    """Chipmunk's box hops as it starts to slide, by an overlap that it is not given at the start."""
    pytest.importorskip("pymunk")
    found = search("chipmunk", "slide", 2)
    assert (found.failing, found.left) == (1, 0) and found.metric == "hop" and found.mends == ("hop",)
    assert list(found.changes) == ["start_overlap"] and found.before > found.tolerance > found.after
    assert found.cost_before > 0.0 and found.cost_after > 0.0
    passes, refuses = search("chipmunk", "incline", 2), search("chipmunk", "slide", 3)
    assert isinstance(passes, Unsearched) and passes.asked and "passes all" in passes.reason
    assert isinstance(refuses, Unsearched) and not refuses.asked


def test_passed_and_unsupported_cells_told_apart(monkeypatch):
    pytest.importorskip("pymunk")
    monkeypatch.setattr(cures, "candidates_of", lambda engine: {"start_overlap": (0.0,)})
    monkeypatch.setattr(cures, "clocked", lambda slots: (None, None))
    told = CliRunner().invoke(main, ["cure", "chipmunk", "incline", "slide"])
    assert told.exit_code == 0, told.output
    lines = told.stdout.splitlines()
    assert re.match(r"chipmunk incline 2-D: as shipped nothing is to be fixed: it passes all \d+ checks$", lines[0])
    refused = [line for line in lines if ": cannot run: " in line]
    assert [line.partition(":")[0] for line in refused] == ["chipmunk incline 3-D", "chipmunk slide 3-D"]
    assert "chipmunk slide 2-D: 1 of" in told.stdout


def test_engine_or_scene_without_candidates_told(monkeypatch):
    monkeypatch.setattr(cures, "asked_of", lambda scene, dimension: ())
    assert search("chipmunk", "incline", 2) == Unsearched(
        False, "incline has no standard case in 2-D at a profile's own iterations"
    )
    monkeypatch.setattr(cures, "profile_of", lambda engine, role: None)
    assert search("chipmunk", "incline", 2) == Unsearched(False, "chipmunk has no profile as shipped")


@pytest.mark.parametrize("engine", [name for name in names() if inside(name, CURES)])
def test_committed_cures_for_installed_release_and_existing_scenes(engine):
    listed = read(inside(engine, CURES))
    assert {cure.engine for cure in listed} == {engine}
    assert len({(cure.scene, cure.dimension) for cure in listed}) == len(listed) == len(cures_of(engine))
    for cure in listed:
        assert cure.dimension in resolve(cure.scene).dimensions and 0 < cure.failing <= cure.judged
        assert bool(cure.changes) == cure.helps and cure.left <= cure.failing
        assert [dict(cell) for cell in cure.cells] == [dict(cell) for cell in asked_of(cure.scene, cure.dimension)]
        assert find(engine).engine is None or cure.version == find(engine).version, "make cures"


def stated(engine, cure):
    """Checks that the cells of a cure state today, the plane of a lifted scene among them."""
    lifted = cure.dimension == 2 and 3 in facts(engine).dimensions
    metrics = {OUT_OF_PLANE: (0.0, "")} if lifted else {}
    slots = [Slot(cure.scene, tuple(sorted(c.items())), cure.dimension, engine, "default", 1 / 240) for c in cure.cells]
    return [each for slot in slots for each in readings(Observation(slot, "", 1, "", Outcome.OK, metrics=metrics))]


def test_fix_of_an_engine_that_is_not_installed(monkeypatch):
    """A kept fix is told everywhere: its settings do not need the engine."""
    monkeypatch.setattr("validation.fixes.panel.load", lambda name: pytest.fail("loads the engine"))
    cure = cures_of("physx")["incline", 3]
    assert cure_paste(cure) == "" and "solver=pgs, iterations=255" in cure_text(cure)


@pytest.mark.parametrize("engine", [name for name in names() if inside(name, CURES)])
def test_committed_cure_measured_with_today_s_checks(engine):
    """A check that came later may fail with a cure that is told as one of all checks: so it was with `out_of_plane`."""
    for cure in read(inside(engine, CURES)):
        known = stated(engine, cure)
        assert cure.judged == len(known), (
            f"{cure.scene} {cure.dimension}-D: crosscheck cure {engine} {cure.scene} --keep"
        )
        assert set(cure.mends) <= {each.check.metric.partition("[")[0] for each in known}


@pytest.mark.parametrize("engine", [name for name in names() if inside(name, CURES)])
def test_committed_cure_failed_before_and_passes_after(engine):
    """A check that still fails is no cure, however near it came."""
    told = [cure for cure in read(inside(engine, CURES)) if cure.helps]
    assert told
    for cure in told:
        where = f"{engine} {cure.scene} {cure.dimension}-D {cure.metric}"
        assert cure.before is None or abs(cure.before - cure.truth) > cure.tolerance, where
        assert cure.after is not None and abs(cure.after - cure.truth) <= cure.tolerance, where


def test_no_cure_from_a_profile_without_a_rank():
    pytest.importorskip("mujoco")
    assert cures._profiles("mujoco") == ["default", "tuned"]


def test_processes_and_refused_cells_of_a_search(monkeypatch):
    asked = []

    def refusing(slots, jobs):
        asked.append(([slot.engine for slot in slots], {slot.scene for slot in slots}, jobs))
        return {slot: Observation(slot, "", 0, "1.0", Outcome.UNSUPPORTED, "it has no slopes") for slot in slots}

    monkeypatch.setattr(cures, "observe", refusing)
    assert search("chipmunk", "incline", 2, jobs=3) == Unsearched(False, "it has no slopes")
    cells = len(asked_of("incline", 2))
    assert asked == [(["chipmunk"] * cells, {"incline"}, 3)]
    assert search("chipmunk", "incline", 2) and asked[-1][2] == 1


# ---- one case --------------------------------------------------------------------------------------------------------

BOX = """
name = "a heavy crate that nothing pushes"
dimension = 3
gravity = [0.0, 0.0, -9.81]
duration = 1.5
[[bodies]]
name = "ground"
shape = { type = "half_space", normal = [0.0, 0.0, 1.0] }
motion = "fixed"
[[bodies]]
name = "crate"
shape = { type = "box", half_extents = [0.4, 0.3, 0.3] }
mass = 12.0
pose = [0.0, 0.0, 0.3, 1.0, 0.0, 0.0, 0.0]
[[pairs]]
restitution = 0.0
friction = 7.0
[[checks]]
quantity = "crate.z"
value = 0.3
tolerance = "g * dt * dt"
because = "rests"
"""
MODEL = """
<mujoco><option timestep="0.004"/><worldbody><geom name="slab" type="plane" size="3 3 .1" friction="6"/>
<body name="crate" pos="0 0 .2"><freejoint/><geom type="box" size=".3 .25 .2" mass="3" friction="6"/></body>
</worldbody></mujoco>
"""


@pytest.mark.few(1)
@pytest.mark.parametrize(("name", "text"), [("crate.toml", BOX), ("crate.xml", MODEL)])
def test_smallest_change_for_a_file(tmp_path, name, text, monkeypatch):
    """With a friction of 6 or 7 MuJoCo's pyramid lets a box sink by a third of its size: the round cone is enough."""
    pytest.importorskip("mujoco")
    monkeypatch.setattr(cures, "candidates_of", lambda engine: {"cone": ("elliptic",), "impratio": (10.0,)})
    monkeypatch.setattr(cures, "_profiles", lambda engine: ["tuned"])
    monkeypatch.setattr(cures, "clocked", lambda slots: (None, None))
    (tmp_path / name).write_text(text)
    found = CliRunner().invoke(main, ["cure", "mujoco", str(tmp_path / name), "--dim", "3"], env={"COLUMNS": "80"})
    assert found.exit_code == 0, found.output
    first = re.search(r"^<option .*$", found.stdout, re.MULTILINE)
    assert first and first[0] == '<option cone="elliptic"/>'


def test_step_of_a_searched_case(monkeypatch):
    asked = []
    monkeypatch.setattr(
        "reports.command.curing.search", lambda *given: asked.append(given) or Unsearched(True, "it rests")
    )
    ask = ["cure", "chipmunk", "stack", "--param", "n=3", "--dt", "1/120", "--dim", "2"]
    assert CliRunner().invoke(main, ask).exit_code == 0
    assert asked == [("chipmunk", "stack", 2, 1, {"n": 3.0}, 1 / 120)]
    kept = CliRunner().invoke(main, [*ask, "--keep"])
    assert kept.exit_code == 2 and "keep: stores fixes of whole scenes of the catalogue" in kept.output


def test_scene_in_other_sizes():
    base, small = resolve("bounce"), resolve("bounce@0.3")
    own, made = base.scene(2, {"e": 0.5}), small.scene(2, {"e": 0.5})
    assert made.gravity == own.gravity and made.duration == pytest.approx(own.duration * 0.3**0.5)
    assert made.bodies[1].shape.radius == pytest.approx(0.3 * own.bodies[1].shape.radius)
    wanted = [(check.metric, check.truth, check.bound) for check in base.checks(own, 0.002 / 0.3**0.5)]
    assert [(check.metric, check.truth, check.bound) for check in small.checks(made, 0.002)] == wanted


def test_search_at_both_phases_of_a_blow():
    """MuJoCo's contacts are softer below 1 mm of overlap: a fix of solref alone rebounded there at 0.9 instead of 1."""
    assert len(cures.in_other_size(Slot("pinch", (), 3, "toy", "default", 1 / 240))) == 1
    found = cures.in_other_size(Slot("head_on", (("e", 1.0), ("ratio", 1.0)), 3, "mujoco", "default", 1 / 240))
    begins = []
    for slot in found:
        first, second = (body for body in scene_of(slot).bodies)
        gap = second.pose[0] - first.pose[0] - first.shape.radius - second.shape.radius
        begins.append(gap / (first.twist[0] - second.twist[0]) / slot.dt % 1.0)
    assert begins[1:] == pytest.approx(cures.PHASES) and {slot.dt for slot in found} == {cures.ELSEWHERE[1]}


@pytest.mark.few(4)
@pytest.mark.parametrize(
    "fix",
    [
        pytest.param(fix, id=f"{engine}-{scene}-{dimension}")
        for engine in ("bullet", "chipmunk", "mujoco")
        for (scene, dimension), fix in cures_of(engine).items()
        if fix.changes and any(each.name == "delay" for each in resolve(scene).parameters)
    ],
)
def test_kept_fix_of_a_blow_at_both_phases(fix):
    """At the same values as in the shown case."""
    pytest.importorskip({"bullet": "pybullet", "chipmunk": "pymunk"}.get(fix.engine, fix.engine))
    own = [
        Slot(fix.scene, tuple(sorted(cell.items())), fix.dimension, fix.engine, fix.shipped, fix.dt)
        for cell in fix.cells
    ]
    (found,) = _Trials(own, 1, cures.in_other_size).all([[fix.changes] * len(own)])
    assert not found.broken and found.failing <= fix.left
