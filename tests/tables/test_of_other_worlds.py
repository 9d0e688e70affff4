"""Where laws speak is kept: what each says of a world in which one thing is otherwise, a number or nothing."""

import pytest
from of_other_worlds import MAKERS
from telling import check


@pytest.mark.parametrize("name", MAKERS)
def test_where_a_law_speaks_is_as_it_was_kept(name):
    check(name, MAKERS[name], share=1e-7, nothing=1e-10)
