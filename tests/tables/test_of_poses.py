"""Scenes posed otherwise, and what is measured once a motion is brought back, is kept."""

import pytest
from made import QUESTIONS
from telling import check

for engine in ("pymunk", "mujoco"):
    pytest.importorskip(engine)

OWN = [name for name in QUESTIONS if "posed" in name]


@pytest.mark.parametrize("name", OWN)
def test_a_scene_that_is_posed_otherwise_is_as_it_was_kept(name):
    check(name, QUESTIONS[name], share=1e-7, nothing=1e-9)
