"""What profiles set, declare and give to paste, and what worlds hold, is kept."""

import pytest
from made import of_installed
from telling import check

INSTALLED = of_installed()


@pytest.mark.parametrize("name", INSTALLED)
def test_settings_and_what_worlds_hold_are_as_they_were_kept(name):
    check(name, INSTALLED[name])
