"""Which tests reach which statements of the three packages.

    copy of the checkout -> every block says that it ran -> each test file once -> test, seconds, blocks

A block is a run of statements that no branch or loop divides and that nothing before it leaves (what stands after ``if
x: return`` is another), named by its function and its first line in there. The record of a test file is kept beside the
copy and made anew when the file changed. What it does not know only makes a mutation score smaller: a file is given up
after some seconds of CPU, beside those of its shared fixtures; tests that are skipped, or fail in the copy as it is,
reach nothing. What a fixture of a whole file computed, or a module while it was imported, is reached by all of its
tests, what a cache keeps by all that ask for it.
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
from dataclasses import asdict, dataclass, replace
from pathlib import Path

from pytest_apart import import_common, run
from subjects import PACKAGES, ROOT

#: Of no use here: they read the sources as text, run none of the three packages, or kill processes for minutes.
LEFT_OUT = ("tests/test_house.py", "tests/reference_solver/", "tests/chaos/test_kills.py", "tests/chaos/test_faults.py",
            "tests/mutation/")  # fmt: skip
#: Name under which the recorder lies in the copy.
PLUGIN = "recording_of_tests"
#: The tools' runs end at the first failure, which is all that a mutant needs; here every test of a file is asked, since
#: some fail only because the sources are instrumented. Zero is no limit.
TO_THE_END = "--maxfail=0"
#: How a test ends, as the recorder writes it.
PASSED, FAILED, SKIPPED = "passed", "failed", "skipped"
#: Block -> tests that reach it, with their seconds of CPU.
Reach = dict[str, dict[str, float]]
#: Decorators that keep answers.
CACHES = ("cache", "lru_cache", "functools.cache", "functools.lru_cache")
#: Statements that leave a block early.
LEAVING = (ast.Return, ast.Raise, ast.Break, ast.Continue)


@dataclass(frozen=True)
class Record:
    """What one test file reaches: test -> seconds and blocks.

    ``shared`` are the seconds of CPU of its shared fixtures, ``whole`` whether all of its tests were met, ``limit`` the
    seconds of CPU after which none was begun.
    """

    tests: dict[str, tuple[float, list[str]]]
    shared: float
    whole: bool
    limit: float


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
        for body, start, _ in reversed(blocks(function)):  # from the end, so that places stay
            key = named(module, name, function, body, start)
            docstring = body is function.body and ast.get_docstring(function, clean=False) is not None
            at = max(start, int(docstring))
            # Told once a test: a loop's body pays one look into a set.
            body[at:at] = ast.parse(f"{key!r} in _seen_by_tests or _seen_by_tests.add({key!r})").body
        for k, decorator in enumerate(function.decorator_list):
            if ast.unparse(decorator).partition("(")[0] in CACHES:
                function.decorator_list.insert(k, ast.Name("_remembered_by_tests", ast.Load()))
                break
    start = int(ast.get_docstring(tree, clean=False) is not None)
    while start < len(tree.body) and getattr(tree.body[start], "module", "") == "__future__":
        start += 1
    names = "remembered as _remembered_by_tests, seen as _seen_by_tests"
    begun = ast.parse(f"from {PLUGIN} import {names}\n_seen_by_tests.importing += 1").body
    ended = ast.parse("_seen_by_tests.importing -= 1").body
    if tree.body[start:]:
        tree.body[start:] = [*begun, ast.Try(tree.body[start:], [], [], ended)]
    return ast.unparse(ast.fix_missing_locations(tree))


def blocks(function: ast.FunctionDef) -> list[tuple[list[ast.stmt], int, int]]:
    """Blocks of a function as parts of statement lists, outer ones first; inner functions belong to the outer."""
    bodies = [function.body]
    for node in ast.walk(function):
        if node is not function and not isinstance(node, ast.Lambda | ast.IfExp | ast.ClassDef):
            parts = (getattr(node, part, None) for part in ("body", "orelse", "finalbody"))
            bodies += [part for part in parts if isinstance(part, list) and part]
    found = []
    for body in bodies:
        start = 0
        for k, statement in enumerate(body[:-1], 1):
            inner = isinstance(statement, ast.FunctionDef | ast.ClassDef)
            if not inner and any(isinstance(node, LEAVING) for node in ast.walk(statement)):
                found.append((body, start, k))
                start = k
        found.append((body, start, len(body)))
    return found


def named(module: str, name: str, function: ast.FunctionDef, body: list[ast.stmt], start: int) -> str:
    """Name of a block: mutmut's of its function, and the line in there, so that edits elsewhere leave it."""
    line = 0 if body is function.body and start == 0 else body[start].lineno - function.lineno
    return f"{dotted(module)}.{name}:{line}"


def block_of(source: str, module: str, function: str, line: int) -> str:
    """Name of the innermost block of a function that has this line of the source; its body for what stands above."""
    name, found = function.removeprefix(f"{dotted(module)}."), ""
    for own, node in functions(ast.parse(source)):
        if own == name:
            for body, start, end in blocks(node):
                first = 0 if body is node.body and start == 0 else body[start].lineno
                if first <= line <= (body[end - 1].end_lineno or 0):
                    found = named(module, name, node, body, start)
    return found


def functions(tree: ast.Module) -> Iterator[tuple[str, ast.FunctionDef]]:
    """Functions and methods as mutmut names them: ``x_apexes``, ``xǁTrajectoryǁsave``."""
    for node in tree.body:
        if isinstance(node, ast.FunctionDef):
            yield f"x_{node.name}", node
        elif isinstance(node, ast.ClassDef):
            yield from ((f"xǁ{node.name}ǁ{m.name}", m) for m in node.body if isinstance(m, ast.FunctionDef))


