"""A results folder that is always the same: runs and a bench, as one text that is kept.

    python tests/tables/kept_run.py

runs the cells anew on the installed engines and writes ``run/store.jsonl``. What an engine finds then stands there and
changes by no release; judged it is anew wherever it is read. Times and ends that no run has at will are made up.
"""

from __future__ import annotations

import json
import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from validation.bench.timing import Timing
from validation.cells import Observation, Outcome, Slot, observation_from_dict
from validation.files.distance import primary_of
from validation.posed import is_file, pinned, remember, texts_of
from validation.records.store import Store
from validation.running.execution import execute

FILE = Path(__file__).parent / "run" / "store.jsonl"
DT = 1 / 240
MACHINE = {"system": "a machine", "cpu": "one that is not there", "cores": 2, "memory_gib": 4, "python": "3.11"}
SERIES = (
    ("reference", "reference"), ("reference", "classical"), ("chipmunk", "default"), ("chipmunk", "tuned"),
    ("bullet", "default"), ("bullet", "tuned"), ("mujoco", "default"), ("mujoco", "tuned"),
)  # fmt: skip
CELLS: tuple[tuple[str, dict[str, float], int], ...] = (
    ("impact", {}, 2), ("impact", {"e": 0.5}, 2), ("impact", {"e": 0.0}, 2), ("impact", {}, 3), ("bounce", {}, 2),
    ("bounce", {"e": 0.5}, 2), ("stack", {"n": 2.0}, 2), ("stack", {"n": 5.0}, 2), ("incline", {}, 2),
    ("incline", {"ratio": 1.1}, 2), ("slide", {}, 2), ("thin_wall", {}, 2), ("pinch", {}, 2), ("rod_gas", {}, 2),
    ("restitution_above_one", {}, 2), ("tumble", {}, 3),
)  # fmt: skip
#: A scene of somebody's own, with a name that must not steer what shows it.
SCENE_FILE = """
name = "<b>[red] drop"
dimension = 2
gravity = [0.0, -9.81]
duration = 0.2
bodies = [
  { name = "floor", shape = { type = "half_space", normal = [0.0, 1.0] }, motion = "fixed" },
  { name = "ball", shape = { type = "disc", radius = 0.5 }, pose = [0.0, 0.6, 0.0] },
]
pairs = [{ restitution = 0.5 }]
[[checks]]
quantity = "ball.y"
value = 0.5
tolerance = 0.01
because = "it lies there"
"""


# ---- reading ---------------------------------------------------------------------------------------------------------


def fill(folder: Path) -> None:
    """Write the store that is kept into a folder."""
    kept = [json.loads(line) for line in FILE.read_text(encoding="utf-8").splitlines()]
    texts = {line["text"]: line["body"] for line in kept if "text" in line}
    store = Store(folder)
    try:
        for line in kept:
            if "run" in line:
                _put(store, line, texts)
    finally:
        store.close()


def _put(store: Store, line: Mapping[str, Any], texts: Mapping[str, Any]) -> None:
    found = [observation_from_dict(_whole(body, texts)) for body in line["observations"]]
    plan = [observation.slot.key() for observation in found] + line["lost"]
    told = (line["run"], line["date"], "c0ffee", json.dumps(MACHINE), line["title"], json.dumps(plan), "", 1)
    scenes = [(line["run"], name, text) for name, text in line["scenes"].items()]
    with store.writing() as database:
        database.execute("INSERT INTO runs VALUES (?, ?, ?, ?, ?, ?, ?, ?)", told)
        database.executemany("INSERT INTO scenes VALUES (?, ?, ?)", scenes)
    remember(line["scenes"])
    run = store.run(line["run"])
    for observation in found:
        store.add(run, observation)
    if line["protocol"]:
        store.add_timings(run, timings())
        store.set_protocol(run, line["protocol"])


def _whole(body: Mapping[str, Any], texts: Mapping[str, Any]) -> dict[str, Any]:
    """An observation with what is kept once for all that share it."""
    return {name: texts[value[1:]] if isinstance(value, str) and value[:1] == "@" else value
            for name, value in body.items()}  # fmt: skip


# ---- making ----------------------------------------------------------------------------------------------------------


def slots() -> list[Slot]:
    """Cells of the run."""
    asked = [Slot(scene, tuple(params.items()), d, *who, DT) for scene, params, d in CELLS for who in SERIES]
    swept = [Slot("stack", (("n", 5.0),), 2, *who, DT, n) for who in SERIES[2:] for n in (4, 30)]
    steps = [Slot("slide", (), 2, *who, dt) for who in SERIES[3:] for dt in (1 / 60, 1 / 960)]
    moved = [Slot("bounce", (), 2, *who, DT, ulp=k) for who in SERIES[2:] for k in (1, 2)]
    return [*asked, *swept, *steps, *moved]


def ended_badly() -> Iterator[Observation]:
    """Ends that no healthy engine has at will."""
    ends = (
        (Outcome.CRASHED, "RuntimeError: no world today", "its last words\nand more"),
        (Outcome.TIMED_OUT, "more than 300 s", ""),
        (Outcome.DIVERGED, "a body is faster than 1000 times what the scene explains", ""),
        (Outcome.NOT_INSTALLED, "no module named pybullet", ""),
    )
    for k, (outcome, reason, log) in enumerate(ends):
        slot = Slot("impact", (("v", 1.0 + k),), 2, *SERIES[4 + k], DT)
        yield replace(Observation(slot, "c", 1, "1.0", outcome, reason), log=log)


