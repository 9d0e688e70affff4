"""Tables of how findings are told that take minutes, releases or a quiet machine to make: they are made up here."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest.mock import patch

import pandas as pd
from click.testing import CliRunner
from of_print import COLOURS, _flat, marks, numbered, on, screen
from of_results import printed, told
from telling import Sections

from adapters.conformance import self_test
from adapters.conformance.self_test import Caught
from reference_solver.verification.self_test import JUDGED, SIZES, Corruption, Trial
from reports import history as written
from reports import page, speed, starved, tables
from reports import releases as told_releases
from reports.command import accepting, benching, certifying, fuzzing, inspecting, main, piles, posing, releasing
from reports.palette import PAPER
from validation.bench import agreement
from validation.bench.piles import KINDS, Lap
from validation.catalogue import CATALOGUE
from validation.cells import Slot
from validation.findings import Family, Finding
from validation.judging.acceptance import Change as Proposed
from validation.judging.comparison import Change, Kind
from validation.judging.comparison import Family as Moved
from validation.questions import invariance
from validation.questions.detection import BlindSpot, Detected
from validation.records.store import Run
from validation.releases import history
from validation.releases.bisection import Found, Unchanged
from validation.releases.environments import Environment

#: Nothing is read: what would be is made up.
NO_STORE: Any = None
SLOT = Slot("stack", (("n", 2.0), ("mu", 0.1)), 3, "chipmunk", "tuned", 1 / 240, 7)


def said(arguments: list[str]) -> dict[str, str]:
    """What a command prints, and its status."""
    with patch.dict("os.environ", {"COLUMNS": "120", "NO_COLOR": "1", "TERM": "dumb"}):
        result = CliRunner().invoke(main, arguments)
    return {"status": str(result.exit_code)} | numbered(result.stdout, "out") | numbered(result.stderr, "err")


def sensitivity() -> Sections:
    """What checks see and what they are blind to, on the terminal."""
    entries = [
        {"name": "stack/creep", "e": "", "mu": "1 %", "g": "0.1 %"},
        {"name": "impact/apex", "e": "10 %", "mu": "", "g": ""},
        {"name": "receipt damping", "e": "", "mu": "", "g": ""},
    ]
    blind = [
        BlindSpot("incline", "angle", "g", 0.001, 0.05, ("speed", "drift"), 1 / 1920),
        BlindSpot("stack", "creep", "mass", 0.2, 0.3, ()),
    ]
    text = printed(lambda console: tables.sensitivity(entries, {"spin": ["inertia", "spin"]}, blind, console))
    with patch.object(inspecting, "detection", lambda *asked, **named: Detected([], blind)):
        own = {f"command{' as data' * bool(more)}": said(["list", "checks", "--sensitivity", *more])
               for more in ([], ["--json"])}  # fmt: skip
    return {"text": text, **own, "refused": said(["list", "scenes", "--sensitivity"])}


def clocked_piles() -> Sections:
    """What steps of piles cost: three sizes of which an exponent is fitted, and one that has none."""

    def laps(kind: str, most: int, seed: int) -> list[Lap]:
        sizes = [20 * 2**k for k in range(3) if 20 * 2**k <= most]
        costs = [1e-5 * (1.0 + seed) * (1.0 + 0.1 * k) for k in range(3)]
        return [Lap(kind, n, cost * n**1.5, cost * n) for n in sizes for cost in costs]

    found = Sections()
    with patch.object(piles, "laps", laps):
        for most, as_data in ((80, False), (20, False), (20, True)):
            console = screen(120)
            runner = CliRunner()
            with runner.isolation() as streams:
                piles.show_piles(console, as_data, most, len(KINDS))
                out = streams[0].getvalue().decode()
            title = f"up to {most}{', as data' * as_data}"
            found[title] = on(console, "shown") | numbered(out, "out")
    return found


def tried_faults() -> Sections:
    """The kit's test of itself, where every fault is caught and where one is not."""
    rows = [
        Caught("none: the healthy toy", "all", math.nan, "", True, "every check holds"),
        Caught("gravity", "free fall", 0.01, "of g", True, "falls too slowly"),
    ]
    missed = Caught("drag", "momentum", 0.25, "1/s", False, "ok")
    found = Sections()
    for name, told_of in (("caught", rows), ("missed", [*rows, missed])):
        for more in ([], ["--json"]):
            with patch.object(self_test, "self_test", lambda told_of=told_of: iter(told_of)):
                found[" ".join([name, *more])] = said(["check-adapter", "--self-test", *more])
    return found | {"neither": said(["check-adapter"]), "both": said(["check-adapter", "bullet", "--self-test"])}


