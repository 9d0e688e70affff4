"""What laws predict is kept, with bands and reasons."""

import pytest
from made import LAWS
from telling import check


@pytest.mark.parametrize("name", LAWS)
def test_what_a_law_predicts_is_as_it_was_kept(name):
    check(name, LAWS[name], share=1e-7, nothing=1e-10)
