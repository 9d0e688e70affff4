"""Mutation run: mutmut changes one expression at a time, and the tests of that module must notice.

    copy of the checkout -> mutmut on one module with its tests -> survivors.csv, score.csv -> score.md

``python tests/mutation/run.py`` runs the modules of `SUBJECTS` that changed, or whose tests did, since they ran last;
each is written down when it ends, so a run that was stopped goes on where it was. Modules that are named run again
whatever they are; ``--survivors`` runs only those of their mutants that survived last time, ``--changed`` those of
functions that have changed since as well, where tests have only been added (else all). ``--check N`` runs N mutants of
one subject, both chosen by the commit, writes nothing, and fails on a survivor that is not listed. It chooses among the
subjects that are as they were when they ran: survivors of another are nobody's yet. Which those are is said, and more
than half of all is a failure. ``--sample N --seed S`` asks about all modules (`sample`), ``--again``
what the tests of now make of those that it missed. With ``--near`` a drawn mutant meets the test files that name its
module, without the three quarters of an hour that it takes to see what tests reach: a lower bound that is lower.

A survivor is listed by its function and its change, so that an edit elsewhere does not make it new. Its reason is
written by hand, but for the few that `known_by_form` can tell; survivors without one are *open*. What only a time limit
ended is listed as that, so that a faster machine, where its tests pass in time, has no survivor that is new; it counts
as killed. Random examples are the same in every run.
"""

from __future__ import annotations

import argparse
import ast
import hashlib
import json
import os
import random
import subprocess
import sys
import tempfile
from collections import Counter
from dataclasses import replace
from pathlib import Path

from checkout import copy_of_the_checkout
from lists import Change, Score, is_current, listed, stored, write_score, write_survivors, write_table
from reach import dotted, functions
from sample import again, sample
from subjects import ROOT, SUBJECTS, hash_of, tests_of

CONFIG = """
[tool.mutmut]
source_paths = ["validation", "adapters", "reports"]
only_mutate = [{module!r}]
also_copy = ["reference_solver", "README.md", "CHANGELOG.md", "CONTRIBUTING.md", "ARCHITECTURE.md", "CITATION.cff",
             "Makefile", ".ci", "contact_crosscheck.py"]
pytest_add_cli_args = ["-p", "no:randomly", "-p", "no:xdist", "-p", "no:cacheprovider", "-q", "-x",
                       "--hypothesis-profile=ci"]
pytest_add_cli_args_test_selection = {tests}
"""
#: Exit codes of a mutant that its tests let live: they passed, or no test reaches it.
ALIVE = (0, 5, 33)
#: Exit codes of a mutant that ran out of CPU or wall time.
OUT_OF_TIME = (-24, 24, 36, 152, 255)
#: Share of the subjects that may have changed since they ran before a check fails.
STALE_SHARE = 0.5


class NothingRanError(RuntimeError):
    """The tests of a module fail without any mutant, or call nothing of it."""


def configured_copy(folder: Path, module: str) -> None:
    """The checkout, and the configuration of one run."""
    copy_of_the_checkout(folder)
    with (folder / "pyproject.toml").open("a", encoding="utf-8") as stream:
        stream.write(CONFIG.format(module=module, tests=json.dumps(tests_of(module))))


def mutmut(folder: Path, *arguments: str) -> str:
    """Run mutmut in the copy, one mutant at a time; its output."""
    command = [sys.executable, "-m", "mutmut", "run", "--max-children", "1", *arguments]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True).stdout


def exit_codes(folder: Path, module: str) -> dict[str, int | None]:
    """Exit code of the tests for every mutant that was made; None of one that did not run."""
    data = json.loads((folder / "mutants" / f"{module}.meta").read_text(encoding="utf-8"))
    return dict(data["exit_code_by_key"])


