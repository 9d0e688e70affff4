"""Tables of what is refused, each in the one line that a user reads, and of what is said of a file beside that.

A refusal names the field, says what stands there, and what may. Nothing is run.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from unittest.mock import patch

from click.testing import CliRunner
from telling import Sections

from adapters import foreign
from adapters.engine import EngineError, EngineFacts, Setting
from adapters.scene import (
    Body,
    Box,
    Capsule,
    Cylinder,
    Disc,
    HalfSpace,
    Hull,
    Pair,
    Polygon,
    Scene,
    SceneError,
    Sphere,
)
from reports.command import main
from reports.scripts import written
from validation.cells import Slot, check_size, parse_dt, slot_from_dict
from validation.files.scene_files import canonical_from_file
from validation.posed import primary_of
from validation.records.store import Store, StoreError
from validation.releases.choosing import chosen


def refusal(do: Callable[[], object], folder: str = "") -> str:
    """What is said where something is refused; what was made where it is not."""
    try:
        made = do()
    except (SceneError, EngineError, StoreError) as error:
        return f"{type(error).__name__}: {error}".replace(folder or "\0", "FOLDER")
    return f"made: {type(made).__name__}"


def told(asked: Mapping[str, Callable[[], object]], folder: str = "") -> dict[str, str]:
    """Each of these by its title."""
    return {title: refusal(do, folder) for title, do in asked.items()}


# ---- scenes ----------------------------------------------------------------------------------------------------------

FLAT = Scene(
    "flat",
    1,
    2,
    (Body("floor", HalfSpace((0.0, 1.0)), motion="fixed"), Body("ball", Disc(0.5), 2.0, 0.25)),
    (Pair(restitution=0.5),),
    (0.0, -9.81),
    1.0,
)
FLOOR, BALL = FLAT.bodies
ROUND = Scene("round", 1, 3, (Body("ball", Sphere(0.5), 2.0, (0.2, 0.2, 0.2)),), (), (0.0, 0.0, -9.81), 1.0)
SQUARE = ((0.5, 0.5), (-0.5, 0.5), (-0.5, -0.5), (0.5, -0.5))
CORNERS = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (-1.0, -1.0, -1.0))
NAN, INF = float("nan"), float("inf")


def balls(**changed: Any) -> Callable[[], Scene]:
    """The flat scene with its ball changed."""
    return lambda: replace(FLAT, bodies=(FLOOR, replace(BALL, **changed)))


def floors(**changed: Any) -> Callable[[], Scene]:
    """The flat scene with its floor changed."""
    return lambda: replace(FLAT, bodies=(replace(FLOOR, **changed), BALL))


def spatial(**changed: Any) -> Callable[[], Scene]:
    """The spatial scene with its ball changed."""
    return lambda: replace(ROUND, bodies=(replace(ROUND.bodies[0], **changed),))


def of_scenes() -> Sections:
    """Scenes with one thing wrong: sizes, names, motions, vectors, materials."""
    whole: dict[str, dict[str, Any]] = {
        "no time": {"duration": 0.0},
        "time without end": {"duration": INF},
        "gravity of three": {"gravity": (0.0,) * 3},
        "gravity is nothing": {"gravity": (0.0, NAN)},
        "no bodies": {"bodies": ()},
        "twice the same name": {"bodies": (FLOOR, BALL, BALL)},
        "a name that is nobody's": {"pairs": (Pair("ball", "wall"),)},
        "friction below 0": {"pairs": (Pair(friction=-0.1),)},
        "friction without end": {"pairs": (Pair(friction=INF),)},
        "restitution above 1": {"pairs": (Pair(restitution=1.5),)},
        "restitution below 0": {"pairs": (Pair(restitution=-0.5),)},
        "two materials of one pair": {"pairs": (Pair("ball", "*"), Pair("*", "floor", 0.5))},
    }
    names = {"empty": "", "star": "*", "steers": "a\x1bb", "long": "x" * 200, "number": 3}
    own: dict[str, Callable[[], Scene]] = {
        title: (lambda changed=changed: replace(FLAT, **changed)) for title, changed in whole.items()
    }
    own |= {f"name {title}": balls(name=name) for title, name in names.items()}
    own |= {
        "sphere in the plane": balls(shape=Sphere(0.5)),
        "disc in space": spatial(shape=Disc(0.5)),
        "radius 0": balls(shape=Disc(0.0)),
        "radius of nothing": balls(shape=Disc(NAN)),
        "box of three in the plane": balls(shape=Box((0.5, 0.5, 0.5))),
        "box without width": balls(shape=Box((0.0, 1.0))),
        "capsule without length": balls(shape=Capsule(0.0, 0.5)),
        "capsule without radius": balls(shape=Capsule(0.5, 0.0)),
        "cylinder without length": spatial(shape=Cylinder(-1.0, 0.5)),
        "free floor": floors(motion="free"),
        "floor somewhere": floors(pose=(1.0, 0.0, 0.0)),
        "floor that turns": floors(motion="prescribed", twist=(0.0, 0.0, 1.0)),
        "long normal": floors(shape=HalfSpace((0.0, 2.0))),
        "normal of three": floors(shape=HalfSpace((0.0, 0.0, 1.0))),
        "offset of nothing": floors(shape=HalfSpace((0.0, 1.0), NAN)),
        "strange motion": balls(motion="lazy"),
        "fixed and moving": balls(motion="fixed", twist=(1.0, 0.0, 0.0)),
        "no mass": balls(mass=0.0),
        "no inertia": balls(inertia=-1.0),
        "moments in the plane": balls(inertia=(1.0, 1.0, 1.0)),
        "one moment in space": spatial(inertia=1.0),
        "two moments in space": spatial(inertia=(1.0, 1.0)),
        "pose of two": balls(pose=(0.0, 1.0)),
        "twist of nothing": balls(twist=(NAN, 0.0, 0.0)),
        "force of three": balls(force=(0.0, 0.0, 1.0)),
        "torque of three": balls(torque=(0.0, 0.0, 1.0)),
        "no quaternion": spatial(pose=(0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0)),
        "surface of what is free": balls(surface_velocity=(1.0, 0.0)),
        "surface of three": floors(surface_velocity=(1.0, 0.0, 0.0)),
    }
    polygons = {
        "two points": SQUARE[:2],
        "a list": list(SQUARE),
        "a point twice": (*SQUARE, SQUARE[0]),
        "clockwise": SQUARE[::-1],
        "off its centre": tuple((x + 0.1, y) for x, y in SQUARE),
        "number": (1.0, *SQUARE),
        "of three": ((0.0, 0.0, 0.0), *SQUARE),
        "twice round": SQUARE * 2,
        "not convex": (*SQUARE, (0.0, 0.0)),
    }
    own |= {f"polygon, {title}": balls(shape=Polygon(points)) for title, points in polygons.items()}
    hulls = {
        "three points": CORNERS[:3],
        "in a plane": tuple((x, y, 0.0) for x, y in SQUARE),
        "a point twice": CORNERS * 2,
    }
    own |= {f"hull, {title}": spatial(shape=Hull(points)) for title, points in hulls.items()}
    return {"scenes": told(own), "sound": told({"plane": lambda: FLAT, "space": lambda: ROUND})}


# ---- slots -----------------------------------------------------------------------------------------------------------

SLOT = {"scene": "impact", "engine": "toy", "profile": "tuned", "dt": "1/240", "params": {"e": 0.5}}


def of_slots() -> Sections:
    """Slots and steps as they come from files and other processes."""
    changes: dict[str, dict[str, Any]] = {
        "unknown": {"colour": 1},
        "scene is a number": {"scene": 3},
        "engine steers": {"engine": "a\nb"},
        "profile is nothing": {"profile": None},
        "no iterations": {"iterations": 0},
        "half iterations": {"iterations": 1.5},
        "true iterations": {"iterations": True},
        "params are a list": {"params": [1]},
        "params are words": {"params": {"e": "x"}},
        "dimension is a word": {"dimension": "2"},
        "too many ulps": {"ulp": 10**9},
        "half an ulp": {"ulp": 0.5},
        "switched is a list": {"switched": [1]},
        "sound": {"switched": {"a": [1, 2]}, "ulp": -1, "iterations": 7},
    }
    own = {title: (lambda changed=changed: slot_from_dict(SLOT | changed)) for title, changed in changes.items()}
    for name in ("scene", "engine", "profile", "dt"):
        own[f"without {name}"] = lambda name=name: slot_from_dict({k: v for k, v in SLOT.items() if k != name})
    steps = {
        text: (lambda text=text: parse_dt(text)) for text in ("", "x", "1/0", "0", "-1/240", "inf", "1e-400", "1/2/3")
    }
    sizes = {f"{dt:g}": (lambda dt=dt: check_size(FLAT, dt)) for dt in (2.0, 1e-9, 1e-12)}
    found = slot_from_dict(SLOT | changes["sound"])
    return {
        "slots": told(own),
        "steps": told(steps),
        "sizes": told(sizes),
        "read": {k: str(v) for k, v in vars(found).items()},
        "beside": told({"primary": lambda: primary_of("tilt_table")}),
    }


# ---- files -----------------------------------------------------------------------------------------------------------

HEAD = 'name = "drop"\ndimension = 2\ngravity = [0.0, -9.81]\nduration = 0.5\n'
BODY = '[[bodies]]\nname = "ball"\nshape = { type = "disc", radius = 0.5 }\npose = [0.0, 2.0, 0.0]\n'
MASS = "mass = 1.0\n"
CHECK = '[[checks]]\nquantity = "ball.y"\nvalue = "1 - g*t"\ntolerance = "dt"\nbecause = "it falls"\n'
FACE = '[[bodies]]\nname = "floor"\nmotion = "fixed"\n'
FILES = {
    "sound": HEAD + BODY + MASS + CHECK,
    "no mass": HEAD + BODY,
    "density": HEAD + BODY + "density = 2.0\n",
    "both": HEAD + BODY + MASS + "density = 2.0\n",
    "density 0": HEAD + BODY + "density = 0.0\n",
    "mass below 0": HEAD + BODY + "mass = -1.0\n",
    "no bodies": HEAD,
    "empty": "",
    "unknown field": HEAD + "colour = 1\n" + BODY,
    "face twice": HEAD + FACE + 'shape = { type = "half_space", normal = [0.0, 1.0], angle = 0.1 }\n' + BODY + MASS,
    "face not at all": HEAD + FACE + 'shape = { type = "half_space" }\n' + BODY + MASS,
    "face without direction": HEAD + FACE + 'shape = { type = "half_space", normal = [0.0, 0.0] }\n' + BODY + MASS,
    "face of length 2": HEAD + FACE + 'shape = { type = "half_space", normal = [0.0, 2.0] }\n' + BODY + MASS,
    "growth below 1": "growth = 0.5\n" + HEAD + BODY + MASS,
    "growth of nobody": 'growth = "x"\n' + HEAD + BODY + MASS,
    "a constant called g": HEAD + "[constants]\ng = 1.0\n" + BODY + MASS,
    "a constant of nobody": HEAD + '[constants]\nk = "sqrt(-1)"\nm = "x+1"\n' + BODY + MASS,
    "check of nobody": HEAD + BODY + MASS + CHECK.replace("ball.y", "bat.y"),
    "check of nothing": HEAD + BODY + MASS + CHECK.replace("ball.y", "ball.colour"),
    "speed between two": HEAD + BODY + MASS + CHECK.replace("ball.y", "ball-ball.vy"),
    "force at a time": HEAD + BODY + MASS + CHECK.replace("ball.y", "ball.fy") + "at = 0.1\n",
    "after the end": HEAD + BODY + MASS + CHECK + "at = 0.75\n",
    "tolerance 0": HEAD + BODY + MASS + CHECK.replace('"dt"', '"dt - 1"'),
    "a call": HEAD + BODY + MASS + CHECK.replace("1 - g*t", "open(1)"),
    "an index": HEAD + BODY + MASS + CHECK.replace("1 - g*t", "g[0]"),
    "too large": HEAD + BODY.replace("0.5", "1e300") + "mass = 1e300\n",
    "polygon off its centre": HEAD
    + BODY.replace('type = "disc", radius = 0.5', 'type = "polygon", vertices = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]')
    + MASS,
}


def of_files() -> Sections:
    """Scene files with one thing wrong, and what is said of what was filled in."""
    found = Sections()
    with TemporaryDirectory() as folder:
        for title, text in FILES.items():
            path = Path(folder) / "a.toml"
            path.write_text(text, encoding="utf-8")
            notes = list[str]()
            own = told({title: lambda path=path, notes=notes: notes.extend(canonical_from_file(path).notes)}, folder)
            found[title] = own | {f"note {k}": note for k, note in enumerate(notes)}
        plain, many = Path(folder) / "a.json", json.dumps({"bodies": [{}] * 20_000})
        for title, content in {"no JSON": b"{", "no UTF-8": b"\xff\xfe", "many": many.encode()}.items():
            plain.write_bytes(content)
            own = told({title: lambda: canonical_from_file(plain)}, folder)
            found[title] = {key: value.partition(" JSON: ")[0] for key, value in own.items()}  # the rest is a library's
        gone = {"gone": Path(folder) / "b.toml", "a folder": Path(folder)}
        found["paths"] = told(
            {title: (lambda path=path: canonical_from_file(path)) for title, path in gone.items()}, folder
        )
    return found


# ---- adapters from outside -------------------------------------------------------------------------------------------


def of_plugins() -> Sections:
    """What an adapter from outside says of itself, where it is of another kind than what is asked for."""
    values: dict[str, tuple[Callable[[Any], object], list[Any]]] = {
        "settings": (foreign.checked_settings, [None, "a", [3], [("a", 1)], [Setting("a", 1, "so")]]),
        "refusal": (foreign.checked_refusal, [3, ["a"], None, "it does"]),
        "facts": (foreign.checked_facts, [None, {"name": "toy"}, EngineFacts]),
    }
    return {
        name: told({repr(value)[:60]: (lambda value=value, check=check: check(value)) for value in given})
        for name, (check, given) in values.items()
    }


# ---- commands --------------------------------------------------------------------------------------------------------

#: Calls that are refused before anything runs; OUT is a folder without results.
CALLS = [
    "bench impact --ulp 1",
    "bench --standard",
    "bench impact --engine nobody",
    "bench impact --against latest --engine chipmunk --dim 2 --profile default --dt 1/60",
    "bench impact --param e",
    "run impact --param e=x",
    "run impact --dt 0",
    "run nobody",
    "run impact --keep",
    "run impact --dim 4",
    "run impact --jobs -1",
    "run impact --timeout nan",
    "run impact --engine nobody",
    "run impact --param nobody=1",
    "run impact --iterations 0",
    "run impact --cluster nobody",
    "run impact --profile nobody",
    "run impact --cluster local:1 --keep-trajectories",
    "export",
    "export --all --to python impact",
    "export --to python",
    "export --engine chipmunk impact",
    "export --to nobody impact --engine reference",
    "export --to python impact",
    "explain nobody",
    "findings",
    "show",
    "show nobody",
    "compare a b",
    "describe nobody",
    "list runs",
    "list nobody",
    "list scenes --sensitivity",
    "list checks --sensitivity --engine chipmunk",
    "prune",
    "prune --keep 1",
    "merge nowhere",
    "accept chipmunk",
    "accept nobody",
    "accept",
    "tune nobody",
    "tune reference",
    "tune chipmunk --group nobody",
    "tune reference --decisive",
    "cure nobody",
    "cure reference nobody",
    "frontier nobody",
    "frontier impact",
    "frontier --engine nobody",
    "sweep",
    "sweep impact --grid v",
    "sweep impact --grid v=1:2",
    "sweep impact --grid v=1:2:x",
    "sweep impact --grid nobody=1:2:3",
    "field nobody",
    "releases",
    "releases nobody 1",
    "releases chipmunk x",
    "bisect chipmunk 7.0.0 impact --check apex",
    "dashboard",
    "nulls nobody",
    "certify --random 0",
    "check-adapter nobody",
    "check-adapter",
    "new-adapter A",
    "new-adapter bullet",
    "findings --prove nobody",
    "residuals nobody",
    "compile --engine nobody",
]


def of_commands() -> Sections:
    """Commands that are called wrongly: status and what is said, by what was typed."""
    found = Sections()
    with TemporaryDirectory() as folder, patch.dict("os.environ", {"COLUMNS": "100", "NO_COLOR": "1", "TERM": "dumb"}):
        for call in CALLS:
            words = call.split()
            command = main.commands[words[0]]
            out = ["--out", f"{folder}/none"] if any("--out" in o.opts for o in command.params) else []
            into = ["--into", folder] if words[0] == "new-adapter" else []
            done = CliRunner().invoke(main, [*words, *out, *into])
            error = done.exception if done.exception and not isinstance(done.exception, SystemExit) else None
            lines = done.output.replace(folder, "FOLDER").splitlines() + ([refusal_of(error, folder)] if error else [])
            found[call] = {"status": str(done.exit_code)} | {
                f"{k:02d}": f"|{line}|" for k, line in enumerate(lines[:12])
            }
    return found


def refusal_of(error: BaseException, folder: str) -> str:
    """An error that the command's own entry would tell in a line."""
    return f"{type(error).__name__}: {error}".replace(folder, "FOLDER")


