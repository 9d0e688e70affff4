"""The report as text: complete, escaped, strict, the same for the same run, and its sentences follow the data."""

import base64
import copy
import gzip
import hashlib
import io
import json
import re
import subprocess
import sys
import zlib
from collections import Counter
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import reports.fixes
from reports import page
from reports.answers import answers
from reports.command import main
from reports.fixes import Change
from reports.page import Source, as_data, first_answers, fixing, load_source, policy, render, replay
from reports.page.choosing import Cure, choices, cures
from reports.page.conclusions import NAMED, findings, scenes_text, sentences
from reports.page.explorer import explorer
from reports.page.fairness import _once
from reports.page.families import families, sentence
from reports.page.replay import Replay, people, replays
from reports.page.scenes import split_figure
from reports.page.verdicts import Mark, slug
from reports.wording import mark_of
from validation.cells import Slot
from validation.records.store import Run, Store
from validation.running.execution import execute

GOLDEN = Path(__file__).parent.parent / "data" / "golden"
EVIL = "<script>window.hacked=1</script>"


class Elements(HTMLParser):
    """All tags with their attributes, the text of scripts and styles, and what is read between tags."""

    def __init__(self, text):
        super().__init__()
        self.tags, self.code, self.read, self._inside = [], [], "", ""
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        self._inside = tag

    def handle_data(self, data):
        if self._inside in ("script", "style"):
            self.code.append((self.tags[-1], data))
        else:
            self.read += data
        self._inside = ""


@pytest.fixture(scope="session")
def text(page_file):
    return page_file.read_text(encoding="utf-8")


@pytest.fixture(scope="session")
def elements(text):
    return Elements(text)


@pytest.mark.few(1)
@pytest.mark.parametrize("found", [True, False])
def test_page_written_and_opened_by_the_command(page_folder, text, tmp_path, monkeypatch, found):
    opened, path = [], tmp_path / "page.html"
    monkeypatch.setattr("webbrowser.open", lambda address: opened.append(address) or found)
    result = CliRunner().invoke(main, ["report", "--open", "--out", str(page_folder), "-o", str(path)])
    assert (result.exit_code, opened) == (0, [path.as_uri()])
    assert ("no browser was found" in result.stderr) is not found
    assert result.stdout.strip() == str(path)
    assert path.read_text() == text and text.startswith("<!doctype html>")


def test_report_of_an_empty_run_exits_with_two(tmp_path):
    result = CliRunner().invoke(main, ["report", "--out", str(tmp_path / "empty")])
    assert result.exit_code == 2
    assert "there are no results" in result.stderr and "Traceback" not in result.output


def test_attributes_of_the_page(elements):
    for tag, attributes in elements.tags:
        assert not [name for name in attributes if name.startswith("on") or name == "style"], (tag, attributes)
        for name in ("src", "href", "action", "data", "poster", "srcset"):
            target = attributes.get(name)
            assert target is None or target.startswith(("#", "data:application/")), (tag, target[:80])


def test_links_within_the_page_to_existing_elements(elements):
    names = Counter(attributes["id"] for _, attributes in elements.tags if "id" in attributes)
    links = {a["href"][1:] for _, a in elements.tags if a.get("href", "").startswith("#")}
    assert [name for name, count in names.items() if count > 1 or name in ("", "None")] == []
    assert links - {""} <= set(names) and len(links) > 20


def views(spec, data=None):
    """Every view of a chart that has channels, with the rows that it draws."""
    data = spec.get("data", data)
    if "encoding" in spec:
        yield spec["encoding"], data
    for key in ("layer", "hconcat", "vconcat", "concat"):
        for each in spec.get(key, ()):
            yield from views(each, data)


