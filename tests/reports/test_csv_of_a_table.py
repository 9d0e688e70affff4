"""The button that saves a table of the page as CSV: one line of names, lines of equal length, read back by pandas."""

import io
import json
import re
import shutil
import subprocess
from importlib.resources import files

import pandas as pd
import pytest

pytestmark = pytest.mark.skipif(shutil.which("node") is None, reason="node runs the page's own function")
SCRIPT = files("reports.page").joinpath("templates", "page.js").read_text(encoding="utf-8")


def csv_of(heads, body):
    """What the page's function makes of a table; a cell is a text, or a text with its rows and columns."""
    function = re.search(r"^function csvOf\(table\) \{.*?^\}$", SCRIPT, re.DOTALL | re.MULTILINE).group()
    rows = [[cell if isinstance(cell, tuple) else (cell, 1, 1) for cell in row] for row in [*heads, *body]]
    program = f"""
    const rows = {json.dumps(rows)}.map((row) => ({{cells: row.map(([textContent, rowSpan, colSpan]) =>
      ({{textContent, rowSpan, colSpan}}))}}));
    const table = {{tHead: {{rows: rows.slice(0, {len(heads)})}}}}, $$ = () => rows;
    {function}
    process.stdout.write(csvOf(table));
    """
    return subprocess.run(["node", "-e", program], capture_output=True, text=True, check=True, timeout=60).stdout


def test_matrix_of_engines_and_profiles_as_csv():
    heads = [[("scene", 2, 1), ("bullet", 1, 2), ("mujoco", 1, 1)], ["default", "tuned", "default"]]
    body = [[("family, one", 1, 4)], [("bounce", 2, 1), "pass 3", "1/3", "pass 3"], ["pass 1", "pass 1", 'said "so"']]
    found = pd.read_csv(io.StringIO(csv_of(heads, body)))
    assert list(found.columns) == ["scene", "bullet/default", "bullet/tuned", "mujoco/default"]
    assert found["scene"].tolist() == ["family, one", "bounce", "bounce"]
    assert found.iloc[2].tolist() == ["bounce", "pass 1", "pass 1", 'said "so"']
    assert found.iloc[0, 1:].isna().all()


def test_plain_table_with_short_lines():
    found = pd.read_csv(io.StringIO(csv_of([["a", "b"]], [["1", "2"], ["3"]])))
    assert found.to_dict("list")["a"] == [1, 3] and found["b"].isna().tolist() == [False, True]
