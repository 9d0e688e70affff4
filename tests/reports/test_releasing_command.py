"""``releases`` and ``bisect`` without an environment: what is asked of which release, what is said, and the status."""

import json
from dataclasses import replace

import pytest
from click.testing import CliRunner

from reports.command import main, releasing
from validation.cells import Observation, Outcome, Slot
from validation.releases.choosing import Release
from validation.releases.driving import Effort
from validation.workers import TIMEOUT

SLOTS = [Slot("impact", (("e", e),), 2, "chipmunk", "tuned", 1 / 240) for e in (0.25, 0.5)]
RELEASES = [Release("chipmunk", version, "pymunk", ("numpy",)) for version in ("1.0", "1.1", "2.0")]


class Asked:
    """What is asked of releases; ``ratio(version, slot)`` is what each answers, or None where it does not."""

    def __init__(self, monkeypatch, ratio, starts=None):
        self.ratio, self.driven, self.timed, self.planned, self.floors = ratio, [], [], [], []
        monkeypatch.setattr(releasing, "chosen", self.chosen)
        monkeypatch.setattr(releasing, "planned", self.plan)
        monkeypatch.setattr(releasing, "drive", self.drive)
        monkeypatch.setattr(releasing, "time", self.time)
        monkeypatch.setattr(releasing, "moved_starts", lambda told: self.floors.append(told) or starts or {})

    def chosen(self, engine, which):
        assert engine == "chipmunk"
        return {"1.0..2.0": RELEASES, "1.0": RELEASES[:1]}[which]

    def plan(self, releases, request, effort, say):
        self.planned.append((releases, request, effort))
        say("planning")
        return SLOTS if request.scenes == ["impact"] else []

    def drive(self, store, release, wanted, effort, say, seen):
        self.driven.append((release.version, list(wanted), effort))
        say(f"making {release.name}")
        found = []
        for slot in wanted:
            told = self.ratio(release.version, slot)
            metrics = {} if told is None else {"rebound_ratio": (told, ""), "impulse": (1.0, "")}
            lost = told is None
            outcome = Outcome.NOT_INSTALLED if lost else Outcome.OK
            found.append(Observation(slot, "c", 1, release.version, outcome, "no wheel" * lost, metrics))
            seen(found[-1])
        return found

    def time(self, store, release, found, effort, say):
        self.timed.append((release.version, [each.slot for each in found], effort))
        say(f"{release.name}: not timed: it is asleep")


def call(*words, status=0):
    done = CliRunner().invoke(main, list(words))
    assert done.exit_code == status, (done.exit_code, done.output, done.exception)
    return done


def test_same_cells_and_one_line_for_every_release(monkeypatch, tmp_path):
    asked = Asked(monkeypatch, lambda version, slot: dict(slot.params)["e"])
    done = call("releases", "chipmunk", "1.0..2.0", "impact", "--json", "--jobs", "3", "--out", str(tmp_path / "out"))
    effort = Effort(3, TIMEOUT, False, False)
    assert asked.driven == [(release.version, SLOTS, effort) for release in RELEASES] and not asked.timed
    ((releases, request, same),) = asked.planned
    assert (releases, same, request.engines, request.scenes) == (RELEASES, effort, ["chipmunk"], ["impact"])
    lines = done.stderr.splitlines()
    assert [line.strip() for line in lines] == [
        "planning", *[line for r in RELEASES for line in (f"making {r.name}", f"{r.name}: 2 cases")],
    ]  # fmt: skip
    assert json.loads(done.stdout)
    assert "1.1" in call("releases", "chipmunk", "1.0..2.0", "impact", "--markdown", "--out", str(tmp_path)).stdout
    assert "1.1" in call("releases", "chipmunk", "1.0..2.0", "impact", "--out", str(tmp_path)).stdout


def test_command_below_what_moved(monkeypatch, tmp_path):
    Asked(monkeypatch, lambda version, slot: 0.9 if version == "2.0" else 0.5)
    said = " ".join(call("releases", "chipmunk", "1.0..2.0", "impact", "--out", str(tmp_path)).stdout.split())
    assert f"crosscheck compare chipmunk==1.1 chipmunk==2.0 --out {tmp_path}" in said


