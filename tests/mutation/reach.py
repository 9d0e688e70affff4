"""Which tests reach which statements of the three packages.

    copy of the checkout -> every block says that it ran -> each test file once -> test, seconds, blocks

A block is a run of statements that no branch or loop divides, named by its function and its first line in there. The
record of a test file is kept beside the copy and made anew when the file changed. What it does not know only makes a
mutation score smaller: a file is given up after some seconds of CPU, tests that fail or are skipped in the copy reach
nothing, what a cache computed once is reached by the test that came first. What a fixture of a whole file computed is
reached by all of its tests.
"""

from __future__ import annotations

import ast
import hashlib
import json
import os
import shutil
import tempfile
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

from pytest_apart import import_common, run
from subjects import PACKAGES, ROOT

#: Of no use here: they read the sources as text, run none of the three packages, or kill processes for minutes.
LEFT_OUT = ("tests/test_house.py", "tests/reference_solver/", "tests/chaos/", "tests/mutation/")
#: Name under which the recorder lies in the copy.
PLUGIN = "recording_of_tests"
#: Block -> tests that reach it, with their seconds of CPU.
Reach = dict[str, dict[str, float]]


def test_files() -> list[str]:
    """Test files whose reach is recorded, from the root of the checkout."""
    names = sorted(str(path.relative_to(ROOT)) for path in (ROOT / "tests").rglob("test_*.py"))
    return [name for name in names if not name.startswith(LEFT_OUT)]


def dotted(module: str) -> str:
    """``validation/findings/__init__.py`` as mutmut names it: ``validation.findings``."""
    return module.removesuffix(".py").removesuffix("/__init__").replace("/", ".")


def instrumented(source: str, module: str) -> str:
    """Let every block of a function or method say that it ran."""
    tree = ast.parse(source)
    for name, function in functions(tree):
        for block in blocks(function):
            key = named(module, name, function, block)
            docstring = block is function.body and ast.get_docstring(function, clean=False) is not None
            # Told once a test: a loop's body pays one look into a set.
            block[int(docstring) : int(docstring)] = ast.parse(
                f"{key!r} in _seen_by_tests or _seen_by_tests.add({key!r})"
            ).body
    start = int(ast.get_docstring(tree, clean=False) is not None)
    while start < len(tree.body) and getattr(tree.body[start], "module", "") == "__future__":
        start += 1
    tree.body[start:start] = ast.parse(f"from {PLUGIN} import seen as _seen_by_tests").body
    return ast.unparse(ast.fix_missing_locations(tree))


def blocks(function: ast.FunctionDef) -> list[list[ast.stmt]]:
    """Blocks of a function, outer ones first; what stands in inner functions belongs to the outer."""
    found = [function.body]
    for node in ast.walk(function):
        if node is not function and not isinstance(node, ast.Lambda | ast.IfExp | ast.ClassDef):
            parts = (getattr(node, part, None) for part in ("body", "orelse", "finalbody"))
            found += [part for part in parts if isinstance(part, list) and part]
    return found


def named(module: str, name: str, function: ast.FunctionDef, block: list[ast.stmt]) -> str:
    """Name of a block: mutmut's of its function, and the line in there, so that edits elsewhere leave it."""
    return f"{dotted(module)}.{name}:{0 if block is function.body else block[0].lineno - function.lineno}"


def block_of(source: str, module: str, function: str, line: int) -> str:
    """Name of the innermost block of a function that has this line of the source; its body for what stands above."""
    name, found = function.removeprefix(f"{dotted(module)}."), ""
    for own, node in functions(ast.parse(source)):
        if own == name:
            for block in blocks(node):
                if block is node.body or block[0].lineno <= line <= (block[-1].end_lineno or 0):
                    found = named(module, name, node, block)
    return found


def functions(tree: ast.Module) -> Iterator[tuple[str, ast.FunctionDef]]:
    """Functions and methods as mutmut names them: ``x_apexes``, ``xǁTrajectoryǁsave``."""
    for node in tree.body:
        if isinstance(node, ast.FunctionDef):
            yield f"x_{node.name}", node
        elif isinstance(node, ast.ClassDef):
            yield from ((f"xǁ{node.name}ǁ{m.name}", m) for m in node.body if isinstance(m, ast.FunctionDef))


def environment(copy: Path, folder: Path, seconds: float) -> dict[str, str]:
    """What tests in the copy are told: every process imports from there, and writes into ``folder``."""
    path = os.pathsep.join(filter(None, (str(copy), os.environ.get("PYTHONPATH", ""))))
    own = {"CROSSCHECK_REACH": str(folder), "CROSSCHECK_REACH_SECONDS": str(seconds), "PYTHONPATH": path}
    return {**os.environ, **own, "PYTHONDONTWRITEBYTECODE": "1", "PYTHONHASHSEED": "0"}


def record(copy: Path, records: Path, seconds: float) -> None:
    """Record every test file that has no record, in an instrumented copy, which is as it was afterwards."""
    records.mkdir(parents=True, exist_ok=True)
    shutil.copy2(Path(__file__).with_name("recording.py"), copy / f"{PLUGIN}.py")
    lacking = [name for name in test_files() if not record_of(records, name).exists()]
    if not lacking:
        return
    modules = [str(path.relative_to(copy)) for name in PACKAGES for path in (copy / name).rglob("*.py")]
    before = {module: (copy / module).read_bytes() for module in modules}
    try:
        for module in modules:
            (copy / module).write_text(instrumented(before[module].decode(), module), encoding="utf-8")
        import_common()
        for name in lacking:
            tests = reached(copy, name, seconds)
            record_of(records, name).write_text(json.dumps(tests), encoding="utf-8")
            print(f"{name}: {len(tests)} tests", flush=True)
    finally:
        for module in modules:
            (copy / module).write_bytes(before[module])


def record_of(records: Path, name: str) -> Path:
    """Where the record of a test file lies; another text of the file has another record."""
    return records / f"{hashlib.sha256(name.encode() + (ROOT / name).read_bytes()).hexdigest()[:16]}.json"


def reached(copy: Path, name: str, seconds: float) -> dict[str, tuple[float, list[str]]]:
    """Run one test file; what each of its tests that passed cost and reached."""
    with tempfile.TemporaryDirectory(prefix="crosscheck-reach-") as text:
        folder = Path(text)
        run(copy, ["--maxfail=1000", "-p", PLUGIN, name], environment(copy, folder, seconds), 10.0 * seconds + 60.0)
        if not (folder / "passed.json").exists():
            return {}
        passed: dict[str, float] = json.loads((folder / "passed.json").read_text(encoding="utf-8"))
        found: dict[str, set[str]] = defaultdict(set)
        for path in folder.glob("*.reached"):
            for line in path.read_text(encoding="utf-8").splitlines():
                test, _, block = line.rpartition("\t")
                found[test].add(block)
        return {test: (cost, sorted(found[test] | found[""])) for test, cost in passed.items()}


def by_block(records: Path) -> Reach:
    """Every record, turned round."""
    reach: Reach = defaultdict(dict)
    for name in test_files():
        if (path := record_of(records, name)).exists():
            for test, (seconds, names) in json.loads(path.read_text(encoding="utf-8")).items():
                for block in names:
                    reach[block][test] = seconds
    return reach
