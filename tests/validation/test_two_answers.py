"""A scene file of which two motions obey the laws: our own run says so, and an engine may follow either."""

from dataclasses import replace

import pytest

from validation.canonical import Check
from validation.cells import Outcome, Slot
from validation.findings import Known
from validation.judging.rows import rows_of
from validation.judging.verdicts import judge, judge_physics
from validation.running.execution import execute

ELEVATOR = """
name = "rod in an elevator"
dimension = 2
gravity = [0.0, -9.81]
duration = 0.1
[[bodies]]
name = "left"
shape = {{ type = "half_space", normal = [1.0, 0.0], offset = -0.5400332889206209 }}
motion = "prescribed"
twist = [0.0, 1.0, 0.0]
[[bodies]]
name = "right"
shape = {{ type = "half_space", normal = [-1.0, 0.0], offset = -0.5400332889206209 }}
motion = "prescribed"
twist = [0.0, 1.0, 0.0]
[[bodies]]
name = "rod"
shape = {{ type = "capsule", half_length = 0.5, radius = 0.05 }}
mass = 1.0
pose = [0.0, 0.0, 0.2]
twist = [0.0, 1.0, 0.0]
[[pairs]]
friction = {friction}
[[checks]]
quantity = "rod.vy"
value = 0.019
tolerance = 0.02
because = "it falls: 1 - 9.81 * .1"
"""


def both(tmp_path, friction, value):
    """Rows of our own run and of another engine whose rod has the speed ``value`` at the end."""
    path = tmp_path / "elevator.toml"
    path.write_text(ELEVATOR.format(friction=friction))
    own = execute(Slot(str(path), (), 2, "reference", "reference", 1 / 240))
    slot = replace(own.slot, profile="classical")
    metrics = {name: (value, "") if name == "final[rod.vy]" else found for name, found in own.metrics.items()}
    other = replace(own, slot=slot, outcome=Outcome.OK, reason="", certificate={}, metrics=metrics)
    rows = [row for row in rows_of("", [own, other]) if row.metric == "final[rod.vy]"]
    return own, {row.profile: row for row in rows}


def test_engine_on_the_other_of_two_motions_not_failed(tmp_path):
    own, rows = both(tmp_path, 1.0, 1.0)
    assert own.certificate["full"]["several"] and own.certificate["full"]["determined"] == 0.0
    told = "two motions obey the laws from 0 s: bodies "
    assert rows["classical"].physics is None and not rows["classical"].alarming
    assert rows["classical"].reason.startswith(f"not judged: {told}")
    assert told in rows["reference"].certificate


def test_engine_that_follows_neither_of_two_motions_fails(tmp_path):
    own, rows = both(tmp_path, 0.05, 1.0)
    assert own.outcome is Outcome.OK and not own.certificate["full"]["several"]
    assert rows["classical"].physics == "fail" and rows["classical"].alarming
    assert rows["reference"].physics == "pass"


@pytest.mark.parametrize("bound", [float("inf"), float("nan")])
def test_tolerance_that_is_nan_judges_nothing(bound):
    check = Check("apex", "m", 1.0, bound, "because", "source")
    assert judge_physics(3.0, check) is None
    verdict = judge(3.0, check, [], Known(None, True, ""))
    assert verdict.physics is None and verdict.standing is None and verdict.reason.startswith("not judged")
