"""What profiles set and declare, for which scenes, with which reasons, is kept."""

import pytest
from made import of_installed
from telling import check

INSTALLED = of_installed()


@pytest.mark.parametrize("name", INSTALLED)
def test_what_profiles_set_and_declare_is_as_it_was_kept(name):
    check(name, INSTALLED[name])
