"""A mark of a family on the page, of each kind of row there is: its words, its share, and whether it leads to rows."""

from collections import Counter

import pytest

from reports.matrix import UNJUDGED, Field
from reports.page.verdicts import Mark, family_mark
from reports.wording import LABELS, MARKS

#: Nobody asked the engine anything there: no row to lead to.
NOWHERE = {"unsupported", "not_installed"}


@pytest.mark.parametrize("mark", sorted({*MARKS, *LABELS}))
def test_a_mark_of_rows_of_one_kind_leads_to_them_unless_the_engine_was_not_asked(mark):
    found = family_mark(Field(Counter({mark: 3})), "there")
    judged, passing = mark not in UNJUDGED, mark == "pass"
    if mark in NOWHERE:
        assert found == Mark(mark, "")
        assert not judged
        return
    assert found.href == "#there" and found.title == ""
    assert found.text == ("" if not judged else "3" if passing else "3/3")
    assert found.share == (1.0 if judged and not passing else 0.0)


def test_nothing_at_all_is_unsupported_and_leads_nowhere():
    assert family_mark(None, "there") == Mark("unsupported", "")
