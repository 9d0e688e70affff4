"""Copies of our code that environments share: those that nobody uses any more go, and no others."""

import os

import pytest

from validation.releases import carried

HOUR, MONTH = 3600.0, 30 * 86400.0


@pytest.mark.parametrize(
    ("name", "age", "stays"),
    [
        ("0123abcd", 0.0, True),
        ("0123abcd", HOUR + 0.5, True),  # what is whole stays for a month
        ("0123abcd", MONTH, True),
        ("0123abcd", MONTH + 0.5, False),
        (f"{carried.UNFINISHED}0123", HOUR, True),  # somebody may be making it
        (f"{carried.UNFINISHED}0123", HOUR + 0.5, False),
    ],
)
def test_age_of_removed_copies(tmp_path, monkeypatch, name, age, stays):
    copy, then = tmp_path / name, 2.0**30
    (copy / "adapters").mkdir(parents=True)
    os.utime(copy, (then, then))
    monkeypatch.setattr(carried.time, "time", lambda: then + age)
    carried._sweep(tmp_path)
    assert copy.is_dir() is stays
