"""What profiles set and declare, for which scenes, with which reasons, is kept."""

import pytest
from made import of_installed
from telling import check

INSTALLED = of_installed()


@pytest.mark.parametrize("name", INSTALLED)
def test_profile_settings_and_declarations_as_kept(name):
    check(name, INSTALLED[name])
