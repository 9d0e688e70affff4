"""The attack: an adapter whose impulses or friction are two per cent low. ``run`` fails and ``accept`` refuses."""

import sys

import pytest
from click.testing import CliRunner

from adapters import registry
from reports.command import main
from validation.findings import files
from validation.identity import adapter_hash

pytest.importorskip("pymunk")

ATTACKED = """
from adapters.chipmunk import ChipmunkEngine
from adapters.planted_faults import Planted


class Low(Planted):
    def __init__(self):
        super().__init__(ChipmunkEngine(), "{fault}", 0.02)


class Engine(Low):
    @property
    def name(self):
        return "attacked"
"""
#: Reasons that would cover everything if a list could bless it.
FAMILIES = "".join(
    f"""
[[family]]
id = "{scene}"
profiles = ["tuned"]
scene = "{scene}"
metrics = ["*"]
reason = "it is by design, says the attacker"
source = "the attacker"
releases = ">=0"
"""
    for scene in ("impact", "stack", "incline")
)


def forget():
    for cached in (registry.find, files.findings_of, adapter_hash):
        cached.cache_clear()


@pytest.fixture(params=["impulse", "friction"])
def attacked(request, tmp_path, monkeypatch):
    """An installed engine with a fault, and findings that excuse whatever they can."""
    site, info = tmp_path / "site", tmp_path / "site" / "attacked-1.dist-info"
    info.mkdir(parents=True)
    (site / "attacked_engine.py").write_text(ATTACKED.format(fault=request.param))
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: attacked\nVersion: 1\n")
    (info / "entry_points.txt").write_text(f"[{registry.GROUP}]\nattacked = attacked_engine:Engine\n")
    monkeypatch.syspath_prepend(str(site))
    folder = tmp_path / "findings"
    (folder / "attacked").mkdir(parents=True)
    (folder / "attacked" / files.FAMILIES).write_text(FAMILIES)
    monkeypatch.setattr(files, "findings_folder", lambda engine: folder / engine)
    forget()
    yield tmp_path
    forget()
    sys.modules.pop("attacked_engine", None)


def test_a_fault_of_two_per_cent_cannot_be_accepted(attacked):
    out = str(attacked / "out")
    call = CliRunner().invoke
    cells = ["stack", "--param", "n=1", "--engine", "attacked", "--profile", "tuned", "--dim", "2", "--jobs", "1"]
    ran = call(main, ["run", *cells, "--out", out])
    assert ran.exit_code == 1, ran.output
    assert "INVALID" in ran.stdout
    accept = ["accept", "--engine", "attacked", "--jobs", "1", "--out", out]
    for family in ("impact", "stack", "incline"):
        accept += ["--family", family]
    refused = call(main, accept)
    assert refused.exit_code == 1, refused.output
    assert "its receipts or its certificate do not hold" in refused.stderr
    listed = (attacked / "findings" / "attacked" / files.MEMBERS).read_text().splitlines()
    assert listed == [",".join(files.COLUMNS)]
    assert call(main, ["run", *cells, "--out", out]).exit_code == 1