def bisected() -> Sections:
    """Changes between two releases: the only one, one of several, nobody knows; and none at all."""
    versions = ["1.0", "1.1", "1.2", "2.0"]
    change = Change(
        next(iter(Kind)),
        True,
        "toy",
        "default",
        "stack",
        3,
        "n=2 mu=0.1",
        "creep",
        "pass",
        "fail",
        3.25,
        SLOT.as_dict(),
    )
    found = Sections()
    for name, others in {"unknown": None, "several": ((0, 1), (2, 3)), "only": ()}.items():
        what = Found(1, 3, (0, 3, 1), {2: "it cannot be imported"}, change, others)
        for out in ("crosscheck-out", "else where"):
            commands = releasing._commands("toy", "1.1", "2.0", SLOT, Path(out))
            plain = told_releases.found_as_plain(what, "toy", versions, commands)
            found[f"{name}, {out}"] = numbered(told_releases.found_as_text(plain), "out") | told(plain)
    for reason in ("", "release 0 has no answer", "release 3 has no answer"):
        for as_data in (False, True):
            found[f"unchanged: {reason}{', as data' * as_data}"] = _left(
                lambda reason=reason, as_data=as_data: releasing._say_unchanged(
                    Unchanged(reason), versions, "creep", "stack", as_data
                )
            )
    plain_slot = Slot("<toy>@abc", (), 2, "chipmunk", "default", 1 / 60)
    found["commands"] = told(releasing._commands("toy", "1", "2", plain_slot, Path("crosscheck-out")))
    return found


def _left(do: Callable[[], object]) -> dict[str, str]:
    """What is printed before a process is left, and with which status."""
    runner, status = CliRunner(), "stays"
    with runner.isolation() as streams:
        try:
            do()
        except SystemExit as end:
            status = str(end.code)
        return {"status": status} | numbered(streams[0].getvalue().decode(), "out")


def kept_environments() -> Sections:
    """Environments of releases: sound, spoilt, removed, none."""
    receipt: dict[str, Any] = {"python": "3.11.4", "packages": {"numpy": "2.0"}, "files": "abc"}
    found = Sections()
    for name, wrong in {"sound": "", "spoilt": "numpy is 1.0, not 2.0"}.items():
        own = [Environment(Path("/x/toy-1.0"), receipt), Environment(Path("/x/toy-2.0"), {})]
        with (
            patch.object(releasing.environments, "found", lambda own=own: list(own)),
            patch.object(releasing.environments, "size", lambda each: 3 * 2**20 + len(each.receipt) * 2**19),
            patch.object(releasing.environments, "check", lambda each, wrong=wrong: wrong if each.receipt else ""),
            patch.object(releasing.environments, "folder", lambda: Path("/x")),
            patch.object(releasing.environments, "remove", own.remove),
        ):
            for more in ([], ["--json"], ["--remove", "toy-9"], ["--remove", "toy-1.0"], ["--remove", "all"]):
                found[" ".join([name, *more])] = said(["releases", "--environments", *more])
        found[f"{name}, left"] = told([each.name for each in own])
    return found


