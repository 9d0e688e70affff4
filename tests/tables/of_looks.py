"""Tables of how what is told looks on a narrow terminal with colours: what stands out, and where lines are folded."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from functools import partial
from typing import TextIO

import of_results
import of_shown
import pytest
from click.testing import CliRunner
from of_print import numbered
from rich.console import Console
from telling import Sections

from reports.command import main

WIDTH = 60
#: What is made up elsewhere, of which this is another look.
MADE_UP = {
    "looks/proofs": of_results.proofs, "looks/cures": of_results.cures, "looks/frontiers": of_results.frontiers,
    "looks/relations": of_results.relations, "looks/field": of_results.field_notes,
    "looks/residuals": of_results.laws_of_contact, "looks/piles": of_shown.clocked_piles,
    "looks/bisected": of_shown.bisected, "looks/environments": of_shown.kept_environments,
    "looks/times": of_shown.times, "looks/doctor": of_shown.doctor, "looks/attacked": of_shown.refusals,
    "looks/corruptions": of_shown.corruptions, "looks/self-test": of_shown.tried_faults,
}  # fmt: skip
#: Commands that need no run.
ASKED = (("describe", "bounce"), ("list", "scenes"), ("list", "suites"))


def marked(text: str, name: str) -> dict[str, str]:
    """Lines by their number, with codes of colours as words."""
    return numbered(re.sub(r"\x1b\[([0-9;]*)m", r"{\1}", text), name)


def narrow(file: TextIO, **given: object) -> Console:
    """A narrow terminal with colours, whatever was asked for."""
    return Console(file=file, width=WIDTH, markup=False, emoji=False, force_terminal=True, color_system="standard")


def said(arguments: Sequence[str]) -> dict[str, str]:
    """What a command prints there."""
    environment = {"COLUMNS": str(WIDTH), "FORCE_COLOR": "1", "TERM": "xterm", "COLORTERM": "", "NO_COLOR": None}
    result = CliRunner().invoke(main, list(arguments), color=True, env=environment)
    return {"status": str(result.exit_code)} | marked(result.stdout, "out") | marked(result.stderr, "err")


def looks(make: Callable[[], Sections]) -> Sections:
    """What a maker tells, on such a terminal; the same section by section, and no data."""
    with pytest.MonkeyPatch.context() as patch:
        for module in (of_results, of_shown):
            patch.setattr(module, "Console", narrow)
            patch.setattr(module, "numbered", marked)
            patch.setattr(module, "told", lambda data: {})
        patch.setattr(of_shown, "said", lambda arguments: {} if "--json" in arguments else said(arguments))
        return {title: own for title, own in make().items() if own and "data" not in title}


#: What `made` lists with the other tables.
MAKERS: dict[str, Callable[[], Sections]] = {name: partial(looks, make) for name, make in MADE_UP.items()}
MAKERS["looks/described"] = lambda: {" ".join(call): said(call) for call in ASKED}
