"""Worlds of an adapter: they have the given start and values, share no state, and repeat bit for bit."""

from __future__ import annotations

import contextlib
import ctypes
import gc
import json
import math
import os
import pickle
from collections.abc import Callable
from itertools import product
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from adapters.conformance.finding import NotAsked
from adapters.conformance.scenes import (
    DT,
    accepted,
    built,
    driven,
    resting,
    rolling,
    sliding,
    striking,
    values,
)
from adapters.engine import Contacts, Engine, Recorded, Simulation
from adapters.isolation import Child, IsolationError, Lost
from adapters.plain import one_line
from adapters.scene import Scene
from adapters.stepping import CONTACT_FIELDS, advances, posed_for

#: Time limit of a process that imports an engine and steps it 48 times, with compilation of kernels [s].
PATIENCE = 300.0
#: Builds before the first measurement of memory, and builds with constant memory. The first build may keep memory.
WARM, BUILDS = 200, 1000
#: Allowed growth of memory over `BUILDS` builds [bytes]: allocators keep some pages, but a thousand leaked worlds take
#: at least a kilobyte each.
STEADY = 2**20
#: Times that they are built where memory grows: pools come and go by megabytes, but a leak grows each time.
ROUNDS = 4


def states(engine: Engine) -> str:
    """Poses and twists are those of all bodies in the scene's order, and start with the scene's values."""
    for profile, order in product(engine.profiles, (1, -1)):
        planar = accepted(engine, profile, resting(order), resting(order, box=False))
        scene = posed_for(engine, planar)
        simulation = built(engine, planar, profile)
        try:
            pose, twist, changed = simulation.pose(), simulation.twist(), simulation.initial_change
        finally:
            simulation.close()
        asked = np.array([body.pose for body in scene.bodies])
        if pose.shape != asked.shape or twist.shape != (len(scene.bodies), 3 if scene.dimension == 2 else 6):
            return f"{profile}: shapes are {pose.shape} and {twist.shape}"
        slack = engine.facts.round_off
        if not np.allclose(twist, [body.twist for body in scene.bodies], rtol=0.0, atol=slack):
            return f"{profile}: bodies start with other velocities than the scene's"
        # A start changed on purpose is shown beside the result; it must be declared.
        if not changed and not np.allclose(pose, asked, rtol=0.0, atol=slack):
            return f"{profile}: bodies start in another pose than the scene's, and initial_change does not report it"
    return ""


def readback(engine: Engine) -> str:
    """The engine's values can be read as data, and are the declared ones: step, gravity, masses, moments, materials."""
    for profile in engine.profiles:
        scene = accepted(engine, profile, resting(), resting(box=False))
        simulation = built(engine, scene, profile)
        try:
            held = simulation.readback()
        finally:
            simulation.close()
        if not held:
            return f"{profile}: nothing is read back"
        json.dumps(held)
        for name, asked, told in _stated(engine, profile, posed_for(engine, scene), held):
            if not _same(asked, told, engine.facts.round_off):
                return f"{profile}: {name} was declared {asked}, the engine holds {told}"
    return ""


def _stated(engine: Engine, profile: str, scene: Scene, held: dict[str, Any]) -> list[tuple[str, Any, Any]]:
    """Name, declared and actual value of all read-back under the names of the interface."""
    pairs = [(f"settings.{k}", v, held[k]) for k, v in values(engine, profile, scene).items() if k in held]
    for name, asked in (("dt", DT), ("gravity", scene.gravity)):
        if name in held:
            pairs.append((name, asked, held[name]))
    for body in scene.bodies:
        told = held.get("bodies", {}).get(body.name, {}) if body.motion == "free" else {}
        for name, value in (("mass", body.mass), ("inertia", body.inertia)):
            if name in told:
                pairs.append((f"{body.name}.{name}", value, told[name]))
    for i, j, material in scene.contact_pairs():
        told = held.get("pairs", {}).get(f"{scene.bodies[i].name}-{scene.bodies[j].name}", {})
        for name in ("restitution", "friction"):
            if name in told:
                pairs.append((f"{material.a}-{material.b}.{name}", getattr(material, name), told[name]))
    return pairs


def _same(asked: Any, told: Any, slack: float) -> bool:
    if isinstance(asked, str):
        return asked.lower() in str(told).lower()  # an engine may add a prefix to a word
    if isinstance(asked, bool) or asked is None:
        return bool(asked == told)
    try:
        a, b = np.asarray(asked, float), np.asarray(told, float)
    except (TypeError, ValueError):
        return True  # the engine's own table or word, which only its adapter can read
    return a.shape != b.shape or bool(np.allclose(a, b, rtol=slack, atol=slack * 1e-3))


# ---- bit for bit ---------------------------------------------------------------------------------------------------