def test_chart_channels_by_column_and_axis_titles(page_made):
    """What is drawn of a column that is not there is nothing, and no error."""
    looked = Counter()
    for spec in page_made[1]:
        for encoding, data in views(spec):
            rows = spec["datasets"][data["name"]]
            for name, channel in encoding.items():
                for each in channel if isinstance(channel, list) else [channel]:
                    if "field" not in each:
                        continue
                    values = [row[each["field"]] for row in rows]
                    assert any(value is not None for value in values), (name, each)
                    if each.get("type") == "quantitative":
                        assert all(value is None or isinstance(value, int | float) for value in values), (name, each)
                    if name in ("x", "y") and "axis" in each and each["axis"] is not None:
                        assert each["axis"].get("title") or each.get("title"), (name, each)
                    looked[name] += 1
    assert min(looked[name] for name in ("x", "y", "color", "description")) > 5, looked


def test_content_policy_with_one_style_and_one_script(elements):
    (content,) = [a["content"] for t, a in elements.tags if a.get("http-equiv") == "Content-Security-Policy"]
    running = [(tag, code) for (tag, attributes), code in elements.code if "type" not in attributes]
    assert [tag for tag, _ in running] == ["style", "script"]
    for tag, code in running:
        digest = base64.b64encode(hashlib.sha256(code.encode()).digest()).decode()
        assert f"{tag}-src 'sha256-{digest}'" in content
    assert "unsafe" not in content and content.startswith("default-src 'none'")


def test_policy_against_a_changed_script():
    assert policy("a{}", "f()") != policy("a{}", "g()")


def test_escaped_names_reasons_and_logs_of_the_page(elements, text):
    assert EVIL not in text and EVIL in elements.read
    assert not any("hacked" in code for (_, attributes), code in elements.code if "type" not in attributes)
    assert "img" not in {tag for tag, _ in elements.tags}


def test_escaped_ends_in_data_blocks():
    evil = {"name": "</script><script>alert(1)</script>&amp;"}
    assert "<" not in as_data(evil) and "&" not in as_data(evil)
    assert json.loads(as_data(evil)) == evil


@pytest.mark.usefixtures("bullet")
def test_every_judged_value_stands_in_a_table(page_source, text):
    grids = re.findall(r"<table[^>]* class=grid.*?</table>", text, re.DOTALL)
    values = [cell for grid in grids for row in grid.split("<tr")[2:] for cell in row.split("<td")[3:]]
    judged = [
        row for row in page_source.rows if row["outcome"] != "unsupported"
    ]  # of whom it cannot be asked is said once
    assert sum(cell.strip() != ">" for cell in values) == len(judged)
    assert text.count("Not supported by chipmunk.") == 1


def test_exported_rows_equal_to_the_page(elements, page_source):
    (href,) = [a["href"] for t, a in elements.tags if a.get("download") == "rows.json.gz"]
    columns = json.loads(gzip.decompress(base64.b64decode(href.partition(",")[2])))
    for name in ("value", "truth", "tolerance", "metric", "because", "standing"):
        assert columns[name] == [row[name] for row in page_source.rows]
    assert {len(column) for column in columns.values()} == {len(page_source.rows)}


def test_rendering_imports_no_engine(tmp_path):
    store = Store(tmp_path)
    slots = [Slot("impact", (), 2, engine, "tuned", 1 / 240) for engine in ("chipmunk", "mujoco")]
    run, _ = store.start("quick", slots)
    for slot in slots:
        store.add(run, execute(slot))
    store.finish(run)
    store.close()
    code = (
        "import sys, pathlib; from reports.page import load_source, render;"
        f"render(load_source(pathlib.Path({str(tmp_path)!r})));"
        "print(*({'pymunk', 'pybullet', 'mujoco'} & set(sys.modules)))"
    )
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert out.stdout.split() == []


def test_anchors_are_plain_whatever_a_name_holds():
    assert re.fullmatch(r"scene-script-x-y-toml-[0-9a-f]{8}", slug("scene", "<script>\"' x/y.toml"))
    assert slug("scene", "a-b.toml@3f2a9c1d") != slug("scene", "a_b.toml@3f2a9c1d")
    assert slug("scene", "bounce", 2) == "scene-bounce-2"
    assert re.fullmatch(r"x-[0-9a-f]{8}", slug("", "<>"))


