"""Runs cells on releases, each in its environment and as one run of the store; stored cells do not run again."""

from __future__ import annotations

import json
import os
import queue
import subprocess
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from typing import Any

from adapters import registry
from adapters.engine import EngineError
from adapters.isolation import LOG_LINES
from adapters.plain import lines, one_line
from validation import posed
from validation.cells import Observation, Outcome, Slot, observation_from_dict, slot_from_dict
from validation.identity import adapter_hash, scene_code
from validation.records.store import RELEASE_TITLE, Run, Store
from validation.releases.carried import code
from validation.releases.choosing import Release
from validation.releases.environments import BuildError, Environment, build
from validation.releases.ports import PATIENCE, Compared, compared_from
from validation.releases.timing import kept, timed_cells
from validation.running.plan import Request, slots
from validation.workers import TIMEOUT

#: Seconds beyond a cell's limit after which a silent environment is given up: it must start a worker.
SILENCE = 180.0
#: Outcomes that may differ next time: something missing may be installed, a slow cell may finish. Refusals by an
#: adapter stay; an unsupported release did not run at all, and its run is independent of the code.
ASKED_AGAIN = (Outcome.NOT_INSTALLED, Outcome.TIMED_OUT)
#: Most scenes in the title of a run.
NAMED = 4
Say = Callable[[str], None]


class Unasked(Exception):
    """A release that cannot run at all; the message is the reason of its rows."""


@dataclass(frozen=True)
class Effort:
    """How cells run: workers (0: one per core), seconds per cell, and whether stored results count."""

    jobs: int = 0
    timeout: float = TIMEOUT
    fresh: bool = False
    #: Also run releases that the adapter does not support.
    anyway: bool = False


def planned(releases: Sequence[Release], request: Request, effort: Effort, say: Say) -> list[Slot]:
    """Cells of a request: for the installed engine, else for the newest release that runs.

    All releases run the same cells, so that their rows can be compared.
    """
    engine = releases[-1].engine
    request = replace(request, engines=[engine])
    if registry.find(engine).engine is not None:
        return slots(request)
    for release in reversed(releases):
        with suppress(Unasked, BuildError):
            told = next(_answers(release, effort, request, [], say))["told"]
            return [slot_from_dict(data) for data in told["slots"]]
    return slots(request)


def drive(
    store: Store,
    release: Release,
    wanted: Sequence[Slot],
    effort: Effort,
    say: Say = lambda line: None,
    progress: Callable[[Observation], None] = lambda observation: None,
) -> list[Observation]:
    """Observations of all ``wanted`` cells on one release; cells that the store lacks are run and stored.

    A release that cannot be installed, imported or run has an observation per cell with the reason.

    Raises
    ------
    RegistryError
        If the package registry does not answer during an installation.
    """
    have = {} if effort.fresh else answered(store, release, wanted)
    todo = [slot for slot in wanted if slot not in have]
    if todo:
        named = list(dict.fromkeys(slot.scene for slot in todo))
        scenes = " ".join(named) if len(named) <= NAMED else f"{len(named)} scenes"
        run, _ = store.start(f"{RELEASE_TITLE}{release.name}: {scenes}", todo, fresh=True, apart=release.name)
        found: dict[Slot, Observation] = {}
        try:
            for observation in _asked(store, run, release, todo, effort, say):
                if observation.slot not in todo:  # answered in another case's place
                    continue
                found[observation.slot] = observation
                store.add(run, observation)
                progress(observation)
        except Unasked as why:
            outcome = Outcome.UNSUPPORTED if release.unknown and not effort.anyway else Outcome.NOT_INSTALLED
            for slot in todo:
                if slot not in found:
                    lost = Observation(slot, "", 0, release.version, outcome, one_line(why))
                    found[slot] = lost
                    store.add(run, lost)
                    progress(lost)
        if not store.missing(run):
            store.finish(run)
        have |= found
    return [have[slot] for slot in wanted if slot in have]