def test_effort_options_and_times_for_the_releases(monkeypatch, tmp_path):
    asked = Asked(monkeypatch, lambda version, slot: 0.5)
    more = ("--times", "--fresh", "--try", "--timeout", "7", "--out", str(tmp_path))
    done = call("releases", "chipmunk", "1.0", "impact", *more)
    effort = Effort(0, 7.0, True, True)
    assert asked.driven == [("1.0", SLOTS, effort)] and asked.timed == [("1.0", SLOTS, effort)]
    assert "chipmunk==1.0: not timed: it is asleep" in done.stderr


def test_release_without_an_answer_makes_the_result_incomplete(monkeypatch, tmp_path):
    Asked(monkeypatch, lambda version, slot: None if version == "1.1" else 0.5)
    done = call("releases", "chipmunk", "1.0..2.0", "impact", "--out", str(tmp_path), status=4)
    assert "chipmunk==1.1: no wheel" in done.stderr and "chipmunk==2.0: 2 cases" in done.stderr


def test_moved_starts_only_for_changed_values(monkeypatch, tmp_path):
    more = [replace(SLOTS[0], ulp=1)]
    asked = Asked(monkeypatch, lambda version, slot: 0.5, starts={"1.1": more})
    call("releases", "chipmunk", "1.0..2.0", "impact", "--fresh", "--out", str(tmp_path))
    versions = [(version, len(wanted), effort.fresh) for version, wanted, effort in asked.driven]
    assert versions == [("1.0", 2, True), ("1.1", 2, True), ("2.0", 2, True), ("1.1", 3, False)]
    assert [each.version for each in asked.floors[0]] == ["1.0", "1.1", "2.0"]


def test_interrupted_releases_resumed_by_the_same_command(monkeypatch, tmp_path):
    def ratio(version, slot):
        raise KeyboardInterrupt

    Asked(monkeypatch, ratio)
    done = CliRunner().invoke(main, ["releases", "chipmunk", "1.0", "impact", "--out", str(tmp_path)])
    assert "interrupted: finished cases are kept; the same command resumes" in done.stderr and done.exit_code != 0


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("releases",), "releases: name an engine and its releases, such as: crosscheck releases ENGINE 3.0.0..3.2.7"),
        (("releases", "chipmunk"), "releases: name an engine and its releases"),
        (("bisect", "chipmunk", "1.0", "impact", "--check", "apex"),
         "releases: 1.0 is one release; a comparison needs two"),
        (("releases", "chipmunk", "1.0", "bounce"), "scenes: no case fits this selection"),
        (("bisect", "chipmunk", "1.0..2.0", "impact", "--check", "apex"),
         "check: impact has no check 'apex'; it has rebound_ratio, "),
        (("bisect", "chipmunk", "1.0..2.0", "impact", "--check", "rebound_ratio[1]"),
         "check: impact has no check 'rebound_ratio[1]'"),
    ],
)  # fmt: skip
def test_wrong_call_refused_before_a_release_is_asked(monkeypatch, tmp_path, words, said):
    asked = Asked(monkeypatch, lambda version, slot: 0.5)
    done = CliRunner().invoke(main, [*words, "--out", str(tmp_path)])
    assert (done.exit_code, asked.driven) == (2, [])
    assert said in done.stderr


def test_scene_checks_of_single_and_combined_cases():
    assert {"creep", "threshold"} <= set(releasing._metrics(replace(SLOTS[0], scene="incline", params=())))


def test_bisection_between_two_ends_with_both_named(monkeypatch, tmp_path):
    asked = Asked(monkeypatch, lambda version, slot: 0.9 if version == "2.0" else dict(slot.params)["e"])
    words = ("bisect", "chipmunk", "1.0..2.0", "impact", "--check", "rebound_ratio", "--out", str(tmp_path))
    plain = json.loads(call(*words, "--json").stdout)
    assert {version for version, _, _ in asked.driven} == {"1.0", "1.1", "2.0"}
    assert "chipmunk==1.1" in json.dumps(plain) and "chipmunk==2.0" in json.dumps(plain)
    assert "1.1" in call(*words).stdout
    Asked(monkeypatch, lambda version, slot: dict(slot.params)["e"])
    done = call(*words)
    assert done.stdout.strip() == ("rebound_ratio of impact is the same in 1.0 and 2.0")
    Asked(monkeypatch, lambda version, slot: None if version == "2.0" else 0.5)
    assert "2.0" in call(*words, status=4).stdout
