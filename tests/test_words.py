"""What programs print for people uses standard words: those that are gone stay gone."""

import ast
import re
import tokenize
import tomllib
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
#: Phrases that are gone from reasons of known failures and from strings of adapters and of `validation`.
GONE_FROM_REASONS = (
    "asked of",
    "asks for",
    "behind the plugin line",
    "cannot be had",
    "has a say",
    "in singles",
    "is no number",
    "is told",
    "knows nothing",
    "makes of",
    "nobody",
    "not told",
    "owes",
    "stands twice",
    "sweeps leave",
    "takes back",
    "to be had",
    "what stands",
    "whoever",
)
#: Phrases that are gone from docstrings and comments outside the solver.
GONE_FROM_DOCSTRINGS = (
    "are told",
    "asks for",
    "asked of",
    "cannot be asked",
    "cures it",
    "has a say",
    "is told",
    "knows nothing",
    "lane of its own",
    "makes of",
    "nobody",
    "not told",
    "null answers",
    "owed",
    "owes",
    "stand once",
    "stands for",
    "stands once",
    "told apart",
    "what stands",
    "whoever",
)
#: Strings that are no sentences: fields of JSON, rows and files, which keep their names.
NAMES = re.compile(r"[\w.\-]*")


def without_code(text):
    """The text without what stands in backticks: stored names and commands."""
    return re.sub(r"`[^`]*`", "", text)


def printed(package="reports"):
    """``file:line`` and text of every string of a package that is no docstring and no bare name."""
    for path in sorted((ROOT / package).rglob("*.py")):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        docstrings = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
        for node in ast.walk(tree):
            text = node.value if isinstance(node, ast.Constant) and id(node) not in docstrings else None
            if isinstance(text, str) and not NAMES.fullmatch(text):
                yield f"{path.relative_to(ROOT)}:{node.lineno}", without_code(text)


def documented(package):
    """``file:line`` and text of every docstring and comment of a package, and of other long strings."""
    for path in sorted((ROOT / package).rglob("*.py")):
        with path.open("rb") as file:
            for token in tokenize.tokenize(file.readline):
                if token.type == tokenize.COMMENT or token.string.startswith(('"""', 'r"""')):
                    yield f"{path.relative_to(ROOT)}:{token.start[0]}", without_code(token.string)


def reasons():
    """File and text of every reason of a known failure."""
    for path in sorted((ROOT / "adapters").glob("*/findings/*.toml")):
        waiting = [tomllib.loads(path.read_text(encoding="utf-8"))]
        while waiting:
            value = waiting.pop()
            if isinstance(value, dict):
                if isinstance(value.get("reason"), str):
                    yield str(path.relative_to(ROOT)), value["reason"]
                waiting += value.values()
            elif isinstance(value, list):
                waiting += value


def found(text, gone=GONE):
    """Words of ``gone`` in a text."""
    flat = " ".join(text.split())
    return [word for word in gone if re.search(rf"(?<!\w){re.escape(word.strip())}(?!\w)", flat)]


def test_no_banned_word_in_the_output():
    texts = [*printed(), *printed("contact_crosscheck")]
    assert [f"{where}: {words} in {text!r}" for where, text in texts if (words := found(text))] == []


def test_no_banned_word_on_a_page():
    """Templates of the report and the dashboard, without what they compute, code and tags."""
    paths = [*(ROOT / "reports").rglob("*.html.j2"), *(ROOT / "docs").rglob("*.md.j2")]
    texts = {path.name: re.sub(r"\{[{%#].*?[}%#]\}|<[^>]*>", "", path.read_text(encoding="utf-8")) for path in paths}
    assert len(texts) > 15
    told = ((name, found(without_code(text), [*GONE, *GONE_FROM_REASONS])) for name, text in texts.items())
    assert {name: words for name, words in told if words} == {}


def test_no_banned_phrase_in_a_reason():
    told = [*reasons(), *printed("adapters"), *printed("validation")]
    assert len(told) > 1000
    assert [f"{where}: {words} in {text!r}" for where, text in told if (words := found(text, GONE_FROM_REASONS))] == []


@pytest.mark.parametrize("package", ["adapters", "validation", "reports", "contact_crosscheck"])
def test_no_docstring_or_comment_has_a_phrase_that_is_gone(package):
    texts = [*documented(package)]
    assert len(texts) > 50
    assert [f"{where}: {words}" for where, text in texts if (words := found(text.lower(), GONE_FROM_DOCSTRINGS))] == []


@pytest.mark.parametrize("name", [None, *main.list_commands(None)])
def test_no_banned_word_in_the_help(name):
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
def test_banned_words_found_in_old_screens(text):
    assert found(text)


def test_stored_names_and_commands_are_exempt():
    assert not found(without_code("the column `cells` of `crosscheck run-cell`; see `receipts`"))
