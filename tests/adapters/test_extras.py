"""Hints of what to install: packages that registries have, never this project, which none has."""

from importlib.metadata import PackageNotFoundError
from pathlib import Path

from adapters import extras

ROOT = Path(__file__).parents[2]


def test_packages_of_an_extra_on_this_system(monkeypatch):
    listed = ["click>=8", 'b>=1; extra == "two"', 'a<2,>=1; (python_version > "3") and extra == "two"',
              'c; os_name == "none" and extra == "two"', 'd; extra == "one"', 'e; python_version > "3"']  # fmt: skip
    monkeypatch.setattr(extras, "required", lambda: listed)
    assert extras.packages("two") == ["a<2,>=1", "b>=1"]
    assert extras.install("two") == "pip install 'a<2,>=1' 'b>=1'"


def test_hint_without_metadata(monkeypatch):
    def missing():
        raise PackageNotFoundError(extras.PROJECT)

    monkeypatch.setattr(extras, "required", missing)
    assert extras.packages("shapes") == [] and extras.install("shapes") == "pip install -e '.[shapes]'"


def test_no_hint_names_this_project():
    rooms = ("adapters", "contact_crosscheck", "reference_solver", "reports", "validation")
    files = [path for room in rooms for path in (ROOT / room).rglob("*.py")]
    assert len(files) > 200
    assert [str(path) for path in files if "contact-crosscheck[" in path.read_text(encoding="utf-8")] == []
