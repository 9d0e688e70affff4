"""What is refused is kept, each in the one line that a user reads."""

import pytest
from of_refusals import MAKERS
from telling import check

for package in ("pymunk", "pybullet", "mujoco"):  # lists of what there is name profiles of all of them
    pytest.importorskip(package)


@pytest.mark.parametrize("name", MAKERS)
def test_what_is_refused_is_told_as_it_was_kept(name):
    check(name, MAKERS[name])