def times() -> Sections:
    """Fits of which some sizes are lost, and two benches that agree, do not, and have nothing in common."""
    names = {"purpose": "bodies", "scene": "pyramid", "dimension": 2, "engine": "bullet", "profile": "tuned"}
    series = {"dt": 1 / 240, "iterations": 10, "params": {}}
    sizes = [{**names, **series, "x": x, "per_step": 1e-6 * x * x, "void": ""} for x in (40.0, 10.0, 20.0)]
    lost = [{**names, **series, "x": x, "per_step": math.nan, "void": f"too slow at {x:g}"} for x in (160.0, 80.0)]
    other = [{**row, "engine": "chipmunk"} for row in sizes]
    fits = [{**names, "engine": engine, "exponent": p, "standard_error": 0.02}
            for engine, p in (("bullet", 2.0), ("chipmunk", math.nan))]  # fmt: skip
    found = Sections()
    for title, rows in {"all ran": [*sizes, *other], "some are lost": [*sizes, *lost, *other]}.items():
        for each in (rows, rows[::-1]):
            table = speed.scaling_table(pd.DataFrame(each), pd.DataFrame(fits))
            found[f"{title} {each is rows}"] = printed(lambda console, table=table: console.print(table))

    first = pd.DataFrame(
        {**names, **series, "sampled": False, "params_text": f"n={k}", "ratio_1": 1.0 + k, "ratio_low_1": 0.9 + k,
         "ratio_high_1": 1.125 + k, "ratio_2": 1.25 + k, "ratio_low_2": 1.2 + k, "ratio_high_2": 1.4 + k,
         "agrees": k != 1} for k in range(20)
    )  # fmt: skip
    run = type("Run", (), {"id": "20260101-000000"})()
    for title, both in {"one of twenty": first, "one of three": first[:3], "nothing": first[:0]}.items():
        with (
            patch.object(agreement, "ratios", lambda store, run: None),
            patch.object(agreement, "agreement", lambda a, b, both=both: both),
        ):
            good = list[bool]()
            found[title] = printed(
                lambda console, good=good: good.append(benching._compare(NO_STORE, run, run, console)), 200
            ) | {"enough": str(good)}
    return found


def posed() -> Sections:
    """Which cells are posed otherwise, and what the command makes of answers that change."""
    slots = [Slot("stack", (("n", n),), 2, "chipmunk", profile, dt, iterations, ulp)
             for n, profile, dt, iterations, ulp in (
                 (3.0, "tuned", 1 / 240, None, 0), (2.0, "tuned", 1 / 240, None, 0), (2.0, "default", 1 / 240, 4, 0),
                 (2.0, "default", 1 / 60, None, 0), (2.0, "default", 1 / 240, None, 1),
                 (5.0, "default", 1 / 240, None, 0),
             )]  # fmt: skip
    found = Sections()
    for named in (False, True):
        found[f"named: {named}"] = told([slot.as_dict() for slot in posing.cells_of(slots, named)])
    ends = {"nothing": [invariance.Change("again")],
            "a break": [invariance.Change("again"), invariance.Change("mirrored", "drift", 1e-3, 1e-6)]}  # fmt: skip
    for title, changes in ends.items():
        for as_data in (False, True):
            runner = CliRunner()
            with (
                patch.object(posing, "compare", lambda slot, changes=changes: changes),
                patch.dict("os.environ", {**COLOURS, "COLUMNS": "120"}),
                runner.isolation(color=True) as streams,
            ):
                fine = posing.compare_and_show(slots[:2], as_data)
                out, err = (marks(stream.getvalue().decode()) for stream in streams[:2])
            told_of = numbered(out, "out") | numbered(err, "err")
            found[f"{title}{', as data' * as_data}"] = {"fine": str(fine)} | told_of
    return found