def test_drawing_told_from_prose():
    prose, drawing = split_figure("A title.\n\n    o\n   ===\n\nWhy it\nmatters.\n")
    assert prose == ["A title.", "Why it matters."]
    assert drawing == " o\n==="


# ---- sentences ----


def golden(name):
    lines = [json.loads(line) for line in (GOLDEN / f"{name}.jsonl").read_text().splitlines()]
    rows = [line for line in lines if "metric" in line]
    return Source(Run("golden", "2026-01-01T00:00:00", "c", {}, "golden", (), True), rows, [])


def said(name):
    return [sentence for _, sentence in sentences(golden(name))]


def test_sentences_of_flipped_data():
    base, flipped = said("base"), said("flip")
    assert "bounce" in base[0].partition("every engine has a profile")[0]
    assert "bounce" not in flipped[0].partition("every engine has a profile")[0]
    assert base[2] != flipped[2]


def test_engines_without_a_clean_profile_in_many_scenes():
    clean = next(row for row in golden("base").rows if row["physics"] == "pass")
    rows = []
    for k in range(6):
        for engine in ("one", "two"):
            verdict = "fail" if engine == "two" and k > 0 else "pass"
            rows.append(clean | {"scene": f"scene{k}", "engine": engine, "profile": "tuned", "physics": verdict})
    rows.append(clean | {"scene": "scene6", "engine": "one", "profile": "tuned"})  # of which the other has nothing
    source = Source(golden("base").run, rows, [])
    first = dict(sentences(source))["Where they agree"]
    assert first.startswith("on scene0 every engine has a profile")
    assert "no profile of two passes everything on scene1, scene2, scene3, scene4 and scene5." in first
    assert "no profile of one" not in first


def test_a_sentence_names_few_scenes_and_counts_many():
    few = [f"scene{k}" for k in range(NAMED)]
    assert scenes_text(few, 40) == ", ".join(few[:-1]) + f" and {few[-1]}"
    assert scenes_text([*few, "more"], 40) == f"{NAMED + 1} of 40 scenes"


@pytest.mark.usefixtures("bullet")
def test_worst_of_each_engine_and_family_first(page_source, monkeypatch):
    wrong = answers(page_source.rows)
    assert first_answers(page_source, wrong) == wrong
    monkeypatch.setattr(page, "SEEN", 2)
    first = first_answers(page_source, wrong)
    family = {scene: each.name for each in families(page_source) for scene in each.scenes}
    assert [answer for answer in wrong if answer in first] == first and 0 < len(first) < len(wrong)
    places = [(answer.engine, family[answer.scene]) for answer in first]
    assert len(set(places)) == len(places)
    for answer in wrong:
        if answer.profile == "default":
            rival = first[places.index((answer.engine, family[answer.scene]))]
            assert rival.failing >= answer.failing
    made = render(Source(page_source.run, page_source.rows, page_source.observations))
    assert f"The other {len(wrong) - len(first)}, scene by scene" in made
    table = made.partition("<table class=wrongs")[0] + made.partition('class="wrongs blocks"')[2]
    assert all(page.unbroken(each.wrong).replace("&", "&amp;") in table for each in wrong if "<" not in each.wrong)


@pytest.mark.parametrize(
    ("metric", "params", "said", "left"),
    [
        ("rebound_ratio", {"e": 0.5}, "(e=0.5)", ""),
        ("impulse", {}, "impulse ", "not fixed: rebounds at "),
    ],
)
def test_sentence_of_the_check_of_before_and_after(page_source, monkeypatch, metric, params, said, left):
    """The sentence told of the worst check of the run, and the numbers of the check of the search."""
    found = [fix for each in fixing.wrongs(page_source, page_source.answers) for fix in each.fixes]
    assert any(fix.before.startswith(f"{fix.check}: ") for fix in found)  # the run has not the case
    cure = replace(reports.fixes.cures_of("bullet")["impact", 2], metric=metric, params=params, shown=())
    monkeypatch.setattr("reports.fixes.cures_of", lambda engine: {("impact", 2): cure} if engine == "bullet" else {})
    [fix] = [fix for each in fixing.wrongs(page_source, page_source.answers) for fix in each.fixes]
    assert said in fix.wrong and fix.left.startswith(left) and bool(left) == bool(fix.left)
    assert not fix.before.startswith(fix.check)


