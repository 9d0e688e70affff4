"""Tables of what questions ask: scenes posed otherwise, cells of plans, replays, frontiers, planted faults, times.

No engine runs but the toy.
"""

from __future__ import annotations

from itertools import islice
from typing import Any

import numpy as np
from of_kit import state
from of_motions import measured, motions
from of_scenes import cells
from telling import Sections, section, word

from adapters import planted_faults
from adapters.conformance import scenes as kit
from adapters.conformance.toy import ToyEngine
from adapters.lift import lift
from adapters.registry import find
from adapters.scene import Scene
from validation.bench import units
from validation.catalogue import CATALOGUE
from validation.cells import Slot
from validation.questions import frontier, invariance
from validation.running.plan import Request, slots
from validation.running.tracks import record, recording_from_bytes, tube
from validation.settings import cures, tuning

DT = 1 / 240
#: Scenes that are posed otherwise: between them every shape, drive and dimension.
POSED = ("impact", "stack", "incline", "conveyor", "tumble", "v_groove", "card_tent", "closing_wall", "wedge", "kane")
REPLAYED = ("bounce", "impact", "incline", "stack", "slide", "cradle", "tumble")
SHOWN = ("free flight, shaken", "hops", "hops, then nothing")
#: Profiles of plans; what an engine is asked depends on whether it is planar and counts iterations.
ASKED = ("chipmunk", "mujoco")


def plain(scene: Scene) -> dict[str, Any]:
    """Fields of a scene that are its own."""
    return {field: value for field, value in vars(scene).items() if field[0] != "_"}


def table_of_poses(name: str) -> Sections:
    """A scene under each relation, and what is measured once a wrong motion is brought back."""
    canonical, found = CATALOGUE[name], Sections()
    for dimension in canonical.dimensions:
        scene = canonical.scene(dimension, canonical.representative)
        own = {"size": word(invariance.size_of(scene)), "unit": word(invariance.unit_of(scene, 7.0))}
        own |= {f"scale of {metric}": word(size) for metric, size in invariance.scales(canonical, scene, DT).items()}
        found[f"{dimension}-D"] = section(scene=plain(scene)) | own
        nudged = invariance._nudged(scene, 0.1, 1e-6)
        found[f"{dimension}-D nudged"] = section(scene=plain(nudged)) | own
        for relation in invariance.RELATIONS[2:]:
            posed = relation.pose(scene)
            title = f"{dimension}-D {relation.name}"
            if isinstance(posed, str):
                found[title] = {"refused": posed}
                continue
            found[title] = section(scene=plain(posed.scene)) | {"shift": word(posed.shift)}
            dt = scene.duration / 60
            for motion, told in islice(motions(posed.scene, canonical.sampling(scene), dt), 6, 8):
                back = measured(canonical, scene, posed.back(told))
                found[title] |= {f"{motion}: {metric}": f"{word(value)} {why}" for metric, (value, why) in back.items()}
    return found


def table_of_plans() -> Sections:
    """Cells of each suite, what tuning and cures ask, per scene."""
    found = Sections()
    for suite in ("quick", "standard"):
        for name in CATALOGUE:
            asked = slots(Request([name], list(ASKED), [], [], suite=suite))
            told = [
                f"{s.engine}/{s.profile} {s.dimension}-D {s.params_text()} {s.dt:.6g} {s.iterations}" for s in asked
            ]
            found[f"{suite} {name}"] = {"cells": str(len(told)), "first": told[0], "last": told[-1]}
            found[f"{suite} {name}"] |= {f"{k:03d}": line for k, line in enumerate(told[1:-1:7])}
    for group in tuning.groups():
        found[f"tuning {group}"] = section(cells=tuning.cells_of(group), held_out=tuning.cells_of(group, True))
    for name, canonical in CATALOGUE.items():
        found[f"cures {name}"] = section(asked={str(d): cures.asked_of(name, d) for d in canonical.dimensions})
    return found


