"""What commands print, files hold and pages show of one run that is kept, word by word."""

import pytest
from made import PRINTED
from telling import check

for package in ("altair", "pymunk", "pybullet", "mujoco"):
    pytest.importorskip(package)


@pytest.mark.parametrize("name", PRINTED)
def test_what_is_shown_is_as_it_was_kept(name):
    check(name, PRINTED[name], share=1e-7, nothing=1e-10)
