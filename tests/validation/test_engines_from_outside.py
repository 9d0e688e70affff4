"""An engine of another package: one entry point brings its folder as it brings ours; what is broken costs it alone."""

import shutil
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from adapters import engine_folder, registry
from adapters.engine_folder import DECISIVE, TUNING, belongs_of, candidates_of, cured_of, experiments_of, laws_of
from reports import palette
from reports.command import main
from reports.listing import doctor
from validation import identity
from validation.findings import files, solutions_of
from validation.releases.choosing import ports_of
from validation.settings import decisive
from validation.settings.proofs import experiments_on

pytest.importorskip("pymunk")

ROOT = Path(__file__).parents[2]
ADAPTER = """
from dataclasses import replace

from adapters.chipmunk.engine import ChipmunkEngine
from .numbers import COLOUR


class Engine(ChipmunkEngine):
    facts = replace(ChipmunkEngine.facts, name="toy", title="Toy", package="toy-package", colour=COLOUR,
                    roles={"default": "shipped", "tuned": "tuned"})
"""
LAWS = """
from dataclasses import replace

from adapters.chipmunk.laws import DEVIATIONS as LIKE_IT

OWN = {"engine": "toy", "because": "a toy's way:\\x1b[31m it is late", "versions": ("1",)}
DEVIATIONS = tuple(replace(law, **OWN) for law in LIKE_IT)
"""
EXPERIMENTS = """
from adapters.experiment import Cured, Experiment

CANDIDATES = {"collision_slop": (1e-3, 0.1)}
BELONGS = {"start_overlap": "collision_slop"}
CURED = (Cured("default", "tuned", "stack", ({},)),)
EXPERIMENTS = (Experiment("soft", "stands", "default", "stack", "penetration", {"collision_slop": 1e-3}, {"n": 10.0}),)
"""
FAMILIES = """
[[family]]
id = "soft"
profiles = ["default"]
scene = "stack"
metrics = ["*"]
reason = "a toy's boxes sink"
source = "its manual"
releases = ">=1"
"""
PROOF = """
[[family.proof]]
cell = { profile = "default", dimension = 2, metric = "penetration", params = { n = 5 } }
set = { collision_slop = 1e-3 }
"""
TUNED = """
[candidates]
start_overlap = [0.0, 1e-4]

[belongs]
collision_bias = "collision_slop"

[[cured]]
shipped = "default"
better = "tuned"
scene = "impact"
cells = [{}]
"""
MEMBERS = ",".join(files.COLUMNS) + "\n"


def forget():
    engine_folder.forget()
    for cached in (files.findings_of, solutions_of, identity.adapter_hash, decisive.measured_of,
                   palette._own_colour, palette.role_of):  # fmt: skip
        cached.cache_clear()
    for name in [name for name in sys.modules if name.partition(".")[0] == "toy_package"]:
        del sys.modules[name]


@pytest.fixture
def site(tmp_path, monkeypatch):
    """Install the toy's package; returns the folder of the engine, and lets itself be looked at again."""
    folder = tmp_path / "site" / "toy_package" / "toy"
    (folder / "findings").mkdir(parents=True)
    (folder.parent / "__init__.py").write_text("")
    texts = {"__init__.py": ADAPTER, "numbers.py": 'COLOUR = "#102030"\n', "laws.py": LAWS,
             "experiments.py": EXPERIMENTS, "findings/families.toml": FAMILIES, "findings/members.csv": MEMBERS,
             DECISIVE: "engine,version\n"}  # fmt: skip
    for name, text in texts.items():
        (folder / name).write_text(text)
    info = tmp_path / "site" / "toy_package-1.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: toy_package\nVersion: 1\n")
    (info / "entry_points.txt").write_text(f"[{registry.GROUP}]\ntoy = toy_package.toy:Engine\n")
    monkeypatch.syspath_prepend(str(tmp_path / "site"))
    forget()
    yield folder
    forget()


