"""The bundle: everything about a run in one archive whose checksums hold."""

import hashlib
import json
import zipfile

from click.testing import CliRunner

from reports.bundle import citation
from reports.command import main
from validation.store import Run


def test_the_bundle_holds_what_it_lists_and_its_checksums_hold(page_folder, page_source, tmp_path):
    path = tmp_path / "b.zip"
    result = CliRunner().invoke(main, ["bundle", "-o", str(path), "--out", str(page_folder)])
    assert result.exit_code == 0, result.output
    assert result.stdout.strip() == str(path)
    with zipfile.ZipFile(path) as archive:
        texts = {name.partition("/")[2]: archive.read(name) for name in archive.namelist()}
    sums = dict(reversed(line.split("  ")) for line in texts.pop("SHA256SUMS").decode().splitlines())
    assert sums == {name: hashlib.sha256(text).hexdigest() for name, text in texts.items()}
    for name in sums.keys() - {"README.txt"}:
        assert name in texts["README.txt"].decode()
    assert len(texts["rows.jsonl"].splitlines()) == len(page_source.rows)
    assert len(texts["observations.jsonl"].splitlines()) == len(page_source.observations)
    environment = json.loads(texts["environment.json"])
    assert environment["run"]["id"] == page_source.run.id
    assert environment["packages_now"]["numpy"]
    assert texts["report.html"].startswith(b"<!doctype html>")
    assert f"run {page_source.run.id}" in texts["CITATION.cff"].decode()


def test_the_citation_names_run_and_commit():
    text = citation(Run("20260101-000000", "2026-01-01T00:00:00", "abc123", {}, "t", (), True))
    assert 'commit: "abc123"' in text and "run 20260101-000000" in text
    assert text.startswith("cff-version:")
