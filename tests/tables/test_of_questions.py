"""Cells of plans, replays, frontiers, planted faults and timed units are kept."""

import pytest
from made import QUESTIONS
from telling import check

for engine in ("pymunk", "mujoco"):
    pytest.importorskip(engine)

OWN = [name for name in QUESTIONS if "posed" not in name]


@pytest.mark.parametrize("name", OWN)
def test_what_questions_ask_is_as_it_was_kept(name):
    check(name, QUESTIONS[name], share=1e-7, nothing=1e-9)