def changes(folder: Path, module: str) -> dict[str, Change]:
    """Every mutant's change: the statements in which it differs."""
    text = (folder / "mutants" / module).read_text(encoding="utf-8")
    lines, made = text.splitlines(), {}
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.FunctionDef) and "__mutmut_" in node.name:
            made[node.name] = [line.strip() for line in lines[node.lineno - 1 : node.end_lineno]]
    prefix = module.removesuffix(".py").removesuffix("/__init__").replace("/", ".")
    found = {}
    for name, mutant in made.items():
        function, _, number = name.rpartition("__mutmut_")
        if number == "orig":
            continue
        old, new = list(made[f"{function}__mutmut_orig"]), list(mutant)
        old[0], new[0] = (
            each[0].replace(own, function) for each, own in ((old, f"{function}__mutmut_orig"), (new, name))
        )
        while old and new and old[0] == new[0]:
            del old[0], new[0]
        while old and new and old[-1] == new[-1]:
            del old[-1], new[-1]
        found[f"{prefix}.{name}"] = (f"{prefix}.{function}", f"{' '.join(old)} -> {' '.join(new)}")
    return found


def run(
    module: str, sample: int | None, survivors_only: bool, changed: set[str] | None = None
) -> tuple[Score, list[Change], list[Change]]:
    """Run the mutants of one module; the score of those that ran, the survivors, and what only time ended.

    With ``changed`` only mutants of these functions run, and those that survived last time; all of them are counted,
    for what was killed is killed still, until a whole run says otherwise.
    """
    spent, of = os.times(), hash_of(module)
    with tempfile.TemporaryDirectory(prefix="crosscheck-mutants-") as name:
        folder = Path(name)
        configured_copy(folder, module)
        chosen: list[str] = []
        if sample is not None or survivors_only or changed is not None:
            mutmut(folder, "no.such.mutant")  # makes them all and runs none
            made, known = changes(folder, module), listed()
            some = survivors_only or changed is not None
            chosen = sorted(mutant for mutant, change in made.items()
                            if not some or change in known or change[0] in (changed or ()))  # fmt: skip
            if sample is not None:
                chosen = random.Random(head()).sample(chosen, min(sample, len(chosen)))
        said = mutmut(folder, *chosen)
        codes = {mutant: code for mutant, code in exit_codes(folder, module).items() if code is not None}
        if not codes:
            raise NothingRanError(f"{module}: no mutant ran; do its tests pass, and do they call it?\n{said[-500:]}")
        if left := set(chosen) - set(codes):  # a run that ended early has not shown that tests notice
            raise NothingRanError(f"{module}: {len(left)} mutants did not run\n{said[-500:]}")
        made = changes(folder, module)
    alive, timed = ([made[mutant] for mutant, code in codes.items() if code in which] for which in (ALIVE, OUT_OF_TIME))
    now = os.times()
    seconds = sum(now[:4]) - sum(spent[:4])
    ran = len(codes) if changed is None else len(made)
    return Score(module, ran, ran - len(alive), round(seconds, 1), of), alive, timed


def changed_since(module: str, of: str) -> set[str] | None:
    """Functions of a module that are other ones than when it ran with the hash ``of``; None where all must run.

    That is where nobody knows its text of then, where a line of a test or of its helpers is not there any more, or one
    of what stands beside the functions. The text is looked for in the commits that changed the module or its tests.
    """
    names = [module, *tests_of(module)]
    log = ["git", "log", "--format=%H", "-n", "100", "--", *names]
    for commit in subprocess.run(log, cwd=ROOT, capture_output=True, text=True).stdout.split():
        texts = [subprocess.run(["git", "show", f"{commit}:{name}"], cwd=ROOT, capture_output=True).stdout
                 for name in names]  # fmt: skip
        if hashlib.sha256(b"".join(texts)).hexdigest()[:12] == of:
            then, now = [*map(ast.parse, texts)], [ast.parse((ROOT / name).read_bytes()) for name in names]
            if any(told(old, k > 0) - told(new, k > 0) for k, (old, new) in enumerate(zip(then, now, strict=True))):
                return None
            before, own = ({name: ast.unparse(node) for name, node in functions(each[0])} for each in (then, now))
            return {f"{dotted(module)}.{name}" for name, text in own.items() if before.get(name) != text}
    return None


