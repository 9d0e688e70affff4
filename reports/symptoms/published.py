"""Verdicts of the published results: the report of the four engines, and the matrix of the optional ones."""

from __future__ import annotations

import base64
import gzip
import json
import re
from collections.abc import Iterator
from functools import cache
from html.parser import HTMLParser
from pathlib import Path

import pandas as pd

FOLDER = Path(__file__).parents[1] / "published"


class _Links(HTMLParser):
    """What a page offers to save: the address of each file by its name."""

    def __init__(self) -> None:
        super().__init__()
        self.files: dict[str, str] = {}

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """See `HTMLParser`."""
        told = dict(attrs)
        if tag == "a" and told.get("download"):
            self.files[str(told["download"])] = str(told.get("href"))


@cache
def values() -> pd.DataFrame:
    """Every value of the published report."""
    links = _Links()
    links.feed((FOLDER / "report.html").read_text(encoding="utf-8"))
    packed = links.files["rows.json.gz"].partition(",")[2]
    return pd.DataFrame(json.loads(gzip.decompress(base64.b64decode(packed))))


def passed() -> pd.DataFrame:
    """Checks judged and failed of each scene, engine and profile in the published report, with the engine's release."""
    rows = values()
    rows = rows[rows.iterations.isna() & rows.physics.isin(["pass", "fail"])]
    rows = rows.assign(failed=rows.physics == "fail")
    by = ["scene", "engine", "profile", "dimension", "engine_version"]
    found = rows.groupby(by, sort=False)["failed"].agg(["size", "sum"])
    return found.reset_index().rename(columns={"size": "judged", "sum": "failed"})


def of_matrix() -> Iterator[tuple[str, str, str, str, int, int, int]]:
    """Engine, release, profile, scene, dimension, failed and judged checks of each entry of the matrix that ran."""
    text = (FOLDER / "engines.md").read_text(encoding="utf-8")
    table = [[cell.strip() for cell in line.strip("|").split("|")] for line in text.splitlines() if line[:2] == "| "]
    columns = [re.split(r"[/<>]+", head.replace("<br>", "/")) for head in table[0][1:]]
    for row in table[1:]:
        scene, _, dimension = row[0].partition(" ")
        for (engine, profile, release), cell in zip(columns, row[1:], strict=True):
            if told := re.fullmatch(r"(?:(\d+) of )?(\d+) (?:fail|pass)\b.*", cell):
                yield engine, release, profile, scene, int(dimension[0]), int(told[1] or 0), int(told[2])