def test_settings_with_mostly_failed_checks_counted_only(page_source, monkeypatch):
    wrong = answers(page_source.rows)
    mended = [each.answer for each in fixing.wrongs(page_source, wrong) if each.fixes]
    listed = reports.fixes.cures_of

    def weak(engine):
        return {key: replace(cure, failing=20, left=19 if cure.helps else 20) for key, cure in listed(engine).items()}

    monkeypatch.setattr("reports.fixes.cures_of", weak)
    found = [each for each in fixing.wrongs(page_source, wrong) if each.answer in mended]
    assert found and all(not each.fixes and "the best settings found fix 1 of 20 checks" in each.said for each in found)


def test_first_choice_of_timed_scenes(page_source):
    found = choices(page_source)
    assert any(choice.timed for choice in found)
    assert not any(choice.timed for choice in choices(Source(page_source.run, page_source.rows, [])))
    assert all(any(c.cost_text for c in choice.good) for choice in found if choice.timed)


def test_drift_within_the_tolerance_changes_the_spread_only():
    base, drifted = said("base"), said("drift")
    assert base[0] != drifted[0]
    assert re.sub(r"by at most [\d.e+-]+", "", base[0]) == re.sub(r"by at most [\d.e+-]+", "", drifted[0])
    assert base[1:] == drifted[1:]


def test_slower_run_leaves_the_sentences():
    assert said("slow") == said("base")


def test_marks_of_explained_failures_and_alarms():
    source = golden("base")
    rows = copy.deepcopy(list(source.rows))
    rows[0] |= {"physics": "fail", "standing": "explained", "reason": "slop takes a share, always (predicted 1 +- 2)"}
    rows[1] |= {"physics": "fail", "standing": "new"}
    changed = sentences(Source(source.run, rows, []))
    assert (
        "1 failures are what the engine's contact model predicts" in changed[1][1]
        and "slop takes a share)" in changed[1][1]
    )
    assert changed[2][1].startswith("1 NEW checks need attention")


def test_findings_hold_every_failing_value_once(page_source):
    failing = [r for r in page_source.rows if r["physics"] == "fail" or r["outcome"] == "crashed"]
    assert sum(count for _, count, _ in findings(page_source)) == len(failing)
    assert sum(f.count for _, _, families in findings(page_source) for f in families) == len(failing)


@pytest.mark.usefixtures("bullet")
def test_finding_with_the_number_of_its_worst_row(page_source):
    """The text's numbers, read back: value, truth and tolerance of one row, and none of the family is worse."""
    looked = 0
    for mark, _, shown in findings(page_source):
        for one in shown:
            said = re.search(r"(\S+) = (.+?), truth (.+?), tolerance (.+)$", one.text)
            value, truth, tolerance = (part.split()[0] for part in said.groups()[1:])
            about = (one.engine, one.profile, one.scene, one.dimension)
            rows = [
                row for row in page_source.rows
                if tuple(row[name] for name in ("engine", "profile", "scene", "dimension")) == about
                and row["metric"].partition("[")[0] == one.family.partition("[")[0] and mark_of(row) == mark
            ]  # fmt: skip
            if not rows or any(row["value"] is None for row in rows):
                continue
            if not re.match(r"-?[\d.]", value):
                assert "never" in said[2]
                continue
            row = max(rows, key=lambda row: abs(row["value"] - row["truth"]) / row["tolerance"])
            assert said[1] == row["metric"], one.text
            assert float(value) == pytest.approx(row["value"], rel=6e-3), one.text
            assert float(truth) == pytest.approx(row["truth"], rel=6e-3), one.text
            assert float(tolerance) == pytest.approx(row["tolerance"], rel=0.1), one.text
            looked += 1
    assert looked > 5


