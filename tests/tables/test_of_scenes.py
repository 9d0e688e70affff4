"""What a scene is, and what is true and allowed in it, is kept: whatever changes a truth or a bound is seen."""

import pytest
from made import SCENES
from telling import check


@pytest.mark.parametrize("name", SCENES)
def test_scenes_truths_and_bounds_against_the_kept_table(name):
    check(name, SCENES[name])
