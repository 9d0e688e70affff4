"""Tables of the conformance kit and of probes: scenes, what the toy makes of them, what each fault spoils, readings."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import product

import numpy as np
from of_motions import motions
from telling import Sections, section

from adapters.conformance import CHECKS, scenes
from adapters.conformance.faults import FAULTS
from adapters.conformance.self_test import broken
from adapters.conformance.spoilt import Fault, Spoilt
from adapters.conformance.toy import ToyEngine
from adapters.lift import lift
from adapters.needs import needs
from adapters.probes import PROBES, Case
from adapters.scene import Scene

STEPS = 5
#: What fault tables are read from: a ball that lands spinning, two that meet, a box that slides; one that is carried.
SHOWN = (scenes.sliding, scenes.carried)
#: Motions from which probes read.
READ = ("free flight", "free flight, shaken", "hops, shaken")
#: Checks of which what they say is told: those that take no second, nor a process of their own.
SAID = set(CHECKS) - {"memory", "process", "packages"}


def kit_scenes() -> dict[str, Scene]:
    """Scenes of the kit by name."""
    found = {
        made.name: made
        for made in (
            scenes.resting(), scenes.striking(), scenes.flying(), scenes.glancing(), scenes.rolling(), scenes.sliding(),
            scenes.odd_pairs(), scenes.carried(), scenes.leaning(),
        )
    }  # fmt: skip
    found |= {"resting, floor last": scenes.resting(-1), "resting, no box": scenes.resting(1, 1.0, False)}
    found |= {"striking, swapped": scenes.striking(-1)}
    for turn in (scenes.mirrored, scenes.quarter_turned):
        found[f"{turn.__name__} sliding"] = turn(scenes.sliding())
        found[f"{turn.__name__} flying"] = turn(scenes.flying())
        pushed = scenes.resting().bodies
        pushed = (*pushed[:-1], replace(pushed[-1], force=(1.0, 2.0), torque=(3.0,), pose=(4.0, 0.25, 0.5)))
        found[f"{turn.__name__} pushed"] = turn(replace(scenes.resting(), bodies=pushed))
    return found


def table_of_scenes() -> Sections:
    """Every scene of the kit, and where the toy has its bodies after some steps."""
    found = Sections()
    for name, scene in kit_scenes().items():
        found[name] = section(scene={field: value for field, value in vars(scene).items() if field[0] != "_"})
        posed = lift(scene)
        found[f"{name}, toy"] = (
            {"refused": said} if (said := ToyEngine().refuses(posed, "")) else state(ToyEngine(), posed)
        )
    return found


def state(engine: ToyEngine | Spoilt, scene: Scene) -> dict[str, str]:
    """What a world of a toy shows after some steps."""
    (profile,) = engine.profiles
    settings = {each.name: each.value for each in engine.settings(profile, needs(scene), scenes.DT)}
    simulation = engine.build(scene, scenes.DT, settings)
    simulation.advance(1)
    simulation.advance(STEPS - 1)
    told = simulation.contacts()
    chosen = np.argsort(np.lexsort((told.point[:, 0], told.b, told.a)))
    rows = {name: value[chosen][:6] for name, value in vars(told).items()}
    return section(pose=simulation.pose(), twist=simulation.twist(), contacts=rows, held=simulation.readback())


def in_words(fault: Fault) -> bool:
    """Whether a fault spoils what an engine says or keeps, not what a world is or shows: other tests ask for those."""
    return not any((fault.told, fault.stepped, fault.pose, fault.twist, fault.contacts, fault.readback))


def table_of_faults() -> Sections:
    """What each fault spoils, at its largest: of a healthy toy's state the lines that differ."""
    found = Sections()
    for make in SHOWN:
        scene = lift(make())
        healthy = state(ToyEngine(), scene)
        for name, fault in FAULTS.items():
            if in_words(fault) or name.startswith("another answer"):
                continue
            for size in fault.sizes[:1] or (1.0,):
                spoilt = state(Spoilt(name, size), scene)
                told = {path: value for path, value in spoilt.items() if healthy.get(path) != value}
                found[f"{scene.name}: {name}, {size:g}"] = dict(list(told.items())[:10])
    for name, fault in FAULTS.items():
        found[f"fault: {name}"] = section(check=fault.check, sizes=fault.sizes, unit=fault.unit)
    return found


def table_of_words() -> Sections:
    """What the check that must catch a fault says of it, at the largest of its sizes."""
    found = Sections({"said": {}})
    for name, fault in FAULTS.items():
        if fault.check in SAID and "another answer" not in name:
            found["said"][name] = broken(Spoilt(name, max(fault.sizes, default=math.nan)), fault.check)
    return found


def table_of_probes() -> Sections:
    """Scenes of the probes, and what their readers read from motions that are wrong."""
    found = Sections()
    for dimension, (e, mu), dt in product((2, 3), ((0.0, 0.5), (0.8, 0.1)), (1 / 240,)):
        case = Case(dimension, e, mu, dt, 0.5)
        for name, probe in PROBES.items():
            scene = probe.make(case)
            title = f"{name}, {dimension}-D, e={e:g}, mu={mu:g}"
            own = {field: value for field, value in vars(scene).items() if field[0] != "_"}
            found[title] = section(scene=own, sampling=probe.sampling(case, scene))
            for motion, trajectory in motions(scene, probe.sampling(case, scene), case.dt):
                if motion not in READ:
                    continue
                with np.errstate(all="ignore"):
                    try:
                        told = probe.read(case, scene, trajectory)
                    except (ArithmeticError, AssertionError, ValueError, IndexError) as error:
                        found[title][f"{motion}"] = type(error).__name__
                        continue
                found[title] |= section(**{motion: {key: [f"{x:.9g}" for x in own] for key, own in told.items()}})
    return found
