"""Discovery: engines load late, and a missing or broken plugin costs only its own rows."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from importlib.metadata import EntryPoint, EntryPoints
from pathlib import Path

import pytest

from adapters import engine_folder, registry
from adapters.engine import EngineError
from adapters.extras import install, packages
from adapters.needs import needs
from reports.listing import engines
from validation import catalogue
from validation.catalogue import CATALOGUE

ROOT = Path(__file__).resolve().parents[2]

PLUGINS = """
import sys
from tests_plugin_base import Healthy

class MissingPackage(Healthy):
    def version(self):
        import package_that_is_not_there

class BrokenVersion(Healthy):
    def version(self):
        raise ZeroDivisionError("first line\\nsecond line")

class BrokenInit(Healthy):
    def __init__(self):
        raise RuntimeError("cannot start")

class NotAnEngine:
    def version(self):
        return "1"

def leave():
    sys.exit("left the process")
"""
BASE = """
from adapters.engine import Engine, EngineFacts, Scheme

class Healthy(Engine):
    facts = EngineFacts("healthy", "Healthy", "healthy-package", frozenset({2}), Scheme("none", 0), 0.01)
    profiles = {}
    def version(self): return "1.2"
    def refuses(self, scene, profile): return None
    def build(self, scene, dt, settings): raise NotImplementedError
    def declares(self, profile, needs, dt): return {}
"""


@pytest.fixture
def plugins(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Registers one healthy engine and one of each kind of broken one."""
    (tmp_path / "tests_plugins.py").write_text(PLUGINS)
    (tmp_path / "tests_plugin_base.py").write_text(BASE)
    (tmp_path / "tests_plugin_syntax.py").write_text("def (")
    (tmp_path / "tests_plugin_import.py").write_text("raise ImportError('two\\nlines')")
    monkeypatch.syspath_prepend(str(tmp_path))
    values = {
        "zeta": "tests_plugin_base:Healthy",
        "healthy": "tests_plugin_base:Healthy",
        "missing_package": "tests_plugins:MissingPackage",
        "broken_version": "tests_plugins:BrokenVersion",
        "broken_init": "tests_plugins:BrokenInit",
        "not_an_engine": "tests_plugins:NotAnEngine",
        "leaves": "tests_plugins:leave",
        "no_module": "tests_plugin_nowhere:Engine",
        "no_class": "tests_plugins:Nowhere",
        "syntax": "tests_plugin_syntax:Engine",
        "two_lines": "tests_plugin_import:Engine",
        "chipmunk": "tests_plugin_base:Healthy",
    }
    entries = [EntryPoint(name, value, registry.GROUP) for name, value in values.items()]
    registry.forget()
    monkeypatch.setattr(registry, "entry_points", lambda: EntryPoints(entries))
    yield
    registry.forget()
    for name in [name for name in sys.modules if name.startswith("tests_plugin")]:
        del sys.modules[name]


def test_our_engines_come_first_and_others_by_name(plugins: None) -> None:
    names = registry.names()
    assert names == sorted(names) and len(names) == 12  # an engine of others under a name of ours is none of ours


def test_entry_points_read_twice(plugins: None, monkeypatch) -> None:
    calls, read = [], registry.entry_points
    monkeypatch.setattr(registry, "entry_points", lambda: calls.append("read") or read())
    catalogue.forget()
    for _ in range(2):
        for name in registry.names():
            registry.find(name), registry.facts(name), registry.entry(name), registry.is_ranked(name, "default")
        registry.usual(), catalogue.broken(), len(CATALOGUE), engine_folder.folder_of("healthy")
    assert calls == ["read"]
    registry.forget()
    assert registry.names() and calls == ["read", "read"]


def test_version_of_an_installed_engine(plugins: None) -> None:
    found = registry.find("healthy")
    assert found.engine is not None and (found.version, found.reason) == ("1.2", "")
    assert registry.load("healthy").version() == "1.2"