def _asked(
    store: Store, run: Run, release: Release, todo: Sequence[Slot], effort: Effort, say: Say
) -> Iterator[Observation]:
    answers = _answers(release, effort, None, todo, say)
    told = next(answers)["told"]
    store.set_protocol(run, _protocol(release, todo, told))
    for answer in answers:
        if "left" in answer:
            slot = slot_from_dict(answer["left"])
            yield Observation(slot, "", 0, release.version, Outcome.TIMED_OUT, one_line(answer["reason"]))
            continue
        yield replace(observation_from_dict(answer), engine_version=release.version)


def _protocol(release: Release, todo: Sequence[Slot], told: dict[str, Any]) -> dict[str, Any]:
    """Conditions of a run on a release; stored results are reused only if they are equal."""
    scenes = dict.fromkeys(slot.scene for slot in todo)
    code_of = {"adapter": adapter_hash(release.engine), "scenes": {scene: scene_code(scene) for scene in scenes}}
    return {"release": {"engine": release.engine, "version": release.version}, "told": told, "code": code_of}


def _answers(
    release: Release,
    effort: Effort,
    request: Request | None,
    todo: Sequence[Slot],
    say: Say,
    timed: Sequence[Slot] = (),
    ported: Sequence[Slot] = (),
    ports: Sequence[str] = (),
) -> Iterator[dict[str, Any]]:
    """Output of a release's environment, line by line: its identity, a result per cell, then laps.

    Raises
    ------
    Unasked
        If the release cannot be installed or imported, or is another one.
    """
    if release.unknown and not effort.anyway:
        raise Unasked(release.unknown)
    try:
        environment = build(release, say)
    except BuildError as error:
        raise Unasked(str(error)) from None
    scenes = list(
        dict.fromkeys([*(slot.scene for slot in (*todo, *timed, *ported)), *(request.scenes if request else ())])
    )
    question = {
        "engine": release.engine,
        "distribution": release.distribution,
        "request": asdict(request) if request else None,
        "slots": [slot.as_dict() for slot in todo],
        "timed": [slot.as_dict() for slot in timed],
        "compared": [slot.as_dict() for slot in ported],
        "ports": list(ports),
        "stated": posed.stated_of(scenes),
        "jobs": effort.jobs,
        "timeout": effort.timeout,
    }
    with_code = code(release.engine, scenes)
    talk = _talk(environment, str(with_code), question, effort.timeout + SILENCE)
    told = next(talk)
    if told["told"]["distribution_version"] != release.version and not _same(told, release):
        held = told["told"]["distribution_version"] or "none"
        raise Unasked(f"its environment holds {release.distribution} {held}")
    if told["told"]["reason"]:
        raise Unasked(f"cannot be imported: {told['told']['reason'].partition('; pip install')[0]}")
    yield told
    yield from talk


def _same(told: dict[str, Any], release: Release) -> bool:
    from packaging.version import InvalidVersion, Version

    try:
        return Version(told["told"]["distribution_version"]) == Version(release.version)
    except InvalidVersion:
        return False


