"""What a scene reads from wrong motions is kept: right ones show nothing of most metrics."""

import pytest
from made import MOTIONS
from telling import check


@pytest.mark.parametrize("name", MOTIONS)
def test_what_is_measured_of_wrong_motions_is_as_it_was_kept(name):
    check(name, MOTIONS[name], share=1e-7, nothing=1e-9)
