"""What a scene is, and what is true and allowed in it, is kept: whatever changes a truth or a bound is seen."""

import pytest
from made import SCENES
from telling import check


@pytest.mark.parametrize("name", SCENES)
def test_what_cells_are_made_of_their_truths_and_bounds_are_as_they_were_kept(name):
    check(name, SCENES[name])
