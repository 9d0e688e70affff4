"""Faults planted in the solver's kernels, one at a time: which test sees each?

    all faults of the kernels -> N of them, drawn by a seed -> the tests that reach each -> a table

``python tests/mutation/kernels.py --seed 1 --count 12``. A fault is of physical size: a constant halved or doubled, a
sign, an index, a comparison or a condition the other way round, a term left out. Its kind is drawn first, so that the
few constants are met as often as the many indices. ``--only reference_solver/direct/`` draws there alone.

Kernels run as plain Python (``NUMBA_DISABLE_JIT``), which takes the same bits as compiled ones
(`tests/reference_solver/test_uncompiled.py`) and compiles nothing: a fault costs seconds and not minutes. What a test
reaches is recorded once for each text of its file and of the sources, some ten minutes of CPU, and kept below the
system's temporary folder. A test file is given up after `RECORDED` seconds and a test after `PATIENCE`, so that what
lives may be seen by tests that run longer: a busy machine sees less. A division by zero is an error of Python's alone.
"""

from __future__ import annotations

import argparse
import ast
import hashlib
import json
import os
import random
import shutil
import tempfile
from collections import Counter, defaultdict
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path

from checkout import copy_of_the_checkout
from pytest_apart import OUT_OF_TIME, import_common, run
from reach import PLUGIN, Record, block_of, by_block, dotted, environment, instrumented, reached
from subjects import ROOT

ROOMS = ("stepping", "planar", "spatial", "direct")
DECORATORS = ("kernel", "inner_kernel", "spliced_kernel")
#: Seconds of CPU of a test file that are recorded, and of the tests that one fault meets.
RECORDED, SPENT = 8.0, 40.0
#: Seconds of wall time of one test.
PATIENCE = 20
#: Left out: they read sources or compile.
LEFT_OUT = ("compilation", "linking", "plain_numba", "structures", "uncompiled", "classical_bits")
OTHER_WAY = {ast.Lt: ">", ast.Gt: "<", ast.LtE: ">=", ast.GtE: "<=", ast.Eq: "!=", ast.NotEq: "=="}


@dataclass(frozen=True)
class Fault:
    """``text`` in place of what stands from ``start`` to ``end`` in a module's source."""

    module: str
    line: int
    start: int
    end: int
    kind: str
    text: str
    function: str  # empty for a constant of the module
    constant: str = ""


def faults_of(module: str) -> Iterator[Fault]:
    """All faults of a module: of its kernels, and of the numbers that it names."""
    source = (ROOT / module).read_text(encoding="utf-8")
    starts = [0]
    for line in source.encode().splitlines(keepends=True):
        starts.append(starts[-1] + len(line))

    def fault(node: ast.expr | ast.stmt, kind: str, text: str, function: str, constant: str = "") -> Fault:
        assert node.end_lineno is not None and node.end_col_offset is not None
        start, end = starts[node.lineno - 1] + node.col_offset, starts[node.end_lineno - 1] + node.end_col_offset
        return Fault(module, node.lineno, start, end, kind, text, function, constant)

    for node in ast.parse(source).body:
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
            if isinstance(node.value, ast.Constant) and isinstance(node.value.value, float):
                for kind, factor in (("halved", "0.5"), ("doubled", "2.0")):
                    yield fault(node.value, kind, f"{factor} * {ast.unparse(node.value)}", "", node.targets[0].id)
        elif isinstance(node, ast.FunctionDef) and any(ast.unparse(d) in DECORATORS for d in node.decorator_list):
            for statement in node.body:
                for part in ast.walk(statement):
                    if isinstance(part, ast.expr | ast.stmt):
                        yield from (fault(part, *change, node.name) for change in changes(part))


