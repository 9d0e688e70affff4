"""How results are told that take an engine to find, word by word."""

import pytest
from of_results import MAKERS
from telling import check

for package in ("altair", "mujoco"):
    pytest.importorskip(package)


@pytest.mark.parametrize("name", MAKERS)
def test_what_is_told_of_a_result_is_as_it_was_kept(name):
    check(name, MAKERS[name], share=1e-7, nothing=1e-10)
