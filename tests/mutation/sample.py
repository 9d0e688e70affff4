"""A sample of the mutants of all modules: how many of them do the tests notice?

    every mutant of the three packages -> N of them, drawn by a seed -> the tests that reach each -> sample.csv

`SUBJECTS` is a choice of modules, each with its own tests. This asks without a choice: each mutant of any module is as
likely as any other. A drawn one stands alone in the module's source, in a copy of the checkout; the tests that reach
its statements (`reach`) run, the cheapest first (`in_turn`), until one fails or what a mutant may cost is spent. What
lives then, and does not change words alone, meets those that were left out for their cost, for some minutes, and the
rest of a test file whose record ended before it did. It *survived* if none failed, for whatever reason: what it may
cost was spent, or no test is known to reach it. So the share that is killed is a lower bound. A kill counts only if the
test that failed passes in the copy without a mutant, and after the first round only if it fails again by itself; what
time alone ends counts in the first round.
"""

from __future__ import annotations

import hashlib
import json
import os
import random
import re
import shutil
import tempfile
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import chdir, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

from checkout import copy_of_the_checkout
from drawn import (
    APART,
    FURTHER,
    GONE,
    KILLED,
    LONGEST,
    MEETS,
    MEETS_NEAR,
    NEAR,
    NEAR_SECONDS,
    NOTICED,
    RECORDED,
    REST_OF,
    SHARED,
    SHARED_FURTHER,
    SPENT,
    SURVIVED,
    TIMED,
    UNREACHED,
    UNSHOWN,
    Drawn,
    stored,
    write,
)  # fmt: skip
from libcst import FunctionDef, Module
from lists import known_by_form
from mutmut.configuration import config
from mutmut.mutation.file_mutation import Mutation, create_mutations, deep_replace
from mutmut.mutation.trampoline_templates import mangle_function_name
from pytest_apart import OUT_OF_TIME, PATIENCE, import_common, run
from reach import PLUGIN, Reach, Record, block_of, by_block, dotted, environment, record, recorded, test_files
from subjects import PACKAGES, ROOT

#: Seconds of wall time that a whole file may take: what its tests start in processes of their own counts nowhere else.
PATIENCE_WITH_FILES = 120.0
#: What the clock of a process tells at the least, a hundredth of a second: a test of nothing costs something.
TICK = 0.01
#: Seconds of CPU of one test by itself, with the fixtures of its file.
ALONE = 200.0
#: Exit status of pytest where a test that is named is not there.
NOT_FOUND = 4
#: Package -> the kept tables that hold something of most that it does.
TABLES = {"validation": ("scenes",), "adapters": ("engines", "laws"), "reports": ("screens",)}
#: Exit statuses where a test file cannot even be collected, or pytest itself ended in an error.
BROKEN = (2, 3, NOT_FOUND)


def modules() -> list[str]:
    """Modules that mutants are drawn from."""
    found = sorted(str(path.relative_to(ROOT)) for name in PACKAGES for path in (ROOT / name).rglob("*.py"))
    return [name for name in found if not name.startswith(APART)]


def mutations_of(module: str) -> tuple[Module, list[tuple[str, Mutation]]]:
    """Every mutation of a module's functions and methods, each with mutmut's name for its function."""
    tree, mutations, _, _ = create_mutations(module, (ROOT / module).read_text(encoding="utf-8"))
    owner = {
        method: node.name.value
        for node in tree.body
        if hasattr(node, "name") and not isinstance(node, FunctionDef)
        for method in getattr(node.body, "body", ())
    }
    named = []
    for mutation in mutations:
        function = mutation.contained_by_top_level_function
        if isinstance(function, FunctionDef):
            name = mangle_function_name(name=function.name.value, class_name=owner.get(function))
            named.append((f"{dotted(module)}.{name}", mutation))
    return tree, named


