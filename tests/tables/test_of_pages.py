"""What files hold and pages show of one run that is kept, word by word; charts by their specifications."""

import of_print
import pytest
from made import PAGES, PRINTED
from telling import check

for package in ("altair", "pymunk", "pybullet", "mujoco"):
    pytest.importorskip(package)

OWN = [name for name in PRINTED if name.endswith(PAGES)]


@pytest.fixture(scope="module", autouse=True)
def kept():
    """What all of them show is made once, in no test's time."""
    of_print.pages()


@pytest.mark.parametrize("name", OWN)
def test_what_is_shown_is_as_it_was_kept(name):
    check(name, PRINTED[name], share=1e-7, nothing=1e-10)