# ---- families ----


def test_families_of_scenes(page_source):
    found = families(page_source)
    assert sorted(scene for family in found for scene in family.scenes) == sorted(page_source.scenes)
    assert found[0].name == "rebound" and found[0].scenes == ("impact", "bounce") and found[-1].name == "others"
    lines = [(line.scene, line.kind) for family in found for line in family.lines if "swept" not in line.kind]
    assert sorted(lines) == sorted((scene, f"{dimension}-D") for scene, dimension in page_source.lines)


@pytest.mark.usefixtures("bullet")
def test_marks_of_a_family(page_source):
    (rebound, *_) = families(page_source)
    column = page_source.columns.index(("bullet", "default"))
    judged = [
        row for row in page_source.of(engine="bullet", profile="default")
        if row["scene"] in rebound.scenes and row["iterations"] is None and row["physics"]
    ]  # fmt: skip
    failing = sum(row["physics"] == "fail" for row in judged)
    assert failing and rebound.marks[column].text == f"{failing}/{len(judged)}"


def test_family_sentence_after_reversed_physics():
    base, flipped = (sentence(golden(name), ["bounce"]) for name in ("base", "flip"))
    assert "every check" in base and " fails " not in base
    assert "fails bounce" in flipped


# ---- choice, cures, explorer ----


def judged(engine, dt, physics, scene="impact"):
    slot = {"scene": scene, "params": {}, "dimension": 2, "engine": engine, "profile": "tuned", "dt": dt,
            "iterations": None, "ulp": 0}  # fmt: skip
    return {
        "scene": scene, "dimension": 2, "engine": engine, "profile": "tuned", "dt": dt, "iterations": None,
        "metric": "rebound_ratio", "value": 0.8, "truth": 0.8, "error": 0.0 if physics == "pass" else 0.1,
        "tolerance": 1e-3, "physics": physics, "standing": None, "outcome": "ok", "params": {"e": 0.8, "v": 6.0},
        "unit": "1", "reason": "", "slot": slot,
    }  # fmt: skip


def test_step_that_passes_by_chance_not_recommended():
    outcomes = {"lucky": ("pass", "fail", "pass"), "safe": ("fail", "pass", "pass")}
    dts = (1 / 60, 1 / 120, 1 / 240)
    rows = [judged(name, dt, said) for name, every in outcomes.items() for dt, said in zip(dts, every, strict=True)]
    run = Run("r", "2026-01-01", "c", {}, "t", (), True)
    (choice,) = choices(Source(run, rows, []))
    assert {c.engine: c.largest for c in choice.candidates} == {"lucky": "1/240", "safe": "1/120"}


def test_the_cheapest_engine_that_passes_stands_first(page_source):
    found = {(c.scene, c.dimension): c for c in choices(page_source)}["impact", 2]
    # The bench's made-up times grow in the order of the engines; bullet/default fails.
    assert [(c.engine, c.profile) for c in found.good][:2] == [("chipmunk", "default"), ("chipmunk", "tuned")]
    assert "bullet/default" not in [f"{c.engine}/{c.profile}" for c in found.good]
    assert found.answer.startswith("Use chipmunk/default at dt = 1/60 s: the cheapest that passes every check, 1")


@pytest.mark.parametrize(("low", "tied"), [(0.9, True), (1.2, False)])
def test_tie_with_the_cheapest_engine(low, tied):
    from reports.page.choosing import Candidate, Cost, _answer, _with_ties

    steps = [("1/60", True)]
    first = Candidate("a", "x", steps, "1/60", Cost(1.0, 0.9, 1.1), "")
    second = Candidate("b", "y", steps, "1/60", Cost(1.3, low, 1.5), "")
    untimed = Candidate("c", "z", steps, "1/60", None, "")
    found = _with_ties([first, second, untimed])
    assert [c.tied for c in found] == [False, tied, False]
    assert ("a/x or b/y" in _answer(found, True)) is tied


