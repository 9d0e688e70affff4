"""How is told, word by word, what takes minutes, releases or a quiet machine to find."""

import pytest
from of_shown import MAKERS
from telling import check

for package in ("altair", "pymunk"):
    pytest.importorskip(package)


@pytest.mark.parametrize("name", MAKERS)
def test_what_is_made_up_is_told_as_it_was_kept(name):
    check(name, MAKERS[name], share=1e-7, nothing=1e-10)