def _talk(environment: Environment, path: str, question: dict[str, Any], patience: float) -> Iterator[dict[str, Any]]:
    """Talk to the process in an environment; it ends with this generator.

    Raises
    ------
    Unasked
        If it ends without its identity, or does not answer.
    """
    kept = {k: v for k, v in os.environ.items() if k not in ("PYTHONHOME", "PYTHONSTARTUP", "VIRTUAL_ENV")}
    # Safe path: the working folder may have packages with our names, such as this checkout.
    own = kept | {"PYTHONPATH": path, "PYTHONSAFEPATH": "1", "PYTHONNOUSERSITE": "1"}
    process = subprocess.Popen(
        [str(environment.python), "-m", "validation.releases.driven"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        env=own,
        start_new_session=True,  # this process handles Ctrl-C; the other one ends when its stdin closes
        text=True,
        encoding="utf-8",
        errors="replace",
    )
    assert process.stdin and process.stdout and process.stderr
    said: queue.Queue[str | None] = queue.Queue()
    written: list[str] = []
    readers = (_reader(process.stdout, said.put), _reader(process.stderr, lambda line: _keep(written, line)))
    first = True
    try:
        with suppress(BrokenPipeError):
            process.stdin.write(json.dumps(question) + "\n")
            process.stdin.flush()
        while True:
            try:
                line = said.get(timeout=patience)
            except queue.Empty:
                raise Unasked(f"its environment has not answered for {patience:g} s") from None
            if line is None:
                break
            yield json.loads(line)
            first = False
        readers[1].join(5.0)
        if process.wait(10.0) or first:
            tail = one_line(lines("".join(written), LOG_LINES).rpartition("\n")[2])
            raise Unasked(f"cannot be run: its process ended with {process.returncode}" + (f": {tail}" if tail else ""))
    except subprocess.TimeoutExpired:
        raise Unasked("cannot be run: its process does not end") from None
    finally:
        with suppress(OSError):
            process.stdin.close()
        try:
            process.wait(10.0)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def _reader(stream: Any, put: Callable[[str | None], None]) -> threading.Thread:
    def read() -> None:
        for line in stream:
            put(line)
        put(None)

    thread = threading.Thread(target=read, daemon=True)
    thread.start()
    return thread


def _keep(written: list[str], line: str | None) -> None:
    if line is not None:
        written.append(line)
        del written[:-200]


def time(
    store: Store, release: Release, wanted: Sequence[Observation], effort: Effort, say: Say = lambda line: None
) -> None:
    """Time a release on cells with a result; timings of the same code in the store are reused."""
    todo = timed_cells(wanted)
    if not todo or (not effort.fresh and set(todo) <= _timed(store, release)):
        return
    run, _ = store.start(f"{RELEASE_TITLE}{release.name}: times", [], fresh=True, apart=release.name)
    try:
        answers = _answers(release, effort, None, [], say, todo)
        store.set_protocol(run, _protocol(release, todo, next(answers)["told"]))
        void = kept(answers, release.version, lambda timings: store.add_timings(run, timings))
    except Unasked as why:
        void = {"": one_line(why)}
    for reason in void.values():
        say(f"{release.name}: not timed: {reason}")
    store.finish(run)


def compare(
    release: Release, ports: Sequence[str], wanted: Sequence[Slot], say: Say = lambda line: None
) -> Iterator[Compared]:
    """Compare cases of an engine with its ports, all in the environment of ``release``.

    Raises
    ------
    EngineError
        If the release cannot be installed or imported.
    """
    switches = [engine.switches for name in ports if (engine := registry.adapter(name))]
    effort = Effort(timeout=PATIENCE * (1 + max(map(len, switches), default=0)))  # each runs a case again
    try:
        answers = _answers(release, effort, None, [], say, ported=wanted, ports=ports)
        next(answers)
        for answer in answers:
            yield compared_from(answer["compared"])
    except Unasked as why:
        raise EngineError(f"ports: {release.name}: {why}") from None


def _timed(store: Store, release: Release) -> set[Slot]:
    """Cells with stored times of a release, taken with the present adapter."""
    found: set[Slot] = set()
    for run in store.release_runs(release.engine, release.version):
        if (store.protocol(run) or {}).get("code", {}).get("adapter") == adapter_hash(release.engine):
            found |= {timing.slot for timing in store.timings(run)}
    return found


def answered(store: Store, release: Release, wanted: Sequence[Slot]) -> dict[Slot, Observation]:
    """Stored observations of these cells on a release, by the present code; the newest ones."""
    asked, found = set(wanted), {}
    adapter = adapter_hash(release.engine)
    for run in store.release_runs(release.engine, release.version):
        made = (store.protocol(run) or {}).get("code", {})
        if made.get("adapter") != adapter:
            continue
        for observation in store.observations(run):
            slot = observation.slot
            same = slot in asked and made["scenes"].get(slot.scene) == scene_code(slot.scene)
            if same and observation.outcome not in ASKED_AGAIN:
                found[slot] = observation
    return found