def counts(cache: Path) -> dict[str, int]:
    """Number of mutants of every module; what was counted of the same text is remembered."""
    known: dict[str, int] = json.loads(cache.read_text(encoding="utf-8")) if cache.exists() else {}
    found = {}
    for module in modules():
        text = hashlib.sha256((ROOT / module).read_bytes()).hexdigest()
        if text not in known:
            known[text] = len(mutations_of(module)[1])
        found[module] = known[text]
    cache.write_text(json.dumps(known), encoding="utf-8")
    return found


def draw(seed: int, number: int, total: int) -> list[int]:
    """Draw so many different mutants of ``total``; more of them begin with the same ones."""
    source, chosen = random.Random(seed), dict[int, None]()
    while len(chosen) < min(number, total):
        chosen.setdefault(source.randrange(total))
    return list(chosen)


def change_of(tree: Module, mutation: Mutation) -> str:
    """``old -> new``: the lines of the function in which the mutant differs."""
    function = mutation.contained_by_top_level_function
    assert function is not None
    spoilt = deep_replace(function, mutation.original_node, mutation.mutated_node)
    old, new = ([line.strip() for line in tree.code_for_node(node).strip().splitlines()]
                for node in (function, spoilt))  # type: ignore[arg-type] # fmt: skip
    while old and new and old[0] == new[0]:
        del old[0], new[0]
    while old and new and old[-1] == new[-1]:
        del old[-1], new[-1]
    return f"{' '.join(old)} -> {' '.join(new)}"


@dataclass(frozen=True)
class Bench:
    """What mutants meet: a copy of the checkout, and which tests reach which statements of it."""

    copy: Path
    known: Mapping[str, Record]
    reach: Reach
    met: str = MEETS

    @classmethod
    def of(cls, folder: Path) -> Bench:
        """Copy the checkout into ``folder``, and record every test file that has changed since."""
        copy, records = copied(folder), folder / "records"
        record(copy, records, RECORDED)
        import_common()
        known = recorded(records)
        return cls(copy, known, by_block(known))

    def verdict(self, module: str, tree: Module, function: str, mutation: Mutation) -> tuple[str, int, str]:
        """Verdict over one mutant of ``tree``, how many tests were asked, and the one that failed."""
        spoilt = deep_replace(tree, mutation.original_node, mutation.mutated_node)
        assert isinstance(spoilt, Module)
        tests_of_it = reaching(self.reach, tree.code, spoilt.code, module, function)
        shared = {name: each.shared for name, each in self.known.items()}
        order = in_turn(tests_of_it, shared)
        chosen = affordable(order, shared, SPENT, SHARED)
        others = affordable([each for each in order if each not in chosen], shared, FURTHER, SHARED_FURTHER)
        words = known_by_form(change_of(tree, mutation))
        verdict, tests, failed = judged(self.copy, module, spoilt.code, chosen, self.known)
        if "::" in failed and asked(self.copy, [failed], 60.0)[0] != 0:
            verdict = UNSHOWN  # it fails without the mutant as well
        if verdict == SURVIVED and others and not words:
            _, more, failed = judged(self.copy, module, spoilt.code, others, self.known)
            tests += more
            verdict = KILLED if is_shown(self.copy, module, spoilt.code, failed) else SURVIVED
        if verdict in (SURVIVED, UNREACHED) and not words:
            rest = cut_short(self.known, module)
            failed = by_the_rest(self.copy, module, spoilt.code, rest, self.known)
            verdict = KILLED if failed else verdict
        return verdict, tests, failed