def test_missing_package_of_an_outside_engine_with_its_pip_line(plugins: None) -> None:
    reason = registry.find("missing_package").reason
    assert reason.endswith("; pip install healthy-package") and "contact-crosscheck" not in reason


def test_distribution_of_an_engine_that_cannot_be_imported(tmp_path, monkeypatch):
    (tmp_path / "hollow.py").write_text("import a_package_that_is_not_there")
    info = tmp_path / "hollow_adapter-1.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: hollow-adapter\nVersion: 1\n")
    (info / "entry_points.txt").write_text(f"[{registry.GROUP}]\nhollow = hollow:Engine\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    registry.forget()
    reason = registry.find("hollow").reason
    assert "a_package_that_is_not_there" in reason and "it is an engine of hollow-adapter" in reason
    registry.forget()


def test_missing_engine_of_ours_with_its_extra(monkeypatch) -> None:
    name = registry.names()[1]
    adapter = type(registry.adapter(name))

    def missing(self):
        raise ImportError("No module named 'it'")

    monkeypatch.setattr(adapter, "version", missing)
    registry.forget()
    reason = registry.find(name).reason
    assert reason.endswith(f"; {install(name)}") and packages(name) and all(each in reason for each in packages(name))
    registry.forget()


def test_engine_set_apart_in_a_run_without_names(monkeypatch):
    apart = [name for name in registry.names() if registry.facts(name).apart]
    usual = [name for name in registry.names() if name not in apart]
    assert apart and "chipmunk" in usual
    monkeypatch.delenv(registry.REQUIRED, raising=False)
    monkeypatch.setattr(registry, "find", lambda name: registry.Found(name, None, "", "not here"))
    assert registry.usual() == usual
    monkeypatch.setenv(registry.REQUIRED, apart[0])
    assert registry.usual() == [name for name in registry.names() if name in (*usual, apart[0])]
    monkeypatch.setattr(registry, "find", lambda name: registry.Found(name, registry.adapter(name), "1"))
    assert registry.usual() == registry.names()


@pytest.mark.parametrize(("asked", "hint"), [("helthy", "did you mean 'healthy'"), ("qqq", "known: broken_init")])
def test_hint_for_an_unknown_engine(plugins: None, asked: str, hint: str) -> None:
    with pytest.raises(EngineError, match=f"there is no engine called '{asked}'") as caught:
        registry.find(asked)
    assert hint in str(caught.value) and "\n" not in str(caught.value)


def test_our_engines_are_registered_under_their_own_names() -> None:
    import tomllib

    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    entries = project["entry-points"][registry.GROUP]
    # A folder in another engine's folder is called by both, or by its own name if it is not that engine's package. An
    # engine in single precision is beside that in double.
    modules = {name: value.partition(":")[0].removeprefix("adapters.") for name, value in entries.items()}
    modules = {name.removesuffix("_single"): module for name, module in modules.items()}
    assert all(name in (module.replace(".", "_"), module.rpartition(".")[2]) for name, module in modules.items())
    names = registry.names()
    ours = [name for name in names if name in entries]
    assert set(ours) == set(entries) and names[: len(ours)] == ours
    # Who promises a solution comes first, then who lives in the plane, each by name.
    facts = [registry.facts(name) for name in ours]
    places = [(told.profile("solution") is None, min(told.dimensions), told.name) for told in facts]
    assert ours[0] == registry.solver() and places == sorted(places)


def test_importing_adapters_imports_no_engine_and_no_numba() -> None:
    code = (
        "import sys; import adapters, adapters.registry, adapters.receipts\n"
        "import adapters.reference, adapters.chipmunk, adapters.bullet, adapters.mujoco\n"
        "print([m for m in ('pymunk', 'pybullet', 'mujoco', 'numba', 'reference_solver') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize("wanted", ["zeta", "zeta, healthy", ""])
def test_required_engines_that_are_installed(plugins, monkeypatch, wanted):
    monkeypatch.setenv(registry.REQUIRED, wanted)
    registry.check_required()


def test_required_engines_that_are_missing_named_with_reasons(plugins, monkeypatch):
    monkeypatch.setenv(registry.REQUIRED, "healthy,broken_init,havok")
    with pytest.raises(EngineError) as caught:
        registry.check_required()
    assert "CROSSCHECK_REQUIRE_ENGINES" in str(caught.value)
    assert "broken_init (RuntimeError: cannot start)" in str(caught.value)
    assert "havok (no such engine)" in str(caught.value)
    assert "healthy" not in str(caught.value)


def test_failure_without_a_required_engine(monkeypatch, tmp_path):
    monkeypatch.setenv(registry.REQUIRED, "havok")
    for command in (
        [sys.executable, "-m", "reports.command", "run", "impact", "--dry-run", "--out", str(tmp_path)],
        [sys.executable, "-m", "pytest", "--collect-only", "-q", "-p", "no:cacheprovider", __file__],
    ):
        done = subprocess.run(command, capture_output=True, text=True, cwd=ROOT)
        assert done.returncode != 0
        assert "CROSSCHECK_REQUIRE_ENGINES: not installed: havok" in done.stdout + done.stderr


@pytest.mark.parametrize("name", [each for each in registry.names() if registry.find(each).engine is not None])
def test_name_reason_and_source_of_every_setting(name: str) -> None:
    """They are printed, compared with other runs and kept as JSON: nothing there may be missing or told twice."""
    engine = registry.find(name).engine
    assert engine is not None
    for profile in engine.profiles:
        for scene in ("impact", "stack", "conveyor"):
            asked = needs(CATALOGUE[scene].scene(max(engine.facts.dimensions), {}))
            settings = engine.settings(profile, asked, 1.0 / 240.0)
            assert len({setting.name for setting in settings}) == len(settings) > 0
            for setting in settings:
                assert isinstance(setting.because, str) and isinstance(setting.source, str), setting
                assert setting.because and setting.name.isidentifier(), setting


@pytest.mark.few(3)
@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("missing_package", "package_that_is_not_there"),
        ("broken_version", "ZeroDivisionError: first line"),
        ("broken_init", "RuntimeError: cannot start"),
        ("not_an_engine", "tests_plugins:NotAnEngine is not an adapters.Engine"),
        ("leaves", "SystemExit: left the process"),
        ("no_module", "tests_plugin_nowhere"),
        ("no_class", "Nowhere"),
        ("syntax", "SyntaxError"),
        ("two_lines", "two; it is an engine of another distribution"),
    ],
)
def test_registry_with_a_broken_engine(plugins: None, name: str, reason: str) -> None:
    found = registry.find(name)
    assert found.engine is None and found.version == ""
    assert reason in found.reason and "\n" not in found.reason
    with pytest.raises(EngineError, match=f"^engine: {name} is not installed"):
        registry.load(name)
    assert registry.find("healthy").engine is not None


def test_broken_engines_listed_under_their_names(plugins) -> None:
    for found in map(registry.find, registry.names()):
        assert (found.engine is None) == bool(found.reason), found
    assert [registry.find(name).name for name in registry.names()] == registry.names()
    # So it is where it is loaded here, as in the process that is asked about it.
    for name in registry.names():
        here = registry.loaded(registry.entry(name))
        assert (here.name, here.engine is None) == (name, registry.find(name).engine is None)
    listed = {entry["name"]: entry for entry in engines()}
    assert list(listed) == registry.names()
    for name, entry in listed.items():
        there = registry.find(name).engine is not None
        assert entry["status"] == ("installed" if there else "not installed") and bool(entry["reason"]) is not there
    assert {entry["status"] for entry in listed.values()} == {"installed", "not installed"}


def test_reason_of_an_engine_in_the_folder_of_another():
    assert registry.find("newton_kamino").reason == registry.find("newton").reason
