"""What commands print of one run that is kept, word by word."""

import of_print
import pytest
from made import PAGES, PRINTED
from telling import check

for package in ("altair", "pymunk", "pybullet", "mujoco"):
    pytest.importorskip(package)

#: Pages and what explains a row have files of their own.
OWN = [name for name in PRINTED if "explain" not in name and not name.endswith(PAGES)]


@pytest.fixture(scope="module", autouse=True)
def kept():
    """What all of them show is made once, in no test's time."""
    of_print.folder()


@pytest.mark.parametrize("name", OWN)
def test_what_a_command_prints_is_as_it_was_kept(name):
    check(name, PRINTED[name], share=1e-7, nothing=1e-10)