def run(tmp_path, *args):
    few = ["--engine", "toy", "--profile", "default", "--dim", "2", "--jobs", "1", "--out", str(tmp_path / "out")]
    done = CliRunner().invoke(main, ["run", *args, *few])
    rows = (tmp_path / "out" / "rows.csv").read_text() if (tmp_path / "out" / "rows.csv").exists() else ""
    return done, rows


def test_parts_of_one_entry_point(site):
    assert engine_folder.folder_of("toy") == site and engine_folder.problems() == []
    assert registry.names()[-1] == "toy" and registry.facts("toy").profile("shipped") == "default"
    assert {law.engine for law in laws_of("toy")} == {"toy"} and len(laws_of("toy")) == len(laws_of("chipmunk"))
    assert "\x1b" not in laws_of("toy")[0].because
    assert [each.family for each in experiments_of("toy")] == ["soft"] == list(files.findings_of("toy").families)
    assert candidates_of("toy") == {"collision_slop": (1e-3, 0.1)} and len(cured_of("toy")) == 1
    assert belongs_of("toy") == {"start_overlap": "collision_slop"}
    assert palette.colours_of(["toy"]) == {"toy": "#102030"}
    assert palette.shape_of("default") == palette.MARKS["shipped"][0]


def test_experiments_as_data_beside_python_and_tuning(site):
    with (site / "findings" / files.FAMILIES).open("a") as families:
        families.write(PROOF)
    (site / TUNING).write_text(TUNED)
    forget()
    assert [(each.says, each.params) for each in experiments_on("toy")] == [
        ("a toy's boxes sink", {"n": 5.0}), ("stands", {"n": 10.0})
    ]  # fmt: skip
    assert candidates_of("toy") == {"start_overlap": (0.0, 1e-4)} and belongs_of("toy")["collision_bias"]
    assert [each.scene for each in cured_of("toy")] == ["impact"] and engine_folder.problems() == []
    (site / "experiments.py").unlink()
    forget()
    assert len(experiments_on("toy")) == 1 and len(cured_of("toy")) == 1


def test_wrong_tuning_file_named_by_doctor_and_tune(site):
    (site / TUNING).write_text(TUNED.replace("cells", "cell"))
    forget()
    said = (
        f"{site / TUNING}: cured 1: cell is not a field; fields are shipped, better, scene, cells, metrics, dimension"
    )
    assert candidates_of("toy") == {} == belongs_of("toy") and cured_of("toy") == () and len(experiments_of("toy")) == 1
    assert engine_folder.problems() == [f"toy: its {TUNING} cannot be loaded: {said}"]
    for call in (["tune", "toy"], ["tune", "toy", "--decisive"]):
        done = CliRunner().invoke(main, call)
        assert (done.exit_code, done.stderr) == (2, f"crosscheck: tune: toy: {said}\n")


def test_cures_of_an_outside_engine_from_its_folder(site):
    lines = (ROOT / "adapters" / "chipmunk" / DECISIVE).read_text()
    (site / DECISIVE).write_text(lines.replace("chipmunk,", "toy,"))
    forget()
    assert [entry.scene for entry in decisive.measured_of("toy")] == ["stack"]
    assert decisive.measured_of("toy")[0].text == decisive.measured_of("chipmunk")[0].text


def test_rows_of_an_outside_engine_explained_and_listed(site, tmp_path):
    done, rows = run(tmp_path, "thin_wall", "--param", "v=200")
    assert done.exit_code == 0, done.output
    assert "explained" in rows and "it is late" in rows
    done, rows = run(tmp_path, "stack", "--param", "n=10")
    assert done.exit_code == 1 and ",new," in rows
    accept = ["accept", "--engine", "toy", "--jobs", "1", "--family", "soft", "--out", str(tmp_path / "out")]
    done = CliRunner().invoke(main, accept)
    assert done.exit_code == 0, done.output
    assert (site / "findings" / files.MEMBERS).read_text().startswith(MEMBERS + "soft,default,2,n=10,")
    done, rows = run(tmp_path, "stack", "--param", "n=10")
    assert done.exit_code == 0 and ",known," in rows


