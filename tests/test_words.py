"""What programs print for people uses standard words: those that are gone stay gone."""

import ast
import re
from pathlib import Path

import pytest
from click.testing import CliRunner

from reports.command import main

ROOT = Path(__file__).resolve().parents[1]
#: Words and phrases that are gone from what is printed, and what says it now.
GONE = {
    "asked of": "run on",
    "cannot be asked": "the engine cannot run it",
    "nobody": "none",
    "whoever": "who guards a suite",
    "stands for": "replaceable",
    "stand for": "replaceable",
    "is told": "is printed",
    "not told": "no value",
    "cures it": "fixes it",
    " one cures": "fix it",
    "is cured by": "what fixes it",
    "e: as laws": "explained (the engine's contact model predicts them)",
    "k: some": "known (cause on record)",
    "rows FAIL": "of 40 fail",
    "row FAIL": "of 40 fail",
    "FAIL known": "FAIL, known",
    "FAIL expl.": "FAIL, explained",
    "that were tried helps": "no setting helps (30 tried)",
    "is asked": "whatever e is",
    "Which engine for what": "best engine",
    "cells": "cases",
    "a cell": "a case",
    "receipt": "property check",
    "Habits": "quirks",
    "promises a solution": "exact",
    "the store": "the folder, or OUT",
    "lane of its own": "timed one at a time",
    "drifted, INVALID": "changed, INVALID",
    "set apart": "optional",
    "lifted": "embedded in 3-D",
}
#: Strings that are no sentences: fields of JSON, rows and files, which keep their names.
NAMES = re.compile(r"[\w.\-]*")
#: Rooms whose text has not been rewritten, or is no text of the terminal.
ELSEWHERE = ("page", "dashboard", "templates")


def without_code(text):
    """The text without what stands in backticks: stored names and commands."""
    return re.sub(r"`[^`]*`", "", text)


def printed():
    """``file:line`` and text of every string of `reports` that is no docstring and no bare name."""
    for path in sorted((ROOT / "reports").rglob("*.py")):
        if path.relative_to(ROOT / "reports").parts[0] in ELSEWHERE:
            continue
        tree = ast.parse(path.read_text(encoding="utf-8"))
        told = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
        for node in ast.walk(tree):
            text = node.value if isinstance(node, ast.Constant) and id(node) not in told else None
            if isinstance(text, str) and not NAMES.fullmatch(text):
                yield f"{path.relative_to(ROOT)}:{node.lineno}", without_code(text)


def found(text):
    """Which of the words that are gone a text has."""
    flat = " ".join(text.split())
    return [word for word in GONE if re.search(rf"(?<!\w){re.escape(word.strip())}(?!\w)", flat)]


def test_no_output_has_a_word_that_is_gone():
    assert [f"{where}: {words} in {text!r}" for where, text in printed() if (words := found(text))] == []


@pytest.mark.parametrize("name", [None, *main.commands])
def test_no_help_has_a_word_that_is_gone(name):
    result = CliRunner(env={"COLUMNS": "200"}).invoke(main, [*([name] if name else []), "--help"])
    assert result.exit_code == 0 and found(without_code(result.output)) == []


@pytest.mark.parametrize(
    "text",
    [
        "Needs attention: 3 rows that nobody knew", "does not rebound whatever e is asked; tuned cures it",
        "completes it; another might stand for it", "2-D: none of 30 changes of its settings that were tried helps",
        "Run cells given as JSON", "share of the rows that FAIL; e: as laws of the engine predict",
    ],
)  # fmt: skip
def test_the_words_of_old_screens_are_found(text):
    assert found(text)


def test_stored_names_and_commands_are_exempt():
    assert not found(without_code("the column `cells` of `crosscheck run-cell`; see `receipts`"))