def doctor() -> Sections:
    """What is told of a machine where all is well, and of one where an engine broke and a foreign package lies."""
    engines = [
        {"name": "toy", "version": "1.2", "status": "installed", "reason": ""},
        {"name": "brittle", "version": "", "status": "broken", "reason": "ImportError: [no] such symbol"},
        {"name": "absent", "version": "", "status": "not installed", "reason": ""},
    ]
    sound: dict[str, Any] = {
        "machine": {"cpu": "a [fast] one", "cores": 4}, "commit": "abc123", "executable": "/x/python",
        "engines": engines[:1], "packages": {"adapters": "/x/adapters", "reports": "/y/[old]/reports"},
        "kernel_cache": {"folder": "/z/cache"}, "problems": [], "traces": {},
    }  # fmt: skip
    spoilt = sound | {
        "commit": "", "engines": engines, "kernel_cache": {"folder": None},
        "problems": ["brittle: it cannot be imported", "reports is not ours: /y/[old]/reports"],
        "traces": {"brittle": ["File one, line 3", "ImportError: [no] such symbol"]},
    }  # fmt: skip
    found = Sections()
    for name, data in {"sound": sound, "spoilt": spoilt}.items():
        found[name] = printed(lambda console, data=data: tables.health(data, console))
        for more in ([], ["--json"]):
            with patch.object(inspecting.listing, "doctor", lambda data=data: data):
                found[" ".join([name, *more])] = said(["doctor", *more])
    return found


def starved_stacks() -> Sections:
    """The picture of stacks that too few sweeps let sink: its tiles, and its specification in both schemes."""
    rows = [
        starved.Starved(10, 1, 9.0, 1.6, 1.0, False), starved.Starved(10, 20, 0.0077, 0.002, 0.15, True),
        starved.Starved(10, 40, 0.021, 0.002, 0.15, True), starved.Starved(5, 20, 0.5, 0.002, 0.15, True),
        starved.Starved(5, 40, 1e-3, 0.0, 0.0, True), starved.Starved(1, 100, 0.0, 0.0, 0.0, True),
    ]  # fmt: skip
    found = Sections(
        {"tiles": {f"{k}": json.dumps(each) for k, each in enumerate(starved.table(rows).to_dict("records"))}}
    )
    for scheme in PAPER:
        spec = starved.chart(rows, scheme)
        del spec["datasets"], spec["$schema"]
        found[scheme] = {path: value for path, value in _flat(spec, "") if not path.endswith(".data.name")}
    return found


def refusals() -> Sections:
    """What became of random scenes: certified, refused for this and that, different, without an answer; and of none."""

    def answer(seed: int, **more: Any) -> dict[str, Any]:
        sound = {"seed": seed, "dimension": 3, "certified": True, "conditions": {}, "bound": 1e-10 * 2**seed}
        return sound | {"off": 3e-11 * 3**seed, "defects": [], **more}

    many = [answer(seed, certified=False, conditions={"cone": 1e-7 * seed, "gap": 2.0}) for seed in range(20, 27)]
    groups = {
        "none": [],
        "all hold": [answer(seed) for seed in range(4)],
        "all refused": [*many, answer(9, certified=False, conditions={"energy": math.nan}, off=math.inf)],
        "of all kinds": [
            answer(1), answer(2, defects=[["mirrored", 0.25, 1.25e-5, 2e-12], ["moved", 0.5, 2e-5, 3e-12]]),
            *many[:2], {"seed": 7, "dimension": 3, "broken": "no answer after 900 s"},
        ],
    }  # fmt: skip
    found = Sections()
    for name, answers in groups.items():
        bad = list[int]()
        found[name] = printed(lambda console, own=answers, bad=bad: bad.append(fuzzing._tell(console, 3, own)))
        found[name]["defects"] = str(bad)
    return found


def corruptions() -> Sections:
    """Which planted corruptions of a run are seen at which size, where enough are and where too few."""
    law = Corruption("law", "friction", "block", lambda *given: given, "no check asks for it")
    motion = Corruption("motion", "a place", "ball", lambda *given: given)
    found = Sections()
    for name, missed in {"all": (), "the least": SIZES[-1:], "the judged": (JUDGED,), "every": SIZES}.items():
        made = [Trial(each, size, () if size in missed and each is law else ("gap", "cone"))
                for each in (law, motion) for size in SIZES]  # fmt: skip
        with patch.object(certifying, "trials", lambda made=made: iter(made)):
            for more in ([], ["--json"]):
                found[" ".join([name, *more])] = said(["certify", "--self-test", *more])
    return found