def table_of_replays() -> Sections:
    """What replays show of wrong motions, as it is kept; and how far from its ghost a body may be."""
    found = Sections()
    for name in REPLAYED:
        canonical = CATALOGUE[name]
        for title, dimension, params in islice(cells(canonical), 2):
            scene = canonical.scene(dimension, params)
            near = tube(canonical, scene, DT, 3.0)
            own = {"tube": f"{word(near.distance)} {word(near.per_impact)}"}
            for motion, told in motions(scene, canonical.sampling(scene), scene.duration / 120):
                if motion not in SHOWN:
                    continue
                seen = recording_from_bytes(record(canonical, scene, told).to_bytes())
                every = max(1, len(seen.t) // 5)
                own |= section(**{motion: {
                    "frames": len(seen.t), "t": seen.t[::every], "pose": seen.pose[::every, :3].round(4),
                    "contacts": len(seen.frame), "frame": seen.frame[:20:5], "pair": seen.pair[:20:5],
                    "point": seen.point[:20:5].round(4), "impulse": seen.impulse[:20:5].round(4),
                    "departs": seen.departure, "finish": seen.finish,
                }})  # fmt: skip
            found[f"{title} {name}"] = own
    return found


def table_of_frontiers() -> Sections:
    """Searches of frontiers, their first cells, and how ends are told."""
    found = Sections()
    for quick in (True, False):
        for bracket in frontier.brackets([], list(ASKED), [], [], quick):
            own, each = bracket.base, bracket.frontier
            title = f"{own.engine}/{own.profile} {own.dimension}-D {own.scene} {each.name}, quick: {quick}"
            first = frontier.following(bracket, 1.1)
            told = {"first": word(first), "hard": word(bracket._hard)}
            for value in (each.easy, each.hard):
                slot = frontier.slot_at(bracket, value)
                told[f"at {value:g}"] = f"{slot.params_text()} {slot.dt:.6g} {slot.iterations}"
                told[f"said of {value:g}"] = frontier.value_text(each, value)
            bracket.survives = frontier.End(each.easy, own, "")
            told["second"], told["survived"] = word(frontier.following(bracket, 1.1)), bracket.text
            bracket.fails = frontier.End(each.hard, own, "fell")
            told["third"], told["closed"] = word(frontier.following(bracket, 1.1)), bracket.text
            bracket.survives = None
            told["nothing survived"], told["then"] = bracket.text, word(frontier.following(bracket, 1.1))
            found[title] = told
    return found


def table_of_planted() -> Sections:
    """What each planted fault changes of a healthy toy: the lines of its state that differ."""
    found = Sections()
    for make in (kit.sliding, kit.rolling):
        scene = lift(make())
        healthy = state(ToyEngine(), scene)
        for fault in planted_faults.SIZED:
            spoilt = state(planted_faults.Planted(ToyEngine(), fault, 0.05), scene)
            found[f"{scene.name}: {fault}"] = {k: v for k, v in spoilt.items() if healthy.get(k) != v}
    return found


def table_of_units() -> Sections:
    """What a bench times: units, their scenes, and what is wrong at their ends."""
    series = [(name, profile) for name in ASKED if (engine := find(name).engine) for profile in engine.profiles]
    made = [
        *units.overhead_units(series, (2, 3)),
        *units.size_units(series, (2,), (("stack", "n"), ("starved", "n")), (3, 10), (3, 5)),
        *units.iteration_units(series, (2, 3), (4, 30), 4),
        *(units.work_unit(Slot(name, (), CATALOGUE[name].dimensions[0], "chipmunk", "tuned", DT), "cell", 0.1, True)
          for name in CATALOGUE if CATALOGUE[name].primary),
    ]  # fmt: skip
    found = Sections()
    for k, unit in enumerate(made):
        slot = unit.slot
        title = f"{k:03d} {unit.purpose} {slot.scene} {slot.dimension}-D {slot.engine}/{slot.profile}"
        found[title] = section(unit=unit, group=[str(x) for x in unit.group], series=[str(x) for x in unit.series])
    for name in ("empty", "flight"):
        for d in (2, 3):
            scene = units.scene_of(Slot(name, (), d, "chipmunk", "tuned", DT))
            start = np.array([body.pose for body in scene.bodies])
            wrong = [units.own_error(scene, time, start, start + 0.1 * time) for time in (0.0, 0.5)]
            found[f"{name}, {d} axes"] = section(scene=plain(scene), wrong=wrong)
    return found