def test_plugin_exception_told_by_the_doctor(site):
    (site / "numbers.py").write_text("def colour():\n    raise LookupError('no\x1b[31m colour')\nCOLOUR = colour()\n")
    registry.forget()
    found = registry.find("toy")
    assert found.reason == r"LookupError: no\u{1b}[31m colour"
    told = doctor()["traces"]["toy"]
    assert told[0] == "Traceback (most recent call last):" and any("in colour" in line for line in told)
    assert told[-1] == found.reason and "\x1b" not in str(told) and set(doctor()["traces"]) == {"toy"}
    said = CliRunner().invoke(main, ["doctor"]).output
    assert "traceback of toy" in said and "in colour" in said
    (site / "numbers.py").write_text('COLOUR = "#102030"\n')
    registry.forget()
    assert registry.find("toy").trace == "" and doctor()["traces"] == {}


BROKEN_LAWS = [
    ("raise RuntimeError('torn')", "RuntimeError: torn"),
    ("raise SystemExit(3)", "SystemExit: 3"),
    ("import os; os.abort()", "SIGABRT"),
    ("def (", "SyntaxError"),
    ("DEVIATIONS = 7", "not iterable"),
    ("DEVIATIONS = ('a law',)", "not a Deviation of toy"),
    (LAWS.replace('"engine": "toy"', '"engine": "bullet"'), "not a Deviation of toy"),
]


@pytest.mark.few(1)
@pytest.mark.parametrize(("code", "said"), BROKEN_LAWS)
def test_unreadable_laws_of_an_engine_that_runs(site, tmp_path, code, said):
    (site / "laws.py").write_text(code)
    forget()
    before = len(laws_of("chipmunk"))
    assert laws_of("toy") == () and len(laws_of("chipmunk")) == before > 0
    assert len(experiments_of("toy")) == 1
    assert any("toy: its laws cannot be loaded" in line and said in line for line in doctor()["problems"])
    done, rows = run(tmp_path, "stack", "--param", "n=1")
    (row,) = [line for line in rows.splitlines() if ",penetration," in line]
    assert ",fail,new," in row and "its laws cannot be loaded" in row and said in row, done.output


@pytest.mark.few(1)
@pytest.mark.parametrize(
    ("answer", "said"),
    [("1 / 0", "ZeroDivisionError"), ("(float('nan'), 1.0)", "predicts nan"), ("(1.0, -1.0)", "predicts 1 +- -1"),
     ("'much'", "ValueError"), ("(1.0,)", "ValueError")],
)  # fmt: skip
def test_exception_of_a_law_told_on_its_row(site, tmp_path, answer, said):
    (site / "laws.py").write_text(f"""
from adapters.law import Deviation

DEVIATIONS = (Deviation("toy", ("default",), "stack", "penetration", lambda *asked: {answer}, "because", "source"),)
""")
    forget()
    done, rows = run(tmp_path, "stack", "--param", "n=1")
    assert "Traceback" not in done.output
    (row,) = [line for line in rows.splitlines() if ",penetration," in line]
    assert "law: toy stack/penetration: " in row and said in row and ",new," in row


@pytest.mark.few(1)
@pytest.mark.parametrize(
    ("code", "said"),
    [("raise RuntimeError('torn')", "torn"), ("EXPERIMENTS = ('one',)", "not of type Experiment"),
     ("CURED = (1,)", "not of type Cured"), ("CANDIDATES = [1]", "not a mapping")],
)  # fmt: skip
def test_unreadable_experiments_of_an_outside_engine(site, code, said):
    (site / "experiments.py").write_text(code)
    forget()
    assert experiments_of("toy") == () == cured_of("toy") and candidates_of("toy") == {} == belongs_of("toy")
    assert any("toy: its experiments cannot be loaded" in line and said in line for line in doctor()["problems"])
    assert len(laws_of("toy")) > 0


