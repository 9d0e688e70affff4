"""What is told looks on a narrow terminal with colours as it was kept."""

import pytest
from of_looks import MAKERS
from telling import check

for package in ("altair", "pymunk", "mujoco"):
    pytest.importorskip(package)


@pytest.mark.parametrize("name", MAKERS)
def test_what_is_told_looks_as_it_was_kept(name):
    check(name, MAKERS[name], share=1e-7, nothing=1e-10)
