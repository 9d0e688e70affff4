"""Mutation run: mutmut changes one expression at a time, and the tests of that module must notice.

    copy of the checkout -> mutmut on one module with its tests -> survivors.csv, score.csv -> score.md

``python tests/mutation/run.py`` runs the modules of `SUBJECTS` that changed, or whose tests did, since they ran last;
each is written down when it ends, so a run that was stopped goes on where it was. Modules that are named run again
whatever they are; ``--survivors`` runs only those of their mutants that survived last time. ``--check N`` runs N
mutants of one subject, both chosen by the commit, writes nothing, and fails on a survivor that is not listed.

A survivor is listed by its function and its change, so that an edit elsewhere does not make it new. Its reason is
written by hand, but for the few that `known_by_form` can tell; survivors without one are *open*.
"""

from __future__ import annotations

import argparse
import ast
import csv
import hashlib
import json
import os
import random
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
HERE = Path(__file__).resolve().parent
LISTED, SCORES, TABLE = HERE / "survivors.csv", HERE / "score.csv", HERE / "score.md"
COLUMNS = ("function", "change", "reason")
SCORE_COLUMNS = ("module", "mutants", "killed", "cpu_seconds", "of")
#: Module -> the tests that must notice, each file below `tests`. In the order of what a verdict hangs on.
SUBJECTS = {
    "validation/judging/verdicts.py": ("validation/test_verdicts.py",),
    "validation/findings/__init__.py": ("validation/test_findings.py", "validation/test_acceptance.py"),
    "validation/findings/files.py": ("validation/test_findings.py",),
    "validation/judging/acceptance.py": ("validation/test_acceptance.py",),
    "validation/bounds.py": ("validation/test_worked_bounds.py", "validation/test_tolerances.py"),
    "validation/truths/columns.py": ("validation/test_worked_bounds.py", "validation/scenes/test_columns.py"),
    "validation/scenes/impact.py": (
        "validation/scenes/test_impact.py",
        "validation/test_worked_bounds.py",
        "validation/test_bench_primary.py",
    ),
    "validation/scenes/bounce.py": (
        "validation/scenes/test_bounce.py",
        "validation/test_worked_bounds.py",
        "validation/test_tolerances.py",
    ),
    "validation/scenes/stack.py": ("validation/scenes/test_stack.py", "validation/test_worked_bounds.py"),
    "validation/scenes/incline.py": ("validation/scenes/test_incline.py", "validation/test_worked_bounds.py"),
    "validation/truths/pivoting.py": ("validation/scenes/test_worked_falls.py", "validation/scenes/test_pivoting.py"),
    "validation/truths/sliding.py": ("validation/scenes/test_worked_slides.py", "validation/scenes/test_standing.py"),
    "validation/scenes/tilt_table.py": ("validation/scenes/test_worked_falls.py", "validation/scenes/test_tilting.py"),
    "validation/scenes/rocker.py": ("validation/scenes/test_worked_rocking.py", "validation/scenes/test_rocker.py"),
    "validation/scenes/seam.py": ("validation/scenes/test_worked_slides.py", "validation/scenes/test_seams.py"),
    "validation/scenes/overlap.py": ("validation/scenes/test_worked_blows.py", "validation/scenes/test_overlaps.py"),
    "validation/scenes/closing_wall.py": (
        "validation/scenes/test_worked_blows.py",
        "validation/scenes/test_moved_blows.py",
    ),
    "validation/questions/nulls.py": ("validation/test_nulls.py",),
    "validation/questions/residuals.py": ("validation/test_residuals.py",),
    "validation/records/keeping.py": ("validation/test_keeping.py",),
    "validation/releases/history.py": ("validation/releases/test_history.py",),
    "validation/releases/bisection.py": ("validation/releases/test_bisection.py",),
    "validation/metrics.py": ("validation/test_metrics.py",),
    "validation/files/quantities.py": ("validation/test_quantities.py", "validation/test_scene_files.py"),
    "adapters/law.py": (
        "validation/test_verdicts.py",
        "validation/test_deviations_chipmunk.py",
        "validation/test_worked_bounds.py",
    ),
    "reports/exports.py": ("reports/test_exports.py", "reports/test_what_is_shown.py"),
    "reports/wording.py": ("reports/test_wording.py", "reports/test_what_is_shown.py"),
    "reports/changes.py": ("reports/test_changes.py",),
    "reports/findings.py": ("reports/test_findings_shown.py", "reports/test_what_is_shown.py"),
    "reports/matrix.py": ("reports/test_matrix.py", "reports/test_what_is_shown.py"),
    "reports/command/statuses.py": ("reports/test_statuses.py",),
    "validation/judging/rows.py": (
        "validation/test_rows.py",
        "validation/test_findings.py",
        "validation/test_acceptance.py",
    ),
    "validation/judging/comparison.py": ("validation/test_comparison.py",),
    "adapters/lift.py": ("adapters/test_lift.py",),
    "adapters/plain.py": ("adapters/test_plain.py",),
    "adapters/needs.py": ("adapters/test_needs.py",),
    "adapters/scene.py": ("adapters/test_scene.py",),
    "adapters/shapes.py": ("adapters/test_scene.py",),
    "adapters/materials.py": ("adapters/test_needs.py", "adapters/test_scene.py"),
    "adapters/trajectory.py": ("adapters/test_stepping.py",),
    "adapters/stepping.py": ("adapters/test_stepping.py",),
    "adapters/receipts.py": ("adapters/test_receipts.py",),
    "validation/geometry.py": (
        "validation/test_geometry.py",
        "validation/test_solids.py",
        "validation/test_metrics.py",
    ),
    "validation/solids.py": ("validation/test_solids.py",),
    "validation/files/invariants.py": ("validation/test_invariants.py",),
    "validation/files/mass_properties.py": ("validation/test_invariants.py",),
    "validation/questions/convergence.py": ("validation/test_convergence.py",),
    "validation/bench/statistics.py": ("validation/test_bench_statistics.py",),
}
PACKAGES = ("validation", "adapters", "reports")
CONFIG = """
[tool.mutmut]
source_paths = ["validation", "adapters", "reports"]
only_mutate = [{module!r}]
also_copy = ["reference_solver", "README.md", "CHANGELOG.md", "CONTRIBUTING.md", "ARCHITECTURE.md", "CITATION.cff",
             "Makefile", ".ci", "contact_crosscheck.py"]
pytest_add_cli_args = ["-p", "no:randomly", "-p", "no:xdist", "-p", "no:cacheprovider", "-q", "-x"]
pytest_add_cli_args_test_selection = {tests}
"""
#: Reasons that the form of a change tells.
WORDS, ENCODING = "words of a sentence", "the same encoding by another name"
LETTERS = "the same sum by other letters"
STRICT = "a guard against slips of our own: both are of one length wherever it is called"
#: Exit codes of a mutant that its tests let live: they passed, or no test reaches it.
ALIVE = (0, 5, 33)


