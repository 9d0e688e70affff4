"""Common format of words and numbers: marks, digits, the command that reproduces a row."""

from __future__ import annotations

import hashlib
import json
import re
import shlex
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from adapters.registry import facts
from adapters.settings import text_of
from validation.catalogue import CATALOGUE
from validation.cells import Slot, format_dt, parse_dt, slot_from_dict
from validation.files.stated import STATED
from validation.metrics import NEVER as NEVER
from validation.metrics import OUT_OF_PLANE
from validation.posed import is_file, resolve

if TYPE_CHECKING:
    import pandas as pd

#: Characters at which a spreadsheet starts a formula.
FORMULA = ("=", "+", "-", "@", "\t", "\r")
#: Largest number of names, as of scenes, in one line.
FEW = 4
#: What is judged of every file, by metric.
LAWS = {
    "energy_growth": "energy",
    "penetration": "overlaps",
    "momentum_drift": "momentum",
    OUT_OF_PLANE: "staying in plane",
}
#: Priority of marks of a group of rows: the first that occurs is its mark.
MARKS = (
    "crashed", "timed_out", "missing", "invalid", "refused", "new", "drifted", "fail", "known", "explained", "pass",
)  # fmt: skip
LABELS = {
    "crashed": "CRASHED",
    "timed_out": "TIMED OUT",
    "missing": "MISSING",
    "invalid": "INVALID",
    "refused": "REFUSED",
    "declined": "REFUSED",
    "diverged": "DIVERGED",
    "new": "FAIL, new",
    "drifted": "changed",
    "fail": "FAIL",
    "known": "FAIL, known",
    "explained": "FAIL, explained",
    "pass": "pass",
    "unsupported": "-",
    "not_installed": "NOT INSTALLED",
    "none": "no value",
}
#: Words for the number of checks with a mark: their regression status.
STATUS = {
    "crashed": "crashed", "timed_out": "timed out", "missing": "missing", "invalid": "INVALID", "refused": "REFUSED",
    "new": "new", "drifted": "changed", "fail": "without a list of known failures", "known": "known",
    "explained": "explained",
}  # fmt: skip


#: Name of a profile for people, by its role.
ROLE_WORDS: dict[str, str] = {
    "shipped": "as shipped", "tuned": "tuned", "one": "compromise", "textbook": "textbook", "solution": "exact",
    "matched": "custom loop",
}  # fmt: skip


def word_of(engine: str, profile: str) -> str:
    """Name of a profile for people, beside its own; empty if both are equal or it has no role."""
    known = facts(engine)
    word = ROLE_WORDS.get(known.roles.get(profile.partition("+")[0], "") if known else "", "")
    return "" if word == profile else word


def roles_line(columns: Iterable[tuple[str, str]]) -> str:
    """Roles of the profiles of ``(engine, profile)`` in one line, if their names do not say them; else empty."""
    named = {profile.partition("+")[0]: word for engine, profile in columns if (word := word_of(engine, profile))}
    return f"Profiles: {'; '.join(f'{name}: {word}' for name, word in named.items())}." if named else ""


def profiles_called(words: Iterable[str], engines: Iterable[str]) -> list[str]:
    """Profiles on engines by name or by role (``shipped``, ``as shipped``); an unknown word stays itself."""
    roles = [known.roles for engine in engines if (known := facts(engine))]
    found: dict[str, None] = {}
    for word in words:
        own = [
            name
            for each in roles
            for name, role in each.items()
            if name == word or (word not in each and word in (role, ROLE_WORDS.get(role)))
        ]
        found.update(dict.fromkeys(own or [word]))
    return list(found)


def mark_of(row: Mapping[str, Any]) -> str:
    """One word for a row: its outcome if it has no physics, else pass, or a FAIL's standing.

    A scene that an exact profile refuses is *refused*, an alarm, in the standard suite, and *declined* elsewhere.
    """
    if row["outcome"] in ("crashed", "timed_out", "missing", "invalid", "not_installed"):
        return str(row["outcome"])
    if row["outcome"] == "refused":
        return "refused" if row["standing"] == "new" else "declined"
    if row["outcome"] == "unsupported":
        return "new" if row["standing"] == "new" else "unsupported"
    if row["standing"] in ("drifted", "new"):  # also without a value, or if a PASS left its band
        return str(row["standing"])
    if row["physics"] == "pass":
        return "pass"
    if row["physics"] == "fail":
        return str(row["standing"] or "fail")
    return "none"


def reproduce(slot: Mapping[str, Any]) -> str:
    """Command that runs exactly this slot."""
    words = ["crosscheck", "run", slot["scene"]]
    first = resolve(slot["scene"]).parameters[:1]
    # A parameter selects one case instead of the suite's variations, so one is always given.
    for name, value in (slot["params"] or {p.name: p.default for p in first}).items():
        words += ["--param", f"{name}={value:.17g}" if float(f"{value:.12g}") != value else f"{name}={value:.12g}"]
    words += ["--dim", str(slot["dimension"]), "--engine", slot["engine"], *profile_words(slot_from_dict(slot))]
    words += ["--dt", format_dt(parse_dt(str(slot["dt"])))]
    if slot["iterations"] is not None:
        words += ["--iterations", str(slot["iterations"])]
    return shlex.join(words)


def at(out: Path | None, run: str = "") -> str:
    """`` RUN --out DIR`` for a command about the same results; empty for the latest in the usual folder."""
    named = f" {run}" if run else ""
    return named + ("" if out is None or out == Path("crosscheck-out") else f" --out {shlex.quote(str(out))}")


def profile_words(slot: Slot) -> list[str]:
    """Options that select the profile of a slot, with the settings that replace its own."""
    sets = [word for name, value in slot.switched for word in ("--set", f"{name}={text_of(value)}")]
    return ["--profile", slot.base, *sets]


