"""Changes of the code that tests should notice: mutmut's mutants, and faults of physical size in the solver's kernels.

A fault is a constant halved or doubled, a sign, an index, a comparison or a condition the other way round, or a term
left out.
"""

from __future__ import annotations

import ast
import random
from collections import defaultdict
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
#: What mutants are drawn from; optional engines are left out, whose tests are skipped where they are not installed.
PACKAGES = ("adapters", "validation", "reports")
OPTIONAL = tuple(
    f"adapters/{name}/"
    for name in ("box2d", "box2d3", "box3d", "rapier", "dart", "drake", "physx", "newton", "mujoco/motrixsim")
)
#: Rooms of the solver that have kernels, and how kernels are marked.
ROOMS = ("textbook", "textbook2", "textbook3", "direct")
DECORATORS = ("kernel", "inner_kernel", "spliced_kernel")
OTHER_WAY = {ast.Lt: ">", ast.Gt: "<", ast.LtE: ">=", ast.GtE: "<=", ast.Eq: "!=", ast.NotEq: "=="}
#: A module and the first and last of its lines.
Place = tuple[str, int, int]


@dataclass(frozen=True)
class Change:
    """One change of a module's source.

    Parameters
    ----------
    module
        Path from the root of the checkout.
    function
        Name of the changed function or of the changed constant.
    kind
        Kind of a fault; empty for a mutant.
    told
        ``old -> new``.
    places
        Lines of functions that have it, up to the change.
    made
        Returns the module's source with the change.
    """

    module: str
    function: str
    kind: str
    told: str
    places: tuple[Place, ...]
    made: Callable[[], str]


def modules(kernels: bool) -> list[str]:
    """Modules that are changed."""
    folders = [ROOT / "reference_solver" / name for name in ROOMS] if kernels else [ROOT / name for name in PACKAGES]
    found = sorted(str(path.relative_to(ROOT)) for folder in folders for path in folder.rglob("*.py"))
    return [name for name in found if not name.startswith(OPTIONAL)]


def mutants_of(module: str) -> list[Callable[[], Change]]:
    """All of mutmut's mutants of a module's functions and methods; each costs a moment when it is called for."""
    from mutmut.mutation.file_mutation import create_mutations, deep_replace

    plain = (ROOT / module).read_text(encoding="utf-8")
    tree, mutations, _, _ = create_mutations(module, plain)
    return [
        lambda each=each: change_to(module, plain, deep_replace(tree, each.original_node, each.mutated_node).code)
        for each in mutations
        if each.contained_by_top_level_function
    ]


def change_to(module: str, plain: str, spoilt: str) -> Change:
    """Describe the mutant of a module by the lines in which both sources differ."""
    old, new = plain.splitlines(), spoilt.splitlines()
    first = next(k for k, (a, b) in enumerate(zip(old, new, strict=False)) if a != b)
    least = min(len(old), len(new)) - first
    same = next((k for k in range(least) if old[-1 - k] != new[-1 - k]), least)
    parts = (old[first : len(old) - same], new[first : len(new) - same])
    told = " -> ".join(" ".join(line.strip() for line in part) for part in parts)
    functions = [node for node in ast.walk(ast.parse(plain)) if isinstance(node, ast.FunctionDef)]
    around = [f for f in functions if f.lineno <= first + 1 <= (f.end_lineno or 0)]
    outer = min(around, key=lambda f: f.lineno, default=None)  # none of what a decorator is given
    name, begin = (outer.name, outer.lineno) if outer else ("", 1)
    return Change(module, name, "", told, ((module, begin, first + 1),), lambda: spoilt)


def faults_of(module: str) -> Iterator[Change]:
    """All faults of a module: of its kernels, and of the numbers that it names."""
    source = (ROOT / module).read_text(encoding="utf-8")
    starts, encoded = [0], source.encode()
    for line in encoded.splitlines(keepends=True):
        starts.append(starts[-1] + len(line))

    def fault(node: ast.expr | ast.stmt, kind: str, text: str, name: str, places: tuple[Place, ...]) -> Change:
        assert node.end_lineno is not None and node.end_col_offset is not None
        start, end = starts[node.lineno - 1] + node.col_offset, starts[node.end_lineno - 1] + node.end_col_offset
        plain = encoded[start:end].decode()

        def made() -> str:
            return (encoded[:start] + text.encode() + encoded[end:]).decode()

        return Change(module, name, kind, f"{' '.join(plain.split())} -> {text}", places, made)

    for node in ast.parse(source).body:
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
            if isinstance(node.value, ast.Constant) and isinstance(node.value.value, float):
                name = node.targets[0].id
                for kind, factor in (("halved", "0.5"), ("doubled", "2.0")):
                    text = f"{factor} * {ast.unparse(node.value)}"
                    yield fault(node.value, kind, text, name, tuple(uses_of(name)))
        elif isinstance(node, ast.FunctionDef) and any(ast.unparse(d) in DECORATORS for d in node.decorator_list):
            for statement in node.body:
                for part in ast.walk(statement):
                    if isinstance(part, ast.expr | ast.stmt):
                        place = module, node.lineno, part.lineno
                        yield from (fault(part, *change, node.name, (place,)) for change in changes(part))


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


def uses_of(name: str) -> Iterator[Place]:
    """Functions of the solver's kernels that name a constant."""
    return (place for place, names in names_in_kernels() if name in names)


@cache
def names_in_kernels() -> tuple[tuple[Place, frozenset[str]], ...]:
    """Where each function of the solver's kernels stands, and the names in it."""
    found = []
    for module in modules(True):
        for node in ast.parse((ROOT / module).read_text(encoding="utf-8")).body:
            if isinstance(node, ast.FunctionDef):
                names = frozenset(part.id for part in ast.walk(node) if isinstance(part, ast.Name))
                found.append(((module, node.lineno, node.end_lineno or node.lineno), names))
    return tuple(found)


def mutants(seed: int, only: str) -> Iterator[Change]:
    """Yield mutants in the order of a seed: the module is drawn by its lines, then one mutant of it."""
    source, names = random.Random(seed), [name for name in modules(False) if name.startswith(only)]
    lines = [len((ROOT / name).read_text(encoding="utf-8").splitlines()) for name in names]
    while True:
        if found := mutants_of(source.choices(names, lines)[0]):
            yield source.choice(found)()


def faults(seed: int, only: str) -> Iterator[Change]:
    """Yield faults of kernels in the order of a seed: the kind is drawn first, then one of it.

    So the few constants of kernels are met as often as the many indices.
    """
    source, found = random.Random(seed), defaultdict[str, list[Change]](list)
    for module in modules(True):
        for change in faults_of(module) if module.startswith(only) else ():
            found[change.kind].append(change)
    while True:
        yield source.choice(found[source.choice(sorted(found))])
