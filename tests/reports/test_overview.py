"""A run of many scenes is told by family: the matrix on one screen, then who is best, what is wrong, what fixes it."""

import io
import re

import pytest
from rich.console import Console

from reports import overview
from reports.answers import answers
from reports.summary import show
from validation.canonical import FAMILIES
from validation.catalogue import CATALOGUE

ENGINES = {"reference": ("reference",), "chipmunk": ("default", "tuned"), "bullet": ("default", "tuned", "one"),
           "mujoco": ("default", "tuned", "matched")}  # fmt: skip


def row(scene, engine, profile, mark="pass", dimension=2, value=0.5, metric="apex[1]"):
    """A judged row as a run gives it."""
    params = {"e": 0.8, "height": 1.0}
    slot = {"scene": scene, "params": params, "dimension": dimension, "engine": engine, "profile": profile,
            "dt": 1 / 240, "iterations": None, "ulp": 0}  # fmt: skip
    refused = mark == "unsupported"
    return {
        "scene": scene, "dimension": dimension, "engine": engine, "profile": profile, "iterations": None,
        "engine_version": "1.0+abc", "metric": metric, "unit": "m", "value": None if refused else value,
        "truth": 0.64, "error": None if refused else value - 0.64, "tolerance": 1e-3, "because": "so",
        "outcome": "unsupported" if refused else "ok", "reason": "it cannot", "dt": 1 / 240, "source": "law",
        "physics": None if refused else "pass" if mark == "pass" else "fail",
        "standing": "known" if refused else None if mark == "pass" else mark, "params": params, "slot": slot,
    }  # fmt: skip


def catalogue(marks=lambda scene, engine, profile: "pass"):
    """Ten rows of every scene, engine and profile; the sixth to the tenth are what ``marks`` says."""
    return [
        row(scene, engine, profile, "pass" if k < 5 else marks(scene, engine, profile))
        for scene in CATALOGUE
        for engine, profiles in ENGINES.items()
        for profile in profiles
        for k in range(10)
    ]


def shown(rows, width, **more):
    stream = io.StringIO()
    show(rows, Console(file=stream, width=width), **more)
    return stream.getvalue().splitlines()


def shipped_is_wrong(scene, engine, profile):
    return "explained" if (engine, profile) == ("mujoco", "default") and scene in ("bounce", "stack") else "pass"


@pytest.mark.parametrize("width", [80, 100])
def test_matrix_in_the_first_thirty_lines_of_the_catalogue(width):
    lines = shown(catalogue(shipped_is_wrong), width)
    assert max(map(len, lines)) <= width
    head, rest = "\n".join(lines[:30]), " ".join(" ".join(lines).split())
    for family in FAMILIES:
        assert all(word in head for word in family.split()), family
    for engine, profiles in ENGINES.items():
        at = lines.index(next(line for line in lines if line.split() == [engine]))
        assert tuple(line.split()[0] for line in lines[at + 1 : at + 1 + len(profiles)]) == profiles and at < 30
    assert "chipmunk 1.0" in head and "abc" not in head
    # half of the rows of bounce, of as many scenes as the family has
    scenes = overview.families_of(catalogue())["rebound"]
    line = next(
        line for line in lines[lines.index(next(x for x in lines if x.split() == ["mujoco"])) :] if "default" in line
    )
    assert f" {overview.share(5, 10 * len(scenes))} " in line
    assert re.search(r"stacks and statics +reference/reference, chipmunk/default, ", rest)
    assert re.search(r"mujoco/default bounce: rebounds [^;]*; profile tuned fixes it", rest)
    # What is matched is shown with what it is, and recommended nowhere.
    assert "mujoco/matched: the textbook law instead of the engine's own" in rest
    # What profiles are stands once: beside them where that is no wider than the terminal, else below.
    beside, below = "  default (as shipped)" in head, "; default: as shipped" in rest
    assert beside is (width == 100) and below is (width == 80)
    assert not re.search(r"mujoco/matched[ ,(]|profile matched", rest)
    assert "crosscheck show --all" in rest


def test_all_scenes_shown_when_requested_or_few():
    every = shown(catalogue(), 80, every=True)
    headings = " ".join(line for line in every if line.startswith("engine, profile"))
    assert all(scene in headings.split() for scene in CATALOGUE)
    few = shown([r for r in catalogue() if r["scene"] in ("bounce", "stack")], 80)
    assert few[0].split() == ["engine,", "profile", "bounce", "stack"] and "show --all" not in "\n".join(few)


