"""``tune``: what a search found, in a line each, and the status that says whether something better is there."""

import json

import pytest
from click.testing import CliRunner

from reports.command import main, tuning
from validation.settings.decisive import ALONE, Decisive, Part
from validation.settings.tuning import Score, Search, Trial, groups

BEFORE, AFTER, HELD = Score(3, 12.34), Score(1, 4.0), (Score(2, 1.0), Score(2, 0.96))


def result(engine, profile, group, changes, needless=()):
    trials = (Trial({"slop": 0.1}, AFTER, ()), Trial({"slop": 0.2}, BEFORE, ("creep",)))
    return Search(engine, profile, group, BEFORE, AFTER, changes, HELD, trials, dict(needless))


@pytest.fixture
def tune(monkeypatch):
    """`tune(words, changes, needless)`: the command where every search finds that, and what was searched."""

    def run(*words, changes=(), needless=()):
        asked = []

        def search(engine, profile, name, jobs, dimensions, said):
            asked.append((engine, profile, name, jobs, dimensions))
            said({"slop": 0.1, "sweeps": 4}, AFTER)
            return result(engine, profile, name, dict(changes), needless)

        monkeypatch.setattr(tuning, "search", search)
        return CliRunner().invoke(main, ["tune", *words]), asked

    return run


def lines(text):
    return [line.strip() for line in text.splitlines()]


@pytest.mark.usefixtures("bullet")
def test_tuning_of_all_groups_in_all_dimensions(tune):
    done, asked = tune("chipmunk")
    assert done.exit_code == 0 and asked == [("chipmunk", "tuned", name, 1, (2,)) for name in groups()]
    done, asked = tune("bullet", "--group", "slide", "--jobs", "2")
    assert asked == [("bullet", "tuned", "slide", 2, (2, 3))]
    done, asked = tune("bullet", "--group", "slide", "--profile", "one", "--dim", "3")
    assert asked == [("bullet", "one", "slide", 1, (3,))]


def test_no_better_tuning_with_status_0(tune):
    done, _ = tune("chipmunk", "--group", "slide")
    said = lines(done.stderr)
    assert done.exit_code == 0 and done.stdout == ""
    assert said == [
        "chipmunk/tuned on slide",
        "slop = 0.1, sweeps = 4: 1 fail, 4.0 decades",
        "chipmunk/tuned slide: 3 fail, 12.3 decades; 2 tried; none is better",
    ]


def test_better_tuning_with_held_out_cells_and_status_1(tune):
    done, _ = tune("chipmunk", "--group", "slide", "--json", changes={"slop": 0.1}, needless={"bias": 0.0})
    assert done.exit_code == 1
    assert lines(done.stderr)[2:] == [
        "chipmunk/tuned slide: 3 fail, 12.3 decades; 2 tried; better: slop = 0.1 -> 1 fail, 4.0 decades "
        "(held out 2 fail, 1.0 decades -> 2 fail, 1.0 decades)",
        "as shipped does as well: bias = 0.0",
    ]
    (plain,) = json.loads(done.stdout)
    assert (plain["engine"], plain["profile"], plain["group"]) == ("chipmunk", "tuned", "slide")
    assert plain["changes"] == {"slop": 0.1} and plain["before"] == {"failing": 3, "decades": 12.34}
    assert [trial["changes"] for trial in plain["trials"]] == [{"slop": 0.1}, {"slop": 0.2}]


def test_unknown_group_and_engine_without_candidates_refused(tune):
    done, asked = tune("chipmunk", "--group", "nosuch")
    assert done.exit_code == 2 and asked == []
    assert "'nosuch' is not one of" in done.stderr and all(name in done.stderr for name in groups())
    done, asked = tune("reference")
    assert (done.exit_code, asked) == (2, [])
    assert "no stock settings of reference to try are listed" in done.stderr


def cured(scene, *decide):
    parts = tuple(Part(name, "1", 2.0, 2.0, ALONE) for name in decide)
    return Decisive("chipmunk", "7", "default", "tuned", scene, 2, ({},), ("drift",), 9.0, 0.5, parts)


@pytest.fixture
def measured(monkeypatch, tmp_path):
    """`measured(listed, found)`: ``tune --decisive`` where these cures are listed, and those are measured."""

    def run(listed, found, *words):
        monkeypatch.setattr(tuning, "measured_of", lambda engine: listed)
        monkeypatch.setattr(tuning, "measure_all", lambda engine, jobs: found)
        monkeypatch.setattr(tuning, "folder_of", lambda engine: tmp_path)
        return CliRunner().invoke(main, ["tune", "chipmunk", "--decisive", *words])

    return run


def test_decisive_settings_kept_and_compared_with_the_list(measured, tmp_path):
    found = [cured("stack", "slop"), cured("impact", "sweeps")]
    done = measured(found[::-1], found)
    assert done.exit_code == 0
    assert lines(done.stdout) == ["chipmunk/default stack: fixed by slop", "chipmunk/default impact: fixed by sweeps"]
    kept = (tmp_path / "decisive.csv").read_text(encoding="utf-8")
    assert "slop" in kept and "sweeps" in kept
    for listed in ([cured("stack", "slop")], [cured("stack", "bias"), found[1]], [*found, cured("bounce", "slop")]):
        assert measured(listed, found).exit_code == 1
    plain = json.loads(measured(found, found, "--json").stdout)
    assert [(each["scene"], each["parts"][0]["setting"]) for each in plain] == [("stack", "slop"), ("impact", "sweeps")]


def test_engine_without_cures_and_outdated_list_refused(measured, monkeypatch):
    def stale(engine, jobs):
        raise ValueError("the profile changes no setting of stack")

    monkeypatch.setattr(tuning, "measure_all", stale)
    done = CliRunner().invoke(main, ["tune", "chipmunk", "--decisive"])
    assert done.exit_code == 2 and "tune: the profile changes no setting of stack" in done.stderr
    done = CliRunner().invoke(main, ["tune", "reference", "--decisive"])
    assert done.exit_code == 2 and "no fixes of reference to measure are listed" in done.stderr


def test_two_measurements_at_once_refused(measured, tmp_path):
    done = measured([], [], "--effects")
    assert done.exit_code == 2 and "--effects and --decisive" in done.stderr and not list(tmp_path.iterdir())