def row_id(row: Mapping[str, Any]) -> str:
    """Eight hex digits by which ``crosscheck explain`` finds a row: equal in all runs with the same case."""
    asked = json.dumps([row["slot"], row["metric"]], sort_keys=True)
    return hashlib.sha256(asked.encode()).hexdigest()[:8]


def quantity(value: float | None, unit: str, digits: int = 4) -> str:
    """A number with its unit; a ratio has none."""
    return amount(number(value, digits), "" if value is None else unit)


def amount(text: str, unit: str) -> str:
    """A number as text with its unit: ``2 weights``, ``1 weight``; a ratio (unit 1 or none) has none."""
    if unit in ("", "1"):
        return text
    one = text == "1" and unit.isalpha() and len(unit) > 1
    return f"{text} {unit.removesuffix('s') if one else unit}"


def measured(row: Mapping[str, Any], digits: int = 4) -> str:
    """Measured value with its unit; a time beyond the end of the run is "never".

    A value that fails and prints as its truth is the truth and its error: ``1.751 + 3.1e-9 rad/s``.
    """
    if row["reason"].startswith(NEVER):
        return NEVER
    truth = number(row.get("truth"), digits)
    if row.get("physics") == "fail" and row.get("error") and number(row["value"], digits) == truth:
        return f"{truth} {'-' if row['error'] < 0 else '+'} {quantity(abs(row['error']), row['unit'], 2)}"
    return quantity(row["value"], row["unit"], digits)


def missing_text(missing: int, planned: int) -> str:
    """Text for a run with missing cases."""
    return (
        f"{missing} of {planned} planned cases have no result and are left out here. The command that started the "
        "run resumes it."
    )


def number(value: float | None, digits: int = 4) -> str:
    """Sensible digits: plain between 1e-3 and 1e5, else with an exponent."""
    if value is None:
        return "-"
    if value == 0.0:
        return "0"
    if 1e-3 <= abs(value) < 1e5:
        text = f"{value:.{digits}g}"
        return f"{float(text):g}" if "e" in text else text  # 5500, not 5.5e+03
    return f"{value:.{max(1, digits - 2)}e}".replace("e-0", "e-").replace("e+0", "e+")


def cell(value: Any) -> Any:
    """Value for a table that a spreadsheet may open: text that looks like a formula is quoted."""
    return f"'{value}" if isinstance(value, str) and value[:1] in FORMULA and not _is_number(value) else value


def csv_of(table: pd.DataFrame) -> str:
    """A table as CSV; text that looks like a formula is quoted, headings as well."""
    return str(table.map(cell).rename(columns=cell).to_csv(index=False, lineterminator="\n"))


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return text == "-"
    return True


#: What has a meaning in Markdown: HTML, table cells, code, emphasis, links and images, names of people, addresses.
_LIVE = re.compile(r"[&<>|\\`*~\[]|(?<!\w)_|_(?!\w)|(?<!\w)@|@(?=[\w-]+\.)|(?<=:)/(?=/)|(?<=\bwww)\.")
_HARMLESS = {"&": "&amp;", "<": "&lt;", ">": "&gt;", "@": "@&#8203;"}


def markdown(text: str) -> str:
    """Text escaped for Markdown, so that it is shown as it is."""
    return _LIVE.sub(lambda found: _HARMLESS.get(found[0], f"\\{found[0]}"), text)


def params_text(params: Mapping[str, float]) -> str:
    """``e=0.8 height=1.03``."""
    return " ".join(f"{name}={value:g}" for name, value in params.items())


def called(scenes: Iterable[str]) -> dict[str, str]:
    """Names of scenes in tables: a file of the user by its stem, if no other of these scenes is called that."""
    names = dict.fromkeys(scenes)
    stems = {name: Path(name.rpartition("@")[0]).stem if is_file(name) else name for name in names}
    counts = Counter([*stems.values(), *(stem for stem in CATALOGUE if stem not in names)])
    return {name: stem if counts[stem] == 1 else name for name, stem in stems.items()}


def unstated(rows: Iterable[Mapping[str, Any]]) -> str:
    """What alone is judged of the files of a run that state no check of their own; empty if each states one."""
    judged = [row for row in rows if is_file(row["scene"]) and row["physics"] is not None]
    own = {row["scene"] for row in judged if row["source"] == STATED}
    bare = [row for row in judged if row["scene"] not in own]
    laws = sorted({LAWS.get(row["metric"], row["metric"]) for row in bare})
    names = joined(dict.fromkeys(called({row["scene"] for row in bare}).values()))
    return f"Only {joined(laws)} are judged of {names}: no check of its own is stated" if bare else ""


def first_of(names: Sequence[str]) -> str:
    """The names, or the first few of many: ``a, b, c, d and 7 more``."""
    return ", ".join(names) if len(names) <= FEW else f"{', '.join(names[:FEW])} and {len(names) - FEW} more"


def joined(words: Iterable[str], last: str = "and") -> str:
    """``a, b and c``."""
    words = list(words)
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} {last} {words[-1]}" if words else "none"


def plural(count: int, noun: str) -> str:
    """``1 run``, ``2 runs``, ``2 families``."""
    if count == 1:
        return f"1 {noun}"
    return f"{count} {noun.removesuffix('y')}ies" if noun.endswith("ly") else f"{count} {noun}s"


def setting_text(value: Any) -> str:
    """A setting's value as text."""
    if isinstance(value, bool) or value is None:
        return str(value)
    if isinstance(value, list | tuple):
        return " ".join(setting_text(item) for item in value)
    return f"{value:.6g}" if isinstance(value, float) else str(value)
