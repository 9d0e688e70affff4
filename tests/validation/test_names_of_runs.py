"""A run that is kept under a name that is none is refused by that name, cut where nobody reads on."""

import pytest

from validation.records import store


@pytest.mark.parametrize("name", ["../x", "y" * 300, "a\nb", ""])
def test_a_name_that_is_no_id_is_told_in_one_line_of_eighty_letters_at_most(name):
    with pytest.raises(ValueError, match=r"is not the id of a run$") as error:
        store._run_of((name, "2026-01-01T00:00:00", "", "{}", "a run", "[]", 1))
    said = str(error.value).removesuffix(" is not the id of a run")
    assert "\n" not in said and len(said) <= 82 and said.startswith(repr(name[:1])[:2])