def line_of(
    name: str, date: str, title: str, found: list[Observation], texts: dict[str, Any], **more: Any
) -> dict[str, Any]:
    """One run as it is kept; what many observations share is put into ``texts``."""
    bodies = []
    for observation in found:
        body = json.loads(json.dumps(observation.as_dict(), default=str))
        # A file's path is another one each time, and so is the key of its cell.
        cell = "0" * 8 if is_file(observation.slot.scene) else observation.slot.key()[:8]
        body |= {"wall_time_s": 0.5, "cell": cell}
        for field in ("settings", "receipts", "readback", "certificate"):
            text = json.dumps(body[field], sort_keys=True)
            if len(text) > 40:
                key = next((key for key, known in texts.items() if known == body[field]), f"{field}{len(texts)}")
                texts[key] = body[field]
                body[field] = f"@{key}"
        bodies.append(body)
    scenes = texts_of(observation.slot.scene for observation in found)
    empty: dict[str, Any] = {"lost": [], "protocol": {}}
    return {"run": name, "date": date, "title": title, "scenes": scenes, "observations": bodies} | empty | more


def timings() -> list[Timing]:
    """Made-up times, in proportion to steps and bodies; some tie, some drift, one is void."""
    found = []
    for k, who in enumerate(SERIES):
        for dt in (1 / 60, 1 / 240, 1 / 960):
            first = Slot("impact", tuple(primary_of("impact").variations(dt)[0].items()), 2, *who, dt)
            found += _rounds("work", first, round(0.5 / dt), (1 + k // 2) * 1e-5 / dt, 1, "busy" if k == 7 else "")
        for scene in ("empty", "free"):
            found += _rounds("overhead", Slot(scene, (), 2, *who, DT), 100, (k + 1) * 1e-4, 1)
        for bodies in (10, 30, 100):
            pile = Slot("stack", (("n", float(bodies)),), 2, *who, DT)
            found += _rounds("bodies", pile, 100, (k + 1) * 1e-4 * bodies, bodies)
        for count in (4, 30):
            swept = Slot("stack", (("n", 5.0),), 2, *who, DT, count)
            found += _rounds("iterations", swept, 100, (k + 1) * 1e-5 * count, 5)
    return found


def _rounds(purpose: Any, slot: Slot, steps: int, seconds: float, bodies: int, void: str = "") -> list[Timing]:
    who = (slot, "c", "1.0", bodies, "chipmunk/tuned")
    return [
        Timing(purpose, *who, k, 0, k % 2, sampled, steps, seconds * (1.0 + 0.02 * k + 0.1 * sampled), seconds, "hash",
               1e-3, void if k == 2 else "")
        for k in range(5) for sampled in (False, True)
    ]  # fmt: skip


def main() -> None:
    """Run, and write what was found."""
    texts: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "drop.toml").write_text(SCENE_FILE, encoding="utf-8")
        own = pinned(str(folder / "drop.toml"))
        found = [execute(slot) for slot in [*slots(), Slot(own, (), 2, "chipmunk", "tuned", DT)]]
        benched = [
            execute(Slot("impact", tuple(params.items()), 2, *who, dt))
            for who in SERIES for dt in (1 / 60, 1 / 240) for params in primary_of("impact").variations(dt)[:3]
        ]  # fmt: skip
    before = [replace(each, engine_version="0.9") for each in found if each.slot.scene in ("impact", "bounce", "slide")]
    before = [_moved(each, k) for k, each in enumerate(before) if not each.slot.ulp]
    lines = [
        line_of("20260101-000000", "2026-01-01T00:00:00+00:00", "quick", before, texts),
        line_of("20260102-000000", "2026-01-02T00:00:00+00:00", "bench quick: impact", benched, texts,
                protocol={"mode": "quick", "seed": 1, "clock": "CPU time", "load_before": [0.1, 0.2]}),
        line_of("20260103-000000", "2026-01-03T00:00:00+00:00", "quick", [*found, *ended_badly()], texts,
                lost=["0123456789abcdef"]),
        *(line_of(f"2026010{4 + k}-000000", f"2026-01-0{4 + k}T00:00:00+00:00", f"release mujoco=={version}: impact",
                  [_moved(replace(each, engine_version=version), m if k else 1) for m, each in enumerate(found)
                   if each.slot.engine == "mujoco" and each.slot.scene in ("impact", "slide")], texts)
          for k, version in enumerate(("3.2.7", "3.12.0"))),
    ]  # fmt: skip
    kept = [{"text": key, "body": body} for key, body in texts.items()] + lines
    FILE.parent.mkdir(exist_ok=True)
    said = "\n".join(json.dumps(line, sort_keys=True) for line in kept).replace(name, "/there")
    FILE.write_text(said + "\n", encoding="utf-8")


def _moved(found: Observation, k: int) -> Observation:
    """The same observation of another version: every third one with other values, every seventh one refused."""
    if k % 7 == 6:
        return replace(found, outcome=Outcome.UNSUPPORTED, reason="not in this version", metrics={})
    if k % 3:
        return found
    share = (1.0 + 1e-6, 1.01, 2.0)[k // 3 % 3]
    told = {name: (None if value is None else value * share, why) for name, (value, why) in found.metrics.items()}
    return replace(found, metrics=told, state_hash="0123456789abcdef")


if __name__ == "__main__":
    main()
