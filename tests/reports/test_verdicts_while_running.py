"""Scenes are judged and shown as their cases end, with the same rows as a run that is judged as a whole."""

import io
import json
import random

import kept_run
import pytest
from click.testing import CliRunner
from rich.console import Console

from reports.command import main
from reports.verdicts import Verdicts
from validation.judging.rows import rows_of
from validation.records.store import Store


@pytest.fixture(scope="module")
def kept(tmp_path_factory):
    """A run of many scenes on four engines, and its results in the order of the plan."""
    folder = tmp_path_factory.mktemp("kept")
    kept_run.fill(folder)
    store = Store(folder, create=False)
    run = max(store.runs(), key=lambda run: len(run.plan))
    yield run, store.observations(run)
    store.close()


def shown(run, observations, plan, width=80, terminal=False):
    """Lines after each result, and all rows."""
    text = io.StringIO()
    console = Console(file=text, width=width, force_terminal=terminal, markup=False, emoji=False)
    verdicts, counts = Verdicts(plan, console), []
    for observation in observations:
        verdicts.add(run, observation)
        counts.append(len(text.getvalue().splitlines()))
    return counts, text.getvalue().splitlines(), verdicts.rows(run)


def test_order_of_rows_while_running(kept):
    run, observations = kept
    plan = [observation.slot for observation in observations]
    whole = rows_of(run.id, observations, plan)
    assert {"incline/threshold"} <= {row.check for row in whole}  # a study of several cells
    mixed = random.Random(1).sample(observations, len(observations))
    assert shown(run, mixed, plan)[2] == whole
    some = mixed[::2]
    kept_order = [observation for observation in observations if observation in some]
    assert shown(run, some, plan)[2] == rows_of(run.id, kept_order, plan)


def test_line_at_the_end_of_each_scene(kept):
    run, observations = kept
    own = [o for o in observations if o.slot.engine == "mujoco" and o.slot.scene in ("impact", "bounce")]
    plan = [observation.slot for observation in own]
    counts, lines, _ = shown(run, own, plan)
    ends = [max(k for k, slot in enumerate(plan) if slot.scene == scene) for scene in ("impact", "bounce")]
    assert counts == [0 if k < min(ends) else 2 if k < max(ends) else 3 for k in range(len(plan))]
    assert lines[0].split() == ["engine", "scene", "checks", "by", "profile"]
    (line,) = (line for line in lines if "impact" in line)
    assert line.split()[:3] == ["mujoco", "impact", "default"] and "/" in line and ", tuned " in line
    assert all(len(line) <= 80 for line in lines)


def test_a_wide_terminal_has_profiles_below_each_other(kept):
    run, observations = kept
    plan = [observation.slot for observation in observations]
    _, lines, _ = shown(run, observations, plan, width=120)
    own = [line for line in lines if line.startswith("mujoco") and "," not in line]
    assert len(own) > 5 and len({line.index("tuned") for line in own}) == 1 and " of " in "".join(own)


def test_control_characters_with_and_without_a_terminal(kept):
    run, observations = kept
    plan = [observation.slot for observation in observations]
    _, lines, _ = shown(run, observations, plan)
    assert not any(ord(letter) < 32 or ord(letter) == 127 for line in lines for letter in line)
    assert any("\x1b[" in line for line in shown(run, observations, plan, terminal=True)[1])


def test_lines_of_a_single_scene_or_a_refusing_engine(kept):
    run, observations = kept
    own = [o for o in observations if o.slot.scene == "bounce"]
    assert own and shown(run, own, [o.slot for o in own])[1] == []
    refused = [o for o in observations if o.outcome.value == "unsupported"]
    _, lines, rows = shown(run, refused, [o.slot for o in refused])
    assert rows and len({o.slot.scene for o in refused}) > 1 and len(lines) <= 1


def test_missing_cases_are_shown_with_the_rows(kept):
    run, observations = kept
    own = [o for o in observations if o.slot.engine == "chipmunk" and o.slot.scene in ("impact", "bounce")]
    text = io.StringIO()
    verdicts = Verdicts([o.slot for o in own], Console(file=text, width=120))
    for observation in own[1:]:
        verdicts.add(run, observation)
    assert "impact" not in text.getvalue()
    verdicts.rows(run)
    assert "missing" in text.getvalue()


SLOT = """
name = "rod in a slot"
dimension = 2
gravity = [0.0, {pull}]
duration = 0.05
[[bodies]]
name = "left"
shape = {{ type = "half_space", normal = [1.0, 0.0], offset = -0.5400332889206209 }}
motion = "prescribed"
twist = {slot}
[[bodies]]
name = "right"
shape = {{ type = "half_space", normal = [-1.0, 0.0], offset = -0.5400332889206209 }}
motion = "prescribed"
twist = {slot}
[[bodies]]
name = "rod"
shape = {{ type = "capsule", half_length = 0.5, radius = 0.05 }}
mass = 1.0
pose = [0.0, {y}, 0.2]
twist = {rod}
[[pairs]]
friction = 1.0
[[checks]]
quantity = "rod.vy"
value = {value}
tolerance = 1e-4
because = "forces within the cones hold it"
"""
SLOTS = {
    "rises": {"pull": -9.81, "slot": [0.0, 1.0, 0.0], "rod": [0.0, 1.0, 0.0], "y": 0.0, "value": 1.0},
    "turns": {"pull": 0.0, "slot": [0.0, 0.0, 2.0], "rod": [3.0, 0.0, 2.0], "y": -1.5, "value": '"3 * sin(2 * t)"'},
}


@pytest.mark.parametrize(("slot", "engines"), [("rises", ["chipmunk"]), ("turns", [])])
def test_a_file_with_two_answers(tmp_path, slot, engines):
    """Held by friction, or not: our own run and engines fall, the file states the other answer."""
    file = tmp_path / "slot.toml"
    file.write_text(SLOT.format(**SLOTS[slot]))
    names = [word for engine in ["reference", *engines] for word in ("--engine", engine)]
    done = CliRunner().invoke(main, ["run", str(file), *names, "--out", str(tmp_path / "out"), "--json", "--jobs", "1"])
    rows = [json.loads(line) for line in (tmp_path / "out" / "rows.jsonl").read_text().splitlines()]
    stated = [row for row in rows if row["metric"] == "final[rod.vy]"]
    told = "two motions obey the laws from 0 s: bodies 0 and 2 may slip, or stick"
    assert {row["engine"] for row in stated} == {"reference", *engines}
    assert all(row["physics"] is None and row["reason"] == f"not judged: {told}" for row in stated)
    text = " ".join(done.stderr.split())
    assert f"How far from our own solution: {file}" in text and told in text.split("How far from our own solution")[1]
    assert "FAIL" not in text
