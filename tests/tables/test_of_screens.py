"""What six commands print is as it was kept, line by line."""

import pytest
import screens
from telling import check_screen

for package in ("pymunk", "pybullet", "mujoco"):
    pytest.importorskip(package)


@pytest.fixture(scope="module", autouse=True)
def kept():
    """The run that most of them are about is made once, in no test's time."""
    screens.place()


@pytest.mark.parametrize("name", screens.SCREENS)
def test_output_of_a_command_as_kept(name):
    check_screen(name, screens.SCREENS[name])
