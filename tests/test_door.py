"""Whatever packages a user's path holds, an entry either runs ours or names the foreign one in one line."""

import subprocess
import sys

import pytest

from contact_crosscheck import PACKAGES, foreign


def start(folder, *arguments):
    return subprocess.run([sys.executable, *arguments], capture_output=True, text=True, cwd=folder, timeout=120)


@pytest.mark.parametrize("name", PACKAGES)
def test_foreign_package_of_our_name(tmp_path, name):
    (tmp_path / name).mkdir()
    (tmp_path / name / "__init__.py").write_text("")
    result = start(tmp_path, "-m", "contact_crosscheck", "list", "scenes")
    assert result.returncode == 2 and result.stdout == ""
    (line,) = result.stderr.splitlines()
    assert f"{name!r} at {tmp_path / name}" in line


def test_readme_snippet_with_a_foreign_package(tmp_path):
    (tmp_path / "reports").mkdir()
    (tmp_path / "reports" / "__init__.py").write_text("")
    result = start(tmp_path, "-c", "from contact_crosscheck import load; load('x')")
    assert f"'reports' at {tmp_path / 'reports'}" in result.stderr.splitlines()[-1]


def test_foreign_package_stops_our_own_modules(tmp_path):
    (tmp_path / "adapters").mkdir()
    (tmp_path / "adapters" / "__init__.py").write_text("")
    result = start(tmp_path, "-c", "import reports.exports")
    assert "'adapters' at" in result.stderr.splitlines()[-1]


def test_foreign_folder_without_code_ignored(tmp_path):
    for name in PACKAGES:
        (tmp_path / name).mkdir()
    result = start(tmp_path, "-m", "contact_crosscheck", "list", "scenes", "--json")
    assert result.returncode == 0, result.stderr


def test_own_packages_found_in_the_checkout():
    assert foreign() == {}
