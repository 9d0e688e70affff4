"""What ``explain`` says of rows of every kind, word by word."""

import of_print
import pytest
from made import PRINTED
from telling import check

for package in ("altair", "pymunk", "pybullet", "mujoco"):
    pytest.importorskip(package)

OWN = [name for name in PRINTED if "explain" in name]


@pytest.fixture(scope="module", autouse=True)
def kept():
    """What all of them show is made once, in no test's time."""
    of_print.source()


@pytest.mark.parametrize("name", OWN)
def test_what_explains_a_row_is_as_it_was_kept(name):
    check(name, PRINTED[name], share=1e-7, nothing=1e-10)
