"""What laws predict is kept, with bands and reasons."""

import pytest
from made import LAWS
from of_laws import APART
from telling import check

OWN = [name for name in LAWS if not name.startswith(tuple(f"laws/{engine}-" for engine in APART))]


@pytest.mark.parametrize("name", OWN)
def test_predictions_of_laws_as_kept(name):
    check(name, LAWS[name], share=1e-7, nothing=1e-10)