def test_no_ranking_by_times_of_a_busy_machine(page_source, monkeypatch):
    from reports.page import choosing

    assert any(c.cost_text for choice in choices(page_source) for c in choice.candidates)
    monkeypatch.setattr(choosing, "busy", lambda timings: "This machine was busy.")
    assert not any(c.cost_text for choice in choices(page_source) for c in choice.candidates)


@pytest.mark.usefixtures("bullet")
def test_settings_and_reasons_of_a_cure(page_source):
    cure = next(c for c in cures(page_source) if (c.engine, c.scene, c.dimension) == ("bullet", "impact", 2))
    assert cure.before.mark != "pass" and cure.after.mark == "pass"
    assert "useMaximalCoordinates" in {change.name for change in cure.changes}
    assert all(change.because and change.before != change.after for change in cure.changes)


@pytest.mark.usefixtures("bullet")
def test_explorer_heights_and_names_of_wrong_rebounds(page_source):
    found = explorer(page_source)
    tuned = next(s for s in found.data["series"] if s["name"] == "chipmunk/tuned")
    assert tuned["heights"]["0.8"][0] == pytest.approx(0.64, abs=0.02)
    assert "Bullet as shipped" in found.maps[0].picture and "bullet/default: set " in found.maps[0].picture
    assert len(found.maps) == 1  # one approach speed ran with both


# ---- replay ----


def test_poses_of_a_packed_replay(page_source):
    found = next(r for r in replays(page_source) if r.id == "replay-bounce-2")
    data = found.head
    planes = np.frombuffer(zlib.decompress(base64.b64decode(found.levels)), np.uint8).reshape(2, -1)
    levels = np.ascontiguousarray(planes.T).view("<i2").ravel()
    times = np.cumsum(levels[: data["count"]]) * data["dt"]
    at, bodies = data["count"], len(data["bodies"])
    names = [one["name"] for one in people(page_source)]
    for series, (slot, recording) in zip(data["series"], _recordings(page_source, "bounce", 2), strict=True):
        assert names[series["who"]] == f"{slot.engine}/{slot.profile}"
        frames = series.get("frames", data["count"])
        assert times[:frames] == pytest.approx(recording.t, abs=1e-9)
        assert series.get("departure") == pytest.approx(recording.departure, abs=1e-6)
        count = frames * bodies * 3
        pose = np.cumsum(levels[at : at + count].reshape(bodies, 3, frames), axis=-1, dtype=np.int16)
        pose = np.moveaxis(pose, -1, 0)
        assert np.abs(pose[..., :2] * data["unit"] - recording.pose[:, 1:, :2]).max() <= 0.5 * data["unit"] * (1 + 1e-9)
        assert np.abs(pose[..., 2] * data["angle"] - recording.pose[:, 1:, 2]).max() <= 0.5 * data["angle"] * (1 + 1e-9)
        at += count + series["contacts"] * (1 + 2 + 2)
    exact = np.cumsum(levels[at:].reshape(2, -1), axis=-1, dtype=np.int16).T * data["unit"]
    assert exact[0] == pytest.approx([0.0, 1.5], abs=data["unit"]) and len(exact) == data["count"]