def changes(node: ast.expr | ast.stmt) -> Iterator[tuple[str, str]]:
    """Kind and text of what may stand in place of a part of a kernel."""
    if isinstance(node, ast.Constant) and isinstance(node.value, float) and node.value != 0.0:
        yield "halved", f"(0.5 * {node.value!r})"
        yield "doubled", f"(2.0 * {node.value!r})"
    elif isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add | ast.Sub):
        left, right, plus = ast.unparse(node.left), ast.unparse(node.right), isinstance(node.op, ast.Add)
        yield "sign", f"({left} {'-' if plus else '+'} ({right}))"
        yield "term left out", f"({left})"
        yield "term left out", f"({'' if plus else '-'}({right}))"
    elif isinstance(node, ast.AugAssign) and isinstance(node.op, ast.Add | ast.Sub):
        target, value = ast.unparse(node.target), ast.unparse(node.value)
        yield "sign", f"{target} {'-' if isinstance(node.op, ast.Add) else '+'}= {value}"
        yield "term left out", f"{target} += 0 * ({value})"
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub) and not isinstance(node.operand, ast.Constant):
        yield "sign", f"({ast.unparse(node.operand)})"
    elif isinstance(node, ast.Compare) and type(node.ops[0]) in OTHER_WAY and len(node.ops) == 1:
        left, right = ast.unparse(node.left), ast.unparse(node.comparators[0])
        yield "comparison", f"({left} {OTHER_WAY[type(node.ops[0])]} {right})"
    elif isinstance(node, ast.BoolOp):
        word = " and " if isinstance(node.op, ast.And) else " or "
        for k in range(len(node.values)):
            rest = (ast.unparse(value) for j, value in enumerate(node.values) if j != k)
            yield "condition left out", f"({word.join(f'({each})' for each in rest)})"
    elif isinstance(node, ast.Subscript):
        parts = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
        for k, part in enumerate(parts):
            if isinstance(part, ast.Constant) and part.value in (0, 1, 2):
                inner = [ast.unparse(each) for each in parts]
                inner[k] = str(part.value - 1 if part.value else 1)
                yield "index", f"{ast.unparse(node.value)}[{', '.join(inner)}]"


def blocks_of(fault: Fault, modules: list[str]) -> tuple[str, ...]:
    """Names of blocks that run where a fault is, or their beginnings: of a constant, those of kernels that name it."""
    source = (ROOT / fault.module).read_text(encoding="utf-8")
    if fault.function:
        return (block_of(source, fault.module, f"{dotted(fault.module)}.x_{fault.function}", fault.line),)
    found = list[str]()
    for module in modules:
        for node in ast.parse((ROOT / module).read_text(encoding="utf-8")).body:
            names = {part.id for part in ast.walk(node) if isinstance(part, ast.Name)}
            if isinstance(node, ast.FunctionDef) and fault.constant in names:
                found.append(f"{dotted(module)}.x_{node.name}:")
    return tuple(found)


def record(copy: Path, folder: Path, modules: list[str]) -> dict[str, Record]:
    """Which tests of the solver reach which blocks of its kernels, from an instrumented copy; kept by its text."""
    shutil.copy2(Path(__file__).with_name("recording.py"), copy / f"{PLUGIN}.py")
    plain = {module: (ROOT / module).read_text(encoding="utf-8") for module in modules}
    spoilt, of = dict[str, str](), hashlib.sha256("".join(plain.values()).encode())
    found = {}
    for path in sorted((ROOT / "tests/reference_solver").rglob("test_*.py")):
        if path.stem.removeprefix("test_") in LEFT_OUT or path.parent.name == "event_driven":
            continue
        own = of.copy()
        own.update(path.read_bytes())
        kept, name = folder / f"{own.hexdigest()[:16]}.json", str(path.relative_to(ROOT))
        if not kept.exists():
            spoilt = spoilt or {module: instrumented(text, module) for module, text in plain.items()}
            for module, text in spoilt.items():
                (copy / module).write_text(text, encoding="utf-8")
            told, failed = reached(copy, name, RECORDED)
            for module, text in plain.items():
                (copy / module).write_text(text, encoding="utf-8")
            tests = {test: each for test, each in told.tests.items() if test not in failed}
            kept.write_text(json.dumps(asdict(replace(told, tests=tests))), encoding="utf-8")
            print(f"{name}: {len(tests)} tests{'' if told.whole else ', cut short'}", flush=True)
        found[name] = Record(**json.loads(kept.read_text(encoding="utf-8")))
    return found


def planted(fault: Fault) -> str:
    """The module's source with the fault."""
    source = (ROOT / fault.module).read_bytes()
    return (source[: fault.start] + fault.text.encode() + source[fault.end :]).decode()


def told(fault: Fault) -> str:
    """The fault in words, on one line."""
    before = (ROOT / fault.module).read_bytes()[fault.start : fault.end].decode()
    where = f"{fault.module}:{fault.line} {fault.function or fault.constant}"
    return f"{where}: {fault.kind}: {' '.join(before.split())} -> {fault.text}"