@dataclass(frozen=True)
class NearBench:
    """What mutants meet where nobody has the minutes to see which tests reach them: test files that name the module."""

    copy: Path
    met: str = MEETS_NEAR

    @classmethod
    def of(cls, folder: Path) -> NearBench:
        """Copy the checkout into ``folder``, the recorder with it: it is what tells which test failed."""
        copy = copied(folder)
        shutil.copy2(Path(__file__).with_name("recording.py"), copy / f"{PLUGIN}.py")
        import_common()
        return cls(copy)

    def verdict(self, module: str, tree: Module, function: str, mutation: Mutation) -> tuple[str, int, str]:
        """Verdict over one mutant of ``tree``, how many test files were asked, and the test that failed."""
        spoilt = deep_replace(tree, mutation.original_node, mutation.mutated_node)
        assert isinstance(spoilt, Module)
        files = near(module, function)[: 2 if known_by_form(change_of(tree, mutation)) else NEAR]  # words: no more
        for asked_so_far, name in enumerate(files, 1):
            with spoilt_copy(self.copy, module, spoilt.code):
                code, failed = asked(self.copy, [name], NEAR_SECONDS, PATIENCE_WITH_FILES, [name])
            shown = [failed] if "::" in failed else [name] if code in BROKEN else []
            if shown and asked(self.copy, shown, 60.0, PATIENCE_WITH_FILES, [name])[0] in (0, OUT_OF_TIME):
                return KILLED, asked_so_far, failed or name
        return SURVIVED if files else UNREACHED, len(files), ""


def near(module: str, function: str) -> list[str]:
    """Test files beside a function: those that import its module first, then by names of both; at most `NEAR`.

    The kept tables of its package are the last of them, for they hold something of most that it does.
    """
    parent, _, stem = dotted(module).rpartition(".")
    imports = re.compile(rf"{re.escape(dotted(module))}\b|from {re.escape(parent)} import [^\n]*\b{re.escape(stem)}\b")
    own = function.removeprefix(f"{dotted(module)}.").removeprefix("xǁ").removeprefix("x_").split("ǁ")
    names = {stem, stem.partition("_")[0], *own}
    words = re.compile("|".join(rf"\b{re.escape(name)}\b" for name in sorted(names)))
    met, folder = dict[str, tuple[bool, bool, int, int]](), parent.rpartition(".")[2]
    for name in test_files():
        text = (ROOT / name).read_text(encoding="utf-8")
        said = words.findall(text)
        rank = imports.search(text) is not None, stem in Path(name).stem, len(set(said)) + (folder in name), len(said)
        if any(rank):
            met[name] = rank
    tables = [f"tests/tables/test_of_{name}.py" for name in TABLES[module.partition("/")[0]]]
    others = sorted((name for name in met if name not in tables), key=lambda name: met[name], reverse=True)
    return [*others[: NEAR - len(tables)], *tables]


def copied(folder: Path) -> Path:
    """Copy the checkout into ``folder``; mutmut's configuration beside it, read where it stands and then remembered."""
    copy_of_the_checkout(folder / "copy")
    (folder / "pyproject.toml").write_text('[tool.mutmut]\nsource_paths = ["copy"]\n', encoding="utf-8")
    with chdir(folder):
        config()
    return folder / "copy"


def sample(seed: int, number: int, folder: Path, by_name: bool) -> None:
    """Draw, run and write down; what is written already of this seed and these sources is not run again.

    Samples of the same sources by other seeds stay: none is chosen.
    """
    bench = NearBench.of(folder) if by_name else Bench.of(folder)
    each = counts(folder / "counts.json")
    total = sum(each.values())
    of = hashlib.sha256(b"".join((ROOT / module).read_bytes() for module in each)).hexdigest()[:12]
    found = {row.number: row for row in stored() if (row.seed, row.of) == (seed, of)}
    others = [row for row in stored() if row.of == of and row.seed != seed]
    for k, index in enumerate(draw(seed, number, total)):
        if k in found:
            continue
        module, place = located(each, index)
        tree, mutations = mutations_of(module)
        function, mutation = mutations[place]
        change = change_of(tree, mutation)
        verdict, tests, failed = bench.verdict(module, tree, function, mutation)
        reason = "" if verdict in NOTICED else known_by_form(change)
        found[k] = Drawn(seed, k, of, module, function, change, verdict, tests, failed, reason=reason, met=bench.met)
        print(f"{k + 1} of {number}: {verdict}, {function}: {change[:100]}", flush=True)
        write([*others, *found.values()])


