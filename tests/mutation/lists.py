"""Scores and survivors as they are kept: score.csv, survivors.csv with the reasons, and the table score.md."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from pathlib import Path

import drawn
from subjects import PACKAGES, ROOT, SUBJECTS, hash_of

HERE = Path(__file__).resolve().parent
LISTED, SCORES, TABLE = HERE / "survivors.csv", HERE / "score.csv", HERE / "score.md"
COLUMNS = ("function", "change", "reason")
SCORE_COLUMNS = ("module", "mutants", "killed", "cpu_seconds", "of")
#: Reasons that the form of a change tells.
WORDS, ENCODING = "words of a sentence", "the same encoding by another name"
LETTERS = "the same sum by other letters"
STRICT = "a guard against slips of our own: both are of one length wherever it is called"
#: Reason of a mutant that ran out of CPU or wall time: its tests had not failed by then.
TIMED = "only a time limit ended it"
#: A mutant as it is listed: its function, and ``old -> new``.
Change = tuple[str, str]


@dataclass(frozen=True)
class Score:
    """What a run of one module found; ``of`` is the hash of the module and its tests."""

    module: str
    mutants: int
    killed: int
    cpu_seconds: float
    of: str


def listed() -> dict[Change, str]:
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


def is_current(module: str) -> bool:
    """Whether a module and its tests are as they were when it ran last."""
    return (score := stored().get(module)) is not None and score.of == hash_of(module)


def write_survivors(module: str, alive: list[Change], timed: list[Change]) -> None:
    """Write the survivors of a module in place of those of its last run; reasons stay."""
    known = listed()
    others = {key: why for key, why in known.items() if module_of(key[0]) != module}
    own = dict.fromkeys(timed, TIMED) | {key: known_by_form(key[1]) or reason_of(known, key) for key in alive}
    with LISTED.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(COLUMNS)
        writer.writerows((*key, why) for key, why in sorted({**others, **own}.items()))


def reason_of(known: dict[Change, str], key: Change) -> str:
    """The reason written by hand; what time ended before, and lives now, has none."""
    return "" if known.get(key) == TIMED else known.get(key, "")


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
             "since, or whose tests have. No number here is entered by hand.", "",
             "| module | mutants | killed | listed with a reason | open | score | CPU s | |",
             "|---|---|---|---|---|---|---|---|"]  # fmt: skip
    for module in SUBJECTS:
        if (score := scores.get(module)) is None:
            lines.append(f"| {module} | not run yet | | | | | | |")
            continue
        own = [why for (function, _), why in reasons.items() if module_of(function) == module and why != TIMED]
        stale = "" if is_current(module) else "stale"
        lines.append(row(module, [score], sum(map(bool, own)), len(own) - sum(map(bool, own)), stale))
    ran = [scores[module] for module in SUBJECTS if module in scores]
    total, still_open = sum(why not in ("", TIMED) for why in reasons.values()), list(reasons.values()).count("")
    lines += [row("**all of these**", ran, total, still_open, ""), "", *left_out(), *drawn.table(drawn.stored())]
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