def test_head_of_a_replay(page_source):
    """What stands there by another name the script takes for nothing: it draws an empty picture and says no word."""
    head = next(r for r in replays(page_source) if r.id == "replay-bounce-2").head
    read = ("dimension", "dt", "count", "bodies", "fixed", "tracked", "low", "high", "unit", "angle", "place", "arrow")
    assert list(head) == [*read, "gravity", "static", "series"]
    script = (Path(replay.__file__).parent / "templates" / "replay.js").read_text(encoding="utf-8")
    assert all(f"data.{name}" in script or f"show.{name}" in script for name in read)
    assert (head["dimension"], head["tracked"], head["static"]) == (2, 0, False)
    assert head["gravity"] == [0.0, -9.81]
    assert [body["name"] for body in head["bodies"]] == ["ball"]
    assert [(body["name"], body["type"]) for body in head["fixed"]] == [("floor", "face")]
    assert len(head["low"]) == len(head["high"]) == 2 and head["low"][-1] < 0.6 < 1.5 < head["high"][-1]
    assert 0.0 < head["unit"] < 1e-3 and head["dt"] > 0.0 and head["count"] > 60
    assert all({"who", "contacts"} <= set(one) for one in head["series"])


def _recordings(source, scene, dimension):
    return [(slot, r) for slot, r in source.replays if (slot.scene, slot.dimension) == (scene, dimension)]


@pytest.mark.usefixtures("bullet")
def test_first_departure_only_of_engines_that_leave(page_source):
    found = next(r for r in replays(page_source) if r.id == "replay-bounce-2")
    gone = {f"{engine}/{profile}": departure for engine, profile, departure, *_ in found.departures}
    assert gone["bullet/default"] is not None and gone["bullet/tuned"] is None and gone["chipmunk/tuned"] is None


# ---- what is missing ----


def test_page_of_any_incomplete_results(page_source):
    page = render(Source(page_source.run, page_source.rows, page_source.observations))
    assert "This folder has no bench yet" in page and "kept no recordings" in page
    assert "No check has a result" in render(Source(page_source.run, [], []))


def test_number_of_missing_cells_of_a_run(tmp_path):
    pytest.importorskip("pymunk")
    slots = [Slot("impact", (("e", e),), 2, "chipmunk", "tuned", 1 / 240) for e in (0.0, 0.5, 1.0)]
    store = Store(tmp_path)
    run, _ = store.start("quick: impact", slots)
    store.add(run, execute(slots[0]))
    store.close()
    said = "2 of 3 planned cases have no result"
    shown = CliRunner().invoke(main, ["show", "--out", str(tmp_path)])
    made = CliRunner().invoke(main, ["report", "--json", "--out", str(tmp_path)])
    assert said in shown.stderr and said in made.stderr
    # Nothing else is alarming, and the run had ended with 1.
    assert said in CliRunner().invoke(main, ["findings", "--new", "--out", str(tmp_path)]).stderr
    assert json.loads(made.stdout)["missing"] == 2
    plain = json.loads(CliRunner().invoke(main, ["show", "--json", "--out", str(tmp_path)]).stdout)
    assert (plain["run"], plain["planned"], plain["missing"]) == (run.id, 3, 2)
    assert said in (tmp_path / "report.html").read_text()
    store = Store(tmp_path)
    for slot in slots[1:]:
        store.add(run, execute(slot))
    store.close()
    assert "have no result" not in CliRunner().invoke(main, ["show", "--out", str(tmp_path)]).stderr
    assert "have no result" not in render(load_source(tmp_path))


def test_page_of_a_run_without_supported_cells(tmp_path):
    pytest.importorskip("pymunk")
    slots = [Slot("impact", (), 3, "chipmunk", profile, 1 / 240) for profile in ("default", "tuned")]
    store = Store(tmp_path)
    run, _ = store.start("quick: impact", slots)
    for slot in slots:
        store.add(run, execute(slot))
    store.finish(run)
    store.close()
    page = render(load_source(tmp_path))
    assert "No check has a result" in page
    for wrong in (
        "is within its tolerance",
        "passes every check of",
        "fails the most",
        "pass every check",
        "every engine has a",
    ):
        assert wrong not in page


def test_size_and_source_of_a_picture():
    from PIL import Image

    from reports.pictures import labelled

    plain, made = Image.new("RGB", (30, 20), (10, 200, 30)), io.BytesIO()
    plain.paste((250, 0, 90), (5, 5, 20, 11))
    plain.save(made, "PNG")
    found = Image.open(io.BytesIO(labelled(made.getvalue(), "run 1, commit a")))
    assert found.convert("RGB").tobytes() == plain.tobytes() and found.text == {"Source": "run 1, commit a"}


