"""Tables of what is refused, each in the one line that a user reads, and of what is said of a file beside that.

A refusal names the field, says what stands there, and what may. Nothing is run.
"""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from unittest.mock import patch

from click.testing import CliRunner
from telling import Sections, word

from adapters import foreign
from adapters.engine import EngineError, EngineFacts, Setting
from adapters.model import Model
from adapters.plain import one_line
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
from validation.catalogue import CATALOGUE
from validation.cells import Slot, check_size, parse_dt, slot_from_dict
from validation.files.scene_files import canonical_from_file
from validation.findings import FindingsError, files
from validation.posed import primary_of
from validation.questions import breaks
from validation.records.store import Store, StoreError
from validation.releases import choosing, environments
from validation.releases.choosing import Release, chosen
from validation.releases.environments import BuildError
from validation.workers import LimitError, limits

#: Step of what is built [s].
DT = 1 / 240


def refusal(do: Callable[[], object], folder: str = "") -> str:
    """What is said where something is refused; what was made where it is not."""
    try:
        made = do()
    except (SceneError, EngineError, StoreError, FindingsError, LimitError, BuildError) as error:
        return f"{type(error).__name__}: {error}".replace(folder or "\0", "FOLDER")
    except Exception as error:  # the engine's own, which should be ours
        return f"untidy {type(error).__name__}: {error}"
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


# ---- models and settings ---------------------------------------------------------------------------------------------

MODELS = Path(__file__).parents[1] / "models"
#: A ball above a floor, in MuJoCo's own words; what is wrong with it stands in one of the places.
MJCF = """<mujoco{root}><option timestep="0.004"{option}/>{top}<worldbody>
<geom name="floor" type="plane" size="0 0 1"{floor}/>{world}
<body name="ball" pos="0 0 1"{body}>{joint}<geom name="round" type="sphere" size="0.5" mass="2"{geom}/>{inside}</body>
</worldbody>{end}</mujoco>"""
FREE, HINGE = "<freejoint/>", '<joint type="hinge" axis="0 1 0"/>'
BOX_BY_IT = '<body name="box" pos="3 0 1"><freejoint/><geom type="box" size="0.5 0.5 0.5" mass="1"{}/></body>'
ODD_MODELS: dict[str, dict[str, str]] = {
    "sound": {},
    "a hinge": {"joint": HINGE},
    "no joint": {"joint": ""},
    "stiff": {"joint": '<joint type="free" stiffness="3"/>'},
    "damped": {"joint": '<joint type="free" damping="3"/>'},
    "two shapes": {"inside": '<geom type="box" size="0.1 0.1 0.1"/>'},
    "weightless": {"body": ' gravcomp="1"'},
    "an ellipsoid": {"geom": '"/><geom type="ellipsoid" size="0.5 0.4 0.3'},
    "off its centre": {"inside": '<inertial pos="0.1 0 0" mass="1" diaginertia="1 1 1"/>'},
    "axes of its own": {"inside": '<inertial pos="0 0 0" euler="0 20 10" mass="1" diaginertia="1 0.9 0.8"/>'},
    "a mask": {"geom": ' contype="2" conaffinity="2"'},
    "a mask of the floor": {"floor": ' contype="0" conaffinity="0"'},
    "wind": {"option": ' wind="1 0 0"'},
    "water": {"option": ' density="1000"'},
    "viscous": {"option": ' viscosity="1"'},
    "no contacts": {"top": '<option><flag contact="disable"/></option>'},
    "a fast solver": {"option": ' solver="CG"'},
    "RK4": {"option": ' integrator="RK4"'},
    "implicit": {"option": ' integrator="implicit"'},
    "elliptic": {"option": ' cone="elliptic" impratio="10"'},
    "override": {"top": '<option><flag override="enable"/></option>'},
    "rolling": {"geom": ' condim="6" friction="1 0.1 0.1"'},
    "torsion": {"geom": ' condim="4" friction="1 0.1 0.1"'},
    "smooth": {"geom": ' condim="1"', "floor": ' condim="1"'},
    "a gap": {"geom": ' gap="0.01" margin="0.02"'},
    "softer": {"geom": ' solref="0.05 1"'},
    "softer than the rest": {"world": BOX_BY_IT.format(' solref="0.05 1"')},
    "smooth beside rough": {"geom": ' condim="1"', "floor": ' condim="1"', "world": BOX_BY_IT.format(' condim="3"')},
    "a pair": {"end": '<contact><pair geom1="floor" geom2="round" condim="4" friction="1 2 0 0 0"/></contact>'},
    "kept apart": {"end": '<contact><exclude body1="world" body2="ball"/></contact>'},
    "a tendon": {"end": '<equality><weld body1="ball"/></equality>'},
    "a motor": {"end": "<actuator><motor/></actuator>"},
    "a keyframe": {"end": '<keyframe><key name="up" qpos="0 0 2 1 0 0 0"/></keyframe>'},
    "a keyframe too short": {"end": '<keyframe><key qpos="0 0 2"/></keyframe>'},
    "another root": {"root": "2"},
    "defaults": {"top": '<default><motor ctrlrange="0 1"/><geom friction="0.25"/><site rgba="1 0 0 1"/></default>'},
    "lights between": {
        "inside": '<light/><site/><geom class="main" type="sphere" size="0.1" contype="0" conaffinity="0"/>'
    },
    "two motors and a weld": {
        "end": '<actuator><motor joint="j"/></actuator><tendon/><equality/>'
        '<contact><exclude body1="a" body2="b"/></contact>',
    },
    "a light": {"world": "<light/><camera/>"},
    "a site": {"inside": "<site/>"},
}