def of_stores() -> Sections:
    """Stores and releases that are not there."""
    with TemporaryDirectory() as folder:
        place = Path(folder)
        (place / "file").write_text("no store")
        store = Store(place / "out")
        own: dict[str, Callable[[], object]] = {
            "no store": lambda: Store(place / "none", create=False),
            "no run": lambda: store.run("20260101-000000"),
            "no id": lambda: store.run("../x"),
            "none at all": store.run,
            "many releases": lambda: chosen("reference", "latest"),
            "no release": lambda: chosen("chipmunk", ","),
            "no version": lambda: chosen("chipmunk", "3.0;rm"),
        }
        found = told(own, folder)
        store.close()
    return {"stores": found}


# ---- scripts ---------------------------------------------------------------------------------------------------------


def scripts(engine: str) -> Sections:
    """Cells as scripts for their engine alone, line by line; versions are none."""
    from adapters.registry import load

    loaded, found = load(engine), Sections()
    cells = [
        ("impact", {"e": 0.5}, "default"),
        ("pinch", {}, "tuned"),
        ("closing_wall", {}, "tuned"),
        ("conveyor", {}, "tuned"),
        ("stack", {"n": 2.0}, "default"),
    ]
    for form in loaded.exports:
        for scene, params, profile in cells:
            for dimension in sorted(loaded.facts.dimensions):
                own = profile if profile in loaded.profiles else next(iter(loaded.profiles))
                slot = Slot(scene, tuple(params.items()), dimension, engine, own, 1 / 240)
                try:
                    text = written(slot, form)
                except (SceneError, EngineError) as error:
                    text = f"{type(error).__name__}: {error}"
                lines = text.replace(loaded.version(), "VERSION").splitlines()
                found[f"{form} {scene} {dimension}-D"] = {f"{k:03d}": f"|{line}|" for k, line in enumerate(lines[:400])}
    return found


MAKERS: dict[str, Callable[[], Sections]] = {
    "refused/scenes": of_scenes,
    "refused/slots": of_slots,
    "refused/files": of_files,
    "refused/plugins": of_plugins,
    "refused/commands": of_commands,
    "refused/stores": of_stores,
}