class NothingRanError(RuntimeError):
    """The tests of a module fail without any mutant, or call nothing of it."""


@dataclass(frozen=True)
class Score:
    """What a run of one module found; ``of`` is the hash of the module and its tests."""

    module: str
    mutants: int
    killed: int
    cpu_seconds: float
    of: str


def tests_of(module: str) -> list[str]:
    """Paths of the tests of a module, from the root of the checkout."""
    return [f"tests/{name}" for name in SUBJECTS[module]]


def hash_of(module: str) -> str:
    """Hash of a module and its tests: another one means that its score is of something else."""
    return hashlib.sha256(b"".join((ROOT / name).read_bytes() for name in [module, *tests_of(module)])).hexdigest()[:12]


def copy_of_the_checkout(folder: Path, module: str) -> None:
    """Everything that is tracked or new, and the configuration of one run."""
    command = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    names = subprocess.run(command, cwd=ROOT, capture_output=True, check=True).stdout
    for name in filter(None, names.decode().split("\0")):
        if not name.startswith("reports/published/") and (ROOT / name).is_file():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, folder / name)
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


def changes(folder: Path, module: str) -> dict[str, tuple[str, str]]:
    """Every mutant's function, and its change as ``old -> new``: the statements in which it differs."""
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


def listed() -> dict[tuple[str, str], str]:
    """Known survivors with their reasons."""
    if not LISTED.exists():
        return {}
    with LISTED.open(newline="", encoding="utf-8") as stream:
        return {(row["function"], row["change"]): row["reason"] for row in csv.DictReader(stream)}