def environment(copy: Path, folder: Path, seconds: float, asked: Path | None = None) -> dict[str, str]:
    """What tests in the copy are told: every process imports from there, and writes into ``folder``.

    Tests that the file ``asked`` names are left out.
    """
    path = os.pathsep.join(filter(None, (str(copy), os.environ.get("PYTHONPATH", ""))))
    own = {"CROSSCHECK_REACH": str(folder), "CROSSCHECK_REACH_SECONDS": str(seconds), "PYTHONPATH": path}
    own["CROSSCHECK_REACH_ASKED"] = str(asked or "")
    return {**os.environ, **own, "PYTHONDONTWRITEBYTECODE": "1", "PYTHONHASHSEED": "0"}


def record(copy: Path, records: Path, seconds: float) -> None:
    """Record every test file that has no record, or a shorter one that ended before it, in an instrumented copy.

    The copy is as it was afterwards.
    """
    records.mkdir(parents=True, exist_ok=True)
    shutil.copy2(Path(__file__).with_name("recording.py"), copy / f"{PLUGIN}.py")
    known = recorded(records)
    lacking = [name for name in test_files()
               if name not in known or not (known[name].whole or known[name].limit >= seconds)]  # fmt: skip
    if not lacking:
        return
    modules = [str(path.relative_to(copy)) for name in PACKAGES for path in (copy / name).rglob("*.py")]
    before = {module: (copy / module).read_bytes() for module in modules}
    spoilt = {module: instrumented(text.decode(), module) for module, text in before.items()}
    import_common()
    for name in lacking:
        try:
            for module, text in spoilt.items():
                (copy / module).write_text(text, encoding="utf-8")
            found, failed = reached(copy, name, seconds)
        finally:
            for module, plain in before.items():
                (copy / module).write_bytes(plain)
        # Some tests fail because the sources are others; what passes in the copy as it is can notice a mutant.
        sound = passing(copy, failed, 5.0 * seconds) if failed else set()
        tests = {test: told for test, told in found.tests.items() if test not in failed or test in sound}
        lost = len(found.tests) - len(tests)
        record_of(records, name).write_text(json.dumps(asdict(replace(found, tests=tests))), encoding="utf-8")
        print(f"{name}: {len(tests)} tests, {lost} fail{'' if found.whole else ', cut short'}", flush=True)


def record_of(records: Path, name: str) -> Path:
    """Where the record of a test file lies.

    Another text of the file, of what stands beside it for tests, or of how it is recorded, has another record: cases of
    kept tables are named by helpers.
    """
    path = ROOT / name
    recorder = [Path(__file__).with_name(each) for each in ("recording.py", "reach.py")]
    beside = sorted(each for each in path.parent.glob("*.py") if not each.name.startswith("test_"))
    texts = b"".join(each.read_bytes() for each in (path, *beside, *recorder))
    return records / f"{hashlib.sha256(name.encode() + texts).hexdigest()[:16]}.json"


def reached(copy: Path, name: str, seconds: float) -> tuple[Record, set[str]]:
    """Run one test file; what each of its tests cost and reached, and which failed."""
    with tempfile.TemporaryDirectory(prefix="crosscheck-reach-") as text:
        folder = Path(text)
        run(copy, [TO_THE_END, "-p", PLUGIN, name], environment(copy, folder, seconds), 10.0 * seconds + 60.0)
        ended = outcomes(folder)
        found: dict[str, set[str]] = defaultdict(set)
        for path in folder.glob("*.reached"):
            for line in path.read_text(encoding="utf-8").splitlines():
                test, _, block = line.rpartition("\t")
                found[test].add(block)
        tests = {test: (cost, sorted(found[test] | found[""])) for test, (how, cost) in ended.items() if how != SKIPPED}
        told = (folder / "shared").read_text(encoding="utf-8") if (folder / "shared").exists() else "0"
        record = Record(tests, float(told), (folder / "whole").exists(), seconds)
        return record, {test for test, (how, _) in ended.items() if how == FAILED}


def passing(copy: Path, tests: set[str], seconds: float) -> set[str]:
    """Those of these tests that pass in the copy as it is."""
    with tempfile.TemporaryDirectory(prefix="crosscheck-reach-") as text:
        folder = Path(text)
        (folder / "tests").write_text("\n".join(sorted(tests)), encoding="utf-8")
        arguments = [TO_THE_END, "-p", PLUGIN, f"@{folder / 'tests'}"]
        run(copy, arguments, environment(copy, folder, float("inf")), seconds)
        return {test for test, (how, _) in outcomes(folder).items() if how == PASSED}


def outcomes(folder: Path) -> dict[str, tuple[str, float]]:
    """How each test ended that a run wrote into its folder, and its seconds of CPU."""
    path = folder / "ended"
    lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    return {test: (how, cost) for test, how, cost in map(json.loads, lines)}


def recorded(records: Path) -> dict[str, Record]:
    """Every record, by test file."""
    found = {}
    for name in test_files():
        if (path := record_of(records, name)).exists():
            found[name] = Record(**json.loads(path.read_text(encoding="utf-8")))
    return found


def by_block(records: dict[str, Record]) -> Reach:
    """Every record, turned round."""
    reach: Reach = defaultdict(dict)
    for found in records.values():
        for test, (seconds, names) in found.tests.items():
            for block in names:
                reach[block][test] = seconds
    return reach
