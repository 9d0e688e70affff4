"""Makes the golden set of ``compare``: a real base run, and copies of it with one planted change each.

    python tests/data/make_golden.py

base.jsonl      rows of a few real cells with measured noise floors, and time ratios
flip.jsonl      the first apex of one bounce moved beyond its tolerance (a physics flip)
drift.jsonl     the same apex moved by a thousandth of its tolerance (a drift: beyond the floor, still a PASS)
slow.jsonl      one unit's time ratio doubled (a slow-down)
noise.jsonl     that apex moved by half its noise floor, that unit's ratio by one per cent (nothing to report)
"""

from __future__ import annotations

import copy
import json
import tempfile
from pathlib import Path

from adapters.registry import names
from reports.exports import load_rows
from validation.records.store import Store
from validation.running.plan import Request, slots
from validation.workers import run_cells

HERE = Path(__file__).parent
METRIC = "apex[1]"


def base() -> list[dict]:
    """Rows of the representative cells of the two exact scenes on two engines, moved by 1 and 2 ulp for the floor."""
    engines = [name for name in names() if name in ("chipmunk", "bullet")]
    chosen = []
    for scene, params in (("bounce", {"e": 0.8, "height": 1.0}), ("incline", {"ratio": 1.1})):
        chosen += slots(Request([scene], engines, ["tuned"], [2], params=params, ulps=(0, 1, 2)))
    with tempfile.TemporaryDirectory() as folder:
        store = Store(Path(folder))
        run, _ = store.start("golden", chosen)
        for observation in run_cells(chosen, jobs=1):
            store.add(run, observation)
        store.close()
        rows = [row.as_dict() for row in load_rows(folder)]
    for row in rows:
        row |= {"run": "golden", "wall_time_s": 0.0}
    timed = next(row["slot"] for row in rows if row["engine"] == "bullet" and row["scene"] == "bounce")
    unit = {"purpose": "work", "slot": timed, "opponent": "chipmunk/tuned"}
    return [*rows, {**unit, "ratio": 2.0, "ratio_low": 1.98, "ratio_high": 2.02}]


def apex(lines: list[dict]) -> dict:
    """The row that gets changed."""
    return next(line for line in lines if line.get("metric") == METRIC and line["engine"] == "chipmunk")


def moved(lines: list[dict], by: float, physics: str) -> list[dict]:
    """A copy in which the apex is ``by`` further from the truth."""
    out = copy.deepcopy(lines)
    row = apex(out)
    away = by if row["error"] >= 0.0 else -by
    row |= {"value": row["value"] + away, "error": row["error"] + away, "physics": physics}
    return out


def slower(lines: list[dict], factor: float) -> list[dict]:
    """A copy in which the timed unit takes ``factor`` times as long."""
    out = copy.deepcopy(lines)
    for line in out:
        if "ratio" in line:
            line |= {name: line[name] * factor for name in ("ratio", "ratio_low", "ratio_high")}
    return out


def main() -> None:
    """Write all files."""
    lines = base()
    row = apex(lines)
    files = {
        "base": lines,
        "flip": moved(lines, 2.0 * row["tolerance"], "fail"),
        "drift": moved(lines, 4e-2 * row["tolerance"], "pass"),
        "slow": slower(lines, 2.0),
        "noise": slower(moved(lines, 0.5 * row["floor"], "pass"), 1.01),
    }
    folder = HERE / "golden"
    folder.mkdir(exist_ok=True)
    for name, content in files.items():
        text = "".join(json.dumps(line, sort_keys=True) + "\n" for line in content)
        (folder / f"{name}.jsonl").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
