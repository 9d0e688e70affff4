"""A small store for the page: real cells of two engines, a scene that tries to inject, a bench with made-up times."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from rich.console import Console
from rich.table import Table

from adapters.trajectory import load_trajectory
from validation.bench.timing import Timing
from validation.cells import Observation, Outcome, Slot, prepare
from validation.files.distance import primary_of
from validation.records.store import Store
from validation.running.execution import execute
from validation.running.tracks import record, representatives

#: A name that a page must show and never run.
EVIL = "<script>window.hacked=1</script><img src=x onerror=window.hacked=2>"
SERIES = (("chipmunk", "default"), ("chipmunk", "tuned"), ("bullet", "default"), ("bullet", "tuned"))
DT = 1.0 / 240.0
SCENE_FILE = f"""
name = "{EVIL}"
dimension = 2
gravity = [0.0, -9.81]
duration = 0.2
bodies = [
  {{ name = "floor", shape = {{ type = "half_space", normal = [0.0, 1.0] }}, motion = "fixed" }},
  {{ name = "{EVIL}", shape = {{ type = "disc", radius = 0.5 }}, inertia = 0.125, pose = [0.0, 0.6, 0.0] }},
]
pairs = [{{ restitution = 0.5 }}]
"""


def _slots(file: str) -> list[Slot]:
    cells = [
        ("impact", {}), ("impact", {"e": 0.5}), ("impact", {"e": 0.0}), ("bounce", {}), ("stack", {"n": 2.0}),
        ("incline", {}), ("incline", {"ratio": 1.1}),
    ]  # fmt: skip
    planar = [Slot(scene, tuple(params.items()), 2, *who, DT) for scene, params in cells for who in SERIES]
    spatial = [Slot("impact", (), 3, *who, DT) for who in SERIES]
    swept = [Slot("stack", (("n", 2.0),), 2, *who, DT, n) for who in SERIES for n in (4, 30)]
    return [*planar, *spatial, *swept, Slot(file, (), 2, "chipmunk", "tuned", DT)]


def _run(store: Store, title: str, slots: list[Slot], folder: Path) -> None:
    run, _ = store.start(title, slots)
    shown = representatives(slots)
    for slot in slots:
        path = folder / f"{slot.key()}.npz" if slot in shown else None
        store.add(run, execute(slot, path))
        if path is not None and path.exists():
            made = prepare(slot)
            store.add_recording(run, slot, record(made.canonical, made.scene, load_trajectory(path)))
    crashed = Slot("impact", (("v", 1.0),), 2, "bullet", "tuned", DT)
    reason = f"RuntimeError: {EVIL}"
    store.add(run, replace(Observation(crashed, "c", 1, "3", Outcome.CRASHED, reason), log=EVIL))
    store.finish(run)


def _bench(store: Store) -> None:
    """Impacts at three steps in all phases; times that grow with the number of steps, in fixed proportions."""
    dts = (1.0 / 60.0, 1.0 / 240.0, 1.0 / 960.0)
    slots = [
        Slot("impact", tuple(params.items()), 2, *who, dt)
        for who in SERIES for dt in dts for params in primary_of("impact").variations(dt)
    ]  # fmt: skip
    run, _ = store.start("bench quick: impact", slots)
    for slot in slots:
        store.add(run, execute(slot))
    timings = []
    for k, (engine, profile) in enumerate(SERIES):
        for dt in dts:
            first = Slot("impact", tuple(primary_of("impact").variations(dt)[0].items()), 2, engine, profile, dt)
            timings += _timings("work", first, round(0.5 / dt), (k + 1) * 1e-5 / dt)
        for scene in ("empty", "flight"):
            timings += _timings("overhead", Slot(scene, (), 2, engine, profile, DT), 100, (k + 1) * 1e-4)
        for bodies in (10, 30, 100):
            pile = Slot("stack", (("n", float(bodies)),), 2, engine, profile, DT)
            timings += _timings("bodies", pile, 100, (k + 1) * 1e-4 * bodies, bodies)
    store.add_timings(run, timings)
    store.set_protocol(run, {"mode": "quick", "seed": 1, "clock": f"CPU time {EVIL}", "load_before": [0.1, 0.2]})
    store.finish(run)


def _timings(purpose: str, slot: Slot, steps: int, seconds: float, bodies: int = 1) -> list[Timing]:
    who = (slot, "c", "1", bodies, "chipmunk/tuned")
    return [
        Timing(purpose, *who, k, 0, 0, False, steps, seconds * (1 + 0.01 * k), seconds, "hash", 0.0) for k in range(5)
    ]


@pytest.fixture(scope="session", autouse=True)
def tables_are_whole(offences):
    """Whatever a command prints in a test: no row is longer or shorter than its table, and nothing prints nothing.

    rich gives a cell too many a column without a heading, leaves what lacks empty, and writes None as a word. A row of
    one cell heads those below it.
    """
    add_row, print_objects = Table.add_row, Console.print

    def whole(table, *cells, **options):
        if table.columns and len(cells) not in (1, len(table.columns)):
            offences.append(f"a row of {len(cells)} cells in a table of {len(table.columns)} columns: {cells}")
        if any(cell is None for cell in cells):
            offences.append(f"a row with nothing in a cell: {cells}")
        return add_row(table, *cells, **options)

    def something(console, *objects, **options):
        if any(each is None for each in objects):
            offences.append(f"nothing is printed: {objects}")
        return print_objects(console, *objects, **options)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Table, "add_row", whole)
        patch.setattr(Console, "print", something)
        yield


@pytest.fixture(scope="session")
def page_folder(tmp_path_factory) -> Path:
    """Folder with the store of a run and a bench."""
    folder = tmp_path_factory.mktemp("page")
    (folder / "scene.toml").write_text(SCENE_FILE)
    store = Store(folder)
    _run(store, "quick", _slots(str(folder / "scene.toml")), folder)
    _bench(store)
    store.close()
    return folder


@pytest.fixture(scope="session")
def page_source(page_folder):
    """What the page is made from."""
    from reports.page import load_source

    return load_source(page_folder)


@pytest.fixture(scope="session")
def page_made(page_source, tmp_path_factory) -> tuple[Path, list[dict]]:
    """The page, and the specifications of its charts as they were drawn."""
    from reports.page import charts, render

    path, specs = tmp_path_factory.mktemp("report") / "report.html", []
    draw = charts.vl_convert.vegalite_to_svg
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(charts.vl_convert, "vegalite_to_svg", lambda spec: (specs.append(spec), draw(spec))[1])
        path.write_text(render(page_source), encoding="utf-8")
    return path, specs


@pytest.fixture(scope="session")
def page_file(page_made) -> Path:
    """The page itself."""
    return page_made[0]
