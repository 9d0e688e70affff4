"""What no test may bring about is told by the test that did it, also where the code under test swallows exceptions."""

from pathlib import Path

import pytest

HERE = Path(__file__).parent
OPTIONS = ("-q", "-p", "no:randomly", "-p", "no:cacheprovider", "-p", "no:xdist")


def planted(pytester, lines, before=""):
    """Run a test for each line, which does it and swallows what that raises, and one after them that does nothing."""
    pytester.makeconftest((HERE / "conftest.py").read_text(encoding="utf-8"))
    folder = pytester.mkdir("reports")
    (folder / "conftest.py").write_text((HERE / "reports" / "conftest.py").read_text(encoding="utf-8"))
    tests = [
        f"def test_{k}():\n    with contextlib.suppress(Exception):\n        {line}\n" for k, line in enumerate(lines)
    ]
    head = f"""
import contextlib
import pytest
import click
from click.testing import CliRunner
from rich.console import Console
from rich.table import Table
from adapters.engine import EngineError
from adapters.scene.shapes import SceneError


@click.command()
@click.option("--json", "text")
def told(text):
    click.echo(text)

{before}
"""
    (folder / "test_planted.py").write_text(head + "\n".join([*tests, "def test_last():\n    pass\n"]))
    # A process of its own: in this one what watches the tests around may be at work already, and would tell it twice.
    return pytester.runpytest_subprocess(*OPTIONS, "reports")


SWALLOWED = {
    "raise SceneError('first\\nsecond')": "SceneError does not say one line*test_planted.py:20",
    "raise SceneError(' ')": "SceneError does not say one line",
    "raise SceneError()": "SceneError does not say one line",
    "raise SceneError('a', 'b')": "SceneError does not say one line",
    "raise EngineError(7)": "EngineError does not say one line",
    "Table('a', 'b', 'c').add_row('1', '2')": "a row of 2 cells in a table of 3 columns",
    "Table('a').add_row('1', '2')": "a row of 2 cells in a table of 1 columns",
    "Table('a', 'b').add_row('1', None)": "a row with nothing in a cell",
    "Console(quiet=True).print(None)": "nothing is printed",
    "CliRunner().invoke(told, ['--json', '[\\n  1\\n]'])": "is laid out otherwise",
    "CliRunner().invoke(told, ['--json', '[{\"a\": 1}]'])": "is laid out otherwise",
}
FINE = [
    "raise SceneError('one line')",
    "raise EngineError('first\\nsecond')",
    "CliRunner().invoke(told, ['--json', '[\\n 1\\n]'])",
    "CliRunner().invoke(told, ['--json', '{\"a\": [1]}'])",
    "CliRunner().invoke(told, ['--json', 'not JSON'])",
    "Table('a', 'b').add_row('1', '2')",
    "Table('a', 'b').add_row('1')",
    "Console(quiet=True).print('')",
]


def test_swallowed_exceptions_reported_by_their_test(pytester):
    result = planted(pytester, [*SWALLOWED, *FINE])
    result.assert_outcomes(passed=len(SWALLOWED) + len(FINE) + 1, errors=len(SWALLOWED))
    result.stdout.fnmatch_lines([f"*{told}*" for told in SWALLOWED.values()])
    result.stdout.fnmatch_lines([f"ERROR *test_planted.py::test_{k}*" for k in range(len(SWALLOWED))])


def test_swallowed_exceptions_in_set_up_and_tear_down(pytester):
    """Of a fixture that the test asks for by that test; of one that ends after the last by that."""
    shared = """
@pytest.fixture(scope="module", autouse=True)
def shared():
    SceneError("")
    yield
    SceneError("")
"""
    result = planted(pytester, ["pass"], shared)
    result.assert_outcomes(passed=2, errors=2)
    result.stdout.fnmatch_lines(["ERROR *::test_0*", "ERROR *::test_last*"])


@pytest.mark.few(2)
@pytest.mark.parametrize(
    ("every", "asked", "passed"),
    [
        ("", (), 3),
        ("", ("reports/test_many.py::test_long",), 1),
        ("1", (), 8),
        ("", ("reports/test_many.py::test_many",), 6),
    ],
)
def test_long_tests_and_samples_of_many_cases(pytester, monkeypatch, every, asked, passed):
    monkeypatch.setenv("CROSSCHECK_ALL", every)
    monkeypatch.delenv("CROSSCHECK_REQUIRE_ENGINES", raising=False)
    pytester.makeconftest((HERE / "conftest.py").read_text(encoding="utf-8"))
    (pytester.mkdir("reports") / "test_many.py").write_text("""
import pytest

@pytest.mark.few(2)
@pytest.mark.parametrize("k", range(6))
def test_many(k):
    pass

@pytest.mark.long
def test_long():
    pass

def test_short():
    pass
""")
    result = pytester.runpytest_subprocess(*OPTIONS, *asked)
    result.assert_outcomes(passed=passed, deselected=8 - passed if not asked else 0)
