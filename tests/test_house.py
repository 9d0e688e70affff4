"""The house: four packages in one line, no engine imported by importing them, no stray rooms."""

import ast
import gc
import io
import re
import subprocess
import sys
import tokenize
import tomllib
from difflib import SequenceMatcher
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

from adapters import registry
from adapters.engine_folder import located
from validation.catalogue import CATALOGUE
from validation.scenes import OURS

ROOT = Path(__file__).parent.parent
LINE = ["reference_solver", "adapters", "validation", "reports"]
#: What people import; its examples name engines and scenes, its code does not.
FRONT = "contact_crosscheck"
#: Folders of our engines, by name; a port is a module in the folder of its original.
FOLDERS = {e.name: located(e.module).parent for e in map(registry.entry, registry.names()) if registry.is_ours(e)}
SOLVER = registry.solver()
#: What their folders import beside the standard library, numpy, scipy and us: the engines themselves.
COMMON = {*sys.stdlib_module_names, "numpy", "packaging", "scipy", *LINE}


@pytest.fixture(scope="module", autouse=True)
def _no_garbage():
    """Trees of all files are kept meanwhile; searching them for garbage takes four times as long as parsing."""
    gc.disable()
    yield
    for kept in (parsed, nodes, all_tests):
        kept.cache_clear()
    gc.enable()


@cache
def parsed(path):
    """Syntax tree of a file."""
    return ast.parse(path.read_text())


@cache
def nodes(path):
    """All nodes of a file, which many of these tests look at; finding them takes longer than parsing."""
    return [*ast.walk(parsed(path))]


