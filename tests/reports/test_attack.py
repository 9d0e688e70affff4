"""The attack: an adapter whose impulses or friction are two per cent low. ``run`` fails and ``accept`` refuses."""

import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from adapters import registry
from reports import exports
from reports.command import main
from validation.findings import files
from validation.identity import adapter_hash

pytest.importorskip("pymunk")

ATTACKED = """
from adapters.chipmunk import ChipmunkEngine
from adapters.conformance.planted_faults import Planted


class Low(Planted):
    def __init__(self):
        super().__init__(ChipmunkEngine(), "{fault}", 0.02)


class Engine(Low):
    @property
    def name(self):
        return "attacked"
"""
#: Reasons that would cover everything if a list could bless it.
FAMILY_SCENES = ("impact", "stack", "incline", "slide")
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
    for scene in FAMILY_SCENES
)


def forget():
    registry.forget()
    for cached in (files.findings_of, adapter_hash):
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


#: Cells of the standard suite, which is what can be listed: a column, a blow, boxes that slide. All have impulses, most
#: have friction.
CELLS = {
    "stack": ["--param", "n=5"],
    "impact": ["--param", "e=.5", "--param", "v=6"],
    "incline": ["--param", "ratio=2"],
    "slide": [],
}
#: Scenes whose cells have no friction to be low in: what runs there is as sound as without the fault.
WITHOUT = {"impulse": set(), "friction": {"impact"}}


@pytest.mark.long
def test_refusal_to_accept_a_fault_of_two_per_cent(attacked, request):
    out, call = str(attacked / "out"), CliRunner().invoke
    common = ["--engine", "attacked", "--profile", "tuned", "--dim", "2", "--jobs", "1", "--out", out]
    told, sound = [], WITHOUT[request.node.callspec.params["attacked"]]
    for scene, params in CELLS.items():
        ran = call(main, ["run", scene, *params, *common])
        assert scene in sound or ran.exit_code == 1, ran.output
        rows = [row for row in exports.load_rows(Path(out)) if row.scene == scene]
        assert rows
        unreal = any(row.outcome == "invalid" or row.metric.startswith("realised_") for row in rows)
        assert unreal == (scene not in sound), scene
        accept = ["accept", "--engine", "attacked", "--jobs", "1", "--out", out]
        for family in FAMILY_SCENES:
            accept += ["--family", family]
        answered = call(main, accept)
        told += [
            line
            for line in answered.stderr.splitlines()
            if "property checks do not hold" in line or "invalid: " in line
        ]
        assert scene in sound or answered.exit_code == 1, answered.output
        assert scene in sound or call(main, ["run", scene, *params, *common]).exit_code == 1
    assert told
    listed = (attacked / "findings" / "attacked" / files.MEMBERS).read_text().splitlines()
    assert listed[0] == ",".join(files.COLUMNS)
    assert {line.partition(",")[0] for line in listed[1:]} <= sound