def again(folder: Path, by_name: bool) -> None:
    """Let what was not noticed of the sample that is kept meet the tests of now, in the sources of now.

    A mutant is found by its function and its change; one whose statements have changed since is `GONE`. What has a
    reason is not asked: no test can notice it.
    """
    rows, bench = stored(), NearBench.of(folder) if by_name else Bench.of(folder)
    for place, row in enumerate(rows):
        if row.verdict in NOTICED or row.now in NOTICED or row.reason:
            continue
        tree, mutations = mutations_of(row.module) if (ROOT / row.module).exists() else (None, [])
        same = [mutation for function, mutation in mutations if function == row.function]
        same = [mutation for mutation in same if tree and change_of(tree, mutation) == row.change]
        if tree and same:
            verdict, tests, failed = bench.verdict(row.module, tree, row.function, same[0])
            rows[place] = replace(row, now=verdict, tests=tests, failed=failed)
        else:
            rows[place] = replace(row, now=GONE)
        print(f"{row.function}: {rows[place].now}: {row.change[:100]}", flush=True)
        write(rows)


def located(each: dict[str, int], index: int) -> tuple[str, int]:
    """Module of a mutant by its number among all, and its place among those of the module."""
    for module, number in each.items():
        if index < number:
            return module, index
        index -= number
    raise IndexError(index)


def reaching(reach: Reach, before: str, after: str, module: str, function: str) -> dict[str, float]:
    """Tests that reach what a mutant changes; those of all its function where none is known to."""
    both = zip(before.splitlines(), after.splitlines(), strict=False)
    line = next((number for number, (old, new) in enumerate(both, 1) if old != new), 1)
    if tests := reach.get(block_of(before, module, function, line)):
        return tests
    return {
        test: cost for block, tests in reach.items() if block.startswith(f"{function}:") for test, cost in tests.items()
    }


def in_turn(tests: dict[str, float], shared: Mapping[str, float]) -> list[tuple[str, float]]:
    """Tests in the order in which they are asked: the cheapest first, for more of them see more.

    A test's further cases see much what its first one has: the n-th of them counts n times its seconds, so that dear
    first cases of tests beside the matter leave room for the case of one engine among ten that costs nothing.

    ``shared`` are the seconds of CPU that a test file takes before its first test, and count as those of each of its
    tests: else two files whose tests cost nothing once a page is made fill all the time that there is for fixtures,
    and no test beside the code is asked.
    """
    met, place = Counter[str](), dict[str, tuple[float, int, str]]()
    costs = {test: seconds + shared[test.partition("::")[0]] for test, seconds in tests.items()}
    for test, seconds in sorted(costs.items(), key=lambda item: (item[1], item[0])):
        name = test.partition("[")[0]
        place[test] = (met[name] + 1) * max(seconds, TICK), met[name], test
        met[name] += 1
    return sorted(tests.items(), key=lambda item: place[item[0]])


def affordable(
    tests: Sequence[tuple[str, float]], shared: Mapping[str, float], seconds: float, fixtures: float
) -> list[tuple[str, float]]:
    """Those of these tests that so many seconds of CPU are enough for, and so many for the fixtures of their files.

    ``shared`` are the seconds that a test file takes before its first test. The first test is always among them.
    """
    chosen, spent, files = list[tuple[str, float]](), 0.0, dict[str, float]()
    for test, cost in tests:
        name = test.partition("::")[0]
        made = sum((files | {name: shared[name]}).values())
        if not chosen or (spent + cost <= seconds and (name in files or made <= fixtures)):
            chosen.append((test, cost))
            spent += cost
            files[name] = shared[name]
    return chosen