def draw(seed: int, count: int, faults: list[Fault]) -> list[Fault]:
    """Draw faults: the kind first, then one of that kind."""
    source, kinds = random.Random(seed), defaultdict[str, list[Fault]](list)
    for each in faults:
        kinds[each.kind].append(each)
    chosen = dict[Fault, None]()
    while len(chosen) < min(count, len(faults)):
        chosen.setdefault(source.choice(kinds[source.choice(sorted(kinds))]))
    return list(chosen)


def in_turn(tests: dict[str, float]) -> list[str]:
    """Tests for up to `SPENT` seconds of CPU: the cheapest case of each first, for different ones see more."""
    met, turns = Counter[str](), list[tuple[int, float, str]]()
    for test, seconds in sorted(tests.items(), key=lambda item: (item[1], item[0])):
        name = test.partition("[")[0]
        turns.append((met[name], seconds, test))
        met[name] += 1
    chosen, spent = list[str](), 0.0
    for _, seconds, test in sorted(turns):
        if spent + seconds <= SPENT:
            chosen.append(test)
            spent += seconds
    return chosen


def verdict(copy: Path, fault: Fault, tests: list[str]) -> str:
    """What the tests make of a fault."""
    if not tests:
        return "no recorded test reaches it"
    path, before = copy / fault.module, (ROOT / fault.module).read_text(encoding="utf-8")
    with tempfile.TemporaryDirectory(prefix="crosscheck-kernels-") as name:
        folder = Path(name)
        (folder / "tests").write_text("\n".join(tests), encoding="utf-8")
        path.write_text(planted(fault), encoding="utf-8")
        try:
            arguments = ["-p", PLUGIN, "-W", "ignore::RuntimeWarning", f"@{folder / 'tests'}"]
            code = run(copy, arguments, environment(copy, folder, float("inf")), 5.0 * SPENT)
        finally:
            path.write_text(before, encoding="utf-8")
        failed = folder / "failed"
        if failed.exists():
            return f"caught by {failed.read_text(encoding='utf-8').splitlines()[0]}"
    if code == OUT_OF_TIME:
        return "caught: the run does not end"
    return f"NOT CAUGHT by {len(tests)} tests" if code == 0 else f"caught: pytest ends with {code}"


def main() -> None:
    """Plant what is asked for; exit with 1 where a fault is not caught."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=1, help="of the draw")
    parser.add_argument("--count", type=int, default=12, help="how many are drawn")
    parser.add_argument("--only", default="", help="beginning of the names of modules that are drawn from")
    parser.add_argument("--dry-run", action="store_true", help="say what is drawn, and run nothing")
    options = parser.parse_args()
    modules = [
        str(p.relative_to(ROOT)) for name in ROOMS for p in sorted((ROOT / "reference_solver" / name).glob("*.py"))
    ]
    faults = [each for module in modules if module.startswith(options.only) for each in faults_of(module)]
    chosen = draw(options.seed, options.count, faults)
    print(f"seed {options.seed}: {len(chosen)} of {len(faults)} faults", flush=True)
    if options.dry_run:
        raise SystemExit("\n".join(told(each) for each in chosen))
    os.environ |= {"NUMBA_DISABLE_JIT": "1", "PYTEST_ADDOPTS": f"--timeout={PATIENCE}"}
    folder = Path(tempfile.gettempdir()) / "crosscheck-kernels"
    folder.mkdir(exist_ok=True)
    import_common()
    with tempfile.TemporaryDirectory(prefix="crosscheck-kernels-") as name:
        copy = Path(name)
        copy_of_the_checkout(copy)
        reach, missed = by_block(record(copy, folder, modules)), 0
        for number, each in enumerate(chosen, 1):
            places = blocks_of(each, modules)
            tests = {
                test: cost
                for block, own in reach.items()
                if block in places or (not each.function and block.startswith(places))
                for test, cost in own.items()
            }
            said = verdict(copy, each, in_turn(tests))
            missed += not said.startswith("caught")
            print(f"{number}. {told(each)}\n   {said}", flush=True)
    raise SystemExit(1 if missed else 0)


if __name__ == "__main__":
    main()