def fresh(engine: Engine) -> str:
    """Two worlds stepped in turn give the same bits as each one alone."""
    for profile in engine.profiles:
        scenes = [accepted(engine, profile, *variants) for variants in _three()]
        alone = [_interleaved(engine, profile, [scene])[0] for scene in scenes]
        together = _interleaved(engine, profile, scenes)
        for scene, a, b in zip(scenes, alone, together, strict=True):
            if not np.array_equal(a, b):
                return f"{profile}: the result of {scene.name} changes when another world is stepped in between"
    return ""


def _three() -> tuple[tuple[Scene, ...], ...]:
    other = resting(-1, 4.0), resting(-1, 4.0, box=False)
    return (resting(), resting(box=False)), other, (striking(), striking(restitution=0.0))


def _interleaved(engine: Engine, profile: str, scenes: list[Scene]) -> list[np.ndarray]:
    """Final states of worlds that are all built first, then stepped in turn."""
    worlds: list[Simulation] = []
    try:
        for scene in scenes:
            worlds.append(built(engine, scene, profile))
        for _ in range(24):
            for world in worlds:
                world.advance(1)
        return [np.hstack([world.pose(), world.twist()]) for world in worlds]
    finally:
        for world in worlds:
            world.close()


def repeat(engine: Engine) -> str:
    """The same scene gives the same bits again, in the same process."""
    for profile in engine.profiles:
        scene = accepted(engine, profile, sliding(), rolling())
        hashes = {driven(engine, scene, profile).state_hash() for _ in range(3)}
        if len(hashes) > 1:
            return f"{profile}: {scene.name} came out in {len(hashes)} ways of 3"
    return ""


def history(engine: Engine) -> str:
    """A scene gives the same bits after another one has run."""
    for profile in engine.profiles:
        scene = accepted(engine, profile, sliding(), rolling())
        before = driven(engine, scene, profile).state_hash()
        lying = (resting(-1, 4.0), resting(-1, 4.0, box=False))
        for other in (accepted(engine, profile, striking(), *lying), accepted(engine, profile, *lying)):
            driven(engine, other, profile)
            if driven(engine, scene, profile).state_hash() != before:
                return f"{profile}: the result of {scene.name} changes after {other.name}"
    return ""


def process(engine: Engine) -> str:
    """A scene gives the same bits in a fresh process."""
    here = _hashes(engine)
    try:
        asked = pickle.dumps(engine)
    except Exception as error:
        raise NotAsked(f"the engine cannot be sent to another process: {type(error).__name__}") from None
    try:
        child = Child(serve_hashes)
    except IsolationError as error:
        raise NotAsked(str(error)) from None
    try:
        child.send(asked)
        there = json.loads(child.receive(PATIENCE))
    except Lost as lost:
        return f"{lost}: {one_line(child.tail())}"
    finally:
        child.stop()
    if "not there" in there:
        raise NotAsked(f"the engine cannot be loaded in another process: {there['not there']}")
    differing = [profile for profile in here if there.get(profile) != here[profile]]
    return f"{', '.join(differing)}: the result differs in a new process" if differing else ""


def serve_hashes(connection: Connection) -> None:
    """Run the scene of `process` on one engine; runs in the child, which gets the engine from its parent only."""
    try:
        engine = pickle.loads(connection.recv_bytes())
    except Exception as error:
        connection.send_bytes(json.dumps({"not there": f"{type(error).__name__}: {error}"}).encode())
        return
    connection.send_bytes(json.dumps(_hashes(engine)).encode())


def _hashes(engine: Engine) -> dict[str, str]:
    scenes = {profile: accepted(engine, profile, sliding(), rolling()) for profile in engine.profiles}
    return {profile: driven(engine, scene, profile).state_hash() for profile, scene in scenes.items()}


def stride(engine: Engine) -> str:
    """The timed loop, many steps at once without readings, ends with the same bits as the judged loop."""
    for profile in engine.profiles:
        scene = accepted(engine, profile, sliding(), rolling())
        ends = [_stepped(engine, scene, profile, strides) for strides in ((24,), (1,) * 24, (1, 7, 16))]
        if not all(np.array_equal(ends[0], end) for end in ends):
            return f"{profile}: 24 steps at once and 24 single steps with readings in between have different results"
        for samples, stride in ((24, 1), (8, 3)):
            wrong = _recorded_otherwise(engine, scene, profile, samples, stride)
            if wrong:
                return (
                    f"{profile}: {wrong} recorded at once ({samples} of {stride} steps) differ from those of "
                    "single steps"
                )
    return ""


