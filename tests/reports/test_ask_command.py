"""``ask``: a symptom in plain words leads to the scene that shows it, to how wrong an engine is, and to a fix."""

import json

import pytest
from click.testing import CliRunner

from reports.command import main
from reports.cures import cure_paste
from validation.catalogue import CATALOGUE
from validation.field import notes
from validation.field.symptoms import matches, stem
from validation.settings.cures import cures_of

#: Words of users that no scene has as they stand -> the scene that is about it.
ASKED = {
    "my ball does not bounce": "bounce",
    "grip slips": "pinch",
    "objects are slipping out of my gripper": "pinch",
    "my stack creeps": "stack",
    "boxes are sinking into one another": "stack",
    "fast things pass through": "thin_wall",
    "a shot is tunnelling through plates": "thin_wall",
    "forces jump": "wipe",
    "noisy contact force sensor": "wipe",
    "crate creeps down a ramp": "incline",
    "tiny objects behave differently": "scales",
    "stumbling over seams between floor tiles": "seam",
    "overlapping bodies explode at the start": "overlap",
    "large mass ratio": "heavy_on_light",
}


def asked(*words, status=0):
    result = CliRunner(env={"COLUMNS": "80"}).invoke(main, ["ask", *words])
    assert result.exit_code == status, result.output
    return result.output


@pytest.mark.parametrize("words", ASKED)
def test_words_of_a_user_lead_to_the_scene(words):
    assert matches(words)[0].scene == ASKED[words]
    assert asked(*words.split()).startswith(f"{ASKED[words]}: {CATALOGUE[ASKED[words]].title}"[:80])


@pytest.mark.parametrize("scene", [name for name, scene in CATALOGUE.items() if scene.symptoms])
def test_each_symptom_leads_to_its_own_scene(scene):
    assert [matches(text)[0].scene for text in CATALOGUE[scene].symptoms] == [scene] * len(CATALOGUE[scene].symptoms)


@pytest.mark.parametrize("note", notes(), ids=lambda note: note.source)
def test_the_number_of_a_known_report_finds_it(note):
    short = note.source.split("/")[1]
    found = matches(short)[0]
    assert found.scene == note.scene and found.report.source.endswith(short)


def test_a_word_is_known_in_all_its_forms():
    for words in ("slip slips slipped slipping", "bounce bounces bouncing", "sink sinks sinking", "box boxes",
                  "jitter jitters jittering", "penetrates penetrating penetration", "grip gripper grips"):  # fmt: skip
        assert len({stem(word) for word in words.split()}) == 1, words


def test_an_engine_that_is_named_gets_its_numbers_and_the_lines_to_paste():
    said, fix = asked("grip", "slips", "mujoco"), cures_of("mujoco")["pinch", 3]
    assert f"{fix.failing} of {fix.judged} checks fail" in said and "bullet" not in said
    assert all(line in said for line in cure_paste(fix).splitlines()), "as `cure` prints them, unbroken"
    assert said.count("\n") <= 24, "one screen"
    without = asked("grip", "slips")
    assert cure_paste(fix).splitlines()[0] not in without and "crosscheck ask grip slips bullet" in without


def test_names_of_packages_are_names_of_engines():
    assert asked("stack", "sinks", "pymunk") == asked("stack", "sinks", "chipmunk")


def test_a_question_about_releases_leads_to_the_command_that_answers_it():
    assert asked("results", "changed", "with", "a", "release").startswith("crosscheck bisect ")


@pytest.mark.parametrize("words", ["it is slow", "the simulation is too slow", "my sim is slow in mujoco"])
def test_a_question_about_time_leads_to_the_bench(words):
    """A slow ball is a symptom of a scene; of a question that has nothing else the command comes first."""
    assert asked(*words.split()).startswith("crosscheck bench ")


@pytest.mark.parametrize("words", ["the ball won't bounce", "the ball doesn\N{RIGHT SINGLE QUOTATION MARK}t bounce"])
def test_an_apostrophe_divides_no_word(words):
    said = asked(*words.split())
    assert said.startswith("bounce: ") and "no match for" not in said


def test_beside_the_best_scene_stand_those_with_as_many_of_the_words_or_another_one():
    best, *others = matches("tower of blocks falls over")
    named = json.loads(asked("tower", "of", "blocks", "falls", "over", "--json"))["others"]
    told = {other.scene: set(other.words) for other in others}
    assert named and all(len(told[s]) >= len(best.words) or told[s] - set(best.words) for s in named)


def test_a_report_about_another_engine_than_the_one_that_is_named_is_left_out():
    assert "known report bulletphysics" in asked("ball", "rolls", "straight", "on", "curves")
    assert "known report" not in asked("ball", "rolls", "straight", "on", "curves", "pymunk")


def test_a_scene_without_a_fix_on_record_says_so_and_not_that_nothing_fails():
    """Bullet fails checks of both scenes; no search for a fix of them was kept."""
    assert "no fix of an engine as shipped is on record" in asked("energy", "grows", "at", "each", "collision")
    said = " ".join(asked("stack", "sinks", "bullet").split())
    assert "bullet: no fix is on record; to search: crosscheck cure bullet stack" in said and "no failure" not in said


def test_what_is_not_known_is_said():
    assert "nothing is known of 'quantum'" in asked("quantum", status=2)
    assert "nothing is known of ''" in asked("mujoco", status=2)
    assert "no match for: quantum" in asked("grip", "slips", "quantum")
    assert "box2d: has no table of fixes" in asked("sinks", "box2d")


def test_settings_that_leave_most_failures_are_counted_and_not_given_to_paste():
    fix = cures_of("mujoco")["wipe", 3]
    assert fix.helps and not fix.recommended, "or choose another scene for this test"
    said = asked("forces", "jump", "mujoco")
    assert f"3-D: the best settings found fix {fix.failing - fix.left} of {fix.failing} checks" in said
    assert cure_paste(fix).splitlines()[0] not in said
    assert "lines to paste" not in asked("forces", "jump"), "no engine has any"
    (plain,) = json.loads(asked("forces", "jump", "mujoco", "--json"))["fixes"]
    assert plain["paste"] == ""


def test_json_has_all_of_it():
    found = json.loads(asked("mujoco#239", "--json"))
    assert found["scene"] == "pinch" and found["report"] == "google-deepmind/mujoco#239"
    assert [fix["engine"] for fix in found["fixes"]] == ["mujoco"] and "elliptic" in found["fixes"][0]["paste"]