def test_a_screen_too_narrow_for_families_shows_scenes():
    lines = shown(catalogue(), 40)
    assert lines[0].startswith("engine, profile") and "…" not in "\n".join(lines)


@pytest.mark.parametrize(("mark", "said"), [("new", " !"), ("drifted", " !"), ("fail", ""), ("known", "")])
def test_failing_share_and_mark_of_the_unexpected(mark, said):
    rows = catalogue(lambda scene, engine, profile: mark if (scene, profile) == ("slide", "one") else "pass")
    scenes = overview.families_of(rows)["friction"]
    text = f" {overview.share(5, 10 * len(scenes))}{said}"
    lines = shown(rows, 80)
    assert sum(text in line for line in lines[:30]) == 1
    assert ("Marked with !" in " ".join(" ".join(lines).split())) == bool(said)
    assert next(line for line in lines if text in line).split()[0] == "one"
    assert ("Needs attention" in "\n".join(lines)) == (mark in ("new", "drifted"))


@pytest.mark.parametrize(
    ("part", "whole", "said"),
    [(0, 7, "0 %"), (1, 1000, "<1 %"), (1, 100, "1 %"), (1, 8, "12 %"), (999, 1000, "99 %"), (5, 5, "100 %")],
)
def test_share_of_zero_or_all_only_where_exact(part, whole, said):
    assert overview.share(part, whole) == said


def test_unsupported_apart_from_passed():
    rows = catalogue() + [
        row(scene, "flat", "only", "unsupported" if scene != "stack" else "pass") for scene in CATALOGUE
    ]
    lines = shown(rows, 80)
    assert next(line for line in lines if line.startswith("  only")).split()[1:] == ["-"] * 3 + ["pass"] + ["-"] * 4
    said = dict(overview.choices(rows, overview.families_of(rows)))
    many = len(overview.families_of(rows)["stacks and statics"])
    assert f"flat/only (1 of {many} scenes run)" in said["stacks and statics"] and "flat" not in said["rebound"]
    assert "A dash: the engine cannot run these scenes." in " ".join(" ".join(lines).split())


def test_nearest_engine_named_where_few_pass():
    rows = catalogue(lambda scene, engine, profile: "pass" if engine == "reference" else "known")
    said = dict(overview.choices(rows, overview.families_of(rows)))
    assert said["turning"] == "reference/reference; nearest: bullet/default 50 %, bullet/one 50 %, bullet/tuned 50 %"
    nobody = [r for r in rows if r["engine"] != "reference"]
    assert dict(overview.choices(nobody, overview.families_of(nobody)))["hard"].startswith("none passes every check; ")


def test_worst_answer_of_a_family_by_failed_rows():
    def mark(scene, engine, profile):
        return "known" if (engine, profile) == ("bullet", "default") and scene in ("impact", "head_on") else "pass"

    rows = catalogue(mark) + [row("head_on", "bullet", "default", "known")]
    found = answers(rows)
    worst = overview.worst_answers(rows, found, overview.families_of(rows))
    assert [(a.engine, a.scene) for a in worst] == [("bullet", "head_on")] and len(found) == 2
    assert worst[0].cure == "profiles tuned and one fix it"


def test_worse_answer_of_another_profile_not_called_shipped():
    rows = catalogue(lambda scene, engine, profile: "known" if (scene, profile) == ("slide", "one") else "pass")
    assert overview.worst_answers(rows, answers(rows), overview.families_of(rows)) == []


def test_nearest_engines_ordered_by_failures():
    wrong = {"one": ("slide", "masse", "wedge"), "tuned": ("slide", "masse"), "default": ("slide",)}
    rows = catalogue(
        lambda scene, engine, profile: "known" if engine == "bullet" and scene in wrong[profile] else "pass"
    )
    rows = [row for row in rows if row["engine"] == "bullet"]
    said = dict(overview.choices(rows, overview.families_of(rows)))["friction"]
    assert [said.index(f"bullet/{profile}") for profile in ("default", "tuned", "one")] == sorted(
        said.index(f"bullet/{profile}") for profile in wrong
    )


def test_scenes_of_files_make_families_of_their_own(tmp_path):
    path = tmp_path / "drop.toml"
    path.write_text(
        'name = "drop"\ndimension = 2\ngravity = [0.0, -9.81]\nduration = 0.5\n[[bodies]]\nname = "a"\n'
        'shape = { type = "disc", radius = 0.5 }\nmass = 1.0\n'
    )
    found = overview.families_of([*catalogue(), row(str(path), "bullet", "tuned")])
    assert list(found)[: len(FAMILIES)] == list(FAMILIES) and [str(path)] in found.values()
