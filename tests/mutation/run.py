"""Mutation run: mutmut changes one expression at a time, and the tests of that module must notice.

    copy of the checkout -> mutmut on one module with its tests -> killed / survived -> survivors.csv, score.md

``python tests/mutation/run.py`` runs every module of `SUBJECTS`, writes the score and lists survivors; ``--check N``
runs N mutants of the first subject, chosen by the commit, and fails on a survivor that is not listed. A survivor is
listed by its function and its change, so that an edit elsewhere does not make it new; its reason is written by hand.
"""

from __future__ import annotations

import argparse
import csv
import json
import random
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
HERE = Path(__file__).resolve().parent
LISTED, SCORE = HERE / "survivors.csv", HERE / "score.md"
COLUMNS = ("function", "change", "reason")
#: Module -> the tests that must notice; what stands under no other name is tested by all of `ALL`.
SUBJECTS = {
    "validation/verdicts.py": ("tests/validation/test_verdicts.py", "tests/validation/test_findings.py",
                               "tests/validation/test_acceptance.py"),
    "validation/acceptance.py": ("tests/validation/test_acceptance.py",),
    "validation/findings/__init__.py": ("tests/validation/test_findings.py", "tests/validation/test_acceptance.py"),
    "validation/findings/files.py": ("tests/validation/test_findings.py",),
    "reports/wording.py": ("tests/reports/test_what_is_shown.py", "tests/reports/test_summary.py"),
    "reports/exports.py": ("tests/reports/test_what_is_shown.py", "tests/reports/test_command.py"),
}  # fmt: skip
ALL = ("tests/validation", "tests/adapters", "tests/reports")
CONFIG = """
[tool.mutmut]
source_paths = ["validation", "adapters", "reports"]
only_mutate = [{module!r}]
also_copy = ["reference_solver", "README.md", "CHANGELOG.md", "CONTRIBUTING.md", "ARCHITECTURE.md", "CITATION.cff",
             "Makefile", ".ci"]
pytest_add_cli_args = ["-p", "no:randomly", "-p", "no:xdist", "-p", "no:cacheprovider", "-q", "-x"]
pytest_add_cli_args_test_selection = {tests}
"""
SURVIVED, UNTESTED = 0, 33


def copy_of_the_checkout(folder: Path, module: str, tests: tuple[str, ...]) -> None:
    """Everything that is tracked, and the configuration of one run."""
    names = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, check=True).stdout
    for name in filter(None, names.decode().split("\0")):
        if not name.startswith("reports/published/") and (ROOT / name).is_file():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, folder / name)
    with (folder / "pyproject.toml").open("a", encoding="utf-8") as stream:
        stream.write(CONFIG.format(module=module, tests=json.dumps(tests)))


def mutmut(folder: Path, *arguments: str) -> str:
    """Run mutmut in the copy; its output."""
    command = [sys.executable, "-m", "mutmut", *arguments]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True).stdout


def verdicts(folder: Path, module: str) -> dict[str, int]:
    """Exit code of the tests for every mutant that ran."""
    data = json.loads((folder / "mutants" / f"{module}.meta").read_text(encoding="utf-8"))
    return {name: code for name, code in data["exit_code_by_key"].items() if code is not None}


def change_of(folder: Path, mutant: str) -> tuple[str, str]:
    """Function of a mutant, and its change as ``old -> new``."""
    diff = mutmut(folder, "show", mutant).splitlines()
    old = [line[1:].strip() for line in diff if line.startswith("-") and not line.startswith("---")]
    new = [line[1:].strip() for line in diff if line.startswith("+") and not line.startswith("+++")]
    return mutant.partition("__mutmut_")[0], f"{' '.join(old)} -> {' '.join(new)}"


def listed() -> dict[tuple[str, str], str]:
    """Known survivors with their reasons."""
    if not LISTED.exists():
        return {}
    with LISTED.open(newline="", encoding="utf-8") as stream:
        return {(row["function"], row["change"]): row["reason"] for row in csv.DictReader(stream)}


def run(module: str, tests: tuple[str, ...], sample: int | None) -> tuple[int, dict[tuple[str, str], str]]:
    """Number of mutants that ran, and the survivors with their reasons ("" for a new one)."""
    with tempfile.TemporaryDirectory(prefix="crosscheck-mutants-") as name:
        folder = Path(name)
        copy_of_the_checkout(folder, module, tests)
        chosen = []
        if sample is not None:
            mutmut(folder, "run", "--max-children", "1", "no.such.mutant")  # makes them all and runs none
            made = json.loads((folder / "mutants" / f"{module}.meta").read_text())["exit_code_by_key"]
            head = subprocess.run(["git", "rev-parse", "HEAD"], cwd=ROOT, capture_output=True, text=True).stdout
            chosen = random.Random(head).sample(sorted(made), min(sample, len(made)))
        mutmut(folder, "run", *chosen)
        codes = verdicts(folder, module)
        if not codes:
            raise SystemExit(f"{module}: no mutant ran; do its tests pass?")
        known = listed()
        keys = [change_of(folder, mutant) for mutant, code in codes.items() if code in (SURVIVED, UNTESTED)]
        return len(codes), {key: known.get(key, "") for key in keys}


def main() -> None:
    """Run what was asked for; exit with 1 on a survivor that is not listed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("modules", nargs="*", help="modules to mutate; all subjects by default")
    parser.add_argument("--check", type=int, metavar="N", help="run N mutants of the first subject, write nothing")
    options = parser.parse_args()
    if options.check:
        module = next(iter(SUBJECTS))
        count, survivors = run(module, SUBJECTS[module], options.check)
        new = [key for key in survivors if key not in listed()]
        print(f"{module}: {count} mutants, {len(survivors)} survived, {len(new)} of them not listed")
        print("\n".join(f"new survivor: {function}: {change}" for function, change in new))
        raise SystemExit(1 if new else 0)
    scores, every = [], {}
    for module in options.modules or SUBJECTS:
        count, survivors = run(module, SUBJECTS.get(module, ALL), None)
        every |= survivors
        scores.append((module, count, count - len(survivors)))
        print(f"{module}: {count - len(survivors)} of {count} killed", flush=True)
    write(scores, every, keep=bool(options.modules))


def write(scores: list[tuple[str, int, int]], survivors: dict[tuple[str, str], str], keep: bool) -> None:
    """Write the list of survivors and the table of scores; ``keep`` those of modules that did not run."""
    ran = {module.removesuffix(".py").removesuffix("/__init__").replace("/", ".") for module, _, _ in scores}
    others = {key: why for key, why in listed().items() if keep and not any(key[0].startswith(f"{m}.x") for m in ran)}
    with LISTED.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(COLUMNS)
        writer.writerows((*key, why) for key, why in sorted({**others, **survivors}.items()))
    lines = ["# Mutation score", "", "Written by `make mutants`; survivors and their reasons: `survivors.csv`.", ""]
    lines += ["| module | mutants | killed | score |", "|---|---|---|---|"]
    lines += [f"| {module} | {count} | {killed} | {100.0 * killed / count:.0f} % |" for module, count, killed in scores]
    SCORE.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
