"""What commands can be asked, and what their help says, is as it was kept."""

from made import OPTIONS
from telling import check


def test_options_and_their_help_are_as_they_were_kept():
    check("print/options", OPTIONS["print/options"])