def judged(
    copy: Path, module: str, source: str, tests: Sequence[tuple[str, float]], known: Mapping[str, Record]
) -> tuple[str, int, str]:
    """Verdict over one mutant, how many tests were asked, and the one that failed."""
    if not tests:
        return UNREACHED, 0, ""
    names = [test for test, _ in tests]
    files = sorted({name.partition("::")[0] for name in names})
    limit = 60.0 + 4.0 * (sum(cost for _, cost in tests) + sum(known[name].shared for name in files))
    with spoilt_copy(copy, module, source):
        code, failed = asked(copy, names, limit)
        if code == NOT_FOUND:  # a file that cannot be imported, or tests that are made of what has changed
            code, failed = asked(copy, files, limit)
    if code == OUT_OF_TIME:
        return TIMED, len(names), ""
    return (SURVIVED if code in (0, NOT_FOUND, 5) else KILLED), len(names), failed


def by_the_rest(copy: Path, module: str, source: str, files: Sequence[str], known: Mapping[str, Record]) -> str:
    """First test that fails, and not without the mutant, of what these files have beyond their records; or empty.

    Of a scene the cases that name it.
    """
    cases = ["-k", Path(module).stem] if module.startswith("validation/scenes/") else []
    for name in files:
        with spoilt_copy(copy, module, source):
            _, failed = asked(copy, [name], LONGEST, PATIENCE_WITH_FILES, known[name].tests, cases)
        if is_shown(copy, module, source, failed):
            return failed
    return ""


def is_shown(copy: Path, module: str, source: str, failed: str) -> bool:
    """Whether a test that failed among many does so again by itself, and passes without the mutant.

    What is asked for minutes on a busy machine fails now and then for its own reasons.
    """
    if "::" not in failed:
        return False
    with spoilt_copy(copy, module, source):
        if asked(copy, [failed], ALONE)[0] in (0, OUT_OF_TIME):
            return False
    return asked(copy, [failed], ALONE)[0] == 0


def cut_short(known: Mapping[str, Record], module: str) -> list[str]:
    """Test files whose record ended before they did: those that import a module first, then by how much they reach."""
    parent, _, stem = dotted(module).rpartition(".")
    imports = re.compile(rf"{re.escape(dotted(module))}\b|from {re.escape(parent)} import [^\n]*\b{re.escape(stem)}\b")
    met = dict[str, tuple[bool, int]]()
    for name, own in known.items():
        blocks = {block for _, names in own.tests.values() for block in names}
        reaches = sum(block.startswith(f"{dotted(module)}.") for block in blocks)
        says = imports.search((ROOT / name).read_text(encoding="utf-8")) is not None
        if not own.whole and (says or reaches):
            met[name] = (says, reaches)
    return sorted(met, key=lambda name: met[name], reverse=True)[:REST_OF]


@contextmanager
def spoilt_copy(copy: Path, module: str, source: str) -> Iterator[None]:
    """A module as a mutant of it; as it was afterwards."""
    path = copy / module
    before, times = path.read_bytes(), path.stat()
    try:
        path.write_text(source, encoding="utf-8")
        yield
    finally:
        path.write_bytes(before)
        os.utime(path, ns=(times.st_atime_ns, times.st_mtime_ns))


def asked(
    copy: Path,
    tests: Sequence[str],
    cpu_seconds: float,
    patience: float = PATIENCE,
    but: Iterable[str] = (),
    options: Sequence[str] = (),
) -> tuple[int, str]:
    """Exit status of these tests, ``but`` some, in the copy as it is, and the first that failed."""
    with tempfile.TemporaryDirectory(prefix="crosscheck-sample-") as text:
        folder = Path(text)
        (folder / "tests").write_text("\n".join(tests), encoding="utf-8")
        (folder / "but").write_text("\n".join(but), encoding="utf-8")
        arguments = ["-p", PLUGIN, f"@{folder / 'tests'}", *options]
        told = environment(copy, folder, float("inf"), folder / "but" if but else None)
        code = run(copy, arguments, told, cpu_seconds, patience)
        said = (folder / "failed").read_text(encoding="utf-8") if (folder / "failed").exists() else ""
        return code, next(iter(said.splitlines()), "")