def test_unreadable_findings_leave_rows_unlisted(site, tmp_path):
    (site / "findings" / files.FAMILIES).write_text("[[family")
    forget()
    done, rows = run(tmp_path, "stack", "--param", "n=10")
    assert done.exit_code == 0 and ",fail," in rows and "families.toml" in rows, done.output


def test_a_plain_module_brings_an_adapter_only(site, tmp_path):
    (site.parent / "plain.py").write_text(ADAPTER.replace(".numbers", ".toy.numbers"))
    entries = tmp_path / "site" / "toy_package-1.dist-info" / "entry_points.txt"
    entries.write_text(f"[{registry.GROUP}]\ntoy = toy_package.plain:Engine\n")
    shutil.copy(site / "laws.py", site.parent / "laws.py")
    forget()
    assert engine_folder.folder_of("toy") is None and laws_of("toy") == () and files.findings_of("toy") is None
    assert registry.facts("toy") is not None
    done = CliRunner().invoke(main, ["accept", "--engine", "toy", "--out", str(tmp_path / "out")])
    assert done.exit_code == 2


def test_invalid_colour_or_role_of_an_engine(site):
    for text, said in (('COLOUR = "red"\n', "colour is 'red'"), ("COLOUR = 7\n", "colour is '7'")):
        (site / "numbers.py").write_text(text)
        forget()
        found = registry.find("toy")
        assert found.engine is None and said in found.reason
    (site / "numbers.py").write_text('COLOUR = ""\n')
    (site / "__init__.py").write_text(ADAPTER.replace('"tuned": "tuned"', '"tuned": "best"'))
    forget()
    assert "role is 'best'" in registry.find("toy").reason


# ---- identity ----------------------------------------------------------------------------------------------------


def hashes():
    identity.adapter_hash.cache_clear()
    return {name: identity.adapter_hash(name) for name in registry.names()}


@pytest.mark.parametrize("engine", ["reference", "chipmunk", "bullet", "mujoco"])
def test_cells_after_an_edit_in_one_folder(site, engine, monkeypatch):
    """`toy` is made of Chipmunk's adapter and does not change with it: others' imports are their own matter."""
    before = hashes()
    read = Path.read_bytes
    edited = ROOT / "adapters" / engine / "simulation.py"
    monkeypatch.setattr(Path, "read_bytes", lambda self: read(self) + b"\n# edited\n" * (self == edited))
    after = hashes()
    assert {name for name in before if before[name] != after[name]} == {engine, *ports_of(engine)}


@pytest.mark.parametrize("name", ["laws.py", "experiments.py", TUNING, "findings/families.toml"])
def test_judging_code_outside_the_identity_of_a_cell(site, name):
    before = hashes()
    (site / name).write_text("# nothing")
    assert hashes() == before


@pytest.mark.parametrize("name", ["__init__.py", "numbers.py"])
def test_own_imports_of_an_adapter_in_its_identity(site, name):
    before = hashes()
    with (site / name).open("a") as file:
        file.write("# another line\n")
    after = hashes()
    assert {name for name in before if before[name] != after[name]} == {"toy"}


@pytest.mark.parametrize("shared", ["stepping.py", "scene/shapes.py", "receipts/probes.py", "isolation/foreign.py"])
def test_the_shared_vocabulary_is_in_every_identity(site, monkeypatch, shared):
    before, read = hashes(), Path.read_bytes
    edited = ROOT / "adapters" / shared
    monkeypatch.setattr(Path, "read_bytes", lambda self: read(self) + b"\n" * (self == edited))
    assert not set(before.items()) & set(hashes().items())


def test_identity_of_adapters_with_our_solver(site, monkeypatch):
    before, read = hashes(), Path.read_bytes
    edited = ROOT / "reference_solver" / "exact" / "loop.py"
    monkeypatch.setattr(Path, "read_bytes", lambda self: read(self) + b"\n" * (self == edited))
    after = hashes()
    assert {name for name in before if before[name] != after[name]} == {registry.solver()}