def of_models() -> Sections:
    """Models of MuJoCo and robots: what is refused of each, or how it is read, strictly and not."""
    from adapters.mujoco import model, urdf

    found = Sections()
    for path in sorted(MODELS.iterdir()):
        reader = {".xml": model, ".urdf": urdf}.get(path.suffix)
        if reader is not None:
            found[path.name] = as_read(reader.read, path.read_text(encoding="utf-8"))
    places = ("root", "option", "top", "floor", "world", "body", "geom", "inside", "end")
    texts = {
        title: MJCF.format(**dict.fromkeys(places, "") | {"joint": FREE} | own) for title, own in ODD_MODELS.items()
    }
    texts |= {"no root": "<a/>", "entity": '<!DOCTYPE a [<!ENTITY b "c">]><mujoco/>', "empty": "<mujoco/>"}
    for title, text in texts.items():
        found[title] = as_read(model.read, text)
    return found


def as_read(read: Callable[[str, bool], Model], text: str) -> dict[str, str]:
    """What is said of a model, strictly and where what has no place may be left out; and what was made of it."""
    found = dict[str, str]()
    for drop in (False, True):
        try:
            made = read(text, drop)
        except (SceneError, EngineError) as error:
            found[f"drop {drop}"] = one_line(error)
            continue
        found |= {f"drop {drop} note {k}": note for k, note in enumerate(made.notes)}
        found |= {f"drop {drop} dropped {k}": left for k, left in enumerate(made.dropped)}
        if not drop:
            found |= {f"setting {k}": word(setting) for k, setting in enumerate(made.settings)}
            found |= {f"body {body.name}": word(body) for body in made.scene.bodies}
            found |= {f"pair {k}": word(pair) for k, pair in enumerate(made.scene.pairs)}
    return found


#: What settings of any kind may not be, or may be for some.
VALUES = (None, "x", True, 0, -1, -0.5, 0.5, NAN, (), (1.0, 2.0))


def of_settings(name: str) -> Sections:
    """Every setting of an engine with values that it may not have, and its names."""
    from adapters.needs import needs
    from adapters.registry import load
    from adapters.stepping import posed_for

    engine, found = load(name), Sections()
    scene = CATALOGUE["impact"].scene(2, {})
    for profile in engine.profiles:
        given = {s.name: s.value for s in engine.settings(profile, needs(scene), DT)}
        posed = posed_for(engine, scene)

        def build(settings: Mapping[str, Any], dt: float = DT, posed: Scene = posed) -> object:
            made = engine.build(posed, dt, dict(settings))
            made.close()
            return made

        sound = dict(given)
        own: dict[str, Callable[[], object]] = {
            f"{setting} {value!r}": (lambda s=setting, v=value, sound=sound: build({**sound, s: v}))
            for setting in given
            for value in VALUES
        }
        own |= {
            f"without {n}": (lambda n=n, sound=sound: build({k: v for k, v in sound.items() if k != n})) for n in given
        }
        own["another"] = lambda sound=sound: build({**sound, "colour": 1})
        own |= {f"step {dt:g}": (lambda dt=dt, sound=sound: build(sound, dt)) for dt in (0.0, -0.1, NAN, INF)}
        found[profile] = {what: said for what, said in told(own).items() if not said.startswith("untidy")}
    return found


# ---- pip, limits, and what other processes hand over -----------------------------------------------------------------


class Said:
    """What a process that was started says in the end."""

    def __init__(self, code: int = 0, out: str = "", err: str = "") -> None:
        self.returncode, self.stdout, self.stderr = code, out, err


