"""The house: four packages in one line, no engine imported by importing them, no stray rooms."""

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest

from adapters import registry
from adapters.engine_folder import folder_of
from validation.catalogue import CATALOGUE
from validation.scenes import OURS

ROOT = Path(__file__).parent.parent
LINE = ["reference_solver", "adapters", "validation", "reports"]
#: Folders of our engines, by name.
FOLDERS = {name: folder_of(name) for name in registry.names() if registry.is_ours(registry.entry(name))}
SOLVER = registry.solver()
#: What their folders import beside the standard library, numpy, scipy and us: the engines themselves.
COMMON = {*sys.stdlib_module_names, "numpy", "packaging", "scipy", *LINE}


def imported(path):
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name.split(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            yield node.module.split(".")[0]


ENGINES = sorted(
    {name for folder in FOLDERS.values() for path in folder.rglob("*.py") for name in imported(path)} - COMMON
)


def test_the_folders_import_the_engines_that_are_known_to_be_there():
    assert {"pymunk", "pybullet", "mujoco"} <= set(ENGINES)


@pytest.mark.parametrize("package", LINE)
def test_each_package_imports_only_what_stands_to_its_left(package):
    forbidden = set(LINE[LINE.index(package) + 1 :])
    for path in (ROOT / package).rglob("*.py"):
        assert not forbidden & set(imported(path)), path


#: Rooms of `validation`, each of which imports only what stands to its left; on the ground floor stands what all share.
ROOMS = ["truths", "scenes", "files", "running", "records", "workers", "bench"]
ROOMS += ["findings", "judging", "questions", "settings", "releases", "field"]
#: What stands in a room further right and is imported all the same.
LOW = {
    ("truths", "validation.scenes.parts"): "parts of which scenes are made, which name none",
    ("records", "validation.bench.timing"): "what a time is, which a store keeps",
}


def test_the_rooms_of_validation_stand_in_a_line():
    folders = {path.name for path in (ROOT / "validation").iterdir() if (path / "__init__.py").is_file()}
    assert folders == set(ROOMS)
    upwards = set()
    for room in ROOMS:
        right = {f"validation.{other}" for other in ROOMS[ROOMS.index(room) + 1 :]}
        for path in (ROOT / "validation" / room).rglob("*.py"):
            named = {name for name in whole_imports(path) if name and ".".join(name.split(".")[:2]) in right}
            upwards |= {(room, name) for name in named}
    assert upwards == set(LOW)


def test_what_a_scene_from_outside_leans_on_stays_where_it_is():
    """Their packages import these; a room may be divided, the ground floor not without an heir at its old name."""
    ground = {path.stem for path in (ROOT / "validation").glob("*.py")} - {"__init__"}
    assert ground == {"canonical", "catalogue", "posed", "bounds", "metrics", "geometry", "solids", "cells", "identity"}


def test_only_an_engine_s_own_folder_imports_it():
    for package in LINE:
        for path in (ROOT / package).rglob("*.py"):
            if not set(path.parents) & set(FOLDERS.values()):
                assert not set(ENGINES) & set(imported(path)), path


@pytest.mark.parametrize("engine", FOLDERS)
def test_an_engine_s_folder_imports_the_shared_vocabulary_and_no_other_engine(engine):
    """What a new engine's folder may lean on is what every other one may; ours uses its solver as well."""
    for path in FOLDERS[engine].rglob("*.py"):
        named = set(re.findall(r"^\s*(?:from|import) (adapters\.\w+)", path.read_text(), re.MULTILINE))
        assert not {f"adapters.{other}" for other in FOLDERS if other != engine} & named, path
        if engine != SOLVER:
            assert "reference_solver" not in set(imported(path)), path


def test_the_shared_vocabulary_knows_no_engine_s_folder():
    for path in (ROOT / "adapters").glob("*.py"):
        assert not {f"adapters.{name}" for name in FOLDERS} & set(whole_imports(path)), path


def own_words():
    """What must be said of an engine in its own folder only: names, packages, profiles, colours."""
    words = {}
    for name in FOLDERS:
        facts = registry.facts(name)
        spoken = {name, facts.package, facts.package.partition("-")[0]} - {"contact-crosscheck", "contact"}
        words[name] = (spoken | set(registry.adapter(name).profiles) | {facts.colour}) - {""}
    return words


@pytest.mark.parametrize("engine", FOLDERS)
def test_every_profile_of_ours_has_a_role_of_its_own(engine):
    roles, profiles = registry.facts(engine).roles, list(registry.adapter(engine).profiles)
    assert list(roles) == [name for name in profiles if name in roles] and len(set(roles.values())) == len(roles)
    # Of an engine set apart one profile may be none of the roles: pictures have one mark for that.
    assert len(profiles) - len(roles) <= registry.facts(engine).apart


#: Words of engines where they mean something else, or where our own solver is meant.
OTHER_WORDS = {
    ("adapters/conformance/faults.py", "default"): "the toy's profile",
    ("adapters/conformance/toy.py", "default"): "the toy's profile",
    ("adapters/engine.py", "one"): "a role",
    ("adapters/engine.py", "tuned"): "a role",
    ("reports/palette.py", "one"): "a role",
    ("reports/palette.py", "tuned"): "a role",
    ("reports/page/choosing.py", "tuned"): "a role",
    ("reports/command/inspecting.py", "tuned"): "a role",
    ("reports/command/tuning.py", "tuned"): "a role",
    ("reports/tables.py", "default"): "the default of a parameter",
}


#: Engines that are named after people, of whose laws scenes speak: these are written large.
PEOPLE = {"newton"}


def test_no_engine_profile_or_colour_is_special_outside_its_folder():
    """Whoever adds or drops an engine opens no other file."""
    found = set()
    words = own_words()
    for package in LINE[1:]:
        for path in (ROOT / package).rglob("*.*"):
            inside = path.relative_to(ROOT)
            if path.suffix not in (".py", ".j2", ".js", ".css") or set(path.parents) & set(FOLDERS.values()):
                continue
            found |= {(str(inside), word) for word in scenes_named(path, set().union(*words.values()))}
            if path.suffix in (".py", ".js", ".j2"):
                text = path.read_text()
                for name in set(FOLDERS) - {SOLVER}:
                    said = text if name in PEOPLE else text.lower()
                    assert not re.search(rf"\b{name}\b", said), path
    assert found == set(OTHER_WORDS)


#: Words that are scenes' names as well, where they mean something else.
OTHER_MEANINGS = {
    ("adapters/conformance/self_test.py", "impact"): "a regime of `Needs`",
    ("adapters/conformance/statements.py", "impact"): "a regime of `Needs`",
    ("adapters/needs.py", "impact"): "a regime of `Needs`",
    ("adapters/receipts.py", "impact"): "a regime of `Needs`",
    ("adapters/probes.py", "slide"): "a probe",
    ("adapters/receipts.py", "slide"): "a probe",
    ("validation/bench/units.py", "pyramid"): "the pile on which iteration counts are timed",
    ("reports/command/certifying.py", "impact"): "a part of `reference_solver.certification`",
}


def scenes_named(path, names):
    """Scenes' names among the strings of a source file, and the quoted words of a template."""
    text = path.read_text()
    if path.suffix != ".py":
        return {word for word in re.findall(r"""["'`](\w+)["'`]""", text) if word in names}
    found = {node.value for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Constant)}
    return {value for value in found if isinstance(value, str) and value in names}