def told(tree: ast.Module, with_functions: bool) -> Counter[str]:
    """Lines of top-level statements but imports and words; of functions and classes only if asked for."""
    left_out = (ast.Import, ast.ImportFrom, ast.Expr, *(() if with_functions else (ast.FunctionDef, ast.ClassDef)))
    return Counter(
        line for node in tree.body if not isinstance(node, left_out) for line in ast.unparse(node).splitlines()
    )


def working_folder() -> Path:
    """Where the sample's copy of the checkout and its records of tests lie: kept, since they cost minutes."""
    of = hashlib.sha256(str(ROOT).encode()).hexdigest()[:8]
    folder = Path(tempfile.gettempdir()) / f"crosscheck-mutants-{of}"
    folder.mkdir(exist_ok=True)
    return folder


def head() -> str:
    """Hash of the commit: the seed of what `--check` chooses."""
    return subprocess.run(["git", "rev-parse", "HEAD"], cwd=ROOT, capture_output=True, text=True).stdout


def main() -> None:
    """Run what was asked for; exit with 1 on a module that cannot be run."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("modules", nargs="*", help="modules to mutate; by default the subjects that changed")
    parser.add_argument("--survivors", action="store_true", help="only mutants that survived last time")
    parser.add_argument("--changed", action="store_true", help="as that, and mutants of functions that have changed")
    parser.add_argument("--check", type=int, metavar="N", help="run N mutants of one subject, write nothing")
    parser.add_argument("--sample", type=int, metavar="N", help="draw N mutants of all modules, and run them")
    parser.add_argument("--seed", type=int, default=1, help="of what --sample draws")
    parser.add_argument("--near", action="store_true", help="--sample asks tests that name a module, without a record")
    parser.add_argument("--again", action="store_true", help="what the kept sample missed meets the tests of now")
    parser.add_argument("--table", action="store_true", help="only write the table, from the scores that are there")
    options = parser.parse_args()
    if unknown := [module for module in options.modules if module not in SUBJECTS]:
        raise SystemExit(f"{unknown[0]}: stands in SUBJECTS with no tests")
    if options.again or options.sample:
        if options.again:
            again(working_folder(), options.near)
        else:
            sample(options.seed, options.sample, working_folder(), options.near)
        write_table()
        return
    stale = [module for module in SUBJECTS if not is_current(module)]
    if options.check:
        check(stale, options.check)
        return
    before = stored()
    failed: list[str] = []
    for module in [] if options.table else options.modules or stale:
        whole = before.get(module)
        changed = changed_since(module, whole.of) if options.changed and whole else None
        try:
            score, alive, timed = run(module, None, options.survivors, changed)
        except NothingRanError as error:
            failed.append(str(error))
            continue
        if whole and options.survivors:  # what was killed is killed still, until a whole run says otherwise
            score = Score(module, whole.mutants, whole.mutants - len(alive), whole.cpu_seconds, whole.of)
        if whole and changed is not None:  # the seconds of a whole run
            score = replace(score, cpu_seconds=whole.cpu_seconds)
        write_survivors(module, alive, timed)
        write_score(score)
        print(f"{module}: {score.killed} of {score.mutants} killed, {score.cpu_seconds:.0f} s", flush=True)
    write_table()
    raise SystemExit("\n".join(failed) or 0)


def check(stale: list[str], count: int) -> None:
    """Run ``count`` mutants of a module; exit with 1 on a survivor that is not listed, or on too many stale modules."""
    if stale:
        print(
            f"not sampled, {len(stale)} modules changed since they ran (make mutants): {', '.join(stale)}", flush=True
        )
    if len(stale) > STALE_SHARE * len(SUBJECTS):
        raise SystemExit(f"{len(stale)} of {len(SUBJECTS)} modules changed since their mutants ran: run `make mutants`")
    module = random.Random(head()).choice([module for module in SUBJECTS if module not in stale])
    score, alive, _ = run(module, count, False)
    new = [key for key in alive if key not in listed()]
    print(f"{module}: {score.mutants} mutants, {len(alive)} survived, {len(new)} of them not listed")
    print("\n".join(f"new survivor: {function}: {change}" for function, change in new))
    raise SystemExit(1 if new else 0)


if __name__ == "__main__":
    main()