def of_processes() -> Sections:
    """What pip says of releases, what a shell allows, and what ``run-cell`` is handed."""
    release = Release("toy", "1.0", "toy-wheel", ("numpy",))
    answers = {
        "none": Said(1, "", "ERROR: No matching distribution found for toy-wheel==1.0"),
        "no version": Said(1, "", "ERROR: Could not find a version that satisfies toy"),
        "words": Said(1, "", "a\nsorry"),
        "two": Said(1, "", "ERROR: first\nERROR: second\nnot this"),
        "silent": Said(2),
        "fine": Said(0),
    }
    python = environments._short()
    found = Sections({"install": {}, "listed": {}, "told": {}, "cells": {}})
    for title, answer in answers.items():
        with patch.object(environments.subprocess, "run", lambda *given, answer=answer, **more: answer):
            own = refusal(lambda: environments._install(Path("x"), release)).replace(python, "PYTHON")
            found["install"][title] = own
            if answer.returncode:
                found["told"][title] = refusal(lambda: environments._told_by(Path("x")))
    lists = {
        "none": Said(1, "", "ERROR: No matching distribution found"),
        "silent": Said(0, "toy (1.0)"),
        "odd": Said(1, "", "WARNING: a"),
        "some": Said(0, "toy (1.0)\nAvailable versions: 2.0rc1, 1.10, x-y, 1.9\n  INSTALLED: 1.0"),
    }
    for title, answer in lists.items():
        with patch.object(choosing.subprocess, "run", lambda *given, answer=answer, **more: answer):
            found["listed"][title] = refusal(lambda: choosing._listed("toy"))

    def late(*given: Any, **more: Any) -> Any:
        raise subprocess.TimeoutExpired("pip", 1.0)

    with patch.object(environments.subprocess, "run", late):
        found["install"]["late"] = refusal(lambda: environments._install(Path("x"), release))
        found["listed"]["late"] = refusal(lambda: choosing._listed("toy"))
    with patch.object(environments, "find_spec", lambda name: None):
        found["install"]["no pip"] = refusal(lambda: environments._install(Path("x"), release))
    with patch.object(limits, "_hard_limit", lambda: limits.GIB):
        found["told"]["a small shell"] = refusal(lambda: limits.memory(2))
    for title, text in {"nothing": "", "words": "words", "a list": "[1]", "no engine": '{"scene": "impact"}'}.items():
        done = CliRunner().invoke(main, ["run-cell"], input=text)
        found["cells"][title] = f"{done.exit_code}: {done.output.strip()}"
    return found


#: A family of findings, and members of it; each entry of the tables below changes one field.
FAMILY = {
    "id": "a",
    "profiles": ["default"],
    "scene": "impact",
    "metrics": ["impulse"],
    "reason": "so",
    "source": "manual",
    "releases": ">=1",
}
ROW = ["a", "default", "2", "e=0.5", "1/240", "", "impulse", "1.5", "0.25"]


def of_lists() -> Sections:
    """Files of findings with one thing wrong."""
    wrong: dict[str, dict[str, Any]] = {
        "sound": {},
        "all of all": {"profiles": ["*"], "metrics": ["*"]},
        "many scenes": {"scene": "imp*"},
        "no specifier": {"releases": "new"},
        "no list": {"profiles": "default"},
        "empty list": {"metrics": []},
        "no reason": {"reason": " "},
        "a number": {"source": 3},
    }
    rows: dict[str, dict[int, str]] = {
        "sound": {},
        "no family": {0: "b"},
        "another profile": {1: "tuned"},
        "another metric": {6: "drift"},
        "no value": {7: "x"},
        "no band": {8: "0"},
        "endless": {7: "inf"},
        "outside": {8: f"2{files.TO}3"},
        "no width": {8: f"1.5{files.TO}1.5"},
        "nothing": {7: ""},
    }
    here = Path("FOLDER/a.toml")
    found = Sections({"families": {}, "rows": {}, "breaks": {}})
    for title, changed in wrong.items():
        found["families"][title] = refusal(lambda changed=changed: files._family("chipmunk", here, FAMILY | changed))
        other = {
            "id": "a",
            "profiles": ["default"],
            "scenes": ["impact"],
            "relations": ["mirrored"],
            "reason": "so",
            "source": "manual",
            "releases": ">=1",
        }
        also = {{"scene": "scenes", "metrics": "relations"}.get(name, name): value for name, value in changed.items()}
        if title == "all of all":
            also = {"scenes": ["*"], "relations": ["*"]}
        found["breaks"][title] = refusal(lambda also=also, other=other: breaks._family("chipmunk", here, other | also))
    family = files._family("chipmunk", here, FAMILY)
    for title, cells in rows.items():
        row = [cells.get(k, value) for k, value in enumerate(ROW)]
        found["rows"][title] = refusal(lambda row=row: files._member("chipmunk", "FOLDER/a.csv:2", row, {"a": family}))
    promised = FAMILY | {"profiles": ["reference"]}
    found["families"]["a solution"] = refusal(lambda: files._family("reference", here, promised))
    return found


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
    "refused/models": of_models,
    "refused/processes": of_processes,
    "refused/lists": of_lists,
    **{
        f"refused/settings-{name}": partial(of_settings, name) for name in ("reference", "chipmunk", "bullet", "mujoco")
    },
}