def imported(path):
    for node in nodes(path):
        if isinstance(node, ast.Import):
            yield from (alias.name.split(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            yield node.module.split(".")[0]


@cache
def engines():
    """Packages of engines, which nothing but the folder of an engine imports."""
    folders = FOLDERS.values()
    return {name for folder in folders for path in folder.rglob("*.py") for name in imported(path)} - COMMON


def test_engines_imported_by_folders():
    assert {"pymunk", "pybullet", "mujoco"} <= engines()


@pytest.mark.parametrize("package", LINE)
def test_each_package_imports_only_what_stands_to_its_left(package):
    forbidden = set(LINE[LINE.index(package) + 1 :])
    for path in (ROOT / package).rglob("*.py"):
        assert not forbidden & set(imported(path)), path


def test_front_imported_only_by_reports():
    asking = {path for package in LINE for path in (ROOT / package).rglob("*.py") if FRONT in set(imported(path))}
    assert asking == {ROOT / "reports" / "__init__.py"}


@pytest.mark.parametrize("package", [*LINE, FRONT])
def test_no_package_imports_tests(package):
    assert not [path for path in (ROOT / package).rglob("*.py") if "tests" in set(imported(path))]


def named(path):
    """Modules that a file imports, by their whole names; of ``from a import b`` both a and a.b."""
    for node in nodes(path):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            yield from (node.module, *(f"{node.module}.{alias.name}" for alias in node.names))


#: Rooms of `validation`, each of which imports only what stands to its left; on the ground floor stands what all share.
ROOMS = ["truths", "scenes", "files", "running", "records", "workers", "bench"]
ROOMS += ["findings", "judging", "questions", "settings", "fixes", "releases", "field"]
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


#: What packages of others import: files and rooms, but for the folders of engines.
GROUND = {
    "adapters": "checked_engine copied engine engine_folder experiment extras isolation law model needs plain readback "
    "readings receipts recording registry releases scene script settings stages stepping trajectory unset whole "
    "conformance new_adapter pipe",
    "validation": " ".join(["canonical catalogue posed bounds metrics geometry solids cells identity", *ROOMS]),
}


@pytest.mark.parametrize("package", GROUND)
def test_modules_imported_by_outside_packages(package):
    """A room may be divided, the ground floor not without an heir at its old name."""
    files = {path.stem for path in (ROOT / package).glob("*.py")} - {"__init__"}
    rooms = {path.parent for path in (ROOT / package).glob("*/__init__.py")} - {*FOLDERS.values()}
    assert files | {path.name for path in rooms} == set(GROUND[package].split())


def test_engine_imported_only_by_its_own_folder():
    for package in LINE:
        for path in (ROOT / package).rglob("*.py"):
            if not set(path.parents) & set(FOLDERS.values()):
                assert not engines() & set(imported(path)), path


@pytest.mark.parametrize("engine", FOLDERS)
def test_engine_folder_imports_the_vocabulary_alone(engine):
    """What a new engine's folder may lean on is what every other one may; ours uses its solver as well.

    A folder in an engine's folder is another engine of the same package, which may use what they share.
    """
    others = {folder.name for name, folder in FOLDERS.items() if name != engine} - {
        folder.name for folder in (FOLDERS[engine], *FOLDERS[engine].parents)
    }
    for path in FOLDERS[engine].rglob("*.py"):
        named = set(re.findall(r"^\s*(?:from|import) adapters\.(\w+)", path.read_text(), re.MULTILINE))
        assert not others & named, path
        if engine != SOLVER:
            assert "reference_solver" not in set(imported(path)), path


def test_packages_of_the_solver_without_extras():
    """It runs where only the dependencies of the project are installed; llvmlite is numba's."""
    stated = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["dependencies"]
    known = {re.match(r"[\w-]+", each)[0] for each in stated} | {
        *sys.stdlib_module_names,
        "reference_solver",
        "llvmlite",
    }
    assert [path for path in (ROOT / "reference_solver").rglob("*.py") if set(imported(path)) - known] == []


def test_imports_without_circles():
    """Within functions and for types as well; a module may know the package that it is in."""
    files = [path for package in LINE[1:] for path in (ROOT / package).rglob("*.py")]
    modules = {".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): path for path in files}
    line = TopologicalSorter()
    for name, path in modules.items():
        line.add(name, *(each for each in modules.keys() & set(named(path)) if not name.startswith(each)))
    line.prepare()


def test_the_shared_vocabulary_knows_no_engine_s_folder():
    for path in (ROOT / "adapters").rglob("*.py"):
        if path.parent not in FOLDERS.values():
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
    # Of an engine set apart two profiles may be none of the roles: pictures have one mark for them.
    assert len(profiles) - len(roles) <= 2 * registry.facts(engine).apart


#: Words of engines where they mean something else, or where our own solver is meant.
OTHER_WORDS = {
    ("adapters/conformance/faults.py", "default"): "the toy's profile",
    ("adapters/conformance/toy.py", "default"): "the toy's profile",
    ("adapters/engine.py", "matched"): "a role",
    ("adapters/engine.py", "one"): "a role",
    ("adapters/engine.py", "tuned"): "a role",
    ("reports/palette.py", "matched"): "a role",
    ("reports/palette.py", "one"): "a role",
    ("reports/palette.py", "tuned"): "a role",
    ("reports/page/choosing.py", "tuned"): "a role",
    ("reports/wording.py", "matched"): "a role",
    ("reports/wording.py", "one"): "a role",
    ("reports/page/opening.py", "tuned"): "a role",
    ("reports/wording.py", "tuned"): "a role",
    ("reports/command/inspecting.py", "tuned"): "a role",
    ("reports/command/tuning.py", "tuned"): "a role",
    ("reports/symptoms/making.py", "tuned"): "a role",
    ("validation/questions/kept_readings.py", "tuned"): "a role",
    ("reports/tables.py", "default"): "the default of a parameter",
    ("contact_crosscheck/cases.py", "tuned"): "a role",
    ("contact_crosscheck/models.py", "default"): "the default of a parameter",
}


#: Engines that are named after people, of whose laws scenes speak: these are written large.
PEOPLE = {"newton"}


def test_no_engine_profile_or_colour_is_special_outside_its_folder():
    """Whoever adds or drops an engine opens no other file."""
    found = set()
    words = own_words()
    for package in (*LINE[1:], FRONT):
        for path in (ROOT / package).rglob("*.*"):
            inside = path.relative_to(ROOT)
            if path.suffix not in (".py", ".j2", ".js", ".css") or set(path.parents) & set(FOLDERS.values()):
                continue
            found |= {(str(inside), word) for word in scenes_named(path, set().union(*words.values()))}
            if path.suffix in (".py", ".js", ".j2"):
                text = path.read_text() if package != FRONT else without_texts(path)
                for name in set(FOLDERS) - {SOLVER}:
                    said = text if name in PEOPLE else text.lower()
                    assert not re.search(rf"\b{name}\b", said), path
    assert found == set(OTHER_WORDS)


def without_texts(path):
    """Code of a file without its docstrings."""
    code = ast.parse(path.read_text())
    for node in ast.walk(code):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef) and ast.get_docstring(node) is not None:
            node.body[0].value.value = ""
    return ast.unparse(code)


#: Words that are scenes' names as well, where they mean something else.
OTHER_MEANINGS = {
    ("adapters/conformance/self_test.py", "impact"): "a regime of `Needs`",
    ("adapters/conformance/statements.py", "impact"): "a regime of `Needs`",
    ("adapters/needs.py", "impact"): "a regime of `Needs`",
    ("adapters/receipts/__init__.py", "impact"): "a regime of `Needs`",
    ("adapters/receipts/probes.py", "slide"): "a probe",
    ("adapters/receipts/__init__.py", "slide"): "a probe",
    ("adapters/receipts/probes.py", "flight"): "a probe",
    ("validation/bench/units.py", "pyramid"): "the pile on which iteration counts are timed",
}


def scenes_named(path, names):
    """Scenes' names among the strings of a source file, and the quoted words of a template."""
    text = path.read_text()
    if path.suffix != ".py":
        return {word for word in re.findall(r"""["'`](\w+)["'`]""", text) if word in names}
    found = {node.value for node in nodes(path) if isinstance(node, ast.Constant)}
    return {value for value in found if isinstance(value, str) and value in names}


def test_scene_named_only_in_its_file_and_engine_folders():
    """Whoever adds a scene opens no other file; `validation/scenes/__init__.py` registers ours."""
    names, found = set(CATALOGUE), {}
    for package in (*LINE[1:], FRONT):
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
    for node in nodes(path):
        if isinstance(node, ast.ImportFrom):
            yield node.module


def test_importing_the_vocabulary_imports_no_engine_and_no_compiler():
    of_engines = {*engines(), "numba"}
    code = "import sys, adapters, validation.judging.rows, reports.command; print(*sys.modules)"
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert not of_engines & set(out.stdout.split())


def test_no_utils_and_no_packages_among_the_tests():
    assert not list(ROOT.glob("[!.]*/**/*utils*.py"))
    assert not list((ROOT / "tests").rglob("__init__.py"))


def solver_functions():
    """Every function of the solver with the file it stands in."""
    for path in sorted((ROOT / "reference_solver").rglob("*.py")):
        for node in nodes(path):
            if isinstance(node, ast.FunctionDef):
                yield path.relative_to(ROOT / "reference_solver"), node


#: Functions of the solver that may take more than nine arguments, each with its reason.
LONG_CALLS: dict[tuple[str, str], str] = {}


def test_argument_lists_of_the_solver_within_nine():
    counts = [
        ((str(path), node.name), len(node.args.posonlyargs + node.args.args + node.args.kwonlyargs))
        for path, node in solver_functions()
    ]
    assert {call for call, count in counts if count > 9} == set(LONG_CALLS)
    assert (("textbook2/points.py", "write_point"), 9) in counts  # they are counted


def clamps(node):
    """Whether a call takes a number between a bound and minus that bound: min(max(x, -b), b) or the other way round."""
    names = {"min", "max"}
    if not (isinstance(node, ast.Call) and getattr(node.func, "id", "") in names and len(node.args) == 2):
        return False
    inner = next((a for a in node.args if isinstance(a, ast.Call) and getattr(a.func, "id", "") in names), None)
    if inner is None or inner.func.id == node.func.id:
        return False
    outer_bounds = {ast.unparse(a).lstrip("-") for a in node.args if a is not inner}
    return bool(outer_bounds & {ast.unparse(a).lstrip("-") for a in inner.args})


#: Where a number is clamped that is no friction.
OTHER_CLAMPS = {
    "textbook2/narrowphase.py": "a point into a box",
    "textbook3/narrowphase.py": "a point into a box",
    "textbook3/segment_box.py": "a point into a box",
    "textbook3/box_box.py": "a point onto an edge",
    "textbook3/capsule.py": "a point onto a segment",
    "textbook3/slip_direction.py": "a step of Newton's method",
}


def test_friction_is_clamped_in_one_place():
    """`coulomb.py` has what the law allows; elsewhere nothing is clamped but lengths and steps."""
    found = {str(path) for path, node in solver_functions() for part in ast.walk(node) if clamps(part)}
    ours = {path for path in found if path.partition("/")[0] not in ("certificate", "geometry.py")}
    assert ours - {"coulomb.py"} == set(OTHER_CLAMPS)
    assert "coulomb.py" in ours


def words_of(node):
    """Tokens of a function without its documentation."""
    body = node.body[1:] if ast.get_docstring(node) else node.body
    return re.findall(r"\w+|[^\w\s]", "\n".join(ast.unparse(statement) for statement in body))


def test_no_duplicate_code_between_dimensions():
    """At most 40 functions have one name; those of a hundred words and more share at most six of seven."""
    rooms = "textbook2", "textbook3"
    told = {
        room: {
            node.name: words_of(node)
            for path in (ROOT / "reference_solver" / room).glob("*.py")
            for node in ast.parse(path.read_text()).body
            if isinstance(node, ast.FunctionDef | ast.ClassDef)
        }
        for room in rooms
    }
    both = set(told[rooms[0]]) & set(told[rooms[1]])
    assert 30 < len(both) <= 40  # as each dimension answers the same questions
    alike = {
        name
        for name in both
        if min(len(told[room][name]) for room in told) >= 100
        and SequenceMatcher(None, *(told[room][name] for room in rooms), autojunk=False).ratio() > 6 / 7
    }
    assert not alike, "tell it in `textbook/`, for both"


#: By how much a room of the solver may have fewer lines than its limit: a smaller one gets a smaller limit.
SLACK = 0.05


def rooms_of_the_solver():
    """Limit and lines of every room in the table of docs/solver/layout.md; "." are the files beside the rooms."""
    solver = ROOT / "reference_solver"
    text = (ROOT / "docs" / "solver" / "layout.md").read_text(encoding="utf-8")
    rooms = {room: int(most) for room, most in re.findall(r"^\| `([\w/.]+)` \| (\d+) \| .+ \|$", text, re.MULTILINE)}
    lines = dict.fromkeys(rooms, 0)
    for path in solver.rglob("*.py"):
        folder = path.parent.relative_to(solver).as_posix()
        own = max((room for room in rooms if folder == room or folder.startswith(f"{room}/")), key=len)
        lines[own] += len(path.read_text().splitlines())
    return rooms, lines


def test_solver_size_limit_by_room():
    """Prints the table with today's counts (pytest -s)."""
    rooms, lines = rooms_of_the_solver()
    for room, most in rooms.items():
        print(f"{room:22} {lines[room]:6} of at most {most:6}")
    print(f"{'all':22} {sum(lines.values()):6}")
    assert set(lines) >= {"textbook2", "textbook3", "textbook", "certificate"}
    grown = {room: lines[room] for room, most in rooms.items() if lines[room] > most}
    assert not grown, "see 'Change the reference solver' in CONTRIBUTING.md"
    loose = {room: lines[room] for room, most in rooms.items() if lines[room] < most * (1.0 - SLACK) - 10}
    assert not loose, "a room that shrank gets a smaller limit"


def test_comparisons_by_max_that_ignore_nan():
    """Python's max(0.0, nan) is 0.0, which passes: `validation.metrics.largest` is NaN, which has no value."""
    found = []
    for path in sorted((ROOT / "validation").rglob("*.py")):
        for function in (node for node in nodes(path) if isinstance(node, ast.FunctionDef)):
            given = [ast.unparse(each.annotation) for each in function.args.args if each.annotation]
            if any("Trajectory" in each or "Measured" in each for each in given):
                named = [node.func for node in ast.walk(function) if isinstance(node, ast.Call)]
                found += [f"{path}:{name.lineno}" for name in named if isinstance(name, ast.Name) and name.id == "max"]
    assert not found


# ---- tests that could say nothing ----------------------------------------------------------------------------------


def own(body):
    """Statements of a body and of what stands in it, but for functions of its own."""
    for statement in body:
        if not isinstance(statement, ast.FunctionDef | ast.ClassDef):
            yield statement
            for part in ("body", "orelse", "handlers", "finalbody"):
                yield from own(getattr(statement, part, []))


def asserts(body):
    """Whether every way through these statements meets an assertion, or an error that is expected."""
    for statement in body:
        if isinstance(statement, ast.Assert):
            return True
        if isinstance(statement, ast.With) and "raises" in ast.unparse(statement.items[0]):
            return True
        if isinstance(statement, ast.For | ast.With | ast.Try) and asserts(statement.body):
            return True
        if isinstance(statement, ast.If):
            if asserts(statement.body) and asserts(statement.orelse):
                return True
            if any(isinstance(each, ast.Return) for each in statement.body) and not asserts(statement.body):
                return False
    return False


@cache
def all_tests():
    return [*_all_tests()]


def _all_tests():
    for path in sorted((ROOT / "tests").rglob("test_*.py")):
        classes = [node for node in parsed(path).body if isinstance(node, ast.ClassDef)]
        for node in (each for part in (parsed(path), *classes) for each in part.body):
            if isinstance(node, ast.FunctionDef) and node.name.startswith("test_"):
                yield f"{path.relative_to(ROOT)}::{node.name}", node


def test_tests_that_end_before_their_first_assertion():
    """An early `return` is a case that passes whatever happens: `assume` it away, or do not ask for it."""
    found = [name for name, test in all_tests() for each in own(test.body) if isinstance(each, ast.If)
             and any(isinstance(last, ast.Return) for last in each.body) and not asserts(each.body)]  # fmt: skip
    assert not found


def test_every_drawn_example_is_asserted_about():
    """An assertion under an `if` without `else` passes where nothing of the kind is drawn: that is what `assume` is."""
    drawn = {name: test for name, test in all_tests()
             if any("given(" in ast.unparse(each) for each in test.decorator_list)}  # fmt: skip
    assert len(drawn) > 20
    called = {name for name, test in drawn.items() if not any(isinstance(each, ast.Assert) for each in ast.walk(test))}
    assert not [name for name, test in drawn.items() if name not in called and not asserts(test.body)]


def test_length_of_the_name_of_a_test():
    """`FAILED file::name` of pytest fits one line of 120 columns, as our code does (but for the solver's own tests)."""
    apart = ("tests/reference_solver/", "tests/verification/")
    names = [f"FAILED {name}" for name, _ in all_tests() if not name.startswith(apart)]
    assert [name for name in names if len(name) > 120] == []


def test_documents_that_tests_cite_are_in_the_repository():
    """A figure of a sheet that nobody else has cannot be looked up."""
    document = re.compile(
        r"[\w./-]+\.(?:md|py|toml|txt|csv|html|pdf|ipynb)\b|fact sheet|lab book|appendix|dossier", re.I
    )
    folders = [ROOT / name for name in (*LINE, FRONT, "tests", "docs")]
    there = {path.name for path in (*ROOT.glob("*"), *(path for folder in folders for path in folder.rglob("*")))}
    cited = []
    for path in sorted((ROOT / "tests").rglob("*.py")):
        text = path.read_text()
        if all(Path(name).name in there for name in document.findall(text)):
            continue
        for token in tokenize.generate_tokens(io.StringIO(text).readline):
            if token.type == tokenize.COMMENT or token.string.startswith('"""'):
                named = document.findall(token.string)
                cited += [(str(path), token.start[0], name) for name in named if Path(name).name not in there]
    assert not cited