@pytest.mark.parametrize("low", [1e-9, 1e-3])
def test_slopes_of_chart_guides_at_the_edge(low):
    import altair

    from reports.page.figures import _guides

    chart = _guides([1 / 960, 1 / 60], (1 / 60, 1e-2), altair.X("dt:Q"), altair.Y("error:Q"), low)
    for order, ends in chart.data.groupby("order"):
        rise = np.diff(np.log(ends["error"])) / np.diff(np.log(ends["dt"]))
        assert rise == pytest.approx(float(order), rel=1e-9)
        assert ends["error"].min() >= low * (1 - 1e-9)


@pytest.mark.parametrize(
    ("departures", "said"),
    [
        ([("a", "x", None, "ok")], "no engine leaves the tolerance"),
        ([("a", "x", 0.2, "ok"), ("b", "y", 0.1, "diverged")], "b/y at 0.100 s (diverged), a/x at 0.200 s"),
        ([("a", "x", 0.2, "ok"), ("b", "y", None, "ok")], "a/x at 0.200 s; the other one never"),
        ([("a", "x", None, "diverged"), ("b", "y", None, "ok"), ("c", "z", None, "ok")],
         "a/x diverged; the other 2 never"),
    ],
)  # fmt: skip
def test_engines_that_leave_the_tolerance_in_order(departures, said):
    assert Replay("i", "t", "s", {}, "", None, "c", departures).departures_text == said


def cure_of(engine, scene, dimension=2, changed="10", paste="iterations = 30"):
    """A cure with one changed setting."""
    mark = Mark("fail", "")
    return Cure(scene, dimension, engine, "default", "tuned", mark, mark, "drift", "1", "0",
                [Change("iterations", changed, "30", "fewer leave more")], paste, "to paste:", "")  # fmt: skip


def test_equal_cures_told_once_with_references():
    """One per engine and scene; the same settings of one engine stand with the first scene that has them."""
    first, flat, space = cure_of("chipmunk", "stack"), cure_of("chipmunk", "rack"), cure_of("chipmunk", "stack", 3)
    other, pasted = cure_of("chipmunk", "pinch", changed="20"), cure_of("chipmunk", "arch", paste="iterations = 31")
    found = _once([first, space, flat, other, pasted, cure_of("bullet", "stack")])
    assert [(c.engine, c.scene, c.dimension, c.like) for c in found] == [
        ("chipmunk", "stack", 2, ""), ("chipmunk", "rack", 2, "stack"), ("chipmunk", "pinch", 2, ""),
        ("chipmunk", "arch", 2, "stack"), ("bullet", "stack", 2, ""),
    ]  # fmt: skip
    assert [c.paste for c in found[1:4]] == ["", other.paste, "iterations = 31"]  # lines of its own stay with a scene


def test_page_without_an_engine_of_the_bench(page_source):
    """The run is of later, of one engine less than the bench of the same folder: the page shows both all the same."""
    gone = page_source.engines[-1]
    assert any(observation.slot.engine == gone for observation in page_source.bench.observations)
    rows = [row for row in page_source.rows if row["engine"] != gone]
    observations = [each for each in page_source.observations if each.slot.engine != gone]
    replays = [(slot, recording) for slot, recording in page_source.replays if slot.engine != gone]
    source = replace(page_source, rows=rows, observations=observations, replays=replays)
    assert gone not in source.engines and gone in {engine for engine, _ in source.named}
    assert source.named[: len(source.columns)] == list(source.columns)
    page = render(source)
    for k, (engine, profile) in enumerate(source.named):
        if engine == gone and (engine, profile) in {(o.slot.engine, o.slot.profile) for o in source.bench.observations}:
            assert f".s{k}::before" in page