def test_a_scene_is_named_only_in_its_own_file_and_in_the_folders_of_engines():
    """Whoever adds a scene opens no other file; `validation/scenes/__init__.py` registers ours."""
    names, found = set(CATALOGUE), {}
    for package in LINE[1:]:
        for path in (ROOT / package).rglob("*.*"):
            inside = path.relative_to(ROOT)
            apart = {"scenes", "published"} & set(inside.parts[:-1]) or set(path.parents) & set(FOLDERS.values())
            if path.suffix in (".py", ".j2", ".js") and not apart:
                found |= {(str(inside), name): path for name in scenes_named(path, names)}
    assert set(found) == set(OTHER_MEANINGS)


def test_a_scene_s_file_names_no_other_scene():
    for name in OURS:
        path = ROOT / "validation" / "scenes" / f"{name}.py"
        assert scenes_named(path, set(CATALOGUE)) - {searched_group(name)} <= {name}
        assert not {f"validation.scenes.{other}" for other in OURS} & set(whole_imports(path))


def searched_group(name):
    """The group that a scene is searched in may have the name of a scene."""
    searched = CATALOGUE[name].searched
    return searched.group if searched else ""


def whole_imports(path):
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom):
            yield node.module


@pytest.mark.parametrize("module", ["adapters", "validation.judging.rows", "reports.command"])
def test_importing_the_vocabulary_imports_no_engine_and_no_compiler(module):
    code = f"import sys, {module}; print(*(set({[*ENGINES, 'numba']!r}) & set(sys.modules)))"
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert out.stdout.split() == []


def test_no_utils_and_no_packages_among_the_tests():
    assert not list(ROOT.glob("[!.]*/**/*utils*.py"))
    assert not list((ROOT / "tests").rglob("__init__.py"))