def stored() -> dict[str, Score]:
    """Scores of the runs before, by module."""
    if not SCORES.exists():
        return {}
    with SCORES.open(newline="", encoding="utf-8") as stream:
        rows = [Score(r["module"], int(r["mutants"]), int(r["killed"]), float(r["cpu_seconds"]), r["of"])
                for r in csv.DictReader(stream)]  # fmt: skip
    return {row.module: row for row in rows}


def run(module: str, sample: int | None, survivors_only: bool) -> tuple[Score, list[tuple[str, str]]]:
    """Run the mutants of one module; the score of those that ran, and the survivors among them."""
    spent, of = os.times(), hash_of(module)
    with tempfile.TemporaryDirectory(prefix="crosscheck-mutants-") as name:
        folder = Path(name)
        copy_of_the_checkout(folder, module)
        chosen: list[str] = []
        if sample is not None or survivors_only:
            mutmut(folder, "no.such.mutant")  # makes them all and runs none
            made, known = changes(folder, module), listed()
            chosen = sorted(mutant for mutant, change in made.items() if not survivors_only or change in known)
            if sample is not None:
                chosen = random.Random(head()).sample(chosen, min(sample, len(chosen)))
        said = mutmut(folder, *chosen)
        codes = {mutant: code for mutant, code in exit_codes(folder, module).items() if code is not None}
        if not codes:
            raise NothingRanError(f"{module}: no mutant ran; do its tests pass, and do they call it?\n{said[-500:]}")
        if left := set(chosen) - set(codes):  # a run that ended early has not shown that tests notice
            raise NothingRanError(f"{module}: {len(left)} mutants did not run\n{said[-500:]}")
        made = changes(folder, module)
    alive = [made[mutant] for mutant, code in codes.items() if code in ALIVE]
    now = os.times()
    seconds = sum(now[:4]) - sum(spent[:4])
    return Score(module, len(codes), len(codes) - len(alive), round(seconds, 1), of), alive


def head() -> str:
    """Hash of the commit: the seed of what `--check` chooses."""
    return subprocess.run(["git", "rev-parse", "HEAD"], cwd=ROOT, capture_output=True, text=True).stdout


