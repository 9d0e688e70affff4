"""Which kernels a plan still needs, and how they are compiled: by the first steps of a cell of each scene.

Engines that compile at their first steps store the machine code on disk (`adapters.engine.Engine.kernels`). Which
kernels a cell calls depends on its dimension and profile, and of a loop of events on what touches. They are compiled
once for all cells by `validation.workers`, before these start and outside of time limits. A mark beside the kernels
says that they are there: a run that needs nothing compiled looks for files, and starts no process.
"""

from __future__ import annotations

import contextlib
import hashlib
from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from adapters.engine import Engine
from adapters.registry import find
from adapters.stages import stage
from adapters.stepping import run
from adapters.trajectory import Sampling
from validation.cells import Slot, prepare, settings_of

#: Steps of each cell. A kernel is compiled at its first call with everything that it calls; two more steps are for data
#: that an engine keeps from the step before.
STEPS = 3

#: How files that say that kernels are compiled begin.
MARK = "compiled-"

#: Engine, profile with a user's own settings, and dimension: cells in which these are equal call the same kernels.
Key = tuple[str, str, int]


@dataclass(frozen=True)
class Part:
    """Kernels to compile.

    Parameters
    ----------
    key
        Of the cells that call them.
    slots
        A cell of each scene of the plan.
    mark
        File that says that they are compiled.
    """

    key: Key
    slots: tuple[Slot, ...]
    mark: Path

    def __str__(self) -> str:
        """``reference/classical 2-D``."""
        engine, profile, dimension = self.key
        return f"{engine}/{profile} {dimension}-D"

    def keep(self) -> None:
        """Write the mark; without a writable folder the kernels are not kept either."""
        with contextlib.suppress(OSError):
            self.mark.write_text(f"{self}\n", encoding="utf-8")


def key_of(slot: Slot) -> Key:
    """What determines the kernels of a cell."""
    return slot.engine, slot.profile, slot.dimension


def missing(slots: Iterable[Slot]) -> list[Part]:
    """Kernels of these cells that are not compiled yet, in the order of the profiles: a textbook step before others.

    Of a profile 3-D comes first: it takes longest, and a long part at the end would leave the other workers idle.

    Empty for engines that compile nothing, have nowhere to keep kernels, or are not installed.
    """
    cells: dict[Key, dict[str, Slot]] = defaultdict(dict)
    for slot in slots:
        cells[key_of(slot)].setdefault(slot.scene, slot)
    folders = {name: _folder(name) for name in {name for name, _, _ in cells}}
    profiles = list(dict.fromkeys((name, profile) for name, profile, _ in cells))
    found = []
    for key in sorted(cells, key=lambda key: (profiles.index(key[:2]), -key[2])):
        folder = folders[key[0]]
        if folder is not None:
            mark = folder / f"{MARK}{hashlib.sha256(repr(key).encode()).hexdigest()[:12]}"
            if not mark.is_file():
                found.append(Part(key, tuple(cells[key].values()), mark))
    return found


def _folder(name: str) -> Path | None:
    engine = find(name).engine
    return engine.kernels() if isinstance(engine, Engine) else None


@stage("compiling kernels", whole=True)
def compile_one(slots: Sequence[Slot]) -> bool:
    """Make the first steps of all cells that can make them; whether there is one.

    What goes wrong is reported by the cells themselves.
    """
    made = False
    for slot in slots:
        with contextlib.suppress(Exception):
            first_steps(slot)
            made = True
    return made


def first_steps(slot: Slot) -> None:
    """Run the first `STEPS` steps of a cell and read its contacts: the engine compiles everything there.

    Raises
    ------
    SceneError, EngineError
        If the slot is wrong or the engine refuses it.
    """
    prepared, engine = prepare(slot), find(slot.engine).engine
    if isinstance(engine, Engine):
        values = {setting.name: setting.value for setting in settings_of(engine, slot, prepared.scene)}
        run(engine, replace(prepared.scene, duration=STEPS * slot.dt), slot.dt, values, Sampling(contacts_from=0.0))