def one_by_one(simulation: Simulation, samples: int, stride: int) -> Recorded:
    """The expected result of `Simulation.record`, with contacts."""
    states, told = [], []
    for _ in advances(simulation, samples * stride, stride):
        states.append((np.array(simulation.pose()), np.array(simulation.twist())))
        told.append(simulation.contacts())
    rows = (np.concatenate([np.array(getattr(each, name)) for each in told]) for name in CONTACT_FIELDS)
    pose, twist = (np.array(column) for column in zip(*states, strict=True))
    return Recorded(pose, twist, np.array([len(each.a) for each in told]), Contacts(*rows))


def _recorded_otherwise(engine: Engine, scene: Scene, profile: str, samples: int, stride: int) -> str:
    """Records of an engine that differ from its readings; nothing if none differs or there are none.

    The record starts at the state after `advance`, and ends there.
    """
    recorder, reader = built(engine, scene, profile), built(engine, scene, profile)
    try:
        recorder.advance(1), reader.advance(1)
        found = recorder.record(samples, stride, True)
        if found is None:
            return ""
        wanted = one_by_one(reader, samples, stride)
        ends = [np.hstack([each.pose(), each.twist()]) for each in (recorder, reader)]
        parts: dict[str, tuple[Any, Any]] = {"poses": (found.pose, wanted.pose), "twists": (found.twist, wanted.twist)}
        parts["ends"] = ends[0], ends[1]
        parts["counts"] = (found.counts, wanted.counts)
        if found.contacts is None or wanted.contacts is None:
            return "contacts"
        for name in CONTACT_FIELDS:
            parts[f"contacts' {name}"] = getattr(found.contacts, name), getattr(wanted.contacts, name)
        same = {name: np.array_equal(one, other, equal_nan=True) for name, (one, other) in parts.items()}
        return ", ".join(name for name, holds in same.items() if not holds)
    finally:
        recorder.close()
        reader.close()


def _stepped(engine: Engine, scene: Scene, profile: str, strides: tuple[int, ...]) -> np.ndarray:
    simulation = built(engine, scene, profile)
    try:
        for steps in strides:
            simulation.advance(steps)
            if len(strides) > 1:
                simulation.pose(), simulation.twist(), simulation.contacts(), simulation.readback()
        return np.hstack([simulation.pose(), simulation.twist()])
    finally:
        simulation.close()


# ---- memory --------------------------------------------------------------------------------------------------------


def memory(engine: Engine) -> str:
    """A thousand worlds that are built, stepped and closed leak no memory."""
    if resident() is None:
        raise NotAsked("this system does not report the memory of a process")
    profile = next(iter(engine.profiles))
    scene = accepted(engine, profile, resting(), resting(box=False))
    posed, given = posed_for(engine, scene), values(engine, profile, scene)

    def build(times: int) -> None:
        for _ in range(times):
            simulation = engine.build(posed, DT, given)
            simulation.advance(1)
            simulation.close()

    build(WARM)
    grown = math.inf
    for _ in range(ROUNDS):
        grown = min(grown, _growth(build))
        if grown <= STEADY:
            break
    return f"{profile}: {BUILDS} worlds leave {grown / BUILDS:.0f} bytes each" if grown > STEADY else ""


def _growth(build: Callable[[int], None]) -> float:
    before = _settled()
    build(BUILDS)
    return float(max(np.subtract(_settled(), before)))


def _settled() -> tuple[float, float]:
    """Resident memory after all free pages are returned, and used bytes of the heap [bytes].

    Memory freed by an earlier check would hide a leak: whole pages are returned, but blocks smaller than a page fill
    gaps without a new page. The heap's own count contains those; memory mapped by an engine itself is visible in the
    pages only.
    """
    gc.collect()
    with contextlib.suppress(AttributeError, OSError, TypeError):  # only GNU's allocator has it
        ctypes.CDLL(None).malloc_trim(0)
    return resident() or 0.0, taken() or 0.0


class _Heap(ctypes.Structure):
    """Statistics of GNU's allocator: ten counts, in this order (mallinfo2, glibc 2.33 and later)."""

    _fields_: ClassVar = [
        (name, ctypes.c_size_t)
        for name in [
            "arena",
            "ordblks",
            "smblks",
            "hblks",
            "hblkhd",
            "usmblks",
            "fsmblks",
            "uordblks",
            "fordblks",
            "keepcost",
        ]
    ]


def taken() -> float | None:
    """Used bytes of the heap, in arenas and in separately mapped blocks; None if the system has no count."""
    try:
        mallinfo = ctypes.CDLL(None).mallinfo2
    except (AttributeError, OSError, TypeError):
        return None
    mallinfo.restype = _Heap
    heap = mallinfo()
    return float(heap.uordblks + heap.hblkhd)


def resident() -> float | None:
    """Resident memory of this process [bytes]; None if the system has no count."""
    try:
        pages = int(Path("/proc/self/statm").read_text().split()[1])
    except (OSError, ValueError, IndexError):
        return None
    return float(pages * os.sysconf("SC_PAGE_SIZE"))