def main() -> None:
    """Run what was asked for; exit with 1 on a module that cannot be run."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("modules", nargs="*", help="modules to mutate; by default the subjects that changed")
    parser.add_argument("--survivors", action="store_true", help="only mutants that survived last time")
    parser.add_argument("--check", type=int, metavar="N", help="run N mutants of one subject, write nothing")
    parser.add_argument("--table", action="store_true", help="only write the table, from the scores that are there")
    options = parser.parse_args()
    if unknown := [module for module in options.modules if module not in SUBJECTS]:
        raise SystemExit(f"{unknown[0]}: stands in SUBJECTS with no tests")
    if options.check:
        check(random.Random(head()).choice([m for m in SUBJECTS if m in stored()]), options.check)
        return
    before = stored()
    failed: list[str] = []
    stale = [m for m in SUBJECTS if m not in before or before[m].of != hash_of(m)]
    for module in [] if options.table else options.modules or stale:
        try:
            score, alive = run(module, None, options.survivors)
        except NothingRanError as error:
            failed.append(str(error))
            continue
        if options.survivors:  # what was killed is killed still, until a whole run says otherwise
            whole = before[module]
            score = Score(module, whole.mutants, whole.mutants - len(alive), whole.cpu_seconds, whole.of)
        write_survivors(module, alive)
        write_score(score)
        print(f"{module}: {score.killed} of {score.mutants} killed, {score.cpu_seconds:.0f} s", flush=True)
    write_table()
    raise SystemExit("\n".join(failed) or 0)


def check(module: str, count: int) -> None:
    """Run ``count`` mutants of a module; exit with 1 on a survivor that is not listed."""
    score, alive = run(module, count, False)
    new = [key for key in alive if key not in listed()]
    print(f"{module}: {score.mutants} mutants, {len(alive)} survived, {len(new)} of them not listed")
    print("\n".join(f"new survivor: {function}: {change}" for function, change in new))
    raise SystemExit(1 if new else 0)


def write_survivors(module: str, alive: list[tuple[str, str]]) -> None:
    """Write the survivors of a module in place of those of its last run; reasons stay."""
    known = listed()
    others = {key: why for key, why in known.items() if module_of(key[0]) != module}
    own = {key: known_by_form(key[1]) or known.get(key, "") for key in alive}
    with LISTED.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(COLUMNS)
        writer.writerows((*key, why) for key, why in sorted({**others, **own}.items()))


def known_by_form(change: str) -> str:
    """Reason of a survivor that its form alone tells: words of a sentence, another name of an encoding, a guard."""
    old, _, new = change.partition(" -> ")
    if "strict=True" in old and new in [
        old.replace("strict=True", weak) for weak in ("strict=False", "strict=None", "")
    ]:
        return STRICT
    if old == new or (old.lower() != new.lower() and old != new.replace("XX", "")):
        return ""
    if "utf-8" in old and "XX" not in new:
        return ENCODING
    if "einsum(" in old and "XX" not in new:
        return LETTERS
    start = next((i for i, (a, b) in enumerate(zip(old, new, strict=False)) if a != b), len(old))
    inside = old[:start].count("{") > old[:start].count("}")  # in a replacement field only its own literals are words
    quote = "'" if inside else '"'
    begin, end = old.rfind(quote, 0, start), old.find(quote, start)
    literal = old[begin + 1 : end] if 0 <= begin < end else ""
    if old[max(0, start - 1) : start] != quote and not literal:
        return ""
    return WORDS if " " in literal.strip() and quote not in literal else ""


def module_of(function: str) -> str:
    """Module of a function as it is listed: ``validation.metrics.x_apexes`` stands in validation/metrics.py."""
    path = function.rpartition(".x")[0].replace(".", "/")
    return f"{path}.py" if (ROOT / f"{path}.py").is_file() else f"{path}/__init__.py"


def write_score(score: Score) -> None:
    """Write one module's score beside the others."""
    before = stored()
    with SCORES.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(SCORE_COLUMNS)
        for row in sorted((before | {score.module: score}).values(), key=lambda s: s.module):
            writer.writerow((row.module, row.mutants, row.killed, row.cpu_seconds, row.of))


def write_table() -> None:
    """Write the table of the docs from scores and survivors."""
    scores, reasons = stored(), listed()
    lines = ["# Mutation score", "", "Written by `make mutants`, as are the survivors with their reasons in",
             "`survivors.csv`. *Open* are survivors without a reason; *stale* is a score of a module that has changed",
             "since, or whose tests have.", "",
             "| module | mutants | killed | listed with a reason | open | score | CPU s | |",
             "|---|---|---|---|---|---|---|---|"]  # fmt: skip
    for module in SUBJECTS:
        if (score := scores.get(module)) is None:
            lines.append(f"| {module} | not run yet | | | | | | |")
            continue
        own = [why for (function, _), why in reasons.items() if module_of(function) == module]
        stale = "" if score.of == hash_of(module) else "stale"
        lines.append(row(module, [score], sum(map(bool, own)), len(own) - sum(map(bool, own)), stale))
    ran = [scores[module] for module in SUBJECTS if module in scores]
    total = sum(bool(why) for why in reasons.values())
    lines += [row("**all of these**", ran, total, len(reasons) - total, ""), "", *left_out()]
    TABLE.write_text("\n".join(lines) + "\n", encoding="utf-8")


def row(name: str, scores: list[Score], with_reason: int, still_open: int, remark: str) -> str:
    """One line of the table."""
    mutants, killed = sum(s.mutants for s in scores), sum(s.killed for s in scores)
    share, seconds = 100.0 * killed / max(mutants, 1), sum(s.cpu_seconds for s in scores)
    return (
        f"| {name} | {mutants} | {killed} | {with_reason} | {still_open} | {share:.1f} % | {seconds:.0f} | {remark} |"
    )


def left_out() -> list[str]:
    """Modules of the three packages that no run mutates."""
    there = sorted(str(path.relative_to(ROOT)) for name in PACKAGES for path in (ROOT / name).rglob("*.py"))
    names = [name for name in there if name not in SUBJECTS]
    return [f"Not mutated, {len(names)} modules: {', '.join(names)}."]


if __name__ == "__main__":
    main()
