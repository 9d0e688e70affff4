"""What profiles set, declare and give to paste, what worlds hold, and what experiments switch, is kept."""

import pytest
from made import EXPERIMENTS, of_installed
from telling import check

INSTALLED = of_installed()


@pytest.mark.parametrize("name", INSTALLED)
def test_settings_and_what_worlds_hold_are_as_they_were_kept(name):
    check(name, INSTALLED[name])


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_what_experiments_switch_is_as_it_was_kept(name):
    check(name, EXPERIMENTS[name])