def accepted() -> Sections:
    """What is told of a family before its reason is asked for, and of rows that cannot be listed."""
    family = Family("f-1", ("default", "tuned"), "stack", ("creep",), "", "", ">=1")
    keys = [("default", "stack", "2", "", f"n={n}", "", f"creep[{n}]") for n in range(5)]
    keys += [("tuned", "stack", "3", "4", "", "", "drift")]
    values = {key: Finding(family, 0.1234567 * (k + 1), 1e-3) for k, key in enumerate(keys)}
    moved = {key: (own, replace(own, value=2.0 * (own.value or 0.0))) for key, own in values.items()}
    changes = {
        "new": Proposed(family, new=values), "drifted": Proposed(family, drifted=moved),
        "gone": Proposed(family, gone=values),
        "bands": Proposed(family, bands=moved), "all": Proposed(family, values, values, moved, values, moved),
        "same": Proposed(family, same=values),
    }  # fmt: skip
    return {name: numbered(accepting._details(change), "line") for name, change in changes.items()}


def said_of_runs() -> Sections:
    """What is said of rows that moved, how a page is cited and made again, and of times on a machine that was busy."""

    def step(*kinds: tuple[Kind, bool]) -> history.Step:
        changes = [
            Change(kind, worse, "toy", "default", "stack", 3, f"n={k}", "creep", "pass", "fail", 3.25, SLOT.as_dict())
            for k, (kind, worse) in enumerate(kinds)
        ]
        return history.Step("1.0", "1.1", Moved(tuple(changes)))

    every = [(kind, worse) for kind in (Kind.FLIP, Kind.OUTCOME, Kind.ERROR) for worse in (True, False)]
    moved = {f"{kind.value} {worse} {count}": written._moved([step(*[(kind, worse)] * count)])
             for kind, worse in every for count in (1, 2)}  # fmt: skip
    found = Sections({"moved": moved | {"all": written._moved([step(*every), step(*every[::-1])])}})
    bench = type("Bench", (), {"run": type("Run", (), {"title": "bench quick: impact --dim 2"})})
    scenes = " ".join(CATALOGUE)
    with patch.object(page, "package_version", lambda: "1.2.3"):
        for title in ("quick: impact bounce", f"full: {scenes} --dim 3 --engine bullet", "odd", f"standard: {scenes}"):
            for commit in ("", "abc123", "abc123+"):
                run = Run("20260101-000000", "2026-01-01T10:00:00", commit, {}, title, (), True)
                own = type(
                    "Source", (), {"run": run, "observations": [1, 2], "rows": [1], "bench": bench if commit else None}
                )
                told_of = page.cite(own)  # type: ignore[arg-type]  # only what it reads of a source
                found[f"{title[:30]}, {commit}"] = {"text": told_of["text"]} | numbered(told_of["commands"], "line")
    idle = pd.DataFrame(
        {"void": ["", "", "", "it hung"], "load": [1.0, 1.1, 1.2, 9.0], "width": [0.01, 0.04, 0.1, 1.0],
         "drifts": [False, True, False, True], "rounds": [5, 6, 7, 1]}
    )  # fmt: skip
    tables_of = {"idle": idle, "busy": idle.assign(load=[1.0, 1.3, 1.3, 1.0]), "none": idle[:0], "void": idle[3:]}
    found["busy"] = {name: speed.busy(table) for name, table in tables_of.items()}
    found["quality"] = {name: speed.quality_line(table) for name, table in tables_of.items()}
    found["key"] = {str(ranked): speed.key(ranked) for ranked in (True, False)}
    return found


MAKERS: dict[str, Callable[[], Sections]] = {
    "shown/sensitivity": sensitivity, "shown/piles": clocked_piles, "shown/self-test": tried_faults,
    "shown/bisected": bisected, "shown/environments": kept_environments, "shown/times": times, "shown/posed": posed,
    "shown/doctor": doctor, "shown/starved": starved_stacks, "shown/attacked": refusals,
    "shown/corruptions": corruptions, "shown/accepted": accepted, "shown/said": said_of_runs,
}  # fmt: skip
